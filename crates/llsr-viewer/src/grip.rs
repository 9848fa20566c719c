//! Picking what lies under the pointer, and dragging it in the plane of the picture.

use glam::{Affine3A, DVec3};
use llsr_scene::{Camera, Light, LightId, ObjectId, Viewport};
use llsr_shading::{Place, World};

/// How near the pointer must be to a light (pixels).
const LIGHT_REACH: f64 = 9.0;

/// Something that can be dragged.
#[derive(Clone, Debug, PartialEq)]
enum Held {
    /// An object, and the transform that it had.
    Object(ObjectId, Affine3A),
    /// A light as it was.
    Light(LightId, Light),
}

/// What the pointer holds: an object or a light, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Grip {
    held: Held,
    /// The point that was picked (m, recentred frame).
    point: DVec3,
}

/// The point of a surface in the middle of pixel position (`x`, `y`), if any.
pub fn surface_under(
    world: &World,
    camera: &Camera,
    viewport: Viewport,
    x: f64,
    y: f64,
) -> Option<(ObjectId, DVec3)> {
    let (origin, direction) = camera.ray(viewport, x, y);
    let hit = world.tracer().closest(origin, direction, f64::INFINITY)?;
    Some((hit.object, hit.position))
}

impl Grip {
    /// Takes hold of what is at picture position (`x`, `y`) in pixels: a light whose line passes within a few pixels, if
    /// `lights`, else the visible object.
    ///
    /// A light is found also where surfaces hide it.
    pub fn take(
        world: &World,
        camera: &Camera,
        viewport: Viewport,
        (x, y): (f64, f64),
        lights: bool,
    ) -> Option<Self> {
        if lights && let Some(grip) = Self::take_light(world, camera, viewport, x, y) {
            return Some(grip);
        }
        let (object, point) = surface_under(world, camera, viewport, x, y)?;
        Some(Self {
            held: Held::Object(object, *world.transform(object)),
            point,
        })
    }

    fn take_light(world: &World, camera: &Camera, viewport: Viewport, x: f64, y: f64) -> Option<Self> {
        let mut best: Option<(f64, usize, DVec3)> = None;
        for (index, light) in world.lights().iter().enumerate() {
            let (a, b) = light.ends();
            // Points along the light, as many as pixels would not do: a light may begin behind the camera.
            const PARTS: u32 = 256;
            for i in 0..=PARTS {
                let point = a.lerp(b, f64::from(i) / f64::from(PARTS));
                let Some((u, v, _)) = camera.project(viewport, point) else {
                    continue;
                };
                let away = (u - x).hypot(v - y);
                if away < best.map_or(LIGHT_REACH, |(nearest, ..)| nearest) {
                    best = Some((away, index, point));
                }
            }
        }
        let (_, index, point) = best?;
        Some(Self {
            held: Held::Light(LightId::from(index), world.lights()[index].clone()),
            point,
        })
    }

    /// The name of what is held.
    pub fn name<'a>(&'a self, world: &'a World) -> &'a str {
        match &self.held {
            Held::Object(object, _) => &world.scene().objects[object.index()].name,
            Held::Light(_, light) => light.name(),
        }
    }

    /// Lights can be moved, and the objects that the world was made to let move.
    pub fn can_move(&self, world: &World) -> bool {
        match self.held {
            Held::Object(object, _) => world.tracer().movable_bounds(object).is_some(),
            Held::Light(..) => true,
        }
    }

    /// True for a light.
    pub fn is_light(&self) -> bool {
        matches!(self.held, Held::Light(..))
    }

    /// Where to put what is held so that the picked point lies under the pointer at (`x`, `y`), in the plane through it
    /// that is parallel to the picture.
    ///
    /// `None` where the pointer's ray does not meet that plane in front of the camera.
    pub fn drag(&self, camera: &Camera, viewport: Viewport, x: f64, y: f64) -> Option<Place> {
        let offset = self.offset(camera, viewport, x, y)?;
        Some(match &self.held {
            Held::Object(object, transform) => {
                let offset = Affine3A::from_translation(offset.as_vec3());
                Place::Object(*object, offset * *transform)
            }
            Held::Light(light, before) => {
                let mut after = before.clone();
                after.translate(offset);
                Place::Light(*light, after)
            }
        })
    }

    fn offset(&self, camera: &Camera, viewport: Viewport, x: f64, y: f64) -> Option<DVec3> {
        let (origin, direction) = camera.ray(viewport, x, y);
        let along = direction.dot(camera.forward());
        let t = (self.point - origin).dot(camera.forward()) / along;
        let offset = origin + direction * t - self.point;
        (t > 0.0 && offset.is_finite()).then_some(offset)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use llsr_scene::{FieldOfView, LinearLight, Material, Mesh, Scene};

    use super::*;

    const VIEWPORT: Viewport = Viewport {
        width: 200,
        height: 100,
    };

    /// A box at 10 m before a wall at 20 m, a light beside the box.
    fn world() -> (World, Camera) {
        let mut scene = Scene::default();
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        let corner = Vec3::splat(1.0);
        scene.add_mesh(Mesh::cuboid("box", -corner, corner, grey));
        let wall = Vec3::new(50.0, 50.0, 0.5);
        let away = Vec3::new(0.0, 0.0, -10.0);
        scene.add_mesh(Mesh::cuboid("wall", away - wall, away + wall, grey));
        let (a, b) = (DVec3::new(3.0, -1.0, 0.0), DVec3::new(3.0, 1.0, 0.0));
        scene.add_light(LinearLight::new("tube", a, b, 100.0));
        let camera = Camera::look_at(
            "c",
            DVec3::new(0.0, 0.0, 10.0),
            DVec3::ZERO,
            DVec3::Y,
            FieldOfView::vertical_degrees(60.0),
        );
        let movable = [ObjectId(0), ObjectId(1)];
        (World::new(Arc::new(scene), &movable).0, camera)
    }

    fn moved(world: &World, grip: &Grip, camera: &Camera, x: f64, y: f64) -> World {
        let place = grip
            .drag(camera, VIEWPORT, x, y)
            .expect("the pointer is in the picture");
        let change = world.moved(&[place]).expect("it can stand there");
        World::clone(&change.world)
    }

    #[test]
    fn the_picked_point_follows_the_pointer() {
        let (world, camera) = world();
        let grip = Grip::take(&world, &camera, VIEWPORT, (95.0, 48.0), true).expect("the box is there");
        assert_eq!(grip.name(&world), "box", "what is in front");
        for (x, y) in [(30.0, 20.0), (150.5, 80.25), (95.0, 48.0)] {
            let after = moved(&world, &grip, &camera, x, y);
            // The same place of the box is under the pointer, as far away as before along the view.
            let transform = after.transform(ObjectId(0));
            let point = transform
                .transform_point3(grip.point.as_vec3() - world.transform(ObjectId(0)).translation.to_vec3());
            let (u, v, depth) = camera
                .project(VIEWPORT, point.as_dvec3())
                .expect("before the camera");
            assert!(
                (u - x).abs() < 1e-3 && (v - y).abs() < 1e-3,
                "at {u}, {v} instead of {x}, {y}"
            );
            assert!((depth - 9.0).abs() < 1e-4, "{depth} m away");
            let (object, _) = surface_under(&after, &camera, VIEWPORT, x, y).expect("something");
            assert_eq!(object, ObjectId(0), "the tracer sees it there");
        }
    }

    #[test]
    fn lights_are_picked_by_their_lines() {
        let (world, camera) = world();
        let (x, y, _) = camera
            .project(VIEWPORT, DVec3::new(3.0, 0.5, 0.0))
            .expect("in front");
        let grip = Grip::take(&world, &camera, VIEWPORT, (x + 4.0, y), true).expect("the light");
        assert!(grip.is_light(), "{}", grip.name(&world));
        let other = Grip::take(&world, &camera, VIEWPORT, (x + 4.0, y), false).expect("the wall");
        assert_eq!(other.name(&world), "wall", "lights are not shown");
        let after = moved(&world, &grip, &camera, x + 4.0, y - 20.0);
        let (before, now) = (world.lights()[0].ends(), after.lights()[0].ends());
        let offset = now.0 - before.0;
        assert!(offset.distance(now.1 - before.1) < 1e-12, "both ends move alike");
        assert!(
            offset.y > 0.5 && offset.z.abs() < 1e-9,
            "upwards in the plane of the picture: {offset}"
        );
    }

    #[test]
    fn nothing_is_picked_where_nothing_is() {
        let (world, camera) = world();
        let away = Camera::look_at(
            "away",
            camera.position,
            DVec3::new(0.0, 0.0, 20.0),
            DVec3::Y,
            FieldOfView::vertical_degrees(60.0),
        );
        assert_eq!(
            Grip::take(&world, &away, VIEWPORT, (100.0, 50.0), true),
            None,
            "empty space"
        );
    }

    #[test]
    fn a_light_that_begins_behind_the_camera_can_be_picked() {
        let (world, _) = world();
        let camera = Camera::look_at(
            "beside",
            DVec3::new(2.5, 0.0, 0.0),
            DVec3::new(4.0, 0.6, 0.0),
            DVec3::Y,
            FieldOfView::vertical_degrees(100.0),
        );
        let (x, y, _) = camera
            .project(VIEWPORT, DVec3::new(3.0, 0.3, 0.0))
            .expect("in front");
        let grip = Grip::take(&world, &camera, VIEWPORT, (x, y), true);
        assert!(grip.is_some_and(|grip| grip.is_light()), "the light");
    }
}
