//! Irradiance and its gradients from rays over a hemisphere.
//!
//! G. Ward, P. Heckbert, "Irradiance gradients", Eurographics Workshop on Rendering 1992: one stratified set of rays,
//! cosine-weighted, gives the irradiance, how it changes when the surface turns (equation 1) and when the point moves
//! (equation 2).

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Vec3};
use rand_core::Rng;

/// What one ray of a hemisphere brought.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sample {
    /// Radiance, linear RGB.
    pub(crate) radiance: Vec3,
    /// Distance (m); infinite if nothing was met.
    pub(crate) distance: f32,
}

/// Irradiance of a hemisphere with its gradients; one entry a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gathered {
    pub(crate) irradiance: Vec3,
    /// Change for a turn about each axis (per radian).
    pub(crate) rotation: [Vec3; 3],
    /// Change for a move along each axis (per metre).
    pub(crate) translation: [Vec3; 3],
    /// Harmonic mean of the distances (m).
    pub(crate) mean_distance: f64,
}

/// A right-handed frame whose third axis is `normal`.
pub(crate) fn frame(normal: DVec3) -> DMat3 {
    let (x, y) = normal.any_orthonormal_pair();
    DMat3::from_cols(x, y, normal)
}

/// A number in [0, 1).
pub(crate) fn unit(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// The direction over a hemisphere, cosine-weighted, for two numbers in [0, 1).
pub(crate) fn cosine_direction(frame: &DMat3, u: f64, v: f64) -> DVec3 {
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    *frame * DVec3::new(radius * cos, radius * sin, (1.0 - u).sqrt())
}

/// `rows` x `columns` directions over the hemisphere about the third axis of `frame`, one at random in each cell, column by
/// column from the zenith down. `random` gives numbers in [0, 1).
pub(crate) fn directions(
    frame: DMat3,
    [rows, columns]: [u32; 2],
    mut random: impl FnMut() -> f64,
) -> impl Iterator<Item = DVec3> {
    let (m, n) = (f64::from(rows), f64::from(columns));
    let cells = (0..columns).flat_map(move |column| (0..rows).map(move |row| (row, column)));
    cells.map(move |(row, column)| {
        let (u, v) = (random(), random());
        cosine_direction(&frame, (f64::from(row) + u) / m, (f64::from(column) + v) / n)
    })
}

/// Sends rays in all [`directions`]. `samples` is working memory and holds what each ray brought afterwards, in their order.
pub(crate) fn gather(
    frame: &DMat3,
    [rows, columns]: [u32; 2],
    random: &mut impl Rng,
    samples: &mut Vec<Sample>,
    mut ray: impl FnMut(DVec3) -> Sample,
) -> Gathered {
    let (m, n) = (f64::from(rows), f64::from(columns));
    samples.clear();
    let mut sum = Vec3::ZERO;
    let mut closeness = 0.0;
    for direction in directions(*frame, [rows, columns], || unit(random)) {
        let sample = ray(direction);
        sum += sample.radiance;
        closeness += 1.0 / f64::from(sample.distance);
        samples.push(sample);
    }
    // Sine of the angle between the zenith and the upper border of a row.
    let border = |row: u32| (f64::from(row) / m).sqrt();
    // The tangent of that angle summed up from the zenith. Its mean over a row stands for the value at a place in it: near the
    // horizon the two differ much.
    let tangents = |row: u32| {
        let square = f64::from(row) / m;
        square.sqrt().asin() - (square * (1.0 - square)).sqrt()
    };
    let mut rotation = [Vec3::ZERO; 3];
    let mut translation = [Vec3::ZERO; 3];
    let add = |to: &mut [Vec3; 3], direction: DVec3, value: Vec3| {
        let direction = (*frame * direction).as_vec3();
        for (axis, sum) in to.iter_mut().enumerate() {
            *sum += value * direction[axis];
        }
    };
    for column in 0..columns {
        let here = &samples[(column * rows) as usize..][..rows as usize];
        let before = &samples[((column + columns - 1) % columns * rows) as usize..][..rows as usize];
        let (sin, cos) = (TAU * (f64::from(column) + 0.5) / n).sin_cos();
        let (outwards, around) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let (sin, cos) = (TAU * f64::from(column) / n).sin_cos();
        let across = DVec3::new(-sin, cos, 0.0);
        let mut turned = Vec3::ZERO;
        let (mut radial, mut sideways) = (Vec3::ZERO, Vec3::ZERO);
        for row in 0..rows {
            let index = row as usize;
            turned += here[index].radiance * (m * (tangents(row + 1) - tangents(row))) as f32;
            if row > 0 {
                let sine = border(row);
                let nearer = here[index].distance.min(here[index - 1].distance);
                let weight = TAU / n * sine * (1.0 - sine * sine) / f64::from(nearer);
                radial += (here[index].radiance - here[index - 1].radiance) * weight as f32;
            }
            let nearer = here[index].distance.min(before[index].distance);
            let weight = (border(row + 1) - border(row)) / f64::from(nearer);
            sideways += (here[index].radiance - before[index].radiance) * weight as f32;
        }
        add(&mut rotation, around, turned * (PI / (m * n)) as f32);
        add(&mut translation, outwards, radial);
        add(&mut translation, across, sideways);
    }
    Gathered {
        irradiance: sum * (PI / (m * n)) as f32,
        rotation,
        translation,
        mean_distance: m * n / closeness,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;

    /// The mean of many gatherings with few rays each.
    fn mean(normal: DVec3, rays: [u32; 2], ray: impl Fn(DVec3) -> Sample) -> Gathered {
        let frame = frame(normal);
        let mut random = Pcg64Mcg::new(5);
        let mut samples = Vec::new();
        let mut mean = Gathered::default();
        let rounds = 100;
        for _ in 0..rounds {
            let one = gather(&frame, rays, &mut random, &mut samples, &ray);
            let share = 1.0 / rounds as f32;
            mean.irradiance += one.irradiance * share;
            for axis in 0..3 {
                mean.rotation[axis] += one.rotation[axis] * share;
                mean.translation[axis] += one.translation[axis] * share;
            }
            mean.mean_distance += one.mean_distance / f64::from(rounds);
        }
        mean
    }

    fn gradient(of: &[Vec3; 3]) -> DVec3 {
        DVec3::new(of[0].x.into(), of[1].x.into(), of[2].x.into())
    }

    /// A floor before a wall that shines, as high as `height` and without end to both sides.
    #[test]
    fn gradients_before_a_bright_wall_are_those_of_the_closed_form() {
        let height = 1.5;
        let wall = |distance: f64| {
            move |d: DVec3| {
                let t = -distance / d.x;
                if d.x < 0.0 && t * d.y <= height {
                    Sample {
                        radiance: Vec3::splat(2.0),
                        distance: t as f32,
                    }
                } else {
                    // A dark sky, so far away that it does not move.
                    Sample {
                        radiance: Vec3::ZERO,
                        distance: 1e6,
                    }
                }
            }
        };
        for distance in [0.5, 1.0, 3.0] {
            let got = mean(DVec3::Y, [48, 144], wall(distance));
            let diagonal = distance.hypot(height);
            let irradiance = PI * (1.0 - distance / diagonal);
            let slope = -PI * height * height / diagonal.powi(3);
            assert!(
                (f64::from(got.irradiance.x) / irradiance - 1.0).abs() < 0.01,
                "{distance}: {got:?}"
            );
            let translation = gradient(&got.translation);
            // The method takes the distance of a border from the rays beside it: below the border they are shorter.
            assert!(
                (translation.x / slope - 1.0).abs() < 0.08,
                "{distance}: {translation} for {slope}"
            );
            assert!(
                translation.z.abs() < 0.02 * slope.abs(),
                "nothing changes along the wall: {translation}"
            );
        }
    }

    /// Half of the sky shines: turning the surface towards it by `a` gives pi/2 (1 + sin a).
    #[test]
    fn rotation_gradient_under_half_a_sky_is_that_of_the_closed_form() {
        for normal in [DVec3::Z, DVec3::new(0.0, 0.6, 0.8)] {
            let got = mean(normal, [12, 36], |d| Sample {
                radiance: Vec3::splat(if d.x > 0.0 { 1.0 } else { 0.0 }),
                distance: f32::INFINITY,
            });
            let about = normal.cross(DVec3::X);
            let rotation = gradient(&got.rotation);
            assert!(
                (f64::from(got.irradiance.x) / (PI / 2.0) - 1.0).abs() < 0.01,
                "{got:?}"
            );
            assert!(
                (rotation.dot(about) / (PI / 2.0) - 1.0).abs() < 0.02,
                "{rotation} about {about}"
            );
            assert!(
                rotation.cross(about).length() < 0.05,
                "about that axis alone: {rotation}"
            );
            assert!(gradient(&got.translation).length() < 1e-6, "a sky does not move");
            assert_eq!(got.mean_distance, f64::INFINITY, "and has no distance");
        }
    }

    #[test]
    fn mean_distance_in_a_hemisphere_is_its_radius() {
        let got = mean(DVec3::X, [7, 20], |_| Sample {
            radiance: Vec3::ONE,
            distance: 2.5,
        });
        assert!((got.mean_distance - 2.5).abs() < 1e-9, "{got:?}");
        assert!((f64::from(got.irradiance.y) / PI - 1.0).abs() < 1e-5, "{got:?}");
        assert!(
            gradient(&got.translation).length() < 1e-5,
            "even all round: {got:?}"
        );
    }
}
