//! `llsr render`: a picture.

use std::path::{Path, PathBuf};

use llsr_epr::{
    StillCounts, StillError, StillLayer, StillSettings, layer_colours, render_still, still_steps,
};
use llsr_io::{Development, Image, Tone, exposure_for, write_exr, write_png};
use llsr_scene::Viewport;
use llsr_shading::{Layer, Rendered, Settings, Statistics, Wasteful, render, tile_count};
use llsr_tracer::Tracer;
use serde_json::{Value, json};

use crate::args::{self, Common, RenderArgs};
use crate::camera;
use crate::clock::{Seconds, Stopwatch};
use crate::failure::Failure;
use crate::load::{load, need_light};
use crate::progress::Progress;
use crate::report;

pub(crate) fn run(args: &RenderArgs, common: &Common, newcomer: bool) -> Result<(), Failure> {
    let format = Format::of(&args.output)?;
    if format == Format::Png && !args.aov.is_empty() && args.reconstruct.is_none() {
        return Err(Failure::Usage(
            "--aov: a .png has no layers; give -o FILE.exr".to_owned(),
        ));
    }
    let watch = Stopwatch::start();
    let loaded = load(&args.scene)?;
    let load_seconds = watch.read();
    need_light(&loaded, &args.scene.scene)?;
    let scene = &loaded.scene;
    let still = args
        .reconstruct
        .map(|how| still_settings(args, common, how, format))
        .transpose()?;
    let settings = match &still {
        Some(still) => still.shading.clone(),
        None => settings(args, common, scene)?,
    };
    let watch = Stopwatch::start();
    let (tracer, dropped) = Tracer::new(scene);
    let build_seconds = watch.read();
    let warnings: Vec<String> = loaded
        .warnings
        .iter()
        .map(ToString::to_string)
        .chain(dropped.iter().map(ToString::to_string))
        .collect();
    let (width, height) = args.scene.size;
    let viewport = Viewport { width, height };
    let (camera, _) = camera::choose(&args.scene, scene, &tracer, viewport)?;
    if !common.quiet {
        report::print_warnings(&warnings, 3, &args.scene.scene);
    }

    let steps = still
        .as_ref()
        .map_or(tile_count(viewport), |still| still_steps(viewport, still.rounds));
    let progress = Progress::new("rendering", steps, common.quiet);
    let step = || progress.step();
    let watch = Stopwatch::start();
    let rendered = match &still {
        Some(still) => render_still(scene, &tracer, &camera, viewport, still, &[], &step)
            .map(|made| (made.film, made.statistics, Some(made.counts)))
            .map_err(|error| match error {
                StillError::Interrupted => Failure::Interrupted,
                error => Failure::Usage(format!("--size: {error}")),
            }),
        None => render(scene, &tracer, &camera, viewport, &settings, &step)
            .map(|Rendered { film, statistics }| (film, statistics, None))
            .map_err(|_| Failure::Interrupted),
    };
    let render_seconds = watch.read();
    progress.finish();
    let (film, statistics, counts) = rendered?;

    let layers = still.iter().flat_map(|still| &still.layers);
    let shown: Vec<(PathBuf, Image)> = layers
        .filter_map(|&layer| {
            let colours = layer_colours(&film, layer)?;
            let image = Image::from_rgb(width as usize, height as usize, &colours);
            Some((beside(&args.output, layer), image))
        })
        .collect();
    let picture = Image {
        width: width as usize,
        height: height as usize,
        channels: film.channels,
    };
    let exposure = match format {
        Format::Png => {
            let automatic = || exposure_for(&picture.rgb().unwrap_or_default());
            let exposure = args.exposure.unwrap_or_else(automatic);
            let tone = match args.tone {
                args::Tone::Srgb => Tone::Srgb,
                args::Tone::Filmic => Tone::Filmic,
            };
            write_png(&args.output, &picture, Development { exposure, tone })?;
            for (path, shown) in &shown {
                write_png(path, shown, Development::default())?;
            }
            Some(exposure)
        }
        Format::Exr => {
            write_exr(&args.output, &picture)?;
            None
        }
    };
    let seconds = [
        ("load", load_seconds),
        ("build", build_seconds),
        ("render", render_seconds),
    ];
    if let Some(path) = &common.report {
        let mut value = statistics_json(&statistics);
        let object = value.as_object_mut().expect("the statistics are an object");
        object.insert("scene".to_owned(), json!(args.scene.scene));
        object.insert("triangles".to_owned(), json!(scene.triangle_count()));
        object.insert("primitives".to_owned(), json!(scene.primitive_count()));
        object.insert("lights".to_owned(), json!(scene.lights.len()));
        object.insert("unit".to_owned(), json!(scene.unit.irradiance_symbol()));
        object.insert("size".to_owned(), json!([width, height]));
        object.insert("method".to_owned(), json!(settings.method.name()));
        object.insert("epsilon".to_owned(), json!(settings.epsilon));
        object.insert("nu".to_owned(), json!(settings.nu));
        object.insert("samples".to_owned(), json!(settings.samples));
        object.insert("spp".to_owned(), json!(settings.spp));
        object.insert("seed".to_owned(), json!(settings.seed));
        object.insert("threads".to_owned(), json!(rayon::current_num_threads()));
        object.insert("exposure".to_owned(), json!(exposure));
        object.insert("seconds".to_owned(), seconds_json(&seconds, |s| s.wall));
        object.insert("cpu_seconds".to_owned(), seconds_json(&seconds, |s| s.cpu));
        if let (Some(still), Some(counts)) = (&still, &counts) {
            object.insert("reconstruct".to_owned(), still_json(still, counts));
        }
        object.insert("warnings".to_owned(), json!(warnings));
        report::write_json(path, &value)?;
    }
    if !common.quiet {
        let name = args.scene.scene.as_str();
        println!(
            "{name}: {}, {}, {}",
            count(scene.triangle_count(), "triangle"),
            count(scene.primitive_count(), "primitive"),
            count(scene.lights.len(), "light")
        );
        println!(
            "{width}x{height}, method {}: {:.2} s (load {:.2} s, build {:.2} s, {})",
            settings.method,
            render_seconds.wall,
            load_seconds.wall,
            build_seconds.wall,
            count(rayon::current_num_threads(), "thread")
        );
        print_statistics(&statistics);
        if let Some(counts) = &counts {
            print_still(counts);
        }
        println!("wrote {}", args.output.display());
        if format == Format::Png {
            shown
                .iter()
                .for_each(|(path, _)| println!("wrote {}", path.display()));
        }
        if newcomer {
            println!(
                "\nTry next:\n  \
                 llsr render room.glb -o room.exr --tube MATERIAL=3000lm    your own room, in lux\n  \
                 llsr render demo:cylinder-2 -m tdf                         another scene, the method of 1999\n  \
                 llsr demo                                                  the built-in scenes\n  \
                 llsr --help                                                everything else"
            );
        }
    }
    Ok(())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Exr,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Failure::Usage(format!(
                "-o {}: the name of a picture ends in .png or .exr",
                path.display()
            ))),
        }
    }
}

/// Where the picture of a layer goes that is drawn beside `output`.
fn beside(output: &Path, layer: StillLayer) -> PathBuf {
    let name = StillLayer::ALL
        .iter()
        .find(|known| known.1 == layer)
        .map_or("", |known| known.0);
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!("{stem}-{name}.png"))
}

/// Settings of `--reconstruct`.
fn still_settings(
    args: &RenderArgs,
    common: &Common,
    how: args::Reconstruct,
    format: Format,
) -> Result<StillSettings, Failure> {
    let mut layers = Vec::new();
    for name in &args.aov {
        let layer = StillLayer::parse(name.trim()).ok_or_else(|| {
            let known: Vec<_> = StillLayer::ALL.iter().map(|known| known.0).collect();
            Failure::Usage(format!(
                "--aov {name}: with --reconstruct there is no such layer; there are {}",
                known.join(", ")
            ))
        })?;
        let is_shown = matches!(layer, StillLayer::Edges | StillLayer::Reach | StillLayer::Samples);
        if format == Format::Png && !is_shown {
            return Err(Failure::Usage(format!(
                "--aov {name}: a .png has no layers, and only edges, reach and samples are drawn beside it; give -o FILE.exr"
            )));
        }
        if !layers.contains(&layer) {
            layers.push(layer);
        }
    }
    Ok(StillSettings {
        density: args.density,
        rounds: args.rounds,
        edges: how == args::Reconstruct::Epi,
        shading: shading_settings(args, common, Vec::new()),
        layers,
        ..StillSettings::default()
    })
}

fn still_json(still: &StillSettings, counts: &StillCounts) -> Value {
    json!({
        "density": still.density,
        "rounds": still.rounds,
        "edge_segments": counts.segments,
        "shadow_segments": counts.shadow_segments,
        "unimportant_shadow_edges": counts.shadow_edges_dropped,
        "unimportant_contrast": report::contrast_json(&counts.dropped_contrast),
        "pixels": { "empty": counts.empty, "simple": counts.simple, "complex": counts.complex },
        "shaded": counts.rounds,
        "regions_missed": counts.regions_missed,
        "complex_shaded": counts.complex_shaded,
        "detailed": counts.detailed,
    })
}

fn print_still(counts: &StillCounts) {
    report::print_contrast(counts.shadow_edges_dropped, &counts.dropped_contrast);
    let pixels = (counts.empty + counts.simple + counts.complex) as u64;
    let percent = |part: usize| 100.0 * share(part as u64, pixels);
    println!(
        "shaded {:.1}% of the pixels; {:.1}% have one edge, {:.1}% are complex ({} points shaded there)",
        percent(counts.rounds.iter().sum()),
        percent(counts.simple),
        percent(counts.complex),
        counts.complex_shaded
    );
}

fn settings(args: &RenderArgs, common: &Common, scene: &llsr_scene::Scene) -> Result<Settings, Failure> {
    let mut layers = Vec::new();
    for name in &args.aov {
        let parsed = Layer::parse(name.trim(), scene).ok_or_else(|| {
            let lights: Vec<_> = scene.lights.iter().map(|light| light.name()).collect();
            Failure::Usage(format!(
                "--aov {name}: there is no such layer; there are irradiance, irradiance:LIGHT, irradiance:*, \
                 discontinuities, tests, certificate, albedo, normal and depth, and the lights {}",
                report::shortened(&lights, 8)
            ))
        })?;
        for layer in parsed {
            if !layers.contains(&layer) {
                layers.push(layer);
            }
        }
    }
    Ok(shading_settings(args, common, layers))
}

fn shading_settings(args: &RenderArgs, common: &Common, layers: Vec<Layer>) -> Settings {
    Settings {
        method: args.method,
        epsilon: args.epsilon,
        nu: args.nu,
        samples: args.samples,
        spp: args.spp,
        share: !args.no_skip.contains(&args::Skip::Share),
        wasteful: wasteful(args),
        light_lines: args.light_lines,
        glossy: args.shader == args::Shader::Glossy,
        refine: args.refine.is_some(),
        seed: common.seed,
        layers,
        ..Settings::default()
    }
}

fn wasteful(args: &RenderArgs) -> Wasteful {
    let asked = |kind| args.no_skip.contains(&kind);
    Wasteful {
        horizon: asked(args::Skip::Horizon),
        clip: asked(args::Skip::Clip),
        prune: asked(args::Skip::Prune),
        power: asked(args::Skip::Power),
        tiles: asked(args::Skip::Tiles),
        boxes: asked(args::Skip::Boxes),
    }
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

fn count(n: usize, what: &str) -> String {
    if n == 1 {
        format!("1 {what}")
    } else {
        format!("{n} {what}s")
    }
}

fn seconds_json(parts: &[(&str, Seconds)], pick: impl Fn(&Seconds) -> f64) -> Value {
    Value::Object(
        parts
            .iter()
            .map(|(name, seconds)| ((*name).to_owned(), json!(pick(seconds))))
            .collect(),
    )
}

/// The statistics under the names that reports use.
pub(crate) fn statistics_json(statistics: &Statistics) -> Value {
    let pairs = statistics.pairs();
    let histogram = &statistics.discontinuities;
    let used = histogram.iter().rposition(|&n| n > 0).map_or(0, |last| last + 1);
    json!({
        "rays": { "primary": statistics.primary_rays, "visibility": statistics.visibility_tests },
        "tests_per_pixel_light": share(statistics.visibility_tests, pairs),
        "tests_per_pixel_light_inner":
            share(statistics.visibility_tests - statistics.end_tests, pairs),
        "share": {
            "lit": share(statistics.lit, pairs),
            "penumbra": share(statistics.penumbra, pairs),
            "umbra": share(statistics.umbra, pairs),
        },
        "hits": statistics.hits,
        "refined_pixels": statistics.refined,
        "fans": {
            "queries": statistics.fans.queries,
            "over_budget": statistics.fans.over_budget,
            "polished": statistics.fans.polished,
            "visits": statistics.fans.visits,
            "in_shaft": statistics.fans.in_shaft,
        },
        "blocks": {
            "tested": statistics.blocks.tested(),
            "clear": statistics.blocks.clear,
            "hidden": statistics.blocks.hidden,
            "among": statistics.blocks.among,
            "unknown": statistics.blocks.unknown,
        },
        "discontinuity_histogram": histogram[..used],
        "skipped": {
            "below_horizon": statistics.skipped.below_horizon,
            "no_power": statistics.skipped.no_power,
            "horizon_clipped": statistics.skipped.horizon_clipped,
            "clear_blocks": statistics.skipped.clear_blocks,
            "hidden_blocks": statistics.skipped.hidden_blocks,
            "empty_fans": statistics.fans.empty,
            "pruned_subtrees": statistics.fans.pruned_blocked,
        },
    })
}

fn print_statistics(statistics: &Statistics) {
    let pairs = statistics.pairs();
    let percent = |part| 100.0 * share(part, pairs);
    println!(
        "lit {:.1}%, penumbra {:.1}%, umbra {:.1}% of the pixels and lights; {:.2} visibility tests each",
        percent(statistics.lit),
        percent(statistics.penumbra),
        percent(statistics.umbra),
        share(statistics.visibility_tests, pairs)
    );
}
