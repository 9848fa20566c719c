//! Trials of any exact segment oracle against brute force, in any number.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Geometry, Material, MaterialId, Mesh, MeshId, Object, Scene, SegmentOracle};
use llsr_visibility::{Certificate, Partition};
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use super::{disagreement, fan_cells, torus, world_triangles};

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
    /// Fans that are partly hidden.
    pub partly: u64,
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
/// Each scene serves twenty fans. Ends are compared to within `tolerance` times their condition number.
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
        let scene = scene_of([(mesh, Affine3A::from_quat(turn))]);
        let triangles = world_triangles(&scene);
        let oracle = build(&scene);
        for _ in 0..20 {
            let mut point = |size| {
                let x = within(rng, size);
                match rng.next_u32() % 8 {
                    0 => (x * 4.0).round() / 4.0,
                    1 => {
                        let [u, v, w] =
                            triangles[rng.next_u32() as usize % triangles.len()].map(|v| v.as_dvec3());
                        u + (v - u) * (0.5 * unit(rng)) + (w - u) * (0.5 * unit(rng))
                    }
                    _ => x,
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
            result.missed += u64::from(found.missed > 0.0);
            result.invented += u64::from(found.invented > 0.0);
        }
    }
    result
}

/// Fans that start inside closed meshes and end outside: nothing may be visible, not even a slit.
///
/// Tori and boxes, rotated, at scales from 1e-3 to 1e5 m and as far from the origin as leaves single precision the room to describe them,
/// up to 1e6 m.
pub fn leak_trials<O: SegmentOracle>(
    rng: &mut Pcg64Mcg,
    fans: u64,
    build: impl Fn(&Scene) -> O,
) -> FanTrials {
    let mut result = FanTrials::default();
    let (mut scratch, mut visible) = (O::Scratch::default(), Partition::default());
    while result.fans < fans {
        let scale = 10f64.powf(8.0 * unit(rng) - 3.0);
        // The coordinates keep at least 12 bits for the shape.
        let distance = (scale * 4096.0).min(1e6) * unit(rng);
        let offset = within(rng, distance).as_vec3().as_dvec3();
        let turn = rotation(rng);
        let place =
            Affine3A::from_scale_rotation_translation(Vec3::splat(scale as f32), turn, offset.as_vec3());
        let ring = rng.next_u32().is_multiple_of(2);
        let mesh = if ring {
            torus(1.0, 0.4, 40, 24, MaterialId(0))
        } else {
            Mesh::cuboid("box", Vec3::splat(-1.0), Vec3::splat(1.0), MaterialId(0))
        };
        let oracle = build(&scene_of([(mesh, place)]));
        let world = |x: DVec3| (turn.as_dquat() * x) * scale + offset;
        for _ in 0..500.min(fans) {
            let (p, outside) = if ring {
                let angle = 6.3 * unit(rng);
                let around = DVec3::new(angle.cos(), 0.0, angle.sin());
                // In the ring's middle or anywhere well inside; the light is above, beside or in the hole's axis.
                (around + within(rng, 0.15), DVec3::new(0.0, 0.7, 0.0))
            } else {
                (within(rng, 0.99), DVec3::new(0.0, 2.0, 0.0))
            };
            let a = outside + within(rng, 0.2);
            let b = outside + DVec3::new(3.0, 1.0, 0.5) * unit(rng) + within(rng, 0.2);
            oracle.visible_part(world(p), world(a), world(b), &mut scratch, &mut visible);
            result.fans += 1;
            result.uncertified += u64::from(visible.certificate() != Certificate::Exact);
            result.missed += u64::from(!visible.is_dark());
        }
    }
    result
}

/// Fans over a closed mesh seen from outside, edge-on included: each hidden stretch is one piece per body, without slits.
///
/// A single box is convex, so that its shadow on the light is one interval. Points lie in the planes of faces and on the lines of
/// edges now and then.
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
        let oracle = build(&scene_of([(mesh, place)]));
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
            // A hidden interval in the middle leaves two panels.
            let inner = visible
                .panels()
                .iter()
                .filter(|x| 0.0 < x.start && x.end < 1.0)
                .count();
            result.missed += u64::from(inner > 0 || visible.panels().len() > 2);
        }
    }
    result
}
