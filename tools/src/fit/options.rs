//! What to fit and how.

use clap::ValueEnum;

use crate::model::{GearSection, Model, TorqueSide};
use crate::recording::TorqueUnit;

/// How the parameters are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Eliminate the linear parameters exactly, search the others
    #[default]
    Auto,
    /// The paper's particle swarm over all six parameters
    Pso,
}

/// What to fit and how.
#[derive(Debug, Clone, Default)]
pub struct FitOptions {
    /// The method.
    pub method: Method,
    /// Seed of every random choice.
    pub seed: u64,
    /// A model whose gear section, law, kernel, gate, play and ω are kept.
    pub start: Option<Model>,
    /// A; else the model's, else the largest deflection seen. rad.
    pub rated_deflection_rad: Option<f64>,
    /// Evaluations of `pso`; by default 20,000.
    pub evaluations: Option<usize>,
    /// The ratio; else the model's.
    pub ratio: Option<f64>,
    /// Where the torque is taken; else where the model says.
    pub torque_side: Option<TorqueSide>,
    /// Whether the deflection of each recording, also of a single one, has a zero of its own, however well they fit without.
    pub own_zeros: bool,
}

impl FitOptions {
    /// What is known of the gear beforehand. A current is taken on the motor side.
    pub fn gear(&self, torque_unit: TorqueUnit) -> GearSection {
        let mut gear = self.start.as_ref().map_or_else(GearSection::default, |model| model.gear.clone());
        if self.start.is_none() && torque_unit == TorqueUnit::Ampere {
            gear.torque_side = TorqueSide::Motor;
        }
        gear.ratio = self.ratio.or(gear.ratio);
        gear.torque_side = self.torque_side.unwrap_or(gear.torque_side);
        gear
    }
}
