//! Tables 1 to 3 and figures 7 and 9 to 13 of Bala, Walter & Greenberg 2003.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use crate::run::{cargo, root, run as run_command};

/// A scene of the paper's tables, and what stands for it here.
struct Case {
    /// What it is called on the command line.
    name: &'static str,
    /// Name in the paper, and what we show.
    paper: &'static str,
    ours: &'static str,
    /// Arguments of `llsr walk`; `@` stands for the folder of data.
    scene: &'static [&'static str],
    shader: &'static str,
    samples: &'static str,
    /// Pixels along each side.
    size: u32,
    /// Frames of the walk.
    frames: &'static str,
    /// The paper's numbers: polygons, edges; the stages and total of table 2 (ms), frames/s, sparseness ratio, seconds of the
    /// ray tracer, speed-up; silhouette and shadow edges and shares of pixels of table 3.
    table1: [&'static str; 2],
    table2: [&'static str; 12],
    table3: [&'static str; 5],
}

const CASES: [Case; 5] = [
    Case {
        name: "rooms",
        paper: "Rooms",
        ours: "demo:rooms",
        scene: &["demo:rooms"],
        shader: "gi",
        samples: "2621",
        size: 512,
        frames: "120",
        table1: ["15,006", "23,004"],
        table2: [
            "0.5", "17", "26", "11", "14", "2", "17", "95", "10.5", "97", "4.8", "51",
        ],
        table3: ["1,814", "7,356", "87.0", "8.9", "4.1"],
    },
    Case {
        name: "chains",
        paper: "Chains",
        ours: "demo:chains",
        scene: &["demo:chains"],
        shader: "direct",
        samples: "5243",
        size: 512,
        frames: "120",
        table1: ["73,728", "110,592"],
        table2: [
            "4", "13", "26", "11", "14", "2", "6", "88", "11.4", "52", "2.0", "23",
        ],
        table3: ["3,644", "14,138", "92.0", "6.9", "1.1"],
    },
    Case {
        name: "classroom",
        paper: "Mack",
        ours: "classroom, 256 x 256",
        scene: &["@/classroom.glb", "--tube", "FluorescentTube=3000lm"],
        shader: "gi",
        samples: "655",
        size: 256,
        frames: "60",
        table1: ["101,306", "153,526"],
        table2: [
            "2.5", "11", "26", "11", "14", "2", "6", "77", "13.0", "92", "4.5", "58",
        ],
        table3: ["3,669", "27,917", "89.1", "9.7", "1.2"],
    },
    Case {
        name: "igea",
        paper: "David",
        ours: "igea",
        scene: &[
            "@/igea.glb",
            "--line-light",
            "-0.5,1.5,1.5:0.5,1.5,1.5=3000lm",
            "--path",
            "!igea",
        ],
        shader: "glossy",
        samples: "2621",
        size: 512,
        frames: "120",
        table1: ["250,014", "374,635"],
        table2: [
            "9", "39", "27", "11", "14", "2", "16", "127", "7.9", "65", "5.1", "40",
        ],
        table3: ["39,116", "163,338", "92.5", "3.5", "4.0"],
    },
    Case {
        name: "dragon",
        paper: "Dragon",
        ours: "dragon with grid",
        scene: &[
            "@/dragon_vrip.glb",
            "--line-light",
            "-0.05,0.6,0.1:0.05,0.6,0.1=300lm",
            "--add-grid",
            "--path",
            "!dragon",
        ],
        shader: "direct",
        samples: "5243",
        size: 512,
        frames: "120",
        table1: ["872,184", "1,305,164"],
        table2: [
            "22", "29", "26", "11", "14", "2", "6", "124", "8.1", "40", "2.3", "19",
        ],
        table3: ["26,269", "92,884", "92.9", "5.9", "1.2"],
    },
];

/// The light of figure 9: from the place of contact its ends are seen 12 and 16 degrees above the surfaces. It is that of the test
/// `umbral_and_penumbral_edges_meet_where_a_torus_touches_a_capsule`.
const GRAZING: &str = "-1.203,3.196,-1.585:1.272,3.381,-1.470=9000lm";

/// Figures that are pictures of a walk: name, arguments, pictures to keep.
const FIGURES: [(&str, &[&str], &[&str]); 7] = [
    ("fig7-chains", &["demo:chains"], &["frame", "edges"]),
    (
        "fig9-torus-capsule",
        &[
            "!torus-capsule.gltf",
            "--line-light",
            GRAZING,
            "--samples-per-frame",
            "4000",
            "--path",
            "!contact",
        ],
        &["frame", "edges"],
    ),
    (
        "fig10-tea-stand",
        &["demo:tea-stand", "--reference", "--samples-per-frame", "4000"],
        &["frame", "edges", "raytrace"],
    ),
    (
        "fig11-interpolation",
        &["demo:rooms", "--reference"],
        &["frame", "blind"],
    ),
    ("fig12-rooms", &["demo:rooms", "--shader", "gi"], &["frame"]),
    (
        "fig12-igea",
        &[
            "@/igea.glb",
            "--line-light",
            "-0.5,1.5,1.5:0.5,1.5,1.5=3000lm",
            "--shader",
            "glossy",
            "--path",
            "!igea",
        ],
        &["frame", "edges"],
    ),
    (
        "fig13-dragon",
        &[
            "@/dragon_vrip.glb",
            "--line-light",
            "-0.05,0.6,0.1:0.05,0.6,0.1=300lm",
            "--add-grid",
            "--path",
            "!dragon",
        ],
        &["frame", "edges"],
    ),
];

/// Frames of a figure's walk; the last is kept.
const FRAMES: &str = "45";
/// Size of the figures.
const FIGURE: &str = "320x320";

/// Writes tables and figures; `only` the tables, a figure or the tables with one case measured anew, if it names one. What fails does not
/// keep the rest from being written.
pub(crate) fn run(data: Option<&Path>, only: Option<&str>) -> Result<(), String> {
    let names: Vec<&str> = ["tables"]
        .into_iter()
        .chain(CASES.iter().map(|case| case.name))
        .chain(FIGURES.iter().map(|figure| figure.0))
        .collect();
    if let Some(name) = only.filter(|name| !names.contains(name)) {
        return Err(format!(
            "bwg03: there is no '{name}'; there are {}",
            names.join(", ")
        ));
    }
    run_command(&mut cargo(&[
        "build",
        "-q",
        "--release",
        "-p",
        "llsr-cli",
        "--locked",
    ]))?;
    let work = Work {
        data,
        folder: root().join("docs/papers/bwg03"),
        reports: root().join("target/bwg03"),
        scratch: std::env::temp_dir().join(format!("llsr-figures-{}", std::process::id())),
    };
    for folder in [&work.folder, &work.reports, &work.scratch] {
        fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    work.prepare()?;
    let wanted = |name: &str| only.is_none_or(|only| only == name);
    let mut failed = Vec::new();
    failed.extend(work.tables(|case| wanted("tables") || wanted(case.name)).err());
    for figure in FIGURES.iter().filter(|figure| wanted(figure.0)) {
        failed.extend(timed(figure.0, || work.figure(figure)).err());
    }
    fs::remove_dir_all(&work.scratch).map_err(|e| format!("{}: {e}", work.scratch.display()))?;
    if failed.is_empty() {
        Ok(())
    } else {
        Err(failed.join("\n"))
    }
}

/// Runs one part and says how long it took.
fn timed<T>(name: &str, part: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    println!("{name} ...");
    let start = Instant::now();
    let result = part();
    let how = if result.is_ok() { "done" } else { "failed" };
    println!("{name}: {how} after {:.0} s", start.elapsed().as_secs_f64());
    result.map_err(|error| format!("{name}: {error}"))
}

/// Where things are.
struct Work<'a> {
    data: Option<&'a Path>,
    folder: PathBuf,
    reports: PathBuf,
    scratch: PathBuf,
}

impl Work<'_> {
    /// Writes the paths of cameras, and the scene of figure 9 without its light.
    fn prepare(&self) -> Result<(), String> {
        // Round things that stand alone, which a walk would pass.
        for (name, center, radius, degrees) in [
            ("igea", [0.0, 0.0, 0.0], 0.2, 40.0),
            ("dragon", [-0.006, 0.125, -0.005], 0.34, 40.0),
        ] {
            write(&self.scratch.join(name), orbit(center, radius, degrees))?;
        }
        // Beside the place where the torus touches the capsule, along the surfaces, and with the eye at rest.
        let line = "1.2 1.1 0.2  -0.9 -0.11 0.11  0 1 0  14\n";
        let path = format!("# llsr camera path 1\n{}", line.repeat(45));
        write(&self.scratch.join("contact"), path)?;
        let scene = self.scratch.join("torus-capsule.gltf");
        let mut command = Command::new(root().join("target/release/llsr"));
        run_command(
            command
                .args(["demo", "torus-capsule", "--quiet", "-o"])
                .arg(&scene),
        )?;
        let mut value = read_json(&scene)?;
        for node in value["nodes"].as_array_mut().into_iter().flatten() {
            if let Some(extensions) = node["extensions"].as_object_mut() {
                extensions.remove("KHR_lights_punctual");
            }
        }
        write(&scene, value.to_string())
    }

    /// The arguments with the folder of data in place of `@` and that of paths in place of `!`; `None` if the file is not there.
    fn placed(&self, arguments: &[&str]) -> Option<Vec<String>> {
        let one = |argument: &&str| match argument.strip_prefix("@/") {
            None => Some(match argument.strip_prefix('!') {
                Some(name) => self.scratch.join(name).display().to_string(),
                None => (*argument).to_owned(),
            }),
            Some(file) => {
                let path: PathBuf = self.data?.join(file);
                path.is_file().then(|| path.display().to_string())
            }
        };
        arguments.iter().map(one).collect()
    }

    /// Measures the cases that are `wanted` and writes the tables: after each, from all reports that there are.
    fn tables(&self, wanted: impl Fn(&Case) -> bool) -> Result<(), String> {
        let mut failed = Vec::new();
        for case in CASES.iter().filter(|case| wanted(case)) {
            let Some(scene) = self.placed(case.scene) else {
                println!("{}: not there, left out", case.name);
                continue;
            };
            failed.extend(timed(case.name, || self.measure(case, &scene)).err());
            let reports = CASES.iter().filter_map(|case| {
                let report = read_json(&self.report(case)).ok()?;
                Some((case, report))
            });
            write(
                &self.folder.join("README.md"),
                tables(&reports.collect::<Vec<_>>()),
            )?;
        }
        if failed.is_empty() {
            Ok(())
        } else {
            Err(failed.join("\n"))
        }
    }

    /// Where the report of a case is kept, for the tables to be written anew when another case is measured.
    fn report(&self, case: &Case) -> PathBuf {
        self.reports.join(format!("{}.json", case.name))
    }

    /// Makes one case's walk and keeps its report.
    fn measure(&self, case: &Case, scene: &[String]) -> Result<(), String> {
        let report = self.report(case);
        // Should the walk fail, no older one stands for it.
        if report.exists() {
            fs::remove_file(&report).map_err(|e| format!("{}: {e}", report.display()))?;
        }
        let mut command = walk(scene);
        command
            .args(["--size", &format!("{0}x{0}", case.size)])
            .args(["--frames", case.frames, "--every", "30", "--compare", "raytrace"])
            .arg("--overlap")
            .args(["--shader", case.shader])
            .args(["--samples-per-frame", case.samples, "--report"])
            .arg(&report);
        run_command(&mut command)
    }

    /// Writes the pictures of one figure.
    fn figure(&self, (name, arguments, pictures): &(&str, &[&str], &[&str])) -> Result<(), String> {
        let Some(scene) = self.placed(arguments) else {
            println!("{name}: not there, left out");
            return Ok(());
        };
        let kept = self.scratch.join(name);
        let mut command = walk(&scene);
        command
            .args(["--size", FIGURE, "--frames", FRAMES, "--every", FRAMES])
            .arg("--keep-frames");
        run_command(command.arg(&kept))?;
        for picture in *pictures {
            let from = kept.join(format!("{picture}-00044.png"));
            let to = self.folder.join(format!("{name}-{picture}.png"));
            fs::copy(&from, &to).map_err(|e| format!("{}: {e}", from.display()))?;
        }
        if name.starts_with("fig9") {
            self.shadow_edges_at_contact(&self.folder.join(format!("{name}-within.png")))?;
        }
        Ok(())
    }

    /// Draws the shadow edges of figure 9 by kind as they are seen from within the capsule: from outside the torus hides where
    /// they meet.
    fn shadow_edges_at_contact(&self, to: &Path) -> Result<(), String> {
        let mut command = Command::new(root().join("target/release/llsr"));
        command.arg("edges").arg(self.scratch.join("torus-capsule.gltf"));
        command
            .args(["--line-light", GRAZING, "--look-from", "0.12,0.6,0.05"])
            .args(["--look-at", "0.12,0.99,0.36", "--up", "0,1,0", "--fov", "95"])
            .args(["--size", FIGURE, "--quiet", "-o"]);
        run_command(command.arg(to))
    }
}

fn write(path: &Path, text: String) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

fn read_json(path: &Path) -> Result<Value, String> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
}

fn walk(scene: &[String]) -> Command {
    let mut command = Command::new(root().join("target/release/llsr"));
    command.arg("walk").args(scene).arg("--quiet");
    command
}

/// A camera path around a point (m) from `degrees` on, 0.6 degrees a frame.
fn orbit([x, y, z]: [f64; 3], radius: f64, degrees: f64) -> String {
    let mut text = String::from("# llsr camera path 1\n");
    for frame in 0..120 {
        let (s, c) = (degrees + 0.6 * f64::from(frame)).to_radians().sin_cos();
        let (dx, dy, dz) = (radius * s, 0.4 * radius, radius * c);
        let _ = writeln!(
            text,
            "{} {} {}  {} {} {}  0 1 0  35",
            x + dx,
            y + dy,
            z + dz,
            -dx,
            -dy,
            -dz
        );
    }
    text
}

fn tables(reports: &[(&Case, Value)]) -> String {
    let mut text = String::from(
        "# Tables of Bala, Walter & Greenberg 2003, made anew\n\n\
         Written by `cargo xtask figures bwg03 --data FOLDER`, with the figures beside this file. The paper's numbers, in\n\
         brackets, come from a 2.8 GHz Pentium 4 for the display and four to ten processors for the shader; ours from one machine\n\
         with two cores: a frame is drawn on one of them while the samples of the frame before are shaded (lockstep, `--overlap`), so that the stages\n\
         share caches and memory with the shader. Pictures have 512 x 512 pixels where nothing else is said, walks\n\
         120 frames (of the classroom 60); numbers are those of the median frame. Ray tracing has a shader of its own, and its first picture, in which most\n\
         records of irradiance are made, does not count. Times are of the machine as it was when they were taken, with whatever ran beside; the numbers of a row come\n\
         from one run.\n\n\
         ## Table 1: scenes\n\n| scene | triangles | mesh edges | shader |\n|---|---|---|---|\n",
    );
    for (case, report) in reports {
        let [polygons, edges] = case.table1;
        let _ = writeln!(
            text,
            "| {} ({}) | {} ({polygons}) | {} ({edges}) | {} |",
            case.ours, case.paper, report["triangles"], report["mesh_edges"], case.shader
        );
    }
    text.push_str(
        "\n## Table 2: milliseconds of a frame\n\n\
         | scene | edges | rasterize | points | reach | interpolate | antialias | complex | total | frames/s | sparseness | \
         ray tracing (s) | speed-up |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (case, report) in reports {
        let summary = &report["summary"];
        let stages = [
            "edges",
            "rasterize",
            "points",
            "reach",
            "interpolate",
            "antialias",
            "complex",
            "total",
        ];
        let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        let mut ours: Vec<String> = stages
            .iter()
            .map(|stage| format!("{:.2}", number(&summary["median_ms"][stage])))
            .collect();
        ours.push(format!("{:.0}", number(&summary["fps"])));
        ours.push(format!("{:.0}", 1.0 / number(&summary["sparseness"])));
        ours.push(format!("{:.2}", number(&summary["raytrace_seconds"])));
        ours.push(format!("{:.0}", number(&summary["speedup"])));
        let _ = write!(text, "| {} ({}) |", case.ours, case.paper);
        for (ours, paper) in ours.iter().zip(case.table2) {
            let _ = write!(text, " {ours} ({paper}) |");
        }
        text.push('\n');
    }
    text.push_str(
        "\n## What a sample costs\n\n\
         Microseconds of all cores. From the second number on, the frames above are made faster than by ray tracing every pixel:\n\
         it is what a frame costs besides its samples, shared among the pixels that are not shaded.\n\n\
         | scene | shader | sample | breaks even at | speed-up in processor time |\n|---|---|---|---|---|\n",
    );
    for (case, report) in reports {
        let number = |key: &str| report["summary"][key].as_f64().unwrap_or(f64::NAN);
        let _ = writeln!(
            text,
            "| {} | {} | {:.2} | {:.3} | {:.0} |",
            case.ours,
            case.shader,
            number("sample_us"),
            number("break_even_us"),
            number("cpu_speedup")
        );
    }
    text.push_str(
        "\n## Table 3: edges and pixels of the last frame\n\n\
         | scene | view edges | shadow edges | empty % | simple % | complex % |\n|---|---|---|---|---|---|\n",
    );
    for (case, report) in reports {
        let last = report["frames"].as_array().and_then(|frames| frames.last());
        let Some(frame) = last else { continue };
        let pixels = &frame["pixels"];
        let count = |class: &str| pixels[class].as_f64().unwrap_or(f64::NAN);
        let all = count("empty") + count("simple") + count("complex");
        let share = |class: &str| format!("{:.1}", 100.0 * count(class) / all);
        let ours = [
            frame["edges"]["silhouette"].to_string(),
            frame["edges"]["shadow"].to_string(),
            share("empty"),
            share("simple"),
            share("complex"),
        ];
        let _ = write!(text, "| {} ({}) |", case.ours, case.paper);
        for (ours, paper) in ours.iter().zip(case.table3) {
            let _ = write!(text, " {ours} ({paper}) |");
        }
        text.push('\n');
    }
    text
}
