//! The scorer, proved by detectors whose score is known beforehand.

use std::collections::{BTreeMap, HashMap};
use std::sync::LazyLock;

use gmhm_tools::diagnose::diagnosis::{
    Diagnosis, Effect, Heldout, Location, Naming, Parameter, ParameterValue, Rms, Side, Unit,
};
use gmhm_tools::diagnose::evidence::{Evidence, Sight};
use gmhm_tools::model::Model;
use gmhm_tools::prove::generator::{Case, case, case_seed};
use gmhm_tools::prove::key::Key;
use gmhm_tools::prove::table::{BlockRow, ProveReport};
use gmhm_tools::prove::{Detector, Found, Sealed, export, mix};
use gmhm_tools::recording::Recording;

const SEED: u64 = 11;
const CASES: usize = 30;

fn nothing() -> Diagnosis {
    Diagnosis::nothing(Unit::NewtonMetre, 0.1, Rms::default(), Heldout::default())
}

type Keys = HashMap<u64, Key>;
type Unseen = HashMap<u64, Vec<f64>>;

/// The keys, and the torques of motions that nobody saw: every oracle reads the same.
static ANSWERS: LazyLock<(Keys, Unseen)> = LazyLock::new(|| {
    let (mut keys, mut unseen) = (HashMap::new(), HashMap::new());
    for (index, spec) in mix::suite(SEED, CASES, &[]) {
        let Case { recordings, unseen: hidden, key, .. } = case(case_seed(SEED, index as u64), &spec);
        keys.insert(print(recordings[0].torque.as_ref().unwrap()), key);
        hidden.into_iter().for_each(|u| drop(unseen.insert(mark(&u.recording), u.torque_nm)));
    }
    (keys, unseen)
});

/// Reads the keys. `bias` moves each parameter by that many standard deviations; `twist` renames what it found.
struct Oracle {
    keys: &'static Keys,
    unseen: &'static Unseen,
    bias: f64,
    twist: fn(&str) -> String,
}

fn print(x: &[f64]) -> u64 {
    x.iter().fold(0, |h: u64, x| h.rotate_left(5) ^ x.to_bits())
}

fn mark(recording: &Recording) -> u64 {
    print(recording.deflection_rad.as_ref().or(recording.theta_out_rad.as_ref()).unwrap())
}

impl Oracle {
    fn new(bias: f64, twist: fn(&str) -> String) -> Self {
        let (keys, unseen) = &*ANSWERS;
        Self { keys, unseen, bias, twist }
    }
}

impl Detector for Oracle {
    fn diagnose(&self, recordings: &[Recording], base: &Model, _removed: &[String]) -> Result<Found, String> {
        let key = &self.keys[&print(recordings[0].torque.as_ref().unwrap())];
        let mut diagnosis = nothing();
        for hidden in key.effects.iter().filter(|e| e.visible) {
            let parameters = hidden.parameters.iter().map(|(name, value)| {
                let sd: Vec<f64> = value.numbers().iter().map(|x| 0.01 * x.abs()).collect();
                let moved = value.numbers().iter().zip(&sd).map(|(x, s)| x + self.bias * s).collect();
                let moved = if name == "orders" { value.clone() } else { ParameterValue::List(moved) };
                (name.clone(), Parameter { value: moved, sd: Some(ParameterValue::List(sd)), unit: String::new() })
            });
            let name = if hidden.listed { (self.twist)(&hidden.kind) } else { "unknown".to_owned() };
            diagnosis.effects.push(Effect {
                verdict: Naming::Named,
                fidelity: None,
                family: String::new(),
                closest: None,
                equivalents: hidden.class.iter().filter(|k| **k != name).cloned().collect(),
                name,
                confidence: 1.0,
                share: 1.0,
                parameters: parameters.collect::<BTreeMap<_, _>>(),
                side: Side::Plant,
                why: Evidence::Written(String::new()),
            });
            diagnosis.locations.push(Location {
                coordinate: hidden.coordinates[0].clone(),
                share: 1.0,
                detail: Sight::Written(String::new()),
                seconds: Vec::new(),
            });
        }
        diagnosis.mismatch = !diagnosis.effects.is_empty();
        Ok(Found { diagnosis, model: base.clone() })
    }

    fn predict(&self, _model: &Model, recording: &Recording) -> Result<Vec<f64>, String> {
        Ok(self.unseen[&mark(recording)].iter().map(|t| t + 7.0).collect())
    }
}

/// Sees nothing, ever.
struct Blind;

impl Detector for Blind {
    fn diagnose(&self, _: &[Recording], base: &Model, _: &[String]) -> Result<Found, String> {
        Ok(Found { diagnosis: nothing(), model: base.clone() })
    }

    fn predict(&self, _: &Model, _: &Recording) -> Result<Vec<f64>, String> {
        Err("it has no idea".to_owned())
    }
}

fn prove(detector: &dyn Detector) -> ProveReport {
    let mut report = Sealed::new(SEED, mix::suite(SEED, CASES, &[])).run(detector, &|_| ());
    report.note_left_out(CASES - report.cases.len());
    report
}

fn all(report: &ProveReport) -> &BlockRow {
    report.blocks.last().unwrap()
}

#[test]
fn an_oracle_scores_perfectly() {
    let report = prove(&Oracle::new(1.0, str::to_owned));
    let row = all(&report);
    assert_eq!(row.cases, CASES - 1, "the case that needs real noise is left out");
    for rate in [row.found, row.exact, row.class_hits, row.located, row.explained_well, row.coverage] {
        assert!(rate.of > 0 && rate.hits == rate.of, "{rate}\n{report}");
    }
    for block in &report.blocks {
        let full = [block.found, block.exact, block.class_hits, block.located, block.explained_well, block.coverage];
        assert!(full.iter().all(|rate| rate.hits == rate.of), "{}\n{report}", block.block);
        assert_eq!((block.false_alarms.hits, block.misnamed.hits, block.wrong_names, block.failed), (0, 0, 0, 0));
        assert!([block.class_size_ratio, block.f1].iter().flatten().all(|x| *x == 1.0), "{}", block.block);
        let powers = [block.explained, block.explained_median];
        assert!(powers.iter().flatten().all(|x| (x - 1.0).abs() < 1e-12), "{}: {powers:?}", block.block);
    }
    assert_eq!((row.class_size_ratio, row.f1), (Some(1.0), Some(1.0)));
    let listed = report.confusion.iter().filter(|(kind, _)| !kind.contains("not in the library"));
    for (kind, said) in listed {
        assert!(said.named.hits == said.named.of && said.in_class.hits == said.in_class.of, "{kind}");
        assert_eq!(said.names[kind], said.named.of);
    }
    assert!(row.unseen_error_nm.unwrap() < 1e-9);
    assert!((row.interval_width.unwrap() - 0.02).abs() < 1e-3);
    for aim in report.aims.iter().filter(|a| !a.aim.contains("cover")) {
        assert_ne!(aim.met, Some(false), "{}", aim.aim);
    }
    // Intervals that always cover are too wide; so few of them say nothing of that.
    assert!(report.to_string().contains("intervals: too few to tell"), "{report}");
    assert_eq!(report.notes.len(), 1);
}

#[test]
fn a_blind_detector_has_no_false_alarm_and_no_hit() {
    let report = prove(&Blind);
    let row = all(&report);
    assert_eq!((row.false_alarms.hits, row.found.hits, row.exact.hits, row.class_hits.hits), (0, 0, 0, 0));
    assert_eq!((row.wrong_names, row.located.hits, row.failed), (0, 0, row.cases));
    assert_eq!((row.misnamed.hits, row.coverage.of, row.class_size_ratio), (0, 0, None));
    assert_eq!((row.f1, row.explained, row.explained_median), (Some(0.0), Some(0.0), Some(0.0)));
    assert!(report.confusion.values().all(|row| row.names.keys().all(String::is_empty)));
}

#[test]
fn wrong_names_and_biased_parameters_are_counted() {
    let report = prove(&Oracle::new(3.0, |_| "inertia".to_owned()));
    let row = all(&report);
    // Its classes still hold the truth: hits, but nothing is exact unless the truth was inertia.
    assert_eq!(row.class_hits.hits, row.class_hits.of);
    assert!(row.exact.hits <= 1 && row.class_size_ratio.unwrap() > 1.2);

    let report = prove(&Oracle::new(3.0, str::to_owned));
    assert_eq!(all(&report).coverage.hits, 0);
}

#[test]
fn a_name_that_stands_for_nothing_is_wrong() {
    struct Chatty;
    impl Detector for Chatty {
        fn diagnose(&self, _: &[Recording], base: &Model, _: &[String]) -> Result<Found, String> {
            let mut diagnosis = nothing();
            diagnosis.mismatch = true;
            diagnosis.effects.push(Effect {
                verdict: Naming::Named,
                fidelity: None,
                family: String::new(),
                closest: None,
                name: "wear".to_owned(),
                equivalents: Vec::new(),
                confidence: 0.5,
                share: 0.1,
                parameters: BTreeMap::new(),
                side: Side::Plant,
                why: Evidence::Written(String::new()),
            });
            Ok(Found { diagnosis, model: base.clone() })
        }
        fn predict(&self, _: &Model, recording: &Recording) -> Result<Vec<f64>, String> {
            Ok(vec![f64::NAN; recording.len()])
        }
    }
    let report = prove(&Chatty);
    let null = report.blocks.iter().find(|b| b.block == "null").unwrap();
    assert_eq!((null.false_alarms.hits, null.wrong_names), (null.cases, null.cases));
    let row = all(&report);
    let right = report.cases.iter().filter(|c| c.wrong_names.is_empty()).count();
    assert_eq!(row.wrong_names + right, row.cases);
    assert!(right < 8, "{right} of {} cases hold wear or what looks like it", row.cases);
    assert_eq!(row.failed, row.cases, "a prediction that is not finite is refused");
}

#[test]
fn the_report_repeats_itself_and_is_json() {
    let strip = |mut report: ProveReport| {
        report.cases.iter_mut().for_each(|c| c.seconds = 0.0);
        report.blocks.iter_mut().for_each(|b| b.seconds = None);
        report
    };
    let (a, b) = (strip(prove(&Blind)), strip(prove(&Blind)));
    assert_eq!(a, b);
    let read: ProveReport = serde_json::from_str(&serde_json::to_string(&a).unwrap()).unwrap();
    assert_eq!(read.cases.len(), a.cases.len());
}

#[test]
fn cases_go_out_as_files_with_their_keys_apart() {
    let folder = tempfile::tempdir().unwrap();
    export::write(folder.path(), SEED, &mix::suite(SEED, 3, &[]), &mut |_| ()).unwrap();
    let case = folder.path().join("case_0001");
    let text = std::fs::read_to_string(case.join("recording_1.csv")).unwrap();
    assert!(text.starts_with("time_s,") && text.lines().next().unwrap().contains("torque_nm"));
    assert!(!std::fs::read_to_string(case.join("unseen_1.csv")).unwrap().contains("torque_nm"));
    assert!(std::fs::read_to_string(case.join("model.toml")).unwrap().contains("format = 1"));
    let key = std::fs::read_to_string(folder.path().join("keys/case_0001.toml")).unwrap();
    let hash = Key::from_toml(&key).unwrap().sha256();
    let hashes = std::fs::read_to_string(folder.path().join("keys.sha256")).unwrap();
    assert_eq!(hashes.lines().nth(1).unwrap(), format!("{hash}  keys/case_0001.toml"));
}
