//! What an adaptation on the drive has learnt, as a host reads it.

#[cfg(feature = "adapt")]
use crate::adapt::{Adaptation, AdaptationState};
#[cfg(feature = "adapt")]
use crate::scalar::Float;

/// Changes of the five coefficients of law `masing` from the block's: of c1·A, c2·A³, c3·A⁵, e·A and h·A, each over T_A, with A and T_A of the block in force.
///
/// A host that reads the block in force has them in SI units: c1 + change·T_A/A, c2 + change·T_A/A³, c3 + change·T_A/A⁵, e and h as c1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Adapted {
    /// Whether adapted parameters are in force; else the block's own are.
    pub taken_over: bool,
    /// Latched warnings: bit n is warning number n of the module `adapt`.
    pub warnings: u16,
    /// Stretches of motion that it has learnt from.
    pub stretches: u32,
    /// The changes in force; zero while the block is.
    pub in_force: [f32; 5],
    /// Those of the shadow, bounds kept: what a host may commit.
    pub shadow: [f32; 5],
    /// Standard deviations of the estimate that the shadow is of.
    pub deviations: [f32; 5],
}

#[cfg(feature = "adapt")]
impl Adapted {
    /// What a joint has learnt.
    #[must_use]
    pub fn of<S: Float>(adaptation: &Adaptation<S>, state: &AdaptationState<S>) -> Self {
        let single = |of: S| of.to_f64() as f32;
        Self {
            taken_over: state.is_taken_over(),
            warnings: state.warnings().bits(),
            stretches: state.stretches(),
            in_force: state.in_force().map(single),
            shadow: adaptation.shadow_change(state).map(single),
            deviations: state.variances().map(|variance| single(variance.sqrt())),
        }
    }
}
