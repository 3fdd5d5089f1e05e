//! Sealed cases: gears, drifts, motions and noise drawn by a generator that shares no code with the core. The keys are fixed in `adapt_keys.csv`; the adaptation sees the gear as it was and
//! the recording, in `f32`, sample by sample.

use crate::common::adapting::change;
use gmhm::adapt::{Adaptation, Change, Settings};
use gmhm::memory::masing::Masing;
use gmhm::{Elastic, Gear, Memory, Params};
use gmhm_host_tests::Constants;
use gmhm_host_tests::sealed::{CHANGED_S, Key, PERIOD_S, SECONDS};

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
    /// Changes of the normalised coefficients and their standard deviations, when the gear has become what it stays, and in the end.
    estimates: [[[f64; 5]; 2]; 2],
    /// What was in force, row by row: predicted torques of the block and of it.
    predicted: Vec<[f64; 2]>,
}

fn adapt(block: &Params, deflection: &[f64], measured: &[f64]) -> Answer {
    let settings = Settings { period_s: PERIOD_S, ..Settings::default() };
    let adaptation = Adaptation::<f32>::new(block, &settings).expect("law masing");
    let gear = Gear::<f32, _>::with_law(block, Masing::new(block));
    let (mut state, mut path, mut in_force) = (adaptation.start(), gear.start::<16>(0.0), gear);
    let (mut predicted, mut estimates) = (Vec::new(), [[[0.0; 5]; 2]; 2]);
    let [mut changed, last] = [(CHANGED_S / PERIOD_S) as usize, deflection.len() - 1];
    changed = changed.min(last);
    for (row, (theta, torque)) in deflection.iter().zip(measured).enumerate() {
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
        for (now, at) in estimates.iter_mut().zip([changed, last]) {
            if row == at {
                *now = [state.estimate().map(f64::from), state.variances().map(|of| f64::from(of).sqrt())];
            }
        }
    }
    Answer { estimates, predicted }
}

/// What is farthest from the truth, in standard deviations.
fn farthest([estimate, sd]: [[f64; 5]; 2], truth: [f64; 5]) -> f64 {
    (0..5).map(|k| (estimate[k] - truth[k]).abs() / sd[k]).fold(0.0, f64::max)
}

#[test]
fn the_keys_are_those_that_were_fixed() {
    assert_eq!(include_str!("adapt_keys.csv"), text(), "the generator has changed: it must draw the keys of the file");
}

#[test]
fn drifts_are_followed() {
    let (mut worst, mut drifts, mut behind) = (0.0_f64, 0, [Vec::new(), Vec::new()]);
    for key in keys() {
        let (block, recording) = (params(&key.gear), key.record(SECONDS));
        let answer = adapt(&block, &recording.deflection, &recording.measured);
        // The last third: the gear has been what it is for a while.
        let late = recording.torque.len() * 2 / 3;
        let rms = |number: usize| {
            let rows = recording.torque.iter().zip(&answer.predicted).skip(late);
            rows.map(|(torque, predicted)| (torque - predicted[number]).powi(2)).sum::<f64>().sqrt()
        };
        let ratio = rms(1) / rms(0);
        assert!(ratio <= 1.02, "{key:?}: {ratio}");
        if (key.stiffness - 1.0).abs() > 0.03 {
            assert!(ratio <= 0.35, "{key:?}: {ratio}");
            (worst, drifts) = (worst.max(ratio), drifts + 1);
        }
        let truth = change(&block, [&key.coefficients(0.0), &key.coefficients(SECONDS)]);
        for (behind, estimate) in behind.iter_mut().zip(answer.estimates) {
            behind.push(farthest(estimate, truth));
        }
    }
    for (mut behind, at_s) in behind.into_iter().zip([CHANGED_S, SECONDS]) {
        behind.sort_by(f64::total_cmp);
        let beyond = behind.iter().filter(|far| **far > 3.0).count();
        println!("at {at_s} s: {beyond} of {CASES} beyond three standard deviations; by case {behind:.1?}");
    }
    println!("{drifts} cases whose stiffness changes by over 3 %: error over the block's at most {worst:.3}");
    assert!(drifts > 20);
}

/// The gears of the keys, which stay as they were.
#[test]
fn what_stays_is_found_within_its_standard_deviations() {
    let (mut beyond, mut worst) = (0, 0.0_f64);
    for key in keys() {
        let key = key.without_drift();
        let (block, recording) = (params(&key.gear), key.record(150.0));
        let answer = adapt(&block, &recording.deflection, &recording.measured);
        let [_, last] = answer.estimates;
        let far = farthest(last, [0.0; 5]);
        beyond += usize::from(far > 3.0);
        worst = worst.max(far);
        let moved = answer.predicted.iter().filter(|[block, adapted]| block != adapted).count();
        assert_eq!(moved, 0, "{key:?}: something was taken over");
    }
    println!("{beyond} of {CASES} beyond three standard deviations, the farthest {worst:.2}");
    assert!(beyond <= 1, "{beyond} of {CASES} beyond three standard deviations");
}
