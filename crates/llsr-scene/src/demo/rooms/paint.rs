//! The colours of the rooms.

use glam::{Vec2, Vec3};

use super::super::pattern::{bricks, hash, noise, planks, textured, tiles};
use crate::{Material, MaterialId, Scene};

/// Materials; the lists of rooms begin with the gallery and go on as the circle does.
pub(super) struct Paint {
    pub(super) floors: [MaterialId; 4],
    pub(super) walls: [MaterialId; 4],
    pub(super) ceiling: MaterialId,
    pub(super) trim: MaterialId,
    pub(super) metal: MaterialId,
    pub(super) wood: MaterialId,
    pub(super) dark_wood: MaterialId,
    pub(super) cloth: MaterialId,
    pub(super) cushion: MaterialId,
    pub(super) rug: MaterialId,
    pub(super) china: MaterialId,
    pub(super) stone: MaterialId,
    pub(super) bronze: MaterialId,
    pub(super) glaze: MaterialId,
    pub(super) leaf: MaterialId,
    pub(super) gilt: MaterialId,
    pub(super) pictures: [MaterialId; 4],
    pub(super) books: [MaterialId; 6],
}

impl Paint {
    pub(super) fn new(scene: &mut Scene) -> Self {
        let v = Vec3::new;
        let oak = |place| planks(place, 6, v(0.24, 0.13, 0.06), v(0.50, 0.31, 0.16));
        let beech = |place| planks(place, 8, v(0.42, 0.28, 0.15), v(0.66, 0.48, 0.29));
        let marble = |place| tiles(place, 2, v(0.78, 0.75, 0.70), v(0.16, 0.17, 0.19));
        let terracotta = |place| tiles(place, 2, v(0.56, 0.30, 0.19), v(0.50, 0.25, 0.15));
        let floors = [
            textured(scene, "marble", (256, 256), Vec2::splat(1.4), marble),
            textured(scene, "oak", (256, 256), Vec2::splat(1.5), oak),
            textured(scene, "beech", (256, 256), Vec2::splat(1.2), beech),
            textured(scene, "terracotta", (128, 128), Vec2::splat(0.8), terracotta),
        ];
        let plaster = |place: Vec2| v(0.76, 0.74, 0.69) * (0.94 + 0.06 * noise(place, [24, 24]));
        let damask = |place: Vec2| {
            // Lozenges between stripes.
            let bow = (place.x * std::f32::consts::TAU * 2.0).cos() * 0.12;
            let wave = ((place.y * 2.0 + bow).fract() - 0.5).abs() * 2.0;
            let stripe = ((place.x * 4.0).fract() - 0.5).abs() * 2.0;
            let figure = if wave + stripe < 0.9 && wave + stripe > 0.45 {
                1.0
            } else {
                0.0
            };
            v(0.46, 0.20, 0.17).lerp(v(0.66, 0.47, 0.28), 0.75 * figure)
        };
        let stripes = |place: Vec2| {
            if (place.x * 5.0).fract() < 0.5 {
                v(0.34, 0.44, 0.36)
            } else {
                v(0.42, 0.52, 0.43)
            }
        };
        let walls = [
            textured(scene, "plaster", (128, 128), Vec2::splat(2.0), plaster),
            textured(scene, "damask", (128, 128), Vec2::splat(0.8), damask),
            textured(scene, "stripes", (64, 4), Vec2::splat(0.8), stripes),
            textured(scene, "bricks", (128, 128), Vec2::splat(1.0), |place| {
                bricks(place, 12)
            }),
        ];
        let weave = |place: Vec2| {
            let (ring, turn) = ((place - 0.5).length(), (place.y - 0.5).atan2(place.x - 0.5));
            let petals = 0.36 + 0.05 * (8.0 * turn).cos();
            let border = (place - 0.5).abs().max_element() > 0.45;
            let base = if border || (ring < petals && ring > petals - 0.06) || ring < 0.1 {
                v(0.70, 0.55, 0.32)
            } else {
                v(0.40, 0.10, 0.10)
            };
            let thread = hash((place.x * 96.0) as i32, (place.y * 96.0) as i32);
            base * (0.85 + 0.15 * thread)
        };
        let rug = textured(scene, "rug", (192, 192), Vec2::new(2.4, 2.4), weave);
        let grain = |place| planks(place, 2, v(0.30, 0.16, 0.08), v(0.52, 0.32, 0.17));
        let wood = textured(scene, "walnut", (128, 128), Vec2::new(0.5, 1.0), grain);
        let pictures = [0, 1, 2, 3].map(|number| {
            textured(
                scene,
                &format!("picture {}", number + 1),
                (96, 96),
                Vec2::ONE,
                |p| picture(number, p),
            )
        });
        let mut plain = |name: &str, color: [f32; 3], roughness: f32, metallic: f32| {
            scene.add_material(Material {
                roughness,
                metallic,
                ..Material::diffuse(name, color.into())
            })
        };
        Self {
            floors,
            walls,
            wood,
            rug,
            pictures,
            ceiling: plain("ceiling", [0.80, 0.80, 0.78], 1.0, 0.0),
            trim: plain("trim", [0.74, 0.72, 0.66], 0.6, 0.0),
            metal: plain("metal", [0.30, 0.30, 0.31], 0.4, 0.0),
            dark_wood: plain("dark wood", [0.16, 0.09, 0.05], 0.5, 0.0),
            cloth: plain("cloth", [0.22, 0.33, 0.46], 1.0, 0.0),
            cushion: plain("cushion", [0.74, 0.50, 0.16], 1.0, 0.0),
            china: plain("china", [0.80, 0.80, 0.78], 0.2, 0.0),
            stone: plain("stone", [0.70, 0.67, 0.61], 0.9, 0.0),
            bronze: plain("bronze", [0.46, 0.30, 0.14], 0.35, 0.0),
            glaze: plain("glaze", [0.12, 0.34, 0.42], 0.2, 0.0),
            leaf: plain("leaf", [0.16, 0.34, 0.10], 0.8, 0.0),
            gilt: plain("gilt", [0.62, 0.46, 0.18], 0.4, 0.0),
            books: [
                [0.46, 0.10, 0.08],
                [0.12, 0.22, 0.38],
                [0.15, 0.32, 0.18],
                [0.55, 0.40, 0.16],
                [0.30, 0.20, 0.32],
                [0.62, 0.56, 0.46],
            ]
            .map(|color| plain("book", color, 0.8, 0.0)),
        }
    }
}

/// Four pictures for the gallery; v runs downwards.
fn picture(number: i32, place: Vec2) -> Vec3 {
    let v = Vec3::new;
    let Vec2 { x, y } = place;
    match number {
        // Hills before an evening sky.
        0 => {
            let hill = |base: f32, seed: i32| base + 0.16 * noise(Vec2::new(x, seed as f32 / 8.0), [5, 8]);
            if y > hill(0.72, 3) {
                v(0.07, 0.16, 0.08)
            } else if y > hill(0.56, 5) {
                v(0.14, 0.26, 0.22)
            } else if place.distance(Vec2::new(0.68, 0.46)) < 0.09 {
                v(0.95, 0.70, 0.30)
            } else {
                v(0.22, 0.32, 0.56).lerp(v(0.88, 0.50, 0.30), (1.6 * y).min(1.0))
            }
        }
        // Rectangles between black bars.
        1 => {
            let bars = [(x, 0.28), (x, 0.74), (y, 0.36), (y, 0.80)];
            if bars.iter().any(|(c, at)| (c - at).abs() < 0.018) {
                Vec3::splat(0.02)
            } else if x > 0.28 && y < 0.36 && x < 0.74 {
                v(0.70, 0.08, 0.05)
            } else if x < 0.28 && y > 0.80 {
                v(0.06, 0.14, 0.50)
            } else if x > 0.74 && y > 0.36 && y < 0.80 {
                v(0.85, 0.66, 0.08)
            } else {
                Vec3::splat(0.80)
            }
        }
        // Rings.
        2 => {
            let ring = (place.distance(Vec2::new(0.42, 0.55)) * 11.0) as i32;
            let palette = [
                v(0.80, 0.62, 0.30),
                v(0.20, 0.42, 0.48),
                v(0.62, 0.22, 0.16),
                v(0.12, 0.14, 0.22),
            ];
            palette[ring.rem_euclid(4) as usize]
        }
        // A vase on a table.
        _ => {
            let (dx, dy) = (x - 0.5, y - 0.58);
            let belly = 0.10 + 0.07 * (dy * 14.0).cos();
            if y > 0.78 {
                v(0.34, 0.18, 0.09)
            } else if dy.abs() < 0.20 && dx.abs() < belly {
                v(0.16, 0.36, 0.60) * (1.0 - 2.5 * dx.abs())
            } else if noise(place, [14, 14]) > 0.5 && place.distance(Vec2::new(0.5, 0.26)) < 0.2 {
                v(0.82, 0.30, 0.36)
            } else {
                v(0.62, 0.58, 0.44) * (0.8 + 0.2 * noise(place, [6, 6]))
            }
        }
    }
}
