//! What can be drawn over or instead of the picture: edges, samples, reachability, lights, text.

use llsr_epi::{EdgePointImage, PixelClass};
use llsr_epr::FrameRenderer;
use llsr_scene::{Camera, Light, Viewport};

use crate::canvas::Canvas;
use crate::keys::{BINDINGS, MOUSE};
use crate::text;

/// Colours of pixels with one edge and of complex ones (BWG03, figure 7).
const SIMPLE: u32 = 0xb0_3c_e0;
const COMPLEX: u32 = 0x20_e0_40;
/// Colours of lights and of the one that is held.
const LIGHT: u32 = 0xff_e0_60;
const HELD: u32 = 0xff_80_20;
const WHITE: u32 = 0xff_ff_ff;
/// Text of messages and of errors.
pub(crate) const MESSAGE: u32 = 0xff_e0_80;
pub(crate) const ERROR: u32 = 0xff_60_50;

/// Colours the pixels that have edges.
pub(crate) fn edges(canvas: &mut Canvas, image: &EdgePointImage) {
    let (width, height) = image.size();
    for y in 0..height {
        for x in 0..width {
            let color = match image.class(x, y) {
                PixelClass::Empty => continue,
                PixelClass::Simple => SIMPLE,
                PixelClass::Complex => COMPLEX,
            };
            canvas.mix(x as i32, y as i32, color, 190);
        }
    }
}

/// Darkens the pixels without a sample of their own.
pub(crate) fn samples(canvas: &mut Canvas, renderer: &FrameRenderer) {
    let image = renderer.image();
    let (width, height) = image.size();
    for y in 0..height {
        for x in 0..width {
            if image.sample(x, y).is_none() {
                canvas.set(x as i32, y as i32, 0);
            }
        }
    }
}

/// Shows for each pixel how many of the 24 neighbours of the 5x5 window it reaches: black none, white all.
pub(crate) fn reach(canvas: &mut Canvas, image: &EdgePointImage) {
    let (width, height) = image.size();
    for y in 0..height {
        for x in 0..width {
            let level = image.reach_mask(x, y).count_ones() * 255 / 24;
            canvas.set(x as i32, y as i32, level << 16 | level << 8 | level);
        }
    }
}

/// Draws lights as lines, points as crosses.
pub(crate) fn lights(
    canvas: &mut Canvas,
    lights: &[Light],
    camera: &Camera,
    viewport: Viewport,
    held: Option<&str>,
) {
    for light in lights {
        let color = if held == Some(light.name()) { HELD } else { LIGHT };
        let (a, b) = light.ends();
        // Cut where the light passes the camera's plane.
        let depth = |p: glam::DVec3| (p - camera.position).dot(camera.forward());
        let near = 1e-4 * (a.distance(b) + a.distance(camera.position));
        let (da, db) = (depth(a) - near, depth(b) - near);
        let cut = || a.lerp(b, da / (da - db));
        let (a, b) = match (da > 0.0, db > 0.0) {
            (true, true) => (a, b),
            (true, false) => (a, cut()),
            (false, true) => (cut(), b),
            (false, false) => continue,
        };
        let (Some(p), Some(q)) = (camera.project(viewport, a), camera.project(viewport, b)) else {
            continue;
        };
        let (p, q) = ((p.0, p.1), (q.0, q.1));
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            canvas.line((p.0 + dx, p.1 + dy), (q.0 + dx, q.1 + dy), color);
        }
        for (x, y) in [p, q] {
            canvas.line((x - 3.0, y), (x + 3.0, y), color);
            canvas.line((x, y - 3.0), (x, y + 3.0), color);
        }
    }
}

/// Writes lines of text into the upper left corner, on a dark ground.
pub(crate) fn numbers(canvas: &mut Canvas, lines: &[(u32, String)]) {
    let scale = text_scale(canvas);
    let (margin, line) = (4 * scale, text::LINE * scale);
    let longest = lines.iter().map(|(_, line)| line.chars().count()).max();
    let width = longest.unwrap_or(0) as i32 * text::CELL * scale;
    canvas.shade(0, 0, width + 2 * margin, lines.len() as i32 * line + margin);
    for (i, (color, content)) in (0..).zip(lines) {
        text::draw(canvas, margin, margin + i * line, scale, *color, content);
    }
}

/// Writes the list of keys into the middle.
pub(crate) fn help(canvas: &mut Canvas) {
    let keys = BINDINGS.iter().filter(|binding| !binding.shown.is_empty());
    let rows: Vec<(&str, &str)> = keys
        .map(|binding| (binding.shown, binding.help))
        .chain(MOUSE.iter().copied())
        .collect();
    let first = rows.iter().map(|row| row.0.chars().count()).max().unwrap_or(0) as i32 + 2;
    let second = rows.iter().map(|row| row.1.chars().count()).max().unwrap_or(0) as i32;
    let (width, height) = canvas.size();
    let cells = first + second + 2;
    // As large as fits, at most as the other text.
    let fits = |scale: &i32| {
        cells * text::CELL * scale <= width as i32
            && (rows.len() as i32 + 2) * text::LINE * scale <= height as i32
    };
    let scale = (1..=text_scale(canvas)).rev().find(fits).unwrap_or(1);
    let (box_width, box_height) = (
        cells * text::CELL * scale,
        (rows.len() as i32 + 1) * text::LINE * scale,
    );
    let x = ((width as i32 - box_width) / 2).max(0);
    let y = ((height as i32 - box_height) / 2).max(0);
    for _ in 0..2 {
        canvas.shade(x, y, box_width, box_height);
    }
    for (i, (keys, what)) in (0..).zip(rows) {
        let top = y + (i * text::LINE + text::LINE / 2) * scale;
        let left = x + text::CELL * scale;
        text::draw(canvas, left, top, scale, MESSAGE, keys);
        text::draw(canvas, left + first * text::CELL * scale, top, scale, WHITE, what);
    }
}

/// Dots of text are two pixels wide in large windows.
fn text_scale(canvas: &Canvas) -> i32 {
    let (width, height) = canvas.size();
    if width >= 1100 && height >= 700 { 2 } else { 1 }
}
