//! The host side of `gmhm`: recordings in, models out.
//!
//! Data flows one way: [`recording`] → [`estimate`] / [`discover`] → [`model`] file → parameter block → drive.
//! Every equation of the gear is evaluated by the core crate [`gmhm`] in `f64`; nothing here writes one again.
#![forbid(unsafe_code)]

pub mod bench;
pub mod block;
pub mod cli;
pub mod demo;
pub mod device;
pub mod diagnosis;
pub mod discover;
pub mod estimate;
pub mod health;
pub mod model;
pub mod output;
pub mod physics;
pub mod prove;
pub mod recording;
pub mod report;
