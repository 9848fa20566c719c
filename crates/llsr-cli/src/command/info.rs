//! `llsr info`: what a scene file holds.

use llsr_io::Loaded;
use llsr_scene::{AreaShape, Camera, Geometry, Light, Projection, Scene, Viewport};
use llsr_tracer::Tracer;
use serde_json::json;

use crate::args::{Common, InfoArgs};
use crate::camera::{self, Source};
use crate::failure::Failure;
use crate::load::load;
use crate::report;

/// Lights, materials and cameras listed before the rest is summed up.
const MOST: usize = 24;

pub(crate) fn run(args: &InfoArgs, common: &Common) -> Result<(), Failure> {
    let Loaded { scene, warnings } = load(&args.scene)?;
    let (tracer, dropped) = Tracer::new(&scene);
    let warnings: Vec<String> = warnings
        .iter()
        .map(ToString::to_string)
        .chain(dropped.iter().map(ToString::to_string))
        .collect();
    let (width, height) = args.scene.size;
    let (camera, source) = camera::choose(&args.scene, &scene, &tracer, Viewport { width, height })?;
    if !common.quiet {
        print(&args.scene.scene, &scene, &camera, source, &warnings);
    }
    if let Some(path) = &common.report {
        let bounds = scene.bounds();
        let (min, max) = (
            bounds.min.as_dvec3() + scene.origin,
            bounds.max.as_dvec3() + scene.origin,
        );
        let eye = camera.position + scene.origin;
        let value = json!({
            "scene": args.scene.scene,
            "triangles": scene.triangle_count(),
            "primitives": scene.primitive_count(),
            "objects": scene.objects.len(),
            "meshes": scene.meshes.len(),
            "materials": scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(),
            "textures": scene.textures.len(),
            "lights": scene.lights.len(),
            "light_names": scene.lights.iter().map(Light::name).collect::<Vec<_>>(),
            "flux": scene.lights.iter().map(Light::flux).collect::<Vec<_>>(),
            "unit": scene.unit.flux_symbol(),
            "bounds": { "min": min.to_array(), "max": max.to_array() },
            "camera": {
                "name": camera.name,
                "source": source.sentence(),
                "position": eye.to_array(),
                "forward": camera.forward().to_array(),
                "up": camera.axes.y_axis.to_array(),
            },
            "cameras": scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(),
            "warnings": warnings,
        });
        report::write_json(path, &value)?;
    }
    Ok(())
}

fn print(shown: &str, scene: &Scene, camera: &Camera, source: Source, warnings: &[String]) {
    let bounds = scene.bounds();
    let size = bounds.size();
    println!("{shown}");
    println!(
        "  geometry   {} triangles and {} primitives in {} objects, {} meshes",
        scene.triangle_count(),
        scene.primitive_count(),
        scene.objects.len(),
        scene.meshes.len()
    );
    let center = bounds.center().as_dvec3() + scene.origin;
    println!(
        "  size       {:.4} x {:.4} x {:.4} m around ({:.4}, {:.4}, {:.4})",
        size.x, size.y, size.z, center.x, center.y, center.z
    );
    println!(
        "  units      metres, flux in {}, pictures in {}",
        scene.unit.flux_symbol(),
        scene.unit.irradiance_symbol()
    );
    print_materials(scene);
    print_lights(scene);
    let eye = camera.position + scene.origin;
    let forward = camera.forward();
    let angle = match camera.projection {
        Projection::Perspective(_) => {
            let square = Viewport { width: 1, height: 1 };
            let angle = camera.vertical_field_of_view(square).unwrap_or_default();
            format!("{:.1} degrees in a square picture", angle.to_degrees())
        }
        Projection::Orthographic { height } => format!("orthographic, {height:.3} m high"),
    };
    println!(
        "  camera     at ({:.3}, {:.3}, {:.3}) along ({:.3}, {:.3}, {:.3}), {angle}; {}",
        eye.x,
        eye.y,
        eye.z,
        forward.x,
        forward.y,
        forward.z,
        source.sentence()
    );
    let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    if !names.is_empty() {
        println!("  cameras    {}", report::shortened(&names, MOST));
    }
    if warnings.is_empty() {
        println!("  warnings   none");
    } else {
        println!("  warnings   {}", warnings.len());
        for warning in warnings {
            println!("    {warning}");
        }
    }
}

fn print_materials(scene: &Scene) {
    let mut triangles = vec![0usize; scene.materials.len()];
    for object in &scene.objects {
        match object.geometry {
            Geometry::Mesh(mesh) => {
                for material in &scene.meshes[mesh.index()].materials {
                    triangles[material.index()] += 1;
                }
            }
            Geometry::Primitive(primitive) => triangles[primitive.material.index()] += 1,
        }
    }
    println!("  materials  {}", scene.materials.len());
    for (material, triangles) in scene.materials.iter().zip(&triangles).take(MOST) {
        let texture = if material.base_color_texture.is_some() {
            ", textured"
        } else {
            ""
        };
        let c = material.base_color;
        println!(
            "    {:<28} {triangles:>8} faces, base colour ({:.2}, {:.2}, {:.2}){texture}",
            material.name, c.x, c.y, c.z
        );
    }
    if scene.materials.len() > MOST {
        println!("    and {} more", scene.materials.len() - MOST);
    }
}

fn print_lights(scene: &Scene) {
    let unit = scene.unit.flux_symbol();
    let total = scene
        .lights
        .iter()
        .map(Light::flux)
        .fold(0.0, |sum, flux| sum + flux);
    println!(
        "  lights     {} with {total:.1} {unit} in all",
        scene.lights.len()
    );
    for light in scene.lights.iter().take(MOST) {
        let (a, b) = light.ends();
        let (a, b) = (a + scene.origin, b + scene.origin);
        match light {
            Light::Linear(line) => println!(
                "    {:<28} {:.1} {unit}, {:?} line of {:.3} m from ({:.3}, {:.3}, {:.3}) to ({:.3}, {:.3}, {:.3})",
                line.name,
                line.flux,
                line.emission,
                line.length(),
                a.x,
                a.y,
                a.z,
                b.x,
                b.y,
                b.z
            ),
            Light::Area(area) => println!(
                "    {:<28} {:.1} {unit}, {}",
                area.name,
                area.flux,
                shape_text(&area.shape, scene.origin)
            ),
            Light::Point(point) => println!(
                "    {:<28} {:.1} {unit}, point at ({:.3}, {:.3}, {:.3})",
                point.name, point.flux, a.x, a.y, a.z
            ),
        }
    }
    if scene.lights.len() > MOST {
        println!("    and {} more", scene.lights.len() - MOST);
    }
}

fn shape_text(shape: &AreaShape, origin: glam::DVec3) -> String {
    match *shape {
        AreaShape::Rect {
            corner,
            along,
            across,
        } => {
            let c = corner + 0.5 * (along + across) + origin;
            let (w, h) = (across.length(), along.length());
            format!(
                "rectangle of {w:.3} x {h:.3} m around ({:.3}, {:.3}, {:.3})",
                c.x, c.y, c.z
            )
        }
        AreaShape::Disc { center, radius, .. } => {
            let c = center + origin;
            format!(
                "disc of radius {radius:.3} m around ({:.3}, {:.3}, {:.3})",
                c.x, c.y, c.z
            )
        }
    }
}
