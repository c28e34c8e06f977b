//! The `radiosity` command.
fn main() {}
