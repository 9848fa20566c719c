//! Pinned results: a change here changes every rendered image and belongs into the change log.

use llsr_rsb::{Method, Stop, bisect, uniform};
use llsr_visibility::Bracket;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

#[test]
fn every_method() {
    let mut methods = Method::ALL.to_vec();
    methods.push(Method::DitheredAt(0.25));
    let seen: Vec<_> = methods
        .into_iter()
        .map(|method| {
            let mut rng = Pcg64Mcg::seed_from_u64(99);
            let unit = Bracket::new(0.0, 1.0, true);
            let [four, fine] = [Stop::Tests(4), Stop::Tolerance(1e-3)]
                .map(|stop| bisect(method, &mut |t: f64| t <= 0.3, unit, stop, &mut rng));
            (four.estimate.to_bits(), fine.estimate.to_bits(), fine.tests)
        })
        .collect();
    let pinned = [
        (4598738169498697728, 4599072421033541632, 9),
        (4598775747392965056, 4599089218980434430, 9),
        (4596219990208547245, 4599077248863340336, 19),
        (4599076370547103678, 4599088065855517093, 10),
        (4599338697346386368, 4599071626794390014, 9),
        (4599019644475408384, 4599081217126563840, 9),
    ];
    assert_eq!(seen, pinned, "bits of the estimates, tests");
}

#[test]
fn uniform_numbers() {
    let mut rng = Pcg64Mcg::seed_from_u64(99);
    let seen = [(); 3].map(|()| uniform(&mut rng).to_bits());
    let pinned = [4602979442326785535, 4606979093577203149, 4607090437597703287];
    assert_eq!(seen, pinned, "bits");
}
