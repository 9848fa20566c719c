//! The exact result of every operation lies in the computed interval.

use llsr_testkit::intervals::{OPERATIONS, containment};

#[test]
fn no_exact_result_escapes() {
    for operation in OPERATIONS {
        let outcome = containment(operation, 20_000);
        assert!(outcome.is_ok(), "{outcome:?}");
    }
}
