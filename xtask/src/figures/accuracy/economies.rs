//! What refinement, shared subsamples and work left out are worth.

use std::fmt::Write as _;
use std::path::Path;

use super::program::{Shot, channel, number, rel_rmse, render};

/// `--refine variance` beside the methods that it stands between.
pub(super) fn refinement(scenes: &[&str]) -> Result<String, String> {
    let mut text = String::from(
        "\n## Refinement where the irradiance varies\n\n\
         `--refine variance` renders pixels again, with each light in quarters, around which the irradiance varies much: the remedy \
         that section 6 of the 1999 paper suggests for more than two changes. At 256x256, epsilon 0.05, nu 0.25; relative RMSE of the irradiance in \
         the whole picture and in penumbrae.\n\n\
         | scene | method | error | in penumbrae | tests a pixel and light | pixels rendered again | CPU s |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for name in scenes {
        let scene = format!("demo:{name}");
        let truth = render(256, &[&scene, "-m", "exact"])?;
        let changes = channel(&truth.picture, "discontinuities.Y")?;
        let mut row = |shown: &str, shot: &Shot| -> Result<(), String> {
            let refined = number(&shot.report, "/refined_pixels")?;
            let _ = writeln!(
                text,
                "| `{name}` | {shown} | {:.1e} | {:.1e} | {:.2} | {:.1}% | {:.3} |",
                rel_rmse(&shot.picture, &truth.picture, |_| true)?,
                rel_rmse(&shot.picture, &truth.picture, |i| changes[i] > 0.0)?,
                number(&shot.report, "/tests_per_pixel_light")?,
                100.0 * refined / changes.len() as f64,
                shot.seconds
            );
            Ok(())
        };
        row("tdf", &render(256, &[&scene, "-m", "tdf"])?)?;
        row(
            "tdf, refined",
            &render(256, &[&scene, "-m", "tdf", "--refine", "variance"])?,
        )?;
        row("finder", &render(256, &[&scene, "-m", "finder"])?)?;
        row("exact", &truth)?;
    }
    Ok(text)
}

/// Sixteen subsamples that share what they know of the lights, beside sixteen that do not, against 256 that do not.
pub(super) fn antialiasing() -> Result<String, String> {
    let scene = "demo:subway";
    let (small, large) = (128, 512);
    // Another seed, so that no subsample is in both pictures.
    let truth = render(
        small,
        &[scene, "--spp", "256", "--no-skip", "share", "--seed", "1"],
    )?;
    let mut text = String::from(
        "\n## Subsamples that share partitions, `demo:subway`\n\n\
         Relative RMSE of the irradiance at 128x128 against 256 subsamples a pixel that share nothing; CPU seconds at 512x512.\n\n\
         | subsamples | error | CPU s | added to one subsample |\n|---|---|---|---|\n",
    );
    let one = render(large, &[scene])?.seconds;
    let mut row = |count: &str, shared: bool| -> Result<(), String> {
        let mut arguments = vec![scene, "--spp", count];
        if !shared {
            arguments.extend(["--no-skip", "share"]);
        }
        let seconds = render(large, &arguments)?.seconds;
        let _ = writeln!(
            text,
            "| {count}, {} | {:.2e} | {seconds:.2} | {:.2} |",
            if shared { "shared" } else { "each on its own" },
            rel_rmse(&render(small, &arguments)?.picture, &truth.picture, |_| true)?,
            seconds - one
        );
        Ok(())
    };
    row("1", false)?;
    for count in ["4", "16"] {
        row(count, true)?;
        row(count, false)?;
    }
    Ok(text)
}

/// Shares of work left out by kind, and the run time with each kind done after all.
pub(super) fn skips(data: Option<&Path>) -> Result<String, String> {
    let mut scenes: Vec<(&str, Vec<String>)> =
        ["wall", "cylinder-2", "cylinder-0.4", "subway", "rooms", "bars"]
            .map(|name| (name, vec![format!("demo:{name}")]))
            .into();
    if let Some(data) = data {
        let file = data.join("classroom.glb").display().to_string();
        scenes.push((
            "classroom, 20 tubes",
            [&file, "--tube", "FluorescentTube=3000lm"]
                .map(str::to_owned)
                .into(),
        ));
    }
    let mut shares = String::from(
        "\n## Work left out\n\n\
         At 256x256: shares of the pairs of pixel and light, and of the pairs of block (8x8 pixels) and light: lights below the horizon or cut by \
         it, pairs in blocks that are proved to be lit or dark, fans that meet nothing, and fans that ask only the few things that lie \
         between their block and the light.\n\n\
         | scene | below the horizon | cut there | block lit | block dark | fan empty | fan among few | blocks looked at | lit | dark | few things | many \
         |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut times = String::from(
        "\nCPU seconds if one kind of work is done after all (`--no-skip KIND`): lights below the horizon, cuts at it, subtrees that \
         hide nothing new, blocks, and boxes that a fan misses (each fan then asks about the whole scene; small scenes only). Lights \
         without power do not occur here: `power`.\n\n\
         | scene | all left out | horizon | clip | prune | tiles | boxes |\n|---|---|---|---|---|---|---|\n",
    );
    for (name, arguments) in &scenes {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let plain = render(256, &arguments)?;
        let count = |pointer: &str| number(&plain.report, pointer);
        let pairs = count("/hits")? * count("/lights")?;
        let blocks = count("/blocks/tested")?;
        let percent = |pointer: &str, whole: f64| -> Result<String, String> {
            Ok(format!("{:.1}%", 100.0 * count(pointer)? / whole))
        };
        let _ = write!(shares, "| `{name}` |");
        for kind in [
            "below_horizon",
            "horizon_clipped",
            "clear_blocks",
            "hidden_blocks",
            "empty_fans",
        ] {
            let _ = write!(shares, " {} |", percent(&format!("/skipped/{kind}"), pairs)?);
        }
        let _ = write!(shares, " {} | {blocks} |", percent("/fans/in_shaft", pairs)?);
        for kind in ["clear", "hidden", "among", "unknown"] {
            let _ = write!(shares, " {} |", percent(&format!("/blocks/{kind}"), blocks)?);
        }
        shares.push('\n');
        let _ = write!(times, "| `{name}` | {:.3} |", plain.seconds);
        for kind in ["horizon", "clip", "prune", "tiles", "boxes"] {
            let triangles = count("/triangles")?;
            if kind == "boxes" && triangles > 3000.0 {
                times.push_str(" - |");
                continue;
            }
            let wasteful = [arguments.as_slice(), &["--no-skip", kind]].concat();
            let _ = write!(times, " {:.3} |", render(256, &wasteful)?.seconds);
        }
        times.push('\n');
    }
    Ok(shares + &times)
}
