//! The diagnosis: from recordings and a model to findings, an extended model and the numbers that go with them.

use gmhm::Law;

use crate::diagnose::DiagnoseError;
use crate::diagnose::base_search::{BaseSearch, Searched, check};
use crate::diagnose::diagnosis::{Diagnosis, FALSE_ALARM_RATE, Heldout, HeldoutFrom, Rms, UNKNOWN, Unit};
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::next_experiment;
use crate::diagnose::reduction::reduced;
use crate::diagnose::report_data::ReportData;
use crate::diagnose::suggestion::{self, Suggestion};
use crate::fit::zeros::other_zeros;
use crate::model::{Base, Model};
use crate::progress::Progress;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::signal::plausible;
use crate::signal::plausible::Remark;

/// The result with another law replaces that with the given law if its rms error on held-out blocks is smaller than this factor times the other; with fewer effects, if it is smaller.
const OTHER_LAW: f64 = 0.9;

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
    let mut begun = BaseSearch::of(recordings, &model, search, progress)?;
    let given = begun.dataset.centred(&begun.dataset.total(&model)?);
    // The model that steady terms stand beside, and the refit of the law given where another is better.
    let (mut beside, mut of_law_given) = (model.clone(), None);
    if let Some(masing) = begun.with_law_masing() {
        let mut other = BaseSearch::of(recordings, &masing, search, progress)?;
        let [own, of_given] = [&other, &begun].map(|search| search.found.verdict.effects.len());
        let allowed = if own < of_given { 1.0 } else { OTHER_LAW };
        if other.found.verdict.mismatch && other.left() < allowed * begun.left() {
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
    if begun.skipped > 0 {
        remarks.push(Remark::NearStandstill { rows: begun.skipped, of: begun.dataset.len() });
    }
    let BaseSearch { dataset, thin, found, .. } = begun;
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
    verdict.extended = dataset.with_slipping_elements(verdict.extended, search)?;
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
