//! Sample patterns on [0, 1], for the methods that test visibility at every shading sample.
//!
//! All write into a slice, so a caller allocates once for a whole picture, and all randomness comes from the
//! caller's stream.

use rand_core::Rng;

/// How to spread sample points over a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pattern {
    /// The midpoints of equal cells: [`uniform`].
    Uniform,
    /// A random point in each of equal cells: [`stratified`].
    Stratified,
    /// Hierarchical Poisson disk: [`hierarchical_poisson`].
    HierarchicalPoisson,
    /// An Owen-scrambled Sobol sequence: [`sobol`].
    Sobol,
}

impl Pattern {
    /// Every pattern, in the order of declaration.
    pub const ALL: [Self; 4] = [
        Self::Uniform,
        Self::Stratified,
        Self::HierarchicalPoisson,
        Self::Sobol,
    ];

    /// Fills `points` with this pattern.
    ///
    /// ```
    /// use llsr_quadrature::Pattern;
    /// use rand_pcg::Pcg64Mcg;
    ///
    /// let mut random = Pcg64Mcg::new(7);
    /// let mut points = [0.0; 4];
    /// Pattern::Stratified.fill(&mut random, &mut points);
    /// assert!(points.iter().enumerate().all(|(i, &t)| (t * 4.0).floor() == i as f64));
    /// ```
    pub fn fill(self, random: &mut impl Rng, points: &mut [f64]) {
        match self {
            Self::Uniform => uniform(points),
            Self::Stratified => stratified(random, points),
            Self::HierarchicalPoisson => hierarchical_poisson(random, points),
            Self::Sobol => sobol(random.next_u32(), 0, points),
        }
    }
}

/// A number in [0, 1) with 53 random bits.
fn unit(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// The midpoints of equal cells, ascending: the same for every pixel, so that errors show as bands.
pub fn uniform(points: &mut [f64]) {
    let cell = 1.0 / points.len() as f64;
    for (i, point) in points.iter_mut().enumerate() {
        *point = (i as f64 + 0.5) * cell;
    }
}

/// A uniformly random point in each of equal cells, ascending. Unbiased. One number of the stream per point.
pub fn stratified(random: &mut impl Rng, points: &mut [f64]) {
    let cell = 1.0 / points.len() as f64;
    for (i, point) in points.iter_mut().enumerate() {
        // The clamp keeps a rounded-up product out of the next cell.
        *point = ((i as f64 + unit(random)) * cell)
            .min((i + 1) as f64 * cell)
            .min(1.0 - f64::EPSILON / 2.0);
    }
}

/// The first points of a Sobol sequence with Owen scrambling by `seed`.
///
/// The first 2^k points have one in each of 2^k equal cells, whatever the seed, and every point is uniform on
/// [0, 1) over the seeds. `dimension` (below 256) tells apart sequences of one seed, as for several lights.
/// The sequence has 65,536 points and 24 bits each; a longer slice gets further ones by other seeds.
///
/// Source: B. Burley, "Practical hash-based Owen scrambling", JCGT 2020, by way of the crate `sobol_burley`.
pub fn sobol(seed: u32, dimension: u32, points: &mut [f64]) {
    let dimension = dimension % sobol_burley::NUM_DIMENSIONS;
    for (block, points) in (0u32..).zip(points.chunks_mut(1 << 16)) {
        for (i, point) in (0u32..).zip(points) {
            *point = f64::from(sobol_burley::sample(i, dimension, seed.wrapping_add(block)));
        }
    }
}

/// Darts thrown at one radius before it shrinks.
const DARTS: i32 = 24;
/// By what the radius shrinks.
const SHRINK: f64 = 0.9;
/// Up to this many points, darts are not thrown one by one.
const LISTED: usize = 64;

/// Hierarchical Poisson-disk points on the circle [0, 1): darts thrown with a radius that shrinks to 0.9 of
/// itself whenever 24 in a row have landed within it of an earlier point.
///
/// Points come in the order in which they were thrown: every prefix is a Poisson-disk pattern of its own
/// density, which is what is hierarchical about it. Distances are taken around the circle, so that every
/// point is uniform on [0, 1) and the estimate unbiased. Cost: quadratic in the number of points, about 0.2 us
/// for 4 and 2 us for 16: for the first 64 points the outcome of a series of darts is drawn at once, from the
/// length of the circle that is still free, with the same distribution.
///
/// Source: M. McCool, E. Fiume, "Hierarchical Poisson disk sampling distributions", Graphics Interface 1992,
/// in one dimension; the method that Ouellette & Fiume 1999, section 4, compare with.
pub fn hierarchical_poisson(random: &mut impl Rng, points: &mut [f64]) {
    let mut radius = 0.5;
    let mut sorted = [0.0; LISTED];
    for (count, point) in points.iter_mut().take(LISTED).enumerate() {
        *point = free_point(random, &sorted[..count], &mut radius);
        let at = sorted[..count].partition_point(|p| p < point);
        sorted.copy_within(at..count, at + 1);
        sorted[at] = *point;
    }
    for count in LISTED..points.len() {
        points[count] = dart(random, &points[..count], &mut radius);
    }
}

/// Where the first dart lands farther than the radius from `sorted` points, which shrinks as it must.
fn free_point(random: &mut impl Rng, sorted: &[f64], radius: &mut f64) -> f64 {
    let Some(&first) = sorted.first() else {
        return unit(random);
    };
    // The gap after each point, the last one around the circle.
    let gaps = || {
        let next = sorted[1..].iter().copied().chain([first + 1.0]);
        sorted.iter().copied().zip(next)
    };
    loop {
        let room = |(from, to): (f64, f64)| (to - from - 2.0 * *radius).max(0.0);
        let free: f64 = gaps().map(room).sum();
        // One of the darts hits unless all of them miss.
        if free > 0.0 && unit(random) >= (1.0 - free).powi(DARTS) {
            let mut left = free * unit(random);
            let mut place = None;
            for gap in gaps().filter(|&gap| room(gap) > 0.0) {
                place = Some(gap.0 + *radius + left.min(room(gap)));
                if left <= room(gap) {
                    break;
                }
                left -= room(gap);
            }
            if let Some(place) = place {
                return if place < 1.0 {
                    place
                } else {
                    (place - 1.0).min(1.0 - f64::EPSILON / 2.0)
                };
            }
        }
        *radius *= SHRINK;
    }
}

/// The same by throwing darts.
fn dart(random: &mut impl Rng, earlier: &[f64], radius: &mut f64) -> f64 {
    let mut misses = 0;
    loop {
        let dart = unit(random);
        let apart = |&p: &f64| {
            let distance = (dart - p).abs();
            distance.min(1.0 - distance) >= *radius
        };
        if earlier.iter().all(apart) {
            return dart;
        }
        misses += 1;
        if misses == DARTS {
            (*radius, misses) = (*radius * SHRINK, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;

    /// Both ways of throwing have the same distribution: mean gap statistics of 6 points over 20,000 patterns.
    #[test]
    fn drawing_a_series_of_darts_is_throwing_them() {
        const TRIALS: u32 = 20_000;
        let closest = |points: &[f64]| {
            let distance = |p: f64, q: f64| (p - q).abs().min(1.0 - (p - q).abs());
            let pairs = points
                .iter()
                .enumerate()
                .flat_map(|(i, &p)| points[..i].iter().map(move |&q| (p, q)));
            pairs.map(|(p, q)| distance(p, q)).fold(1.0, f64::min)
        };
        // Mean and mean square of the closest distance, and of the last point's distance to the first.
        let statistics = |drawn: bool| {
            let mut random = Pcg64Mcg::new(17);
            let mut sums = [0.0; 3];
            for _ in 0..TRIALS {
                let mut points = [0.0; 6];
                if drawn {
                    hierarchical_poisson(&mut random, &mut points);
                } else {
                    let mut radius = 0.5;
                    for count in 0..points.len() {
                        points[count] = dart(&mut random, &points[..count], &mut radius);
                    }
                }
                let (near, last) = (closest(&points), closest(&[points[0], points[5]]));
                for (sum, value) in sums.iter_mut().zip([near, near * near, last]) {
                    *sum += value / f64::from(TRIALS);
                }
            }
            sums
        };
        let (drawn, thrown) = (statistics(true), statistics(false));
        // Standard errors of the differences are about 1.5e-4, 4e-5 and 1.1e-3.
        for ((one, other), limit) in drawn.into_iter().zip(thrown).zip([7.5e-4, 2e-4, 5.5e-3]) {
            assert!((one - other).abs() < limit, "{drawn:?} against {thrown:?}");
        }
    }
}
