//! Zero of the torque sensor that moves with temperature.
//!
//! T += κ (Θ − Θ_0).

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("nm_per_k", "N·m/K", "κ").within(-0.5, 0.5);
const REFERENCE: KeyInfo = KeyInfo::shape("reference_c", "°C", "Θ_0").decided().within(0.0, 60.0);

/// A torque proportional to the temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalZeroDrift<S> {
    gain: S,
    reference: S,
}

impl<S: Float> Physics<S> for ThermalZeroDrift<S> {
    const INFO: KindInfo = KindInfo {
        name: "thermal_zero_drift",
        side: Side::Instrument,
        domain: Domain::Torque,
        equation: "T += κ (Θ − Θ_0)",
        coordinates: &[Coordinate::Temperature],
        needs: &[Need::Temperature],
        keys: &[GAIN, REFERENCE],
        hides_behind: "sensor_drift",
        instructions: 105,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self { gain: reader.number(&GAIN)?, reference: reader.number(&REFERENCE)? })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.gain * (sample.temperature - self.reference)
    }
}
