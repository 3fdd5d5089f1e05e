//! Model files: the gear's parameters in SI units, as TOML.

mod error;
mod read;
pub mod refusal;
pub(crate) mod unit;
mod write;

pub use error::{ModelError, ModelProblem};
pub use read::{load, parse};
pub use unit::key_per;

/// A gear of law `masing` for tests.
#[cfg(test)]
pub(crate) const TEST_GEAR: &str = r#"format = 1
[gear]
rated_deflection_rad = 1e-3
[elastic]
c1_nm_per_rad = 2.4e4
c2_nm_per_rad3 = 2.1e9
c3_nm_per_rad5 = -6e14
[memory]
law = "masing"
alpha = 2.3e6
beta_per_s = 416.0
omega_per_s = 200.0
"#;

use std::collections::BTreeMap;

use crate::recording::TorqueUnit;

/// The key of a series of waves: the list of their orders.
pub const ORDERS: &str = "orders";

/// The side of the gear on which the torque is taken, MODEL.md's σ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum TorqueSide {
    /// At the motor, such as a motor current: σ = +1 in the equations.
    Motor,
    /// By a sensor at the output: σ = −1 in the equations.
    #[default]
    Output,
}

impl TorqueSide {
    /// Its name in model files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Output => "output",
        }
    }

    /// The other side of the gear.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Motor => Self::Output,
            Self::Output => Self::Motor,
        }
    }
}

/// What the terms of a model are added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Base {
    /// The model's own elastic and hysteresis torque; nothing for a joint log.
    #[default]
    Model,
    /// The torque of another simulator, column `torque_sim_nm` of each recording.
    Simulation,
}

/// The gear itself: section `[gear]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GearSection {
    /// Reduction ratio N, negative where the gear reverses; needed only where angles are used.
    pub ratio: Option<f64>,
    /// Where the torque is taken.
    pub torque_side: TorqueSide,
    /// Rated deflection A, rad: the amplitude of the calibrated cycle. Absent for a joint log.
    pub rated_deflection_rad: Option<f64>,
    /// Subtracted from every deflection before anything else, rad.
    pub deflection_zero_rad: f64,
    /// What the terms are added to.
    pub base: Base,
}

/// One value of a `[[term]]` table.
#[derive(Debug, Clone, PartialEq)]
pub enum TermValue {
    /// A number in the unit that its key names.
    Number(f64),
    /// A list of numbers.
    List(Vec<f64>),
    /// A choice, such as `shape` or `angle`.
    Text(String),
}

/// One `[[term]]`: a kind of MODEL.md section 7 and its keys, checked against the core's list of terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// The kind, such as `kinematic_error`.
    pub kind: String,
    /// Its keys and values.
    pub values: BTreeMap<String, TermValue>,
}

/// A model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// A name for people.
    pub name: String,
    /// What torques are counted in. Per ampere, every `_nm` in the names of parameters reads `_a` in the file.
    pub torque_unit: TorqueUnit,
    /// Section `[gear]`.
    pub gear: GearSection,
    /// Section `[elastic]`; absent for a joint log and where a simulation is the base.
    pub elastic: Option<gmhm::Elastic>,
    /// Section `[memory]`; absent as that is.
    pub memory: Option<gmhm::Memory>,
    /// The `[[term]]` tables in file order.
    pub terms: Vec<Term>,
}

impl Model {
    /// The model with what else is known of its gear: the ratio, and the side on which the torque is taken.
    #[must_use]
    pub fn of_gear(mut self, ratio: Option<f64>, torque_side: Option<TorqueSide>) -> Self {
        self.gear.ratio = ratio.or(self.gear.ratio);
        self.gear.torque_side = torque_side.unwrap_or(self.gear.torque_side);
        self
    }

    /// Whether the model has a term of a kind.
    pub fn has_term(&self, kind: &str) -> bool {
        self.terms.iter().any(|term| term.kind == kind)
    }

    /// Removes those terms from place `from` on for which `is_gone` is true.
    pub fn remove_terms(&mut self, from: usize, is_gone: impl Fn(&Term) -> bool) {
        let later = self.terms.split_off(from.min(self.terms.len()));
        self.terms.extend(later.into_iter().filter(|term| !is_gone(term)));
    }

    /// Whether the base is a gear that follows the deflection.
    pub fn has_gear(&self) -> bool {
        self.elastic.is_some() || self.memory.is_some()
    }

    /// Whether the terms are added to another simulator's torque.
    pub fn is_simulation(&self) -> bool {
        self.gear.base == Base::Simulation
    }

    /// Whether there is nothing but its terms: a joint, or another machine without a gear, whose base no simulation is.
    pub fn has_terms_alone(&self) -> bool {
        !self.has_gear() && !self.is_simulation()
    }

    /// The parameters of the gear at the rated deflection A, as the host evaluates them: beside slip elements the fitted spring of a real gear may fall at 0. `None` for a
    /// joint log. The file's own A is only a default: commands may be given another.
    ///
    /// # Errors
    /// What cannot be evaluated.
    pub fn params(&self, rated_deflection_rad: f64) -> Option<Result<gmhm::Params, gmhm::ParamError>> {
        Some(gmhm::Params::candidate(rated_deflection_rad, self.elastic?, self.memory?))
    }

    /// The same, within the ranges that a drive accepts.
    ///
    /// # Errors
    /// What the core refuses.
    pub fn drive_params(&self, rated_deflection_rad: f64) -> Option<Result<gmhm::Params, gmhm::ParamError>> {
        Some(gmhm::Params::new(rated_deflection_rad, self.elastic?, self.memory?))
    }
}
