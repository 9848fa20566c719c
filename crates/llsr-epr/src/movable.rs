//! Which objects of a scene it makes sense to let move.

use llsr_scene::{ObjectId, Scene};

/// Most objects that can be moved: each costs the tracer a little.
const MOST: usize = 1024;
/// An object whose box is larger than this share of the scene's (by their diagonals) is what the others stand in.
const LARGEST: f32 = 0.6;

/// The objects of a scene that it makes sense to move: all but those that hold the rest, and no more than 1024, the
/// largest of them.
pub fn movable_objects(scene: &Scene) -> Vec<ObjectId> {
    let whole = scene.bounds().diagonal();
    let mut found: Vec<(f32, ObjectId)> = (0..scene.objects.len())
        .map(ObjectId::from)
        .map(|id| (scene.object_bounds(id).diagonal(), id))
        // A scene of one object can be moved as a whole.
        .filter(|&(size, _)| size <= LARGEST * whole || scene.objects.len() == 1)
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    found.truncate(MOST);
    let mut ids: Vec<ObjectId> = found.into_iter().map(|(_, id)| id).collect();
    ids.sort_unstable();
    ids
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use llsr_scene::{Material, Mesh};

    use super::*;

    fn scene(sizes: &[f32]) -> Scene {
        let mut scene = Scene::default();
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        for &size in sizes {
            scene.add_mesh(Mesh::cuboid("box", Vec3::ZERO, Vec3::splat(size), grey));
        }
        scene
    }

    #[test]
    fn the_room_stays_and_the_furniture_moves() {
        let found = movable_objects(&scene(&[1.0, 10.0, 3.0]));
        assert_eq!(found, [ObjectId(0), ObjectId(2)], "all but the largest");
    }

    #[test]
    fn a_single_object_can_be_moved() {
        assert_eq!(movable_objects(&scene(&[2.0])), [ObjectId(0)], "there is no room");
        assert_eq!(movable_objects(&Scene::default()), [], "nothing");
    }

    #[test]
    fn of_very_many_the_largest_are_taken() {
        let sizes: Vec<f32> = (0..3000u16).map(|i| 1.0 + f32::from(i)).chain([1e5]).collect();
        let found = movable_objects(&scene(&sizes));
        assert_eq!(found.len(), MOST, "as many as are allowed");
        assert_eq!(
            found.first(),
            Some(&ObjectId(3000 - MOST as u32)),
            "the smallest of them"
        );
    }
}
