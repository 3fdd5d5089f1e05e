//! What to fit and how.

use crate::model::Model;

/// How the parameters are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Linear parameters eliminated, the others searched and polished; noise, selection.
    #[default]
    Auto,
    /// The paper's swarm over all six parameters.
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
}
