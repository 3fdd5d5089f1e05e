//! Coulomb friction, smoothed about standstill.
//!
//! T += σ F_c tanh(v/v_s); the sign of v where v_s = 0.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, Sense};
use crate::scalar::Float;

const TORQUE: KeyInfo = KeyInfo::linear("torque_nm", "N·m", "F_c").within(0.0, 50.0);
pub(super) const SMOOTHING: KeyInfo =
    KeyInfo::shape("smoothing_rad_per_s", "rad/s", "v_s of tanh(v/v_s), 0 for the sign itself")
        .at_least_zero()
        .optional()
        .within(1e-4, 0.5);

/// A constant torque against the movement.
#[derive(Debug, Clone, PartialEq)]
pub struct CoulombFriction<S> {
    torque: S,
    sense: Sense<S>,
}

impl<S: Float> Physics<S> for CoulombFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "coulomb_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ F_c tanh(v/v_s)",
        coordinates: &[Coordinate::OutputVelocity],
        needs: &[Need::Velocity],
        keys: &[TORQUE, SMOOTHING],
        hides_behind: "h, on one amplitude",
        instructions: 215,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let torque = reader.setting.sigma * reader.number(&TORQUE)?;
        Ok(Self { torque, sense: Sense::new(reader.number(&SMOOTHING)?) })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.torque * self.sense.of(sample.velocity)
    }
}
