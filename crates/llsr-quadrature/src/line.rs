//! Closed-form irradiance of a visible stretch of a linear light.
//!
//! # Derivation
//! Let `h` be the distance from the receiver to the light's line, `s` the coordinate along the line measured
//! from the foot of the perpendicular, `x(s) = w + s d` the vector from the receiver to the light (`w` the
//! perpendicular, `|w| = h`, `d` the unit direction), `r = |x|` and `n` the receiver's normal. Then
//! `cos(theta) = n.x / r`, the sine of the angle to the axis is `h / r`, and with `s = h tan(alpha)`:
//!
//! ```text
//! isotropic  E = Phi / (4 pi L)  int n.x / r^3 ds    = Phi / (4 pi L h)  int c(alpha) d alpha
//! diffuse    E = Phi / (pi^2 L)  int h n.x / r^4 ds  = Phi / (pi^2 L h)  int c(alpha) cos(alpha) d alpha
//! ```
//!
//! with `c(alpha) = n.x / r`, a cosine wave in `alpha`. Antiderivatives follow at once, but their difference
//! over a short panel, or over any panel seen from near its own line (`h -> 0`), cancels. Both are therefore
//! written with the two ends of the panel (1 and 2, `l = s2 - s1`, `D = alpha2 - alpha1`), using
//! `sin D = h l / (r1 r2)` and `cos D = x1.x2 / (r1 r2)`:
//!
//! ```text
//! int n.x / r^3 ds    = l (n.x1 / r1 + n.x2 / r2) / (r1 r2 + x1.x2)
//! int h n.x / r^4 ds  = h l (n.x1 + n.x2) / (2 r1^2 r2^2) + n.w (D - sin D cos D) / (2 h^2)
//! ```
//!
//! The first says that the field of a uniform line is that of an arc of radius `h` about the receiver, along
//! the bisector of the two end directions; the second follows from the product formula of cosines. After the
//! horizon is clipped, `n.x1` and `n.x2` are not negative. What can still cancel:
//!
//! - `r1 r2 + x1.x2` for a light that passes close overhead: there it equals `h^2 l^2 / (r1 r2 - x1.x2)`;
//! - `D - sin D cos D` for a narrow panel: there it is `sin^3 D` times a power series in `sin^2 D`, so that
//!   `h^3` cancels against `h^2` on paper and nothing is left to divide by;
//! - the sum of the two diffuse terms if `n.w < 0` (the foot of the perpendicular below the horizon): the
//!   first is then at least 3/2 of the second, so at most a factor of five of precision is lost.
//!
//! # Error
//! Relative to the irradiance of exactly the receiver and light given, with `e` = 2^-53, `R` the distance to the
//! nearer end of the light, `m` the larger distance to an end of the panel, `n.x` the larger height of those
//! over the receiver's plane, and `q` the distance to the nearest point of the panel, it is at most
//!
//! ```text
//! diffuse    100 e (1 + R / h + m / n.x) + 8 e (1 / (t1 - t0) + L / q)
//! isotropic   50 e (1         + m / n.x) + 8 e (1 / (t1 - t0) + L / q)
//! ```
//!
//! `R / h` is the error of `h` itself, seen nearly end-on; `m / n.x` that of a light low over the horizon; the
//! rest is the rounding of `t`. Where coordinates subtract without rounding it is below 1e-13 + 1e-15 L / q.
//!
//! Source: the two emission laws integrated here; the isotropic field is the textbook field of a charged line.

use glam::DVec3;
use llsr_visibility::Partition;

use crate::light::{Emission, LineLight, Receiver, clip_heights};

/// Directions are meaningless closer to the light than this fraction of its length...
const NEAREST_FRACTION: f64 = 1e-9;
/// ... or than this distance in metres.
const NEAREST: f64 = 1e-12;
/// Beyond this many metres fourth powers of distances overflow.
const FARTHEST: f64 = 1e70;

/// A line light, prepared for many receivers: see [`LineIrradiance::along`].
#[derive(Clone, Copy, Debug)]
pub struct LineAxis {
    a: DVec3,
    b: DVec3,
    /// Unit, from a to b; meaningless without a length.
    direction: DVec3,
    length: f64,
    /// Directions are meaningless closer to the light than this.
    nearest: f64,
    /// Flux divided by the constant of the emission law.
    scale: f64,
    diffuse: bool,
}

impl LineAxis {
    /// Prepares a light.
    pub fn new(light: &LineLight) -> Self {
        use std::f64::consts::PI;

        let axis = light.b - light.a;
        let length = axis.length();
        let diffuse = length != 0.0 && light.emission == Emission::Diffuse;
        Self {
            a: light.a,
            b: light.b,
            direction: axis / length,
            length,
            nearest: NEAREST + NEAREST_FRACTION * length,
            scale: light.flux / if diffuse { PI * PI } else { 4.0 * PI },
            diffuse,
        }
    }
}

/// The irradiance at one receiver from stretches of one line light, prepared once per pair.
///
/// Build it once for a receiver and a light, then ask for as many panels as visibility leaves:
///
/// ```
/// use glam::DVec3;
/// use llsr_quadrature::{Emission, LineIrradiance, LineLight, Receiver};
///
/// let light = LineLight {
///     a: DVec3::new(-0.6, 2.5, 0.0),
///     b: DVec3::new(0.6, 2.5, 0.0),
///     emission: Emission::Diffuse,
///     flux: 3000.0,
/// };
/// let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
/// let line = LineIrradiance::new(&receiver, &light);
/// let all = line.panel(0.0, 1.0);
/// assert!((all - 46.86).abs() < 0.01, "3000 lm at 2.5 m give about 47 lux: {all}");
/// assert!((line.panel(0.0, 0.3) + line.panel(0.3, 1.0) - all).abs() < 1e-12 * all);
/// ```
///
/// # Special cases
/// - A light (or part of one) below the receiver's horizon, in its plane, or with coordinates or a flux that
///   are not finite (or beyond 1e70 m) contributes nothing.
/// - Seen exactly end-on, a diffuse light contributes nothing and an isotropic one what its points do.
/// - A zero-length light is a point light of intensity `flux / (4 pi)`.
/// - The irradiance has no bound on the light itself. Within 1e-12 m plus 1e-9 of its length, the receiver
///   counts as being at that distance, so that results are finite everywhere.
#[derive(Clone, Copy, Debug)]
pub struct LineIrradiance {
    /// The light parameters between which the light is above the horizon.
    lit: (f64, f64),
    /// Position of the two ends along the line, measured from the foot of the perpendicular, in metres.
    along: (f64, f64),
    /// Height of the two ends over the receiver's plane, in metres.
    height: (f64, f64),
    length: f64,
    /// Distance to the line.
    distance: f64,
    /// `n.w`: height of the foot of the perpendicular over the receiver's plane.
    foot_height: f64,
    /// Flux divided by the constant of the emission law.
    scale: f64,
    diffuse: bool,
}

impl LineIrradiance {
    /// Projects the receiver on the light's line. Cost: about that of one panel.
    pub fn new(receiver: &Receiver, light: &LineLight) -> Self {
        Self::along(receiver, &LineAxis::new(light))
    }

    /// The same for a light that was prepared, which saves a third.
    pub fn along(receiver: &Receiver, axis: &LineAxis) -> Self {
        let to_a = axis.a - receiver.position;
        let to_b = axis.b - receiver.position;
        let extent = to_a.abs().max_element().max(to_b.abs().max_element());
        // Written so that a NaN anywhere is out of range.
        let in_range = to_a.is_finite() && to_b.is_finite() && extent < FARTHEST;
        let usable = in_range && receiver.normal.is_finite() && axis.scale.is_finite();
        if !usable {
            return Self::dark();
        }
        let LineAxis { length, nearest, .. } = *axis;
        let height = (receiver.normal.dot(to_a), receiver.normal.dot(to_b));
        let lit = clip_heights(height.0, height.1);
        if length == 0.0 {
            // The perpendicular to an axis that does not exist: the whole vector.
            return Self {
                lit,
                along: (0.0, 0.0),
                height,
                length: 0.0,
                distance: to_a.length().max(nearest),
                foot_height: height.0,
                scale: axis.scale,
                diffuse: false,
            };
        }
        let direction = axis.direction;
        let along = (to_a.dot(direction), to_b.dot(direction));
        // From the nearer end, since the rounding of the perpendicular grows with the vector it is taken from.
        let (near, near_along) = if along.0.abs() < along.1.abs() {
            (to_a, along.0)
        } else {
            (to_b, along.1)
        };
        let perpendicular = near - near_along * direction;
        let distance = perpendicular.length();
        let beside = if along.0 < 0.0 && along.1 > 0.0 {
            0.0
        } else {
            near_along
        };
        let on_light = distance.max(beside.abs()) < nearest;
        Self {
            lit,
            along,
            height,
            length,
            distance: if on_light { nearest } else { distance },
            foot_height: receiver.normal.dot(perpendicular),
            scale: axis.scale,
            diffuse: axis.diffuse,
        }
    }

    /// A pair that contributes nothing.
    pub(crate) fn dark() -> Self {
        Self {
            lit: (0.0, 0.0),
            along: (0.0, 0.0),
            height: (0.0, 0.0),
            length: 0.0,
            distance: 1.0,
            foot_height: 0.0,
            scale: 0.0,
            diffuse: false,
        }
    }

    /// The light parameters between which the light is above the receiver's horizon, or `None`.
    pub fn lit_range(&self) -> Option<(f64, f64)> {
        (self.lit.0 < self.lit.1).then_some(self.lit)
    }

    /// Irradiance from the light between the parameters `t0` and `t1`, in lux or W/m2.
    ///
    /// The part outside [0, 1] or below the horizon contributes nothing; neither does a panel with a NaN or
    /// reversed end. Never negative (for a flux that is not) and always finite. Cost: about 20 ns.
    #[inline]
    pub fn panel(&self, t0: f64, t1: f64) -> f64 {
        let (t0, t1) = (if t0 > self.lit.0 { t0 } else { self.lit.0 }, t1.min(self.lit.1));
        let width = t1 - t0;
        if width.is_nan() || width <= 0.0 {
            return 0.0;
        }
        let (s1, s2) = (self.along_at(t0), self.along_at(t1));
        let (n1, n2) = (self.height_at(t0), self.height_at(t1));
        let h2 = self.distance * self.distance;
        let rr1 = h2 + s1 * s1;
        let rr2 = h2 + s2 * s2;
        let rr = rr1 * rr2;
        // |x1| |x2| cos D
        let dot = h2 + s1 * s2;
        if self.diffuse {
            let l = width * self.length;
            let ends = 0.5 * width * self.distance * (n1 + n2) / rr;
            let arc = self.foot_height * self.arc_term(width, l, dot, rr);
            (self.scale * (ends + arc)).max(0.0)
        } else {
            let r = rr.sqrt();
            let cosines = n1 / rr1.sqrt() + n2 / rr2.sqrt();
            if dot >= 0.0 {
                self.scale * width * cosines / (r + dot)
            } else {
                let l = width * self.length;
                self.scale * width * cosines * (r - dot) / (h2 * l * l)
            }
        }
    }

    /// `(D - sin D cos D) / (2 h^2 L)` with `D` the angle that the panel of length `l` subtends.
    #[inline]
    fn arc_term(&self, width: f64, l: f64, dot: f64, rr: f64) -> f64 {
        let h = self.distance;
        let hl = h * l;
        let sin2 = hl * hl / rr;
        if dot > 0.0 && sin2 < NARROW {
            0.5 * h * width * l * l * narrow_arc(sin2) / (rr * rr.sqrt())
        } else {
            (hl.atan2(dot) - hl * dot / rr) / (2.0 * h * h * self.length)
        }
    }

    /// Irradiance from all panels of a partition, in lux or W/m2. Cost: one [`panel`](Self::panel) each.
    pub fn partition(&self, partition: &Partition) -> f64 {
        partition
            .panels()
            .iter()
            .map(|p| self.panel(p.start, p.end))
            .sum()
    }

    /// Irradiance per unit of light parameter at `t`: the integrand of [`panel`](Self::panel).
    ///
    /// Zero outside [0, 1] and below the horizon.
    #[inline]
    pub fn density(&self, t: f64) -> f64 {
        if !(t >= self.lit.0 && t <= self.lit.1 && self.lit.0 < self.lit.1) {
            return 0.0;
        }
        let s = self.along_at(t);
        let rr = self.distance * self.distance + s * s;
        let falloff = if self.diffuse {
            self.distance / (rr * rr)
        } else {
            1.0 / (rr * rr.sqrt())
        };
        self.scale * self.height_at(t) * falloff
    }

    /// The irradiance estimated from samples: pairs of a light parameter and whether the light is visible there.
    ///
    /// The mean of density times visibility: unbiased if each parameter is uniform on [0, 1]. Nothing for no
    /// samples. Cost: one [`density`](Self::density) per visible sample.
    ///
    /// ```
    /// use glam::DVec3;
    /// use llsr_quadrature::{Emission, LineIrradiance, LineLight, Receiver};
    ///
    /// # let emission = Emission::Isotropic;
    /// # let light = LineLight { a: DVec3::new(-1.0, 2.0, 0.0), b: DVec3::new(1.0, 2.0, 0.0), emission, flux: 1.0 };
    /// # let receiver = Receiver { position: DVec3::ZERO, normal: DVec3::Y };
    /// let line = LineIrradiance::new(&receiver, &light);
    /// // A shadow over the last third of the light.
    /// let samples = [0.125, 0.375, 0.625, 0.875].map(|t| (t, t < 0.67));
    /// let truth = line.panel(0.0, 0.67);
    /// assert!((line.sampled(samples) / truth - 1.0).abs() < 0.15);
    /// ```
    pub fn sampled(&self, samples: impl IntoIterator<Item = (f64, bool)>) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for (t, visible) in samples {
            count += 1;
            if visible {
                sum += self.density(t);
            }
        }
        sum / count.max(1) as f64
    }

    /// To first order, the most by which the irradiance of `partition` can be off because its ends are
    /// uncertain: the sum over ends of uncertainty times [`density`](Self::density).
    pub fn uncertainty(&self, partition: &Partition) -> f64 {
        let ends = |p: &llsr_visibility::Panel| {
            p.start_uncertainty * self.density(p.start) + p.end_uncertainty * self.density(p.end)
        };
        partition.panels().iter().map(ends).fold(0.0, |sum, e| sum + e)
    }

    /// Whether the light's emission falls off towards its axis; a point light's does not.
    pub(crate) fn is_diffuse(&self) -> bool {
        self.diffuse
    }

    /// The panel between `t0` and `t1`, horizon clipped, as angles at the receiver.
    pub(crate) fn arc(&self, t0: f64, t1: f64) -> Option<Arc> {
        let (t0, t1) = (t0.max(self.lit.0), t1.min(self.lit.1));
        let width = t1 - t0;
        if width.is_nan() || width <= 0.0 {
            return None;
        }
        let (s1, s2) = (self.along_at(t0), self.along_at(t1));
        let h = self.distance;
        let rr = (h * h + s1 * s1) * (h * h + s2 * s2);
        let cross = h * width * self.length;
        let angle = cross.atan2(h * h + s1 * s2);
        let sin2 = cross * cross / rr;
        // angle / (h L), which is width (angle / sin(angle)) / (r1 r2).
        let per_irradiance = if sin2 < 1e-8 {
            width * (1.0 + sin2 / 6.0) / rr.sqrt()
        } else {
            angle / (h * self.length)
        };
        Some(Arc {
            start: s1.atan2(h),
            angle,
            scale: self.scale * per_irradiance,
        })
    }

    /// Unit vectors from the receiver straight to the light's line, and along the light from `a` to `b`; any
    /// pair at right angles where geometry leaves them open.
    pub(crate) fn frame(&self, receiver: &Receiver, light: &LineLight) -> (DVec3, DVec3) {
        let to_a = light.a - receiver.position;
        let to_b = light.b - receiver.position;
        if self.length == 0.0 {
            let across = to_a.try_normalize().unwrap_or(receiver.normal);
            return (across, across.any_orthonormal_vector());
        }
        let along = (light.b - light.a) / self.length;
        let near = if self.along.0.abs() < self.along.1.abs() {
            to_a
        } else {
            to_b
        };
        let across = (near - near.dot(along) * along).try_normalize();
        (across.unwrap_or_else(|| along.any_orthonormal_vector()), along)
    }

    /// Position along the line; both products round relative to themselves, so each end is as good as given.
    #[inline]
    fn along_at(&self, t: f64) -> f64 {
        self.along.0 * (1.0 - t) + self.along.1 * t
    }

    /// Height over the receiver's plane, not negative.
    #[inline]
    fn height_at(&self, t: f64) -> f64 {
        (self.height.0 * (1.0 - t) + self.height.1 * t).max(0.0)
    }
}

/// A panel as the receiver sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    /// Angle from the perpendicular to the first end, radians.
    pub(crate) start: f64,
    /// Angle that the panel subtends, not negative.
    pub(crate) angle: f64,
    /// The irradiance if the mean over the arc of `cos(theta)`, times `cos(alpha)` for the diffuse law, were 1.
    pub(crate) scale: f64,
}

/// The largest `sin^2 D` for which [`narrow_arc`] reaches full precision.
const NARROW: f64 = 1.0 / 16.0;

/// `(D - sin D cos D) / sin^3 D` for `w = sin^2 D` up to [`NARROW`], `D` acute.
///
/// The derivative of `asin(z) - z sqrt(1 - z^2)` is `2 z^2 / sqrt(1 - z^2)`; its binomial series integrated
/// gives `sum 2 C(2k, k) / 4^k w^k / (2k + 3)`. The first term left out is below 2e-17 of the sum.
#[inline]
fn narrow_arc(w: f64) -> f64 {
    const TERMS: usize = 12;
    const SERIES: [f64; TERMS] = {
        let mut series = [0.0; TERMS];
        let (mut k, mut binomial) = (0, 1.0);
        while k < TERMS {
            series[k] = 2.0 * binomial / (2 * k + 3) as f64;
            binomial *= (2 * k + 1) as f64 / (2 * k + 2) as f64;
            k += 1;
        }
        series
    };
    SERIES.iter().rev().fold(0.0, |sum, &c| sum * w + c)
}
