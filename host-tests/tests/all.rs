//! Every test of behaviour, a module for each subject, in one program: it is linked once, and its tests share the processors to the end.
//!
//! `cargo test --package gmhm-host-tests --test all SUBJECT` runs one subject.

mod adapt;
mod adapt_long;
mod adapt_recursion;
mod adapt_sealed;
mod bad_input;
mod bits;
mod block;
mod block_fuzz;
mod bumpless;
mod change_faults;
mod closed_form;
mod common;
mod control_faults;
mod drive;
mod feedforward;
mod fixed;
mod golden;
mod inverse;
mod largest_step;
mod link;
mod link_bound;
mod link_line;
mod link_plausible;
mod lock;
mod lockstep;
mod objects;
mod outliers;
mod pages;
mod param_ranges;
mod paths;
mod power_cut;
mod prepared;
mod properties;
mod read_faults;
mod servo_terms;
mod stored_gate;
mod stored_servo;
mod tangent;
mod terms;
mod terms_feedforward;
mod terms_reference;
