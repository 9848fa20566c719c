//! From linear light to display values.

use glam::Vec3;
use llsr_scene::{linear_to_srgb, luminance};

/// How linear values become display values in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// The sRGB transfer curve; values above 1 are clipped.
    #[default]
    Srgb,
    /// A film-like curve before the sRGB transfer: darks with a toe, highlights rolled off towards white.
    ///
    /// f(x) = x (a x + b) / (x (c x + d) + e), each channel on its own, with the constants that K. Narkowicz fitted to the
    /// ACES reference rendering transform ("ACES Filmic Tone Mapping Curve", 2016), and x scaled so that mid grey (0.18)
    /// keeps its value.
    Filmic,
}

impl Tone {
    /// The display value (sRGB-encoded, in [0, 1]) of a linear colour; not-a-number becomes 0.
    pub fn encode(self, color: Vec3) -> Vec3 {
        color.map(|x| {
            // Not a clamp: NaN is to become black.
            let x = if x > 0.0 { x } else { 0.0 };
            let x = match self {
                Self::Srgb => x,
                Self::Filmic => filmic(x),
            };
            linear_to_srgb(x.min(1.0)).min(1.0)
        })
    }
}

fn filmic(x: f32) -> f32 {
    const A: f32 = 2.51;
    const B: f32 = 0.03;
    const C: f32 = 2.43;
    const D: f32 = 0.59;
    const E: f32 = 0.14;
    /// Solves f(0.18 s) = 0.18.
    const MID_GREY_SCALE: f32 = 0.723_170_8;
    // Beyond this the curve is flat, and infinity would give infinity / infinity.
    let x = (x * MID_GREY_SCALE).min(1e6);
    x * (A * x + B) / (x * (C * x + D) + E)
}

/// An exposure, in stops, that shows a picture of any unit: it brings the 90th percentile of luminance to 0.8. Black
/// pixels do not count: most of a picture may be background.
///
/// 0 for a picture that is black or has no finite pixels.
pub fn exposure_for(pixels: &[Vec3]) -> f64 {
    // Not higher: strips of wall next to a tube are hundreds of times brighter than the room.
    const SHARE: f64 = 0.90;
    const TARGET: f64 = 0.8;
    let lit = pixels
        .iter()
        .map(|&p| luminance(p))
        .filter(|y| y.is_finite() && *y > 0.0);
    let mut values: Vec<f32> = lit.collect();
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * SHARE).round() as usize;
    let (_, &mut white, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (TARGET / f64::from(white)).log2()
}
