//! Scenes whose shadows are easy, and scenes whose shadows are not, with a measure of what an edge finder found there.

use std::f32::consts::TAU;

use glam::{Affine3A, DVec3, EulerRot, Quat, Vec3};
use llsr_scene::{
    Geometry, Light, LightId, LinearLight, Material, MaterialId, Mesh, MeshId, Object, ObjectId, Scene,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::shadows::{LightClass, ShadowCoverage, ShadowOracle, class_changes};
use super::{bumpy_sphere, chain_link, torus};
use crate::tracer::world_triangles;

/// A scene of meshes under one or more lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowScenes {
    /// A box in some position above a floor.
    Box,
    /// A convex solid of many faces.
    Ball,
    /// Nine convex solids whose shadows do not touch.
    Apart,
    /// Twenty boxes, many behind others.
    Crowd,
    /// A torus above a floor and a step; also its shadow on itself.
    Torus,
    /// Twisted sheets with boundaries.
    Sheets,
    /// A sphere with bumps and dents.
    Rough,
    /// Interlocking links of a chain.
    Chain,
    /// A wall with a window of eight corners.
    Window,
}

impl ShadowScenes {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Box,
        Self::Ball,
        Self::Apart,
        Self::Crowd,
        Self::Torus,
        Self::Sheets,
        Self::Rough,
        Self::Chain,
        Self::Window,
    ];

    /// One convex blocker, or several without overlap.
    pub fn is_simple(self) -> bool {
        matches!(self, Self::Box | Self::Ball | Self::Apart)
    }

    /// Builds it in a random position under one linear light.
    pub fn build(self, seed: u64) -> Scene {
        let random = &mut Pcg64Mcg::seed_from_u64(seed);
        let mut scene = Scene::new(format!("{self:?}"));
        scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        let floor = [[-6.0, -6.0], [-6.0, 6.0], [6.0, 6.0], [6.0, -6.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        scene.add_mesh(Mesh::quad("floor", floor, MaterialId(0)));
        let cube = || Mesh::cuboid("box", Vec3::splat(-0.5), Vec3::splat(0.5), MaterialId(0));
        match self {
            Self::Box => place(&mut scene, cube(), turned(random, 1.0, Vec3::Y * 1.5)),
            Self::Ball => {
                let mesh = bumpy_sphere(12, 0.0, 1);
                place(&mut scene, mesh, turned(random, 0.6, Vec3::Y * 1.5));
            }
            Self::Apart => {
                for i in 0..9u8 {
                    let at = Vec3::new(3.2 * f32::from(i % 3) - 3.2, 0.5, 3.2 * f32::from(i / 3) - 3.2);
                    let mesh = if i % 2 == 0 {
                        cube()
                    } else {
                        bumpy_sphere(6, 0.0, 1)
                    };
                    place(&mut scene, mesh, turned(random, 0.4, at));
                }
            }
            Self::Crowd => {
                // None of them inside another: there the surface of both together has edges that neither has.
                let mut boxes: Vec<(Vec3, f32)> = Vec::new();
                while boxes.len() < 20 {
                    let at = Vec3::new(symmetric(random), 0.6 + 0.8 * unit(random), symmetric(random)) * 1.6;
                    let size = 0.2 + 0.4 * unit(random);
                    if boxes
                        .iter()
                        .all(|(other, s)| other.distance(at) > 0.87 * (size + s))
                    {
                        boxes.push((at, size));
                        place(&mut scene, cube(), turned(random, size, at));
                    }
                }
            }
            Self::Torus => {
                let step = Mesh::cuboid(
                    "step",
                    Vec3::new(0.3, 0.0, -3.0),
                    Vec3::new(4.0, 0.4, 3.0),
                    MaterialId(0),
                );
                scene.add_mesh(step);
                place(
                    &mut scene,
                    torus(1.0, 0.35, 24, 12),
                    turned(random, 0.9, Vec3::Y * 1.8),
                );
            }
            Self::Sheets => {
                for i in 0..4u8 {
                    let at = Vec3::new(
                        f32::from(i) - 1.5,
                        1.0 + 0.3 * f32::from(i),
                        0.4 * symmetric(random),
                    );
                    // None that cuts another: along the cut the surface of both has an edge that neither has.
                    let before: Vec<[Vec3; 3]> = world_triangles(&scene).split_off(2);
                    loop {
                        let (mesh, transform) = (sheet(random), turned(random, 0.5, at));
                        let this: Vec<[Vec3; 3]> = (0..mesh.triangles.len())
                            .map(|i| mesh.corners(i).map(|p| transform.transform_point3(p)))
                            .collect();
                        if !any_side_cut(&this, &before) && !any_side_cut(&before, &this) {
                            place(&mut scene, mesh, transform);
                            break;
                        }
                    }
                }
            }
            Self::Rough => place(
                &mut scene,
                bumpy_sphere(10, 0.5, seed),
                turned(random, 0.7, Vec3::Y * 1.9),
            ),
            Self::Chain => {
                for i in 0..3u8 {
                    let link = chain_link(Vec3::ZERO, 0.5, i % 2 == 1, 24, 10);
                    let at = Vec3::new(0.95 * f32::from(i) - 0.95, 1.6, 0.0);
                    let lean = Quat::from_euler(
                        EulerRot::XYZ,
                        0.1 * symmetric(random),
                        0.3 * symmetric(random),
                        0.1,
                    );
                    place(&mut scene, link, Affine3A::from_rotation_translation(lean, at));
                }
            }
            Self::Window => place(&mut scene, window(), turned(random, 0.8, Vec3::Y * 1.8)),
        }
        let height = if self == Self::Apart {
            4.5
        } else {
            3.6 + f64::from(unit(random))
        };
        let middle = DVec3::new(f64::from(symmetric(random)), height, f64::from(symmetric(random)));
        let half = 0.5
            * DVec3::new(
                f64::from(symmetric(random)),
                0.3 * f64::from(symmetric(random)),
                f64::from(symmetric(random)),
            )
            .normalize()
            * if self == Self::Apart {
                0.4
            } else {
                0.4 + 1.2 * f64::from(unit(random))
            };
        scene.add_light(LinearLight::new("tube", middle - half, middle + half, 1000.0));
        scene
    }
}

fn unit(random: &mut Pcg64Mcg) -> f32 {
    (random.next_u32() >> 8) as f32 / (1u32 << 24) as f32
}

fn symmetric(random: &mut Pcg64Mcg) -> f32 {
    2.0 * unit(random) - 1.0
}

fn turned(random: &mut Pcg64Mcg, size: f32, at: Vec3) -> Affine3A {
    let angles = [0; 3].map(|_| TAU * unit(random));
    let turn = Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
    Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, at)
}

fn place(scene: &mut Scene, mesh: Mesh, transform: Affine3A) {
    let name = mesh.name.clone();
    scene.meshes.push(mesh);
    let geometry = Geometry::Mesh(MeshId::from(scene.meshes.len() - 1));
    scene.add_object(Object {
        name,
        geometry,
        transform,
    });
}

/// A saddle of 6 by 6 cells with random heights.
fn sheet(random: &mut Pcg64Mcg) -> Mesh {
    let n = 6u32;
    let mut mesh = Mesh {
        name: "sheet".into(),
        ..Mesh::default()
    };
    for i in 0..=n {
        for j in 0..=n {
            let (u, v) = (2.0 * i as f32 / n as f32 - 1.0, 2.0 * j as f32 / n as f32 - 1.0);
            mesh.positions
                .push(Vec3::new(u, 0.6 * u * v + 0.15 * unit(random), v));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            mesh.triangles
                .extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }
    mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
    mesh
}

/// Does a side of one of the triangles `a` go through one of `b`?
fn any_side_cut(a: &[[Vec3; 3]], b: &[[Vec3; 3]]) -> bool {
    let b = ShadowOracle::new(b);
    let sides = a.iter().flat_map(|&[x, y, z]| [[x, y], [y, z], [z, x]]);
    sides
        .map(|side| side.map(Vec3::as_dvec3))
        .any(|[p, q]| b.is_cut(p, q))
}

/// A slab around an octagonal hole.
fn window() -> Mesh {
    let mut mesh = Mesh {
        name: "window".into(),
        ..Mesh::default()
    };
    let n = 8u32;
    let angle = |i: u32| TAU * i as f32 / n as f32;
    for (radius, y) in [(0.5, 0.05), (1.5, 0.05), (1.5, -0.05), (0.5, -0.05)] {
        for i in 0..n {
            let (sin, cos) = angle(i).sin_cos();
            mesh.positions.push(Vec3::new(radius * cos, y, -radius * sin));
        }
    }
    for ring in 0..4 {
        for i in 0..n {
            let [a, b, c, d] = [
                ring * n + i,
                (ring + 1) % 4 * n + i,
                (ring + 1) % 4 * n + (i + 1) % n,
                ring * n + (i + 1) % n,
            ];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh.materials = vec![MaterialId(0); mesh.triangles.len()];
    mesh
}

/// Random segments on the faces of all receivers, the class changes along them, and the share that lies within 1e-4 of
/// the scene's size of an edge.
///
/// `edges` gives the segments of a light and a receiver at which the class may change between lit and not lit, and
/// between dark and not dark. A face is a receiver if the whole light is before it. Changes that were not found are
/// passed to `lost`.
pub fn shadow_coverage(
    scene: &Scene,
    segments: u32,
    seed: u64,
    mut edges: impl FnMut(LightId, ObjectId) -> [Vec<[Vec3; 2]>; 2],
    mut lost: impl FnMut(ObjectId, &super::ClassChange),
) -> ShadowCoverage {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let oracle = ShadowOracle::new(&world_triangles(scene));
    let near = 1e-4 * f64::from(scene.bounds().diagonal());
    let mut coverage = ShadowCoverage::default();
    let mut scratch = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        let ends = match light {
            Light::Linear(light) => [light.a, light.b],
            Light::Point(light) => [light.position; 2],
            Light::Area(_) => continue,
        };
        let receivers: Vec<(ObjectId, Vec<[DVec3; 3]>)> = (0..scene.objects.len())
            .map(|o| (ObjectId::from(o), lit_faces(scene, o, ends)))
            .filter(|(_, faces)| !faces.is_empty())
            .collect();
        let areas: Vec<f64> = receivers
            .iter()
            .map(|(_, faces)| faces.iter().map(area).sum())
            .collect();
        for ((receiver, faces), &all) in receivers.iter().zip(&areas) {
            let [outer, inner] = edges(LightId::from(index), *receiver);
            // Half of the segments on the floor, the rest by area.
            let whole: f64 = areas[1..].iter().sum();
            let share = if receiver.0 == 0 { 0.5 } else { 0.5 * all / whole };
            let count = (f64::from(segments) * share).ceil() as u32;
            for _ in 0..count {
                let face = pick(faces, all * f64::from(unit(random)));
                let mut inside = || {
                    let (mut u, mut v) = (f64::from(unit(random)), f64::from(unit(random)));
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    face[0] + (face[1] - face[0]) * u + (face[2] - face[0]) * v
                };
                let segment = [inside(), inside()];
                let samples = if receiver.0 == 0 { 96 } else { 12 };
                let changes = class_changes(segment, samples, |p| {
                    oracle.class(p, ends[0], ends[1], &mut scratch)
                });
                for change in &changes {
                    let hard = ends[0] == ends[1];
                    let mut change = *change;
                    if hard {
                        change.between = [LightClass::Lit, LightClass::Umbra];
                    }
                    if !coverage.count(&change, &outer, &inner, near) {
                        lost(*receiver, &change);
                    }
                }
            }
        }
    }
    coverage
}

pub(super) fn lit_faces(scene: &Scene, object: usize, ends: [DVec3; 2]) -> Vec<[DVec3; 3]> {
    let Object {
        geometry, transform, ..
    } = &scene.objects[object];
    let Geometry::Mesh(mesh) = geometry else {
        return Vec::new();
    };
    let mesh = &scene.meshes[mesh.index()];
    (0..mesh.triangles.len())
        .map(|i| mesh.corners(i).map(|p| transform.transform_point3(p).as_dvec3()))
        .filter(|[a, b, c]| ends.iter().all(|&l| (*b - a).cross(*c - a).dot(l - a) > 0.0))
        .collect()
}

pub(super) fn area([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

fn pick(faces: &[[DVec3; 3]], mut at: f64) -> [DVec3; 3] {
    for face in faces {
        at -= area(face);
        if at <= 0.0 {
            return *face;
        }
    }
    faces[faces.len() - 1]
}
