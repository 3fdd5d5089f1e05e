//! Kinematic error: the wave generator's angle is not quite what its encoder says.
//!
//! θ_measured = θ + Σ A_k sin(k q_m + φ_k), written as Σ c_k cos(k q_m) + s_k sin(k q_m). About 2.9e-4 rad peak to peak at 2 per motor turn.

use super::harmonics::{Harmonics, MOST_ORDERS};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const ORDERS: KeyInfo = KeyInfo::shape_list("orders", "1", MOST_ORDERS, "orders k of the motor turn")
    .positive()
    .decided()
    .within(0.5, 128.0);
const COS: KeyInfo =
    KeyInfo::linear_list("cos_rad", "rad", MOST_ORDERS, "coefficients of cos(k q_m)").within(-3e-4, 3e-4);
const SIN: KeyInfo =
    KeyInfo::linear_list("sin_rad", "rad", MOST_ORDERS, "coefficients of sin(k q_m)").within(-3e-4, 3e-4);

/// A series of the motor angle taken out of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct KinematicError<S>(Harmonics<S>);

impl<S: Float> Physics<S> for KinematicError<S> {
    const INFO: KindInfo = KindInfo {
        name: "kinematic_error",
        side: Side::Plant,
        domain: Domain::Deflection,
        equation: "θ_measured = θ + Σ A_k sin(k q_m + φ_k)",
        coordinates: &[Coordinate::MotorAngle],
        needs: &[Need::MotorAngle, Need::Deflection],
        keys: &[ORDERS, COS, SIN],
        hides_behind: "torque_ripple; invisible with the input locked",
        instructions: 264,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Harmonics::read(reader, &ORDERS, &COS, &SIN, S::ONE).map(Self)
    }

    #[inline]
    fn deflection_error(&self, sample: &Sample<S>) -> S {
        self.0.at(sample.motor_angle)
    }
}
