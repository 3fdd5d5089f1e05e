//! Inertia between the torque's place and the load.
//!
//! T += σ J v̇.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("inertia_kgm2", "kg·m²", "J").within(0.0, 100.0);

/// A torque proportional to the acceleration.
#[derive(Debug, Clone, PartialEq)]
pub struct Inertia<S>(S);

impl<S: Float> Physics<S> for Inertia<S> {
    const INFO: KindInfo = KindInfo {
        name: "inertia",
        side: Side::Plant,
        domain: Domain::Load,
        equation: "T += σ J v̇",
        coordinates: &[Coordinate::Acceleration],
        needs: &[Need::Acceleration],
        keys: &[GAIN],
        hides_behind: "c1 at one rate",
        instructions: 103,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(reader.setting.sigma * reader.number(&GAIN)?))
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0 * sample.acceleration
    }
}
