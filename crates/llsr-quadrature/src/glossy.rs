//! Radiance reflected by a glossy receiver from visible panels of a linear light.
//!
//! # Method
//! In the angle `alpha` of the receiver's view of the light (see the crate's closed forms) the falloff with
//! distance is gone, and the integrand is a smooth wave times the lobe. With `g` the slope of the half vector
//! against the normal, GGX is `1 / (a^2 + |g|^2)^2` up to smooth factors, and along the light `g(alpha)` is
//! nearly straight and uniform around the point where `|g|` is least. So, near that point `p`,
//!
//! ```text
//! a^2 + |g|^2 = |g'|^2 (w^2 + (alpha - p)^2),    w^2 = (a^2 + |g(p)|^2) / |g'|^2
//! ```
//!
//! and with `alpha = p + w tan(eta)` a lobe of any sharpness is a `cos^2(eta)`. In `eta` each panel is split at
//! the peak, then bisected where the Kronrod rule of 7 points differs most from the Gauss rule of 3 inside it,
//! until the sum of differences is within the tolerance. The difference is the error of the 3-point rule, so
//! results are usually far better than asked.
//!
//! Schlick's term is linear in the colour at normal incidence: one integration gives the scalar
//! [`Lobes`], whatever the number of channels. The Lambertian lobe takes the closed form of the irradiance
//! less a smooth Fresnel share.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::DVec3;
use llsr_visibility::Partition;

use crate::light::{LineLight, Receiver};
use crate::line::{Arc, LineIrradiance};
use crate::material::Lobes;

/// Below this roughness a lobe is counted as this rough: on a mirror a light without thickness has no
/// finite reflection.
const LEAST_ROUGHNESS: f64 = 0.01;
/// A viewer lower than this over the surface (as a cosine) counts as this high.
const LEAST_COSINE: f64 = 1e-4;
/// A peak wider than this many radians is no peak.
const WIDEST: f64 = 4.0;
/// The lobe has settled this many widths of its fall at the horizon above it.
const DUSK: f64 = 6.0;
/// Pieces of a panel that can be pending at once: with seven evaluations each, more than any bound allows.
const PIECES: usize = 64;

/// How exact a glossy integral is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlossyOptions {
    /// Estimated error of the specular part, relative to it. The default is 1e-3. (The diffuse part is good to
    /// 2e-5 in any case.)
    ///
    /// Measured by the example `glossy_cost`: at 1e-3 none of 80,000 random cases was off by more than this, at
    /// 1e-2 one in 10,000, by up to 2.4 times, with viewers a degree above the surface.
    pub tolerance: f64,
    /// Bound on the evaluations of the lobe for one panel, at least 28 and at most 448. The default is 210.
    pub max_evaluations: u32,
}

impl Default for GlossyOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            max_evaluations: 210,
        }
    }
}

/// What one glossy integral gave and cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Glossy {
    /// The integrals.
    pub lobes: Lobes,
    /// Estimated error of `lobes.f0 + lobes.grazing`, absolute.
    pub error: f64,
    /// Evaluations of the specular lobe.
    pub evaluations: u32,
}

/// The light that one receiver reflects towards one viewer from stretches of one line light.
///
/// ```
/// use glam::DVec3;
/// use llsr_quadrature::{Emission, GlossyOptions, LineGlossy, LineLight, MetalRough, Receiver};
///
/// let light = LineLight {
///     a: DVec3::new(-0.6, 2.0, 1.0),
///     b: DVec3::new(0.6, 2.0, 1.0),
///     emission: Emission::Diffuse,
///     flux: 3000.0,
/// };
/// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
/// let to_viewer = DVec3::new(0.0, 2.0, -1.0).normalize();
/// let brass = MetalRough { base_color: DVec3::new(0.9, 0.7, 0.3), metallic: 1.0, roughness: 0.2 };
///
/// let line = LineGlossy::new(&receiver, &light, to_viewer, brass.roughness);
/// let all = line.panel(0.0, 1.0, &GlossyOptions::default());
/// let radiance = brass.radiance(&all.lobes);
/// assert!(radiance.x > radiance.y && radiance.y > radiance.z, "brass is yellow: {radiance}");
/// assert!(all.evaluations < 50);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LineGlossy {
    line: LineIrradiance,
    /// The directions at `alpha = 0` and 90 degrees, and the viewer's: parts along the normal and the rest.
    normal: Split<f64>,
    tangent: Split<DVec3>,
    /// Square of the width of the lobe.
    a2: f64,
    /// `sqrt(a2 + (1 - a2) cos^2)` for the viewer.
    smith_view: f64,
    /// Where the lobe peaks and how wide it is, as angles along the light.
    peak: f64,
    width: f64,
    /// Where the light's line is highest above the horizon, as an angle along it.
    zenith: f64,
    /// Farther than this from the zenith, shadowing near the horizon makes the lobe bend.
    dusk: f64,
}

#[derive(Clone, Copy, Debug)]
struct Split<T> {
    across: T,
    along: T,
    view: T,
}

impl LineGlossy {
    /// Prepares a receiver, a light and the unit direction `to_viewer` for a surface of this roughness.
    ///
    /// A roughness below 0.01 counts as 0.01, and a viewer at or below the surface as just above it. A
    /// viewer that is not finite sees nothing.
    pub fn new(receiver: &Receiver, light: &LineLight, to_viewer: DVec3, roughness: f64) -> Self {
        let mut line = LineIrradiance::new(receiver, light);
        if !to_viewer.is_finite() || !roughness.is_finite() {
            line = LineIrradiance::dark();
        }
        let n = receiver.normal;
        let (across, along) = line.frame(receiver, light);
        let tangential = |v: DVec3| v - v.dot(n) * n;
        let normal = Split {
            across: n.dot(across),
            along: n.dot(along),
            view: n.dot(to_viewer).clamp(LEAST_COSINE, 1.0),
        };
        let tangent = Split {
            across: tangential(across),
            along: tangential(along),
            view: tangential(to_viewer),
        };
        let a = roughness.clamp(LEAST_ROUGHNESS, 1.0).powi(2);
        let a2 = a * a;
        let smith_view = (a2 + (1.0 - a2) * normal.view * normal.view).sqrt();
        let mut glossy = Self {
            line,
            normal,
            tangent,
            a2,
            smith_view,
            peak: 0.0,
            width: 1.0,
            zenith: 0.0,
            dusk: 0.0,
        };
        glossy.find_peak();
        glossy
    }

    /// Finds where along the light's whole line, above the horizon, the slope of the half vector is least.
    fn find_peak(&mut self) {
        let (t, n) = (&self.tangent, &self.normal);
        // The line is above the horizon within a quarter turn of this angle.
        let zenith = n.along.atan2(n.across);
        let above = |angle: f64| {
            let from_zenith = (angle - zenith + 3.0 * PI).rem_euclid(TAU) - PI;
            zenith + from_zenith.clamp(-FRAC_PI_2, FRAC_PI_2)
        };
        // Nearest to the mirrored viewer, whose tangential part is turned round; then Gauss-Newton steps, which
        // also see how the lobe stretches towards the horizon. They converge at once where the lobe is sharp.
        let along = n.along * n.view - t.along.dot(t.view);
        let across = n.across * n.view - t.across.dot(t.view);
        let mut peak = above(along.atan2(across));
        for _ in 0..4 {
            let (slope, change) = self.slope(peak);
            let step = -slope.dot(change) / change.length_squared();
            if !step.is_finite() {
                break;
            }
            peak = above(peak + step.clamp(-0.25, 0.25));
            // A tenth of the peak's width is near enough.
            let width2 = (self.a2 + slope.length_squared()) / change.length_squared();
            if step * step < 0.01 * width2 {
                break;
            }
        }
        // Below this cosine the Smith term falls to zero: `c / (c smith_view + n.v smith_light)`.
        let low = DUSK * (self.a2.sqrt() * n.view / self.smith_view);
        self.zenith = zenith;
        self.dusk = (low / n.across.hypot(n.along)).min(1.0).acos();
        let (slope, change) = self.slope(peak);
        let width = ((self.a2 + slope.length_squared()) / change.length_squared()).sqrt();
        (self.peak, self.width) = if width.is_finite() {
            (peak, width.clamp(1e-9, WIDEST))
        } else {
            (zenith, WIDEST)
        };
    }

    /// The slope of the half vector against the normal for the direction at `alpha`, and its derivative.
    fn slope(&self, alpha: f64) -> (DVec3, DVec3) {
        let (sin, cos) = alpha.sin_cos();
        let (t, n) = (&self.tangent, &self.normal);
        let tangential = t.view + t.across * cos + t.along * sin;
        let height = n.view + n.across * cos + n.along * sin;
        let tangential_change = t.along * cos - t.across * sin;
        let height_change = n.along * cos - n.across * sin;
        let slope = tangential / height;
        (slope, (tangential_change - slope * height_change) / height)
    }

    /// The factors of the lobe for the direction at `alpha`: `D V cos(theta)` and Schlick's `(1 - cos)^5`.
    #[inline]
    fn lobe(&self, alpha: f64) -> (f64, f64) {
        let (sin, cos) = alpha.sin_cos();
        let (t, n) = (&self.tangent, &self.normal);
        let cosine = (n.across * cos + n.along * sin).max(0.0);
        // The half vector before it is normalised, in parts, so that no 1 - cos^2 cancels at the peak.
        let tangential2 = (t.view + t.across * cos + t.along * sin).length_squared();
        let height2 = (n.view + cosine).powi(2);
        let half2 = tangential2 + height2;
        let d = half2 / (self.a2 * height2 + tangential2);
        let smith_light = (self.a2 + (1.0 - self.a2) * cosine * cosine).sqrt();
        let v = 0.5 / (cosine * self.smith_view + n.view * smith_light);
        let ggx = self.a2 * d * d * FRAC_1_PI;
        let mut weight = ggx * v * cosine;
        if self.line.is_diffuse() {
            weight *= cos.max(0.0);
        }
        (weight, schlick(half2))
    }

    /// Schlick's share of the irradiance per angle: `(1 - cos)^5 cos(theta)`, with the emission law.
    #[inline]
    fn fresnel(&self, alpha: f64) -> f64 {
        let (sin, cos) = alpha.sin_cos();
        let (t, n) = (&self.tangent, &self.normal);
        let cosine = (n.across * cos + n.along * sin).max(0.0);
        let tangential2 = (t.view + t.across * cos + t.along * sin).length_squared();
        let emission = if self.line.is_diffuse() { cos.max(0.0) } else { 1.0 };
        schlick(tangential2 + (n.view + cosine).powi(2)) * cosine * emission
    }

    /// The lobes of the light between the parameters `t0` and `t1`, horizon clipped.
    ///
    /// Cost: 7 to 60 evaluations for most panels at the default tolerance, about 1 us; more for strict ones.
    pub fn panel(&self, t0: f64, t1: f64, options: &GlossyOptions) -> Glossy {
        self.panel_beside(t0, t1, 0.0, options)
    }

    /// The lobes of all panels of a partition. The tolerance holds for the whole, so that a faint panel beside
    /// a bright one costs little.
    pub fn partition(&self, partition: &Partition, options: &GlossyOptions) -> Glossy {
        let mut all = Glossy::default();
        for panel in partition.panels() {
            let one = self.panel_beside(panel.start, panel.end, all.lobes.f0 + all.lobes.grazing, options);
            all.lobes += one.lobes;
            all.error += one.error;
            all.evaluations += one.evaluations;
        }
        all
    }

    /// A panel, to the tolerance relative to itself and a specular part already at hand.
    fn panel_beside(&self, t0: f64, t1: f64, beside: f64, options: &GlossyOptions) -> Glossy {
        let Some(arc) = self.line.arc(t0, t1) else {
            return Glossy::default();
        };
        let irradiance = self.line.panel(t0, t1);
        let specular = self.specular(arc.start, arc.angle, arc.scale, beside, options);
        Glossy {
            lobes: Lobes {
                diffuse: (irradiance - self.fresnel_share(&arc)).max(0.0),
                ..specular.lobes
            },
            ..specular
        }
    }

    /// Irradiance times Schlick's `(1 - cos)^5`: smooth, so a fixed rule on pieces of at most 90 degrees.
    fn fresnel_share(&self, arc: &Arc) -> f64 {
        let pieces = (arc.angle / FRAC_PI_2).ceil().max(1.0);
        let step = arc.angle / pieces;
        let mut sum = 0.0;
        for i in 0..pieces as u32 {
            let start = arc.start + f64::from(i) * step;
            sum += GAUSS_5
                .iter()
                .map(|(x, w)| w * self.fresnel(start + x * step))
                .sum::<f64>();
        }
        arc.scale * sum / pieces
    }

    fn specular(&self, start: f64, angle: f64, scale: f64, beside: f64, options: &GlossyOptions) -> Glossy {
        // Angles by the turn that is nearest to the panel.
        let near = |to: f64| to + TAU * ((start + 0.5 * angle - to) / TAU).round();
        let (peak, zenith) = (near(self.peak), near(self.zenith));
        let eta = |alpha: f64| ((alpha - peak) / self.width).atan();
        let (lo, hi) = (eta(start), eta(start + angle));
        let mut glossy = Glossy::default();
        if hi - lo < 1e-9 {
            // A panel that is a point to the lobe.
            let (weight, schlick) = self.lobe(start + 0.5 * angle);
            glossy.evaluations = 1;
            glossy.lobes = Lobes {
                f0: scale * weight * (1.0 - schlick),
                grazing: scale * weight * schlick,
                diffuse: 0.0,
            };
            return glossy;
        }
        // d alpha = w / cos^2(eta) d eta, and the mean over the panel takes 1 / angle.
        let scale = scale * self.width / angle;
        let integrand = |eta: f64| {
            let tan = eta.tan();
            let (weight, schlick) = self.lobe(peak + self.width * tan);
            let weight = scale * weight * (1.0 + tan * tan);
            (weight * (1.0 - schlick), weight * schlick)
        };
        let mut pieces = [Piece::default(); PIECES];
        let bound = options.max_evaluations.clamp(28, 7 * PIECES as u32);
        let mut cuts = [0.0, eta(zenith - self.dusk), eta(zenith + self.dusk), hi];
        cuts[..3].sort_by(f64::total_cmp);
        let (mut count, mut from) = (0, lo);
        for cut in cuts {
            if cut > from && cut <= hi {
                pieces[count] = Piece::new(from, cut, &integrand);
                (count, from) = (count + 1, cut);
            }
        }
        let mut evaluations = 7 * count as u32;
        loop {
            let live = &pieces[..count];
            let error = live.iter().map(|p| p.error).sum::<f64>();
            let f0 = live.iter().map(|p| p.value.0).sum::<f64>();
            let grazing = live.iter().map(|p| p.value.1).sum::<f64>();
            glossy.lobes = Lobes {
                f0,
                grazing,
                diffuse: 0.0,
            };
            (glossy.error, glossy.evaluations) = (error, evaluations);
            if error <= options.tolerance * (f0 + grazing + beside)
                || evaluations + 14 > bound
                || count == PIECES
            {
                return glossy;
            }
            let worst = (0..count)
                .max_by(|&i, &j| pieces[i].error.total_cmp(&pieces[j].error))
                .unwrap_or(0);
            let Piece { lo, hi, .. } = pieces[worst];
            let middle = 0.5 * (lo + hi);
            pieces[worst] = Piece::new(lo, middle, &integrand);
            pieces[count] = Piece::new(middle, hi, &integrand);
            count += 1;
            evaluations += 14;
        }
    }
}

/// `(1 - cos)^5` of the angle between viewer and half vector; `half2` is the squared length of the sum of the
/// two unit directions, four times the squared cosine.
#[inline]
fn schlick(half2: f64) -> f64 {
    let rest = (1.0 - 0.5 * half2.sqrt()).max(0.0);
    let rest2 = rest * rest;
    rest2 * rest2 * rest
}

/// Nodes and weights of the 5-point Gauss rule on [0, 1].
const GAUSS_5: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// A stretch of a panel with its estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    lo: f64,
    hi: f64,
    value: (f64, f64),
    error: f64,
}

/// The positive nodes of the 7-point Kronrod rule that extends the 3-point Gauss rule (the second is Gauss's),
/// and its weights; then the weights of the Gauss rule.
const KRONROD_NODES: [f64; 3] = [
    0.960_491_268_708_020_3,
    0.774_596_669_241_483_4,
    0.434_243_749_346_802_55,
];
const KRONROD_WEIGHTS: [f64; 4] = [
    0.104_656_226_026_467_27,
    0.268_488_089_868_333_44,
    0.401_397_414_775_962_2,
    0.450_916_538_658_474_15,
];
const GAUSS_WEIGHTS: [f64; 2] = [5.0 / 9.0, 8.0 / 9.0];

impl Piece {
    fn new(lo: f64, hi: f64, f: &impl Fn(f64) -> (f64, f64)) -> Self {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let centre = f(middle);
        let mut fine = (KRONROD_WEIGHTS[3] * centre.0, KRONROD_WEIGHTS[3] * centre.1);
        let mut coarse = (GAUSS_WEIGHTS[1] * centre.0, GAUSS_WEIGHTS[1] * centre.1);
        for (i, x) in KRONROD_NODES.into_iter().enumerate() {
            let (left, right) = (f(middle - half * x), f(middle + half * x));
            let pair = (left.0 + right.0, left.1 + right.1);
            fine.0 += KRONROD_WEIGHTS[i] * pair.0;
            fine.1 += KRONROD_WEIGHTS[i] * pair.1;
            if i == 1 {
                coarse.0 += GAUSS_WEIGHTS[0] * pair.0;
                coarse.1 += GAUSS_WEIGHTS[0] * pair.1;
            }
        }
        let value = (half * fine.0, half * fine.1);
        // Apart, so that errors of opposite sign do not hide each other.
        let error = half * ((fine.0 - coarse.0).abs() + (fine.1 - coarse.1).abs());
        Self { lo, hi, value, error }
    }
}
