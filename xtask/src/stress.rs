//! Numerical stress with large counts: exact visibility against exact brute force, leaks, slits, and intervals.

use std::time::Instant;

use llsr_scene::Scene;
use llsr_testkit::intervals::{OPERATIONS, containment};
use llsr_testkit::tracer::{FanTrials, exactness_trials, leak_trials, slit_trials};
use llsr_tracer::Tracer;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Interval ends may differ from those of exact arithmetic by this times their condition number.
const TOLERANCE: f64 = 1e-9;

/// Streams of random numbers that share the trials of a kind, each on a thread of its own.
const STREAMS: u64 = 4;

/// Trials of one kind.
struct Kind {
    name: &'static str,
    fans: u64,
    seed: u64,
    trials: fn(&mut Pcg64Mcg, u64) -> FanTrials,
}

impl Kind {
    fn run(&self) -> FanTrials {
        std::thread::scope(|scope| {
            let streams: Vec<_> = (0..STREAMS)
                .map(|stream| {
                    scope.spawn(move || {
                        let mut rng = Pcg64Mcg::seed_from_u64(self.seed + 10 * stream);
                        (self.trials)(&mut rng, self.fans.div_ceil(STREAMS))
                    })
                })
                .collect();
            let mut sum = FanTrials::default();
            for stream in streams {
                sum.add(&stream.join().expect("trials do not panic"));
            }
            sum
        })
    }
}

fn build(scene: &Scene) -> Tracer {
    Tracer::new(scene).0
}

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
    let kinds: [Kind; 3] = [
        Kind {
            name: "exact visibility against brute force",
            fans: count(1e6),
            seed: 101,
            trials: |rng, fans| exactness_trials(rng, fans, TOLERANCE, build),
        },
        Kind {
            name: "leaks: points inside closed meshes",
            fans: count(1e7),
            seed: 102,
            trials: |rng, fans| leak_trials(rng, fans, build),
        },
        Kind {
            name: "slits: a convex body seen edge-on",
            fans: count(1e6),
            seed: 103,
            trials: |rng, fans| slit_trials(rng, fans, build),
        },
    ];
    let mut faults = Vec::new();
    for kind in &kinds {
        let start = Instant::now();
        let found = kind.run();
        println!(
            "{:<40} {:>9} fans: {} with light where there is none, {} with an occluder where there is none, \
             {} not certified, {} partly hidden, {} with an ill-conditioned end elsewhere; {:.1} s",
            kind.name,
            found.fans,
            found.missed,
            found.invented,
            found.uncertified,
            found.partly,
            found.moved,
            start.elapsed().as_secs_f64()
        );
        if found.missed + found.invented + found.uncertified > 0 {
            faults.push(kind.name.to_owned());
        }
    }
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
