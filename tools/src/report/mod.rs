//! Plots.

pub mod figures;
pub mod plot;
