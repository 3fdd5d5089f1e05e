//! Adaptation on the drive: the coefficients of law `masing` follow the gear, bounded and reversible.
//!
//! Given the path of the deflection, law `masing` is linear in five coefficients (MODEL.md section 3), here normalised by the rated deflection A and the torque scale T_A:
//!
//! ```text
//! τ = x·k        x = [u, u³, u⁵, −u·g(u), η]        k = [c1·A, c2·A³, c3·A⁵, e·A, h·A]/T_A        u = θ/A
//! ```
//!
//! η, the loop shape, follows the path alone. The signal of the torque may be off by a constant, which is learnt as a sixth coefficient that nothing in force uses. So recursive least squares needs the deflection
//! and a torque, measured or estimated, and nothing else. What the coefficients do not change, such as the torque of terms, is taken off the torque before.
//!
//! | part | file | what |
//! |---|---|---|
//! | samples | `samples` | a control period: samples into blocks, blocks into stretches |
//! | supervision | `supervision` | which stretches are fit to be learnt from |
//! | estimate | `estimate` | recursive least squares, square-root form, forgetting by direction |
//! | bounds | `bounds` | what may ever be in force |
//! | trial | `trial` | the shadow beside those in force: sequential test, takeover, return |
//! | health | `health`, `warnings` | delay, offset and drift beyond their uncertainty, latched |
//! | work | `work` | what is done with blocks and stretches: a countdown of pieces, one a period |
//! | rotations | `triangle` | the loops that all of these are made of, each once in flash |
//!
//! **Samples.** One beyond 3σ of the mean residual of the block before gets the weight (3σ/r)², r its distance, one that is not finite 0. σ is that of the samples about that mean.
//!
//! **Blocks** of [`BLOCK_S`] average the samples. **Stretches** of samples end after [`SHORTEST_S`] as soon as the block's torque has moved by [`LEAST_MOTION`] of T_A; one that has not after
//! [`LONGEST_S`] is dropped. So standing still, tiny amplitudes and slow drifts of the signal teach nothing. A stretch's delay is free, so a loop that a delay explains as well as h does is not
//! taken for h. Its level is learnt from last, and shared between the coefficients and the offset by their variances.
//!
//! **Work** is spread: a period takes a sample or does a piece of work. A block takes 8 pieces, a stretch some 210. Periods longer than 1 ms do as many pieces as they have milliseconds, and then take
//! their sample.
//!
//! **Coloured noise.** The variance v of the rows is learnt from their innovations from stretch to stretch, not only from the residuals within one: what the noise does at the pace of the motion, and
//! what the law misses, counts in full. A row is learnt from only where its information is at least [`LEAST_TOLD`] times that of the prior (standard deviation: half the largest change).
//!
//! **What cannot be distinguished.** A torque signal of another scale looks exactly as a gear with all coefficients greater: their common factor is bounded, and beyond 3 % reported as
//! [`Warning::ScaleOrGear`]. An offset that grows is taken for a gear that drifts until it is reported, where the motion does not tell them apart: `docs/adaptation.md` says by how much.
//!
//! **Bounds, takeover, return, false alarms** are stated in their files and measured in `docs/adaptation.md`. Nothing here writes a memory that lasts.
//!
//! Units: rad, N·m. Fixed point is out of scope: a Cortex-M0 has no adaptation.
//!
//! ```
//! use gmhm::adapt::{Adaptation, Change, Settings};
//! use gmhm::memory::masing::Masing;
//! use gmhm::{Elastic, Gear, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let block = Params::new(1.168e-3, elastic, memory)?;
//!
//! let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
//! let mut path = gear.start::<16>(0.0);
//! let adaptation = Adaptation::<f32>::new(&block, &Settings::default())?;
//! let mut adapted = adaptation.start();
//! let mut in_force = block;
//! for k in 0..100_000 {
//!     let deflection = 1.1e-3 * (k as f32 * 5e-3).sin();
//!     let torque = 1.1 * gear.step(&mut path, deflection).torque; // a gear that is a tenth stiffer than its block
//!     if adaptation.period(&mut adapted, &path, torque) == Change::TakenOver {
//!         in_force = adaptation.params(&adapted, &block)?;
//!     }
//! }
//! assert!((in_force.elastic().c1_nm_per_rad / 2.4737e4 - 1.1).abs() < 0.01);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod adaptation;
mod bounds;
mod coefficients;
mod estimate;
mod health;
mod samples;
mod settings;
mod state;
mod supervision;
mod trial;
mod triangle;
mod warnings;
mod work;

pub use adaptation::Adaptation;
pub use coefficients::changed;
pub use settings::{AdaptError, Settings};
pub use state::AdaptationState;
pub use trial::Change;
pub use warnings::{Warning, Warnings};

/// How many coefficients law `masing` is linear in.
pub const COEFFICIENTS: usize = 5;

/// c1·A, c2·A³, c3·A⁵, e·A, h·A over T_A, or changes of them. Within this module they are the other way round: the rows of a stretch are made orthogonal to the last column first, and that of c1 moves most.
pub type Coefficients<S> = [S; COEFFICIENTS];

/// The other way round.
fn reversed<S>([a, b, c, d, e]: Coefficients<S>) -> Coefficients<S> {
    [e, d, c, b, a]
}

/// Seconds of a block.
pub const BLOCK_S: f64 = 0.025;
/// Seconds of samples of a stretch at least.
pub const SHORTEST_S: f64 = 1.0;
/// Seconds of samples after which a stretch that moved too little is dropped.
pub const LONGEST_S: f64 = 20.0;
/// What the block's torque must move by within a stretch: rms about its mean, of T_A. A sine over 14 % of T_A does.
pub const LEAST_MOTION: f64 = 0.05;
/// Information of a row that is learnt from, over that of the prior in its direction, at least.
pub const LEAST_TOLD: f64 = 4.0;
