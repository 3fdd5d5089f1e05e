//! Stribeck friction: more of it near standstill.
//!
//! T += σ {[F_c + (F_s − F_c) e^(−abs(v/v_s)^δ)] sgn v + B v}, sgn v smoothed as tanh(v/smoothing).

use super::coulomb_friction::SMOOTHING;
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, Sense};
use crate::scalar::Float;

const COULOMB: KeyInfo = KeyInfo::linear("coulomb_nm", "N·m", "F_c, far from standstill").within(0.0, 50.0);
const STATIC: KeyInfo = KeyInfo::linear("static_nm", "N·m", "F_s, at standstill").within(0.0, 100.0);
const VELOCITY: KeyInfo = KeyInfo::shape("stribeck_velocity_rad_per_s", "rad/s", "v_s").positive().within(1e-3, 1.0);
const EXPONENT: KeyInfo = KeyInfo::shape("exponent", "1", "δ").positive().within(0.5, 3.0);
const DAMPING: KeyInfo = KeyInfo::linear("damping_nms_per_rad", "N·m·s/rad", "B").optional().within(0.0, 500.0);

/// Friction that falls off with the velocity before it grows.
#[derive(Debug, Clone, PartialEq)]
pub struct StribeckFriction<S> {
    coulomb: S,
    excess: S,
    inverse_velocity: S,
    exponent: S,
    damping: S,
    sense: Sense<S>,
}

impl<S: Float> Physics<S> for StribeckFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "stribeck_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ {[F_c + (F_s − F_c) e^(−abs(v/v_s)^δ)] sgn v + B v}",
        coordinates: &[Coordinate::OutputVelocity],
        needs: &[Need::Velocity],
        keys: &[COULOMB, STATIC, VELOCITY, EXPONENT, DAMPING, SMOOTHING],
        hides_behind: "",
        instructions: 516,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let sigma = reader.setting.sigma;
        let coulomb = reader.number(&COULOMB)?;
        Ok(Self {
            coulomb: sigma * coulomb,
            excess: sigma * (reader.number(&STATIC)? - coulomb),
            inverse_velocity: reader.number(&VELOCITY)?.recip(),
            exponent: reader.number(&EXPONENT)?,
            damping: sigma * reader.number(&DAMPING)?,
            sense: Sense::new(reader.number(&SMOOTHING)?),
        })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let v = sample.velocity;
        let fall = (-(v * self.inverse_velocity).abs().powf(self.exponent)).exp();
        (self.coulomb + self.excess * fall) * self.sense.of(v) + self.damping * v
    }
}
