//! The host side of `gmhm`: recordings in, models out.
//!
//! Data flows one way: [`recording`] → [`signal`] → [`fit`] / [`diagnose`] → [`model`] file → parameter block → drive.
//! Every equation of the gear is evaluated by the core crate [`gmhm`] in `f64`; nothing here writes one again.
#![forbid(unsafe_code)]

pub mod adapt;
pub mod baselines;
pub mod bench;
pub mod block;
pub mod cli;
pub mod demo;
pub mod device;
pub mod diagnose;
pub mod export;
pub mod failure;
pub mod fit;
pub mod fleet;
pub mod health;
pub mod jobs;
pub mod kinds;
pub mod model;
pub mod number;
pub mod numerics;
pub mod output;
pub mod physics;
pub mod progress;
pub mod prove;
pub mod recording;
pub mod regression;
pub mod report;
pub mod signal;
pub mod text_table;
