//! Every test of behaviour, a module for each subject, in one program: it is linked once, and its tests share the processors to the end.
//!
//! `cargo test --package gmhm-tools --test all SUBJECT` runs one subject.

mod adapt;
mod awkward_inputs;
mod baselines;
mod bench_experiments;
mod bench_hide;
mod bench_joint;
mod bench_sensors;
mod book;
mod browser;
mod common;
mod compare;
mod demo;
mod diagnose;
mod diagnose_joint;
mod diagnose_memory;
mod diagnose_plausible;
mod diagnose_shapes;
mod drive;
#[cfg(unix)]
mod drive_live;
mod export_c;
mod exported;
mod fit;
mod fit_gear;
mod fit_invertible;
mod fit_joint;
mod fit_many;
mod fit_report;
mod fit_terms;
mod fit_uncertainty;
mod fit_zeros;
mod flash;
mod flash_probe;
mod fleet;
mod formats;
mod gears;
mod health;
mod help;
#[cfg(unix)]
mod interrupt;
mod invert;
mod model;
mod pack;
mod page;
mod plots;
mod predict;
mod predict_recorded;
#[cfg(unix)]
mod progress;
mod prove;
mod prove_floors;
mod prove_generator;
mod prove_real;
mod prove_score;
mod prove_truth;
mod real_machines;
mod real_recordings;
mod recording;
mod recording_cli;
mod served;
mod simulate;
mod terms_columns;
mod terms_predict;
mod virtual_drive;
