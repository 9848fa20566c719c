//! From boxes to the trees that are traversed.

mod binary;
mod repack;
mod wide;

pub(crate) use wide::{ChildRef, STACK, WIDTH, WideNode, WideTree};
