//! Weight of the link: one wave a turn of the output.
//!
//! T += G sin(q_o + φ), written as c cos q_o + s sin q_o.

use super::harmonics::Harmonics;
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const COS: KeyInfo = KeyInfo::linear("cos_nm", "N·m", "coefficient of cos q_o").within(-500.0, 500.0);
const SIN: KeyInfo = KeyInfo::linear("sin_nm", "N·m", "coefficient of sin q_o").within(-500.0, 500.0);

/// A wave of the output angle added to the torque.
#[derive(Debug, Clone, PartialEq)]
pub struct GravityLoad<S>(Harmonics<S>);

impl<S: Float> Physics<S> for GravityLoad<S> {
    const INFO: KindInfo = KindInfo {
        name: "gravity_load",
        side: Side::Plant,
        domain: Domain::Load,
        equation: "T += G sin(q_o + φ)",
        coordinates: &[Coordinate::OutputAngle],
        needs: &[Need::OutputAngle],
        keys: &[COS, SIN],
        hides_behind: "encoder_eccentricity, sensor_drift",
        instructions: 203,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(Harmonics::first(reader.number(&COS)?, reader.number(&SIN)?)))
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0.at(sample.output_angle)
    }
}
