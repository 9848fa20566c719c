//! One module a command.

pub(crate) mod bench;
pub(crate) mod demo;
pub(crate) mod diff;
pub(crate) mod edges;
pub(crate) mod info;
pub(crate) mod render;
pub(crate) mod view;
pub(crate) mod walk;
