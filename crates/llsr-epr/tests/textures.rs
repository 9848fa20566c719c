//! Textures are as sharp as the pixels, however few the points.

use std::sync::Arc;

use glam::{Affine3A, DVec3, Mat3, Vec2, Vec3};
use llsr_epi::{Picture, PixelClass};
use llsr_epr::{BlindInterpolation, FrameRenderer, FrameSettings, LockstepRenderer, ray_trace};
use llsr_scene::{
    Camera, FieldOfView, LinearLight, Material, Mesh, ObjectId, Scene, Texture, TextureUse, Viewport, Wrap,
};
use llsr_shading::{DirectShader, Place, Shader, World};

const VIEWPORT: Viewport = Viewport {
    width: 160,
    height: 120,
};

/// A texture of blots a few texels wide.
fn blots(wrap: [Wrap; 2]) -> Texture {
    let size = 32u32;
    let value = |x: u32, y: u32, salt: u32| {
        let blot = (x / 4).wrapping_mul(0x9e37_79b9) ^ (y / 3).wrapping_mul(0x85eb_ca6b) ^ salt;
        (blot.wrapping_mul(0xc2b2_ae35) >> 24) as u8
    };
    Texture {
        name: "blots".to_owned(),
        width: size,
        height: size,
        pixels: (0..size * size)
            .map(|i| [1, 2, 3].map(|salt| value(i % size, i / size, salt)))
            .collect(),
        wrap,
    }
}

/// A floor in a fan of triangles and a box, both textured, under a light.
fn textured(wrap: [Wrap; 2]) -> (Scene, ObjectId) {
    let mut scene = Scene::new("blots");
    let texture = scene.add_texture(blots(wrap));
    let mut floor = Material::diffuse("floor", Vec3::new(0.9, 0.8, 0.7));
    floor.base_color_texture = Some(TextureUse {
        texture,
        transform: Mat3::from_scale_angle_translation(Vec2::splat(2.0), 0.3, Vec2::new(0.1, -0.2)),
    });
    let floor = scene.add_material(floor);
    let mut paper = Material::diffuse("paper", Vec3::ONE);
    paper.base_color_texture = Some(TextureUse::plain(texture));
    let paper = scene.add_material(paper);
    let corners = [[-4.0, -4.0], [-4.0, 4.0], [4.0, 4.0], [4.0, -4.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    let mut quad = Mesh::quad("floor", corners, floor);
    quad.uvs = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
        .map(Vec2::from)
        .to_vec();
    scene.add_mesh(quad);
    let (min, max) = (Vec3::new(-0.8, 0.3, -0.8), Vec3::new(0.8, 1.1, 0.8));
    let mut cuboid = Mesh::cuboid("box", min, max, paper);
    // Oblique, so that every side shows something else.
    cuboid.uvs = cuboid
        .positions
        .iter()
        .map(|p| Vec2::new(p.x + 0.6 * p.y, p.z - 0.7 * p.y) * 0.8)
        .collect();
    let id = scene.add_mesh(cuboid);
    let (a, b) = (DVec3::new(-0.4, 4.0, 1.0), DVec3::new(0.4, 4.0, 1.0));
    scene.add_light(LinearLight::new("tube", a, b, 3000.0));
    (scene, id)
}

fn camera() -> Camera {
    let (eye, target) = (DVec3::new(1.0, 2.8, 3.6), DVec3::new(0.0, 0.4, 0.0));
    Camera::look_at("eye", eye, target, DVec3::Y, FieldOfView::vertical_degrees(48.0))
}

fn lockstep(world: &World, settings: FrameSettings, samples: usize) -> LockstepRenderer {
    let renderer = FrameRenderer::new(world.scene(), VIEWPORT, settings).expect("size");
    LockstepRenderer::new(renderer, samples)
}

/// Relative error of a picture, in the mean of the pixels that no edge crosses.
fn error(picture: &Picture, renderer: &FrameRenderer, truth: &Picture) -> f32 {
    let (mut difference, mut sum) = (0.0, 0.0);
    for y in 0..VIEWPORT.height {
        for x in 0..VIEWPORT.width {
            if renderer.image().class(x, y) == PixelClass::Empty {
                let (a, b) = (picture.pixel(x, y), truth.pixel(x, y));
                difference += (a - b).abs().element_sum();
                sum += b.element_sum();
            }
        }
    }
    difference / sum
}

fn bits(picture: &Picture) -> Vec<u32> {
    let rows = (0..VIEWPORT.height).map(|y| picture.row(y));
    rows.flat_map(|row| row.into_iter().flatten().map(|value| value.to_bits()))
        .collect()
}

#[test]
fn few_points_show_whole_textures_under_every_wrap() {
    let wraps = [
        [Wrap::Repeat, Wrap::Repeat],
        [Wrap::Mirror, Wrap::Clamp],
        [Wrap::Clamp, Wrap::Mirror],
    ];
    for wrap in wraps {
        let (scene, _) = textured(wrap);
        let mut plain = scene.clone();
        for i in 0..plain.materials.len() {
            let colour = plain.plain_albedo(&plain.materials[i]);
            plain.materials[i].base_color = colour;
            plain.materials[i].base_color_texture = None;
        }
        let with = |scene: &Scene, textures: bool| {
            let (world, _) = World::new(Arc::new(scene.clone()), &[]);
            let world = Arc::new(world);
            let shader = DirectShader::new(Arc::clone(&world), Vec3::splat(5.0));
            let truth = ray_trace(&shader, &camera(), VIEWPORT, 8, 0).expect("shaded");
            let settings = FrameSettings {
                textures,
                ..FrameSettings::default()
            };
            // One pixel in four has a point.
            let mut frames = lockstep(&world, settings, VIEWPORT.pixels() / 4);
            frames.warm_up(&shader, &camera());
            frames.draw(&camera());
            frames.shade(&shader);
            frames.draw(&camera());
            let one = ray_trace(&shader, &camera(), VIEWPORT, 1, 0).expect("shaded");
            let one = error(&one, &frames.renderer, &truth);
            let own = error(frames.renderer.picture(), &frames.renderer, &truth);
            let mut blind = BlindInterpolation::new(&frames.renderer).expect("size");
            let blind = error(blind.draw(&frames.renderer), &frames.renderer, &truth);
            (own, blind, one)
        };
        let (looked_up, blind, one) = with(&scene, true);
        let (interpolated, ..) = with(&scene, false);
        let (light, ..) = with(&plain, true);
        println!(
            "{wrap:?}: {looked_up}, blind {blind}, interpolated {interpolated}, light alone {light}, one ray {one}"
        );
        assert!(
            looked_up < light + 1.5 * one,
            "{wrap:?}: {looked_up} with textures, {light} without, {one} for one ray a pixel"
        );
        assert!(
            interpolated > 4.0 * looked_up,
            "{wrap:?}: interpolated textures err by {interpolated}"
        );
        assert!(blind < 0.5 * interpolated, "{wrap:?}: {blind} without edges");
    }
}

#[test]
fn textures_move_with_their_objects_on_any_number_of_threads() {
    let (scene, id) = textured([Wrap::Repeat; 2]);
    let (world, _) = World::new(Arc::new(scene), &[id]);
    let before = Arc::new(world);
    let shader = DirectShader::new(Arc::clone(&before), Vec3::splat(5.0));
    let turned = Affine3A::from_translation(Vec3::new(0.3, 0.2, -0.1))
        * Affine3A::from_rotation_y(0.4)
        * *before.transform(id);
    let change = before.moved(&[Place::Object(id, turned)]).expect("it moves");
    let run = |threads: usize| {
        let settings = FrameSettings {
            threads,
            ..FrameSettings::default()
        };
        let mut frames = lockstep(&before, settings, VIEWPORT.pixels() / 4);
        let shader = DirectShader::new(Arc::clone(&before), Vec3::splat(5.0));
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            frames.warm_up(&shader, &camera());
            frames.draw(&camera());
            shader.changed(&change);
            frames.renderer.changed(&change);
            for _ in 0..30 {
                frames.shade(&shader);
                frames.draw(&camera());
            }
        });
        frames
    };
    let frames = run(1);
    shader.changed(&change);
    let truth = ray_trace(&shader, &camera(), VIEWPORT, 8, 0).expect("shaded");
    let found = error(frames.renderer.picture(), &frames.renderer, &truth);
    println!("{found}");
    assert!(found < 0.02, "{found}");
    for threads in [2, 3] {
        assert_eq!(
            bits(run(threads).renderer.picture()),
            bits(frames.renderer.picture()),
            "{threads} threads"
        );
    }
}
