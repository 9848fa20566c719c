//! Colours for maps of errors.

/// Coefficients of t^0 to t^6 for red, green and blue: a near-minimax fit to the table of matplotlib's magma
/// (S. van der Walt, N. Smith; public domain), at most 5/255 away from it in every channel.
const MAGMA: [[f32; 7]; 3] = [
    [
        -0.00669, 0.54272, 5.39341, -16.11542, 31.09074, -32.6683, 12.75874,
    ],
    [0.00965, 0.6092, -3.81979, 16.67744, -33.578, 34.3168, -13.23791],
    [
        -0.00298, 2.26022, 3.40347, -28.39551, 44.28347, -26.14334, 5.36102,
    ],
];

/// The sRGB colour (0 to 255) of an error in [0, 1]: black, violet, orange, pale yellow.
///
/// Like the magma map it approximates, it grows in lightness with the error, so it survives grey-scale
/// printing. Values outside [0, 1] are clamped; NaN is drawn as 0.
pub fn heat_colour(error: f32) -> [u8; 3] {
    let t = if error.is_nan() {
        0.0
    } else {
        error.clamp(0.0, 1.0)
    };
    MAGMA.map(|coefficients| {
        let value = coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
        // Float to integer conversion saturates.
        (255.0 * value + 0.5) as u8
    })
}
