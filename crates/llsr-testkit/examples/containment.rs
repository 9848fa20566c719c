//! Containment trials of every interval operation: `containment [TRIALS]`, one million by default.

use std::process::ExitCode;

use llsr_testkit::intervals::{OPERATIONS, containment};

fn main() -> ExitCode {
    let trials = std::env::args()
        .nth(1)
        .map_or(Ok(1_000_000), |text| text.parse::<u64>());
    let Ok(trials) = trials else {
        eprintln!("the number of trials is not a whole number");
        return ExitCode::from(2);
    };
    let mut escaped = false;
    for operation in OPERATIONS {
        match containment(operation, trials) {
            Ok(()) => println!("{operation:?}: {trials} trials in f32 and in f64, none escaped"),
            Err(failure) => {
                escaped = true;
                println!("{operation:?}: trial {}: {}", failure.trial, failure.message);
            }
        }
    }
    ExitCode::from(u8::from(escaped))
}
