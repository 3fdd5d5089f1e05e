//! The hysteresis torque z and what it remembers.
//!
//! | law | file | remembers | source |
//! |---|---|---|---|
//! | [`masing`] | turning points | the nested reversals of the deflection | MODEL.md section 3 |
//! | [`phase`] | one number | the memory integral in pseudo-time | MODEL.md section 4 |
//! | [`time`] | one number | the memory integral in real time | MODEL.md section 4 |
//!
//! [`closed_form`] is the paper's own solution on the rated cycle, the yardstick for the three.

mod any;
pub mod closed_form;
mod fast_path;
pub mod frame;
pub mod masing;
pub mod phase;
pub mod time;

pub use any::{AnyLaw, AnyMemory};
pub use frame::Frame;

use crate::scalar::{Float, Scalar};

/// Rated torques: the bound of a memory that never forgets.
const UNKNOWN: f64 = 4.0;

/// A law that can be stepped with a sample period of its own. Laws `masing` and `phase` know no time and ignore it.
pub trait VaryingPeriod<S: Float>: MemoryLaw<S> {
    /// Moves to the next sample, `period_s` ≥ 0 after the last.
    #[inline]
    fn step_after<const N: usize>(&self, frame: &Frame<S>, state: &mut Self::State<N>, theta: S, _period_s: S) {
        self.step(frame, state, theta);
    }

    /// z/T_A at the next sample, `period_s` ≥ 0 after the last, without moving there.
    fn peek_after<const N: usize>(&self, frame: &Frame<S>, state: &Self::State<N>, theta: S, period_s: S) -> S {
        let mut moved = state.clone();
        self.step_after(frame, &mut moved, theta, period_s);
        self.torque(frame, &moved, theta)
    }
}

/// A memory law with its coefficients; its state is apart, so that one set of coefficients serves many gears of a kind.
pub trait MemoryLaw<S: Scalar>: Copy + crate::sealed::Sealed {
    /// What the law remembers, with room for `N` turning points.
    type State<const N: usize>: Clone;

    /// The state of an unknown past at the deflection θ_0: y = 0 or m = 0.
    fn start<const N: usize>(&self, frame: &Frame<S>, theta: S) -> Self::State<N>;

    /// Moves to the next sample. The sample is finite (the gear refuses others).
    fn step<const N: usize>(&self, frame: &Frame<S>, state: &mut Self::State<N>, theta: S);

    /// Moves to a sample within ±A if that takes little, and says so; else leaves the state alone. NaN is not within ±A.
    fn fast_path<const N: usize>(&self, frame: &Frame<S>, state: &mut Self::State<N>, theta: S) -> bool;

    /// z/T_A at the deflection that `state` was last moved to.
    fn torque<const N: usize>(&self, frame: &Frame<S>, state: &Self::State<N>, theta: S) -> S;

    /// The part of z/T_A that does not depend on the past.
    fn single_valued(&self, _frame: &Frame<S>, _theta: S) -> S {
        S::ZERO
    }

    /// Half of what z/T_A may be apart after two pasts before the start that differ. After a sample that is [doubtful](Frame::is_doubtful) the past is unknown again.
    fn start_spread<const N: usize>(&self, frame: &Frame<S>, state: &Self::State<N>, theta: S) -> S;

    /// [`start_spread`](Self::start_spread) of a start at θ = 0, the largest.
    fn largest_spread(&self, frame: &Frame<S>) -> S;

    /// How far z/T_A may be off because the past is unknown: before the start, and before a sample that is [doubtful](Frame::is_doubtful). A bound, wherever z lies between the pasts.
    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &Self::State<N>, theta: S) -> S;

    /// Makes a state that of an unknown past at a deflection, where it is.
    fn restart<const N: usize>(&self, frame: &Frame<S>, state: &mut Self::State<N>, theta: S) {
        *state = self.start(frame, theta);
    }

    /// The memory that a state of this law with other coefficients becomes: the path in input units stays, torques are computed anew.
    fn take_over<const N: usize>(
        &self,
        frame: &Frame<S>,
        before: (&Self, &Frame<S>),
        state: &Self::State<N>,
        theta: S,
    ) -> Self::State<N>;

    /// Whether the law knows the sample period that [`step`](Self::step) needs.
    fn has_period(&self) -> bool {
        true
    }

    /// Whether [`step`](Self::step) depends on the sample period that the law was set up for.
    fn knows_time(&self) -> bool {
        false
    }

    /// Pairs of turning points given up so far because the stack was full.
    fn merged_pairs<const N: usize>(&self, _state: &Self::State<N>) -> u32 {
        0
    }
}
