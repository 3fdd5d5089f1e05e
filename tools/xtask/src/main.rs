//! `cargo xtask`: set-up, tests, emulator runs and tables.

fn main() {}
