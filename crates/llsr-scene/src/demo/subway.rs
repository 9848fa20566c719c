//! The inside of a subway car: figures 2 and 7 of Ouellette & Fiume 1999.
//!
//! x runs along the car, y is up, the far wall is at negative z. The car is 14 m long, 3 m wide and 2.5 m high.

use glam::{DVec3, Vec3};

use crate::{Camera, FieldOfView, LinearLight, Material, MaterialId, Mesh, Primitive, Scene, Shape};

/// Half the length of the car (m).
const HALF_LENGTH: f32 = 7.0;
/// Half the width, to the plane of the side walls (m).
const HALF_WIDTH: f32 = 1.5;
const HEIGHT: f32 = 2.5;
/// How far the doors lie behind the plane of the walls (m).
const RECESS: f32 = 0.22;
/// Centres and half widths of the door recesses along x (m).
const DOORS: [(f32, f32); 2] = [(1.75, 0.8), (-4.6, 0.8)];
const DOOR_HEIGHT: f32 = 2.1;

struct Materials {
    shell: MaterialId,
    floor: MaterialId,
    door: MaterialId,
    seat: MaterialId,
    frame: MaterialId,
    steel: MaterialId,
    luggage: MaterialId,
    ball: MaterialId,
}

/// Two tubes along the car, seats in threes, handrails, recessed doors, spheres and cylinders.
pub(super) fn subway() -> Scene {
    let mut scene = Scene::default();
    let mut paint =
        |name: &str, r: f32, g: f32, b: f32| scene.add_material(Material::diffuse(name, Vec3::new(r, g, b)));
    let materials = Materials {
        shell: paint("shell", 0.74, 0.73, 0.68),
        floor: paint("floor", 0.33, 0.31, 0.30),
        door: paint("door", 0.62, 0.66, 0.68),
        seat: paint("seat", 0.72, 0.28, 0.08),
        frame: paint("frame", 0.35, 0.36, 0.38),
        steel: paint("steel", 0.60, 0.61, 0.62),
        luggage: paint("luggage", 0.16, 0.28, 0.48),
        ball: paint("ball", 0.70, 0.62, 0.18),
    };
    shell(&mut scene, &materials);
    for side in [-1.0, 1.0] {
        for x in [-1.0, -6.25, 4.5] {
            seats(&mut scene, &materials, side, x);
        }
    }
    rails(&mut scene, &materials);
    passengers_things(&mut scene, &materials);
    for (name, z) in [("tube far", -0.95), ("tube near", 0.95)] {
        let (a, b) = (DVec3::new(-6.6, 2.3, z), DVec3::new(6.6, 2.3, z));
        scene.add_light(LinearLight::new(name, a, b, 12_000.0));
    }
    scene.cameras.push(Camera::look_at(
        "default",
        DVec3::new(2.6, 1.62, 1.32),
        DVec3::new(-0.55, 0.98, -1.5),
        DVec3::Y,
        FieldOfView::vertical_degrees(62.0),
    ));
    scene
}

fn quad(mesh: &mut Mesh, corners: [Vec3; 4], material: MaterialId) {
    mesh.append(&Mesh::quad("", corners, material));
}

fn cuboid(mesh: &mut Mesh, min: [f32; 3], max: [f32; 3], material: MaterialId) {
    mesh.append(&Mesh::cuboid("", min.into(), max.into(), material));
}

/// Floor, ceiling, ends and the two side walls with their recesses, all facing inwards.
fn shell(scene: &mut Scene, materials: &Materials) {
    let (l, w, h) = (HALF_LENGTH, HALF_WIDTH, HEIGHT);
    let deep = w + RECESS;
    let v = Vec3::new;
    let mut floor = Mesh {
        name: "floor".to_owned(),
        ..Mesh::default()
    };
    quad(
        &mut floor,
        [
            v(-l, 0.0, -deep),
            v(-l, 0.0, deep),
            v(l, 0.0, deep),
            v(l, 0.0, -deep),
        ],
        materials.floor,
    );
    scene.add_mesh(floor);

    let mut mesh = Mesh {
        name: "shell".to_owned(),
        ..Mesh::default()
    };
    quad(
        &mut mesh,
        [v(-l, h, -w), v(l, h, -w), v(l, h, w), v(-l, h, w)],
        materials.shell,
    );
    for x in [-l, l] {
        quad(
            &mut mesh,
            [v(x, 0.0, -w), v(x, h, -w), v(x, h, w), v(x, 0.0, w)],
            materials.shell,
        );
    }
    for side in [-1.0, 1.0] {
        let (z, back) = (side * w, side * deep);
        let mut doors = DOORS;
        doors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut from = -l;
        for (center, half) in doors {
            let (x0, x1) = (center - half, center + half);
            quad(
                &mut mesh,
                [v(from, 0.0, z), v(x0, 0.0, z), v(x0, h, z), v(from, h, z)],
                materials.shell,
            );
            // Above the door, then the door itself, its two jambs and its lintel.
            let (d, top) = (DOOR_HEIGHT, materials.door);
            quad(
                &mut mesh,
                [v(x0, d, z), v(x1, d, z), v(x1, h, z), v(x0, h, z)],
                materials.shell,
            );
            quad(
                &mut mesh,
                [v(x0, 0.0, back), v(x1, 0.0, back), v(x1, d, back), v(x0, d, back)],
                top,
            );
            quad(
                &mut mesh,
                [v(x0, 0.0, z), v(x0, 0.0, back), v(x0, d, back), v(x0, d, z)],
                materials.shell,
            );
            quad(
                &mut mesh,
                [v(x1, 0.0, z), v(x1, 0.0, back), v(x1, d, back), v(x1, d, z)],
                materials.shell,
            );
            quad(
                &mut mesh,
                [v(x0, d, z), v(x1, d, z), v(x1, d, back), v(x0, d, back)],
                materials.shell,
            );
            from = x1;
        }
        quad(
            &mut mesh,
            [v(from, 0.0, z), v(l, 0.0, z), v(l, h, z), v(from, h, z)],
            materials.shell,
        );
        // A ledge under the tube runs along the wall.
        let (inner, outer) = (side * (w - 0.12), side * (w + 0.001));
        let (z0, z1) = (inner.min(outer), inner.max(outer));
        cuboid(&mut mesh, [-l, 2.12, z0], [l, 2.17, z1], materials.shell);
    }
    scene.add_mesh(mesh);
}

/// A set of three seats whose middle is at `x`, on the far (`side` = -1) or near wall.
fn seats(scene: &mut Scene, materials: &Materials, side: f32, x: f32) {
    let mut mesh = Mesh {
        name: format!("seats {x} {side}"),
        ..Mesh::default()
    };
    let mut block = |min: [f32; 3], max: [f32; 3], material| {
        let (z0, z1) = (side * min[2], side * max[2]);
        cuboid(
            &mut mesh,
            [min[0], min[1], z0.min(z1)],
            [max[0], max[1], z0.max(z1)],
            material,
        );
    };
    for i in -1i8..=1 {
        let middle = x + 0.56 * f32::from(i);
        let (x0, x1) = (middle - 0.25, middle + 0.25);
        block([x0, 0.42, 0.98], [x1, 0.48, 1.44], materials.seat);
        block([x0, 0.50, 1.39], [x1, 1.02, 1.46], materials.seat);
    }
    // The bench's beam and its two feet.
    block([x - 0.84, 0.36, 1.05], [x + 0.84, 0.42, 1.46], materials.frame);
    for foot in [-0.62, 0.62] {
        block(
            [x + foot - 0.05, 0.0, 1.12],
            [x + foot + 0.05, 0.36, 1.32],
            materials.frame,
        );
    }
    scene.add_mesh(mesh);
}

fn rod(scene: &mut Scene, name: &str, a: Vec3, b: Vec3, radius: f32, material: MaterialId) {
    let shape = Shape::Cylinder {
        a,
        b,
        radius,
        capped: true,
    };
    scene.add_primitive(name, Primitive { shape, material });
}

/// An upright pole beside each door and an overhead rail on two hangers, all on the far side: on the near side they
/// would stand between a tube and everything in view. Arm rests on both.
fn rails(scene: &mut Scene, materials: &Materials) {
    let steel = materials.steel;
    let v = Vec3::new;
    for (center, half) in DOORS {
        let x = center - half - 0.08;
        rod(scene, "pole", v(x, 0.0, -1.2), v(x, HEIGHT, -1.2), 0.018, steel);
    }
    let (x0, x1, z) = (-3.5, 0.6, -0.66);
    rod(
        scene,
        "overhead rail",
        v(x0, 1.95, z),
        v(x1, 1.95, z),
        0.016,
        steel,
    );
    for x in [x0, x1] {
        rod(scene, "hanger", v(x, 1.95, z), v(x, HEIGHT, z), 0.012, steel);
        let shape = Shape::Sphere {
            center: v(x, 1.95, z),
            radius: 0.03,
        };
        scene.add_primitive(
            "rail end",
            Primitive {
                shape,
                material: steel,
            },
        );
    }
    for side in [-1.0f32, 1.0] {
        for x in [-1.9f32, -0.1] {
            rod(
                scene,
                "arm rest",
                v(x, 0.68, side * 1.05),
                v(x, 0.68, side * 1.5),
                0.015,
                steel,
            );
            rod(
                scene,
                "arm rest post",
                v(x, 0.36, side * 1.05),
                v(x, 0.68, side * 1.05),
                0.015,
                steel,
            );
        }
    }
}

/// What was left behind: a case, two balls, a traffic cone and a drum.
fn passengers_things(scene: &mut Scene, materials: &Materials) {
    let v = Vec3::new;
    let case = Mesh::cuboid(
        "case",
        v(-2.55, 0.0, -0.95),
        v(-2.1, 0.62, -0.72),
        materials.luggage,
    );
    scene.add_mesh(case);
    let mut add = |name: &str, shape, material| {
        scene.add_primitive(name, Primitive { shape, material });
    };
    add(
        "ball",
        Shape::Sphere {
            center: v(-0.35, 0.19, -0.62),
            radius: 0.19,
        },
        materials.ball,
    );
    add(
        "ball on seat",
        Shape::Sphere {
            center: v(-1.0, 0.59, -1.2),
            radius: 0.11,
        },
        materials.luggage,
    );
    let cone = Shape::Cone {
        base: v(0.55, 0.0, -0.25),
        apex: v(0.55, 0.52, -0.25),
        radius: 0.16,
        capped: true,
    };
    add("traffic cone", cone, materials.seat);
    let drum = Shape::Cylinder {
        a: v(1.55, 0.0, -0.95),
        b: v(1.55, 0.5, -0.95),
        radius: 0.2,
        capped: true,
    };
    add("drum", drum, materials.frame);
}
