//! Colour spaces of FLIP: linear sRGB, YCxCz (linear opponent space) and Hunt-adjusted CIELAB.
//!
//! XYZ is used relative to the white (D65) throughout, so that white is (1, 1, 1).

type Matrix = [[f64; 3]; 3];

/// (x, y) of the sRGB primaries and of D65 (IEC 61966-2-1).
const PRIMARIES: [(f64, f64); 3] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)];
const WHITE: (f64, f64) = (0.3127, 0.3290);

/// Conversions between linear sRGB and relative XYZ.
#[derive(Clone, Debug)]
pub(super) struct Colours {
    to_xyz: [[f32; 3]; 3],
    to_rgb: [[f32; 3]; 3],
}

impl Colours {
    pub(super) fn new() -> Self {
        let xyz = |(x, y): (f64, f64)| [x / y, 1.0, (1.0 - x - y) / y];
        let white = xyz(WHITE);
        // Columns: the primaries relative to the white, each scaled so that their sum is the white.
        let columns = PRIMARIES.map(xyz);
        let mut unscaled = [[0.0; 3]; 3];
        for (row, line) in unscaled.iter_mut().enumerate() {
            *line = [0, 1, 2].map(|c| columns[c][row] / white[row]);
        }
        let inverse = invert(&unscaled);
        let scale = inverse.map(|line| line.iter().sum::<f64>());
        let to_xyz = unscaled.map(|line| [0, 1, 2].map(|c| line[c] * scale[c]));
        let to_rgb = invert(&to_xyz);
        let narrow = |m: Matrix| m.map(|line| line.map(|v| v as f32));
        Self {
            to_xyz: narrow(to_xyz),
            to_rgb: narrow(to_rgb),
        }
    }

    /// Linear sRGB in [0, 1] to YCxCz.
    pub(super) fn opponent(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = multiply(&self.to_xyz, rgb);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// YCxCz to CIELAB with chroma scaled by the lightness (Hunt effect), clamped to the sRGB cube on the way.
    pub(super) fn hunt_lab(&self, opponent: [f32; 3]) -> [f32; 3] {
        let y = (opponent[0] + 16.0) / 116.0;
        let xyz = [y + opponent[1] / 500.0, y, y - opponent[2] / 200.0];
        let rgb = multiply(&self.to_rgb, xyz).map(|v| v.clamp(0.0, 1.0));
        let [fx, fy, fz] = multiply(&self.to_xyz, rgb).map(lab_curve);
        let lightness = 116.0 * fy - 16.0;
        let hunt = 0.01 * lightness;
        [lightness, hunt * 500.0 * (fx - fy), hunt * 200.0 * (fy - fz)]
    }

    /// The largest colour difference that FLIP provides for: green against blue.
    pub(super) fn largest_difference(&self) -> f32 {
        let lab = |rgb| self.hunt_lab(self.opponent(rgb));
        hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0]))
    }
}

/// Difference of lightness plus distance of chroma (HyAB).
pub(super) fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

fn lab_curve(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA {
        t.cbrt()
    } else {
        t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
    }
}

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|line| line[0] * v[0] + line[1] * v[1] + line[2] * v[2])
}

/// The inverse by cofactors; only called with the two well-conditioned matrices above.
fn invert(m: &Matrix) -> Matrix {
    let cofactor = |r: usize, c: usize| {
        let (r1, r2) = ((r + 1) % 3, (r + 2) % 3);
        let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| cofactor(c, r) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_weights_are_those_of_srgb() {
        let colours = Colours::new();
        for (found, expected) in colours.to_xyz[1].iter().zip([0.2126f32, 0.7152, 0.0722]) {
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
    }

    #[test]
    fn known_lab_values() {
        // CIELAB (D65) of the sRGB primaries as tabulated in colour textbooks, to two digits; the chroma is
        // then scaled by L / 100.
        let colours = Colours::new();
        for (rgb, lab) in [
            ([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 1.0, 0.0], [87.73, -86.18, 83.18]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
            ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ] {
            let found = colours.hunt_lab(colours.opponent(rgb));
            let hunt = lab[0] / 100.0;
            for (f, e) in found.iter().zip([lab[0], hunt * lab[1], hunt * lab[2]]) {
                assert!((f - e).abs() < 0.06, "{found:?} for {rgb:?}");
            }
        }
    }
}
