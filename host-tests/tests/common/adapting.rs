//! An adaptation on a gear that drifts, told by a sensor that may lie.

use gmhm::adapt::{Adaptation, AdaptationState, Change, Settings, Warnings};
use gmhm::memory::masing::Masing;
use gmhm::scalar::Float;
use gmhm::{Elastic, Gear, Memory, Params};
use gmhm_host_tests::Constants;
use gmhm_host_tests::drift::{self, Fault, Motion, Mover, Sensor};

/// Control period, s.
pub const PERIOD_S: f64 = 1e-3;

/// Samples of a second.
const SECOND: u64 = 1000;

/// The published gear.
pub fn block() -> Params {
    let Constants { a, c1, c2, c3, alpha, beta, omega } = Constants::PUBLISHED;
    let elastic = Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: c2, c3_nm_per_rad5: c3 };
    let memory = Memory { alpha, beta_per_s: beta, omega_per_s: omega, ..Memory::default() };
    Params::new(a, elastic, memory).expect("published parameters")
}

/// A run of an adaptation.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub motion: Motion,
    /// A fault of the torque signal, and when it begins, s.
    pub fault: (Fault, f64),
    /// Standard deviation of white noise, of the rated torque.
    pub white: f64,
    /// Of coloured noise, and its correlation from sample to sample.
    pub coloured: [f64; 2],
    pub seconds: f64,
    pub seed: u64,
    /// What stiffness and hysteresis have become in the end, linear over the run.
    pub drift: [f64; 2],
}

impl Default for Case {
    fn default() -> Self {
        Self {
            motion: Motion::Sine,
            fault: (Fault::None, 0.0),
            white: 0.01,
            coloured: [0.0; 2],
            seconds: 600.0,
            seed: 1,
            drift: [1.0; 2],
        }
    }
}

/// What came of it; errors are rms over the rated torque.
#[derive(Debug)]
pub struct Outcome {
    /// One step ahead against torque and noise: the block, those in force, the truth.
    pub one_step: [f64; 3],
    /// Against the torque alone: the block, those in force.
    pub feed_forward: [f64; 2],
    /// The same, less the mean error of each second.
    pub feed_forward_less_level: [f64; 2],
    pub taken_over: usize,
    pub given_back: usize,
    pub warnings: Warnings,
    /// Estimates less the truth in the end, over their standard deviations.
    pub deviations: [f64; 5],
}

/// Normalised changes of drifted coefficients, from nominal ones.
pub fn change(block: &Params, [nominal, now]: [&drift::Coefficients; 2]) -> [f64; 5] {
    let (a, scale) = (block.rated_deflection_rad(), block.torque_scale_nm());
    let [c1, c2, c3] = [0, 1, 2].map(|k| now.elastic[k] - nominal.elastic[k]);
    [c1, c2 * a * a, c3 * a.powi(4), now.e - nominal.e, now.h - nominal.h].map(|change| change * a / scale)
}

/// Runs a case; `watch` sees the state after every period.
pub fn run<S: Float>(case: &Case, mut watch: impl FnMut(&Adaptation<S>, &AdaptationState<S>)) -> Outcome {
    let block = block();
    let (a, rated) = (block.rated_deflection_rad(), block.torque_scale_nm());
    let settings = Settings { period_s: PERIOD_S, ..Settings::default() };
    let adaptation = Adaptation::<S>::new(&block, &settings).expect("law masing");
    let gear = Gear::<S, _>::with_law(&block, Masing::new(&block));
    let (mut state, mut path, mut in_force) = (adaptation.start(), gear.start::<16>(S::ZERO), gear);
    let nominal = drift::Coefficients::of(&Constants::PUBLISHED);
    let mut plant = drift::Gear::new(&Constants::PUBLISHED, 0.0);
    let mut mover = Mover::new(case.motion, case.seed);
    let [sd, correlation] = case.coloured;
    let mut sensor = Sensor::new(case.white * rated, [sd * rated, correlation], rated, case.seed);
    let samples = (case.seconds / PERIOD_S) as u64;
    let (mut one_step, mut feed_forward) = ([0.0; 3], [0.0; 2]);
    let (mut of_a_second, mut of_levels) = ([0.0; 2], [0.0; 2]);
    let (mut taken_over, mut given_back, mut now) = (0, 0, nominal);
    for k in 0..samples {
        let t = k as f64 * PERIOD_S;
        let share = k as f64 / samples as f64;
        let [stiffness, hysteresis] = case.drift.map(|end| 1.0 + (end - 1.0) * share);
        now = nominal.scaled(stiffness, hysteresis);
        let theta = a * mover.at(t);
        let torque = plant.step(&now, theta);
        let (fault, from) = case.fault;
        let [healthy, says] = sensor.read(torque, if t >= from { fault } else { Fault::None }, PERIOD_S);
        let by_block = gear.step(&mut path, S::from_f64(theta)).torque.to_f64();
        let by_adapted = in_force.output(&path).torque.to_f64();
        for (sum, by) in one_step.iter_mut().zip([by_block, by_adapted, torque]) {
            *sum += (healthy - by).powi(2);
        }
        for (way, by) in [by_block, by_adapted].into_iter().enumerate() {
            feed_forward[way] += (torque - by).powi(2);
            of_a_second[way] += torque - by;
            if (k + 1) % SECOND == 0 {
                of_levels[way] += of_a_second[way].powi(2) / SECOND as f64;
                of_a_second[way] = 0.0;
            }
        }
        match adaptation.period(&mut state, &path, S::from_f64(says)) {
            Change::None => {}
            Change::TakenOver => {
                taken_over += 1;
                let params = adaptation.params(&state, &block).expect("acceptable parameters");
                in_force = Gear::with_law(&params, Masing::new(&params));
            }
            Change::GivenBack => {
                given_back += 1;
                in_force = gear;
            }
        }
        watch(&adaptation, &state);
    }
    let rms = |sum: f64| (sum / samples as f64).sqrt() / rated;
    let (truth, estimate, variances) = (change(&block, [&nominal, &now]), state.estimate(), state.variances());
    Outcome {
        one_step: one_step.map(rms),
        feed_forward: feed_forward.map(rms),
        feed_forward_less_level: [0, 1].map(|way| rms(feed_forward[way] - of_levels[way])),
        taken_over,
        given_back,
        warnings: state.warnings(),
        deviations: [0, 1, 2, 3, 4].map(|k| (estimate[k].to_f64() - truth[k]) / variances[k].to_f64().sqrt()),
    }
}
