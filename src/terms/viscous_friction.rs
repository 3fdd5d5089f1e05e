//! Viscous friction of bearings and lubricant.
//!
//! T += σ B abs(v/v_1)^p sgn v · v_1 with v_1 = 1 rad/s: σ B v where p = 1, as it is unless stated. Gears have p of 0.6 to 1.2.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, sign};
use crate::scalar::Float;

const GAIN: KeyInfo =
    KeyInfo::linear("damping_nms_per_rad", "N·m·s/rad", "B, the torque at 1 rad/s over that").within(0.0, 500.0);
const EXPONENT: KeyInfo =
    KeyInfo::shape("exponent", "1", "p, 1 where left out").positive().within(0.6, 1.2).appended(1.0);

/// A torque against the movement, proportional to a power of the velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscousFriction<S> {
    gain: S,
    /// p; `None` for 1.
    exponent: Option<S>,
}

impl<S: Float> Physics<S> for ViscousFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "viscous_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ B abs(v/v_1)^p sgn v · v_1, v_1 = 1 rad/s",
        coordinates: &[Coordinate::OutputVelocity],
        needs: &[Need::Velocity],
        keys: &[GAIN, EXPONENT],
        hides_behind: "viscous_damping when the input is locked (v = −θ̇)",
        instructions: 344,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let gain = reader.setting.sigma * reader.number(&GAIN)?;
        Ok(Self { gain, exponent: Some(reader.number(&EXPONENT)?).filter(|p| *p != S::ONE) })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let v = sample.velocity;
        match self.exponent {
            None => self.gain * v,
            Some(exponent) => self.gain * sign(v) * v.abs().powf(exponent),
        }
    }
}
