//! Scenes that are written and read again.

use glam::{Affine3A, DVec3, Mat3, Quat, Vec2, Vec3};
use llsr_io::{Error, LoadOptions, Loaded, load_scene, write_gltf};
use llsr_scene::{
    AreaLight, AreaShape, Camera, EmissionLaw, FieldOfView, Geometry, Light, LinearLight, Material, Mesh,
    MeshId, Object, PhotometricUnit, PointLight, Primitive, Projection, Scene, Shape, Texture, TextureUse,
    Wrap,
};

use crate::support::{Folder, assert_no_warnings, triangles};

/// Everything a scene can have.
fn scene() -> Scene {
    let mut scene = Scene::new("all kinds");
    let texture = scene.add_texture(Texture {
        name: "tiles".to_owned(),
        width: 3,
        height: 2,
        pixels: (0..6).map(|i| [i * 40, 255 - i * 40, 7]).collect(),
        wrap: [Wrap::Mirror, Wrap::Clamp],
    });
    let (sin, cos) = 0.4f32.sin_cos();
    let transform = Mat3::from_cols(
        Vec3::new(2.0 * cos, -2.0 * sin, 0.0),
        Vec3::new(-3.0 * sin, -3.0 * cos, 0.0),
        Vec3::new(0.25, 0.75, 1.0),
    );
    let tiled = scene.add_material(Material {
        base_color_texture: Some(TextureUse { texture, transform }),
        metallic: 0.1,
        roughness: 0.7,
        ..Material::diffuse("tiled", Vec3::new(0.1, 0.2, 0.3))
    });
    let glowing = scene.add_material(Material {
        emission: Vec3::new(120.0, 80.0, 7.0),
        ..Material::diffuse("glowing", Vec3::ONE)
    });
    let mut quad = Mesh::quad(
        "quad",
        [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.0, 1.0), Vec3::Z],
        tiled,
    );
    quad.normals = vec![Vec3::Y; 4];
    quad.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    quad.materials[0] = glowing;
    scene.add_mesh(quad);
    let cube = Mesh::cuboid("cube", Vec3::splat(-0.3), Vec3::splat(0.4), tiled);
    scene.meshes.push(cube);
    for i in 0..3 {
        let rotation = Quat::from_scaled_axis(Vec3::new(0.1, 0.9, 0.3) * i as f32);
        let place = Vec3::new(i as f32, 2.0, 0.5);
        scene.add_object(Object {
            name: format!("copy {i}"),
            geometry: Geometry::Mesh(MeshId(1)),
            transform: Affine3A::from_scale_rotation_translation(Vec3::new(1.0, 1.5, 1.0), rotation, place),
        });
    }
    let (a, b) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 2.0, 2.5));
    for shape in [
        Shape::Sphere {
            center: a,
            radius: 0.75,
        },
        Shape::Cylinder {
            a,
            b,
            radius: 0.2,
            capped: false,
        },
        Shape::Cone {
            base: a,
            apex: b,
            radius: 0.3,
            capped: true,
        },
        Shape::Disc {
            center: b,
            normal: Vec3::new(0.6, 0.8, 0.0),
            radius: 0.5,
        },
    ] {
        scene.add_primitive(
            "body",
            Primitive {
                shape,
                material: tiled,
            },
        );
    }
    for (name, direction) in [
        ("along -x", DVec3::NEG_X),
        ("oblique", DVec3::new(1.0, -2.0, 0.5)),
        ("along x", DVec3::X),
    ] {
        let start = DVec3::new(0.1, 2.2, -0.3);
        scene.add_light(LinearLight {
            color: Vec3::new(0.5, 1.2, 0.5) / llsr_scene::luminance(Vec3::new(0.5, 1.2, 0.5)),
            emission: EmissionLaw::Isotropic,
            radius: 0.013,
            ..LinearLight::new(name, start, start + direction, 3000.0)
        });
    }
    scene.add_light(LinearLight::new("plain", DVec3::ZERO, DVec3::Y, 1.0));
    let position = DVec3::new(0.0, 3.0, 0.0);
    scene.add_light(PointLight {
        name: "bulb".to_owned(),
        position,
        flux: 800.0,
        color: Vec3::ONE,
    });
    let eye = DVec3::new(3.0, 1.5, 4.0);
    let mut look = |name: &str, projection: Projection| {
        let mut camera = Camera::look_at(name, eye, DVec3::ZERO, DVec3::Y, FieldOfView::Vertical(1.0));
        camera.projection = projection;
        scene.cameras.push(camera);
    };
    look("tall", Projection::Perspective(FieldOfView::Vertical(0.75)));
    look("wide", Projection::Perspective(FieldOfView::Horizontal(1.25)));
    look("map", Projection::Orthographic { height: 7.0 });
    scene.unit = PhotometricUnit::Radiant;
    scene.origin = DVec3::new(1e6, -5.0, 0.125);
    scene
}

fn round_trip(scene: &Scene, name: &str) -> Loaded {
    let folder = Folder::new();
    let path = folder.path(name);
    write_gltf(&path, scene).expect("a written file");
    load_scene(&path, &LoadOptions::default()).expect("a readable file")
}

#[test]
fn all_of_a_scene_comes_back() {
    let scene = scene();
    for name in ["a.gltf", "a.glb"] {
        let loaded = round_trip(&scene, name);
        let kinds: Vec<_> = loaded.warnings.iter().map(|w| w.kind).collect();
        assert_eq!(
            kinds,
            [llsr_io::WarningKind::DarkEmitter],
            "the glowing triangle is no tube"
        );
        let back = &loaded.scene;
        assert_eq!(
            (back.name.as_str(), back.unit),
            ("a", scene.unit),
            "{name}: named by its file"
        );

        let key = |(name, c): &(String, [DVec3; 3])| {
            (name.clone(), c.map(|p| (p * 1e3).round().as_i64vec3().to_array()))
        };
        let sorted = |scene: &Scene| {
            let mut list = triangles(scene);
            list.sort_by_key(key);
            list
        };
        let (want, got) = (sorted(&scene), sorted(back));
        assert_eq!(want.len(), got.len(), "{name}: as many triangles");
        for ((want_name, want), (got_name, got)) in want.iter().zip(&got) {
            assert_eq!(want_name, got_name, "{name}: material");
            let error = want
                .iter()
                .zip(got)
                .map(|(p, q)| p.distance(*q))
                .fold(0.0, f64::max);
            assert!(error < 1e-6, "{name}: {want:?} is {got:?}");
        }
        assert_eq!(back.meshes.len(), 2, "{name}: the cube is still shared");

        let shapes = |scene: &Scene| -> Vec<(Shape, DVec3)> {
            let objects = scene.objects.iter();
            objects
                .filter_map(|o| match o.geometry {
                    Geometry::Primitive(p) => {
                        Some((p.shape, o.transform.translation.as_dvec3() + scene.origin))
                    }
                    Geometry::Mesh(_) => None,
                })
                .collect()
        };
        for ((want, want_place), (got, got_place)) in shapes(&scene).into_iter().zip(shapes(back)) {
            assert_eq!(want, got, "{name}: shape");
            assert!(
                want_place.distance(got_place) < 1e-6,
                "{name}: {want_place} is {got_place}"
            );
        }
        assert_eq!(back.primitive_count(), 4, "{name}: none is a mesh");

        assert_eq!(back.textures, scene.textures, "{name}: every pixel");
        for (want, got) in scene.materials.iter().zip(&back.materials) {
            assert_eq!(
                (&want.name, want.base_color, want.roughness),
                (&got.name, got.base_color, got.roughness),
                "{name}"
            );
            assert_eq!(want.metallic, got.metallic, "{name}");
            assert!(
                want.emission.distance(got.emission) <= 1e-5 * want.emission.length(),
                "{name}: emission"
            );
            let transform = |m: &Material| m.base_color_texture.map(|t| t.transform);
            match (transform(want), transform(got)) {
                (Some(want), Some(got)) => assert!(want.abs_diff_eq(got, 1e-5), "{name}: {want} is {got}"),
                (want, got) => assert_eq!(want, got, "{name}"),
            }
        }
        compare_lights(&scene, back);
        assert_eq!(back.cameras.len(), 3, "{name}: cameras");
        for (want, got) in scene.cameras.iter().zip(&back.cameras) {
            assert_eq!(want.name, got.name, "{name}");
            let place = |camera: &Camera, scene: &Scene| camera.position + scene.origin;
            assert!(
                place(want, &scene).distance(place(got, back)) < 1e-9,
                "{name}: place"
            );
            assert!(want.axes.abs_diff_eq(got.axes, 1e-12), "{name}: axes");
            match (want.projection, got.projection) {
                (
                    Projection::Perspective(FieldOfView::Vertical(want)),
                    Projection::Perspective(FieldOfView::Vertical(got)),
                )
                | (Projection::Orthographic { height: want }, Projection::Orthographic { height: got }) => {
                    assert!(
                        (want - got).abs() < 1e-6,
                        "{name}: single precision in the library"
                    );
                }
                (want, got) => assert_eq!(want, got, "{name}"),
            }
        }
    }
}

fn compare_lights(scene: &Scene, back: &Scene) {
    assert_eq!(scene.lights.len(), back.lights.len(), "lights");
    for (want, got) in scene.lights.iter().zip(&back.lights) {
        assert_eq!(want.name(), got.name(), "name");
        assert!(
            (want.flux() / got.flux() - 1.0).abs() < 1e-6,
            "flux {} is {}",
            want.flux(),
            got.flux()
        );
        assert!(want.color().distance(got.color()) < 1e-5, "colour");
        let ends = |light: &Light, scene: &Scene| <[DVec3; 2]>::from(light.ends()).map(|p| p + scene.origin);
        for (p, q) in ends(want, scene).into_iter().zip(ends(got, back)) {
            assert!(p.distance(q) < 1e-8, "{}: {p} is {q}", want.name());
        }
        match (want, got) {
            (Light::Linear(want), Light::Linear(got)) => {
                assert_eq!(
                    (want.emission, want.radius),
                    (got.emission, got.radius),
                    "law and radius"
                );
            }
            (Light::Point(_), Light::Point(_)) => {}
            _ => panic!("{want:?} is {got:?}"),
        }
    }
}

#[test]
fn all_built_in_scenes_come_back() {
    for demo in llsr_scene::demo::DEMOS {
        let scene = demo.build();
        let loaded = round_trip(&scene, "a.gltf");
        let back = &loaded.scene;
        assert_no_warnings(&loaded);
        assert_eq!(
            back.triangle_count(),
            scene.triangle_count(),
            "{}: triangles",
            scene.name
        );
        assert_eq!(
            back.primitive_count(),
            scene.primitive_count(),
            "{}: primitives",
            scene.name
        );
        assert_eq!(back.cameras.len(), scene.cameras.len(), "{}: cameras", scene.name);
        compare_lights(&scene, back);
        let world = |scene: &Scene| {
            let bounds = scene.bounds();
            [bounds.min, bounds.max].map(|p| p.as_dvec3() + scene.origin)
        };
        for (p, q) in world(&scene).into_iter().zip(world(back)) {
            assert!(p.distance(q) < 1e-5, "{}: bounds {p} are {q}", scene.name);
        }
    }
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let folder = Folder::new();
    for ending in ["gltf", "glb"] {
        let write = |name: &str| {
            let path = folder.path(&format!("{name}.{ending}"));
            write_gltf(&path, &scene()).expect("a written file");
            std::fs::read(path).expect("its bytes")
        };
        assert_eq!(write("one"), write("two"), "{ending}");
    }
}

#[test]
fn reading_what_was_read_changes_nothing() {
    let first = round_trip(&scene(), "a.glb").scene;
    let second = round_trip(&first, "a.glb").scene;
    assert_eq!(first.objects.len(), second.objects.len(), "objects");
    compare_lights(&first, &second);
    for ((_, p), (_, q)) in triangles(&first).iter().zip(triangles(&second)) {
        assert!(
            p.iter().zip(q).all(|(p, q)| p.distance(q) < 1e-6),
            "{p:?} is {q:?}"
        );
    }
}

#[test]
fn scenes_the_format_cannot_hold_are_refused() {
    let folder = Folder::new();
    let refused = |scene: &Scene, name: &str| {
        let path = folder.path(name);
        let error = write_gltf(&path, scene).expect_err("refused");
        assert!(!path.exists(), "nothing is written");
        error
    };
    assert!(
        matches!(refused(&scene(), "a.obj"), Error::Ending { .. }),
        "another format"
    );
    let mut broken = scene();
    broken.meshes[0].positions[0].x = f32::NAN;
    assert!(
        refused(&broken, "a.glb").to_string().contains("quad"),
        "a broken mesh is named"
    );
    let mut sheared = scene();
    if let Some(texture) = &mut sheared.materials[0].base_color_texture {
        texture.transform.y_axis = Vec3::new(1.0, 1.0, 0.0);
    }
    assert!(
        refused(&sheared, "a.glb").to_string().contains("shear"),
        "no texture transform of the format"
    );
}

#[test]
fn an_empty_mesh_is_no_obstacle() {
    let mut scene = Scene::new("lights only");
    scene.add_mesh(Mesh::default());
    scene.add_light(LinearLight::new("a", DVec3::ZERO, DVec3::Y, 1.0));
    let loaded = round_trip(&scene, "a.gltf");
    assert_no_warnings(&loaded);
    assert_eq!(
        (loaded.scene.objects.len(), loaded.scene.lights.len()),
        (0, 1),
        "the light came through"
    );
}

#[test]
fn rectangles_and_discs_shine_along_their_own_minus_z_and_survive_a_round_trip() {
    let mut scene = Scene::new("areas");
    let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::quad(
        "floor",
        [Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X],
        grey,
    ));
    let down = AreaShape::Rect {
        corner: DVec3::new(0.2, 2.0, 0.1),
        along: DVec3::new(0.6, 0.0, 0.0),
        across: DVec3::new(0.0, 0.0, 0.3),
    };
    let tilted = AreaShape::Disc {
        center: DVec3::new(1.0, 2.0, 3.0),
        normal: DVec3::new(0.6, -0.8, 0.0),
        radius: 0.25,
    };
    for (name, shape) in [("rect", down), ("disc", tilted)] {
        scene.add_light(AreaLight {
            name: name.to_owned(),
            shape,
            flux: 1200.0,
            color: Vec3::ONE,
        });
    }
    let folder = Folder::new();
    let path = folder.path("areas.gltf");
    write_gltf(&path, &scene).expect("written");
    let loaded = load_scene(&path, &LoadOptions::default()).expect("read");
    let moved = loaded.scene.origin;
    for (want, got) in scene.lights.iter().zip(&loaded.scene.lights) {
        let (Light::Area(want), Light::Area(got)) = (want, got) else {
            panic!("{got:?} has no area")
        };
        assert!((want.flux / got.flux - 1.0).abs() < 1e-6, "{want:?}, {got:?}");
        let facing = |shape: &AreaShape| match *shape {
            AreaShape::Rect {
                corner,
                along,
                across,
            } => (
                corner + 0.5 * (along + across),
                along.cross(across),
                along.length().min(across.length()),
            ),
            AreaShape::Disc {
                center,
                normal,
                radius,
            } => (center, normal, radius),
        };
        let ((c0, n0, s0), (c1, n1, s1)) = (facing(&want.shape), facing(&got.shape));
        assert!(
            c0.distance(c1 + moved) < 1e-5 && n0.distance(n1) < 1e-5,
            "{want:?}, {got:?}"
        );
        assert!((s0 - s1).abs() < 1e-6, "{want:?}, {got:?}");
    }
}
