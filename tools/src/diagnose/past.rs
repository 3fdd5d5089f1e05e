//! Pasts of recordings other than the polynomial one.

use crate::diagnose::nonparametric;
use crate::diagnose::search::MARGIN;
use crate::kinds;
use crate::regression::dataset::{Dataset, untouched};
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;

/// Pieces of which what any past adds is made.
const PAST_HATS: usize = 8;

/// A search from rest is tried where the error of held-out blocks is more than so many times the error of the fit: the past that was fitted is then probably none of the gear.
const OF_ONE_BLOCK: f64 = 1.15;

/// A search from rest is preferred where it leaves less than so many times as much of held-out blocks: it has four numbers or more less for each recording. Where it finds fewer
/// effects, it has to leave less.
const FROM_REST: f64 = 1.1;

/// A search beside a past of eight numbers more for each recording is preferred where it leaves less than this part.
const OLDER_PAST: f64 = 0.5;

/// Recordings with another past than the polynomial one.
pub(super) struct OtherPast<'a> {
    /// All rows.
    pub dataset: Dataset<'a>,
    /// The rows that are searched.
    pub thin: Dataset<'a>,
    /// The most that a search beside it may leave of held-out blocks to be preferred, over what is left beside the polynomial one.
    pub most_left: f64,
}

/// Whether slip elements were found beside a base of `base_terms` terms.
pub(super) fn has_slip_elements(extended: &Fitted, base_terms: usize) -> bool {
    extended.model.terms[base_terms..].iter().any(kinds::is_of_slip_elements)
}

/// The other pasts to try where slip elements were found beside a base of `base_terms` terms: none, where what is left does not carry over to held-out blocks, and any, where that is likelier.
/// Beside a base that lacks such a memory its error passes for a past.
///
/// # Errors
/// A model that cannot be evaluated.
pub(super) fn other_pasts<'a>(
    dataset: &Dataset<'a>,
    thin: &Dataset<'a>,
    extended: &Fitted,
    base_terms: usize,
) -> Result<Vec<OtherPast<'a>>, EstimateError> {
    let mut pasts = Vec::new();
    if !has_slip_elements(extended, base_terms) {
        return Ok(pasts);
    }
    let has_past = thin.nuisances.len() > thin.spans.len();
    if has_past && thin.rms_of_blocks(extended) > OF_ONE_BLOCK * thin.rms(&extended.residual) {
        let [dataset, thin] = [dataset, thin].map(Dataset::at_rest);
        pasts.push(OtherPast { dataset, thin, most_left: FROM_REST });
    }
    let (mut older, mut thin_older) = (dataset.clone(), thin.clone());
    if thin_older.allow_any_past(extended)?
        && older.allow_any_past(&dataset.fit_as(extended, &extended.model, &extended.parameters, 0)?)?
    {
        pasts.push(OtherPast { dataset: older, thin: thin_older, most_left: OLDER_PAST });
    }
    Ok(pasts)
}

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

    /// The same rows of recordings that begin without a past.
    fn at_rest(&self) -> Self {
        let offset = |index: usize| self.layout().nuisances_of(index)[0].clone();
        let mut rested = self.clone();
        rested.nuisances = (0..self.spans.len()).map(offset).collect();
        rested
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
