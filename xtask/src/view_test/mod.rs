//! `llsr view` for real: a virtual screen, keys and a mouse, and a look at the pixels.

mod screen;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::run::{cargo, output, root, run};
use screen::{Picture, Screen};

/// Size of the window.
const SIZE: (u32, u32) = (400, 300);
/// Rows at the top that hold text: pictures are compared below.
const TEXT: u32 = 96;
/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// Pixels that may differ clearly between two pictures of the same thing.
const GRAIN: usize = 60;

/// `cargo xtask view-test [FOLDER]`: pictures of every step are kept in the folder, if one is named.
pub(crate) fn run_with(args: &[String]) -> Result<(), String> {
    let keep = match args {
        [] => None,
        [folder] => Some(PathBuf::from(folder)),
        _ => return Err("usage: cargo xtask view-test [FOLDER]".to_owned()),
    };
    for (program, flag) in [("Xvfb", "-help"), ("xdotool", "version")] {
        let there = Command::new(program)
            .arg(flag)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if there.is_err() {
            println!("{program} is not installed; skipped (Debian: apt-get install xvfb xdotool)");
            return Ok(());
        }
    }
    run(&mut cargo(&[
        "clippy",
        "--quiet",
        "-p",
        "llsr-cli",
        "--features",
        "view",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]))?;
    run(&mut cargo(&[
        "build",
        "--quiet",
        "-p",
        "llsr-cli",
        "--features",
        "view",
    ]))?;
    let folder = root().join("target/view-test");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    if let Some(keep) = &keep {
        std::fs::create_dir_all(keep).map_err(|e| e.to_string())?;
    }
    let screen = Screen::start(&folder)?;
    steps(&screen, &folder, keep.as_deref())?;
    for how in [End::CloseButton, End::Interrupt] {
        let mut view = View::open(&screen, &folder, None)?;
        view.end(how)?;
    }
    Ok(())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Escape,
    CloseButton,
    Interrupt,
}

/// A running `llsr view` and its window.
struct View<'a> {
    screen: &'a Screen,
    child: Child,
    window: String,
    keep: Option<&'a Path>,
    shots: u32,
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl<'a> View<'a> {
    fn open(screen: &'a Screen, folder: &Path, keep: Option<&'a Path>) -> Result<Self, String> {
        let child = Command::new(root().join("target/debug/llsr"))
            .args([
                "view",
                "demo:torus-capsule",
                "--size",
                &format!("{}x{}", SIZE.0, SIZE.1),
            ])
            .args(["--spp", "4", "--quiet", "--folder"])
            .arg(folder)
            .arg("--report")
            .arg(folder.join("report.json"))
            .env("DISPLAY", screen.display())
            .env_remove("WAYLAND_DISPLAY")
            .spawn()
            .map_err(|e| e.to_string())?;
        let mut view = Self {
            screen,
            child,
            window: String::new(),
            keep,
            shots: 0,
        };
        view.wait("a window", |view| {
            let found = view.xdotool(&["search", "--onlyvisible", "--name", "llsr - "]);
            view.window = found.unwrap_or_default().trim().to_owned();
            !view.window.is_empty()
        })?;
        let window = view.window.clone();
        view.xdotool(&["windowfocus", &window])?;
        view.wait("a picture", |view| {
            view.screen
                .picture()
                .is_ok_and(|p| p.count(|c| c != 0) > (SIZE.0 * SIZE.1 / 2) as usize)
        })?;
        Ok(view)
    }

    fn xdotool(&self, args: &[&str]) -> Result<String, String> {
        output(
            Command::new("xdotool")
                .args(args)
                .env("DISPLAY", self.screen.display()),
        )
    }

    fn key(&self, key: &str) -> Result<(), String> {
        self.xdotool(&["key", key]).map(drop)
    }

    /// Presses a button at one place of the window, moves to another in steps, and lets go.
    fn drag(&self, button: &str, from: (i32, i32), to: (i32, i32)) -> Result<(), String> {
        let place = |(x, y): (i32, i32)| {
            self.xdotool(&[
                "mousemove",
                "--window",
                &self.window,
                &x.to_string(),
                &y.to_string(),
            ])
        };
        place(from)?;
        sleep(Duration::from_millis(60));
        self.xdotool(&["mousedown", button])?;
        for i in 1..=8 {
            sleep(Duration::from_millis(30));
            place((from.0 + (to.0 - from.0) * i / 8, from.1 + (to.1 - from.1) * i / 8))?;
        }
        sleep(Duration::from_millis(60));
        self.xdotool(&["mouseup", button]).map(drop)
    }

    /// Waits until `done`, or says what did not happen.
    fn wait(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) -> Result<(), String> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Err(format!("llsr view ended ({status}) before there was {what}"));
            }
            if done(self) {
                return Ok(());
            }
            sleep(Duration::from_millis(40));
        }
        self.keep("failed");
        Err(format!("after {} s there is not {what}", PATIENCE.as_secs()))
    }

    /// Waits for a picture of which `good` holds, and returns it.
    fn see(&mut self, what: &str, good: impl Fn(&Picture) -> bool) -> Result<Picture, String> {
        let mut seen = None;
        self.wait(what, |view| {
            seen = view.screen.picture().ok().filter(|picture| good(picture));
            seen.is_some()
        })?;
        println!("   {what}");
        self.keep(what);
        seen.ok_or_else(|| "no picture".to_owned())
    }

    /// The picture once it changes no more than grain.
    fn settled(&mut self) -> Result<Picture, String> {
        let mut last = self.screen.picture()?;
        let mut quiet = 0;
        self.wait("a picture that stands still", |view| {
            sleep(Duration::from_millis(150));
            if let Ok(now) = view.screen.picture() {
                quiet = if now.difference(&last, TEXT) < GRAIN {
                    quiet + 1
                } else {
                    0
                };
                last = now;
            }
            quiet >= 4
        })?;
        Ok(last)
    }

    fn keep(&mut self, what: &str) {
        self.shots += 1;
        if let (Some(folder), Ok(picture)) = (self.keep, self.screen.picture()) {
            let name = format!("{:02} {what}.png", self.shots).replace('/', "-");
            if let Err(error) = picture.write(&folder.join(name)) {
                println!("   {error}");
            }
        }
    }

    /// Ends the view in one of the ways and checks that it goes at once and well.
    fn end(&mut self, how: End) -> Result<(), String> {
        match how {
            End::Escape => self.key("Escape")?,
            End::CloseButton => {
                if !self.screen.close(&self.window) {
                    println!("   this xdotool cannot press the close button; Escape instead");
                    self.key("Escape")?;
                }
            }
            End::Interrupt => {
                let id = self.child.id().to_string();
                run(Command::new("kill").args(["-INT", &id]))?;
            }
        }
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(5) {
            match self.child.try_wait().map_err(|e| e.to_string())? {
                Some(status) if status.success() => {
                    println!("   ended by {how:?} in {:.2} s", start.elapsed().as_secs_f64());
                    return Ok(());
                }
                Some(status) => return Err(format!("{how:?}: {status}")),
                None => sleep(Duration::from_millis(10)),
            }
        }
        Err(format!("{how:?}: still running after 5 s"))
    }
}

/// Plain ray tracing: one ray a pixel, so that borders are stairs, and nothing changes any more once it is done.
fn traced(view: &mut View<'_>, plain: &Picture) -> Result<(), String> {
    let apart = |p: &Picture| p.difference(plain, TEXT);
    view.key("t")?;
    let mut last: Option<Picture> = None;
    view.wait("a ray traced picture that stays the same to the bit", |view| {
        sleep(Duration::from_millis(300));
        let now = view.screen.picture().ok();
        let still = last
            .as_ref()
            .zip(now.as_ref())
            .is_some_and(|(last, now)| apart(now) > 2 * GRAIN && now.same_below(last, TEXT));
        last = now;
        still
    })?;
    println!(
        "   plain ray tracing: {} pixels differ",
        last.as_ref().map_or(0, apart)
    );
    view.keep("plain ray tracing");
    view.key("t")?;
    view.see("no longer plain ray tracing", |p| apart(p) <= GRAIN)?;
    Ok(())
}

/// With few samples a frame, and all forgotten, most pixels are without one for long: black if samples are shown, and only then.
fn samples(view: &mut View<'_>, plain: &Picture) -> Result<(), String> {
    let few = 12;
    let black = |p: &Picture| p.count(|c| c == 0);
    let pixels = (SIZE.0 * SIZE.1) as usize;
    for _ in 0..few {
        view.key("bracketleft")?;
    }
    view.key("f")?;
    view.key("p")?;
    view.see("few samples on black", |p| black(p) > black(plain) + pixels / 2)?;
    view.key("p")?;
    view.see("a colour in every pixel again", |p| {
        black(p) < black(plain) + pixels / 50
    })?;
    for _ in 0..few {
        view.key("bracketright")?;
    }
    view.settled()?;
    Ok(())
}

/// The recorded path walked without a window: as many frames, and the last one shows what the window shows at the end.
fn replay(folder: &Path, path: &Path, steps: usize, window: &Picture) -> Result<(), String> {
    let kept = folder.join("walked");
    let report = folder.join("walk.json");
    let mut walk = Command::new(root().join("target/debug/llsr"));
    walk.args([
        "walk",
        "demo:torus-capsule",
        "--quiet",
        "--every",
        "100000",
        "--size",
    ])
    .arg(format!("{}x{}", SIZE.0, SIZE.1))
    .arg("--path")
    .arg(path)
    .arg("--keep-frames")
    .arg(&kept)
    .arg("--report")
    .arg(&report);
    run(&mut walk)?;
    let report = json(&report)?;
    let frames = report["frames"].as_array().map_or(0, Vec::len);
    if frames != steps {
        return Err(format!("{frames} frames of a path of {steps} steps"));
    }
    let last = Picture::read(&kept.join(format!("frame-{:05}.png", steps - 1)))?;
    let (here, there) = (window.reddish(TEXT), last.reddish(TEXT));
    let near = (here.x - there.x).abs() < 4.0 && (here.y - there.y).abs() < 4.0;
    if !near || here.count.abs_diff(there.count) > here.count / 10 {
        return Err(format!(
            "the walk ends with another view than the window: {:.0}, {:.0} ({} pixels) and {:.0}, {:.0} ({})",
            there.x, there.y, there.count, here.x, here.y, here.count
        ));
    }
    println!("   and walked to the same view");
    Ok(())
}

fn json(path: &Path) -> Result<serde_json::Value, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Everything that a user does, one thing after another.
fn steps(screen: &Screen, folder: &Path, keep: Option<&Path>) -> Result<(), String> {
    let mut view = View::open(screen, folder, keep)?;
    let first = view.settled()?;
    view.keep("the first picture");
    if first.red().count < 2000 {
        return Err(format!("the torus is not seen: {} red pixels", first.red().count));
    }
    let same = |p: &Picture| p.difference(&first, TEXT) < 900;
    let other = |p: &Picture| p.difference(&first, TEXT) > 4000;

    view.key("g")?;
    let edges =
        |p: &Picture| p.count(|c| (c & 255) > (c >> 8 & 255) + 60 && (c >> 16 & 255) > (c >> 8 & 255) + 40);
    view.see("edges in violet", |p| edges(p) > edges(&first) + 300)?;
    view.key("g")?;
    view.see("no edges again", |p| edges(p) <= edges(&first) + 60)?;
    view.key("r")?;
    view.see("reachability in grey", |p| {
        p.red().count < 50 && p.difference(&first, TEXT) > 10_000
    })?;
    view.key("r")?;
    view.see("the picture again", same)?;
    // Near to the picture, so that it takes one of the same samples to tell them apart.
    let plain = view.settled()?;
    let apart = |p: &Picture| p.difference(&plain, TEXT);
    view.key("b")?;
    view.see("interpolation across edges", |p| apart(p) > 3 * GRAIN)?;
    view.key("b")?;
    view.see("no longer interpolation across edges", |p| apart(p) <= GRAIN)?;
    traced(&mut view, &plain)?;
    samples(&mut view, &plain)?;
    view.see("the picture after the switches", same)?;
    view.key("h")?;
    view.see("the list of keys", |p| p.difference(&first, TEXT) > 10_000)?;
    view.key("h")?;
    view.see("no list of keys", same)?;

    view.xdotool(&["keydown", "d"])?;
    sleep(Duration::from_millis(700));
    view.xdotool(&["keyup", "d"])?;
    let flown = view.see("the view from farther right", other)?;
    if flown.red().x > first.red().x - 20.0 {
        return Err("flying to the right does not move the torus to the left".to_owned());
    }
    view.key("Home")?;
    view.see("the first view", same)?;
    view.drag("1", (200, 250), (260, 250))?;
    let turned = view.see("the view turned with the mouse", other)?;
    if turned.red().x < first.red().x + 10.0 {
        return Err("the torus does not follow the pointer".to_owned());
    }
    view.key("Home")?;
    view.see("the first view once more", same)?;
    view.key("o")?;
    view.drag("1", (200, 200), (300, 200))?;
    view.see("the view from another side", other)?;
    view.key("Home")?;
    view.key("o")?;
    view.see("the first view after going round", same)?;

    // On the tube of the torus, where it is seen in front.
    let at = first.red_run().ok_or("no red row")?;
    view.drag("3", at, (at.0 - 60, at.1 - 30))?;
    let (x, y) = (first.red().x - 60.0, first.red().y - 30.0);
    view.see("the torus dragged to the upper left", |p| {
        (p.red().x - x).abs() < 15.0 && (p.red().y - y).abs() < 15.0
    })?;
    view.settled()?;
    view.keep("the torus dragged, settled");
    view.key("BackSpace")?;
    view.see("the torus at its place", same)?;

    view.key("x")?;
    let picture = folder.join("llsr-view.png");
    view.wait("a saved picture", |_| picture.is_file())?;
    println!("   a saved picture");
    let saved = Picture::read(&picture)?;
    let now = view.settled()?;
    let apart = now.difference(&saved, TEXT);
    if apart > 3000 {
        return Err(format!(
            "{apart} pixels of the saved picture differ from the window"
        ));
    }
    view.key("c")?;
    view.xdotool(&["keydown", "w"])?;
    sleep(Duration::from_millis(500));
    view.xdotool(&["keyup", "w"])?;
    view.key("c")?;
    let path = folder.join("llsr-path.txt");
    view.wait("a recorded path", |_| path.is_file())?;
    let text = std::fs::read_to_string(&path).map_err(|e| e.to_string())?;
    let steps = text.lines().filter(|line| !line.starts_with('#')).count();
    if steps < 8 {
        return Err(format!("the recorded path has {steps} steps"));
    }
    println!("   a recorded path of {steps} steps");
    let reached = view.settled()?;
    view.keep("the end of the recorded path");
    if reached.red().count < first.red().count * 11 / 10 {
        return Err("flying ahead does not bring the torus nearer".to_owned());
    }
    replay(folder, &path, steps, &reached)?;
    view.key("Home")?;

    let window = view.window.clone();
    view.xdotool(&["windowsize", &window, "520", "410"])?;
    view.see("a larger window, filled", |p| {
        let lit = |x: u32, y: u32| p.at(x, y) != 0;
        lit(500, 400) && lit(20, 400) && p.red().count > first.red().count * 5 / 4
    })?;
    view.end(End::Escape)?;
    let report = json(&folder.join("report.json"))?;
    let files = report["files"].as_array().map_or(0, Vec::len);
    if files != 2 || report["moves"].as_u64().unwrap_or(0) < 2 || report["shader_errors"] != 0 {
        return Err(format!("the report does not say what happened: {report}"));
    }
    println!(
        "   {} frames, first picture after {} s (unoptimised program)",
        report["frames"], report["seconds"]["first_picture"]
    );
    Ok(())
}
