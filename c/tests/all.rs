//! Every test of the library for C, a module for each subject, in one program.
//!
//! `cargo test --package gmhm-c --test all SUBJECT` runs one subject.

mod common;
mod faults;
mod feed_forward;
mod gate;
mod gear;
mod host;
mod law;
mod link;
mod other_block;
mod outliers;
mod pair;
mod terms;
