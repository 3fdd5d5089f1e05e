//! Eccentricity of the output encoder: one wave a turn in the measured deflection.
//!
//! θ_measured = θ + a sin(q_o + φ), written as c cos q_o + s sin q_o.

use super::harmonics::Harmonics;
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const COS: KeyInfo = KeyInfo::linear("cos_rad", "rad", "coefficient of cos q_o").within(-1e-3, 1e-3);
const SIN: KeyInfo = KeyInfo::linear("sin_rad", "rad", "coefficient of sin q_o").within(-1e-3, 1e-3);

/// A wave of the output angle taken out of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderEccentricity<S>(Harmonics<S>);

impl<S: Float> Physics<S> for EncoderEccentricity<S> {
    const INFO: KindInfo = KindInfo {
        name: "encoder_eccentricity",
        side: Side::Instrument,
        domain: Domain::Deflection,
        equation: "θ_measured = θ + a sin(q_o + φ)",
        coordinates: &[Coordinate::OutputAngle],
        needs: &[Need::OutputAngle, Need::Deflection],
        keys: &[COS, SIN],
        hides_behind: "gravity_load",
        instructions: 213,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(Harmonics::first(reader.number(&COS)?, reader.number(&SIN)?)))
    }

    #[inline]
    fn deflection_error(&self, sample: &Sample<S>) -> S {
        self.0.at(sample.output_angle)
    }
}
