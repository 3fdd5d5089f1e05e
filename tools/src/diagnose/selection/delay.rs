//! A delay of the torque that is too long for its derivative to show: the phase of a ripple turns with it.

use gmhm::terms::Resampled;

use super::Selection;
use super::dictionary::Dictionary;
use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::{self, is_delay};
use crate::kinds;
use crate::kinds::build::{number, term};
use crate::model::Term;
use crate::numerics::block_gram::{BlockGram, Chosen};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// Delays that are tried: up to what `time_skew` accepts, s,
const LONGEST_S: f64 = 0.018;
/// so far from each other, or by a row, s.
const STEP_S: f64 = 0.001;
/// A delay is tried if free functions leave at most this part of the squares beside it.
const LEAVES: f64 = 0.8;
/// A selection beside a delay stands if it leaves at most this part of the squares of that without.
const BETTER: f64 = 0.8;

/// Delays of both signs on a grid, none in the middle.
fn delays(period_s: f64) -> Vec<f64> {
    let step = STEP_S.max(period_s);
    let most = (LONGEST_S / step).floor() as i32;
    (-most..=most).map(|k| f64::from(k) * step).collect()
}

impl Dataset<'_> {
    /// The delay of the torque beside which free functions leave least, s; `None` where they leave little less than beside none. Beside a gear none is looked for: the
    /// derivative of its torque shows a delay, and its loops resemble one.
    pub(super) fn likely_delay(
        &self,
        dictionary: &Dictionary,
        gram: &BlockGram,
        (free, ridge): (&[usize], f64),
        fit: &Fitted,
    ) -> Option<f64> {
        if fit.model.has_gear() {
            return None;
        }
        let time = self.time_s();
        let delays = delays(self.period_s());
        let mut targets: Vec<Vec<f64>> = delays.iter().map(|d| self.target_beside(*d, &time, fit)).collect();
        Dictionary::without_own(self, &dictionary.counts, &mut targets);
        let targets = gram.targets(&dictionary.columns, &targets, &dictionary.counts);
        let blocks = gram.errors(&targets, &Chosen::with_free(&dictionary.base, free, ridge));
        let left: Vec<f64> = (0..delays.len()).map(|k| blocks.iter().map(|b| b[k]).sum()).collect();
        let best = (0..delays.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        let none = left[delays.len() / 2];
        (left[best] < LEAVES * none).then(|| delays[best])
    }

    /// What a fit leaves of the torque, had that come earlier by a delay.
    fn target_beside(&self, delay_s: f64, time: &[f64], fit: &Fitted) -> Vec<f64> {
        let mut target = Vec::with_capacity(time.len());
        for span in &self.spans {
            let time = &time[span.clone()];
            let mut torque = Resampled::new(time, &self.target[span.clone()]);
            let rows = time.iter().zip(span.clone());
            target.extend(rows.map(|(t, row)| torque.at(t + delay_s) - (self.target[row] - fit.residual[row])));
        }
        target
    }

    /// A selection, or one beside a delay of the torque where that leaves much less.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn select_beside_delays(&self, base: &Fitted, search: explain::Search<'_>) -> Result<Selection, DiagnoseError> {
        let selection = self.select(base, search, 1.0)?;
        let is_open = |delay: &Term| search.allows(&delay.kind) && !base.model.terms.iter().any(is_delay);
        let Some(delay) = selection.likely_delay_s.and_then(delay_of).filter(is_open) else { return Ok(selection) };
        let mut model = base.model.clone();
        model.terms.push(delay);
        // Beside no other kind the delay would be fitted to something else.
        let start = self.plain_fit(&model, &self.parameters(&model, search), 0)?;
        let delayed = self.select_from(&start, Some(selection.reference()), search, 1.0)?;
        let is_kept = delayed.selected.iter().any(|s| kinds::of(s.kind).is_some_and(kinds::shifts_time));
        let is_better = is_kept && delayed.selected_squares < BETTER * selection.selected_squares;
        Ok(if is_better { delayed } else { selection })
    }
}

/// The term that delays the torque.
fn delay_of(delay_s: f64) -> Option<Term> {
    let info = kinds::ALL.iter().filter(|kind| kinds::shifts_time(**kind)).find_map(|kind| kind.info())?;
    let key = info.keys.first()?;
    Some(term(info.name, &[(key.name, number(delay_s))]))
}
