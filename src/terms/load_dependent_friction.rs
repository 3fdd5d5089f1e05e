//! Friction of the loaded teeth: 1 to 5 % of the torque.
//!
//! T += σ μ abs(T_base) sgn v, with T_base = f + z, gravity and inertia of a joint log, or T_sim where a simulation is the base; sgn v smoothed as tanh(v/smoothing).

use super::coulomb_friction::SMOOTHING;
use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::{Sample, Sense};
use crate::scalar::Float;

const MU: KeyInfo = KeyInfo::linear("mu", "1", "μ").within(0.0, 0.2);

/// A torque against the movement, proportional to the transmitted one.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadDependentFriction<S> {
    mu: S,
    sense: Sense<S>,
}

impl<S: Float> Physics<S> for LoadDependentFriction<S> {
    const INFO: KindInfo = KindInfo {
        name: "load_dependent_friction",
        side: Side::Plant,
        domain: Domain::Friction,
        equation: "T += σ μ abs(T_base) sgn v",
        coordinates: &[Coordinate::Torque],
        needs: &[Need::Velocity],
        keys: &[MU, SMOOTHING],
        hides_behind: "coulomb_friction",
        instructions: 219,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let mu = reader.setting.sigma * reader.number(&MU)?;
        Ok(Self { mu, sense: Sense::new(reader.number(&SMOOTHING)?) })
    }

    fn follows_base(&self) -> bool {
        true
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        self.mu * sample.base_torque.abs() * self.sense.of(sample.velocity)
    }
}
