//! Wrong scale of the torque against a simulation: torque constant, sensor gain, efficiency.
//!
//! T_measured = T + γ T_sim. Only against another simulator's torque, which is not refitted: a refitted base absorbs it.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const GAIN_ERROR: KeyInfo =
    KeyInfo::linear("gain_error", "1", "γ, by which share too much torque is measured").within(-0.5, 0.5);

/// A torque proportional to the simulated one.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueScale<S>(S);

impl<S: Float> Physics<S> for TorqueScale<S> {
    const INFO: KindInfo = KindInfo {
        name: "torque_scale",
        side: Side::Instrument,
        domain: Domain::Torque,
        equation: "T_measured = T + γ T_sim",
        coordinates: &[Coordinate::Torque],
        needs: &[Need::SimulatedTorque],
        keys: &[GAIN_ERROR],
        hides_behind: "load_dependent_friction",
        instructions: 103,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        reader.number(&GAIN_ERROR).map(Self)
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.0 * sample.simulated_torque
    }
}
