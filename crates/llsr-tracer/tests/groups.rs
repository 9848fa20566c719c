//! Queries for groups of rays and points against the queries for single ones.

use glam::{Affine3A, DVec3, Vec3};
use llsr_scene::{Material, MaterialId, Mesh, Primitive, Scene, Shape};
use llsr_testkit::tracer::{bumpy_knot, scene_of, segment_is_cut, torus, world_triangles};
use llsr_tracer::{FanQuery, FanScratch, Hit, Instructions, Shaft, Sight, Tracer};
use llsr_visibility::Partition;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const ALL: [Instructions; 3] = [Instructions::Portable, Instructions::Avx2, Instructions::Avx512];

fn unit(rng: &mut Pcg64Mcg) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn point(rng: &mut Pcg64Mcg, size: f64) -> DVec3 {
    DVec3::new(unit(rng), unit(rng), unit(rng)) * (2.0 * size) - size
}

/// Meshes fine and coarse, and every primitive.
fn mixed(offset: Vec3) -> Scene {
    let place = Affine3A::from_translation(offset);
    let mut scene = scene_of([
        (bumpy_knot(90, 20, 0.2, MaterialId(0)), place),
        (torus(1.2, 0.1, 30, 12, MaterialId(0)), place),
        (
            Mesh::cuboid(
                "floor",
                Vec3::new(-3.0, -1.2, -3.0),
                Vec3::new(3.0, -1.0, 3.0),
                MaterialId(0),
            ),
            place,
        ),
    ]);
    let shapes = [
        Shape::Sphere {
            center: Vec3::new(0.9, 0.7, 0.0),
            radius: 0.3,
        },
        Shape::Cylinder {
            a: Vec3::new(-1.2, -1.0, 0.8),
            b: Vec3::new(-1.2, 0.6, 0.8),
            radius: 0.05,
            capped: false,
        },
        Shape::Cone {
            base: Vec3::new(-0.8, -1.0, -0.9),
            apex: Vec3::new(-0.8, 0.2, -0.9),
            radius: 0.3,
            capped: true,
        },
        Shape::Disc {
            center: Vec3::new(0.0, 1.0, 0.0),
            normal: Vec3::new(0.2, 1.0, 0.1),
            radius: 0.4,
        },
    ];
    for shape in shapes {
        let material = MaterialId(0);
        let object = scene.add_primitive("shape", Primitive { shape, material });
        scene.objects[object.index()].transform = place;
    }
    scene
}

#[test]
fn rays_in_packets_hit_what_single_rays_hit() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let (mut hits, mut rays) = (0, 0);
    for offset in [Vec3::ZERO, Vec3::new(900.0, -300.0, 5000.0)] {
        let (mut tracer, _) = Tracer::new(&mixed(offset));
        let at = offset.as_dvec3();
        for round in 0..500 {
            let eye = at + point(&mut rng, 1.0).normalize() * 3.0;
            // Views along an axis too, where signs of components change inside a packet.
            let aim = if round % 4 == 0 {
                [DVec3::X, DVec3::Y, DVec3::NEG_Z][round / 4 % 3]
            } else {
                (at + point(&mut rng, 0.8) - eye).normalize()
            };
            let spread = [0.3, 0.02, 2e-3, 3.0][round / 3 % 4];
            let count = 1 + rng.next_u32() as usize % 40;
            let directions: Vec<DVec3> = (0..count)
                .map(|_| (aim + point(&mut rng, spread)).normalize() * [1.0, 2.5][round % 2])
                .collect();
            let t_max = if round % 5 == 0 { 2.8 } else { f64::INFINITY };
            let single: Vec<Option<Hit>> = directions
                .iter()
                .map(|&d| tracer.closest(eye, d, t_max))
                .collect();
            hits += single.iter().flatten().count();
            rays += count;
            for instructions in ALL {
                tracer.restrict(instructions);
                let mut found = vec![None; count];
                tracer.closest_each(eye, &directions, t_max, &mut found);
                assert_eq!(found, single, "{instructions:?}, eye {eye}, spread {spread}");
            }
        }
    }
    assert!(
        hits > 2000 && rays - hits > 1000,
        "both answers occur: {hits} of {rays}"
    );
}

#[test]
fn packets_do_not_leak_at_shared_vertices_and_bear_nonsense() {
    let n = 12u32;
    let positions: Vec<Vec3> = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| Vec3::new(i as f32, 0.0, j as f32)))
        .collect();
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let triangles = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            [
                [at(i, j), at(i, j + 1), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i + 1, j)],
            ]
        })
        .collect();
    let mesh = Mesh::new("grid", positions, triangles, MaterialId(0));
    let (mut tracer, _) = Tracer::new(&scene_of([(mesh, Affine3A::IDENTITY)]));
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    for _ in 0..200 {
        let eye = DVec3::new(6.0, 0.0, 6.0) + point(&mut rng, 1.0) + DVec3::Y * 12.0;
        let directions: Vec<DVec3> = (0..16)
            .map(|i| (DVec3::new(f64::from(4 + i % 4), 0.0, f64::from(4 + i / 4)) - eye).normalize())
            .collect();
        for instructions in ALL {
            tracer.restrict(instructions);
            let mut found = [None; 16];
            tracer.closest_each(eye, &directions, f64::INFINITY, &mut found);
            assert!(
                found.iter().all(Option::is_some),
                "a ray at a vertex slips through"
            );
        }
    }
    let mut found = [None; 4];
    for bad in [f64::NAN, f64::INFINITY, 0.0] {
        let directions = [DVec3::NEG_Y, DVec3::new(bad, -bad, bad), DVec3::NEG_Y, DVec3::Y];
        let eye = DVec3::new(5.3, 3.0, 5.7);
        tracer.closest_each(eye, &directions, f64::INFINITY, &mut found);
        assert_eq!(
            found.map(|hit| hit.is_some()),
            [true, false, true, false],
            "one bad ray spoils no other: {bad}"
        );
    }
    tracer.closest_each(DVec3::NAN, &[DVec3::NEG_Y; 4], 1.0, &mut found);
    assert_eq!(found, [None; 4], "no origin, no hit");
    let (empty, _) = Tracer::new(&Scene::new("empty"));
    empty.closest_each(DVec3::ZERO, &[DVec3::NEG_Y; 4], 1.0, &mut found);
    assert_eq!(found, [None; 4], "nothing to hit");
}

/// Points of the scene seen through a small window.
fn neighbours(tracer: &Tracer, rng: &mut Pcg64Mcg, at: DVec3, width: f64) -> Vec<DVec3> {
    let eye = at + point(rng, 1.0).normalize() * 3.0;
    let aim = (at + point(rng, 0.8) - eye).normalize();
    (0..64)
        .filter_map(|_| {
            let direction = (aim + point(rng, width)).normalize();
            let hit = tracer.closest(eye, direction, f64::INFINITY)?;
            Some(hit.leave(-direction))
        })
        .collect()
}

#[test]
fn what_a_shaft_says_holds_for_every_point() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let mut scene = mixed(Vec3::ZERO);
    // Something that hides a light from many neighbours at once: two triangles, and a large disc.
    scene.add_mesh(Mesh::quad(
        "board",
        [
            Vec3::new(1.1, -1.0, -2.0),
            Vec3::new(1.1, -1.0, 2.0),
            Vec3::new(1.3, 2.0, 2.0),
            Vec3::new(1.2, 2.0, -2.0),
        ],
        MaterialId(0),
    ));
    let (mut tracer, _) = Tracer::new(&scene);
    let mut kinds = [0; 4];
    let (mut shaft, mut scratch) = (Shaft::default(), FanScratch::default());
    let (mut through_tree, mut through_shaft) = (Partition::default(), Partition::default());
    let mut partly = 0;
    for round in 0..900 {
        let points = neighbours(&tracer, &mut rng, DVec3::ZERO, [0.003, 0.02, 0.1][round % 3]);
        let a = point(&mut rng, 2.5) + DVec3::Y * 1.5;
        let b = a + point(&mut rng, 1.0);
        tracer.restrict(ALL[round % 3]);
        tracer.shaft(&points, &[a, b], &mut shaft);
        let sight = shaft.sight();
        kinds[sight as usize] += 1;
        for &p in &points {
            let query = FanQuery {
                t0: [0.0, 0.3][round % 2],
                ..FanQuery::new(p, a, b)
            };
            let report = tracer.fan(&query, &mut scratch, &mut through_tree);
            assert!(report.complete, "no budget was set");
            match sight {
                Sight::Clear => assert_eq!(
                    through_tree.panels(),
                    [llsr_visibility::Panel::exact(query.t0, 1.0)],
                    "{p} to {a} - {b} is not clear"
                ),
                Sight::Blocked => assert!(through_tree.is_dark(), "{p} to {a} - {b} is not hidden"),
                _ => partly += usize::from(!through_tree.is_dark() && !through_tree.is_lit()),
            }
            tracer.fan_in_shaft(&query, &shaft, &mut scratch, &mut through_shaft);
            assert_eq!(through_shaft, through_tree, "{sight:?}, {p} to {a} - {b}");
        }
    }
    assert!(
        kinds.iter().all(|&count| count > 5) && partly > 500,
        "every answer occurs: {kinds:?}, {partly} partly visible"
    );
}

#[test]
fn hidden_and_clear_are_those_of_exact_brute_force() {
    // Triangles in general position, points anywhere in a small box, any point of the light.
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut kinds = [0; 4];
    let mut shaft = Shaft::default();
    for round in 0..4000 {
        let mut scene = Scene::new("triangles");
        scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        let count = 1 + round % 4;
        let positions: Vec<Vec3> = if round % 2 == 0 {
            (0..3 * count).map(|_| point(&mut rng, 1.5).as_vec3()).collect()
        } else {
            // A strip, whose neighbours share edges.
            (0..count + 2)
                .map(|i| {
                    Vec3::new(i as f32 * 1.2 - 2.0, 0.0, [-2.0, 2.0][i % 2]) + point(&mut rng, 0.4).as_vec3()
                })
                .collect()
        };
        let triangles = (0..count as u32)
            .map(|i| {
                let first = if round % 2 == 0 { 3 * i } else { i };
                [first, first + 1, first + 2]
            })
            .collect();
        scene.add_mesh(Mesh::new("soup", positions, triangles, MaterialId(0)));
        let all = world_triangles(&scene);
        let (tracer, _) = Tracer::new(&scene);
        let middle = point(&mut rng, 0.7) - DVec3::Y * 1.5;
        let points: Vec<DVec3> = (0..6).map(|_| middle + point(&mut rng, 0.05)).collect();
        let a = point(&mut rng, 0.6) + DVec3::Y * 1.5;
        let b = a + point(&mut rng, 0.5);
        tracer.shaft(&points, &[a, b], &mut shaft);
        kinds[shaft.sight() as usize] += 1;
        if !matches!(shaft.sight(), Sight::Clear | Sight::Blocked) {
            continue;
        }
        for &p in &points {
            let t = unit(&mut rng);
            assert_eq!(
                segment_is_cut(&all, p, a + (b - a) * t),
                shaft.sight() == Sight::Blocked,
                "round {round}: {:?} from {p} to {a} - {b} at {t}",
                shaft.sight()
            );
        }
    }
    assert!(
        kinds[Sight::Clear as usize] > 300 && kinds[Sight::Blocked as usize] > 300,
        "both occur: {kinds:?}"
    );
}

#[test]
fn shafts_without_points_or_with_nonsense_know_nothing() {
    let (tracer, _) = Tracer::new(&mixed(Vec3::ZERO));
    let mut shaft = Shaft::default();
    let (a, b) = (DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 2.0, 0.0));
    for (points, light) in [
        (vec![], vec![a, b]),
        (vec![a], vec![]),
        (vec![DVec3::NAN], vec![a, b]),
        (vec![a], vec![a, DVec3::INFINITY]),
    ] {
        tracer.shaft(&points, &light, &mut shaft);
        assert_eq!(shaft.sight(), Sight::Unknown, "{points:?} to {light:?}");
    }
    // Everything is kept if asked for, and gives the same answers.
    assert!(tracer.everything(&mut shaft), "the scene has no instances");
    let mut scratch = FanScratch::default();
    let (mut found, mut expected) = (Partition::default(), Partition::default());
    let query = FanQuery::new(DVec3::new(0.1, -0.9, 0.2), a, b);
    let report = tracer.fan_in_shaft(&query, &shaft, &mut scratch, &mut found);
    tracer.fan(&query, &mut scratch, &mut expected);
    assert_eq!(found, expected, "all leaves");
    assert!(
        report.blocks > 200 && report.nodes == 0,
        "all were asked: {report:?}"
    );
}

#[test]
fn pencils_are_cut_where_single_rays_are() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let (mut cut, mut rays) = (0, 0);
    for offset in [Vec3::ZERO, Vec3::new(-700.0, 4000.0, 90.0)] {
        let (mut tracer, _) = Tracer::new(&mixed(offset));
        let at = offset.as_dvec3();
        for round in 0..700 {
            let window = neighbours(&tracer, &mut rng, at, 0.02);
            let Some(&from) = window.first() else { continue };
            // Short, long, close and far lights, and now and then one that the point lies on.
            let length = [0.3, 1.5, 6.0][round % 3];
            let a = if round % 50 == 0 {
                from
            } else {
                at + point(&mut rng, 2.0) + DVec3::Y * [0.2, 2.0][round % 2]
            };
            let b = a + point(&mut rng, length);
            let count = 1 + rng.next_u32() as usize % 20;
            let ts: Vec<f64> = (0..count).map(|_| unit(&mut rng)).collect();
            let single: Vec<bool> = ts
                .iter()
                .map(|&t| tracer.occluded(from, a + (b - a) * t))
                .collect();
            cut += single.iter().filter(|&&cut| cut).count();
            rays += count;
            for instructions in ALL {
                tracer.restrict(instructions);
                let mut blocked = vec![false; count];
                tracer.occluded_pencil(from, a, b, &ts, &mut blocked);
                assert_eq!(blocked, single, "{instructions:?}, {from} to {a} - {b}");
            }
        }
    }
    assert!(
        cut > 2000 && rays - cut > 2000,
        "both answers occur: {cut} of {rays}"
    );
}
