//! Viscous friction of bearings and lubricant.
//!
//! T += σ B v.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("damping_nms_per_rad", "N·m·s/rad", "B").within(0.0, 500.0);

/// A torque against the movement, proportional to the velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscousFriction<S>(S);

impl<S: Float> Physics<S> for ViscousFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "viscous_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ B v",
        coordinates: &[Coordinate::OutputVelocity],
        needs: &[Need::Velocity],
        keys: &[GAIN],
        hides_behind: "viscous_damping when the input is locked (v = −θ̇)",
        instructions: 146,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(reader.setting.sigma * reader.number(&GAIN)?))
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0 * sample.velocity
    }
}
