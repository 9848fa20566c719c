//! Tests of the public interface.

mod common;
mod flip;
mod measures;
