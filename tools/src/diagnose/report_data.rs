//! What a report shows of a diagnosis: every coordinate of every row, and the orders of the motor turn before and after.

use crate::diagnose::DiagnoseError;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::nonparametric::Coordinates;
use crate::numerics::spectrum::Line;
use crate::regression::dataset::Dataset;

/// Rows and spectra for figures.
pub struct ReportData {
    /// Every coordinate of every row.
    pub coordinates: Coordinates,
    /// The first row of each recording.
    pub first_rows: Vec<usize>,
    /// The spectrum over the orders of the motor turn, of the refitted base model and of the extended one.
    pub orders: Option<(Vec<Line>, Vec<Line>)>,
}

impl ReportData {
    /// The report data of a verdict.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn new(dataset: &Dataset<'_>, verdict: &DiagnosisVerdict) -> Result<Self, DiagnoseError> {
        let evaluations = dataset.evaluate(&verdict.extended.model)?;
        let coordinates = Coordinates::new(dataset, &evaluations);
        let orders = coordinates.motor.as_deref().and_then(|motor| {
            // The noise of the extended model is what the lines of both stand out of.
            let lines = |residual: &[f64]| {
                let mut fit = verdict.extended.clone();
                fit.residual = residual.to_vec();
                let u = dataset.filtered_twice(&fit);
                dataset.order_spectrum(&fit, motor, &u)
            };
            let (before, after) = (lines(&verdict.base.residual), lines(&verdict.extended.residual));
            (!before.is_empty()).then_some((before, after))
        });
        let first_rows = dataset.spans.iter().map(|span| span.start).collect();
        Ok(Self { coordinates, first_rows, orders })
    }
}
