//! Foreign models of hysteresis, as baselines: the same recordings, estimator and held-out blocks as the gear's own model.
//!
//! One file a model. Each is its textbook equation with the linear parameters eliminated and the others searched, so that no model loses by a
//! bad search; models of hysteresis stand beside the gear's own elastic polynomial, so that none loses by its spring. All start with an empty
//! memory, as the gear's model does.

mod bouc_wen;
mod closed_form;
pub mod cost;
mod dahl;
mod lines;
mod maxwell_slip;
mod polynomial;

pub use lines::{spring, two as two_lines};

use crate::numerics::bounded::Bound;
use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Nonlinear, Stretch};
use crate::regression::rows::Rows;

/// A model whose columns follow from the deflection path alone.
pub struct Baseline {
    /// Its name for people.
    pub name: String,
    columns: Vec<Column>,
    nonlinear: Vec<Nonlinear>,
    start: Start,
}

/// One sample: the deflection in, the columns out.
type Step = Box<dyn FnMut(f64, &mut [f64])>;
/// From nonlinear parameters to a model at rest.
type Start = Box<dyn Fn(&[f64]) -> Step + Sync>;

impl Baseline {
    fn new(
        name: impl Into<String>,
        columns: &[(&'static str, Bound)],
        start: impl Fn(&[f64]) -> Step + Sync + 'static,
    ) -> Self {
        let columns = columns.iter().map(|(name, bound)| Column::of_gear(name, "", *bound)).collect();
        Self { name: name.into(), columns, nonlinear: Vec::new(), start: Box::new(start) }
    }

    fn searching(mut self, name: &'static str, low: f64, high: f64) -> Self {
        self.nonlinear.push(Nonlinear { name: name.into(), unit: "".into(), low, high, smooth: true });
        self
    }

    /// Parameters of the model, the offset of each recording not among them.
    pub fn parameters(&self) -> usize {
        self.columns.len() + self.nonlinear.len()
    }
}

struct Running(Step);

impl Contribution for Baseline {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.nonlinear
    }

    fn start<'a>(&'a self, nonlinear: &[f64], _: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(Running((self.start)(nonlinear)))
    }
}

impl Evaluate for Running {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        let mut values = vec![0.0; columns.count()];
        for (row, &theta) in stretch.deflection_rad.iter().enumerate() {
            (self.0)(theta, &mut values);
            columns.set(row, &values);
        }
    }
}

/// The direction of a path: the sign of its last change.
#[derive(Default)]
struct Direction {
    last: Option<f64>,
    sign: f64,
}

impl Direction {
    /// The change since the last sample.
    fn step(&mut self, theta: f64) -> f64 {
        let change = theta - self.last.unwrap_or(theta);
        self.last = Some(theta);
        if change != 0.0 {
            self.sign = change.signum();
        }
        change
    }
}

/// Columns of the elastic torque f(θ).
const ELASTIC: [(&str, Bound); 3] = [("c1", Bound::Free), ("c2", Bound::Free), ("c3", Bound::Free)];

/// Fills them.
fn elastic(theta: f64, out: &mut [f64]) {
    out[..3].copy_from_slice(&gmhm::elastic::basis(theta));
}

/// All baselines for a rated deflection.
pub fn all(rated_deflection_rad: f64) -> Vec<Baseline> {
    let a = rated_deflection_rad;
    let mut baselines =
        vec![spring(), lines::two(), lines::four(), polynomial::with_coulomb(), closed_form::closed_form(a)];
    baselines.extend([dahl::dahl(a), bouc_wen::one_step(a), bouc_wen::bouc_wen(a)]);
    baselines.extend([2, 4, 8, 10, 16].map(|count| maxwell_slip::maxwell_slip(a, count)));
    baselines
}

/// The name of two lines fitted by least squares, the paper's baseline.
pub const TWO_LINES: &str = "two lines";
