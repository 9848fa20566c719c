//! A texture at several sizes, to be averaged over the footprint of a pixel.

use llsr_scene::{Texture, Wrap, srgb_to_linear};

/// Linear red, green and blue in units of 1/65535; the fourth is unused, so that a texel is one load.
pub(crate) type Texel = [u16; 4];
/// Pixels that are looked up together.
pub(crate) const BLOCK: usize = 16;
/// Most look-ups along the long side of a footprint.
const MOST_TAPS: f32 = 8.0;
/// A level's texels are this many times as wide as the short side of a footprint, or less, to a half: a look-up then spreads about as
/// far as the footprint, for a bilinear one of means of texels has the variance of a box sqrt(3) texels wide.
const BLUR: f32 = 0.816;
/// Texels of its level from one tap to the next, at most.
const TAP: f32 = 1.5;

/// A texture, halved until one texel is left.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    wrap: [Wrap; 2],
}

/// One size. A row and a column that repeat what comes after the last ones let four neighbours be loaded without a thought.
#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<Texel>,
}

/// The part of a texture's plane that a pixel shows, in texture coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Changes of u and v with one pixel to the right.
    pub(crate) right: [f32; 2],
    /// With one pixel down.
    pub(crate) down: [f32; 2],
}

/// Texture coordinates of a block of pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    pub(crate) u: [f32; BLOCK],
    pub(crate) v: [f32; BLOCK],
}

/// Red, green and blue of a block of pixels, linear, times 65535.
pub(crate) type Texels = [[f32; BLOCK]; 3];

/// How a footprint is looked up.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampling {
    level: usize,
    taps: u32,
    /// From one tap to the next.
    step: [f32; 2],
}

impl Pyramid {
    pub(crate) fn new(texture: &Texture) -> Self {
        let linear: [u16; 256] =
            std::array::from_fn(|i| (srgb_to_linear(i as f32 / 255.0) * 65535.0).round() as u16);
        let (width, height) = (texture.width.max(1) as usize, texture.height.max(1) as usize);
        let mut plain: Vec<Texel> = texture
            .pixels
            .iter()
            .map(|p| {
                let [r, g, b] = p.map(|c| linear[usize::from(c)]);
                [r, g, b, 0]
            })
            .collect();
        plain.resize(width * height, [0; 4]);
        let mut levels = vec![Level::new(width, height, &plain, texture.wrap)];
        let (mut width, mut height) = (width, height);
        while width > 1 || height > 1 {
            (plain, width, height) = halved(&plain, width, height);
            levels.push(Level::new(width, height, &plain, texture.wrap));
        }
        Self {
            levels,
            wrap: texture.wrap,
        }
    }

    /// What happens outside [0, 1] along u and v.
    pub(crate) fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// The level and the taps for a footprint: as many along its long side as keep the short one sharp.
    #[inline(always)]
    pub(crate) fn sampling(&self, footprint: Footprint) -> Sampling {
        let size = [self.levels[0].width as f32, self.levels[0].height as f32];
        let texels = |d: [f32; 2]| [d[0] * size[0], d[1] * size[1]];
        let length = |d: [f32; 2]| (d[0] * d[0] + d[1] * d[1]).sqrt();
        let (right, down) = (texels(footprint.right), texels(footprint.down));
        let (across, along) = (length(right), length(down));
        let (long, axis) = if across > along {
            (across, footprint.right)
        } else {
            (along, footprint.down)
        };
        let area = (right[0] * down[1] - right[1] * down[0]).abs();
        if !(long.is_finite() && area.is_finite()) {
            return Sampling {
                level: self.levels.len() - 1,
                taps: 1,
                step: [0.0; 2],
            };
        }
        let short = (area / long.max(1e-20)).max(long / MOST_TAPS).max(1.0);
        // The whole part of the binary logarithm, from 0 on.
        let level = ((short * BLUR).max(1.0).to_bits() >> 23) as usize - 127;
        let level = level.min(self.levels.len() - 1);
        let texel = (1u64 << level.min(40)) as f32;
        let taps = (long / (TAP * texel)).ceil().clamp(1.0, MOST_TAPS);
        Sampling {
            level,
            taps: taps as u32,
            step: [axis[0] / taps, axis[1] / taps],
        }
    }

    /// Looks up the first `count` of a block of places: the means over the taps around them.
    #[inline(always)]
    pub(crate) fn look_up<B: Between>(
        &self,
        places: &Places,
        count: usize,
        sampling: &Sampling,
        out: &mut Texels,
    ) {
        let level = &self.levels[sampling.level];
        let half = 0.5 * (sampling.taps - 1) as f32;
        let share = 1.0 / sampling.taps as f32;
        let mut places = *places;
        for i in 0..BLOCK {
            places.u[i] -= half * sampling.step[0];
            places.v[i] -= half * sampling.step[1];
        }
        let mut sums = [[0.0; 4]; BLOCK];
        for _ in 0..sampling.taps {
            level.add::<B>(&places, self.wrap, share, &mut sums[..count]);
            for i in 0..BLOCK {
                places.u[i] += sampling.step[0];
                places.v[i] += sampling.step[1];
            }
        }
        for (channel, out) in out.iter_mut().enumerate() {
            for i in 0..BLOCK {
                out[i] = sums[i][channel];
            }
        }
    }
}

impl Level {
    fn new(width: usize, height: usize, plain: &[Texel], wrap: [Wrap; 2]) -> Self {
        let mut texels = Vec::with_capacity((width + 1) * (height + 1));
        for y in 0..=height {
            let after = |i: usize, size: usize, wrap: Wrap| match wrap {
                Wrap::Repeat => i % size,
                Wrap::Mirror | Wrap::Clamp => i.min(size - 1),
            };
            let row = &plain[after(y, height, wrap[1]) * width..][..width];
            texels.extend_from_slice(row);
            texels.push(row[after(width, width, wrap[0])]);
        }
        Self {
            width,
            height,
            texels,
        }
    }

    /// Adds what lies at the places, bilinear, times `share`.
    #[inline(always)]
    fn add<B: Between>(&self, places: &Places, wrap: [Wrap; 2], share: f32, out: &mut [[f32; 4]]) {
        let across = wrapped(&places.u, self.width, wrap[0]);
        let down = wrapped(&places.v, self.height, wrap[1]);
        let pitch = self.width + 1;
        for (i, out) in out.iter_mut().enumerate() {
            let start = down.first[i] as usize * pitch + across.first[i] as usize;
            let four = &self.texels[start..start + pitch + 2];
            let (Some(upper), Some(lower)) = (four.first_chunk(), four.last_chunk()) else {
                unreachable!("two rows lie there");
            };
            B::add(upper, lower, across.rest[i], down.rest[i], share, out);
        }
    }
}

/// Four texels: the parts that SIMD modules replace.
pub(crate) trait Between {
    /// Adds to `sums` what lies between two texels above, in `upper`, and two below, at `x` and `y` in [0, 1], times `share`.
    fn add(upper: &[Texel; 2], lower: &[Texel; 2], x: f32, y: f32, share: f32, sums: &mut [f32; 4]);
}

/// The form that runs anywhere.
#[derive(Debug)]
pub(crate) struct Portable;

impl Between for Portable {
    #[inline(always)]
    fn add(upper: &[Texel; 2], lower: &[Texel; 2], x: f32, y: f32, share: f32, sums: &mut [f32; 4]) {
        for (channel, sum) in sums.iter_mut().enumerate() {
            let side = |i: usize| {
                let (above, below) = (f32::from(upper[i][channel]), f32::from(lower[i][channel]));
                above + (below - above) * y
            };
            let (left, right) = (side(0), side(1));
            *sum += (left + (right - left) * x) * share;
        }
    }
}

/// Texels before some coordinates, in 0..size, and how far these are from their centres to those of the next.
struct Along {
    first: [u32; BLOCK],
    rest: [f32; BLOCK],
}

#[inline(always)]
fn wrapped(coordinates: &[f32; BLOCK], size: usize, wrap: Wrap) -> Along {
    let n = size as f32;
    let mut x = [0.0; BLOCK];
    // One loop each, for the compiler to do many at once.
    match wrap {
        Wrap::Repeat => {
            for i in 0..BLOCK {
                let place = (coordinates[i] - coordinates[i].floor()) * n - 0.5;
                x[i] = if place < 0.0 { place + n } else { place };
            }
        }
        Wrap::Mirror => {
            for i in 0..BLOCK {
                let t = coordinates[i] - 2.0 * (0.5 * coordinates[i]).floor();
                x[i] = t.min(2.0 - t) * n - 0.5;
            }
        }
        Wrap::Clamp => {
            for i in 0..BLOCK {
                x[i] = coordinates[i] * n - 0.5;
            }
        }
    }
    let mut along = Along {
        first: [0; BLOCK],
        rest: [0.0; BLOCK],
    };
    // What lies on the last texel goes on to what comes after it; without repeats nothing does.
    let last = n - 1.0;
    let end = if wrap == Wrap::Repeat { n } else { last };
    for (i, x) in x.into_iter().enumerate() {
        // NaN becomes 0.
        let place = x.max(0.0).min(end);
        let first = place.floor().min(last);
        // A whole number below 2^23 shows in the low bits then, which is cheaper than a conversion.
        along.first[i] = (first + 8_388_608.0).to_bits() & 0x7f_ffff;
        along.rest[i] = place - first;
    }
    along
}

/// Means of two by two texels; a last odd row or column counts twice.
fn halved(texels: &[Texel], width: usize, height: usize) -> (Vec<Texel>, usize, usize) {
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let mut half = Vec::with_capacity(half_width * half_height);
    for y in 0..half_height {
        let rows = [2 * y, (2 * y + 1).min(height - 1)].map(|y| &texels[y * width..][..width]);
        for x in 0..half_width {
            let columns = [2 * x, (2 * x + 1).min(width - 1)];
            let mean = |i: usize| {
                let sum: u32 = rows
                    .iter()
                    .flat_map(|row| columns.map(|x| u32::from(row[x][i])))
                    .sum();
                ((sum + 2) / 4) as u16
            };
            half.push([mean(0), mean(1), mean(2), 0]);
        }
    }
    (half, half_width, half_height)
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    fn texture(width: u32, height: u32, wrap: [Wrap; 2]) -> Texture {
        let pixel = |i: u32| [i, 7 * i + 3, 31 * i].map(|i| (i.wrapping_mul(0x9e37_79b9) >> 24) as u8);
        Texture {
            name: String::new(),
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
            wrap,
        }
    }

    /// One place with a footprint.
    fn look_up(pyramid: &Pyramid, uv: Vec2, footprint: Footprint) -> Vec3 {
        let places = Places {
            u: [uv.x; BLOCK],
            v: [uv.y; BLOCK],
        };
        let mut found = [[0.0; BLOCK]; 3];
        pyramid.look_up::<Portable>(&places, BLOCK, &pyramid.sampling(footprint), &mut found);
        Vec3::from(found.map(|channel| channel[BLOCK - 1])) / 65535.0
    }

    /// The scene's own sampler is the oracle.
    #[test]
    fn tiny_footprints_are_bilinear_look_ups() {
        let tiny = Footprint {
            right: [1e-5, 0.0],
            down: [0.0, 1e-5],
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for (width, height) in [(1, 1), (5, 3), (16, 16), (2, 40)] {
                let texture = texture(width, height, [wrap, Wrap::Repeat]);
                let pyramid = Pyramid::new(&texture);
                for i in 0..2000 {
                    let uv = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.754_877_7).fract());
                    let uv = (uv - 0.5) * 7.0;
                    let (found, expected) = (look_up(&pyramid, uv, tiny), texture.sample(uv));
                    assert!(
                        (found - expected).abs().max_element() < 2e-4,
                        "{wrap:?} {width}x{height} {uv}: {found} for {expected}"
                    );
                }
            }
        }
    }

    /// Means of a dense sum of the scene's sampler over the footprint.
    #[test]
    fn footprints_are_averaged() {
        let mut texture = texture(64, 64, [Wrap::Repeat; 2]);
        // Blots of eight texels by eight, for noise has no means but that of all.
        let noise = texture.pixels.clone();
        for (i, pixel) in texture.pixels.iter_mut().enumerate() {
            *pixel = noise[i / 512 * 8 + i % 64 / 8];
        }
        let pyramid = Pyramid::new(&texture);
        // In texels: square ones, long ones, one over everything.
        let footprints = [
            ([6.0, 0.0], [0.0, 6.0]),
            ([16.0, 3.0], [-3.0, 16.0]),
            ([24.0, 5.0], [-1.0, 4.0]),
            ([2.0, 0.0], [3.0, 30.0]),
            ([640.0, 0.0], [0.0, 640.0]),
        ];
        for (right, down) in footprints {
            let (right, down) = (Vec2::from(right) / 64.0, Vec2::from(down) / 64.0);
            let footprint = Footprint {
                right: right.into(),
                down: down.into(),
            };
            let (mut error, mut blurred, mut sharp) = (0.0, 0.0, 0.0);
            for i in 0..40 {
                let uv = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.754_877_7).fract());
                let n = 64;
                let mut mean = Vec3::ZERO;
                for k in 0..n * n {
                    let at = Vec2::new((k % n) as f32 + 0.5, (k / n) as f32 + 0.5) / n as f32 - 0.5;
                    mean += texture.sample(uv + right * at.x + down * at.y);
                }
                mean /= (n * n) as f32;
                error += (look_up(&pyramid, uv, footprint) - mean).length_squared();
                sharp += (texture.sample(uv) - mean).length_squared();
                blurred += (pyramid.mean() - mean).length_squared();
            }
            println!("{right} {down}: {error} of {sharp} for one sample, {blurred} for the mean");
            assert!(error < 0.15 * sharp, "{right} {down}: {error} of {sharp}");
            assert!(
                error < 0.8 * blurred + 1e-6,
                "{right} {down}: {error} of {blurred} for the mean of all"
            );
        }
    }

    impl Pyramid {
        fn mean(&self) -> Vec3 {
            let [r, g, b, _] = self.levels.last().expect("a level").texels[0];
            Vec3::new(r.into(), g.into(), b.into()) / 65535.0
        }
    }

    #[test]
    fn wild_footprints_and_places_are_harmless() {
        let pyramid = Pyramid::new(&texture(9, 4, [Wrap::Mirror, Wrap::Clamp]));
        for wild in [f32::NAN, f32::INFINITY, 1e30, -1e30, 0.0] {
            for place in [f32::NAN, f32::NEG_INFINITY, 1e30, 0.5] {
                let footprint = Footprint {
                    right: [wild, 0.0],
                    down: [0.1, wild],
                };
                let found = look_up(&pyramid, Vec2::new(place, 0.3), footprint);
                assert!(
                    found.min_element() >= 0.0 && found.max_element() <= 1.0,
                    "{wild} at {place}: {found}"
                );
            }
        }
    }
}
