//! Ripple through a structural mode: the line of order k swells where k q̇ nears the mode's frequency, and turns its phase.
//!
//! T += Σ Re[H(j k q̇) C_k e^(j k q)] with C_k = cos_k − j sin_k, q the motor or output angle, H(s) = ω_n²/(s² + 2ζω_n s + ω_n²). At standstill that is
//! Σ cos_k cos(k q) + sin_k sin(k q), as of `torque_ripple`. With x = k q̇/ω_n and a wave's value p and quadrature r, e^(j k q) C_k = p + j r, each order adds
//! ((1 − x²) p + 2ζx r)/((1 − x²)² + (2ζx)²). The speed is taken to change little within the mode's settling time, 1/(ζω_n).

use core::f64::consts::TAU;

use super::harmonics::{ANGLE, Angle, Harmonics, MOST_ORDERS};
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const ORDERS: KeyInfo =
    KeyInfo::shape_list("orders", "1", MOST_ORDERS, "orders k of the turn").positive().decided().within(0.5, 128.0);
const COS: KeyInfo =
    KeyInfo::linear_list("cos_nm", "N·m", MOST_ORDERS, "coefficients of cos(k q), at standstill").within(-10.0, 10.0);
const SIN: KeyInfo =
    KeyInfo::linear_list("sin_nm", "N·m", MOST_ORDERS, "coefficients of sin(k q), at standstill").within(-10.0, 10.0);
const FREQUENCY: KeyInfo =
    KeyInfo::shape("frequency_hz", "Hz", "ω_n/(2π), frequency of the mode").positive().within(2.0, 200.0);
const DAMPING: KeyInfo = KeyInfo::shape("damping_ratio", "1", "ζ of the mode").positive().within(0.01, 0.7);

/// A series of an angle, each order amplified and turned by the mode.
#[derive(Debug, Clone, PartialEq)]
pub struct RippleResonance<S> {
    angle: Angle,
    series: Harmonics<S>,
    /// 1/ω_n, s.
    inverse_frequency: S,
    twice_damping: S,
}

impl<S: Float> Physics<S> for RippleResonance<S> {
    const INFO: KindInfo = KindInfo {
        name: "ripple_resonance",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += Σ Re[H(j k q̇) C_k e^(j k q)], H(s) = ω_n²/(s² + 2ζω_n s + ω_n²)",
        coordinates: &[Coordinate::MotorAngle, Coordinate::OutputVelocity],
        needs: &[],
        keys: &[ORDERS, COS, SIN, FREQUENCY, DAMPING, ANGLE],
        hides_behind: "torque_ripple",
        instructions: 294,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let angle = Angle::read(reader, &ORDERS)?;
        let series = Harmonics::read(reader, &ORDERS, &COS, &SIN, S::ONE)?;
        let inverse_frequency = (S::from_f64(TAU) * reader.number(&FREQUENCY)?).recip();
        let twice_damping = S::TWO * reader.number(&DAMPING)?;
        Ok(Self { angle, series, inverse_frequency, twice_damping })
    }

    fn needs_besides(&self) -> &'static [Need] {
        match self.angle {
            Angle::Motor => &[Need::MotorAngle, Need::MotorVelocity],
            Angle::Output => &[Need::OutputAngle, Need::OutputVelocity],
        }
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let velocity = match self.angle {
            Angle::Motor => sample.motor_velocity,
            Angle::Output => sample.output_velocity,
        };
        let speed = velocity * self.inverse_frequency;
        self.series.sum(self.angle.of(sample), |order, in_phase, quadrature| {
            let x = order * speed;
            let (elastic, damping) = ((S::ONE - x) * (S::ONE + x), self.twice_damping * x);
            (elastic * in_phase + damping * quadrature).over(elastic * elastic + damping * damping)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_resonance_a_wave_is_a_quarter_turn_late_and_amplified() {
        let at = |motor_velocity: f64, motor_angle: f64| {
            let series = Harmonics::first(3.0, 0.0);
            let resonance = RippleResonance { angle: Angle::Motor, series, inverse_frequency: 0.1, twice_damping: 0.2 };
            resonance.torque(&mut (), &Sample { motor_velocity, motor_angle, ..Sample::default() })
        };
        let near = |a: f64, b: f64| libm::fabs(a - b) < 1e-12;
        // 3 cos q at standstill; 3/(2ζ) sin q at ω_n, and as late when turning back; nothing far above.
        assert!(near(at(0.0, 0.4), 3.0 * libm::cos(0.4)));
        assert!(near(at(10.0, 0.4), 15.0 * libm::sin(0.4)));
        assert!(near(at(-10.0, 0.4), -15.0 * libm::sin(0.4)));
        assert!(libm::fabs(at(1e4, 0.4)) < 1e-5);
    }
}
