//! What these recordings could not have shown, and the experiment that would.

use gmhm::terms::{KINDS, KindInfo};

use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates;
use crate::diagnose::diagnosis::{UNKNOWN, Undecidable};
use crate::diagnose::evidence::NextExperiment;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::kinds;
use crate::kinds::experiment::Experiment;
use crate::numerics::basis::Basis;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;

/// An effect whose plausible size leaves fewer squared deviations of noise than this could not have been seen.
const VISIBLE: f64 = 40.0;

/// Kinds of which a plausible size would not stand out of the noise of these recordings.
pub fn undecidable(
    dataset: &Dataset<'_>,
    verdict: &DiagnosisVerdict,
    search: Search<'_>,
) -> Result<Vec<Undecidable>, DiagnoseError> {
    let fit = &verdict.extended;
    let evaluations = dataset.evaluate(&fit.model)?;
    let proposals = candidates::proposals(dataset, &evaluations, fit, search);
    let layout = dataset.layout();
    let mut basis = Basis::default();
    for column in &fit.columns {
        basis.add(&layout.whiten(&fit.noise, column));
    }
    let visible = |info: &KindInfo| {
        proposals.iter().filter(|p| p.info.name == info.name).any(|p| {
            let column = &p.columns[p.columns.len() - 1];
            let (key, _) = p.keys[p.keys.len() - 1];
            let size = key.plausible.0.abs().max(key.plausible.1.abs());
            let mut white = layout.whiten(&fit.noise, column);
            basis.reduce(&mut white);
            // A tenth of what such a gear may have.
            dot(&white, &white) * (0.1 * size).powi(2) > VISIBLE
        })
    };
    let joint = !fit.model.has_gear();
    let open = |info: &&KindInfo| {
        let found = fit.model.has_term(info.name)
            || verdict.effects.iter().any(|e| e.equivalents.iter().any(|k| k == info.name));
        let of_gear = info.needs.iter().any(|n| matches!(n, gmhm::terms::Need::Deflection | gmhm::terms::Need::Gear));
        info.name != UNKNOWN && search.allows(info.name) && !found && !(joint && of_gear) && !visible(info)
    };
    let line = |info: &KindInfo| {
        let experiment = kinds::of(info.name).and_then(|kind| kind.experiments().first());
        let instruction = experiment.map_or("", |experiment| experiment.instruction());
        Undecidable { name: info.name.to_owned(), experiment: instruction.to_owned() }
    };
    Ok(KINDS.iter().filter(open).map(line).collect())
}

/// The experiment that splits most of what is still open: kinds of one class first, then what could not have been seen.
pub fn next(verdict: &DiagnosisVerdict, undecidable: &[Undecidable]) -> NextExperiment {
    let classes = verdict.effects.iter().filter(|e| !e.equivalents.is_empty());
    let members: Vec<&str> = classes
        .clone()
        .flat_map(|e| std::iter::once(e.name.as_str()).chain(e.equivalents.iter().map(String::as_str)))
        .collect();
    let shows = |e: &Experiment, name: &str| kinds::of(name).is_some_and(|kind| kind.experiments().contains(e));
    let worth = |e: &Experiment| {
        let split = members.iter().filter(|name| shows(e, name)).count();
        // An experiment that shows some of a class and not others distinguishes them.
        let splits = if split > 0 && split < members.len() { 10 * split } else { 3 * split };
        splits + undecidable.iter().filter(|u| shows(e, &u.name)).count()
    };
    let Some(best) = Experiment::ALL.iter().max_by_key(|e| worth(e)).filter(|e| worth(e) > 0) else {
        return NextExperiment::None;
    };
    let distinguishes = members.into_iter().map(str::to_owned).collect();
    NextExperiment::Bench { experiment: *best, distinguishes }
}
