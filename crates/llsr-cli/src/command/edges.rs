//! `llsr edges`: a line drawing.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use llsr_edges::{
    EdgeClass, Eye, FoundEdges, Part, SceneEdgeOptions, SceneEdges, SceneFound, SceneScratch, SceneView,
    Sight, Stroke, clip_to_picture, join, split_hidden,
};
use llsr_epr::dropped_contrast;
use llsr_io::{Development, Image, Tone, exposure_for, write_png};
use llsr_scene::{Camera, ObjectId, Scene, Viewport, srgb_to_linear};
use llsr_shading::{Settings, render, tile_count};
use llsr_tracer::Tracer;
use serde_json::{Value, json};

use crate::args::{Common, DrawingFormat, EdgesArgs};
use crate::camera;
use crate::clock::Stopwatch;
use crate::drawing::{DrawnLine, Layer, Shadows, UNIMPORTANT, flatten, obj, overlay, svg};
use crate::failure::Failure;
use crate::load::load;
use crate::progress::Progress;
use crate::report;

pub(crate) fn run(args: &EdgesArgs, common: &Common) -> Result<(), Failure> {
    let (output, format) = output(args)?;
    let whole = Stopwatch::start();
    let loaded = load(&args.scene)?;
    let load_ms = 1e3 * whole.read().wall;
    let scene = &loaded.scene;
    let (width, height) = args.scene.size;
    let viewport = Viewport { width, height };

    let options = SceneEdgeOptions::with_crease_degrees(args.crease);
    let watch = Stopwatch::start();
    let build_edges = || {
        let watch = Stopwatch::start();
        (SceneEdges::new(scene, &options), 1e3 * watch.read().wall)
    };
    let ((edges, build_ms), (tracer, dropped)) = if rayon::current_num_threads() == 1 {
        (build_edges(), Tracer::new(scene))
    } else {
        // Not by `rayon::join`: while the edges wait for one of their parts, their thread would take on the tracer whole.
        std::thread::scope(|threads| {
            let tracer = threads.spawn(|| Tracer::new(scene));
            let edges = build_edges();
            match tracer.join() {
                Ok(tracer) => (edges, tracer),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    };
    let trees_ms = 1e3 * watch.read().wall;
    let (camera, source) = camera::choose(&args.scene, scene, &tracer, viewport)?;
    let mut warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    warnings.extend(dropped.iter().map(ToString::to_string));
    let of_edges: Vec<String> = edges.warnings().iter().map(ToString::to_string).collect();
    if !common.quiet {
        report::print_warnings(&warnings, 3, &args.scene.scene);
        for warning in of_edges.iter().take(3) {
            eprintln!("warning: {warning}");
        }
        if of_edges.len() > 3 {
            eprintln!(
                "warning: {} more of this kind; --report FILE lists them",
                of_edges.len() - 3
            );
        }
    }
    warnings.extend(of_edges);

    let found = find(&edges, &camera, viewport);
    let silhouette_ms = silhouette_ms(&edges, Eye::of(&camera));
    let objects = scene.objects.len();
    let mut counts = [0usize; 6];
    for class in EdgeClass::ALL {
        counts[Layer::from(class).index()] += found.count(class);
    }
    let diagonal = f64::from(scene.bounds().diagonal()).max(f64::MIN_POSITIVE);
    // Lines in space are those of the whole scene, others those of the picture.
    let near = 1e-6 * diagonal;
    let stroke = |layer: Layer, object: ObjectId, segment: [Vec3; 2]| {
        let ends = segment.map(Vec3::as_dvec3);
        let ends = match format {
            DrawingFormat::Obj => Some(ends),
            _ => clip_to_picture(&camera, viewport, near, ends),
        }?;
        let group = (layer.index() * objects + object.index()) as u32;
        Some(Stroke { group, ends })
    };
    let mut strokes: Vec<Stroke> = found
        .iter()
        .filter_map(|edge| stroke(edge.class.into(), edge.object, edge.segment))
        .collect();
    let first_shadow = strokes.len();
    let shadows = Shadows::of(scene, &tracer, &edges, &options, common.quiet)?;
    let unmarked = dropped_contrast(
        scene,
        &tracer,
        &Settings::default(),
        &shadows.dropped_sample,
        UNIMPORTANT,
    );
    for (count, of_shadows) in counts.iter_mut().zip(shadows.counts) {
        *count += of_shadows;
    }
    for &(layer, receiver, segment) in &shadows.edges {
        strokes.extend(stroke(layer, receiver, segment));
    }

    let watch = Stopwatch::start();
    let eye = Eye::of(&camera);
    let (of_edges, of_shadows) = strokes.split_at(first_shadow);
    let mut parts = split_hidden(of_edges, &Sight::of_edges(eye, diagonal), &tracer);
    let below = split_hidden(of_shadows, &Sight::of_lines_on_surfaces(eye, diagonal), &tracer);
    parts.extend(below.into_iter().map(|part| Part {
        stroke: part.stroke + first_shadow as u32,
        ..part
    }));
    let hidden_ms = 1e3 * watch.read().wall;
    let length = |part: &Part| {
        let stroke = &strokes[part.stroke as usize];
        stroke.at(part.t[0]).distance(stroke.at(part.t[1]))
    };
    let all: f64 = parts.iter().map(length).sum();
    let hidden: f64 = parts.iter().filter(|part| part.hidden).map(length).sum();
    parts.retain(|part| args.hidden || !part.hidden);
    let watch = Stopwatch::start();
    let picture_plane = |p: DVec3| {
        let seen = camera.project(viewport, p);
        seen.map_or(p, |(x, y, _)| DVec3::new(x, y, 0.0))
    };
    let lines: Vec<DrawnLine> = join(&strokes, &parts, picture_plane)
        .into_iter()
        .map(|line| DrawnLine::new(line, objects))
        .collect();
    let join_ms = 1e3 * watch.read().wall;

    let watch = Stopwatch::start();
    let title = format!("{}, lines seen from {}", args.scene.scene, place(&camera, scene));
    let drawn = match format {
        DrawingFormat::Svg => {
            let flat = flatten(&lines, &camera, viewport);
            llsr_io::write_file(&output, svg(&flat, viewport, &title).as_bytes())?;
            flat.len()
        }
        DrawingFormat::Obj => {
            llsr_io::write_file(&output, obj(&lines, scene.origin, &title).as_bytes())?;
            lines.len()
        }
        DrawingFormat::Png => {
            let flat = flatten(&lines, &camera, viewport);
            let mut pixels = backdrop(scene, &tracer, &camera, viewport, common)?;
            overlay(&mut pixels, &flat, viewport);
            let picture = Image::from_rgb(width as usize, height as usize, &pixels);
            let development = Development {
                exposure: 0.0,
                tone: Tone::Srgb,
            };
            write_png(&output, &picture, development)?;
            flat.len()
        }
    };
    let write_ms = 1e3 * watch.read().wall;
    let total = whole.read();

    if let Some(path) = &common.report {
        let named = |values: &[usize; 6]| -> Value {
            let pairs = Layer::ALL.map(|layer| (layer.name().to_owned(), json!(values[layer.index()])));
            Value::Object(pairs.into_iter().collect())
        };
        let value = json!({
            "scene": args.scene.scene,
            "triangles": scene.triangle_count(),
            "primitives": scene.primitive_count(),
            "lights": scene.lights.len(),
            "size": [width, height],
            "crease_degrees": args.crease,
            "counts": named(&counts),
            "lines": drawn,
            "unimportant_shadow_edges": shadows.dropped,
            "unimportant_contrast": report::contrast_json(&unmarked),
            "specks_left_out": lines.len() - drawn,
            "hidden_share_of_length": if all > 0.0 { hidden / all } else { 0.0 },
            "threads": rayon::current_num_threads(),
            "ms": {
                "load": load_ms,
                "build": build_ms,
                "build_and_tracer": trees_ms,
                "silhouette": silhouette_ms,
                "shadow": shadows.milliseconds,
                "hidden": hidden_ms,
                "join": join_ms,
                "write": write_ms,
                "total": 1e3 * total.wall,
            },
            "cpu_seconds": total.cpu,
            "warnings": warnings,
        });
        report::write_json(path, &value)?;
    }
    if !common.quiet {
        println!(
            "{}: {} triangles, {} primitives; camera {}",
            args.scene.scene,
            scene.triangle_count(),
            scene.primitive_count(),
            source.sentence()
        );
        let named: Vec<String> = Layer::ALL
            .iter()
            .rev()
            .filter(|layer| counts[layer.index()] > 0)
            .map(|layer| format!("{} {}", counts[layer.index()], layer.name()))
            .collect();
        match named.as_slice() {
            [] => println!("no edges are seen from there"),
            named => println!(
                "edges: {}; silhouettes found in {silhouette_ms:.2} ms",
                named.join(", ")
            ),
        }
        report::print_contrast(shadows.dropped, &unmarked);
        if all > 0.0 {
            let fate = if args.hidden { "dashed" } else { "removed" };
            println!(
                "{:.0}% of their length in the picture is hidden and {fate}; {drawn} lines drawn",
                100.0 * hidden / all
            );
        }
        println!(
            "{:.2} s (load {:.2}, edges and tracer {:.2}, shadows {:.2}, hidden parts {:.2}, write {:.2})",
            total.wall,
            load_ms / 1e3,
            trees_ms / 1e3,
            shadows.milliseconds / 1e3,
            hidden_ms / 1e3,
            write_ms / 1e3
        );
        println!("wrote {}", output.display());
    }
    Ok(())
}

/// The file and its format: what `--format` says, else what the name of the file ends in.
fn output(args: &EdgesArgs) -> Result<(PathBuf, DrawingFormat), Failure> {
    let ending = |path: &Path| {
        let ending = path.extension().and_then(|e| e.to_str())?;
        match ending.to_ascii_lowercase().as_str() {
            "svg" => Some(DrawingFormat::Svg),
            "obj" => Some(DrawingFormat::Obj),
            "png" => Some(DrawingFormat::Png),
            _ => None,
        }
    };
    let Some(path) = &args.output else {
        let format = args.format.unwrap_or(DrawingFormat::Svg);
        let name = match format {
            DrawingFormat::Svg => "edges.svg",
            DrawingFormat::Obj => "edges.obj",
            DrawingFormat::Png => "edges.png",
        };
        return Ok((name.into(), format));
    };
    match args.format.or_else(|| ending(path)) {
        Some(format) => Ok((path.clone(), format)),
        None => Err(Failure::Usage(format!(
            "-o {}: the name of a drawing ends in .svg, .obj or .png; --format says it for other names",
            path.display()
        ))),
    }
}

/// The edges of all objects, those outside the picture included.
fn find(edges: &SceneEdges, camera: &Camera, viewport: Viewport) -> SceneFound {
    let (mut scratch, mut found) = (SceneScratch::default(), SceneFound::default());
    let view = SceneView::Picture { camera, viewport };
    for object in (0..edges.objects()).map(ObjectId::from) {
        edges.find_object(view, object, &mut scratch, &mut found);
    }
    found
}

/// Milliseconds that one thread takes for the silhouettes of all meshes: the median of 9 after a warm-up.
fn silhouette_ms(edges: &SceneEdges, eye: Eye) -> f64 {
    let mut scratch = Default::default();
    let mut found = FoundEdges::default();
    let mut once = || {
        let watch = std::time::Instant::now();
        for object in (0..edges.objects()).map(ObjectId::from) {
            let (mesh, viewer) = (edges.mesh_of(object), edges.viewpoint(object, eye));
            if let (Some(mesh), Some(viewer)) = (mesh, viewer) {
                found.clear();
                mesh.silhouettes(&viewer, &mut scratch, &mut found.silhouettes);
            }
        }
        1e3 * watch.elapsed().as_secs_f64()
    };
    once();
    let mut times: Vec<f64> = (0..9).map(|_| once()).collect();
    times.sort_unstable_by(f64::total_cmp);
    times[4]
}

fn place(camera: &Camera, scene: &Scene) -> String {
    let p = camera.position + scene.origin;
    format!("({:.3}, {:.3}, {:.3})", p.x, p.y, p.z)
}

/// A pale picture to draw on, in linear colours for display: lit by the scene's lights, or by one at the camera.
fn backdrop(
    scene: &Scene,
    tracer: &Tracer,
    camera: &Camera,
    viewport: Viewport,
    common: &Common,
) -> Result<Vec<Vec3>, Failure> {
    let pale = |display: Vec3| display.lerp(Vec3::ONE, 0.45).map(srgb_to_linear);
    if scene.lights.is_empty() {
        let steps = u64::from(viewport.height);
        let progress = Progress::new("looking", steps, common.quiet);
        let mut pixels = Vec::with_capacity(viewport.pixels());
        for y in 0..viewport.height {
            for x in 0..viewport.width {
                let (origin, direction) = camera.ray(viewport, f64::from(x) + 0.5, f64::from(y) + 0.5);
                let hit = tracer.closest(origin, direction, f64::INFINITY);
                pixels.push(hit.map_or(Vec3::ONE, |hit| {
                    let facing = hit.normal.dot(direction).abs() as f32;
                    pale(Vec3::splat(0.25 + 0.6 * facing))
                }));
            }
            if !progress.step() {
                return Err(Failure::Interrupted);
            }
        }
        progress.finish();
        return Ok(pixels);
    }
    let progress = Progress::new("rendering", tile_count(viewport), common.quiet);
    let settings = Settings {
        seed: common.seed,
        ..Settings::default()
    };
    let rendered = render(scene, tracer, camera, viewport, &settings, &|| progress.step())
        .map_err(|_| Failure::Interrupted)?;
    progress.finish();
    let pixels: Vec<Vec3> = rendered.film.pixels().map(Vec3::from).collect();
    let gain = exposure_for(&pixels).exp2() as f32;
    Ok(pixels
        .iter()
        .map(|&p| pale(Tone::Filmic.encode(p * gain)))
        .collect())
}
