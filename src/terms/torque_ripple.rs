//! Torque ripple: torque that turns with the motor.
//!
//! T += Σ B_k sin(k q + φ_k), any order, written as Σ c_k cos(k q) + s_k sin(k q). q is the motor angle or,
//! with orders above 1, the output angle. 1 to 5 % of the rated torque.

use super::harmonics::{ANGLE, Angle, Harmonics, MOST_ORDERS};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const ORDERS: KeyInfo =
    KeyInfo::shape_list("orders", "1", MOST_ORDERS, "orders k of the turn").positive().decided().within(0.5, 128.0);
const COS: KeyInfo = KeyInfo::linear_list("cos_nm", "N·m", MOST_ORDERS, "coefficients of cos(k q)").within(-10.0, 10.0);
const SIN: KeyInfo = KeyInfo::linear_list("sin_nm", "N·m", MOST_ORDERS, "coefficients of sin(k q)").within(-10.0, 10.0);

/// A series of the motor or output angle added to the torque.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueRipple<S> {
    angle: Angle,
    series: Harmonics<S>,
}

impl<S: Float> Physics<S> for TorqueRipple<S> {
    const INFO: KindInfo = KindInfo {
        name: "torque_ripple",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += Σ B_k sin(k q + φ_k)",
        coordinates: &[Coordinate::MotorAngle],
        needs: &[],
        keys: &[ORDERS, COS, SIN, ANGLE],
        hides_behind: "kinematic_error (a blocked output separates them)",
        instructions: 260,
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
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.series.at(self.angle.of(sample))
    }
}
