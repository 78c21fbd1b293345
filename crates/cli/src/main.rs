//! The `specula` command.
fn main() {}
