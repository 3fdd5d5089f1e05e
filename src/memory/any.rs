//! Whichever law the parameters name.

use super::masing::{LoopPath, Masing, Path};
use super::phase::{Phase, PhaseState};
use super::time::{Time, TimeState};
use super::{Frame, MemoryLaw, VaryingPeriod};
use crate::params::{Law, Params};
use crate::scalar::{Float, Scalar};

/// A law chosen at run time. Where the law is known at build time, [`Masing`], [`Phase`] or [`Time`] cost less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AnyLaw<S: Scalar> {
    /// Law `masing`.
    Masing(Masing<S>),
    /// Law `phase`.
    Phase(Phase<S>),
    /// Law `time`.
    Time(Time<S>),
}

/// The state of [`AnyLaw`].
#[derive(Debug, Clone)]
pub enum AnyMemory<S: Scalar, const N: usize> {
    /// Law `masing`.
    Masing(Path<S, N>),
    /// Law `phase`.
    Phase(PhaseState<S>),
    /// Law `time`.
    Time(TimeState<S>),
}

impl<S: Scalar> AnyLaw<S> {
    /// The law that the parameters name; law `time` at the sample period Δ (s).
    #[must_use]
    pub fn new(params: &Params, period_s: f64) -> Self {
        match params.memory().law {
            Law::Masing => Self::Masing(Masing::new(params)),
            Law::Phase => Self::Phase(Phase::new(params)),
            Law::Time => Self::Time(Time::new(params, period_s)),
        }
    }
}

/// Calls the same method of whichever law, with its own state. A state of another law is left alone and answers `$otherwise`.
macro_rules! dispatch {
    ($law:expr, $state:expr, $otherwise:expr, |$l:ident, $s:ident| $call:expr) => {
        match ($law, $state) {
            (AnyLaw::Masing($l), AnyMemory::Masing($s)) => $call,
            (AnyLaw::Phase($l), AnyMemory::Phase($s)) => $call,
            (AnyLaw::Time($l), AnyMemory::Time($s)) => $call,
            _ => $otherwise,
        }
    };
}

impl<S: Float> MemoryLaw<S> for AnyLaw<S> {
    type State<const N: usize> = AnyMemory<S, N>;

    fn start<const N: usize>(&self, frame: &Frame<S>, theta: S) -> AnyMemory<S, N> {
        match self {
            Self::Masing(law) => AnyMemory::Masing(law.start(frame, theta)),
            Self::Phase(law) => AnyMemory::Phase(law.start::<N>(frame, theta)),
            Self::Time(law) => AnyMemory::Time(law.start::<N>(frame, theta)),
        }
    }

    #[inline]
    fn step<const N: usize>(&self, frame: &Frame<S>, state: &mut AnyMemory<S, N>, theta: S) {
        dispatch!(self, state, (), |law, state| law.step::<N>(frame, state, theta));
    }

    #[inline]
    fn fast_path<const N: usize>(&self, frame: &Frame<S>, state: &mut AnyMemory<S, N>, theta: S) -> bool {
        dispatch!(self, state, false, |law, state| law.fast_path::<N>(frame, state, theta))
    }

    #[inline]
    fn torque<const N: usize>(&self, frame: &Frame<S>, state: &AnyMemory<S, N>, theta: S) -> S {
        dispatch!(self, state, S::ZERO, |law, state| law.torque::<N>(frame, state, theta))
    }

    fn single_valued(&self, frame: &Frame<S>, theta: S) -> S {
        match self {
            Self::Masing(law) => law.single_valued(frame, theta),
            Self::Phase(law) => law.single_valued(frame, theta),
            Self::Time(law) => law.single_valued(frame, theta),
        }
    }

    fn start_spread<const N: usize>(&self, frame: &Frame<S>, state: &AnyMemory<S, N>, theta: S) -> S {
        dispatch!(self, state, S::ZERO, |law, state| law.start_spread::<N>(frame, state, theta))
    }

    fn start_uncertainty<const N: usize>(&self, frame: &Frame<S>, state: &AnyMemory<S, N>, theta: S) -> S {
        dispatch!(self, state, S::ZERO, |law, state| law.start_uncertainty::<N>(frame, state, theta))
    }

    fn largest_spread(&self, frame: &Frame<S>) -> S {
        match self {
            Self::Masing(law) => law.largest_spread(frame),
            Self::Phase(law) => law.largest_spread(frame),
            Self::Time(law) => law.largest_spread(frame),
        }
    }

    fn restart<const N: usize>(&self, frame: &Frame<S>, state: &mut AnyMemory<S, N>, theta: S) {
        dispatch!(self, state, (), |law, state| law.restart::<N>(frame, state, theta));
    }

    fn take_over<const N: usize>(
        &self,
        frame: &Frame<S>,
        (law, old_frame): (&Self, &Frame<S>),
        state: &AnyMemory<S, N>,
        theta: S,
    ) -> AnyMemory<S, N> {
        match (self, law, state) {
            (Self::Masing(new), Self::Masing(old), AnyMemory::Masing(state)) => {
                AnyMemory::Masing(new.take_over(frame, (old, old_frame), state, theta))
            }
            (Self::Phase(new), Self::Phase(old), AnyMemory::Phase(state)) => {
                AnyMemory::Phase(new.take_over::<N>(frame, (old, old_frame), state, theta))
            }
            (Self::Time(new), Self::Time(old), AnyMemory::Time(state)) => {
                AnyMemory::Time(new.take_over::<N>(frame, (old, old_frame), state, theta))
            }
            // What another law remembers says nothing here.
            _ => self.start(frame, theta),
        }
    }

    fn has_period(&self) -> bool {
        if let Self::Time(law) = self { law.has_period() } else { true }
    }

    fn knows_time(&self) -> bool {
        matches!(self, Self::Time(_))
    }

    fn merged_pairs<const N: usize>(&self, state: &AnyMemory<S, N>) -> u32 {
        dispatch!(self, state, 0, |law, state| law.merged_pairs::<N>(state))
    }
}

impl<S: Float> LoopPath<S> for AnyLaw<S> {
    #[inline]
    fn path<const N: usize>(memory: &AnyMemory<S, N>) -> Option<&Path<S, N>> {
        if let AnyMemory::Masing(path) = memory { Some(path) } else { None }
    }
}

impl<S: Float> VaryingPeriod<S> for AnyLaw<S> {
    #[inline]
    fn step_after<const N: usize>(&self, frame: &Frame<S>, state: &mut AnyMemory<S, N>, theta: S, period_s: S) {
        match (self, state) {
            (Self::Time(law), AnyMemory::Time(state)) => law.step_after::<N>(frame, state, theta, period_s),
            (law, state) => law.step(frame, state, theta),
        }
    }

    fn peek_after<const N: usize>(&self, frame: &Frame<S>, state: &AnyMemory<S, N>, theta: S, period_s: S) -> S {
        dispatch!(self, state, S::ZERO, |law, state| law.peek_after::<N>(frame, state, theta, period_s))
    }
}
