//! Text in a bitmap font of 8x8 pixels.

use font8x8::legacy::{BASIC_LEGACY, NOTHING_TO_DISPLAY};

use crate::canvas::Canvas;

/// Width of a character and height of its box (pixels).
pub(crate) const CELL: i32 = 8;
/// Distance between lines (pixels).
pub(crate) const LINE: i32 = 11;

/// What is drawn for a character outside of ASCII.
const UNKNOWN: [u8; 8] = [0x00, 0x7e, 0x42, 0x42, 0x42, 0x42, 0x7e, 0x00];

fn glyph(character: char) -> [u8; 8] {
    let index = character as usize;
    match character {
        ' ' => NOTHING_TO_DISPLAY,
        '!'..='~' => BASIC_LEGACY[index],
        // The characters that this program itself writes.
        'µ' => [0x00, 0x00, 0x66, 0x66, 0x66, 0x3e, 0x06, 0x03],
        _ => UNKNOWN,
    }
}

/// Draws one line of text in `color` (0xRRGGBB) with a dark shadow, its upper left corner at (`x`, `y`), every dot
/// `scale` pixels wide. Parts outside of the canvas are left out.
pub(crate) fn draw(canvas: &mut Canvas, x: i32, y: i32, scale: i32, color: u32, text: &str) {
    for (offset, ink) in [(scale, 0), (0, color)] {
        for (column, character) in (0..).zip(text.chars()) {
            for (row, bits) in (0..).zip(glyph(character)) {
                for dot in (0..CELL).filter(|dot| bits >> dot & 1 == 1) {
                    let left = x + offset + (column * CELL + dot) * scale;
                    let top = y + offset + row * scale;
                    canvas.fill(left, top, scale, scale, ink);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dots of a text as lines of `#` and `.`.
    fn dots(text: &str, scale: i32) -> Vec<String> {
        let width = text.chars().count() as i32 * CELL * scale;
        let mut canvas = Canvas::new(width as u32, (CELL * scale) as u32);
        draw(&mut canvas, 0, 0, scale, 0xff_ffff, text);
        canvas
            .pixels()
            .chunks(width as usize)
            .map(|row| {
                row.iter()
                    .map(|&p| if p == 0xff_ffff { '#' } else { '.' })
                    .collect()
            })
            .collect()
    }

    #[test]
    fn letters_are_drawn_upright_and_not_mirrored() {
        let f = dots("F", 1);
        let count = |row: &String| row.matches('#').count();
        assert!(count(&f[0]) > count(&f[5]), "the bar is at the top: {f:?}");
        let left = |row: &String| row.find('#').unwrap_or(8);
        assert!(
            left(&f[5]) < 4 && f[0].rfind('#').unwrap_or(0) > 4,
            "and the stem at the left: {f:?}"
        );
    }

    #[test]
    fn every_printable_character_differs_from_every_other() {
        let printable: Vec<char> = (' '..='~').collect();
        for (i, &a) in printable.iter().enumerate() {
            for &b in &printable[i + 1..] {
                assert_ne!(glyph(a), glyph(b), "'{a}' and '{b}'");
            }
        }
        assert_eq!(glyph('語'), UNKNOWN, "other characters show as a box");
    }

    #[test]
    fn large_text_is_small_text_with_larger_dots() {
        let (small, large) = (dots("a7", 1), dots("a7", 3));
        for (y, row) in large.iter().enumerate() {
            for (x, dot) in row.chars().enumerate() {
                assert_eq!(Some(dot), small[y / 3].chars().nth(x / 3), "dot {x}, {y}");
            }
        }
    }

    #[test]
    fn text_outside_of_the_canvas_is_left_out() {
        let mut canvas = Canvas::new(10, 10);
        for (x, y) in [(-40, 0), (100, 100), (-3, -3), (7, 7), (i32::MAX / 64, 0)] {
            draw(&mut canvas, x, y, 2, 0xffff, "Wg");
        }
        assert!(canvas.pixels().contains(&0xffff), "what lies inside is drawn");
    }
}
