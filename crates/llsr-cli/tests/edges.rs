//! `llsr edges` as a user meets it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use llsr_testkit::program::{Program, parsed};
use serde_json::Value;
use tempfile::TempDir;

const LLSR: Program = Program::new(env!("CARGO_BIN_EXE_llsr"), &["edges"]);

fn read(folder: &Path, name: &str) -> String {
    llsr_testkit::program::read(&folder.join(name))
}

/// The ids of the groups of an SVG file, in order.
fn layers(svg: &str) -> Vec<String> {
    let ids = svg.split("<g id=\"").skip(1);
    ids.map(|rest| rest.split('"').next().unwrap_or_default().to_owned())
        .collect()
}

/// The `d` attributes of a layer's paths.
fn paths<'a>(svg: &'a str, layer: &str) -> Vec<&'a str> {
    let Some(start) = svg.find(&format!("<g id=\"{layer}\"")) else {
        return Vec::new();
    };
    let group = &svg[start..];
    let group = &group[..group.find("</g>").expect("groups end")];
    let paths = group.split("<path d=\"").skip(1);
    paths
        .map(|rest| rest.split('"').next().unwrap_or_default())
        .collect()
}

/// A unit cube and, behind it, a larger square of which the cube hides the middle. No light.
const CUBE: &str = "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
o cube
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
v -1 -1 -2\nv 2 -1 -2\nv 2 2 -2\nv -1 2 -2\nv -1 0.5 -2.0001\nv 2 0.5 -2.0001
o square
f 9 10 14 13\nf 13 14 11 12
";

fn cube(folder: &TempDir) {
    fs::write(folder.path().join("cube.obj"), CUBE).expect("a writable folder");
}

const FRONT: [&str; 7] = [
    "cube.obj",
    "--look-from",
    "0.5,0.5,9",
    "--look-at",
    "0.5,0.5,0",
    "--fov",
    "30",
];

#[test]
fn a_drawing_has_a_layer_a_class_and_needs_no_light() {
    let folder = TempDir::new().expect("a folder");
    cube(&folder);
    let said = LLSR.ok(folder.path(), &FRONT);
    assert!(
        said.contains("wrote edges.svg") && said.contains("4 silhouette"),
        "{said}"
    );
    let svg = read(folder.path(), "edges.svg");
    assert!(
        svg.starts_with("<?xml") && svg.trim_end().ends_with("</svg>"),
        "{svg}"
    );
    assert!(svg.contains("viewBox=\"0 0 512 512\""), "{svg}");
    assert_eq!(layers(&svg), ["boundary", "silhouette"], "{svg}");
    for class in ["boundary", "silhouette"] {
        assert!(
            svg.contains(&format!(
                "<g id=\"{class}\" class=\"{class}\" inkscape:groupmode=\"layer\""
            )),
            "{svg}"
        );
    }
    // From the front the cube's outline is one square, closed.
    let outline = paths(&svg, "silhouette");
    assert_eq!(outline.len(), 1, "{outline:?}");
    assert!(
        outline[0].ends_with('Z') && outline[0].matches(['M', 'L']).count() == 4,
        "{outline:?}"
    );
    let square = paths(&svg, "boundary");
    assert_eq!(
        square.len(),
        1,
        "the border of the square is seen whole: {square:?}"
    );
}

#[test]
fn hidden_parts_go_or_are_dashed_and_begin_where_they_should() {
    let folder = TempDir::new().expect("a folder");
    cube(&folder);
    // From straight above the cube's front the square's lower border is hidden in the middle.
    let above = [
        "cube.obj",
        "--look-from",
        "0.5,0.5,9",
        "--look-at",
        "0.5,0.5,0",
        "--fov",
        "30",
        "--crease",
        "0",
    ];
    LLSR.ok(folder.path(), &above);
    let without = read(folder.path(), "edges.svg");
    // The fold of the square at half height is a crease with --crease 0, hidden behind the cube but for both ends.
    let fold: Vec<Vec<f64>> = paths(&without, "crease").into_iter().map(numbers).collect();
    let mut ends: Vec<f64> = fold
        .iter()
        .filter(|p| p.len() == 4 && (p[1] - p[3]).abs() < 0.02)
        .flat_map(|p| [p[0], p[2]])
        .collect();
    ends.sort_by(f64::total_cmp);
    // In pixels: 256 + (x - 0.5) * 256 / (tan(15 degrees) * distance); the cube's front is at 8, the square at 11.0001.
    let at = |x: f64, distance: f64| 256.0 + (x - 0.5) * 256.0 / (15f64.to_radians().tan() * distance);
    let expected = [at(-1.0, 11.0001), at(0.0, 8.0), at(1.0, 8.0), at(2.0, 11.0001)];
    assert_eq!(ends.len(), 4, "{fold:?}");
    for (end, expected) in ends.iter().zip(expected) {
        assert!((end - expected).abs() < 0.011, "{ends:?}, not {expected}");
    }
    assert!(
        !layers(&without).contains(&"hidden".to_owned()),
        "hidden parts are gone"
    );

    LLSR.ok(
        folder.path(),
        &[&above[..], &["--hidden", "-o", "all.svg"]].concat(),
    );
    let with = read(folder.path(), "all.svg");
    let names = layers(&with);
    assert_eq!(names[0], "hidden", "{names:?}");
    assert!(names.contains(&"hidden-crease".to_owned()), "{names:?}");
    assert!(with.contains("stroke-dasharray"), "dashed");
    for layer in ["crease", "silhouette", "boundary"] {
        let sets = [&without, &with].map(|svg| paths(svg, layer).into_iter().collect::<BTreeSet<_>>());
        assert_eq!(sets[0], sets[1], "what is seen of the {layer} stays the same");
    }
    let middle: Vec<Vec<f64>> = paths(&with, "hidden-crease").into_iter().map(numbers).collect();
    let found = middle.iter().any(|p| {
        p.len() == 4
            && (p[0].min(p[2]) - expected[1]).abs() < 0.011
            && (p[0].max(p[2]) - expected[2]).abs() < 0.011
    });
    assert!(found, "the hidden middle of the fold: {middle:?}");
}

fn numbers(path: &str) -> Vec<f64> {
    path.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
        .filter_map(|part| part.parse().ok())
        .collect()
}

#[test]
fn lines_in_space_are_where_the_file_has_them() {
    let folder = TempDir::new().expect("a folder");
    cube(&folder);
    LLSR.ok(
        folder.path(),
        &[&FRONT[..], &["-o", "lines.obj", "--hidden"]].concat(),
    );
    let obj = read(folder.path(), "lines.obj");
    let vertices: Vec<Vec<f64>> = obj
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split(' ').filter_map(|x| x.parse().ok()).collect())
        .collect();
    for corner in [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [-1.0, -1.0, -2.0]] {
        let found = vertices.iter().any(|v| {
            let far = v.iter().zip(corner).map(|(a, b): (&f64, f64)| (a - b).abs());
            far.fold(0.0, f64::max) < 1e-6
        });
        assert!(found, "{corner:?} in {vertices:?}");
    }
    let groups: Vec<&str> = obj.lines().filter(|line| line.starts_with("g ")).collect();
    assert_eq!(groups, ["g boundary", "g silhouette"], "{obj}");
    for element in obj.lines().filter_map(|line| line.strip_prefix("l ")) {
        let indices: Vec<usize> = element.split(' ').filter_map(|x| x.parse().ok()).collect();
        assert!(indices.len() >= 2, "{element}");
        assert!(
            indices.iter().all(|&i| (1..=vertices.len()).contains(&i)),
            "{element}"
        );
    }
}

#[test]
fn an_overlay_is_a_picture_with_dark_lines() {
    let folder = TempDir::new().expect("a folder");
    cube(&folder);
    let named = [
        &FRONT[..],
        &["--format", "png", "-o", "lines.out", "--size", "96x80"],
    ]
    .concat();
    LLSR.ok(folder.path(), &named);
    let bytes = fs::read(folder.path().join("lines.out")).expect("written");
    assert!(bytes.starts_with(b"\x89PNG"), "the format that was asked for");
    LLSR.ok(folder.path(), &["demo:wall", "-o", "lit.png", "--size", "96x80"]);
    let lit = fs::read(folder.path().join("lit.png")).expect("written");
    assert!(
        lit.starts_with(b"\x89PNG") && lit.len() > 500,
        "{} bytes",
        lit.len()
    );
}

#[test]
fn lights_add_shadow_edges_where_geometry_says() {
    let folder = TempDir::new().expect("a folder");
    // A square of side 2 at height 1 over a floor, under lights at height 2 along its middle.
    let plates = "\
v -9 0 -9\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -1 1 -1\nv -1 1 1\nv 1 1 1\nv 1 1 -1
o floor\nf 1 2 3 4\no plate\nf 5 6 7 8\n";
    fs::write(folder.path().join("plates.obj"), plates).expect("a writable folder");
    let base = [
        "plates.obj",
        "--line-light",
        "-0.5,2,0:0.5,2,0=1000lm",
        "--look-from",
        "0,9,12",
        "--look-at",
        "0,0,0",
        "--fov",
        "90",
        "--report",
        "r.json",
    ];
    LLSR.ok(folder.path(), &[&base[..], &["-o", "lines.obj"]].concat());
    let report = parsed::<Value>(&folder.path().join("r.json"));
    assert!(
        report["counts"]["umbral"].as_u64() > Some(0) && report["counts"]["penumbral"].as_u64() > Some(0)
    );
    let obj = read(folder.path(), "lines.obj");
    let mut group = "";
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut reach = [0.0f64; 2];
    for line in obj.lines() {
        if let Some(numbers) = line.strip_prefix("v ") {
            let p: Vec<f64> = numbers.split(' ').filter_map(|x| x.parse().ok()).collect();
            vertices.push([p[0], p[1], p[2]]);
        } else if let Some(name) = line.strip_prefix("g ") {
            group = name;
        } else if let Some(indices) = line.strip_prefix("l ") {
            let Some(which) = ["umbral", "penumbral"].iter().position(|&name| name == group) else {
                continue;
            };
            let points: Vec<[f64; 3]> = indices
                .split(' ')
                .filter_map(|x| Some(vertices[x.parse::<usize>().ok()? - 1]))
                .collect();
            for pair in points.windows(2) {
                let [[x0, y0, z0], [x1, y1, z1]] = [pair[0], pair[1]];
                assert!(y0.abs() < 1e-4 && y1.abs() < 1e-4, "on the floor");
                // Where the line passes below the middle of the plate.
                if z0 * z1 < 0.0 {
                    let x = x0 + (x1 - x0) * z0 / (z0 - z1);
                    reach[which] = reach[which].max(x.abs());
                }
            }
        }
    }
    // Seen from the far end of the light the plate's border falls at 1.5 + 1, from the near end at 0.5 + 1.
    for (found, expected) in reach.into_iter().zip([1.5, 2.5]) {
        assert!((found - expected).abs() < 1e-4, "{reach:?}");
    }
    LLSR.ok(folder.path(), &base);
    let svg = read(folder.path(), "edges.svg");
    assert_eq!(
        layers(&svg),
        ["penumbral", "umbral", "boundary"],
        "from below to the top"
    );
}

#[test]
fn a_report_has_the_stated_keys() {
    let folder = TempDir::new().expect("a folder");
    LLSR.ok(folder.path(), &["demo:subway", "--report", "r.json", "-q"]);
    let report = parsed::<Value>(&folder.path().join("r.json"));
    for key in ["silhouette", "crease", "boundary", "hard", "umbral", "penumbral"] {
        assert!(report["counts"][key].is_u64(), "counts.{key} in {report}");
    }
    for key in ["build", "silhouette", "shadow", "hidden"] {
        assert!(report["ms"][key].is_f64(), "ms.{key} in {report}");
    }
    assert!(report["counts"]["silhouette"].as_u64() > Some(100), "{report}");
}

#[test]
fn drawings_do_not_depend_on_the_number_of_threads() {
    let folder = TempDir::new().expect("a folder");
    let files: Vec<String> = ["1", "2", "3"]
        .iter()
        .map(|threads| {
            let name = format!("{threads}.svg");
            LLSR.ok(
                folder.path(),
                &["demo:subway", "--hidden", "-o", &name, "--threads", threads],
            );
            read(folder.path(), &name)
        })
        .collect();
    assert!(files[0].len() > 5000, "{} bytes", files[0].len());
    assert_eq!(files[0], files[1], "one thread and two");
    assert_eq!(files[0], files[2], "one thread and three");
}

#[test]
fn wrong_command_lines_say_what_is_right() {
    let folder = TempDir::new().expect("a folder");
    cube(&folder);
    for (args, named) in [
        (&["cube.obj", "-o", "lines.dxf"][..], ".svg, .obj or .png"),
        (&["cube.obj", "--crease", "200"], "0 to 180"),
        (&["cube.obj", "--crease", "NaN"], "0 to 180"),
        (&["cube.obj", "--format", "pdf"], "svg"),
    ] {
        let message = LLSR.fails(folder.path(), args, 2);
        assert!(message.contains(named), "{args:?}: {message}");
    }
    LLSR.fails(folder.path(), &["nothing.obj"], 1);
}

#[test]
fn broken_meshes_are_drawn_or_named_and_never_a_panic() {
    let folder = TempDir::new().expect("a folder");
    let cases = [
        ("empty", ""),
        ("points", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("needle", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        (
            "doubled",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\nf 3 2 1\n",
        ),
        (
            "fan",
            "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n",
        ),
        (
            "loose",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.4\nf 1 2 3\nf 4 6 5\n",
        ),
        ("dot", "v 3 3 3\nv 3 3 3\nv 3 3 3\nf 1 2 3\n"),
        ("far", "v 1e30 0 0\nv 1e30 1e29 0\nv 9e29 1 2\nf 1 2 3\n"),
        ("nan", "v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 3 4\n"),
    ];
    for (name, obj) in cases {
        let file = format!("{name}.obj");
        fs::write(folder.path().join(&file), obj).expect("a writable folder");
        let ended = LLSR.run(folder.path(), &[&file, "--hidden", "-o", "out.svg"]);
        let message = ended.err;
        assert!(matches!(ended.code, Some(0 | 1)), "{name}: {message}");
        assert!(
            ended.code == Some(0) || message.contains(&file),
            "{name}: {message}"
        );
    }
    let seen = LLSR.ok(folder.path(), &["loose.obj", "-o", "out.svg", "--crease", "5"]);
    assert!(seen.contains("4 boundary"), "equal corners are welded: {seen}");
    let message = LLSR.run(folder.path(), &["fan.obj", "-o", "out.svg"]).err;
    assert!(message.contains("more than two faces"), "{message}");
}
