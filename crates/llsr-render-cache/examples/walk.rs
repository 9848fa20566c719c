//! A camera walks past spheres on a floor while 2% of the pixels are sampled in each frame; then one sphere changes
//! its colour.
//!
//! `cargo run --release -p llsr-render-cache --example walk`

use glam::{Mat4, Vec3};
use llsr_render_cache::*;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
const SAMPLES: usize = (WIDTH * HEIGHT / 50) as usize;
/// Share of the samples spent on where the camera will look ten frames on.
const AHEAD: usize = SAMPLES / 4;

/// Centre and radius.
const SPHERES: [(Vec3, f32); 3] = [
    (Vec3::new(-1.5, 1.0, -6.0), 1.0),
    (Vec3::new(1.0, 0.7, -4.0), 0.7),
    (Vec3::new(3.5, 1.3, -7.0), 1.3),
];

/// The eye in a frame; it always looks along -z, 90 degrees wide.
fn eye(frame: u32) -> Vec3 {
    Vec3::new(0.02 * frame as f32, 1.2, 0.0)
}

fn view(frame: u32) -> Result<View, Error> {
    let aspect = WIDTH as f32 / HEIGHT as f32;
    let columns = [
        [1., 0., 0., 0.],
        [0., aspect, 0., 0.],
        [0., 0., 0., -1.],
        [0., 0., 0.1, 0.],
    ];
    let matrix = Mat4::from_cols_array_2d(&columns) * Mat4::from_translation(-eye(frame));
    View::new(&matrix, WIDTH, HEIGHT)
}

/// The shader: what the ray through a pixel hits.
fn shade(frame: u32, request: Request, red: bool) -> Point {
    let (x, y) = (request.x as f32 + 0.5, request.y as f32 + 0.5);
    let direction = Vec3::new(
        2.0 * x / WIDTH as f32 - 1.0,
        (HEIGHT as f32 - 2.0 * y) / WIDTH as f32,
        -1.0,
    );
    let eye = eye(frame);
    let hit = |(centre, radius): &(Vec3, f32)| {
        let (to, square) = (*centre - eye, direction.length_squared());
        let along = to.dot(direction) / square;
        let half_squared = (radius * radius - (to - direction * along).length_squared()) / square;
        (half_squared > 0.0).then(|| along - half_squared.sqrt())
    };
    // The sky is far away; the floor is at height 0.
    let floor = if direction.y < 0.0 {
        -eye.y / direction.y
    } else {
        1e4
    };
    let (mut distance, mut object) = (floor, 0);
    for (i, sphere) in SPHERES.iter().enumerate() {
        if let Some(t) = hit(sphere)
            && t < distance
        {
            (distance, object) = (t, i as u32 + 1);
        }
    }
    let colour = if red && object == 2 {
        Vec3::X
    } else {
        Vec3::splat(0.2 + 0.2 * object as f32)
    };
    Point {
        position: eye + direction * distance,
        colour,
        surface: 0,
        object,
        lights: 1,
    }
}

fn main() -> Result<(), Error> {
    let mut store = PointStore::new((WIDTH * HEIGHT) as usize)?;
    let mut image = PointImage::new(WIDTH, HEIGHT)?;
    let mut priorities = Priorities::new(WIDTH, HEIGHT)?;
    let mut chooser = Chooser::new(WIDTH, HEIGHT)?;
    let mut prediction = Prediction::new(WIDTH, HEIGHT)?;
    let (mut requests, mut ahead) = (Vec::new(), Vec::new());
    let red = pack_colour(Vec3::X);
    println!("frame  points  pixels with a point  hidden  not covered 10 frames on  red pixels");
    for frame in 0..240 {
        store.advance(1, 255);
        let changed = frame >= 120;
        for &request in &requests {
            store.insert(&shade(frame, request, changed), &image, &Replacement::default());
        }
        for &request in &ahead {
            store.insert(
                &shade(frame + 10, request, changed),
                &image,
                &Replacement::default(),
            );
        }
        image.reproject(&store, &view(frame)?, &DepthFilter::default().for_density(0.4));
        priorities.update_by_gaps(&image, AgeRule::default());
        prediction.update(&store, &view(frame + 10)?, 4, frame as usize, 13);

        let phase = (f64::from(frame) * 0.618_033_988_75).fract();
        chooser.choose(&mut priorities, SAMPLES - AHEAD, phase, 0, &mut requests);
        prediction.choose(AHEAD, phase, &mut ahead);
        if frame % 20 == 19 {
            let Counts { occupied, hidden } = image.counts();
            let points = image.region_plane().iter().zip(image.colour_plane());
            let red = points.filter(|&(&r, &c)| r != 0 && c == red.coarse).count();
            let share = 100.0 * occupied as f32 / (WIDTH * HEIGHT) as f32;
            let missing = 100.0 * prediction.uncovered();
            println!(
                "{frame:5}  {:6}  {share:18.1}%  {hidden:6}  {missing:23.1}%  {red:10}",
                store.len()
            );
        }
    }
    Ok(())
}
