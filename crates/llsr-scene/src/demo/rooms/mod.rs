//! Four textured rooms around a crossing of walls, with doorways between them: after figure 12 of Bala, Walter &
//! Greenberg 2003.
//!
//! The middles of the four doorways lie on a circle of 4 m around the crossing, on which nothing stands, and nothing stands
//! on the line through the doorway that the first camera looks at. The gallery is at positive x and z, the dining room at
//! negative z, the library at negative x too, the lounge at negative x and positive z.

mod furniture;
mod paint;

use glam::{Affine3A, DVec3, Quat, Vec3};

use self::furniture::Furniture;
use self::paint::Paint;
use super::solid::blocks;
use crate::{Camera, FieldOfView, LinearLight, Mesh, ObjectId, Scene};

/// Radius of the circle through the doorways (m).
pub(in crate::demo) const CIRCLE: f32 = 4.0;
/// From the crossing to the inside of the outer walls (m).
const INSIDE: f32 = 7.0;
const OUTSIDE: f32 = 7.2;
/// Half the thickness of the walls between the rooms (m).
const WALL: f32 = 0.1;
const DOOR_HALF: f32 = 0.8;
const DOOR_HEIGHT: f32 = 2.3;
const HEIGHT: f32 = 3.0;

/// Six tubes, 15,006 triangles.
pub(super) fn rooms() -> Scene {
    let mut scene = Scene::default();
    let paint = Paint::new(&mut scene);
    shell(&mut scene, &paint);
    let mut furniture = Furniture {
        scene: &mut scene,
        paint: &paint,
    };
    furniture.gallery();
    furniture.dining_room();
    furniture.library();
    furniture.lounge();
    lights(&mut scene);

    // Straight on is the doorway to the dining room.
    let eye = DVec3::new(3.8, 1.55, 6.1);
    scene.cameras.push(Camera::look_at(
        "default",
        eye,
        eye - DVec3::Z,
        DVec3::Y,
        FieldOfView::vertical_degrees(62.0),
    ));
    for (name, eye, target) in [
        ("dining room", [1.9, 1.6, -1.3], [5.2, 0.7, -5.2]),
        ("library", [-1.6, 1.6, -1.6], [-5.0, 1.0, -5.8]),
        ("lounge", [-1.9, 1.6, 1.5], [-5.2, 0.5, 5.2]),
    ] {
        scene.cameras.push(Camera::look_at(
            name,
            DVec3::from_array(eye),
            DVec3::from_array(target),
            DVec3::Y,
            FieldOfView::vertical_degrees(56.0),
        ));
    }
    scene
}

/// Adds `mesh` under `name`.
fn add(scene: &mut Scene, name: &str, mesh: Mesh) -> ObjectId {
    scene.add_mesh(Mesh {
        name: name.to_owned(),
        ..mesh
    })
}

/// Floor, ceiling, outer walls and the crossing with its four doorways, in one piece.
fn shell(scene: &mut Scene, paint: &Paint) {
    let (near, far) = (CIRCLE - DOOR_HALF, CIRCLE + DOOR_HALF);
    let across = [
        -OUTSIDE, -INSIDE, -far, -near, -WALL, WALL, near, far, INSIDE, OUTSIDE,
    ];
    let up = [-0.2, 0.0, DOOR_HEIGHT, HEIGHT, HEIGHT + 0.2];
    let last = across.len() - 2;
    let filled = |[i, j, k]: [usize; 3]| {
        let border = |c: usize| c == 0 || c == last;
        let doorway = |along: usize| j == 1 && (along == 2 || along == 6);
        border(i) || border(k) || j == 0 || j == 3 || i == 4 && !doorway(k) || k == 4 && !doorway(i)
    };
    let material = |[i, j, k]: [usize; 3], normal: Vec3| {
        // The room that the face looks into; a threshold belongs to the room behind it.
        let (x, z) = (i as f32 + 0.4 * normal.x, k as f32 + 0.4 * normal.z);
        let room = match (x > 4.0, z > 4.0) {
            (true, true) => 0,
            (true, false) => 1,
            (false, false) => 2,
            (false, true) => 3,
        };
        let jamb = |along: usize| (along == 3 || along == 5 || along == 1 || along == 7) && j == 1;
        if j == 0 {
            paint.floors[room]
        } else if j == 3 {
            paint.ceiling
        } else if normal.y != 0.0
            || i == 4 && normal.z != 0.0 && jamb(k)
            || k == 4 && normal.x != 0.0 && jamb(i)
        {
            paint.trim
        } else {
            paint.walls[room]
        }
    };
    add(scene, "walls", blocks([&across, &up, &across], filled, material));
}

/// Tubes below the ceiling, one of them low over the table.
fn lights(scene: &mut Scene) {
    let warm = Vec3::new(1.0, 0.84, 0.64);
    let white = Vec3::new(1.0, 0.95, 0.88);
    let cool = Vec3::new(0.84, 0.93, 1.0);
    for (name, a, b, flux, color) in [
        ("gallery left", [1.4, 2.62, 5.6], [3.6, 2.62, 5.6], 3600.0, white),
        ("gallery right", [5.6, 2.62, 1.5], [5.6, 2.62, 3.9], 3600.0, white),
        ("dining table", [4.8, 2.1, -5.2], [6.4, 2.1, -5.2], 3400.0, warm),
        (
            "library shelves",
            [-6.0, 2.62, -2.4],
            [-3.6, 2.62, -2.4],
            3400.0,
            warm,
        ),
        (
            "library desk",
            [-2.2, 2.62, -5.8],
            [-2.2, 2.62, -4.2],
            2600.0,
            white,
        ),
        ("lounge", [-4.6, 2.62, 3.0], [-3.0, 2.62, 4.6], 4200.0, cool),
    ] {
        scene.add_light(LinearLight {
            color: color / crate::luminance(color),
            ..LinearLight::new(name, DVec3::from_array(a), DVec3::from_array(b), flux)
        });
    }
}

/// Turned about the vertical by `degrees`, at (`x`, `y`, `z`).
fn at(x: f32, y: f32, z: f32, degrees: f32) -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(degrees.to_radians()), Vec3::new(x, y, z))
}
