//! Damping of the flexspline's own deformation.
//!
//! T += b θ̇, of the corrected deflection.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN: KeyInfo = KeyInfo::linear("damping_nms_per_rad", "N·m·s/rad", "b").within(0.0, 1e3);

/// A torque proportional to the rate of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscousDamping<S>(S);

impl<S: Float> Physics<S> for ViscousDamping<S> {
    const INFO: KindInfo = KindInfo {
        name: "viscous_damping",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += b θ̇",
        coordinates: &[Coordinate::DeflectionRate],
        needs: &[Need::DeflectionRate],
        keys: &[GAIN],
        hides_behind: "time_skew",
        instructions: 103,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self(reader.number(&GAIN)?))
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0 * sample.deflection_rate
    }
}
