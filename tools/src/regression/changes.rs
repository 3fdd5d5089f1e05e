//! Changes of the torque that are no noise, and what a fit would take them for.

use nalgebra::DMatrix;

use crate::numerics::autoregression::Noise;
use crate::numerics::bounded::Bound;
use crate::regression::columns::Column;
use crate::regression::problem::{Linear, Problem, Sweep, Tangent};
use crate::regression::ready::Ready;

/// How the torque of a model changes whose residuals were `before` and are `after`, recording by recording.
pub fn between(before: &[Vec<f64>], mut after: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    after.iter_mut().flatten().zip(before.iter().flatten()).for_each(|(after, before)| *after = before - *after);
    after
}

/// The products of a problem's filtered columns (the gear's linear parameters, then the nonlinear ones; nuisances eliminated) with changes of the torque, one a column: the
/// inverse Gram matrix makes of each what the parameters take of that change.
pub fn scores(
    problem: &Problem<'_>,
    nonlinear: &[f64],
    linear: &Linear,
    noise: Option<&[Noise]>,
    changes: &[Vec<Vec<f64>>],
) -> DMatrix<f64> {
    let of_recording = |index: usize| changes.iter().map(|change| &change[index][..]).collect();
    let columns = changes.iter().map(|_| Column::of_gear("change of the torque", "N·m", Bound::Free)).collect();
    let ready = Ready::new(columns, (0..problem.rows.len()).map(of_recording).collect());
    let mut beside = problem.on(problem.rows);
    beside.contributions.push(&ready);
    let mut linear = linear.clone();
    let gear = linear.gear.len();
    linear.gear.resize(gear + changes.len(), 0.0);
    let parameters: Vec<usize> = (0..nonlinear.len()).collect();
    let tangent = Tangent { parameters: &parameters, linear: &linear };
    let sweep = Sweep { noise, ..Sweep::PLAIN };
    let shared = beside.factor(nonlinear, Some(tangent), sweep).combine(|_, _| true).shared;
    let of_change = |change: usize| {
        let unit: Vec<f64> = (0..shared.columns()).map(|j| if j == gear + change { 1.0 } else { 0.0 }).collect();
        shared.products(&unit)
    };
    let products: Vec<Vec<f64>> = (0..changes.len()).map(of_change).collect();
    let own = |k: usize| if k < gear { k } else { k + changes.len() };
    DMatrix::from_fn(gear + nonlinear.len(), changes.len(), |k, change| products[change][own(k)])
}
