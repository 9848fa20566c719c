//! Wrought tea-stands with china on them: after figure 10 of Bala, Walter & Greenberg 2003.

use glam::{Affine3A, DVec3, Quat, Vec2, Vec3};

use super::pattern::{planks, textured};
use super::solid::{arc, ball, blocks, lathe, put, rod, sweep, torus};
use crate::{Camera, FieldOfView, Geometry, LinearLight, Material, MaterialId, Mesh, MeshId, Object, Scene};

/// Height and radius of the rails of the three tiers (m), from below.
const TIERS: [(f32, f32); 3] = [(0.36, 0.33), (0.80, 0.26), (1.20, 0.19)];
/// How high the little fence around a tier is (m).
const FENCE: f32 = 0.085;
/// Half the inside of the room, and its height (m).
const ROOM: f32 = 5.0;
const HEIGHT: f32 = 3.0;

/// Four tea-stands in a room with three tubes, one of them near the camera; a lattice behind it.
pub(super) fn tea_stand() -> Scene {
    let mut scene = Scene::default();
    let mut paint = |name: &str, color: [f32; 3], roughness, metallic| {
        scene.add_material(Material {
            roughness,
            metallic,
            ..Material::diffuse(name, color.into())
        })
    };
    let wall = paint("wall", [0.76, 0.73, 0.66], 1.0, 0.0);
    let iron = paint("iron", [0.10, 0.10, 0.11], 0.5, 0.0);
    let china = paint("china", [0.82, 0.82, 0.80], 0.2, 0.0);
    let glaze = paint("glaze", [0.16, 0.30, 0.52], 0.2, 0.0);
    let cake = paint("cake", [0.66, 0.36, 0.24], 0.9, 0.0);
    let floor = textured(&mut scene, "boards", (256, 256), Vec2::splat(1.2), |place| {
        planks(place, 8, Vec3::new(0.34, 0.22, 0.13), Vec3::new(0.58, 0.42, 0.27))
    });
    let (out, across) = (ROOM + 0.2, [-ROOM, ROOM]);
    let planes = [-out, across[0], across[1], out];
    let room = blocks(
        [&planes, &[-0.2, 0.0, HEIGHT, HEIGHT + 0.2], &planes],
        |cell| cell != [1, 1, 1],
        |[_, j, _], normal| if j == 0 && normal.y > 0.0 { floor } else { wall },
    );
    scene.add_mesh(Mesh {
        name: "room".to_owned(),
        ..room
    });

    let parts = [
        ("stand", stand(iron)),
        ("china", service(china, glaze)),
        ("cakes", cakes(cake)),
        ("lattice", lattice(iron)),
    ];
    let first = scene.meshes.len();
    for (name, mesh) in parts {
        scene.meshes.push(Mesh {
            name: name.to_owned(),
            ..mesh
        });
    }
    let corners = [
        (3.8, -4.35, 20.0),
        (-3.75, -3.75, 130.0),
        (-3.75, 3.75, 200.0),
        (3.75, 3.75, 320.0),
    ];
    for (x, z, turn) in corners {
        for (part, name) in ["stand", "china", "cakes"].into_iter().enumerate() {
            scene.add_object(object(name, first + part, x, z, turn));
        }
    }
    for (x, z, turn) in [(1.1, -4.72, 0.0), (-4.72, -1.1, 90.0), (4.72, 1.1, -90.0)] {
        scene.add_object(object("lattice", first + 3, x, z, turn));
    }

    let mut light = |name: &str, a: [f64; 3], b: [f64; 3], flux, color: [f32; 3]| {
        let color = Vec3::from_array(color);
        scene.add_light(LinearLight {
            color: color / crate::luminance(color),
            ..LinearLight::new(name, DVec3::from_array(a), DVec3::from_array(b), flux)
        });
    };
    let (warm, white) = ([1.0, 0.82, 0.60], [1.0, 0.96, 0.90]);
    light("side", [4.8, 1.7, -2.0], [4.8, 1.95, -2.15], 2_400.0, white);
    light("right", [1.2, 2.7, -2.2], [4.2, 2.7, -2.2], 1_800.0, warm);
    light("left", [-3.4, 2.7, -1.6], [-3.4, 2.7, 1.6], 4_200.0, warm);
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(3.1, 1.45, 1.0),
        DVec3::new(3.4, 0.80, -4.6),
        DVec3::Y,
        FieldOfView::vertical_degrees(21.0),
    ));
    scene
}

fn object(name: &str, mesh: usize, x: f32, z: f32, turn: f32) -> Object {
    Object {
        name: name.to_owned(),
        geometry: Geometry::Mesh(MeshId::from(mesh)),
        transform: turned(turn, Vec3::new(x, 0.0, z)),
    }
}

fn turned(degrees: f32, to: Vec3) -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(degrees.to_radians()), to)
}

/// Points along a smooth curve through `knots` (Catmull-Rom), `parts` between each two.
fn through(knots: &[Vec3], parts: u16) -> Vec<Vec3> {
    let last = knots.len() - 1;
    let mut points = Vec::new();
    for i in 0..last {
        let [a, b, c, d] = [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| knots[k]);
        for step in 0..parts {
            let s = f32::from(step) / f32::from(parts);
            let (m, n) = (0.5 * (c - a), 0.5 * (d - b));
            let (s2, s3) = (s * s, s * s * s);
            points.push(
                (2.0 * s3 - 3.0 * s2 + 1.0) * b
                    + (s3 - 2.0 * s2 + s) * m
                    + (3.0 * s2 - 2.0 * s3) * c
                    + (s3 - s2) * n,
            );
        }
    }
    points.push(knots[last]);
    points
}

/// Four bent legs, three tiers with fences, scrolls between them, a ring to carry it by.
fn stand(iron: MaterialId) -> Mesh {
    let mut whole = Mesh::default();
    let [low, middle, high] = TIERS;
    // In the plane of a leg: (distance from the axis, height).
    let leg = [
        (0.46, 0.05),
        (0.43, 0.015),
        (0.36, 0.04),
        (low.1, 0.2),
        (low.1 + 0.012, low.0),
        (0.20, 0.60),
        (middle.1 + 0.012, middle.0),
        (0.15, 1.02),
        (high.1 + 0.012, high.0),
        (0.08, 1.42),
        (0.0, 1.50),
    ]
    .map(|(r, y)| Vec3::new(r, y, 0.0));
    let leg = sweep(&through(&leg, 5), |_| 0.0105, 8, iron);
    // A scroll: a spiral that opens towards the leg.
    let scroll = |center: Vec2, size: f32, from: f32| {
        let path: Vec<Vec3> = (0..=26u8)
            .map(|i| {
                let s = f32::from(i) / 26.0;
                let p = center + size * (0.15 + 0.85 * s) * Vec2::from_angle(from + 9.0 * s);
                Vec3::new(p.x, p.y, 0.0)
            })
            .collect();
        sweep(&path, |_| 0.0055, 6, iron)
    };
    let scrolls = [
        scroll(Vec2::new(0.115, 0.63), 0.085, 0.0),
        scroll(Vec2::new(0.25, 0.20), 0.085, 2.0),
        scroll(Vec2::new(0.075, 1.04), 0.062, 1.0),
    ];
    for quarter in 0..4u8 {
        let turn = 90.0 * f32::from(quarter);
        put(&mut whole, &leg, turned(turn, Vec3::ZERO));
        for scroll in &scrolls {
            put(&mut whole, scroll, turned(turn, Vec3::ZERO));
        }
        let foot = Quat::from_rotation_y(turn.to_radians()) * Vec3::new(0.36, 0.02, 0.0);
        put(
            &mut whole,
            &ball(0.02, 12, 8, iron),
            Affine3A::from_translation(foot),
        );
    }
    for ((height, radius), pickets) in TIERS.into_iter().zip([32u16, 24, 16]) {
        for (y, wire) in [(height, 0.009), (height + FENCE, 0.006)] {
            let rail = torus(radius, wire, 64, 8, iron);
            put(&mut whole, &rail, Affine3A::from_translation(Vec3::Y * y));
        }
        let picket = rod(
            Vec3::new(radius, height, 0.0),
            Vec3::new(radius, height + FENCE, 0.0),
            0.0032,
            6,
            iron,
        );
        for i in 0..pickets {
            let turn = 360.0 * (f32::from(i) + 0.5) / f32::from(pickets);
            put(&mut whole, &picket, turned(turn, Vec3::ZERO));
        }
        // A cross of flat rods carries the plate.
        for turn in [45.0, 135.0] {
            let bar = rod(
                Vec3::new(-radius, height, 0.0),
                Vec3::new(radius, height, 0.0),
                0.005,
                6,
                iron,
            );
            put(&mut whole, &bar, turned(turn, Vec3::ZERO));
        }
    }
    let handle = Affine3A::from_rotation_translation(
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        Vec3::Y * 1.565,
    );
    put(&mut whole, &torus(0.055, 0.008, 32, 8, iron), handle);
    whole
}

fn profile<const N: usize>(points: [(f32, f32); N], scale: f32) -> [Vec2; N] {
    points.map(|(r, y)| scale * Vec2::new(r, y))
}

/// Three plates, a teapot and six cups on saucers.
fn service(china: MaterialId, glaze: MaterialId) -> Mesh {
    let mut whole = Mesh::default();
    let plate = profile(
        [
            (0.0, 0.0),
            (0.6, 0.0),
            (0.85, 0.03),
            (1.0, 0.09),
            (1.0, 0.115),
            (0.84, 0.06),
            (0.6, 0.03),
            (0.0, 0.03),
        ],
        1.0,
    );
    for (height, radius) in TIERS {
        let plate = plate.map(|p| (radius - 0.025) * p);
        let mesh = lathe(&plate, 64, 50.0, china);
        put(
            &mut whole,
            &mesh,
            Affine3A::from_translation(Vec3::Y * (height + 0.006)),
        );
    }
    let (cup, saucer) = (cup(china, glaze), saucer(china));
    for (tier, count, radius) in [(0, 4u8, 0.19), (1, 3, 0.14)] {
        let floor = TIERS[tier].0 + 0.006 + 0.03 * (TIERS[tier].1 - 0.025);
        for i in 0..count {
            let turn = 360.0 * f32::from(i) / f32::from(count) + 30.0;
            let place = turned(turn, Vec3::ZERO) * turned(70.0, Vec3::new(radius, floor, 0.0));
            put(&mut whole, &saucer, place);
            put(
                &mut whole,
                &cup,
                place * Affine3A::from_translation(Vec3::Y * 0.008),
            );
        }
    }
    let floor = TIERS[0].0 + 0.006 + 0.03 * (TIERS[0].1 - 0.025);
    put(
        &mut whole,
        &teapot(glaze),
        turned(200.0, Vec3::new(0.0, floor, 0.0)),
    );
    whole
}

fn saucer(china: MaterialId) -> Mesh {
    let points = [
        (0.0, 0.0),
        (0.03, 0.0),
        (0.062, 0.010),
        (0.062, 0.013),
        (0.03, 0.006),
        (0.0, 0.006),
    ];
    lathe(&profile(points, 1.0), 32, 50.0, china)
}

fn cup(china: MaterialId, glaze: MaterialId) -> Mesh {
    let points = [
        (0.0, 0.0),
        (0.018, 0.0),
        (0.020, 0.006),
        (0.032, 0.022),
        (0.038, 0.045),
        (0.041, 0.060),
        (0.038, 0.060),
        (0.035, 0.044),
        (0.028, 0.022),
        (0.0, 0.010),
    ];
    let mut whole = lathe(&profile(points, 1.0), 32, 50.0, china);
    let ear = [
        (0.036, 0.050),
        (0.056, 0.050),
        (0.060, 0.034),
        (0.048, 0.022),
        (0.031, 0.022),
    ]
    .map(|(x, y)| Vec3::new(x, y, 0.0));
    put(
        &mut whole,
        &sweep(&through(&ear, 4), |_| 0.0036, 8, glaze),
        Affine3A::IDENTITY,
    );
    whole
}

fn teapot(glaze: MaterialId) -> Mesh {
    let points = [
        (0.0, 0.0),
        (0.055, 0.0),
        (0.058, 0.006),
        (0.078, 0.030),
        (0.090, 0.062),
        (0.086, 0.095),
        (0.066, 0.122),
        (0.040, 0.134),
        (0.042, 0.139),
        (0.024, 0.152),
        (0.010, 0.158),
        (0.015, 0.172),
        (0.0, 0.180),
    ];
    let mut whole = lathe(&profile(points, 1.0), 48, 55.0, glaze);
    let spout =
        [(0.070, 0.045), (0.115, 0.060), (0.130, 0.105), (0.158, 0.135)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let spout = sweep(
        &through(&spout, 6),
        |i| 0.022 - 0.013 * (i as f32 / 18.0),
        12,
        glaze,
    );
    put(&mut whole, &spout, Affine3A::IDENTITY);
    let ear = [
        (-0.080, 0.115),
        (-0.125, 0.125),
        (-0.142, 0.085),
        (-0.122, 0.045),
        (-0.078, 0.040),
    ]
    .map(|(x, y)| Vec3::new(x, y, 0.0));
    put(
        &mut whole,
        &sweep(&through(&ear, 6), |_| 0.0075, 10, glaze),
        Affine3A::IDENTITY,
    );
    whole
}

/// A heap of small cakes on the uppermost plate.
fn cakes(cake: MaterialId) -> Mesh {
    let mut whole = Mesh::default();
    let floor = TIERS[2].0 + 0.006 + 0.03 * (TIERS[2].1 - 0.025);
    let bun: Vec<Vec2> = std::iter::once(Vec2::ZERO)
        .chain(arc(Vec2::new(0.0, 0.016), 0.034, -20.0, 90.0, 8))
        .map(|p| Vec2::new(p.x, p.y.max(0.0)))
        .collect();
    let bun = lathe(&bun, 20, 60.0, cake);
    for i in 0..6u8 {
        let place = turned(60.0 * f32::from(i), Vec3::ZERO) * turned(0.0, Vec3::new(0.09, floor, 0.0));
        put(&mut whole, &bun, place);
    }
    put(
        &mut whole,
        &bun,
        Affine3A::from_translation(Vec3::Y * (floor + 0.030)),
    );
    whole
}

/// A screen of thin crossing rods in a frame, 1.6 m wide and 1.8 m high, facing +z.
fn lattice(iron: MaterialId) -> Mesh {
    let mut whole = Mesh::default();
    let (half, height) = (0.8, 1.8);
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let mut bar = |a: Vec3, b: Vec3, radius: f32| {
        put(&mut whole, &rod(a, b, radius, 8, iron), Affine3A::IDENTITY);
    };
    for x in [-half, half] {
        bar(corner(x, 0.0), corner(x, height), 0.014);
    }
    for y in [0.12, height - 0.02] {
        bar(corner(-half, y), corner(half, y), 0.010);
    }
    // Two families of slanted rods, cut off at the frame, one in front of the other.
    let (bottom, top) = (0.12, height - 0.02);
    for family in [-1.0f32, 1.0] {
        for i in -12i8..=12 {
            // The rod x = x0 + family * (y - bottom), between the uprights and the rails.
            let x0 = 0.2 * f32::from(i);
            let at = |x: f32| bottom + family * (x - x0);
            let (y0, y1) = (at(-half * family).max(bottom), at(half * family).min(top));
            if y1 - y0 < 0.05 {
                continue;
            }
            let point = |y: f32| Vec3::new(x0 + family * (y - bottom), y, 0.004 * family);
            bar(point(y0), point(y1), 0.0045);
        }
    }
    whole
}
