//! Textures by formula.

use glam::{Mat3, Vec2, Vec3};

use crate::{Material, MaterialId, Scene, Texture, TextureUse, Wrap, linear_to_srgb};

/// Adds a matte material whose texture of `width` x `height` pixels repeats every `size` metres.
///
/// `color` gives the linear albedo at a place of the texture in [0, 1)².
pub(super) fn textured(
    scene: &mut Scene,
    name: &str,
    (width, height): (u32, u32),
    size: Vec2,
    color: impl Fn(Vec2) -> Vec3,
) -> MaterialId {
    let extent = Vec2::new(width as f32, height as f32);
    let place = |i: u32| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / extent;
    let pixels = (0..width * height).map(|i| {
        let linear = color(place(i)).clamp(Vec3::ZERO, Vec3::ONE);
        linear
            .to_array()
            .map(|x| (linear_to_srgb(x) * 255.0).round() as u8)
    });
    let texture = scene.add_texture(Texture {
        name: name.to_owned(),
        width,
        height,
        pixels: pixels.collect(),
        wrap: [Wrap::Repeat; 2],
    });
    scene.add_material(Material {
        base_color_texture: Some(TextureUse {
            texture,
            transform: Mat3::from_scale(size.recip()),
        }),
        ..Material::diffuse(name, Vec3::ONE)
    })
}

/// Some number in [0, 1), always the same for the same arguments.
pub(super) fn hash(x: i32, y: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    (h ^ (h >> 15)) as f32 / 4_294_967_296.0
}

/// Smooth noise in [0, 1) over a lattice of `period` cells that repeats over [0, 1)².
pub(super) fn noise(place: Vec2, period: [i32; 2]) -> f32 {
    let scaled = place * Vec2::new(period[0] as f32, period[1] as f32);
    let cell = scaled.floor();
    let f = scaled - cell;
    let f = f * f * (3.0 - 2.0 * f);
    let at = |dx: i32, dy: i32| {
        hash(
            (cell.x as i32 + dx).rem_euclid(period[0]),
            (cell.y as i32 + dy).rem_euclid(period[1]),
        )
    };
    let low = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let high = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    low + (high - low) * f.y
}

/// Planks along v, `count` over the texture, each of its own shade, with grain and dark joints.
pub(super) fn planks(place: Vec2, count: i32, dark: Vec3, light: Vec3) -> Vec3 {
    let across = place.x * count as f32;
    let plank = across.floor() as i32;
    // Each plank ends somewhere else.
    let along = (place.y + hash(plank, 7)).fract();
    let edge = (across.fract() - 0.5).abs() > 0.48 || along > 0.994;
    let grain = noise(place, [count * 8, 3]) * 0.6 + noise(place, [count * 16, 8]) * 0.4;
    let shade = 0.25 * hash(plank, 3) + 0.75 * grain;
    dark.lerp(light, shade) * if edge { 0.45 } else { 1.0 }
}

/// Square tiles of two colours with pale joints; `count` tiles along each side.
pub(super) fn tiles(place: Vec2, count: i32, one: Vec3, other: Vec3) -> Vec3 {
    let scaled = place * count as f32;
    let (i, j) = (scaled.x.floor() as i32, scaled.y.floor() as i32);
    let inside = (scaled.fract() - 0.5).abs().max_element() < 0.485;
    let base = if (i + j).rem_euclid(2) == 0 { one } else { other };
    let vein = noise(place, [count * 3, count * 3]) * 0.5 + noise(place, [count * 9, count * 7]) * 0.5;
    if inside {
        base * (0.82 + 0.18 * vein)
    } else {
        Vec3::splat(0.35)
    }
}

/// Courses of bricks; `count` courses over the texture.
pub(super) fn bricks(place: Vec2, count: i32) -> Vec3 {
    let scaled = place * Vec2::new(count as f32 * 0.5, count as f32);
    let course = scaled.y.floor();
    let along = scaled.x + 0.5 * course.rem_euclid(2.0);
    let brick = along.floor().rem_euclid(count as f32 * 0.5);
    let mortar = along.fract() < 0.05 || scaled.y.fract() < 0.1;
    let rough = 0.8 + 0.2 * noise(place, [count * 8, count * 8]);
    if mortar {
        Vec3::new(0.55, 0.53, 0.48) * rough
    } else {
        Vec3::new(0.48, 0.2, 0.13).lerp(Vec3::new(0.62, 0.3, 0.2), hash(brick as i32, course as i32)) * rough
    }
}
