//! The control tick of one joint.

use core::fmt;

use super::pair::{EncoderPair, FromCounts, Reading};
use super::{Encoder, TorqueSink};

/// A joint: encoders on motor and output, and what makes the torque.
///
/// Call [`tick`](Self::tick) from the timer interrupt of the control loop.
#[derive(Debug)]
pub struct Joint<M, O, T, S: FromCounts> {
    motor: M,
    output: O,
    sink: T,
    pair: EncoderPair<S>,
    last: Option<Reading<S>>,
}

/// What failed in a tick. The torque was released; the next tick tries again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Fault<M, O, T> {
    /// The motor's encoder.
    Motor(M),
    /// The output's encoder.
    Output(O),
    /// The way to the power stage.
    Sink(T),
}

impl<M: fmt::Debug, O: fmt::Debug, T: fmt::Debug> fmt::Display for Fault<M, O, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Motor(error) => write!(f, "motor encoder: {error:?}"),
            Self::Output(error) => write!(f, "output encoder: {error:?}"),
            Self::Sink(error) => write!(f, "torque command: {error:?}"),
        }
    }
}

impl<M: fmt::Debug, O: fmt::Debug, T: fmt::Debug> core::error::Error for Fault<M, O, T> {}

/// What a tick comes to.
pub type TickResult<M, O, T, S> =
    Result<Reading<S>, Fault<<M as Encoder>::Error, <O as Encoder>::Error, <T as TorqueSink<S>>::Error>>;

impl<M: Encoder, O: Encoder, T: TorqueSink<S>, S: FromCounts> Joint<M, O, T, S> {
    /// A joint whose encoders have not been read yet.
    #[must_use]
    pub const fn new(motor: M, output: O, sink: T, pair: EncoderPair<S>) -> Self {
        Self { motor, output, sink, pair, last: None }
    }

    /// One control period: reads both encoders, asks `control` for a torque and hands it on.
    ///
    /// The first tick, and the first after a fault, finds the motor's turn anew from the output's absolute angle, so that a reading missed at
    /// speed costs no turn.
    ///
    /// # Errors
    /// [`Fault`]: `control` was not asked, or its torque did not arrive; the torque was released where that was possible.
    #[inline]
    pub fn tick(&mut self, control: impl FnOnce(&Reading<S>) -> S) -> TickResult<M, O, T, S> {
        let result = self.read().and_then(|reading| {
            self.sink.set_torque(control(&reading)).map_err(Fault::Sink)?;
            Ok(reading)
        });
        self.last = result.as_ref().ok().copied();
        if self.last.is_none() {
            // A sink that fails here has nothing more to be asked.
            let _ = self.sink.release();
        }
        result
    }

    /// No torque until the next tick.
    ///
    /// # Errors
    /// The command did not arrive.
    pub fn release(&mut self) -> Result<(), T::Error> {
        self.sink.release()
    }

    /// The encoders' common measure.
    #[must_use]
    pub const fn pair(&self) -> &EncoderPair<S> {
        &self.pair
    }

    #[inline]
    fn read(&mut self) -> TickResult<M, O, T, S> {
        let motor = self.motor.counts().map_err(Fault::Motor)?;
        let output = self.output.counts().map_err(Fault::Output)?;
        Ok(match &self.last {
            Some(last) => self.pair.follow(last, motor, output),
            None => self.pair.start(motor, output),
        })
    }
}
