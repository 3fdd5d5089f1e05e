//! Drift of the torque sensor.
//!
//! T += b t, with t as the recording counts it.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("nm_per_s", "N·m/s", "b").within(-0.1, 0.1);

/// A torque proportional to time.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorDrift<S>(S);

impl<S: Float> Physics<S> for SensorDrift<S> {
    const INFO: KindInfo = KindInfo {
        name: "sensor_drift",
        side: Side::Instrument,
        domain: Domain::Torque,
        equation: "T += b t",
        coordinates: &[Coordinate::Time],
        needs: &[],
        keys: &[GAIN],
        hides_behind: "thermal_zero_drift",
        instructions: 103,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(reader.number(&GAIN)?))
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0 * sample.time
    }
}
