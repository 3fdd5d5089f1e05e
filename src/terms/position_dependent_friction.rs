//! Friction that changes over the turn of the motor or of the output.
//!
//! T += σ Σ F_k cos(k q + φ_k) sgn v, written as (Σ c_k cos(k q) + s_k sin(k q)) sgn v; sgn v smoothed as tanh(v/smoothing).

use super::coulomb_friction::SMOOTHING;
use super::harmonics::{Harmonics, MOST_ORDERS};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, Sense};
use crate::scalar::Float;

const ANGLE: KeyInfo = KeyInfo::choice("angle", &["motor", "output"], "q: which angle it turns with");
const ORDERS: KeyInfo =
    KeyInfo::shape_list("orders", "1", MOST_ORDERS, "orders k of the turn").positive().decided().within(0.5, 128.0);
const COS: KeyInfo =
    KeyInfo::linear_list("cos_nm", "N·m", MOST_ORDERS, "coefficients of cos(k q) sgn v").within(-10.0, 10.0);
const SIN: KeyInfo =
    KeyInfo::linear_list("sin_nm", "N·m", MOST_ORDERS, "coefficients of sin(k q) sgn v").within(-10.0, 10.0);

/// A series of an angle against the movement.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionDependentFriction<S> {
    of_output: bool,
    series: Harmonics<S>,
    sense: Sense<S>,
}

impl<S: Float> Physics<S> for PositionDependentFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "position_dependent_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ Σ F_k cos(k q + φ_k) sgn v",
        coordinates: &[Coordinate::MotorAngle, Coordinate::OutputAngle],
        needs: &[Need::Velocity],
        keys: &[ANGLE, ORDERS, COS, SIN, SMOOTHING],
        hides_behind: "kinematic_error (which does not flip with sgn v)",
        instructions: 373,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self {
            of_output: reader.choice(&ANGLE)? == 1,
            series: Harmonics::read(reader, &ORDERS, &COS, &SIN, reader.setting.sigma)?,
            sense: Sense::new(reader.number(&SMOOTHING)?),
        })
    }

    fn needs_besides(&self) -> &'static [Need] {
        if self.of_output { &[Need::OutputAngle] } else { &[Need::MotorAngle] }
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let angle = if self.of_output { sample.output_angle } else { sample.motor_angle };
        self.series.at(angle) * self.sense.of(sample.velocity)
    }
}
