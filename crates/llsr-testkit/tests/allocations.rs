//! The counting allocator counts what a thread asks for, and nothing of what others do.

use std::hint::black_box;
use std::sync::Barrier;
use std::thread;

use llsr_testkit::allocations::{Counting, Made, count};

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn every_request_of_this_thread_counts() {
    let (mut vector, made) = count(|| black_box(Vec::<u8>::with_capacity(100)));
    let one = Made {
        allocations: 1,
        bytes: 100,
    };
    assert_eq!(made, one, "one vector");
    let ((), made) = count(|| vector.reserve_exact(300));
    assert_eq!((made.allocations, made.bytes), (1, 300), "it grows");
    let (zeroed, made) = count(|| black_box(vec![0u64; 16]));
    assert_eq!(made.bytes, 128, "zeroed");
    let ((), made) = count(|| drop(zeroed));
    assert_eq!(made, Made::default(), "giving back is not asking");
}

#[test]
fn other_threads_do_not_count() {
    let (began, ended) = (Barrier::new(2), Barrier::new(2));
    thread::scope(|scope| {
        scope.spawn(|| {
            began.wait();
            for size in 1..1000 {
                drop(black_box(vec![1u8; size]));
            }
            ended.wait();
        });
        let ((), made) = count(|| {
            began.wait();
            ended.wait();
        });
        assert_eq!(made, Made::default(), "nothing was asked for here");
    });
}
