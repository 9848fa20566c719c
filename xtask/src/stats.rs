//! Statistics of the searches: every claim about an expected value, against simulation.
//!
//! A claim is a number for one setting (method, number of tests, place of the change), a cell of a table.
//! [`SAMPLES`] searches with a stream of their own per claim, from the fixed [`SEED`], give a mean and its
//! deviation; the claim is rejected if the mean lies further from it than z deviations. z is such that true
//! claims are *all* kept with probability 1 - [`LEVEL`] (Sidak's correction for their number). A claim about
//! something that does not vary must hold to 1e-12.
//!
//! A check that rejects nothing is none: the two formulas that the paper misprints are put to the same test,
//! and it is an error if they pass.

mod claims;
mod sampling;

use llsr_rsb::{Method, Stop, average_mean_square_error, average_tests};
use sampling::{Claim, limit};

/// Searches per claim.
const SAMPLES: u32 = 1 << 16;
/// Seed of the first claim; each claim adds one.
const SEED: u64 = 1999;
/// Probability of rejecting any true claim at all.
const LEVEL: f64 = 0.01;

/// Claims of one kind.
struct Group {
    name: &'static str,
    claims: Vec<Claim>,
}

/// Checks every claim, prints a line a group and fails if a true claim is rejected or a false one is not.
pub(crate) fn run() -> Result<(), String> {
    let groups = claims::true_groups();
    let count: usize = groups.iter().map(|group| group.claims.len()).sum();
    let limit = limit(LEVEL, count);
    println!(
        "{count} claims, {SAMPLES} searches each, seed {SEED}; all true ones pass with probability {}: \
         at most {limit:.2} deviations of the mean",
        1.0 - LEVEL
    );
    println!("{:34} claims  worst z  where", "");
    let mut failed = Vec::new();
    for group in &groups {
        let worst = group.worst();
        println!(
            "{:34} {:6} {:8.2}  {}",
            group.name,
            group.claims.len(),
            worst.deviations(),
            worst.place
        );
        let rejected = group.claims.iter().filter(|claim| claim.deviations() > limit);
        failed.extend(rejected.map(|claim| format!("{}: {claim}", group.name)));
    }

    println!("misprints of the paper, to be rejected");
    for group in &claims::misprints() {
        let kept: Vec<_> = group
            .claims
            .iter()
            .filter(|claim| claim.deviations() <= limit)
            .collect();
        let least = group
            .claims
            .iter()
            .map(Claim::deviations)
            .fold(f64::INFINITY, f64::min);
        println!(
            "{:34} {:6} {:8.2}  least; {} not rejected",
            group.name,
            group.claims.len(),
            least,
            kept.len()
        );
        failed.extend(
            kept.iter()
                .map(|claim| format!("{} was not rejected: {claim}", group.name)),
        );
    }
    failed.extend(compare_errors());

    if failed.is_empty() {
        Ok(())
    } else {
        Err(format!("statistics:\n  {}", failed.join("\n  ")))
    }
}

impl Group {
    /// The claim whose mean is the most deviations away.
    fn worst(&self) -> &Claim {
        let worst = self
            .claims
            .iter()
            .max_by(|a, b| a.deviations().total_cmp(&b.deviations()));
        worst.expect("a group has claims")
    }
}

/// Prints the errors of random seed and dithered bisection at equal effort; returns the bars that are missed.
///
/// These are the closed forms; the groups above check them against simulation.
fn compare_errors() -> Vec<String> {
    println!("rms error over changes uniform on the light");
    println!(
        "{:34} {:>15} {:>15} {:>15}",
        "", "random seed", "dithered", "ratio (bar)"
    );
    let mut missed = Vec::new();
    let comparisons = [
        ("four tests", Stop::Tests(4), Some(1.35)),
        ("four tests, never five", Stop::Budget(4), None),
        ("tolerance 0.05", Stop::Tolerance(0.05), Some(1.12)),
        ("tolerance 0.25", Stop::Tolerance(0.25), None),
        ("tolerance 0.005", Stop::Tolerance(0.005), None),
    ];
    for (name, stop, bar) in comparisons {
        let rms = |method| average_mean_square_error(method, stop).sqrt();
        let show = |method| format!("{:.5} ({:.2})", rms(method), average_tests(method, stop));
        let ratio = rms(Method::RandomSeed) / rms(Method::Dithered);
        let shown = bar.map_or_else(String::new, |bar: f64| format!(" ({bar})"));
        // Another test halves the error of either.
        let more = average_tests(Method::RandomSeed, stop) - average_tests(Method::Dithered, stop);
        println!(
            "{name:24} {:>15} {:>15} {:>14} {:14.3}",
            show(Method::RandomSeed),
            show(Method::Dithered),
            format!("{ratio:.3}{shown}"),
            ratio * more.exp2()
        );
        if bar.is_some_and(|bar| ratio < bar) {
            missed.push(format!(
                "{name}: dithered bisection is only {ratio:.3} times better"
            ));
        }
    }
    println!("(in brackets: tests on average; equal tests: the ratio if each made as many)");
    missed
}
