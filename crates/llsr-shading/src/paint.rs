//! Painting the pixels of a tile.
//!
//! A tile is painted in strips a few rows high. First all rays from the camera of a strip are traced, in packets; then, for
//! square blocks of pixels, what can lie between them and each light is found once; last the pixels are lit one after the
//! other, in an order in which each follows a neighbour.

use std::f64::consts::PI;

use glam::DVec3;
use llsr_quadrature::MetalRough;
use llsr_scene::{CameraRays, LightId, Scene, Viewport};
use llsr_tracer::{Hit, Shaft, Sight, Tracer};

use crate::direct::{Pixel, Work};
use crate::random::{Random, mix};
use crate::render::TILE;
use crate::share::{representative, split_surface};
use crate::{DirectLight, Layer, LightAnswer, LightState, Scratch, Settings, Statistics, SurfacePoint};

/// Rows of a strip, and width of a block that shares its shafts (pixels).
const BLOCK: u32 = 8;

/// Width and height of the pixels whose rays are traced together.
const PACKET: u32 = 4;

/// A rectangle of pixels.
pub(crate) struct Tile {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) width: u32,
    height: u32,
}

impl Tile {
    pub(crate) fn new(viewport: Viewport, column: u32, row: u32) -> Self {
        let (x, y) = (column * TILE.0, row * TILE.1);
        Self {
            x,
            y,
            width: TILE.0.min(viewport.width - x),
            height: TILE.1.min(viewport.height - y),
        }
    }

    pub(crate) fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// The place of a pixel of a strip among rays that are traced packet by packet.
fn packet_slot(strip: &Tile, row: u32, column: u32) -> usize {
    let packet = row / PACKET * strip.width.div_ceil(PACKET) + column / PACKET;
    (packet * PACKET * PACKET + row % PACKET * PACKET + column % PACKET) as usize
}

/// Subsamples of one pixel that share an answer about the lights.
#[derive(Clone, Copy)]
struct Group {
    /// The point that stands for them.
    surface: SurfacePoint,
    /// How many they are.
    points: u32,
    /// Number of the group in its pixel.
    subsample: u32,
}

/// Memory that one worker keeps from tile to tile.
#[derive(Default)]
pub(crate) struct Brush {
    scratch: Scratch,
    states: Vec<LightState>,
    /// The states after each pixel of the row above, column by column.
    above: Vec<LightState>,
    surfaces: Vec<SurfacePoint>,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
    /// What the strip's pixels see, row by row.
    groups: Vec<Group>,
    /// Where each pixel's groups begin, and where the last end.
    starts: Vec<u32>,
    /// Points of a block.
    points: Vec<DVec3>,
    /// For each block of the strip and each light.
    shafts: Vec<Shaft>,
    pixel: Vec<f64>,
}

pub(crate) struct Painter<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) tracer: &'a Tracer,
    pub(crate) rays: CameraRays,
    pub(crate) viewport: Viewport,
    pub(crate) settings: &'a Settings,
    pub(crate) direct: &'a DirectLight<'a>,
    /// Parts of each light that are searched on their own.
    pub(crate) split: u32,
}

impl Painter<'_> {
    /// All channels of a tile, one after the other, and what it took.
    pub(crate) fn tile(&self, tile: &Tile, brush: &mut Brush) -> (Vec<f32>, Statistics) {
        let channels = 3 + self
            .settings
            .layers
            .iter()
            .map(|layer| layer.channel_count())
            .sum::<usize>();
        let mut values = vec![0f32; channels * tile.pixels()];
        let mut statistics = Statistics::default();
        let lights = self.scene.lights.len();
        let exact = self.direct.asks_fans();
        brush.scratch.begin_sequence();
        brush.states.iter_mut().for_each(LightState::clear);
        brush.states.resize(lights, LightState::default());
        brush.above.iter_mut().for_each(LightState::clear);
        brush
            .above
            .resize(lights * tile.width as usize, LightState::default());
        for top in (0..tile.height).step_by(BLOCK as usize) {
            let strip = Tile {
                x: tile.x,
                y: tile.y + top,
                width: tile.width,
                height: BLOCK.min(tile.height - top),
            };
            self.look(&strip, brush, &mut statistics);
            self.find_shafts(&strip, brush, &mut statistics);
            for row in 0..strip.height {
                for step in 0..tile.width {
                    // In serpentine order every pixel but the first follows a neighbour.
                    let column = if (top + row) % 2 == 0 {
                        step
                    } else {
                        tile.width - 1 - step
                    };
                    brush.pixel.clear();
                    brush.pixel.resize(channels, 0.0);
                    let in_column = column as usize * lights..(column as usize + 1) * lights;
                    // What neighbours saw matters only to searches; where all queries were exact none has been made.
                    let mut searched = !exact || statistics.fans.over_budget > 0;
                    if searched {
                        for (state, above) in brush.states.iter_mut().zip(&brush.above[in_column.clone()]) {
                            state.prefer_richer(above);
                        }
                    }
                    let place = (row * tile.width + column) as usize;
                    let block = (column / BLOCK) as usize;
                    self.pixel(
                        strip.x + column,
                        strip.y + row,
                        place,
                        block,
                        brush,
                        &mut statistics,
                    );
                    searched |= statistics.fans.over_budget > 0;
                    if searched {
                        for (state, above) in brush.states.iter().zip(&mut brush.above[in_column]) {
                            above.copy_changes(state);
                        }
                    }
                    let index = ((top + row) * tile.width + column) as usize;
                    for (channel, &value) in brush.pixel.iter().enumerate() {
                        values[channel * tile.pixels() + index] = value as f32;
                    }
                }
            }
        }
        (values, statistics)
    }

    /// All channels of a pixel that has no neighbour.
    pub(crate) fn lone_pixel(
        &self,
        x: u32,
        y: u32,
        channels: usize,
        brush: &mut Brush,
        statistics: &mut Statistics,
    ) -> Vec<f64> {
        brush.scratch.begin_sequence();
        brush.states.iter_mut().for_each(LightState::clear);
        brush
            .states
            .resize(self.scene.lights.len(), LightState::default());
        brush.pixel.clear();
        brush.pixel.resize(channels, 0.0);
        let pixel = Tile {
            x,
            y,
            width: 1,
            height: 1,
        };
        self.look(&pixel, brush, statistics);
        brush.shafts.clear();
        self.pixel(x, y, 0, 0, brush, statistics);
        brush.pixel.clone()
    }

    /// Traces the rays of a strip from the camera and groups what they meet in each pixel.
    fn look(&self, strip: &Tile, brush: &mut Brush, statistics: &mut Statistics) {
        brush.groups.clear();
        brush.starts.clear();
        let spp = self.settings.spp as usize;
        if spp == 1 {
            self.trace_centres(strip, brush);
        }
        for row in 0..strip.height {
            for column in 0..strip.width {
                brush.starts.push(brush.groups.len() as u32);
                if spp == 1 {
                    let slot = packet_slot(strip, row, column);
                    let Some(hit) = &brush.hits[slot] else { continue };
                    statistics.hits += 1;
                    brush.groups.push(Group {
                        surface: SurfacePoint::new(self.scene, hit, brush.directions[slot]),
                        points: 1,
                        subsample: 0,
                    });
                } else {
                    self.look_through_pixel(strip.x + column, strip.y + row, brush);
                    statistics.hits += brush.surfaces.len() as u64;
                    self.group(brush);
                }
            }
        }
        brush.starts.push(brush.groups.len() as u32);
        statistics.primary_rays += strip.pixels() as u64 * spp as u64;
    }

    /// Traces one ray through each pixel of a strip; leaves them in `directions` and `hits`, packet by packet.
    ///
    /// Packets that stick out of the strip are filled with rays of its last column and row.
    fn trace_centres(&self, strip: &Tile, brush: &mut Brush) {
        let Brush { directions, hits, .. } = brush;
        directions.clear();
        hits.clear();
        for top in (0..strip.height).step_by(PACKET as usize) {
            for left in (0..strip.width).step_by(PACKET as usize) {
                let first = directions.len();
                for i in 0..PACKET * PACKET {
                    let x = strip.x + (left + i % PACKET).min(strip.width - 1);
                    let y = strip.y + (top + i / PACKET).min(strip.height - 1);
                    let (origin, direction) = self.rays.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    directions.push(direction);
                    if self.rays.eye().is_none() {
                        hits.push(self.tracer.closest(origin, direction, f64::INFINITY));
                    }
                }
                let Some(eye) = self.rays.eye() else { continue };
                hits.resize(directions.len(), None);
                self.tracer
                    .closest_each(eye, &directions[first..], f64::INFINITY, &mut hits[first..]);
            }
        }
    }

    /// Traces all subsamples of a pixel; leaves what they meet in `surfaces`.
    fn look_through_pixel(&self, x: u32, y: u32, brush: &mut Brush) {
        let Brush {
            directions,
            hits,
            surfaces,
            ..
        } = brush;
        let spp = self.settings.spp;
        let index = u64::from(y) * u64::from(self.viewport.width) + u64::from(x);
        let seed = mix(self.settings.seed ^ mix(index));
        directions.clear();
        hits.clear();
        surfaces.clear();
        for subsample in 0..spp {
            let (dx, dy) = subpixel(spp, subsample, seed);
            let (origin, direction) = self.rays.ray(f64::from(x) + dx, f64::from(y) + dy);
            directions.push(direction);
            if self.rays.eye().is_none() {
                hits.push(self.tracer.closest(origin, direction, f64::INFINITY));
            }
        }
        if let Some(eye) = self.rays.eye() {
            hits.resize(directions.len(), None);
            self.tracer.closest_each(eye, directions, f64::INFINITY, hits);
        }
        for (hit, &direction) in hits.iter().zip(&*directions) {
            surfaces.extend(
                hit.as_ref()
                    .map(|hit| SurfacePoint::new(self.scene, hit, direction)),
            );
        }
    }

    /// Groups the points of a pixel by surface.
    fn group(&self, brush: &mut Brush) {
        let Brush { surfaces, groups, .. } = brush;
        if !self.settings.share {
            groups.extend(surfaces.iter().enumerate().map(|(subsample, &surface)| Group {
                surface,
                points: 1,
                subsample: subsample as u32,
            }));
            return;
        }
        surfaces.sort_by_key(|surface| surface.object);
        let mut rest = surfaces.as_mut_slice();
        let mut subsample = 0;
        while !rest.is_empty() {
            let (same, others) = split_surface(rest);
            groups.push(Group {
                surface: representative(same),
                points: same.len() as u32,
                subsample,
            });
            subsample += 1;
            rest = others;
        }
    }

    /// Finds out what lies between each block of pixels and each light.
    fn find_shafts(&self, strip: &Tile, brush: &mut Brush, statistics: &mut Statistics) {
        let lights = self.scene.lights.len();
        let blocks = strip.width.div_ceil(BLOCK) as usize;
        if !self.direct.asks_fans() {
            brush.shafts.clear();
            return;
        }
        brush.shafts.resize_with(blocks * lights, Shaft::default);
        for (block, shafts) in brush.shafts.chunks_mut(lights.max(1)).enumerate() {
            let left = block as u32 * BLOCK;
            let right = (left + BLOCK).min(strip.width);
            brush.points.clear();
            let mut above = [DVec3::ZERO; 2];
            for row in 0..strip.height {
                let first = brush.starts[(row * strip.width + left) as usize] as usize;
                let end = brush.starts[(row * strip.width + right) as usize] as usize;
                for group in &brush.groups[first..end] {
                    if brush.points.is_empty() {
                        above[0] = group.surface.geometric_normal;
                    }
                    above[1] = group.surface.geometric_normal;
                    brush.points.push(group.surface.origin);
                }
            }
            for (light, shaft) in shafts.iter_mut().enumerate() {
                shaft.clear();
                let hull = self.direct.hull(LightId::from(light));
                // A block that faces away from the light needs no proof.
                let ends = [brush.points.first(), brush.points.last()];
                let faces = std::iter::zip(ends, above)
                    .filter_map(|(p, normal)| Some((*p?, normal)))
                    .any(|(p, normal)| hull.iter().any(|&q| normal.dot(q - p) > 0.0));
                if !faces || brush.points.len() < 2 {
                    continue;
                }
                if self.settings.wasteful.boxes {
                    self.tracer.everything(shaft);
                } else if !self.settings.wasteful.tiles {
                    self.tracer.shaft(&brush.points, hull, shaft);
                    statistics.blocks.count(shaft.sight());
                }
            }
        }
    }

    /// Adds up all that is seen through one pixel in `brush.pixel`. `place` is its number in the strip, `block` that of its block.
    fn pixel(
        &self,
        x: u32,
        y: u32,
        place: usize,
        block: usize,
        brush: &mut Brush,
        statistics: &mut Statistics,
    ) {
        let weight = 1.0 / f64::from(self.settings.spp);
        let index = u64::from(y) * u64::from(self.viewport.width) + u64::from(x);
        let groups = std::mem::take(&mut brush.groups);
        let mut missed = self.settings.spp;
        for group in &groups[brush.starts[place] as usize..brush.starts[place + 1] as usize] {
            missed -= group.points;
            let at = Pixel {
                x,
                y,
                index,
                subsample: group.subsample,
            };
            let weight = weight * f64::from(group.points);
            self.geometry_layers(Some(&group.surface), weight, &mut brush.pixel);
            self.surface(&group.surface, at, block, weight, brush, statistics);
        }
        brush.groups = groups;
        if missed > 0 {
            self.geometry_layers(None, weight * f64::from(missed), &mut brush.pixel);
        }
    }

    /// Light on a point, added to the picture and to the layers that concern light.
    fn surface(
        &self,
        surface: &SurfacePoint,
        at: Pixel,
        block: usize,
        weight: f64,
        brush: &mut Brush,
        statistics: &mut Statistics,
    ) {
        let mut radiance = surface.emission.as_dvec3();
        let mut sum = LightAnswer::default();
        let Brush {
            scratch,
            states,
            shafts,
            pixel,
            ..
        } = brush;
        let lights = self.scene.lights.len();
        let material = &self.scene.materials[surface.material.index()];
        let reflection = MetalRough {
            base_color: surface.albedo.as_dvec3(),
            metallic: f64::from(material.metallic),
            roughness: f64::from(material.roughness),
        };
        for (index, light) in self.scene.lights.iter().enumerate() {
            let id = LightId::from(index);
            let random = Random::new(self.settings.seed, at.index, at.subsample, index as u32);
            let mut work = Work {
                at,
                split: self.split,
                shaft: shafts
                    .get(block * lights + index)
                    .filter(|shaft| shaft.sight() != Sight::Unknown),
                random,
                blockers: None,
                scratch: &mut *scratch,
                statistics: &mut *statistics,
            };
            let answer = self.direct.shade(surface, id, &mut states[index], &mut work);
            radiance += light.color().as_dvec3()
                * if self.settings.glossy {
                    reflection.radiance(&answer.lobes)
                } else {
                    reflection.base_color * (answer.irradiance / PI)
                };
            sum.add(&answer);
            let mut channel = 3;
            for &layer in &self.settings.layers {
                if layer == Layer::IrradianceOf(id) {
                    pixel[channel] += weight * answer.irradiance;
                }
                channel += layer.channel_count();
            }
        }
        for (i, value) in radiance.to_array().into_iter().enumerate() {
            brush.pixel[i] += weight * value;
        }
        let mut channel = 3;
        for &layer in &self.settings.layers {
            let value = match layer {
                Layer::Irradiance => Some(sum.irradiance),
                Layer::Discontinuities => Some(f64::from(sum.discontinuities)),
                Layer::Tests => Some(f64::from(sum.tests)),
                Layer::Certificate => Some(f64::from(sum.certificate.level())),
                _ => None,
            };
            if let Some(value) = value {
                brush.pixel[channel] += weight * value;
            }
            channel += layer.channel_count();
        }
    }

    /// Layers that do not depend on light.
    fn geometry_layers(&self, surface: Option<&SurfacePoint>, weight: f64, pixel: &mut [f64]) {
        let mut channel = 3;
        for &layer in &self.settings.layers {
            match (layer, surface) {
                (Layer::Albedo, Some(s)) => {
                    for (i, value) in s.albedo.to_array().into_iter().enumerate() {
                        pixel[channel + i] += weight * f64::from(value);
                    }
                }
                (Layer::Normal, Some(s)) => {
                    for (i, value) in s.shading_normal.to_array().into_iter().enumerate() {
                        pixel[channel + i] += weight * value;
                    }
                }
                (Layer::Depth, surface) => {
                    pixel[channel] += weight * surface.map_or(f64::INFINITY, |s| s.distance);
                }
                _ => {}
            }
            channel += layer.channel_count();
        }
    }
}

/// Where subsample `index` of `count` lies in its pixel: the centre if it is alone, else one random point in
/// each of `count` cells of equal area, in rows.
fn subpixel(count: u32, index: u32, pixel_seed: u64) -> (f64, f64) {
    if count == 1 {
        return (0.5, 0.5);
    }
    let columns = f64::from(count).sqrt().ceil() as u32;
    let (row, in_row) = (index / columns, index % columns);
    // The last row may hold fewer cells; rows are as high as their cells are many, so that areas are equal.
    let cells = columns.min(count - row * columns);
    let bits = mix(pixel_seed ^ u64::from(index + 1));
    let unit = |bits: u64| (bits >> 40) as f64 / (1u64 << 24) as f64;
    let dx = (f64::from(in_row) + unit(bits)) / f64::from(cells);
    let dy = (f64::from(row * columns) + unit(bits << 24) * f64::from(cells)) / f64::from(count);
    (dx, dy)
}

#[cfg(test)]
mod tests {
    use super::subpixel;

    #[test]
    fn subsamples_stay_in_the_pixel_and_average_to_its_centre() {
        assert_eq!(subpixel(1, 0, 7), (0.5, 0.5), "one ray goes through the centre");
        for count in [2, 3, 5, 16, 17, 64] {
            let (mut sx, mut sy) = (0.0, 0.0);
            let pixels = 400;
            for pixel in 0..pixels {
                for index in 0..count {
                    let (x, y) = subpixel(count, index, super::mix(pixel));
                    assert!(
                        (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y),
                        "({x}, {y}) of {count}"
                    );
                    sx += x;
                    sy += y;
                }
            }
            let n = f64::from(count) * pixels as f64;
            assert!((sx / n - 0.5).abs() < 0.02, "{count}: mean x {}", sx / n);
            assert!((sy / n - 0.5).abs() < 0.02, "{count}: mean y {}", sy / n);
        }
    }
}
