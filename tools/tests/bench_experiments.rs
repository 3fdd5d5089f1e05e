//! The bench's motion: what each experiment reaches, and that its columns belong to one machine.

use crate::common;
use gmhm_tools::bench::{BenchError, Experiment, Noise, Options, Waveform, simulate};
use gmhm_tools::model::{self, Model};
use gmhm_tools::physics::predict;
use gmhm_tools::recording::Recording;

const ALL: [Experiment; 5] =
    [Experiment::Cycle, Experiment::Amplitudes, Experiment::Rates, Experiment::Running, Experiment::Dynamic];
const A: f64 = 1.168e-3;

fn published() -> Model {
    model::parse("published", common::PUBLISHED).unwrap()
}

fn quiet() -> Options {
    Options { noise: Some(Noise::default()), ..Options::new() }
}

fn run(experiment: Experiment, options: &Options) -> Recording {
    simulate(&published(), experiment, options, 7).unwrap().0
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (x.min(a), x.max(b)))
}

#[test]
fn every_experiment_starts_from_rest_and_reaches_both_rated_torques() {
    let rated_nm = published().params(A).unwrap().unwrap().rated_torque_nm();
    for experiment in ALL {
        let recording = run(experiment, &quiet());
        let theta = recording.deflection().unwrap();
        let torque = recording.torque.as_deref().unwrap();
        assert!(theta[0].abs() < 1e-15 && torque[0].abs() < 1e-9, "{experiment}");
        let (low, high) = extremes(theta);
        assert!((low + A).abs() < 1e-12 * A && (high - A).abs() < 1e-12 * A, "{experiment}: {low} {high}");
        let (low, high) = extremes(torque);
        assert!((low + rated_nm).abs() < 1e-9 * rated_nm, "{experiment}: {low}");
        assert!((high - rated_nm).abs() < 1e-9 * rated_nm, "{experiment}: {high}");
    }
}

#[test]
fn defaults_are_as_documented() {
    for (experiment, duration_s, sample_rate_hz) in [
        (Experiment::Cycle, 130.0, 50.0),
        (Experiment::Amplitudes, 145.0, 50.0),
        (Experiment::Rates, 112.75, 200.0),
        (Experiment::Running, 60.0, 400.0),
        (Experiment::Dynamic, 40.0, 500.0),
    ] {
        let (recording, key) = simulate(&published(), experiment, &Options::new(), 1).unwrap();
        let last = recording.time_s.last().unwrap();
        println!("{experiment}: {last} s, {} rows", recording.len());
        assert!((last - duration_s).abs() < 1e-9, "{experiment}: {last}");
        assert!((recording.time_s[1] - 1.0 / sample_rate_hz).abs() < 1e-12);
        assert_eq!(key.rows, recording.len());
    }
}

#[test]
fn angles_deflection_and_velocity_belong_to_one_machine() {
    for experiment in ALL {
        let recording = run(experiment, &quiet());
        let (input, output) = (recording.theta_in_rad.as_deref().unwrap(), recording.theta_out_rad.as_deref().unwrap());
        let theta = recording.deflection().unwrap();
        let velocity = recording.velocity_out_rad_per_s.as_deref().unwrap();
        let dt = recording.time_s[1];
        let mut turned = 0.0_f64;
        for k in 0..recording.len() {
            assert!((input[k] / 100.0 - output[k] - theta[k]).abs() < 1e-14, "{experiment} row {k}");
            if k > 0 && k + 1 < recording.len() {
                let difference = (output[k + 1] - output[k - 1]) / (2.0 * dt);
                assert!((velocity[k] - difference).abs() < 1e-9, "{experiment} row {k}");
            }
            turned = turned.max((input[k] - input[0]).abs());
        }
        if experiment.input_locked() {
            assert_eq!(turned, 0.0, "{experiment}");
        } else {
            let turns = turned / std::f64::consts::TAU;
            assert!(turns > 200.0, "{experiment}: {turns} motor turns");
            let (low, high) = extremes(velocity);
            assert!((high - 1.0).abs() < 0.02 && (low + 1.0).abs() < 0.02, "{low} {high}");
            // Every speed is met under positive and under negative load.
            let torque = recording.torque.as_deref().unwrap();
            for sign in [-1.0, 1.0] {
                for load in [-1.0, 1.0] {
                    let rows =
                        velocity.iter().zip(torque).filter(|(v, t)| sign * **v > 0.15 && load * **t > 5.0).count();
                    assert!(rows > recording.len() / 20, "{rows} rows at {sign} {load}");
                }
            }
        }
    }
}

#[test]
fn perfect_sensors_record_what_predict_predicts() {
    for experiment in ALL {
        let (recording, key) = simulate(&published(), experiment, &quiet(), 3).unwrap();
        let predicted = predict(&key.truth, None, &recording).unwrap().torque;
        for (a, b) in predicted.iter().zip(recording.torque.as_deref().unwrap()) {
            assert!((a - b).abs() < 1e-12 * 30.0);
        }
    }
}

/// MODEL.md section 3: once both tips were reached, the cycle is the paper's, T = f(θ) − eθg + d·hA(1 − θ²/A²).
#[test]
fn the_published_cycle_meets_the_closed_form() {
    let model = published();
    let recording = run(Experiment::Cycle, &quiet());
    let (elastic, memory) = (model.elastic.unwrap(), model.memory.unwrap());
    let theta = recording.deflection().unwrap();
    let torque = recording.torque.as_deref().unwrap();
    let settled = theta.iter().position(|x| *x <= -A * (1.0 - 1e-12)).unwrap();
    let mut worst = 0.0_f64;
    for k in settled + 1..theta.len() - 1 {
        let (x, u) = (theta[k], theta[k] / A);
        let direction = (theta[k + 1] - theta[k - 1]).signum();
        let cycle = elastic.torque_nm(x) - memory.e() * x * (1.0 - u * u).max(0.0).sqrt()
            + direction * memory.h() * A * (1.0 - u * u);
        if u.abs() < 0.999 {
            worst = worst.max((torque[k] - cycle).abs());
        }
    }
    assert!(worst < 1e-9 * 30.0, "{worst} N·m");
    // The first loading: the initial curve 2hδ(1 − δ/A).
    for k in 0..400 {
        let x = theta[k];
        let initial = elastic.torque_nm(x) - memory.e() * x * (1.0 - (x / A).powi(2)).sqrt()
            + 2.0 * memory.h() * x * (1.0 - x / A);
        assert!((torque[k] - initial).abs() < 1e-9 * 30.0, "row {k}");
    }
}

#[test]
fn the_load_is_carried_within_the_stated_tolerance() {
    // Steps: between the changes the torque rests on multiples of a fifteenth of the rated torque.
    let options = Options { waveform: Some(Waveform::Steps), ..quiet() };
    let recording = run(Experiment::Cycle, &options);
    let step = published().params(A).unwrap().unwrap().rated_torque_nm() / 15.0;
    let torque = recording.torque.as_deref().unwrap();
    let resting: Vec<f64> = torque.windows(2).filter(|w| (w[0] - w[1]).abs() < 1e-9).map(|w| w[0] / step).collect();
    assert!(resting.len() > torque.len() / 2, "{} of {}", resting.len(), torque.len());
    for level in resting {
        assert!((level - level.round()).abs() < 1e-9, "{level}");
    }
}

#[test]
fn rates_and_amplitudes_are_those_asked_for() {
    let options = Options { amplitudes: vec![0.3, 0.9], cycles: Some(2), rates_hz: vec![0.1], ..quiet() };
    let recording = run(Experiment::Amplitudes, &options);
    let theta = recording.deflection().unwrap();
    let mut tips: Vec<f64> =
        theta.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).map(|w| w[1] / A).collect();
    tips.push(theta[theta.len() - 1] / A);
    let asked = [0.3, -0.3, 0.3, -0.3, 0.9, -0.9, 0.9, -0.9, 0.9];
    assert_eq!(tips.len(), asked.len());
    assert!(tips.iter().zip(asked).all(|(tip, a)| (tip - a).abs() < 1e-12), "{tips:?}");

    let options = Options { duration_s: Some(65.0), ..quiet() };
    let recording = run(Experiment::Cycle, &options);
    assert!((recording.time_s.last().unwrap() - 65.0).abs() < 0.03);
    let (low, high) = extremes(recording.deflection().unwrap());
    assert!((low + A).abs() < 1e-12 * A && (high - A).abs() < 1e-12 * A);
}

/// The load of experiment dynamic lies within its band.
#[test]
fn the_random_load_is_band_limited() {
    let recording = run(Experiment::Dynamic, &Options { rates_hz: vec![4.0], ..quiet() });
    let torque = recording.torque.as_deref().unwrap();
    // Power of the signal and of its part above 4.5 Hz, by a Hann-windowed discrete transform on a grid of 1/40 Hz.
    let n = torque.len() as f64;
    let power = |hz: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, t) in torque.iter().enumerate() {
            let window = 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / n).cos();
            let phase = std::f64::consts::TAU * hz * recording.time_s[k];
            re += window * t * phase.cos();
            im += window * t * phase.sin();
        }
        re * re + im * im
    };
    let band = |from: f64, to: f64| {
        (0..).map(|k| from + f64::from(k) * 0.05).take_while(|hz| *hz < to).map(power).sum::<f64>()
    };
    let (inside, outside) = (band(0.3, 4.1), band(4.5, 8.0));
    assert!(outside < 1e-4 * inside, "{outside} of {inside}");
}

#[test]
fn every_law_runs() {
    for law in ["law = \"phase\"", "law = \"time\"\ngate = \"none\"\nkernel = \"rate\"\n"] {
        let text = common::PUBLISHED.replace("alpha = 2.6532e6", &format!("{law}\nalpha = 2000.0"));
        let model = model::parse("law", &text).unwrap();
        for experiment in ALL {
            let amplitudes = vec![0.9];
            let (recording, _) = simulate(&model, experiment, &Options { amplitudes, ..quiet() }, 1).unwrap();
            assert!(recording.torque.unwrap().iter().all(|t| t.is_finite()), "{law} {experiment}");
        }
    }
}

#[test]
fn a_model_without_a_ratio_has_no_angles_and_cannot_run() {
    let model = model::parse("no ratio", &common::PUBLISHED.replace("ratio = 100.0\n", "")).unwrap();
    let (recording, _) = simulate(&model, Experiment::Cycle, &Options::new(), 1).unwrap();
    assert!(recording.theta_in_rad.is_none() && recording.theta_out_rad.is_none());
    assert!(recording.deflection_rad.is_some());
    let refused = simulate(&model, Experiment::Running, &Options::new(), 1);
    assert!(matches!(refused, Err(BenchError::NoRatio(_))));
}

#[test]
fn the_encoder_zero_is_in_the_deflection() {
    let text = common::PUBLISHED.replace("[elastic]", "deflection_zero_rad = 2e-4\n[elastic]");
    let model = model::parse("zero", &text).unwrap();
    let (recording, key) = simulate(&model, Experiment::Cycle, &quiet(), 1).unwrap();
    assert!((recording.deflection().unwrap()[0] - 2e-4).abs() < 1e-15);
    let copy = Recording { deflection_rad: None, ..recording.clone() };
    let predicted = predict(&key.truth, None, &copy).unwrap().torque;
    for (a, b) in predicted.iter().zip(recording.torque.as_deref().unwrap()) {
        // At the tips the torque changes as the square root of the rounding of the angles.
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn what_an_experiment_does_not_have_is_refused() {
    let refuse = |experiment, options: Options, part: &str| {
        let error = simulate(&published(), experiment, &options, 1).unwrap_err().to_string();
        assert!(error.contains(part), "{error} should say {part}");
    };
    let new = Options::new;
    refuse(Experiment::Cycle, Options { speed_rad_per_s: Some(1.0), ..new() }, "--speed");
    refuse(Experiment::Running, Options { cycles: Some(1), ..new() }, "--cycles");
    refuse(Experiment::Dynamic, Options { waveform: Some(Waveform::Sine), ..new() }, "--waveform");
    refuse(Experiment::Cycle, Options { amplitudes: vec![0.5, 1.0], ..new() }, "--amplitude");
    refuse(Experiment::Cycle, Options { amplitudes: vec![1.5], ..new() }, "above 0 to 1");
    refuse(Experiment::Cycle, Options { amplitudes: vec![f64::NAN], ..new() }, "above 0 to 1");
    refuse(Experiment::Cycle, Options { rates_hz: vec![1.0], duration_s: Some(5.0), ..new() }, "beside --duration");
    refuse(Experiment::Cycle, Options { rates_hz: vec![20.0], ..new() }, "160 Hz are needed");
    refuse(Experiment::Running, Options { duration_s: Some(1e9), ..new() }, "rows");
    refuse(Experiment::Running, Options { duration_s: Some(-1.0), ..new() }, "greater than zero");
    refuse(Experiment::Rates, Options { cycles: Some(0), ..new() }, "1 to 10000");
}
