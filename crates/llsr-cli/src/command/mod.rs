//! One module a command.

pub(crate) mod demo;
pub(crate) mod diff;
pub(crate) mod info;
pub(crate) mod render;
