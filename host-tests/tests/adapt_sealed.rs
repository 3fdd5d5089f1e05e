//! Sealed cases: gears, drifts, motions and noise drawn by a generator that shares no code with the core. The keys are fixed in `adapt_keys.csv`; the adaptation sees the gear as it was and
//! the recording, in `f32`, sample by sample.

use gmhm::adapt::{Adaptation, Change, Settings};
use gmhm::memory::masing::Masing;
use gmhm::{Elastic, Gear, Memory, Params};
use gmhm_host_tests::Constants;
use gmhm_host_tests::drift::Coefficients;
use gmhm_host_tests::sealed::{Key, PERIOD_S, SECONDS};

const CASES: u64 = 40;
const HEADER: &str = "seed,motion,stiffness,hysteresis,noise,a,c1,c2,c3,alpha,beta,omega";

fn keys() -> Vec<Key> {
    (1..=CASES).map(Key::of_seed).collect()
}

fn text() -> String {
    let lines: Vec<String> = keys().iter().map(Key::line).collect();
    format!("{HEADER}\n{}\n", lines.join("\n"))
}

/// Fixes the keys; run it before the adaptation is, and never after.
#[test]
#[ignore = "writes the keys"]
fn write_keys() {
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/adapt_keys.csv"), text()).expect("written");
}

fn params(gear: &Constants) -> Params {
    let Constants { a, c1, c2, c3, alpha, beta, omega } = *gear;
    let elastic = Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: c2, c3_nm_per_rad5: c3 };
    let memory = Memory { alpha, beta_per_s: beta, omega_per_s: omega, ..Memory::default() };
    Params::new(a, elastic, memory).expect("a gear")
}

/// What an adaptation makes of a recording.
struct Answer {
    /// Changes of the normalised coefficients and their standard deviations, at the end.
    estimate: [f64; 5],
    deviations: [f64; 5],
    /// What was in force, row by row: predicted torques of the block and of it.
    predicted: Vec<[f64; 2]>,
}

fn adapt(block: &Params, deflection: &[f64], measured: &[f64]) -> Answer {
    let settings = Settings { period_s: PERIOD_S, ..Settings::default() };
    let adaptation = Adaptation::<f32>::new(block, &settings).expect("law masing");
    let gear = Gear::<f32, _>::with_law(block, Masing::new(block));
    let (mut state, mut path, mut in_force) = (adaptation.start(), gear.start::<16>(0.0), gear);
    let mut predicted = Vec::new();
    for (theta, torque) in deflection.iter().zip(measured) {
        let by_block = gear.step(&mut path, *theta as f32).torque;
        predicted.push([by_block, in_force.output(&path).torque].map(f64::from));
        match adaptation.period(&mut state, &path, *torque as f32) {
            Change::None => {}
            Change::GivenBack => in_force = gear,
            Change::TakenOver => {
                let params = adaptation.params(&state, block).expect("acceptable");
                in_force = Gear::with_law(&params, Masing::new(&params));
            }
        }
    }
    Answer {
        estimate: state.estimate().map(f64::from),
        deviations: state.variances().map(|variance| f64::from(variance).sqrt()),
        predicted,
    }
}

/// The normalised changes that a key says.
fn truth(key: &Key, scale: f64) -> [f64; 5] {
    let (before, after, a) = (Coefficients::of(&key.gear), key.coefficients(SECONDS), key.gear.a);
    let [c1, c2, c3] = [0, 1, 2].map(|k| after.elastic[k] - before.elastic[k]);
    [c1, c2 * a * a, c3 * a.powi(4), after.e - before.e, after.h - before.h].map(|change| change * a / scale)
}

#[test]
fn sealed_cases_are_answered() {
    let fixed = include_str!("adapt_keys.csv");
    assert_eq!(fixed, text(), "the generator has changed: it must draw the keys that were fixed");
    let (mut beyond, mut follows, mut drifts) = (0, 0, 0);
    for key in keys() {
        let (block, recording) = (params(&key.gear), key.record());
        let answer = adapt(&block, &recording.deflection, &recording.measured);
        let truth = truth(&key, block.torque_scale_nm());
        let far = |number: usize| (answer.estimate[number] - truth[number]).abs() > 3.0 * answer.deviations[number];
        beyond += usize::from((0..5).any(far));
        // The last third: the gear has been what it is for a while.
        let late = recording.torque.len() * 2 / 3;
        let rms = |number: usize| {
            let rows = recording.torque.iter().zip(&answer.predicted).skip(late);
            rows.map(|(torque, predicted)| (torque - predicted[number]).powi(2)).sum::<f64>().sqrt()
        };
        let ratio = rms(1) / rms(0);
        assert!(ratio <= 1.02, "{key:?}: {ratio}");
        if (key.stiffness - 1.0).abs() > 0.03 {
            drifts += 1;
            follows += usize::from(ratio <= 0.35);
        }
        println!("{}: {:?}, error over the block's {ratio:.3}", key.seed, key.motion);
    }
    println!("{beyond} of {CASES} beyond three standard deviations; {follows} of {drifts} that drift followed to 0.35");
    assert!(beyond * 20 <= CASES as usize, "{beyond} of {CASES} beyond three standard deviations");
    assert_eq!(follows, drifts);
}
