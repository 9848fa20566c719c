//! The `llsr` command.

fn main() {}
