//! Numerical stress with large counts: exact visibility against exact brute force, leaks, slits, and intervals.

use std::time::Instant;

use llsr_testkit::intervals::{OPERATIONS, containment};
use llsr_testkit::tracer::{FanTrials, exactness_trials, leak_trials, slit_trials};
use llsr_tracer::Tracer;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Interval ends may differ from those of exact arithmetic by this times their condition number.
const TOLERANCE: f64 = 1e-9;

/// `cargo xtask stress [SHARE]`: 1 is a million cases of each kind and ten million fans for leaks.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let share: f64 = match args {
        [] => 1.0,
        [text] => text.parse().map_err(|_| format!("'{text}' is not a number"))?,
        _ => return Err("usage: cargo xtask stress [SHARE]".to_owned()),
    };
    if !(share > 0.0 && share.is_finite()) {
        return Err(format!("{share} is no share of the full counts"));
    }
    let count = |full: f64| ((full * share) as u64).max(1);
    let build = |scene: &llsr_scene::Scene| Tracer::new(scene).0;
    let mut faults = Vec::new();
    let mut report = |name: &str, seed: u64, trials: &dyn Fn(&mut Pcg64Mcg) -> FanTrials| {
        let start = Instant::now();
        let found = trials(&mut Pcg64Mcg::seed_from_u64(seed));
        println!(
            "{name:<40} {:>9} fans: {} with light where there is none, {} with an occluder where there is none, \
             {} not certified, {} partly hidden; {:.1} s",
            found.fans,
            found.missed,
            found.invented,
            found.uncertified,
            found.partly,
            start.elapsed().as_secs_f64()
        );
        if found.missed + found.invented + found.uncertified > 0 {
            faults.push(name.to_owned());
        }
    };
    report("exact visibility against brute force", 101, &|rng| {
        exactness_trials(rng, count(1e6), TOLERANCE, build)
    });
    report("leaks: points inside closed meshes", 102, &|rng| {
        leak_trials(rng, count(1e7), build)
    });
    report("slits: a convex body seen edge-on", 103, &|rng| {
        slit_trials(rng, count(1e6), build)
    });
    let trials = count(1e6);
    for operation in OPERATIONS {
        if let Err(failure) = containment(operation, trials) {
            faults.push(format!(
                "{operation:?}, trial {}: {}",
                failure.trial, failure.message
            ));
        }
    }
    println!(
        "intervals: {trials} trials of each of {} operations in f32 and f64",
        OPERATIONS.len()
    );
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults.join("\n"))
    }
}
