//! Hysteresis torque of a harmonic drive and its inverse, from the genetic-memory hysteresis model (GMHM).
#![no_std]

pub mod params;

pub use params::{Elastic, Gate, Kernel, Law, Memory, ParamError, Params};
