//! Stiffness that falls with temperature, about 0.03 % a kelvin.
//!
//! T −= κ c1 θ (Θ − Θ_0), with c1 of the base model.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("per_k", "1/K", "κ").within(0.0, 2e-3);
const REFERENCE: KeyInfo = KeyInfo::shape("reference_c", "°C", "Θ_0").decided().within(0.0, 60.0);

/// A spring that softens as it warms.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalStiffness<S> {
    gain: S,
    reference: S,
}

impl<S: Float> Physics<S> for ThermalStiffness<S> {
    const INFO: KindInfo = KindInfo {
        name: "thermal_stiffness",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T −= κ c1 θ (Θ − Θ_0)",
        coordinates: &[Coordinate::Temperature],
        needs: &[Need::Temperature, Need::Deflection, Need::Gear],
        keys: &[GAIN, REFERENCE],
        hides_behind: "wear",
        instructions: 107,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self { gain: -(reader.number(&GAIN)? * reader.setting.c1), reference: reader.number(&REFERENCE)? })
    }

    fn follows_base(&self) -> bool {
        true
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.gain * sample.deflection * (sample.temperature - self.reference)
    }
}
