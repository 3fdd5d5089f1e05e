//! What the parameters take of what a motion behind counts may be off by.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::numerics::autoregression::Noise;
use crate::regression::changes;
use crate::regression::problem::{Linear, Problem};
use crate::regression::rows::{Rows, beginning};
use crate::signal::counts::{DRAWN_ROWS, DRAWS};

/// What the parameters take of what the motion may be off by, as `changes::scores` of each. `None` without counted deflections.
pub fn scores(problem: &Problem<'_>, nonlinear: &[f64], linear: &Linear, noise: &[Noise]) -> Option<DMatrix<f64>> {
    if problem.rows.iter().all(|rows| rows.counts.is_none()) {
        return None;
    }
    let rows = beginning(problem.rows, DRAWN_ROWS);
    let along = |rows: &[Rows<'_>]| problem.on(rows).residuals(nonlinear, linear);
    let found = along(&rows);
    let with_errors = |draw: usize| {
        let mut moved = rows.clone();
        for rows in &mut moved {
            if let Some(counts) = &rows.counts {
                let motion = rows.deflection_rad.to_mut().iter_mut();
                motion.zip(counts.errors_rad(draw)).for_each(|(motion, error)| *motion -= error);
            }
        }
        changes::between(&found, along(&moved))
    };
    let drawn: Vec<Vec<Vec<f64>>> = (0..DRAWS).into_par_iter().map(with_errors).collect();
    let count = |rows: &[Rows<'_>]| rows.iter().map(Rows::len).sum::<usize>() as f64;
    let scale = count(problem.rows) / count(&rows) / (DRAWS as f64).sqrt();
    Some(scale * changes::scores(&problem.on(&rows), nonlinear, linear, Some(noise), &drawn))
}
