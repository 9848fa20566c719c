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
const DARTS: u32 = 24;
/// By what the radius shrinks.
const SHRINK: f64 = 0.9;

/// Hierarchical Poisson-disk points on the circle [0, 1): darts thrown with a radius that shrinks whenever
/// too many in a row have landed within it of an earlier point.
///
/// Points come in the order in which they were thrown: every prefix is a Poisson-disk pattern of its own
/// density, which is what is hierarchical about it. Distances are taken around the circle, so that every
/// point is uniform on [0, 1) and the estimate unbiased. The radius shrinks to 0.9 of itself after 24 misses.
/// Cost: quadratic in the number of points, about 1 us for 4 and 10 us for 16.
///
/// Source: M. McCool, E. Fiume, "Hierarchical Poisson disk sampling distributions", Graphics Interface 1992,
/// in one dimension; the method that Ouellette & Fiume 1999, section 4, compare with.
pub fn hierarchical_poisson(random: &mut impl Rng, points: &mut [f64]) {
    let mut radius = 0.5;
    for done in 0..points.len() {
        let (earlier, rest) = points.split_at_mut(done);
        let mut misses = 0;
        rest[0] = loop {
            let dart = unit(random);
            let apart = |&p: &f64| {
                let distance = (dart - p).abs();
                distance.min(1.0 - distance) >= radius
            };
            if earlier.iter().all(apart) {
                break dart;
            }
            misses += 1;
            if misses == DARTS {
                (radius, misses) = (radius * SHRINK, 0);
            }
        };
    }
}
