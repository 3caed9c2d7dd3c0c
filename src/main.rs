//! The `pointillist` command.

fn main() {}
