//! What a report shows of a diagnosis: every coordinate of every row, and the orders of the motor turn before and after.

use super::DiscoverError;
use super::flexible::Coordinates;
use super::judge::Judgement;
use super::spectrum::Line;
use super::subject::Subject;

/// Rows and spectra for figures.
pub struct Scene {
    /// Every coordinate of every row.
    pub coordinates: Coordinates,
    /// The first row of each recording.
    pub first_rows: Vec<usize>,
    /// The spectrum over the orders of the motor turn, of the refitted base model and of the extended one.
    pub orders: Option<(Vec<Line>, Vec<Line>)>,
}

impl Scene {
    /// The scene of a judgement.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn new(subject: &Subject<'_>, judgement: &Judgement) -> Result<Self, DiscoverError> {
        let evaluations = subject.evaluate(&judgement.extended.model)?;
        let coordinates = Coordinates::new(subject, &evaluations);
        let orders = coordinates.motor.as_deref().and_then(|motor| {
            // The noise of the extended model is what the lines of both stand out of.
            let lines = |residual: &[f64]| {
                let mut fit = judgement.extended.clone();
                fit.residual = residual.to_vec();
                let u = subject.filtered_twice(&fit);
                subject.order_spectrum(&fit, motor, &u)
            };
            let (before, after) = (lines(&judgement.base.residual), lines(&judgement.extended.residual));
            (!before.is_empty()).then_some((before, after))
        });
        let first_rows = subject.spans.iter().map(|span| span.start).collect();
        Ok(Self { coordinates, first_rows, orders })
    }
}
