//! Friction that falls with temperature, as the lubricant thins.
//!
//! All friction terms × e^(−κ(Θ − Θ_0)).

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::shape("per_k", "1/K", "κ").within(0.0, 0.1);
const REFERENCE: KeyInfo = KeyInfo::shape("reference_c", "°C", "Θ_0").decided().within(0.0, 60.0);

/// A factor on all friction.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalFriction<S> {
    gain: S,
    reference: S,
}

impl<S: Float> Physics<S> for ThermalFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "thermal_friction",
        side: Side::Plant,
        domain: Domain::FrictionScale,
        equation: "friction terms × e^(−κ(Θ − Θ_0))",
        coordinates: &[Coordinate::Temperature],
        needs: &[Need::Temperature],
        keys: &[GAIN, REFERENCE],
        hides_behind: "wear",
        instructions: 160,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self { gain: reader.number(&GAIN)?, reference: reader.number(&REFERENCE)? })
    }

    #[inline]
    fn friction_factor(&self, sample: &Sample<S>) -> S {
        (-(self.gain * (sample.temperature - self.reference))).exp()
    }
}
