//! Wear: stiffness lost in the course of the recording.
//!
//! T −= ΔK θ s(t), s a step at t_0 (0 before, 1 from then on) or a ramp from t_0 to t_0 + duration.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const SHAPE: KeyInfo = KeyInfo::choice("shape", &["step", "ramp"], "s(t)");
const DROP: KeyInfo =
    KeyInfo::linear("stiffness_drop_nm_per_rad", "N·m/rad", "ΔK, the stiffness lost").within(0.0, 5e3);
const START: KeyInfo = KeyInfo::shape("start_s", "s", "t_0, as the recording counts time").within(0.0, 1e4);
const DURATION: KeyInfo = KeyInfo::shape("duration_s", "s", "how long the ramp rises; a step has none")
    .at_least_zero()
    .optional()
    .within(0.1, 1e4);

/// A spring that gives way in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Wear<S> {
    drop: S,
    start: S,
    /// 1/duration, 0 for a step.
    inverse_duration: S,
}

impl<S: Float> Physics<S> for Wear<S> {
    const INFO: KindInfo = KindInfo {
        name: "wear",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T −= ΔK θ s(t), s a step or a ramp",
        coordinates: &[Coordinate::Time],
        needs: &[Need::Deflection],
        keys: &[SHAPE, DROP, START, DURATION],
        hides_behind: "thermal_stiffness",
        instructions: 123,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let ramp = reader.choice(&SHAPE)? == 1;
        let duration = reader.number(&DURATION)?;
        let inverse = if ramp && duration > S::ZERO { duration.recip() } else { S::ZERO };
        let inverse_duration = if inverse.is_finite() { inverse } else { S::ZERO };
        Ok(Self { drop: reader.number(&DROP)?, start: reader.number(&START)?, inverse_duration })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let since = sample.time - self.start;
        let worn = if self.inverse_duration > S::ZERO {
            (since * self.inverse_duration).clamp(S::ZERO, S::ONE)
        } else if since >= S::ZERO {
            S::ONE
        } else {
            S::ZERO
        };
        -(self.drop * sample.deflection * worn)
    }
}
