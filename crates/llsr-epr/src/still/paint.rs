//! From light to colours: albedo, texture detail and complex pixels.

use glam::{Vec3, Vec3A};
use llsr_epi::{EdgePointImage, Picture, PixelClass};
use llsr_scene::luminance;
use llsr_shading::{Pixel, Statistics, SurfacePoint};
use rayon::prelude::*;

use crate::still::sample::{Brush, Shaded};
use crate::still::spread::AROUND;
use crate::still::surface::{Seen, TOGETHER, look_each};
use crate::still::{StillCounts, radiance};

/// Rays through a pixel around which the albedo changes.
const DETAIL: u32 = 4;
/// In complex pixels with a shadow's edge one of so many rays is shaded.
const IN_SHADOW: u32 = 4;
/// Relative difference of light below which the shadow between is not worth more points.
const CALM: f32 = 0.1;
/// Relative difference between neighbours from which the albedo is said to change.
const CHANGE: f32 = 0.05;
/// Pixels to each side in which a complex pixel looks for light on its surfaces before it shades them itself.
const REACH: u32 = 2;

pub(crate) struct Painter<'a> {
    pub(crate) shaded: &'a Shaded<'a>,
    pub(crate) image: &'a EdgePointImage,
    pub(crate) seen: &'a [Seen],
    /// Pixels with a narrow shadow's edge.
    pub(crate) shadowed: &'a [bool],
    pub(crate) light: &'a [Vec3A],
    pub(crate) complex_samples: u32,
    pub(crate) progress: &'a (dyn Fn() -> bool + Sync),
    pub(crate) counts: &'a mut StillCounts,
    pub(crate) statistics: &'a mut Statistics,
}

/// Do a point's light and all light around it, given as its mean and how much it differs, hardly differ?
fn is_calm(light: Vec3A, (around, spread): (Vec3A, f32)) -> bool {
    let [light, around] = [light, around].map(|light| luminance(light.into()));
    spread < CALM && (light - around).abs() <= CALM * light.max(around)
}

/// Where subsample `index` of `count` lies in its pixel: Hammersley's set.
fn subpixel(count: u32, index: u32) -> (f64, f64) {
    let x = (f64::from(index) + 0.5) / f64::from(count);
    let y = f64::from(index.reverse_bits()) / (1u64 << 32) as f64;
    (x, (y + 0.5 / f64::from(count)).fract())
}

impl Painter<'_> {
    /// Colours of all pixels that are not complex, before edges are blended.
    pub(crate) fn details(&mut self, picture: &mut Picture) -> Option<()> {
        let viewport = self.shaded.viewport;
        let width = viewport.width as usize;
        let this = &*self;
        let rows: Option<Vec<(Vec<Vec3>, usize)>> = (0..viewport.height)
            .into_par_iter()
            .map(|y| {
                let mut detailed = 0;
                let row = (0..viewport.width)
                    .map(|x| {
                        let index = y as usize * width + x as usize;
                        let seen = &this.seen[index];
                        let (mut albedo, mut emission) = (seen.albedo, seen.emission);
                        if this.image.class(x, y) == PixelClass::Empty && this.is_detailed(x, y) {
                            detailed += 1;
                            (albedo, emission) = this.average(x, y);
                        }
                        radiance(albedo, emission, this.light[index], this.shaded.glossy)
                    })
                    .collect();
                (this.progress)().then_some((row, detailed))
            })
            .collect();
        for (y, (row, detailed)) in (0..).zip(rows?) {
            self.counts.detailed += detailed;
            for (x, colour) in (0..).zip(row) {
                picture.set_pixel(x, y, colour);
            }
        }
        self.statistics.primary_rays += self.counts.detailed as u64 * u64::from(DETAIL);
        Some(())
    }

    /// Does the albedo change towards one of the four nearest pixels?
    fn is_detailed(&self, x: u32, y: u32) -> bool {
        let (width, height) = self.image.size();
        let here = &self.seen[(y * width + x) as usize];
        [(-1, 0), (1, 0), (0, -1), (0, 1)].into_iter().any(|(dx, dy)| {
            let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
            if u >= width || v >= height {
                return false;
            }
            let there = &self.seen[(v * width + u) as usize];
            let differ = |a: Vec3, b: Vec3| (a - b).abs().max_element() > CHANGE * (a + b).max_element();
            differ(here.albedo, there.albedo)
                || (!here.same_material(there) && differ(here.emission, there.emission))
        })
    }

    /// Mean albedo and emission of a pixel.
    fn average(&self, x: u32, y: u32) -> (Vec3, Vec3) {
        let (mut albedo, mut emission) = (Vec3::ZERO, Vec3::ZERO);
        let mut points = [None; DETAIL as usize];
        self.look_each(x, y, &mut points);
        for point in points.iter().flatten() {
            albedo += point.albedo;
            emission += point.emission;
        }
        (albedo / DETAIL as f32, emission / DETAIL as f32)
    }

    /// Supersamples what the edge image cannot tell alone: complex pixels, and of those with one edge, those beside one and
    /// `doubtful` ones where more than one surface is seen. Lists how many points were shaded in each complex pixel, and in each other in which there were some.
    pub(crate) fn mixed(&mut self, picture: &mut Picture, doubtful: &[bool]) -> Option<Vec<(u32, u32, u32)>> {
        let (width, height) = self.image.size();
        let pixels: Vec<(u32, u32)> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .filter(|&(x, y)| {
                doubtful[(y * width + x) as usize]
                    || AROUND.iter().chain(&[(0, 0, 0.0)]).any(|&(dx, dy, _)| {
                        let (u, v) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
                        u < width && v < height && self.image.class(u, v) != PixelClass::Empty
                    })
            })
            .collect();
        let length = pixels.len().div_ceil(self.shaded.viewport.height as usize).max(1);
        let this = &*self;
        let parts: Option<Vec<_>> = pixels
            .par_chunks(length)
            .map_init(Brush::default, |brush, pixels| {
                let mut counts = Statistics::default();
                let colours: Vec<(Option<Vec3>, u32)> = pixels
                    .iter()
                    .map(|&(x, y)| this.supersample(x, y, brush, &mut counts))
                    .collect();
                (this.progress)().then_some((colours, counts))
            })
            .collect();
        let mut colours = Vec::with_capacity(pixels.len());
        for (part, counts) in parts? {
            colours.extend(part);
            self.statistics.add(&counts);
        }
        let mut list = Vec::with_capacity(pixels.len());
        for (&(x, y), (colour, shaded)) in pixels.iter().zip(colours) {
            if let Some(colour) = colour {
                picture.set_pixel(x, y, colour);
            }
            self.counts.complex_shaded += shaded as usize;
            if shaded > 0 || self.image.class(x, y) == PixelClass::Complex {
                list.push((x, y, shaded));
            }
        }
        Some(list)
    }

    /// The colour of a pixel and the number of points that were shaded for it; no colour if one surface fills a pixel that is
    /// not complex, which is what interpolation and blending are for.
    fn supersample(
        &self,
        x: u32,
        y: u32,
        brush: &mut Brush,
        statistics: &mut Statistics,
    ) -> (Option<Vec3>, u32) {
        // Surfaces in the pixel: the first ray to each, rays, sums of albedo and emission.
        struct Group {
            seen: Seen,
            first: u32,
            rays: u32,
            albedo: Vec3,
            emission: Vec3,
        }
        let mut groups: Vec<Group> = Vec::new();
        let count = self.complex_samples;
        if self.image.class(x, y) == PixelClass::Empty && !self.is_mixed(x, y, statistics) {
            return (None, 0);
        }
        let index = y as usize * self.shaded.viewport.width as usize + x as usize;
        let mut points = std::mem::take(&mut brush.points);
        points.resize(count as usize, None);
        self.look_each(x, y, &mut points);
        statistics.primary_rays += u64::from(count);
        for (subsample, point) in (0..).zip(&points) {
            let Some(point) = point else { continue };
            let seen = Seen::new(point);
            let known = groups.iter().position(|group| group.seen.is_near(&seen));
            let number = known.unwrap_or_else(|| {
                groups.push(Group {
                    seen,
                    first: subsample,
                    rays: 0,
                    albedo: Vec3::ZERO,
                    emission: Vec3::ZERO,
                });
                groups.len() - 1
            });
            let group = &mut groups[number];
            group.rays += 1;
            group.albedo += point.albedo;
            group.emission += point.emission;
        }
        let whole = groups.len() == 1 && groups[0].rays == count;
        if self.image.class(x, y) != PixelClass::Complex && (whole || groups.is_empty()) {
            brush.points = points;
            return (None, 0);
        }
        // Where light jumps inside the pixel its neighbours know too little.
        let dense = self.shadowed[index] && self.image.class(x, y) == PixelClass::Complex;
        let mut colour = Vec3::ZERO;
        let mut shaded = 0;
        for group in &groups {
            let rays = group.rays as f32;
            let around = self.light_around(x, y, &group.seen);
            let light = match around {
                Some((light, _)) if !dense => light,
                _ => {
                    let (mut sum, mut number) = (Vec3A::ZERO, 0);
                    for (subsample, point) in (0..).zip(&points) {
                        let chosen = subsample == group.first || dense && subsample % IN_SHADOW == 0;
                        let Some(point) = point.as_ref().filter(|_| chosen) else {
                            continue;
                        };
                        if !group.seen.is_near(&Seen::new(point)) {
                            continue;
                        }
                        let at = Pixel {
                            x,
                            y,
                            index: index as u64,
                            subsample,
                        };
                        sum += self.shaded.light(point, at, brush, None, statistics);
                        number += 1;
                        // The shadow in this pixel is that of one light among many.
                        if number == 1 && around.is_some_and(|around| is_calm(sum, around)) {
                            break;
                        }
                    }
                    shaded += number;
                    sum / number.max(1) as f32
                }
            };
            let mean = radiance(
                group.albedo / rays,
                group.emission / rays,
                light,
                self.shaded.glossy,
            );
            colour += mean * (rays / count as f32);
        }
        brush.points = points;
        (Some(colour), shaded)
    }

    /// Looks through all subsamples of a pixel.
    fn look_each(&self, x: u32, y: u32, points: &mut [Option<SurfacePoint>]) {
        let Shaded {
            scene,
            tracer,
            camera,
            viewport,
            ..
        } = *self.shaded;
        let count = points.len() as u32;
        for (i, part) in (0..).zip(points.chunks_mut(TOGETHER)) {
            let place = |k: usize| {
                let (dx, dy) = subpixel(count, (i * TOGETHER + k) as u32);
                (f64::from(x) + dx, f64::from(y) + dy)
            };
            let places: [(f64, f64); TOGETHER] = std::array::from_fn(place);
            look_each(scene, tracer, camera, viewport, &places[..part.len()], part);
        }
    }

    /// Do a few rays through the pixel see another surface than the one through its centre?
    fn is_mixed(&self, x: u32, y: u32, statistics: &mut Statistics) -> bool {
        let centre = &self.seen[y as usize * self.shaded.viewport.width as usize + x as usize];
        let mut points = [None; DETAIL as usize];
        self.look_each(x, y, &mut points);
        statistics.primary_rays += u64::from(DETAIL);
        points.iter().any(|point| match point {
            Some(point) => !Seen::new(point).is_near(centre),
            None => centre.is_hit(),
        })
    }

    /// Light on a surface as pixels around that are not complex have it, and by how much they differ, as a share of the most; `None`
    /// if none of them sees that surface.
    fn light_around(&self, x: u32, y: u32, surface: &Seen) -> Option<(Vec3A, f32)> {
        let (width, height) = self.image.size();
        let own = y as usize * width as usize + x as usize;
        if self.image.class(x, y) != PixelClass::Complex && self.seen[own].is_near(surface) {
            return Some((self.light[own], 0.0));
        }
        let (mut sum, mut weights) = (Vec3A::ZERO, 0.0);
        let (mut least, mut most) = (f32::MAX, 0.0f32);
        for v in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
            for u in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
                let index = v as usize * width as usize + u as usize;
                let known = index != own && self.image.class(u, v) != PixelClass::Complex;
                if known && self.seen[index].is_near(surface) {
                    let weight = 1.0 / (u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2)) as f32;
                    sum += self.light[index] * weight;
                    weights += weight;
                    let luminance = luminance(self.light[index].into());
                    (least, most) = (least.min(luminance), most.max(luminance));
                }
            }
        }
        (weights > 0.0).then(|| (sum / weights, (most - least) / most.max(f32::MIN_POSITIVE)))
    }
}
