//! The joint that all three programs run.
#![no_std]

// The interrupt vectors of the board.
use lm3s6965 as _;

use gmhm::block::{BlockError, Prepared};
use gmhm::feedforward::{Contribution, Controls, Demand, FeedForward, FeedForwardState, Limits};
use gmhm::memory::masing::Masing;

/// A block as `gmhm pack` has written it.
pub const BLOCK: &[u8] = include_bytes!("../../bench/params.bin");

/// Control periods that a program runs for.
pub const PERIODS: u32 = 2000;

/// Parameters in force: plain numbers, computed anywhere.
pub type Feed = FeedForward<f32, Masing<f32>>;

/// The feed-forward of a stored block, at 1 kHz.
///
/// # Errors
/// The block is refused.
pub fn load(block: &[u8]) -> Result<Feed, BlockError> {
    let prepared = Prepared::<f32>::load(block, 16)?;
    let limits = Limits { period_s: 1e-3, ramp_s: 0.5, largest_rate_rad_per_s: 2.0, ..Limits::default() };
    FeedForward::of_inverse(&prepared.inverse, &limits).map_err(|_| BlockError::Firmware(1))
}

/// A joint: its parameters and its past.
pub struct Joint {
    feed: Feed,
    state: FeedForwardState<f32, 16, Masing<f32>>,
}

impl Joint {
    /// A joint whose past is unknown, at rest.
    pub fn new(feed: Feed) -> Self {
        Self { state: feed.start(0.0), feed }
    }

    /// A control period: what to feed forward for a torque reference.
    pub fn period(&mut self, torque: f32) -> Contribution<f32> {
        let controls = Controls { on: true, ..Controls::default() };
        self.feed.step(&mut self.state, &controls, &Demand { torque, deflection: 0.0 })
    }

    /// Other parameters: the contribution goes on from where it is.
    pub fn take_over(&mut self, feed: Feed) {
        feed.take_over(&self.feed, &mut self.state);
        self.feed = feed;
    }
}

/// The torque reference: a triangle of 20 N·m.
pub fn reference(period: u32) -> f32 {
    let phase = period % 1000;
    0.08 * if phase < 500 { phase as f32 - 250.0 } else { 750.0 - phase as f32 }
}
