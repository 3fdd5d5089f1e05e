//! The diagnosis: from recordings and a model to findings, an extended model and the numbers that go with them.

use gmhm::{Elastic, Law, Memory};

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::{Diagnosis, FALSE_ALARM_RATE, Heldout, HeldoutFrom, Rms, UNKNOWN, Unit};
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::next_experiment;
use crate::diagnose::reduction::reduced;
use crate::diagnose::report_data::ReportData;
use crate::diagnose::selection::Selection;
use crate::diagnose::suggestion::{self, Suggestion};
use crate::fit::zeros::other_zeros;
use crate::model::{Base, Model};
use crate::numerics::autoregression::mark_outliers;
use crate::numerics::vector::dot;
use crate::progress::Progress;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::assembly::from_cycle;
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;
use crate::signal::plausible;
use crate::signal::plausible::Remark;

/// Rows that the search looks at: means where there are more. The final fit takes all.
const SEARCH_ROWS: usize = 10_000;

/// Rows that are fitted. Of longer recordings means are, the motion's as well as the torque's, or stretches.
const MOST_ROWS: usize = 250_000;

/// How a diagnosis is done.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Kinds that may not be used.
    pub removed: Vec<String>,
    /// The rated deflection, where the model has none, rad.
    pub rated_deflection_rad: Option<f64>,
    /// The seed of every random choice.
    pub seed: u64,
}

/// A diagnosis with all that a report shows of it.
pub struct Finding {
    /// What `--json` writes.
    pub diagnosis: Diagnosis,
    /// The extended model; the refitted base where nothing was found.
    pub model: Model,
    /// The verdict that it rests on.
    pub verdict: DiagnosisVerdict,
    /// Rows and spectra for figures.
    pub report_data: ReportData,
    /// What is odd about the recordings beside the model given.
    pub remarks: Vec<Remark>,
}

/// Diagnoses recordings of one gear or joint against a model.
///
/// # Errors
/// Recordings that cannot be used, a model that cannot be evaluated, or `progress` cancelling.
pub fn diagnose(
    recordings: &[Recording],
    model: &Model,
    holdout: &[Recording],
    options: &Options,
    progress: &dyn Progress,
) -> Result<Finding, DiagnoseError> {
    if recordings.is_empty() {
        return Err(EstimateError::NoRecording.into());
    }
    let model = prepared(model, recordings, options)?;
    let mut remarks = plausible::examine(recordings, holdout, &model)?;
    let (recordings, of_rows) = reduced(recordings, model.gear.ratio, MOST_ROWS);
    let recordings = &recordings[..];
    remarks.extend(of_rows);
    progress.report("reading", 0.0);
    let search = Search {
        removed: &options.removed,
        only: None,
        base_terms: model.terms.len(),
        held_terms: None,
        zero: false,
        seed: options.seed,
    };
    let mut begun = Begun::of(recordings, &model, search, progress)?;
    let given = begun.dataset.centred(&begun.dataset.total(&model)?);
    // The model that steady terms stand beside, and the refit of the law given where another is better.
    let (mut beside, mut of_law_given) = (model.clone(), None);
    if let Some(masing) = begun.with_law_masing() {
        let mut other = Begun::of(recordings, &masing, search, progress)?;
        if other.found.verdict.mismatch && other.left() < OTHER_LAW * begun.left() {
            beside = other.found.verdict.base.model.clone();
            other.found.selection.base_squares = begun.found.selection.base_squares;
            other.found.suggestions.push(Suggestion::Law(Law::Masing));
            let fit = std::mem::replace(&mut begun, other);
            of_law_given = Some(fit.on_all_rows(fit.found.verdict.base.clone())?);
        }
    }
    if begun.base_held {
        remarks.push(Remark::BaseHeld);
    }
    let Begun { dataset, thin, found, .. } = begun;
    let Searched { mut verdict, selection, search, mut suggestions } = found;
    progress.report("judging", 0.6);
    if verdict.mismatch {
        remarks.extend(other_zeros(recordings, &model));
    }
    let undecidable = next_experiment::undecidable(&thin, &verdict, search)?;
    let locations = if verdict.mismatch { thin.where_it_sits(&verdict) } else { Vec::new() };
    progress.report("fitting all rows", 0.8);
    if thin.len() < dataset.len() {
        for fit in [&mut verdict.base, &mut verdict.extended] {
            *fit = dataset.refitted_alike(fit)?;
        }
    }
    verdict.extended = dataset.steady(&beside, &verdict.base, verdict.extended, search)?;
    verdict.extended = dataset.with_curves_apart(verdict.extended, search)?;
    dataset.drop_curves(&mut verdict, search)?;
    verdict.extended = dataset.with_base_unchanged(&beside, verdict.extended, search)?;
    let (extended, mut variances) = dataset.among_shapes(verdict.extended, search)?;
    verdict.extended = extended;
    dataset.add_soft_edges(&verdict.extended, search, &mut variances)?;
    verdict.base = of_law_given.unwrap_or(verdict.base);
    check(progress)?;
    progress.report("checking on rows held out", 0.9);
    let rms = Rms {
        given: dataset.rms(&given),
        refitted: dataset.rms(&verdict.base.residual),
        extended: dataset.rms(&verdict.extended.residual),
    };
    let [base_left, extended_left] = [&verdict.base, &verdict.extended].map(|fit| dataset.rms_of_blocks(fit));
    let heldout = if holdout.is_empty() {
        Heldout {
            rms: Rms { given: rms.given, refitted: base_left, extended: extended_left },
            from: HeldoutFrom::Blocks,
        }
    } else {
        let unseen = Dataset::new(holdout, &model)?;
        let left = |m: &Model| -> Result<f64, DiagnoseError> { Ok(unseen.rms(&unseen.centred(&unseen.total(m)?))) };
        Heldout {
            rms: Rms {
                given: left(&model)?,
                refitted: left(&verdict.base.model)?,
                extended: left(&verdict.extended.model)?,
            },
            from: HeldoutFrom::Recordings,
        }
    };
    let reported = |kind: &str| verdict.effects.iter().any(|e| e.name == kind && e.share >= suggestion::LEAST_SHARE);
    suggestions.extend(suggestion::of_model(&verdict.extended.model, search.base_terms, reported));
    let unit = match dataset.torque_unit() {
        TorqueUnit::NewtonMetre => Unit::NewtonMetre,
        TorqueUnit::Ampere => Unit::Ampere,
    };
    let explained = (1.0 - (extended_left / base_left.max(f64::MIN_POSITIVE)).powi(2)).clamp(0.0, 1.0);
    let base_squares = base_left.powi(2).max(f64::MIN_POSITIVE);
    let named = (1.0 - dataset.left_by_kinds(&verdict, search)? / base_squares).clamp(0.0, 1.0);
    let noise_rms = rms.extended * verdict.noise_part;
    let next_experiment = next_experiment::next(&verdict, &undecidable);
    let diagnosis = Diagnosis {
        mismatch: verdict.mismatch,
        false_alarm_rate: FALSE_ALARM_RATE,
        unit,
        noise_rms,
        rms,
        heldout,
        // What neither likelihood nor a kind or curve confirms, free functions predict by chance.
        predictable: if verdict.mismatch { selection.predictable().max(explained) } else { explained },
        explained,
        named,
        locations,
        suggestions,
        effects: dataset.effects(&verdict, &variances),
        undecidable,
        next_experiment,
    };
    let mut extended = verdict.extended.model.clone();
    extended.terms.retain(|t| t.kind != UNKNOWN || verdict.mismatch);
    progress.report("done", 1.0);
    let report_data = ReportData::new(&dataset, &verdict)?;
    Ok(Finding { diagnosis, model: extended, verdict, report_data, remarks })
}

fn check(progress: &dyn Progress) -> Result<(), DiagnoseError> {
    if progress.cancelled() { Err(DiagnoseError::Cancelled) } else { Ok(()) }
}

/// A diagnosis up to the search.
struct Begun<'a, 'r> {
    /// All rows.
    dataset: Dataset<'a>,
    /// The rows that are searched.
    thin: Dataset<'a>,
    found: Searched<'r>,
    /// Whether the base had to be held as it was given.
    base_held: bool,
}

impl<'a, 'r> Begun<'a, 'r> {
    fn of(
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
        check(progress)?;
        progress.report("searching", 0.15);
        let stride = dataset.len().div_ceil(SEARCH_ROWS);
        let thin = dataset.thinned(stride, &plain.residual);
        let thin = thin.in_means_within(LOST_IN_MEANS * dataset.rms(&plain.residual), &plain.model)?;
        let mut found = thin.searched(plain, search, progress)?;
        let mut base_held = false;
        let as_given = thin.rms(&thin.centred(&thin.total(model)?));
        if found.verdict.mismatch && thin.rms_of_blocks(&found.verdict.extended) > as_given {
            let held = Search { held_terms: Some(model.terms.len()), ..search };
            let plain = thin.fit(model, &thin.parameters(model, held), None, 0)?;
            let beside_given = thin.searched(plain, held, progress)?;
            if thin.rms_of_blocks(&beside_given.verdict.extended) < as_given {
                (found, base_held) = (beside_given, true);
            }
        }
        Ok(Self { dataset, thin, found, base_held })
    }

    /// What the extended model leaves on blocks held out, rms.
    fn left(&self) -> f64 {
        self.thin.rms_of_blocks(&self.found.verdict.extended)
    }

    /// A fit to the rows searched, fitted to all.
    fn on_all_rows(&self, fit: Fitted) -> Result<Fitted, DiagnoseError> {
        if self.thin.len() < self.dataset.len() { self.dataset.refitted_alike(&fit) } else { Ok(fit) }
    }

    /// The base that a mismatch was seen beside, with law `masing` in place of another, for a fit to start from. The memory of laws `phase` and `time` runs on with the motion, and
    /// takes a part of every other hysteresis that no term found beside it can give back.
    fn with_law_masing(&self) -> Option<Model> {
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
struct Searched<'r> {
    verdict: DiagnosisVerdict,
    selection: Selection,
    /// As the search was done.
    search: Search<'r>,
    suggestions: Vec<Suggestion>,
}

/// The search takes means of a gear's signals where they change the torque of the base model by less than this share of its residual (rms).
const LOST_IN_MEANS: f64 = 0.01;

/// Friction of the wrong sign that would save this share of what is predictable: the torque is on the other side of the gear.
const WRONG_SIGN: f64 = 0.1;

/// The other side has to lessen error and prices by this share of what is predictable.
const LEAST_BETTER: f64 = 0.02;

/// e and h of the published gear over its stiffness, T_A/A (MODEL.md section 6): where a fit of law `masing` starts.
const USUAL_E: f64 = 0.188;
const USUAL_H: f64 = 0.101;

/// What is found beside another law counts where it leaves at most this part (rms, held out) of what is found beside the law given.
const OTHER_LAW: f64 = 0.9;

/// Steps of plain least squares.
const PLAIN_STEPS: usize = 8;

/// The model as the search uses it: canonical signs, a rated deflection.
fn prepared(model: &Model, recordings: &[Recording], options: &Options) -> Result<Model, DiagnoseError> {
    let mut model = model.clone();
    if recordings.iter().all(|r| r.torque_sim_nm.is_some()) && !model.is_simulation() {
        // Another simulator's torque stands in for the base model.
        (model.elastic, model.memory, model.terms) = (None, None, Vec::new());
        model.gear.base = Base::Simulation;
    }
    // Another simulator may stand in for a gear on a bench. The two encoders of a joint differ by more than its deflection.
    let is_bench = |r: &Recording| r.deflection_rad.is_some() && r.theta_out_rad.is_none();
    let is_of_gear = options.rated_deflection_rad.is_some() || recordings.iter().all(is_bench);
    let is_simulated_gear = model.is_simulation() && is_of_gear;
    if !model.has_gear() && !is_simulated_gear {
        return Ok(model);
    }
    let zero = model.gear.deflection_zero_rad;
    let seen = || {
        let derived = |r: &Recording| {
            let mut r = r.clone();
            r.derive_deflection(model.gear.ratio).ok()?;
            r.largest_deflection_rad(zero)
        };
        recordings.iter().filter_map(derived).fold(None, |a: Option<f64>, x| Some(a.map_or(x, |a| a.max(x))))
    };
    let rated = options.rated_deflection_rad.or(model.gear.rated_deflection_rad).or_else(seen);
    model.gear.rated_deflection_rad = rated;
    if let Some(params) = rated.and_then(|a| model.params(a)) {
        let params = params.map_err(|error| crate::physics::PredictError::Params {
            rated_deflection_rad: rated.unwrap_or(f64::NAN),
            error,
        })?;
        model.memory = Some(params.memory());
    }
    Ok(model)
}

impl Dataset<'_> {
    /// Searches for what a model lacks from the model fitted, also with the torque on the other side of the gear where friction has the wrong sign.
    fn searched<'r>(
        &self,
        mut plain: Fitted,
        search: Search<'r>,
        progress: &dyn Progress,
    ) -> Result<Searched<'r>, DiagnoseError> {
        let mut suggestions = Vec::new();
        let mut base = self.plain_fit(&plain.model, &self.parameters(&plain.model, search), PLAIN_STEPS)?;
        let mut selection = self.select_beside_delays(&base, search)?;
        check(progress)?;
        if selection.friction_of_wrong_sign > WRONG_SIGN {
            let mut other = plain.model.clone();
            other.gear.torque_side = other.gear.torque_side.other();
            let fit = self.plain_fit(&other, &self.parameters(&other, search), PLAIN_STEPS)?;
            let turned = self.select_beside_delays(&fit, search)?;
            if turned.objective < selection.objective - LEAST_BETTER {
                suggestions.push(Suggestion::TorqueSide(other.gear.torque_side));
                (base, selection) = (fit, turned);
                plain = self.fit(&other, &self.parameters(&other, search), None, 2)?;
            }
        }
        progress.report("searching", 0.35);
        let (mut verdict, search) = self.decided(&plain.model, base, &selection, search)?;
        self.settle_classes(&mut verdict, search)?;
        self.unite_with_memory(&mut verdict, search)?;
        self.withhold_similar_kind(&mut verdict, search)?;
        check(progress)?;
        Ok(Searched { verdict, selection, search, suggestions })
    }

    /// A fit to other rows of these recordings, fitted to these by the same criterion.
    fn refitted_alike(&self, fit: &Fitted) -> Result<Fitted, DiagnoseError> {
        Ok(if fit.plain {
            self.plain_fit(&fit.model, &fit.parameters, 3)?
        } else {
            self.or_plain(self.fit(&fit.model, &fit.parameters, None, 3)?)?
        })
    }

    /// The same on means of the signals where a gear moves so slowly that its torque along them differs by at most `allowed` (rms) from the means of its torque.
    fn in_means_within(self, allowed: f64, model: &Model) -> Result<Self, DiagnoseError> {
        if self.stride == 1 || !model.has_gear() {
            return Ok(self);
        }
        let means = self.with_mean_signals();
        let lost: Vec<f64> = self.total(model)?.iter().zip(&means.total(model)?).map(|(a, b)| a - b).collect();
        let lost = self.without_offsets(&self.layout().white(), &lost);
        Ok(if self.rms(&lost) < allowed { means } else { self })
    }

    /// Root mean square of the rows that count.
    fn rms(&self, residual: &[f64]) -> f64 {
        let masked = self.layout().masked(residual);
        (dot(&masked, &masked) / self.counted().max(1) as f64).sqrt()
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
    let middle = bends.len() / 2;
    let median = bends.select_nth_unstable_by(middle, f64::total_cmp).1.max(f64::MIN_POSITIVE);
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
