//! What a drive's own adaptation has learnt, beside the block in force.

use gmhm::Params;
use gmhm::adapt::{Warning, changed};
use gmhm::link::Adapted;
use serde::Serialize;

use super::{AdaptReplayError, NAMES, coefficients, units};

/// Units of the coefficients.
const UNITS: [&str; 5] = ["N·m/rad", "N·m/rad³", "N·m/rad⁵", "N·m/rad", "N·m/rad"];

/// A coefficient, SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coefficient {
    /// c1, c2, c3, e or h.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Of the block.
    pub block: f64,
    /// In force: the block's, or what was taken over.
    pub in_force: f64,
    /// Of the shadow, bounds kept.
    pub shadow: f64,
    /// Standard deviation of the estimate.
    pub sd: f64,
}

/// Old and new.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Learnt {
    /// Whether adapted parameters are in force.
    pub taken_over: bool,
    /// Stretches of motion that it has learnt from.
    pub stretches: u32,
    /// The five coefficients.
    pub coefficients: Vec<Coefficient>,
    /// What is latched, by name.
    pub warnings: Vec<&'static str>,
    /// The gear with the coefficients of the shadow.
    #[serde(skip)]
    pub shadow: Params,
}

impl Learnt {
    /// What a drive has learnt beside a block with these parameters.
    ///
    /// # Errors
    /// Changes that the core does not accept: [`AdaptReplayError::Params`].
    pub fn of(block: &Params, adapted: &Adapted) -> Result<Self, AdaptReplayError> {
        let units = units(block.rated_deflection_rad(), block.torque_scale_nm());
        let old = coefficients(&block.elastic(), &block.memory());
        let coefficient = |k: usize| Coefficient {
            name: NAMES[k],
            unit: UNITS[k],
            block: old[k],
            in_force: old[k] + units[k] * f64::from(adapted.in_force[k]),
            shadow: old[k] + units[k] * f64::from(adapted.shadow[k]),
            sd: units[k] * f64::from(adapted.deviations[k]),
        };
        let is_latched = |warning: &Warning| adapted.warnings & (1 << *warning as u8) != 0;
        Ok(Self {
            taken_over: adapted.taken_over,
            stretches: adapted.stretches,
            coefficients: (0..NAMES.len()).map(coefficient).collect(),
            warnings: Warning::ALL.into_iter().filter(is_latched).map(Warning::name).collect(),
            shadow: changed(block, &adapted.shadow)?,
        })
    }
}
