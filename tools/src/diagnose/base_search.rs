//! The search beside one base: from recordings and a model to what was found, before any number is reported.

use gmhm::{Elastic, Law, Memory};

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::past::{has_slip_elements, other_pasts};
use crate::diagnose::reduction::{loses_waves, rows_of_mean};
use crate::diagnose::selection::Selection;
use crate::diagnose::suggestion::Suggestion;
use crate::fit::thresholds::THRESHOLDS;
use crate::model::Model;
use crate::numerics::autoregression::mark_outliers;
use crate::numerics::robust;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::assembly::from_cycle;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// The search takes means of a gear's signals where they change the torque of the base model by less than this share of its residual (rms).
const LOST_IN_MEANS: f64 = 0.01;

/// Friction of the wrong sign that would save this share of what is predictable: the torque is on the other side of the gear.
const WRONG_SIGN: f64 = 0.02;

/// The other side has to lessen error and prices by this share of what is predictable.
const LEAST_BETTER: f64 = 0.005;

/// The base with the torque on the other side has to leave less than this share of the error on blocks held out, where friction or inertia of the base is held at zero; as in a fit.
const SIDE_BETTER_SHARE: f64 = THRESHOLDS.side_better_share;

/// e and h of the published gear over its stiffness, T_A/A (MODEL.md section 6): where a fit of law `masing` starts.
const USUAL_E: f64 = 0.188;
const USUAL_H: f64 = 0.101;

/// Steps of plain least squares.
const PLAIN_STEPS: usize = 8;

/// A search beside one base.
pub(super) struct BaseSearch<'a, 'r> {
    /// All rows.
    pub dataset: Dataset<'a>,
    /// The rows that are searched.
    pub thin: Dataset<'a>,
    /// What was found.
    pub found: Searched<'r>,
    /// Whether the base had to be held as it was given.
    pub base_held: bool,
    /// Rows near standstill that are not used.
    pub skipped: usize,
}

impl<'a, 'r> BaseSearch<'a, 'r> {
    /// Refits the base and searches for what it lacks.
    ///
    /// # Errors
    /// Recordings that cannot be used, a model that cannot be evaluated, or `progress` cancelling.
    pub fn of(
        recordings: &'a [Recording],
        model: &Model,
        search: Search<'r>,
        progress: &dyn Progress,
    ) -> Result<Self, DiagnoseError> {
        let mut dataset = Dataset::new(recordings, model)?.with_base(model);
        progress.report("refitting the base model", 0.05);
        let mut plain = dataset.fit(model, &dataset.parameters(model, search), None, 2)?;
        dataset.mark_outliers(&plain);
        if dataset.allow_any_past(&plain)? {
            plain = dataset.fit(model, &dataset.parameters(model, search), None, 2)?;
        }
        let skipped = dataset.skip_disturbed(recordings, &plain, search.seed)?;
        if skipped > 0 {
            plain = dataset.fit(model, &dataset.parameters(model, search), None, 2)?;
        }
        check(progress)?;
        progress.report("searching", 0.15);
        let rows = rows_of_mean(&dataset.recordings, model.gear.ratio, dataset.is_far_from(&plain));
        let thin = dataset.thinned(rows, &plain.residual);
        let mut thin = thin.in_means_within(LOST_IN_MEANS * dataset.rms(&plain.residual), &plain.model)?;
        let mut found = thin.searched(model, plain, search, progress)?;
        let mut base_held = false;
        let as_given = thin.rms(&thin.centred(&thin.total(model)?));
        if found.verdict.mismatch && thin.rms_of_blocks(&found.verdict.extended) > as_given {
            let held = Search { held_terms: Some(model.terms.len()), ..search };
            let plain = thin.fit(model, &thin.parameters(model, held), None, 0)?;
            let beside_given = thin.searched(model, plain, held, progress)?;
            if thin.rms_of_blocks(&beside_given.verdict.extended) < as_given {
                (found, base_held) = (beside_given, true);
            }
        }
        for past in other_pasts(&dataset, &thin, &found.verdict.extended, search.base_terms)? {
            let plain = past.thin.fit(model, &past.thin.parameters(model, search), None, 2)?;
            let again = past.thin.searched(model, plain, search, progress)?;
            let own = past.thin.rms_of_blocks(&again.verdict.extended);
            let left = thin.rms_of_blocks(&found.verdict.extended);
            let fewer = again.verdict.effects.len() < found.verdict.effects.len();
            let most_left = if fewer { past.most_left.min(1.0) } else { past.most_left };
            // Where nothing is found beside it, the past itself may stand for what a short recording does not determine of the base.
            if has_slip_elements(&again.verdict.extended, search.base_terms) && own < most_left * left {
                (dataset, thin, found, base_held) = (past.dataset, past.thin, again, false);
            }
        }
        Ok(Self { dataset, thin, found, base_held, skipped })
    }

    /// The rms error of the extended model on held-out blocks, N·m.
    pub fn left(&self) -> f64 {
        self.thin.rms_of_blocks(&self.found.verdict.extended)
    }

    /// A fit to the rows searched, fitted to all.
    pub fn on_all_rows(&self, fit: Fitted) -> Result<Fitted, DiagnoseError> {
        if self.thin.len() == self.dataset.len() {
            return Ok(fit);
        }
        self.dataset.refitted_alike(&fit)
    }

    /// The base that a mismatch was seen beside, with law `masing` in place of another, for a fit to start from. The memory of laws `phase` and `time` runs on with the motion, and
    /// takes a part of every other hysteresis that no term found beside it can give back.
    pub fn with_law_masing(&self) -> Option<Model> {
        let mut model = self.found.verdict.base.model.clone();
        let rated_rad = model.gear.rated_deflection_rad?;
        let replaced = |memory: &&mut Memory| self.found.verdict.mismatch && memory.law != Law::Masing;
        let memory = model.memory.as_mut().filter(replaced)?;
        let stiffness = 0.5 * self.dataset.torque_span() / rated_rad;
        let (alpha, beta_per_s, omega_per_s) = from_cycle(USUAL_E * stiffness, USUAL_H * stiffness, 1.0);
        *memory = Memory { law: Law::Masing, alpha, beta_per_s, omega_per_s, ..Memory::default() };
        model.elastic = Some(Elastic { c1_nm_per_rad: stiffness, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 });
        Some(model)
    }
}

/// What a search finds.
pub(super) struct Searched<'r> {
    /// The verdict.
    pub verdict: DiagnosisVerdict,
    /// What the joint selection found.
    pub selection: Selection,
    /// As the search was done.
    pub search: Search<'r>,
    /// Settings that are probably wrong.
    pub suggestions: Vec<Suggestion>,
}

/// Ends a diagnosis that was cancelled.
pub(super) fn check(progress: &dyn Progress) -> Result<(), DiagnoseError> {
    if progress.cancelled() { Err(DiagnoseError::Cancelled) } else { Ok(()) }
}

impl Dataset<'_> {
    /// Searches for what a given model lacks from that model fitted, also with the torque on the other side of the gear where friction has the wrong sign, or the base explains more there.
    fn searched<'r>(
        &self,
        given: &Model,
        mut plain: Fitted,
        search: Search<'r>,
        progress: &dyn Progress,
    ) -> Result<Searched<'r>, DiagnoseError> {
        let mut suggestions = Vec::new();
        let mut base = self.plain_fit(&plain.model, &self.parameters(&plain.model, search), PLAIN_STEPS)?;
        let mut selection = self.select_beside_delays(&base, search)?;
        check(progress)?;
        let is_of_wrong_sign = selection.friction_of_wrong_sign > WRONG_SIGN;
        let is_held = base.parameters.iter().any(|parameter| self.is_held(&base.model, *parameter));
        if is_of_wrong_sign || is_held {
            let mut other = plain.model.clone();
            other.gear.torque_side = other.gear.torque_side.other();
            if is_held {
                // Without friction its smoothing means nothing.
                other.terms.clone_from(&given.terms);
            }
            let fit = self.plain_fit(&other, &self.parameters(&other, search), PLAIN_STEPS)?;
            let is_better_base = self.rms_of_blocks(&fit) < SIDE_BETTER_SHARE * self.rms_of_blocks(&base);
            if is_of_wrong_sign || is_better_base {
                let turned = self.select_beside_delays(&fit, search)?;
                // With all that was selected, too: beside a load that the base lacks, inertia of the wrong sign explains much.
                let leaves_less = |share: f64| turned.selected_squares < share * selection.selected_squares;
                let costs_less = turned.objective < selection.objective - LEAST_BETTER;
                if is_of_wrong_sign && costs_less && leaves_less(1.0)
                    || is_better_base && leaves_less(SIDE_BETTER_SHARE.powi(2))
                {
                    suggestions.push(Suggestion::TorqueSide(other.gear.torque_side));
                    (base, selection) = (fit, turned);
                    plain = self.fit(&other, &self.parameters(&other, search), None, 2)?;
                }
            }
        }
        let selection = self.with_friction_shapes(&base, selection, search)?;
        progress.report("searching", 0.35);
        let (mut verdict, search) = self.decided(&plain.model, base, &selection, search)?;
        self.settle_classes(&mut verdict, search)?;
        self.unite_at_locked_input(&mut verdict, search)?;
        self.withhold_similar_kinds(&mut verdict, search)?;
        self.withdraw_unestablished(&mut verdict, search)?;
        self.with_friction_of_one_speed(&mut verdict, search)?;
        self.with_unnamed_rest(&mut verdict);
        verdict.extended = self.with_slipping_elements(verdict.extended, search)?;
        check(progress)?;
        Ok(Searched { verdict, selection, search, suggestions })
    }

    /// A fit to other rows of these recordings, fitted to these by the same criterion.
    pub(super) fn refitted_alike(&self, fit: &Fitted) -> Result<Fitted, DiagnoseError> {
        Ok(if fit.plain {
            self.plain_fit(&fit.model, &fit.parameters, 3)?
        } else {
            self.or_plain(self.fit(&fit.model, &fit.parameters, None, 3)?)?
        })
    }

    /// The same rows in means of the signals where a gear moves so slowly that its torque along them differs by at most `allowed` (rms) from the means of its torque, and the motor so slowly that no wave of its turn is lost.
    fn in_means_within(self, allowed: f64, model: &Model) -> Result<Self, DiagnoseError> {
        if self.stride == 1 || !model.has_gear() || loses_waves(&self.recordings, self.stride) {
            return Ok(self);
        }
        let means = self.with_mean_signals();
        let lost: Vec<f64> = self.total(model)?.iter().zip(&means.total(model)?).map(|(a, b)| a - b).collect();
        let lost = self.without_offsets(&self.layout().white(), &lost);
        Ok(if self.rms(&lost) < allowed { means } else { self })
    }

    /// Root mean square of the rows that count.
    pub(super) fn rms(&self, residual: &[f64]) -> f64 {
        (self.layout().squares(residual) / self.counted().max(1) as f64).sqrt()
    }

    /// Marks isolated rows that stand out of a fit's residual.
    fn mark_outliers(&mut self, fit: &Fitted) {
        for ((span, marks), recording) in self.spans.iter().zip(&mut self.marks).zip(&self.recordings) {
            let before = marks.clone();
            mark_outliers(&fit.residual[span.clone()], marks);
            // What stands out where a motion turns is physics, not a fault of a sample.
            let motions = [&recording.deflection_rad, &recording.theta_out_rad, &recording.theta_in_rad];
            for row in motions.into_iter().flatten().flat_map(|motion| turns(motion)) {
                let near = row.saturating_sub(3)..(row + 4).min(marks.len());
                marks[near.clone()].copy_from_slice(&before[near]);
            }
        }
    }
}

/// Rows about which a signal turns round or its slope breaks; none where it does little else, as noise at rest does.
fn turns(x: &[f64]) -> Vec<usize> {
    let bend = |w: &[f64]| (w[2 * LAG] - 2.0 * w[LAG] + w[0]).abs();
    let mut bends: Vec<f64> = x.windows(2 * LAG + 1).map(bend).collect();
    let median = robust::median(&mut bends).max(f64::MIN_POSITIVE);
    let turned = |w: &[f64]| (w[2 * LAG] - w[LAG]) * (w[LAG] - w[0]) <= 0.0 || bend(w) > 8.0 * median;
    let rows: Vec<usize> =
        x.windows(2 * LAG + 1).enumerate().filter(|(_, w)| turned(w)).map(|(row, _)| row + LAG).collect();
    if 2 * rows.len() > x.len() { Vec::new() } else { rows }
}

/// Over so many rows before and after a signal is seen to turn.
const LAG: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{TEST_GEAR, parse};

    #[test]
    fn a_gear_is_followed_along_means_only_where_it_moves_slowly() {
        let model = parse("gear.toml", TEST_GEAR).unwrap();
        for (rad_per_s, in_means) in [(2.0, true), (600.0, false)] {
            let time_s: Vec<f64> = (0..6000).map(|row| 0.001 * f64::from(row)).collect();
            let mut recording = Recording {
                name: "gear".into(),
                deflection_rad: Some(time_s.iter().map(|t| 8e-4 * (rad_per_s * t).sin()).collect()),
                time_s: time_s.into(),
                ..Recording::default()
            };
            recording.torque = Some(crate::physics::predict(&model, None, &recording).unwrap().torque.into());
            let recordings = [recording];
            let dataset = Dataset::new(&recordings, &model).unwrap();
            let thin = dataset.thinned(4, &vec![0.0; dataset.len()]).in_means_within(0.01, &model).unwrap();
            assert_eq!(thin.stride == 1, in_means, "{rad_per_s} rad/s");
            assert_eq!(thin.len(), 1500);
        }
    }
}
