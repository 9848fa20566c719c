//! What `--add-grid` and `--move` do to a scene.

use glam::{Affine3A, Vec3};
use llsr_scene::{Material, Mesh, ObjectId, Scene};
use llsr_shading::Place;

use crate::failure::Failure;

/// Name of the grid's object.
const GRID: &str = "grid";
/// Distance between bars, as a share of the scene's larger horizontal extent.
const SPACING: f32 = 0.1;
/// Thickness of a bar, as a share of that distance.
const THICKNESS: f32 = 0.22;
/// Frames of one movement to and fro.
const PERIOD: f64 = 60.0;

/// Adds crossed bars between the scene and its lights: above the scene, or below lights that are in it.
pub(crate) fn add_grid(scene: &mut Scene) -> ObjectId {
    let bounds = scene.bounds();
    let (size, center) = (bounds.size(), bounds.center());
    let extent = 1.2 * size.x.max(size.z).max(1e-6 * size.y).max(f32::MIN_POSITIVE);
    let spacing = SPACING * extent;
    let half = 0.5 * THICKNESS * spacing;
    let lowest = scene.lights.iter().map(|light| {
        let (a, b) = light.ends();
        a.y.min(b.y) as f32
    });
    let light = lowest.fold(f32::INFINITY, f32::min);
    let height = if light > bounds.max.y {
        bounds.max.y + (0.4 * (light - bounds.max.y)).min(0.25 * size.y + 2.0 * half)
    } else {
        light - 0.15 * (light - bounds.min.y)
    };
    let material = scene.add_material(Material::diffuse(GRID, Vec3::splat(0.5)));
    let mut mesh = Mesh {
        name: GRID.to_owned(),
        ..Mesh::default()
    };
    let middle = Vec3::new(center.x, height, center.z);
    let count = (1.0 / SPACING) as i32;
    for bar in 0..=count {
        let across = (bar as f32 - 0.5 * count as f32) * spacing;
        // The upper bars lie on the lower ones.
        for (offset, along) in [
            (Vec3::new(across, 0.0, 0.0), Vec3::new(half, half, 0.5 * extent)),
            (
                Vec3::new(0.0, 2.0 * half, across),
                Vec3::new(0.5 * extent, half, half),
            ),
        ] {
            let at = middle + offset;
            mesh.append(&Mesh::cuboid(GRID, at - along, at + along, material));
        }
    }
    scene.add_mesh(mesh)
}

/// An object that moves to and fro along x.
pub(crate) struct Motion {
    pub(crate) object: ObjectId,
    /// Farthest from the middle (m).
    reach: f64,
    home: Affine3A,
}

impl Motion {
    /// The object called `name`; without a name the grid.
    pub(crate) fn of(name: &str, grid: Option<ObjectId>, scene: &Scene) -> Result<Self, Failure> {
        let object = if name.is_empty() {
            grid.ok_or_else(|| {
                Failure::Usage("--move: there is no grid; give --add-grid too, or --move=OBJECT".to_owned())
            })?
        } else {
            let found = scene.objects.iter().position(|object| object.name == name);
            let Some(index) = found else {
                let names: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
                return Err(Failure::Usage(format!(
                    "--move={name}: the scene has no such object; it has {}",
                    crate::report::shortened(&names, 8)
                )));
            };
            ObjectId::from(index)
        };
        let size = scene.object_bounds(object).size();
        Ok(Self {
            object,
            reach: 0.25 * f64::from(size.x.max(size.y).max(size.z)),
            home: scene.objects[object.index()].transform,
        })
    }

    /// Where the object is in a frame.
    pub(crate) fn place(&self, frame: usize) -> Place {
        let angle = std::f64::consts::TAU * frame as f64 / PERIOD;
        let offset = Vec3::X * (self.reach * angle.sin()) as f32;
        Place::Object(self.object, Affine3A::from_translation(offset) * self.home)
    }
}
