//! Voronoi Search: halve the widest stretch without a test until one answers otherwise.

use llsr_rsb::uniform;
use llsr_visibility::Visibility;
use rand_core::Rng;

/// Tolerances below this count as this, so that a search makes at most about 2 / 2<sup>-16</sup> tests.
pub(crate) const MIN_NU: f64 = 1.0 / 65536.0;

/// `nu` within what searches support; NaN and numbers that are not positive ask for the finest.
pub(crate) fn supported_nu(nu: f64) -> f64 {
    nu.max(MIN_NU)
}

/// A stretch between neighbouring points that are known at the start, cut into 2^level equal parts.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    lo: f64,
    length: f64,
    level: i32,
}

impl Stretch {
    /// The length of its parts. Taken from the whole, not from the ends of a part, so that ties are exact.
    fn part(&self) -> f64 {
        self.length * 0.5f64.powi(self.level)
    }
}

/// Memory of [`voronoi_search`], kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct VoronoiScratch {
    stretches: Vec<Stretch>,
    order: Vec<u32>,
}

/// Searches [`known[0]`, `known[last]`] for a point that does not answer `base` (OF99 section 5.1, P = 0).
///
/// `known` holds, ascending, the ends of the interval and the points inside it that were tested before and
/// answered `base`. If `seed`, the first test is uniform in the interval. Then the midpoint of the widest
/// stretch is tested, ties broken by the stream, until one answers otherwise, which is returned, or the
/// widest stretch is narrower than `nu`.
pub(crate) fn voronoi_search<V, R>(
    oracle: &mut V,
    known: &[f64],
    base: bool,
    nu: f64,
    seed: bool,
    rng: &mut R,
    scratch: &mut VoronoiScratch,
) -> Option<f64>
where
    V: Visibility + ?Sized,
    R: Rng + ?Sized,
{
    let nu = supported_nu(nu);
    let VoronoiScratch { stretches, order } = scratch;
    stretches.clear();
    let (&[first, ..], &[.., last]) = (known, known) else {
        return None;
    };
    let mut add = |lo: f64, hi: f64| {
        if hi > lo {
            stretches.push(Stretch {
                lo,
                length: hi - lo,
                level: 0,
            });
        }
    };
    let mut pending = (seed && last > first).then(|| first + uniform(rng) * (last - first));
    if let Some(t) = pending
        && oracle.visible(t) != base
    {
        return Some(t);
    }
    for pair in known.windows(2) {
        match pending {
            Some(t) if t <= pair[1] => {
                add(pair[0], t);
                add(t, pair[1]);
                pending = None;
            }
            _ => add(pair[0], pair[1]),
        }
    }

    loop {
        let widest = stretches
            .iter_mut()
            .max_by(|a, b| a.part().total_cmp(&b.part()))?;
        let part = widest.part();
        if part < nu {
            return None;
        }
        // All parts of the widest stretch tie; none of their halves can be the widest before all are cut.
        let parts = 1u32 << widest.level;
        order.clear();
        order.extend(0..parts);
        for i in 0..parts {
            let rest = f64::from(parts - i);
            // Rounding down a number below `rest` keeps the index in range.
            let pick = if parts - i > 1 {
                (uniform(rng) * rest) as u32
            } else {
                0
            };
            order.swap(i as usize, (i + pick) as usize);
            let t = widest.lo + (f64::from(order[i as usize]) + 0.5) * part;
            if oracle.visible(t) != base {
                return Some(t);
            }
        }
        widest.level += 1;
    }
}
