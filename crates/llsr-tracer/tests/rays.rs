//! Ray queries against exact brute force.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_scene::{Geometry, Material, MaterialId, Mesh, MeshId, Object, Primitive, Scene, Shape};
use llsr_testkit::tracer::{segment_is_cut, torus, world_triangles};
use llsr_tracer::{Instructions, Surface, Tracer};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const ALL: [Instructions; 3] = [Instructions::Portable, Instructions::Avx2, Instructions::Avx512];

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn point(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

fn scene_of(meshes: impl IntoIterator<Item = (Mesh, Affine3A)>) -> Scene {
    let mut scene = Scene::new("test");
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

fn soup(rng: &mut Pcg64Mcg, count: usize, size: f64) -> Mesh {
    let mut positions = Vec::new();
    for _ in 0..count {
        let at = point(rng, 1.0);
        positions.extend((0..3).map(|_| (at + point(rng, size)).as_vec3()));
    }
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new("soup", positions, triangles, MaterialId(0))
}

#[test]
fn occlusion_agrees_with_exact_brute_force() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (count, size) in [(1, 0.5), (9, 0.3), (300, 0.1)] {
        let scene = scene_of([(soup(&mut rng, count, size), Affine3A::IDENTITY)]);
        let triangles = world_triangles(&scene);
        let (mut tracer, warnings) = Tracer::new(&scene);
        assert!(
            warnings.is_empty(),
            "nothing is wrong with the soup: {warnings:?}"
        );
        let mut cut = 0;
        for _ in 0..300 {
            let (p, q) = (point(&mut rng, 1.2), point(&mut rng, 1.2));
            let expected = segment_is_cut(&triangles, p, q);
            cut += u32::from(expected);
            for instructions in ALL {
                tracer.restrict(instructions);
                assert_eq!(tracer.occluded(p, q), expected, "{p} to {q}, {instructions:?}");
                assert_eq!(tracer.occluded(q, p), expected, "{q} to {p}, {instructions:?}");
            }
        }
        assert!(
            count == 1 || (10..300).contains(&cut),
            "both answers occur: {cut} of 300"
        );
    }
}

#[test]
fn segments_through_shared_vertices_and_edges_do_not_leak() {
    // Flat grid of integer vertices; rays aim at vertices and at points of edges.
    let n = 12;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            positions.push(Vec3::new(i as f32, 0.0, j as f32));
            if i < n && j < n {
                let at = |i: u32, j: u32| i * (n + 1) + j;
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    let scene = scene_of([(
        Mesh::new("grid", positions, triangles, MaterialId(0)),
        Affine3A::IDENTITY,
    )]);
    let (mut tracer, _) = Tracer::new(&scene);
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for distance in [3.0, 1e4] {
        for _ in 0..2000 {
            let i = 1 + rng.next_u32() % (n - 1);
            let j = 1 + rng.next_u32() % (n - 1);
            let target = DVec3::new(f64::from(i), 0.0, f64::from(j));
            let above = target + point(&mut rng, 1.0) + DVec3::Y * distance;
            // Mirrored through the target in exact arithmetic where the numbers allow it, nearly so otherwise.
            let below = target + (target - above);
            for instructions in ALL {
                tracer.restrict(instructions);
                assert!(tracer.occluded(above, below), "leak at {target} from {above}");
                let direction = (target - above).normalize();
                let hit = tracer.closest(above, direction, f64::INFINITY);
                assert!(hit.is_some(), "closest leaks at {target} from {above}");
            }
        }
    }
}

#[test]
fn closest_gives_the_first_crossing() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let tilt = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.7), Vec3::new(0.2, 0.1, 0.0));
    let scene = scene_of([
        (soup(&mut rng, 100, 0.2), Affine3A::IDENTITY),
        (torus(0.7, 0.2, 40, 20, MaterialId(0)), tilt),
    ]);
    let triangles = world_triangles(&scene);
    let (mut tracer, _) = Tracer::new(&scene);
    let mut hits = 0;
    for _ in 0..500 {
        let (origin, target) = (point(&mut rng, 2.0), point(&mut rng, 0.7));
        let direction = (target - origin).normalize();
        tracer.restrict(Instructions::Portable);
        let hit = tracer.closest(origin, direction, 10.0);
        for instructions in ALL {
            tracer.restrict(instructions);
            assert_eq!(tracer.closest(origin, direction, 10.0), hit, "{instructions:?}");
        }
        let Some(hit) = hit else {
            let end = origin + direction * 10.0;
            assert!(
                !segment_is_cut(&triangles, origin, end),
                "missed from {origin} to {target}"
            );
            continue;
        };
        hits += 1;
        let along = origin + direction * hit.t;
        assert!(along.distance(hit.position) < 1e-12, "t and position agree");
        // Nothing lies between the origin and a point just before the hit, something just behind it.
        let before = origin + direction * (hit.t - 1e-9);
        let behind = origin + direction * (hit.t + 1e-9);
        assert!(!segment_is_cut(&triangles, origin, before), "something is nearer");
        assert!(segment_is_cut(&triangles, origin, behind), "nothing is there");
    }
    assert!(hits > 100, "rays meet the scene: {hits}");
}

#[test]
fn surfaces_do_not_shadow_themselves_wherever_they_are() {
    // Tilted quads far from the origin, lit at grazing angles down to 1e-6.
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    for offset in [0.0f32, 10.0, 1e3, 1e6] {
        // Numbers that single precision holds exactly, so that the quad is flat.
        let size = (1.0 + offset * 1e-4).log2().ceil().exp2();
        let center = Vec3::new(offset, -offset, (0.3 * offset).round());
        let u = Vec3::new(0.75, 0.25, 0.125) * size;
        let v = Vec3::new(-0.25, 0.125, 0.875) * size;
        let quad = Mesh::quad(
            "quad",
            [center - u - v, center + u - v, center + u + v, center - u + v],
            MaterialId(0),
        );
        let (tracer, _) = Tracer::new(&scene_of([(quad, Affine3A::IDENTITY)]));
        let center = center.as_dvec3();
        let (u, v) = (u.as_dvec3(), v.as_dvec3());
        let normal = u.cross(v).normalize();
        for _ in 0..500 {
            let aim = center + u * (1.6 * unit(&mut rng) - 0.8) + v * (1.6 * unit(&mut rng) - 0.8);
            let eye = aim + (normal + point(&mut rng, 0.5)) * f64::from(size);
            let hit = tracer
                .closest(eye, (aim - eye).normalize(), f64::INFINITY)
                .expect("the quad is hit");
            let start = hit.leave(eye - aim);
            let grazing = 10f64.powf(-6.0 * unit(&mut rng));
            let side = (u * (unit(&mut rng) - 0.5) + v * (unit(&mut rng) - 0.5)).normalize();
            let light = hit.position
                + (side + hit.normal * grazing.copysign(hit.normal.dot(eye - aim))) * f64::from(size);
            assert!(
                !tracer.occluded(start, light),
                "shadows itself at {offset}, grazing {grazing}"
            );
            let other_side = hit.position - normal.normalize() * f64::from(size) * 0.5;
            assert!(
                tracer.occluded(start, other_side),
                "lets light through at {offset}"
            );
        }
    }
}

#[test]
fn primitives_are_hit_and_do_not_shadow_themselves() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let shapes = [
        Shape::Sphere {
            center: Vec3::new(0.1, 0.2, 0.3),
            radius: 0.5,
        },
        Shape::Cylinder {
            a: Vec3::new(-0.4, 0.0, 0.1),
            b: Vec3::new(0.3, 0.5, 0.2),
            radius: 0.3,
            capped: true,
        },
        Shape::Cone {
            base: Vec3::new(0.0, -0.4, 0.0),
            apex: Vec3::new(0.2, 0.5, 0.1),
            radius: 0.4,
            capped: true,
        },
    ];
    for shape in shapes {
        for offset in [0.0f32, 1e4] {
            let mut scene = Scene::new("shape");
            scene.add_primitive(
                "shape",
                Primitive {
                    shape,
                    material: MaterialId(0),
                },
            );
            scene.objects[0].transform = Affine3A::from_scale_rotation_translation(
                Vec3::new(1.0, 1.5, 0.8),
                Quat::from_rotation_z(0.4),
                Vec3::splat(offset),
            );
            let (tracer, warnings) = Tracer::new(&scene);
            assert!(warnings.is_empty(), "the shape is usable");
            let middle = scene.objects[0]
                .transform
                .transform_point3(shape.bounds().center())
                .as_dvec3();
            for _ in 0..300 {
                let eye = middle + point(&mut rng, 1.0).normalize() * 3.0;
                let direction = (middle - eye).normalize();
                let hit = tracer
                    .closest(eye, direction, f64::INFINITY)
                    .expect("the middle is inside");
                assert_eq!(hit.surface, Surface::Primitive, "the only surface");
                assert!(hit.normal.dot(direction) < 0.0, "the outer side is seen");
                assert!(
                    hit.position.distance(eye + direction * hit.t) < 1e-9,
                    "the position is on the ray"
                );
                // The solid is convex: from outside the plane of the hit everything above it is seen.
                let start = hit.leave(-direction);
                let side = hit.normal.any_orthonormal_vector();
                for grazing in [1.0, 1e-3, 1e-5] {
                    let light = hit.position + (side + hit.normal * grazing) * 2.0;
                    assert!(
                        !tracer.occluded(start, light),
                        "{shape:?} shadows itself at {grazing}, {offset}"
                    );
                }
                assert!(
                    tracer.occluded(start, middle - direction * 5.0 + direction * 10.0),
                    "light passes"
                );
            }
        }
    }
}
