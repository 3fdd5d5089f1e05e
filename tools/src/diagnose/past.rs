//! Pasts of recordings beyond the polynomial one.

use crate::diagnose::nonparametric;
use crate::diagnose::search::MARGIN;
use crate::regression::dataset::{Dataset, untouched};
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;

/// Pieces of which what any past adds is made.
const PAST_HATS: usize = 8;

impl Dataset<'_> {
    /// Lets each recording remember any past whatever, where that explains more than the polynomial past does: reversals of old leave kinks. Highest and lowest
    /// deflection so far move one way only, so what the past adds is a function of how far they have come together. Tells whether any does.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn allow_any_past(&mut self, fit: &Fitted) -> Result<bool, EstimateError> {
        let mut admitted = vec![Vec::new(); self.spans.len()];
        for ((recording, span), admitted) in self.recordings.iter().zip(&self.spans).zip(&mut admitted) {
            let Some(room) = untouched(recording, &fit.model)? else { continue };
            let come: Vec<f64> = room.iter().map(|(above, below)| -(above + below)).collect();
            let (from, to) = (come[0], come[come.len() - 1]);
            let knots: Vec<f64> = (0..=PAST_HATS).map(|k| from + (to - from) * k as f64 / PAST_HATS as f64).collect();
            if knots.windows(2).any(|w| w[1] <= w[0]) {
                continue;
            }
            let mut columns = nonparametric::linear_splines(&come, &knots);
            columns.pop();
            let mut own = vec![vec![0.0; self.len()]; columns.len()];
            own.iter_mut().zip(&columns).for_each(|(line, column)| line[span.clone()].copy_from_slice(column));
            let mut columns = fit.parameter_columns();
            columns.extend(own.iter().map(Vec::as_slice));
            let with = self.layout().best_profile(&columns, &fit.residual, &fit.noise);
            let gain = fit.minus_two_log_likelihood - with.minus_two_log_likelihood;
            if gain > self.penalty(own.len()) + MARGIN {
                *admitted = own;
            }
        }
        let any = admitted.iter().any(|own| !own.is_empty());
        if any {
            self.remember(admitted);
        }
        Ok(any)
    }

    /// Adds nuisances to those of each recording. Each has as many, those that it lacks are 0.
    fn remember(&mut self, admitted: Vec<Vec<Vec<f64>>>) {
        let most = admitted.iter().map(Vec::len).max().unwrap_or(0);
        let mut all = Vec::new();
        for (index, mut own) in admitted.into_iter().enumerate() {
            own.resize(most, vec![0.0; self.len()]);
            all.extend_from_slice(self.layout().nuisances_of(index));
            all.append(&mut own);
        }
        self.nuisances = all;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parse;
    use crate::recording::Recording;

    #[test]
    fn each_recording_keeps_its_own_offset_beside_an_older_past() {
        let text = "format = 1\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 1.0\n";
        let model = parse("joint.toml", text).unwrap();
        let time_s: Vec<f64> = (0..200).map(|row| 0.01 * f64::from(row)).collect();
        let recording = Recording {
            name: "joint".into(),
            torque: Some(time_s.iter().map(|t| t.sin()).collect()),
            velocity_out_rad_per_s: Some(time_s.iter().map(|t| t.cos()).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        let recordings = [recording.clone(), recording];
        let mut dataset = Dataset::new(&recordings, &model).unwrap();
        let of_second: Vec<f64> = (0..dataset.len()).map(|row| f64::from(u8::from(row >= 200))).collect();
        dataset.remember(vec![Vec::new(), vec![of_second; PAST_HATS]]);
        for (index, span) in dataset.spans.iter().enumerate() {
            let layout = dataset.layout();
            let lines = layout.nuisances_of(index);
            assert!(lines[0][span.clone()].iter().all(|x| *x == 1.0), "recording {index} has lost its offset");
            let others = (0..dataset.len()).filter(|row| !span.contains(row));
            assert!(others.flat_map(|row| lines.iter().map(move |line| line[row])).all(|x| x == 0.0));
        }
    }
}
