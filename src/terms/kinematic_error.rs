//! Kinematic error: the wave generator's angle is not quite what its encoder says.
//!
//! θ_measured = θ + Σ A_k sin(k q + φ_k), written as Σ c_k cos(k q) + s_k sin(k q). q is the motor
//! angle or, with orders above 1, the output angle: at ratio 101 order 202 of the output is order 2 of the motor. About 2.9e-4 rad peak to peak at 2 per motor turn.

use super::harmonics::{ANGLE, Angle, Harmonics, MOST_ORDERS};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const ORDERS: KeyInfo =
    KeyInfo::shape_list("orders", "1", MOST_ORDERS, "orders k of the turn").positive().decided().within(0.5, 128.0);
const COS: KeyInfo =
    KeyInfo::linear_list("cos_rad", "rad", MOST_ORDERS, "coefficients of cos(k q)").within(-3e-4, 3e-4);
const SIN: KeyInfo =
    KeyInfo::linear_list("sin_rad", "rad", MOST_ORDERS, "coefficients of sin(k q)").within(-3e-4, 3e-4);

/// A series of the motor or output angle taken out of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct KinematicError<S> {
    angle: Angle,
    series: Harmonics<S>,
}

impl<S: Float> Physics<S> for KinematicError<S> {
    const INFO: KindInfo = KindInfo {
        name: "kinematic_error",
        side: Side::Plant,
        domain: Domain::Deflection,
        equation: "θ_measured = θ + Σ A_k sin(k q + φ_k)",
        coordinates: &[Coordinate::MotorAngle],
        needs: &[Need::Deflection],
        keys: &[ORDERS, COS, SIN, ANGLE],
        hides_behind: "torque_ripple; invisible with the input locked",
        instructions: 280,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let angle = Angle::read(reader, &ORDERS)?;
        Ok(Self { angle, series: Harmonics::read(reader, &ORDERS, &COS, &SIN, S::ONE)? })
    }

    fn needs_besides(&self) -> &'static [Need] {
        self.angle.needs()
    }

    #[inline]
    fn deflection_error(&self, sample: &Sample<S>) -> S {
        self.series.at(self.angle.of(sample))
    }
}
