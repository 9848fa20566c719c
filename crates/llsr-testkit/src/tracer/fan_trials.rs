//! Trials of any exact segment oracle against brute force, in any number.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Geometry, Material, MaterialId, Mesh, MeshId, Object, Scene, SegmentOracle};
use llsr_visibility::{Certificate, Panel, Partition};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use super::{FanCell, disagreement, fan_cells, hare, hare_radius, torus, world_triangles};

/// What a number of trials found.
#[derive(Clone, Copy, Debug, Default)]
pub struct FanTrials {
    /// Fans tried.
    pub fans: u64,
    /// Fans whose answer was not certified exact.
    pub uncertified: u64,
    /// Fans that reported light where there is none.
    pub missed: u64,
    /// Fans that reported an occluder where there is none.
    pub invented: u64,
    /// Fans of which an end lies elsewhere than in exact arithmetic, no further than its condition number allows, but across a place
    /// where nothing ends.
    pub moved: u64,
    /// Fans that are partly hidden.
    pub partly: u64,
}

impl FanTrials {
    /// Adds what other trials found.
    pub fn add(&mut self, other: &Self) {
        self.fans += other.fans;
        self.uncertified += other.uncertified;
        self.missed += other.missed;
        self.invented += other.invented;
        self.moved += other.moved;
        self.partly += other.partly;
    }
}

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn within(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

fn rotation(rng: &mut Pcg64Mcg) -> Quat {
    let axis = within(rng, 1.0).normalize_or(DVec3::Y).as_vec3();
    Quat::from_axis_angle(axis, (unit(rng) * 6.3) as f32)
}

/// A scale from 1e-3 to 1e5 m, and a place up to 1e6 m away as far as single precision leaves at least 12 bits for the shape.
fn size_and_place(rng: &mut Pcg64Mcg) -> (f64, DVec3) {
    let scale = f64::from(10f64.powf(8.0 * unit(rng) - 3.0) as f32);
    let distance = (scale * 4096.0).min(1e6) * unit(rng);
    (scale, within(rng, distance).as_vec3().as_dvec3())
}

/// A scene of one object per mesh, each with its transform.
pub fn scene_of(meshes: impl IntoIterator<Item = (Mesh, Affine3A)>) -> Scene {
    let mut scene = Scene::new("trial");
    scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    for (mesh, transform) in meshes {
        scene.meshes.push(mesh);
        let geometry = Geometry::Mesh(MeshId::from(scene.meshes.len() - 1));
        scene.add_object(Object {
            name: "object".into(),
            geometry,
            transform,
        });
    }
    scene
}

/// A few triangles of all sizes and shapes, needles included; on a coarse grid now and then, so that planes, edges and
/// vertices coincide with the fan.
fn soup(rng: &mut Pcg64Mcg) -> Mesh {
    let count = 1 + rng.next_u32() % 40;
    let coarse = rng.next_u32().is_multiple_of(4);
    let mut positions = Vec::new();
    for _ in 0..count {
        let at = within(rng, 1.0);
        let size = 10f64.powf(-2.0 * unit(rng));
        let needle = if rng.next_u32().is_multiple_of(8) {
            1e-4
        } else {
            1.0
        };
        let side = within(rng, size);
        for corner in [DVec3::ZERO, side, side * unit(rng) + within(rng, size * needle)] {
            let v = at + corner;
            positions.push(if coarse { (v * 4.0).round() / 4.0 } else { v }.as_vec3());
        }
    }
    Mesh::new(
        "soup",
        positions,
        (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        MaterialId(0),
    )
}

/// Random triangles, closed bodies among them, against brute force in exact arithmetic.
///
/// A quarter of the scenes is scaled and moved, by 1e-3 to 1e5 and up to 1e6 m. Each scene serves twenty fans. Ends are compared to within `tolerance` times their condition number.
pub fn exactness_trials<O: SegmentOracle>(
    rng: &mut Pcg64Mcg,
    fans: u64,
    tolerance: f64,
    build: impl Fn(&Scene) -> O,
) -> FanTrials {
    let mut result = FanTrials::default();
    let (mut scratch, mut visible) = (O::Scratch::default(), Partition::default());
    while result.fans < fans {
        let mesh = match rng.next_u32() % 4 {
            0 => torus(0.7, 0.25, 9, 7, MaterialId(0)),
            1 => Mesh::cuboid(
                "box",
                Vec3::splat(-0.5),
                Vec3::new(0.5, 0.25, 0.75),
                MaterialId(0),
            ),
            _ => soup(rng),
        };
        let turn = if rng.next_u32().is_multiple_of(2) {
            rotation(rng)
        } else {
            Quat::IDENTITY
        };
        let (scale, offset) = if rng.next_u32().is_multiple_of(4) {
            size_and_place(rng)
        } else {
            (1.0, DVec3::ZERO)
        };
        let place =
            Affine3A::from_scale_rotation_translation(Vec3::splat(scale as f32), turn, offset.as_vec3());
        let scene = scene_of([(mesh, place)]);
        let triangles = world_triangles(&scene);
        let oracle = build(&scene);
        for _ in 0..20 {
            let mut point = |size| {
                let x = within(rng, size);
                match rng.next_u32() % 8 {
                    0 => (x * 4.0).round() / 4.0 * scale + offset,
                    1 => {
                        let [u, v, w] =
                            triangles[rng.next_u32() as usize % triangles.len()].map(|v| v.as_dvec3());
                        u + (v - u) * (0.5 * unit(rng)) + (w - u) * (0.5 * unit(rng))
                    }
                    _ => x * scale + offset,
                }
            };
            let [p, a, b] = [point(1.3), point(1.3), point(1.3)];
            // Fans that are all but a line have no useful condition number.
            if (a - p).cross(b - a).length() < 1e-6 * (a - p).length() * (b - a).length() {
                continue;
            }
            oracle.visible_part(p, a, b, &mut scratch, &mut visible);
            result.fans += 1;
            result.uncertified += u64::from(visible.certificate() != Certificate::Exact);
            result.partly += u64::from(visible.discontinuities() > 0);
            let found = disagreement(&fan_cells(&triangles, p, a, b), &visible, tolerance);
            result.moved += u64::from(found.moved > 0.0);
            result.missed += u64::from(found.missed > 0.0);
            result.invented += u64::from(found.invented > 0.0);
        }
    }
    result
}

/// Fans that start inside closed meshes and end outside: nothing may be visible, not even a slit.
///
/// Tori, boxes and hares, rotated, at scales from 1e-3 to 1e5 m and as far from the origin as leaves single precision the room to
/// describe them, up to 1e6 m.
pub fn leak_trials<O: SegmentOracle>(
    rng: &mut Pcg64Mcg,
    fans: u64,
    build: impl Fn(&Scene) -> O,
) -> FanTrials {
    let mut result = FanTrials::default();
    let (mut scratch, mut visible) = (O::Scratch::default(), Partition::default());
    let hare = hare(96, 60, MaterialId(0));
    while result.fans < fans {
        let (scale, offset) = size_and_place(rng);
        let turn = rotation(rng);
        let place =
            Affine3A::from_scale_rotation_translation(Vec3::splat(scale as f32), turn, offset.as_vec3());
        let body = match rng.next_u32() % 3 {
            0 => Body::Torus,
            1 => Body::Box,
            _ => Body::Hare,
        };
        let mesh = match body {
            Body::Torus => torus(1.0, 0.4, 40, 24, MaterialId(0)),
            Body::Box => Mesh::cuboid("box", Vec3::splat(-1.0), Vec3::splat(1.0), MaterialId(0)),
            Body::Hare => hare.clone(),
        };
        let oracle = build(&scene_of([(mesh, place)]));
        let world = |x: DVec3| (turn.as_dquat() * x) * scale + offset;
        for _ in 0..500.min(fans) {
            let (p, a, b) = body.fan(rng);
            oracle.visible_part(world(p), world(a), world(b), &mut scratch, &mut visible);
            result.fans += 1;
            result.uncertified += u64::from(visible.certificate() != Certificate::Exact);
            result.missed += u64::from(!visible.is_dark());
        }
    }
    result
}

/// A closed mesh that fans start in.
#[derive(Clone, Copy)]
enum Body {
    Torus,
    Box,
    Hare,
}

impl Body {
    /// A point inside and a light outside.
    fn fan(self, rng: &mut Pcg64Mcg) -> (DVec3, DVec3, DVec3) {
        let beyond = |rng: &mut Pcg64Mcg, outside: DVec3| {
            let a = outside + within(rng, 0.2);
            (
                a,
                outside + DVec3::new(3.0, 1.0, 0.5) * unit(rng) + within(rng, 0.2),
            )
        };
        match self {
            Self::Torus => {
                let angle = 6.3 * unit(rng);
                let around = DVec3::new(angle.cos(), 0.0, angle.sin());
                // In the ring's middle or anywhere well inside; the light is above, beside or in the hole's axis.
                let p = around + within(rng, 0.15);
                let (a, b) = beyond(rng, DVec3::new(0.0, 0.7, 0.0));
                (p, a, b)
            }
            Self::Box => {
                let p = within(rng, 0.99);
                let (a, b) = beyond(rng, DVec3::new(0.0, 2.0, 0.0));
                (p, a, b)
            }
            Self::Hare => {
                // Out to where flat triangles may lie below the formula's surface; the light starts at the ears.
                let direction = within(rng, 1.0).normalize_or(DVec3::Y);
                let p = direction * f64::from(hare_radius(direction.as_vec3())) * 0.8 * unit(rng);
                let (a, b) = beyond(rng, DVec3::new(0.5, 2.0, 0.0));
                (p, a, b)
            }
        }
    }
}

/// Fans over a closed mesh seen from outside, edge-on included: each hidden stretch is one piece per body, without slits.
///
/// A single box is convex, so that its shadow on the light is one interval. Points lie in the planes of faces and on the lines of
/// edges now and then. Turned, the corners are rounded and the two triangles of a face are folded by about 1e-7: a fan that
/// close to a face may truly pass through the fold, so that exact arithmetic decides whether an opening is a slit.
pub fn slit_trials<O: SegmentOracle>(
    rng: &mut Pcg64Mcg,
    fans: u64,
    build: impl Fn(&Scene) -> O,
) -> FanTrials {
    let mut result = FanTrials::default();
    let (mut scratch, mut visible) = (O::Scratch::default(), Partition::default());
    while result.fans < fans {
        let turn = rotation(rng);
        let mesh = Mesh::cuboid("box", Vec3::splat(-1.0), Vec3::splat(1.0), MaterialId(0));
        let aligned = rng.next_u32().is_multiple_of(2);
        let place = Affine3A::from_quat(if aligned { Quat::IDENTITY } else { turn });
        let scene = scene_of([(mesh, place)]);
        let oracle = build(&scene);
        for _ in 0..200.min(fans) {
            let mut point = |z: f64| {
                let mut x = within(rng, 3.0);
                x.z = z;
                for axis in 0..2 {
                    if rng.next_u32().is_multiple_of(4) {
                        x[axis] = if x[axis] < 0.0 { -1.0 } else { 1.0 };
                    }
                }
                if aligned { x } else { turn.as_dquat() * x }
            };
            // Beyond the box on both sides, so that neither p nor the light touches it.
            let [p, a, b] = [point(-2.0), point(2.0), point(2.5)];
            oracle.visible_part(p, a, b, &mut scratch, &mut visible);
            result.fans += 1;
            result.uncertified += u64::from(visible.certificate() != Certificate::Exact);
            result.partly += u64::from(visible.discontinuities() > 0);
            // Hidden in the middle, the light is seen in two panels that hold its ends.
            let slit = visible.panels().iter().any(|panel| {
                let inner = 0.0 < panel.start && panel.end < 1.0;
                inner && !is_open(&fan_cells(&world_triangles(&scene), p, a, b), panel)
            });
            result.missed += u64::from(slit);
        }
    }
    result
}

/// Does exact arithmetic see through some of this panel? Rounding makes no opening as wide as asked for here.
fn is_open(cells: &[FanCell], panel: &Panel) -> bool {
    cells
        .iter()
        .any(|cell| !cell.blocked && cell.hi.min(panel.end) - cell.lo.max(panel.start) > 1e-9)
}
