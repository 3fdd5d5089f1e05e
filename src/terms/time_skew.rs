//! Time skew: the torque is recorded later (or earlier) than the angles.
//!
//! T_measured(t) = T(t − δ), T linear between samples and constant beyond them. A fault of the measurement, so it concerns whole recordings only and
//! does nothing in a drive's control tick.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Side};
use crate::scalar::Float;

const DELAY: KeyInfo = KeyInfo::shape("delay_s", "s", "δ, by which the torque comes late").within(-0.02, 0.02);

/// A delay of the whole torque.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSkew<S>(S);

impl<S: Float> Physics<S> for TimeSkew<S> {
    const INFO: KindInfo = KindInfo {
        name: "time_skew",
        side: Side::Instrument,
        domain: Domain::Delay,
        equation: "T_measured(t) = T(t − δ)",
        coordinates: &[Coordinate::TorqueRate],
        needs: &[],
        keys: &[DELAY],
        hides_behind: "viscous_damping, anti-alias lag",
        instructions: 100,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        reader.number(&DELAY).map(Self)
    }

    fn delay(&self) -> S {
        self.0
    }
}

/// A signal read at other times than it was sampled at. Times to be asked for in a row are found fastest in order.
#[derive(Debug, Clone)]
pub struct Resampled<'a, S> {
    time: &'a [S],
    values: &'a [S],
    near: usize,
}

impl<'a, S: Float> Resampled<'a, S> {
    /// A signal of samples at increasing times.
    #[must_use]
    pub fn new(time: &'a [S], values: &'a [S]) -> Self {
        Self { time, values, near: 0 }
    }

    /// The signal at a time, linear between samples, the first or last value beyond them; 0 without samples.
    pub fn at(&mut self, time: S) -> S {
        let row = |k: usize| Some((*self.time.get(k)?, *self.values.get(k)?));
        while self.near > 0 && row(self.near).is_some_and(|(t, _)| t > time) {
            self.near -= 1;
        }
        while row(self.near + 1).is_some_and(|(t, _)| t <= time) {
            self.near += 1;
        }
        let Some((t, value)) = row(self.near) else { return S::ZERO };
        match row(self.near + 1) {
            Some((next_t, next)) if time > t => value + (next - value) * (time - t).over(next_t - t),
            _ => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_read_between_and_beyond_its_samples() {
        let (time, values) = ([0.0, 1.0, 3.0], [10.0, 20.0, 0.0]);
        let mut signal = Resampled::new(&time, &values);
        let read = [-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0, 0.25, f64::NAN].map(|t| signal.at(t));
        assert_eq!(read[..8], [10.0, 10.0, 15.0, 20.0, 10.0, 0.0, 0.0, 12.5]);
        assert_eq!(Resampled::<f32>::new(&[], &[]).at(1.0), 0.0);
    }
}
