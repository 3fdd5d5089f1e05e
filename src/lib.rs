//! Hysteresis torque of a harmonic drive, and its inverse, from the genetic-memory hysteresis model (GMHM).
//!
//! A harmonic drive transmits the torque T = f(θ) + z at the torsional deflection θ = q_m/N − q_o: an elastic part f and a
//! hysteresis torque z that remembers the path. This crate computes both, sample by sample, on the drive's microcontroller:
//! no allocator, no panic in the hot path, in `f32`, `f64` or [fixed point].
//!
//! | module | what |
//! |---|---|
//! | [`params`] | parameters in SI units, checked once |
//! | [`elastic`] | f(θ) |
//! | [`memory`] | the laws `masing`, `phase` and `time`, and the paper's closed form |
//! | [`gear`] | both together: parameters and state apart, one call a sample |
//! | [`inverse`] | from torque to deflection |
//! | [`feedforward`] | what a joint controller adds: offset of the motor, hysteresis torque; gain, limits, start |
//! | [`adapt`] | the coefficients follow the gear on the drive, bounded and reversible |
//! | [`terms`] | physics beyond the base model: friction, ripple, backlash, creep, … |
//! | [`block`] | parameter blocks: what a drive keeps of a model file |
//! | [`store`] | two slots in flash for blocks: one is whole at any moment |
//! | [`link`] | the serial port: read, try, store, go back |
//! | [`diagnostics`] | latched counters of what went wrong |
//! | [`drive`] | the control tick over encoders and a torque command, by `embedded-hal` |
//! | [`registry`] | names, units, ranges and words of all parameters |
//! | [`scalar`] | the operations the model asks of a number |
//!
//! # Features
//!
//! | feature | adds | needs |
//! |---|---|---|
//! | none | laws, inverse, feed-forward, servo | `libm`, `heapless` |
//! | `fixed` | fixed point | `fixed` |
//! | `adapt` | [`adapt`] | |
//! | `terms` | [`terms`], [`registry`] | |
//! | `block` | [`block`], `terms`, `fixed` | |
//! | `store` | [`store`], `block` | `embedded-storage` |
//! | `link` | [`link`], `drive::lockstep`, `store` | `cobs` |
//! | `lock` | access by key in [`link`] | `hmac`, `sha2` |
//! | `drive` | drivers in [`drive`] | `embedded-hal` |
//! | `full` | all of these | |
//! | `serde` | plain types written and read | `serde` |
//! | `defmt` | logs, plain types as their arguments | `defmt` |
//!
//! ```
//! use gmhm::{Elastic, Gear, Memory, Params};
//!
//! // The published gear: rated at 1.168 mrad.
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let params = Params::new(1.168e-3, elastic, memory)?;
//!
//! let gear = Gear::<f32>::new(&params);
//! let mut state = gear.start::<16>(0.0);
//! for k in 0..=100 {
//!     gear.step(&mut state, 1.168e-3 * k as f32 / 100.0); // load to the rated deflection
//! }
//! let out = gear.step(&mut state, 0.143e-3); // and back
//! assert!((out.torque - -0.16).abs() < 0.01); // the published unloading branch, N·m
//! # Ok::<(), gmhm::ParamError>(())
//! ```
//!
// Where a feature is off, what it adds is named and leads to the table of the features.
#![cfg_attr(feature = "fixed", doc = "[fixed point]: scalar::fixed")]
#![cfg_attr(not(feature = "fixed"), doc = "[fixed point]: #features")]
#![cfg_attr(not(feature = "adapt"), doc = "[`adapt`]: #features")]
#![cfg_attr(not(feature = "terms"), doc = "[`terms`]: #features\n[`registry`]: #features")]
#![cfg_attr(not(feature = "block"), doc = "[`block`]: #features")]
#![cfg_attr(not(feature = "store"), doc = "[`store`]: #features")]
#![cfg_attr(not(feature = "link"), doc = "[`link`]: #features")]
#![no_std]
// One instruction of the cores with a floating-point unit is not to be had otherwise: `scalar::float` allows it there.
#![cfg_attr(not(any(all(target_arch = "arm", target_abi = "eabihf"), riscv_float_unit)), forbid(unsafe_code))]
#![warn(clippy::must_use_candidate)]
#![deny(unsafe_code)]

#[cfg(feature = "adapt")]
pub mod adapt;
#[cfg(feature = "block")]
pub mod block;
pub mod diagnostics;
pub mod drive;
pub mod elastic;
pub mod feedforward;
pub mod gear;
pub mod inverse;
#[cfg(feature = "link")]
pub mod link;
pub mod memory;
pub mod params;
#[cfg(feature = "terms")]
pub mod registry;
pub mod scalar;
mod sealed;
#[cfg(feature = "store")]
pub mod store;
#[cfg(feature = "terms")]
pub mod terms;

pub use elastic::Elastic;
pub use gear::{Gear, Output, State, Status};
pub use inverse::{Inverse, InverseError, Solution};
pub use memory::closed_form;
pub use params::{Gate, Kernel, Law, Memory, ParamError, Params};

/// The README's code is compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
