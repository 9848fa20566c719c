//! Tests of the public interface.

mod choice;
mod filter;
mod frame;
mod reprojection;
mod scene;
mod store;
