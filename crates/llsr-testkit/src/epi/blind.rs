//! Interpolation that knows no edges, as the render cache does it: what edges are compared with.

/// A sample of a picture: position in pixels from the top left corner, colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenSample {
    /// x and y, y downwards.
    pub position: [f32; 2],
    /// Linear.
    pub colour: [f32; 3],
}

/// Each pixel is the mean of the samples in its 5x5 pixels, weighted by the product of `taps` (at distance 0, 1 and 2) along both
/// axes; where there are none, of what the pixels around got, as often as it takes. Row by row.
///
/// A pixel has at most one sample: later ones replace earlier ones.
pub fn edge_blind(width: usize, height: usize, samples: &[ScreenSample], taps: [f32; 3]) -> Vec<[f32; 3]> {
    let mut known: Vec<Option<[f32; 3]>> = vec![None; width * height];
    for sample in samples {
        let [x, y] = sample.position;
        if x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32 {
            known[y as usize * width + x as usize] = Some(sample.colour);
        }
    }
    let mut filtered = filter(width, height, &known, taps);
    while filtered.iter().any(Option::is_none) && filtered.iter().any(Option::is_some) {
        let next = filter(width, height, &filtered, taps);
        for (value, next) in filtered.iter_mut().zip(next) {
            *value = value.or(next);
        }
    }
    filtered.into_iter().map(Option::unwrap_or_default).collect()
}

fn filter(width: usize, height: usize, known: &[Option<[f32; 3]>], taps: [f32; 3]) -> Vec<Option<[f32; 3]>> {
    let window = |at: usize, size: usize| at.saturating_sub(2)..(at + 3).min(size);
    let pixel = |x: usize, y: usize| {
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for v in window(y, height) {
            for u in window(x, width) {
                if let Some(colour) = known[v * width + u] {
                    let weight = taps[u.abs_diff(x)] * taps[v.abs_diff(y)];
                    weights += weight;
                    for (sum, component) in sum.iter_mut().zip(colour) {
                        *sum += weight * component;
                    }
                }
            }
        }
        (weights > 0.0).then(|| sum.map(|component| component / weights))
    };
    (0..width * height).map(|i| pixel(i % width, i / width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lone_sample_spreads_everywhere_and_two_are_mixed_by_their_distance() {
        let at = |x: f32, value: f32| ScreenSample {
            position: [x, 0.5],
            colour: [value; 3],
        };
        let lone = edge_blind(11, 3, &[at(0.5, 2.0)], [18.0, 6.0, 1.0]);
        assert!(
            lone.iter().all(|c| (c[0] - 2.0).abs() < 1e-6),
            "everywhere: {lone:?}"
        );
        let two = edge_blind(4, 1, &[at(0.5, 0.0), at(3.5, 1.0)], [18.0, 6.0, 1.0]);
        let expected = [0.0, 1.0 / 7.0, 6.0 / 7.0, 1.0];
        for (found, expected) in two.iter().zip(expected) {
            assert!((found[0] - expected).abs() < 1e-6, "{two:?}");
        }
    }
}
