//! Random seed bisection and its relatives: bracket a visibility change with few tests.
