//! Lights with an area as stacks of line lights.
//!
//! # Why a stack is made of ordinary diffuse line lights
//! Tubes, rectangles and discs are ruled by parallel lines, and a line lies in its surface, so the surface's
//! normal `m` is at right angles to it: along one line `-m.x` is the constant `M`. A strip of width `dy` about
//! the line, of radiance `Lv`, therefore gives
//!
//! ```text
//! dE = Lv dy  int (n.x)(-m.x) / r^4 ds  =  Lv (M dy / h)  int h n.x / r^4 ds
//! ```
//!
//! which is the closed form of a *diffuse* line light of the same ends (see [`LineIrradiance`]) whose flux is
//! `pi^2 L Lv (M / h) dy`; and `M dy / h^2` is the angle `dg` that the strip subtends in the plane across the
//! lines. So a Lambertian surface ruled by parallel lines is, to one receiver, exactly
//!
//! ```text
//! E = int  (a diffuse line light of flux  pi^2 Lv L(g) h(g))  dg
//! ```
//!
//! over the angle `g` under which the receiver sees it across the lines. The lines are placed by a rule in `g`
//! (or, where the outline or the surface turns tangential, in an angle whose sine or cosine `g` follows), so
//! that neither the nearness of the surface nor its outline spoils convergence: unoccluded it is exponential
//! in the number of lines. An occluder's edge makes the integrand kink (edge across the lines, error of order
//! `n^-2`) or jump (edge along the lines, `n^-1`); jittered nodes then make the error noise instead of bands.
//!
//! The lines' fluxes are scaled so that a small or far light sends exactly its flux, whatever the rule. (For
//! random nodes this makes the estimate a ratio: hardly biased, and without noise for a thin tube.)
//!
//! Since the lines are ordinary lights, everything that works for those works here: searching their
//! visibility, closed forms, glossy lobes. Their flux is *as seen from one receiver*: it is not the light's.
//!
//! A glossy lobe narrower than the view of the gap between two lines shows the lines one by one; then take more
//! lines, or jittered ones.
//!
//! [`LineIrradiance`]: crate::LineIrradiance

mod disc;
mod rect;
mod tube;

pub use disc::DiscLight;
pub use rect::RectLight;
pub use tube::TubeLight;

use glam::DVec3;

use crate::light::{Emission, LineLight};

/// A line of a stack, of the flux that it has for one receiver.
fn line(a: DVec3, b: DVec3, flux: f64) -> LineLight {
    LineLight {
        a,
        b,
        emission: Emission::Diffuse,
        flux,
    }
}

/// One over the sum of the nodes' weights times `density`, which integrates to 1 over [0, 1].
fn normalization(nodes: impl Iterator<Item = (f64, f64)>, density: impl Fn(f64) -> f64) -> f64 {
    let sum: f64 = nodes.map(|(x, weight)| weight * density(x)).sum();
    // No nodes, or all of them where nothing is seen.
    if sum > 1e-9 { 1.0 / sum } else { 0.0 }
}

/// Two parallel lines seen from a receiver, in the plane across them: what is between, by angle.
#[derive(Clone, Copy, Debug)]
struct Fan {
    /// Distance from the receiver to each line.
    distance: (f64, f64),
    /// Position of each line along the stack, measured from the foot of the receiver; its height over it.
    across: (f64, f64),
    height: f64,
    /// Angle between the two lines, in (0, pi).
    angle: f64,
}

impl Fan {
    /// Lines `across.0 < across.1` in a plane at positive `height`.
    fn new(across: (f64, f64), height: f64) -> Self {
        let distance = (height.hypot(across.0), height.hypot(across.1));
        let width = across.1 - across.0;
        let angle = (height * width).atan2(height * height + across.0 * across.1);
        Self {
            distance,
            across,
            height,
            angle,
        }
    }

    /// For the line at the fraction `x` of the angle: the parts of the stack's width before and after it,
    /// up to a common factor, and its distance from the receiver.
    ///
    /// By the law of sines, so that no tangent of a right angle occurs for a receiver close to the plane.
    fn at(&self, x: f64) -> (f64, f64, f64) {
        // For angles too small for their sine to differ, the sine of a part is the part.
        let part = |x: f64| {
            if self.angle < 1e-9 {
                x
            } else {
                (x * self.angle).sin()
            }
        };
        let (before, after) = (self.distance.0 * part(x), self.distance.1 * part(1.0 - x));
        let sum = before + after;
        let across = (self.across.0 * after + self.across.1 * before) / sum;
        (before / sum, after / sum, self.height.hypot(across))
    }
}

/// Equal weights for `points` on [0, 1]: the nodes of a stratified or other sampled stack.
///
/// ```
/// use llsr_quadrature::{Pattern, sampled_nodes};
/// use rand_pcg::Pcg64Mcg;
///
/// let mut points = [0.0; 4];
/// Pattern::Stratified.fill(&mut Pcg64Mcg::new(1), &mut points);
/// assert!(sampled_nodes(&points).all(|(_, weight)| weight == 0.25));
/// ```
pub fn sampled_nodes(points: &[f64]) -> impl ExactSizeIterator<Item = (f64, f64)> + Clone + '_ {
    let weight = 1.0 / points.len() as f64;
    points.iter().map(move |&point| (point, weight))
}
