//! The `gmhm` program.

fn main() {}
