//! Latched diagnostics of a joint: what went wrong since they were cleared, and what last.
//!
//! A drive shows each sample's [`Status`], each period's [`Contribution`] and each [`Solution`] of an inverse to its [`Diagnostics`]; a host reads them over the link (feature `link`), or C by
//! `gmhm_get_diagnostics`, and clears them by command. Counters stop at `u32::MAX`.
//!
//! ```
//! use gmhm::diagnostics::{Diagnostics, Fault};
//! # use gmhm::{Elastic, Gear, Params, Memory};
//! # let elastic = Elastic { c1_nm_per_rad: 2.4737e4, ..Elastic::default() };
//! # let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! # let gear = Gear::<f32>::new(&Params::new(1.168e-3, elastic, memory)?);
//! let mut diagnostics = Diagnostics::default();
//! let mut state = gear.start::<16>(0.0);
//! for deflection in [1e-4, f32::NAN, 1.5e-3] {
//!     gear.step(&mut state, deflection);
//!     diagnostics.see_sample(&state.status());
//! }
//! assert_eq!((diagnostics.refused, diagnostics.out_of_range, diagnostics.last), (1, 1, Fault::OutOfRange));
//! # Ok::<(), gmhm::ParamError>(())
//! ```

use crate::feedforward::Contribution;
use crate::gear::Status;
use crate::inverse::Solution;

/// What can go wrong in a control period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
#[repr(u8)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Fault {
    /// Nothing yet.
    #[default]
    None = 0,
    /// Input that is not finite, or absurd.
    Refused = 1,
    /// A deflection beyond the rated one.
    OutOfRange = 2,
    /// A deflection that the gear cannot have reached.
    Quarantined = 3,
    /// A new start where quarantined samples agreed.
    Restarted = 4,
    /// A torque beyond the invertible range.
    Saturated = 5,
    /// Turning points given up for lack of room.
    Merged = 6,
}

impl Fault {
    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The fault of a number.
    #[must_use]
    pub const fn of_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::None,
            1 => Self::Refused,
            2 => Self::OutOfRange,
            3 => Self::Quarantined,
            4 => Self::Restarted,
            5 => Self::Saturated,
            6 => Self::Merged,
            _ => return None,
        })
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Refused => "refused",
            Self::OutOfRange => "out of range",
            Self::Quarantined => "quarantined",
            Self::Restarted => "restarted",
            Self::Saturated => "saturated",
            Self::Merged => "merged",
        }
    }
}

/// The power-on self-test: golden samples of the block, computed anew when it was put in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SelfTest {
    /// No block, or one without samples.
    #[default]
    NotRun = 0,
    /// All samples came out to the bit.
    Passed = 1,
    /// One came out otherwise: the block was refused.
    Failed = 2,
}

impl SelfTest {
    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The result of a number.
    #[must_use]
    pub const fn of_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::NotRun,
            1 => Self::Passed,
            2 => Self::Failed,
            _ => return None,
        })
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotRun => "not run",
            Self::Passed => "passed",
            Self::Failed => "failed",
        }
    }
}

/// Counters since they were cleared, and the last fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Diagnostics {
    /// Samples or demands that were refused.
    pub refused: u32,
    /// Samples beyond the rated deflection.
    pub out_of_range: u32,
    /// Samples that were quarantined.
    pub quarantined: u32,
    /// New starts where quarantined samples agreed.
    pub restarted: u32,
    /// Torques asked for beyond the invertible range.
    pub saturated: u32,
    /// Pairs of turning points given up.
    pub merged_pairs: u32,
    /// The last fault.
    pub last: Fault,
    /// The self-test of the last block.
    pub self_test: SelfTest,
}

impl Diagnostics {
    /// Counts what a sample was.
    pub fn see_sample(&mut self, status: &Status) {
        self.count(status.refused, Fault::Refused);
        self.count(status.out_of_range && !status.refused && !status.quarantined, Fault::OutOfRange);
        self.count(status.quarantined, Fault::Quarantined);
        self.count(status.restarted, Fault::Restarted);
    }

    /// Counts what a period of a feed-forward was, `status` that of [its gear](crate::feedforward::FeedForwardState::gear). A quarantined sample is not counted as a refused one, too.
    pub fn see_contribution<S>(&mut self, contribution: &Contribution<S>, status: &Status) {
        let accepted = !contribution.refused;
        self.count(!accepted && !status.quarantined, Fault::Refused);
        self.count(!accepted && status.quarantined, Fault::Quarantined);
        self.count(accepted && status.out_of_range, Fault::OutOfRange);
        self.count(accepted && status.restarted, Fault::Restarted);
        self.count(accepted && contribution.saturated, Fault::Saturated);
    }

    /// Counts what an [inverse](crate::Inverse) made of a torque.
    pub fn see_solution<S>(&mut self, solution: &Solution<S>) {
        self.count(solution.refused, Fault::Refused);
        self.count(solution.saturated && !solution.refused, Fault::Saturated);
    }

    /// Takes over how many pairs of turning points a state has given up ([`Gear::merged_pairs`](crate::Gear::merged_pairs)), `before` of them earlier.
    pub fn see_merged_pairs(&mut self, before: u32, now: u32) {
        if now > before {
            self.merged_pairs = self.merged_pairs.saturating_add(now - before);
            self.last = Fault::Merged;
        }
    }

    /// Takes over what became of a block that was to be put in force.
    #[cfg(feature = "block")]
    pub fn see_load(&mut self, loaded: Result<SelfTest, &crate::block::BlockError>) {
        match loaded {
            Ok(self_test) => self.self_test = self_test,
            Err(crate::block::BlockError::SelfTest) => self.self_test = SelfTest::Failed,
            Err(_) => {}
        }
    }

    /// Counts from nothing again; the result of the self-test stays.
    pub fn clear(&mut self) {
        *self = Self { self_test: self.self_test, ..Self::default() };
    }

    #[inline]
    fn count(&mut self, happened: bool, fault: Fault) {
        if happened {
            self.count_one(fault);
        }
    }

    #[cold]
    #[inline(never)]
    fn count_one(&mut self, fault: Fault) {
        let counter = match fault {
            Fault::Refused => &mut self.refused,
            Fault::OutOfRange => &mut self.out_of_range,
            Fault::Quarantined => &mut self.quarantined,
            Fault::Restarted => &mut self.restarted,
            Fault::Saturated => &mut self.saturated,
            Fault::None | Fault::Merged => return,
        };
        *counter = counter.saturating_add(1);
        self.last = fault;
    }
}
