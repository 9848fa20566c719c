//! The display form: values over a common white, clamped to [0, 1], then the sRGB curve.

use crate::Image;

/// The sRGB curve: linear [0, 1] to encoded [0, 1]; values outside are clamped (IEC 61966-2-1). A measure of its own: pictures are
/// encoded by `llsr_scene::linear_to_srgb`, which nothing here may use.
pub(crate) fn srgb_encode(linear: f32) -> f32 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.003_130_8 {
        12.92 * v
    } else {
        // The same as 1.055 v^(1/2.4) - 0.055, but 1 stays exactly 1.
        1.0 - 1.055 * (1.0 - v.powf(1.0 / 2.4))
    }
}

/// The percentile `q` in [0, 100] of all channel values of all pixels, linear between ranks.
///
/// `q` is clamped; NaN channels are ordered last. Cost: linear on average, one copy of the image.
pub fn percentile(image: Image<'_>, q: f64) -> f32 {
    let mut values = image.pixels().as_flattened().to_vec();
    let rank = q.clamp(0.0, 100.0) / 100.0 * (values.len() - 1) as f64;
    let below = rank.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f32::total_cmp);
    let high = above.iter().copied().min_by(f32::total_cmp).unwrap_or(low);
    let fraction = rank - below as f64;
    (f64::from(low) * (1.0 - fraction) + f64::from(high) * fraction) as f32
}

/// The white of a comparison with reference `b`: its 98th percentile; where that is not above 0 (a nearly
/// black picture), its largest value; where that is not either, 1.
pub(crate) fn white_of(b: Image<'_>) -> f32 {
    let white = percentile(b, 98.0);
    if white > 0.0 {
        return white;
    }
    let largest = b.pixels().as_flattened().iter().copied().fold(0.0, f32::max);
    if largest > 0.0 { largest } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::srgb_encode;

    #[test]
    fn srgb_curve() {
        // Encoded mid-grey 0.5 is linear 0.214041; the two branches meet.
        for (linear, encoded) in [
            (0.0, 0.0),
            (0.214_041, 0.5),
            (1.0, 1.0),
            (-1.0, 0.0),
            (7.0, 1.0),
            (0.001, 0.012_92),
        ] {
            assert!((srgb_encode(linear) - encoded).abs() < 1e-5, "{linear}");
        }
        let (below, above) = (srgb_encode(0.003_130_7), srgb_encode(0.003_130_9));
        assert!((below - above).abs() < 1e-5, "{below} and {above}");
    }
}
