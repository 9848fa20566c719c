//! `--wander`: camera, objects and lights that move at random, for as long as one likes.

use glam::{Affine3A, DVec3, Quat, Vec3};
use llsr_epr::movable_objects;
use llsr_scene::{Camera, FieldOfView, Light, LightId, ObjectId, Scene};
use llsr_shading::Place;
use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// Frames between two goals of the camera: the least, and how many more there may be.
const GOAL: (u64, u64) = (30, 120);
/// Share of the way to its goal that the camera goes in a frame.
const PACE: f64 = 0.04;
/// The camera jumps to its goal once in so many goals.
const JUMPS: u64 = 12;
/// Something moves in one frame of so many: objects, lights.
const OBJECTS: u64 = 3;
const LIGHTS: u64 = 24;
/// Objects that move in one frame at most.
const TOGETHER: u64 = 4;
/// Farthest that objects go from home, as a share of their size, and lights, as a share of the scene's diagonal.
const OBJECT_REACH: f64 = 0.4;
const LIGHT_REACH: f64 = 0.05;

/// Random motion that depends on the seed alone.
pub(crate) struct Wander {
    random: Pcg64Mcg,
    camera: Camera,
    /// Where the camera goes, what it will look at there, and what it looks at now (m, recentred frame).
    goal: (DVec3, DVec3),
    looks_at: DVec3,
    /// Frames until the next goal.
    left: u64,
    /// The middle of the scene's box and half its size (m).
    room: (DVec3, DVec3),
    objects: Vec<Object>,
    lights: Vec<Light>,
    diagonal: f64,
}

/// An object that may move.
struct Object {
    id: ObjectId,
    home: Affine3A,
    /// The middle of its box at home, and its size (m).
    center: Vec3,
    size: f64,
}

impl Wander {
    /// Starts from `camera`. Objects that hold the rest of the scene stay where they are.
    pub(crate) fn new(scene: &Scene, camera: &Camera, seed: u64) -> Self {
        let bounds = scene.bounds();
        let objects = movable_objects(scene).into_iter().map(|id| {
            let around = scene.object_bounds(id);
            Object {
                id,
                home: scene.objects[id.index()].transform,
                center: around.center(),
                size: f64::from(around.diagonal()),
            }
        });
        let room = (bounds.center().as_dvec3(), 0.5 * bounds.size().as_dvec3());
        Self {
            random: Pcg64Mcg::new(u128::from(seed) << 1 | 1),
            goal: (camera.position, room.0),
            looks_at: camera.position + camera.forward() * room.1.length(),
            camera: camera.clone(),
            left: 0,
            room,
            objects: objects.collect(),
            lights: scene.lights.clone(),
            diagonal: f64::from(bounds.diagonal()),
        }
    }

    /// A whole number below `end`.
    fn below(&mut self, end: u64) -> u64 {
        self.random.next_u64() % end.max(1)
    }

    /// A vector whose parts lie in (-1, 1).
    fn vector(&mut self) -> DVec3 {
        let mut part = || (self.random.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
        DVec3::new(part(), part(), part())
    }

    /// The next camera.
    pub(crate) fn camera(&mut self) -> Camera {
        let (center, half) = self.room;
        if self.left == 0 {
            self.left = GOAL.0 + self.below(GOAL.1);
            // Mostly in the scene's box, a little way out of it too; what it looks at is in the inner half.
            let eye = center + self.vector() * half * 1.2;
            let target = center + self.vector() * half * 0.5;
            self.goal = (eye, target);
            if self.below(JUMPS) == 0 {
                (self.camera.position, self.looks_at) = self.goal;
            }
        }
        self.left -= 1;
        let eye = self.camera.position.lerp(self.goal.0, PACE);
        self.looks_at = self.looks_at.lerp(self.goal.1, PACE);
        self.camera = Camera::look_at(
            "wander",
            eye,
            self.looks_at,
            DVec3::Y,
            FieldOfView::vertical_degrees(60.0),
        );
        self.camera.clone()
    }

    /// Where what moves in this frame is put; often nothing.
    pub(crate) fn places(&mut self) -> Vec<Place> {
        let mut places = Vec::new();
        if !self.objects.is_empty() && self.below(OBJECTS) == 0 {
            for _ in 0..=self.below(TOGETHER) {
                let index = self.below(self.objects.len() as u64) as usize;
                let (offset, turn) = (self.vector() * OBJECT_REACH, self.vector().x as f32);
                let Object {
                    id,
                    home,
                    center,
                    size,
                } = self.objects[index];
                let turned = Affine3A::from_translation(center)
                    * Affine3A::from_quat(Quat::from_rotation_y(turn))
                    * Affine3A::from_translation(-center);
                let moved = Affine3A::from_translation((offset * size).as_vec3()) * turned * home;
                places.push(Place::Object(id, moved));
            }
        }
        if !self.lights.is_empty() && self.below(LIGHTS) == 0 {
            let index = self.below(self.lights.len() as u64) as usize;
            let mut light = self.lights[index].clone();
            light.translate(self.vector() * LIGHT_REACH * self.diagonal);
            places.push(Place::Light(LightId::from(index), light));
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_moves_the_same_things_and_all_of_them() {
        let scene = llsr_scene::demo::build("chains").expect("it is built in");
        let camera = scene.cameras[0].clone();
        let mut two = [7, 7].map(|seed| Wander::new(&scene, &camera, seed));
        let mut other = Wander::new(&scene, &camera, 8);
        let mut moved = std::collections::BTreeSet::new();
        let (mut lights, mut apart) = (0, 0);
        for frame in 0..2000 {
            let [first, second] = two.each_mut().map(|one| (one.camera(), one.places()));
            assert_eq!(first, second, "frame {frame}");
            assert!(
                first.0.position.is_finite() && first.0.axes.is_finite(),
                "frame {frame}"
            );
            apart += usize::from(other.camera().position != first.0.position);
            for place in first.1 {
                match place {
                    Place::Object(id, _) => _ = moved.insert(id),
                    Place::Light(..) => lights += 1,
                }
            }
        }
        assert_eq!(
            moved.into_iter().collect::<Vec<_>>(),
            movable_objects(&scene),
            "all that can move"
        );
        assert!(lights > 40, "{lights} moves of lights");
        assert!(apart > 1900, "another seed goes elsewhere");
    }
}
