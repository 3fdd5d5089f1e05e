//! What these recordings could not have shown, and the experiment that would.

use gmhm::terms::{KINDS, KindInfo};

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::{UNKNOWN, Undecidable};
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::kinds::library;
use crate::numerics::basis::Basis;
use crate::numerics::qr::dot;
use crate::regression::dataset::Dataset;

/// An effect whose plausible size leaves fewer squared deviations of noise than this could not have been seen.
const VISIBLE: f64 = 40.0;

/// An experiment of the bench.
struct Experiment {
    /// Its name in `gmhm simulate`.
    name: &'static str,
    /// What to do, in words.
    words: &'static str,
    /// The kinds that it shows.
    shows: &'static [&'static str],
}

const EXPERIMENTS: [Experiment; 5] = [
    Experiment {
        name: "running",
        words: "let the motor run forth and back at several speeds while the brake load varies slowly, both angles recorded",
        shows: &[
            "kinematic_error",
            "torque_ripple",
            "encoder_eccentricity",
            "gravity_load",
            "coulomb_friction",
            "viscous_friction",
            "stribeck_friction",
            "load_dependent_friction",
            "position_dependent_friction",
        ],
    },
    Experiment {
        name: "rates",
        words: "repeat the load cycle with the input locked at rates a decade apart",
        shows: &["viscous_damping", "inertia", "time_skew", "viscous_friction", "coulomb_friction"],
    },
    Experiment {
        name: "amplitudes",
        words: "load and unload with the input locked at four amplitudes from a tenth of the rated torque up, small loops among them",
        shows: &["soft_windup", "stiffness_asymmetry", "backlash", "nonlocal_memory"],
    },
    Experiment {
        name: "cycle",
        words: "hold the load for minutes after each reversal, before and after warming the gear up, temperature recorded",
        shows: &["creep", "thermal_stiffness", "thermal_zero_drift", "thermal_friction", "sensor_drift", "wear"],
    },
    Experiment {
        name: "dynamic",
        words: "load the output with band-limited noise up to the control bandwidth",
        shows: &["inertia", "time_skew", "viscous_damping"],
    },
];

/// The experiment that shows a kind.
fn revealing(kind: &str) -> &'static Experiment {
    EXPERIMENTS.iter().find(|e| e.shows.contains(&kind)).unwrap_or(&EXPERIMENTS[0])
}

/// Kinds of which a plausible size would not stand out of the noise of these recordings.
pub fn undecidable(
    dataset: &Dataset<'_>,
    verdict: &DiagnosisVerdict,
    search: Search<'_>,
) -> Result<Vec<Undecidable>, DiagnoseError> {
    let fit = &verdict.extended;
    let evaluations = dataset.evaluate(&fit.model)?;
    let proposals = library::proposals(dataset, &evaluations, fit, search);
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
    let joint = fit.model.elastic.is_none();
    let open = |info: &&KindInfo| {
        let found = fit.model.terms.iter().any(|t| t.kind == info.name)
            || verdict.effects.iter().any(|e| e.equivalents.iter().any(|k| k == info.name));
        let of_gear = info.needs.iter().any(|n| matches!(n, gmhm::terms::Need::Deflection | gmhm::terms::Need::Gear));
        info.name != UNKNOWN && search.allows(info.name) && !found && !(joint && of_gear) && !visible(info)
    };
    let line = |info: &KindInfo| {
        let experiment = revealing(info.name);
        Undecidable { name: info.name.to_owned(), experiment: experiment.words.to_owned() }
    };
    Ok(KINDS.iter().filter(open).map(line).collect())
}

/// The experiment that splits most of what is still open: kinds of one class first, then what could not have been seen.
pub fn next(verdict: &DiagnosisVerdict, undecidable: &[Undecidable]) -> String {
    let classes = verdict.effects.iter().filter(|e| !e.equivalents.is_empty());
    let members: Vec<&str> = classes
        .clone()
        .flat_map(|e| std::iter::once(e.name.as_str()).chain(e.equivalents.iter().map(String::as_str)))
        .collect();
    let worth = |e: &Experiment| {
        let split = members.iter().filter(|k| e.shows.contains(k)).count();
        // An experiment that shows some of a class and not others tells them apart.
        let splits = if split > 0 && split < members.len() { 10 * split } else { 3 * split };
        splits + undecidable.iter().filter(|u| e.shows.contains(&u.name.as_str())).count()
    };
    let Some(best) = EXPERIMENTS.iter().max_by_key(|e| worth(e)).filter(|e| worth(e) > 0) else { return String::new() };
    let aim = if members.is_empty() {
        "would show what these recordings could not have".to_owned()
    } else {
        format!("would tell {} apart", members.join(", "))
    };
    format!("gmhm simulate M.toml --experiment {} -o next.csv: {}; it {aim}", best.name, best.words)
}
