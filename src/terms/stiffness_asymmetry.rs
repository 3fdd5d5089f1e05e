//! A spring that is stiffer one way than the other.
//!
//! T += k θ² or k abs(θ).

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const SHAPE: KeyInfo = KeyInfo::choice("shape", &["square", "abs"], "k θ² or k abs(θ)");
const SQUARE: KeyInfo =
    KeyInfo::linear("stiffness_nm_per_rad2", "N·m/rad²", "k of k θ²").of_shapes(&["square"]).within(-1e7, 1e7);
const ABS: KeyInfo =
    KeyInfo::linear("stiffness_nm_per_rad", "N·m/rad", "k of k abs(θ)").of_shapes(&["abs"]).within(-5e3, 5e3);

/// An even torque of the deflection.
#[derive(Debug, Clone, PartialEq)]
pub enum StiffnessAsymmetry<S> {
    /// k θ².
    Square(S),
    /// k abs(θ).
    Abs(S),
}

impl<S: Float> Physics<S> for StiffnessAsymmetry<S> {
    const INFO: KindInfo = KindInfo {
        name: "stiffness_asymmetry",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T += k θ² or k abs(θ)",
        coordinates: &[Coordinate::Deflection],
        needs: &[Need::Deflection],
        keys: &[SHAPE, SQUARE, ABS],
        hides_behind: "offset",
        instructions: 110,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        if reader.choice(&SHAPE)? == 0 {
            reader.number(&SQUARE).map(Self::Square)
        } else {
            reader.number(&ABS).map(Self::Abs)
        }
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let theta = sample.deflection;
        match self {
            // k θ first: θ² alone may leave the range of f32.
            Self::Square(k) => *k * theta * theta,
            Self::Abs(k) => *k * theta.abs(),
        }
    }
}
