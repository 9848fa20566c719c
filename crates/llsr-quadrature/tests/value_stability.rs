//! Pinned results of seeded code: an accidental change of a random stream fails here, though no statistic would.

use llsr_quadrature::{DitherMask, Pattern};
use rand_pcg::Pcg64Mcg;

#[test]
fn patterns_keep_their_points() {
    let points = |pattern: Pattern| {
        let mut points = [0.0; 4];
        pattern.fill(&mut Pcg64Mcg::new(42), &mut points);
        points.map(|t| (t * 1e9).round() / 1e9)
    };
    assert_eq!(points(Pattern::Uniform), [0.125, 0.375, 0.625, 0.875]);
    assert_eq!(
        points(Pattern::Stratified),
        [0.097368772, 0.304845156, 0.664053048, 0.960041648]
    );
    assert_eq!(
        points(Pattern::HierarchicalPoisson),
        [0.389475087, 0.905096306, 0.645034113, 0.145824123]
    );
    assert_eq!(
        points(Pattern::Sobol),
        [0.196164608, 0.96186018, 0.490970492, 0.542649269]
    );
}

#[test]
fn the_mask_keeps_its_values() {
    let mask = DitherMask::blue_noise();
    let ranks = [0, 1, 2, 3, 4, 5].map(|x| (mask.value(x, 0, 0) * 4096.0) as u32);
    assert_eq!(ranks, [3802, 3379, 287, 975, 2057, 533]);
    // A digest of all of them.
    let digest = (0..4096u64).fold(0u64, |digest, i| {
        let rank = (mask.value(i as u32 % 64, i as u32 / 64, 0) * 4096.0) as u64;
        digest.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(rank)
    });
    assert_eq!(digest, 4_110_204_039_453_375_416);
}
