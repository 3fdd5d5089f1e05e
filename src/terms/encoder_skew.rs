//! Encoder skew: the reading of the output is older than that of the motor.
//!
//! θ_measured = q_m/N − q_o(t − δ) ≈ θ + δ q̇_o, whatever side the torque is taken on: one δ at every speed and in both directions.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const DELAY: KeyInfo =
    KeyInfo::linear("delay_s", "s", "δ, by which the output's reading is older than the motor's").within(-2e-3, 2e-3);

/// A share of the output velocity taken out of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderSkew<S>(S);

impl<S: Float> Physics<S> for EncoderSkew<S> {
    const INFO: KindInfo = KindInfo {
        name: "encoder_skew",
        side: Side::Instrument,
        domain: Domain::Deflection,
        equation: "θ_measured = q_m/N − q_o(t − δ) ≈ θ + δ q̇_o",
        coordinates: &[Coordinate::OutputVelocity],
        needs: &[Need::OutputVelocity, Need::Deflection],
        keys: &[DELAY],
        hides_behind: "viscous_damping, lost motion",
        instructions: 113,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        reader.number(&DELAY).map(Self)
    }

    #[inline]
    fn deflection_error(&self, sample: &Sample<S>) -> S {
        self.0 * sample.output_velocity
    }
}
