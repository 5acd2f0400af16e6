//! The `passband` command.
fn main() {}
