//! The swarm that searches the shapes of what was found. Synthetic recordings.

mod gears;

use gears::{Path, published, record, walk};
use gmhm_tools::diagnose::explain::Search;
use gmhm_tools::model::{Model, Term, TermValue};
use gmhm_tools::physics::predict;
use gmhm_tools::regression::dataset::Dataset;

const A: f64 = 1.168e-3;

/// The published gear with two slipping elements.
fn slipping(radius_rad: [f64; 2]) -> Model {
    let (elastic, memory) = published();
    let list = |values: [f64; 2]| TermValue::List(values.to_vec());
    let values = [("radius_rad", list(radius_rad)), ("torque_nm", list([1.0, 1.5]))];
    let values = values.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    let terms = vec![Term { kind: "nonlocal_memory".to_owned(), values }];
    let mut model = Model { elastic: Some(elastic), memory: Some(memory), terms, ..Model::default() };
    model.gear.rated_deflection_rad = Some(A);
    model
}

/// The radii of a model's elements, in order.
fn radii(model: &Model) -> Vec<f64> {
    let Some(TermValue::List(radii)) = model.terms[0].values.get("radius_rad") else { return Vec::new() };
    let mut radii = radii.clone();
    radii.sort_by(f64::total_cmp);
    radii
}

#[test]
fn the_swarm_leaves_an_optimum_that_the_polish_is_held_in() {
    let truth = [1e-4, 6e-4];
    let (elastic, memory) = published();
    let path = Path { theta: walk(A, 3000, 5), period_s: 0.01 };
    let mut recording = record(A, elastic, memory, &path, 0.05, 5);
    let gear = Model { terms: Vec::new(), ..slipping(truth) };
    let torque = |model: &Model| predict(model, None, &recording).unwrap().torque;
    let hidden: Vec<f64> = torque(&slipping(truth)).iter().zip(torque(&gear)).map(|(with, gear)| with - gear).collect();
    recording.torque.iter_mut().flatten().zip(hidden).for_each(|(torque, hidden)| *torque += hidden);
    let recordings = [recording];
    let dataset = Dataset::new(&recordings, &gear).unwrap();
    let search = Search { removed: &[], only: None, base_terms: 0, zero: false, seed: 1 };
    let start = slipping([0.9e-4, 1.2e-4]);
    let polished = dataset.fit(&start, &dataset.places(&start, search), None, 12).unwrap();
    let found = dataset.reshaped(polished.clone(), 0, search.seed).unwrap();
    let off = |model: &Model| radii(model).iter().zip(truth).map(|(r, t)| (r / t - 1.0).abs()).fold(0.0, f64::max);
    assert!(off(&polished.model) > 0.3, "{:?}", radii(&polished.model));
    assert!(off(&found.model) < 0.03, "{:?}", radii(&found.model));
    assert!(found.minus_two_log_likelihood < polished.minus_two_log_likelihood - 20.0);
    let again = dataset.reshaped(polished, 0, search.seed).unwrap();
    assert_eq!(radii(&again.model), radii(&found.model));
    // What is at its best stays.
    let kept = dataset.reshaped(found.clone(), 0, 2).unwrap();
    assert_eq!(radii(&kept.model), radii(&found.model));
}
