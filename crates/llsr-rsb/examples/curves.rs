//! Prints the expected estimate of every method, closed form beside simulation: `cargo run --example curves`.

use llsr_rsb::{Method, Stop, bisect, expected_estimate};
use llsr_visibility::Bracket;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn main() {
    const TESTS: u32 = 3;
    const SEARCHES: u32 = 100_000;
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    print!("lambda");
    for method in Method::ALL {
        print!("{:>26}", method.name());
    }
    println!(
        "\n      {}",
        "    closed form  simulated".repeat(Method::ALL.len())
    );
    for i in 0..=8 {
        let lambda = f64::from(i) / 8.0;
        print!("{lambda:6.3}");
        for method in Method::ALL {
            let mut sum = 0.0;
            for _ in 0..SEARCHES {
                let unit = Bracket::new(0.0, 1.0, true);
                sum += bisect(method, &mut |t| t <= lambda, unit, Stop::Tests(TESTS), &mut rng).estimate;
            }
            print!(
                "{:15.4}{:11.4}",
                expected_estimate(method, TESTS, lambda),
                sum / f64::from(SEARCHES)
            );
        }
        println!();
    }
}
