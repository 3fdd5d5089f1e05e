//! An experiment with its options, sampled: what is prescribed at each time.

use gmhm::Params;
use rand_chacha::ChaCha8Rng;

use super::error::BenchError;
use super::options::{Experiment, Options, Waveform};
use super::profile::{self, Cycles};

/// What the load machine holds at each sample.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Drive {
    /// The deflection, rad.
    Deflection(Vec<f64>),
    /// The torque, N·m.
    Load(Vec<f64>),
}

/// An experiment, sampled.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub time_s: Vec<f64>,
    pub drive: Drive,
    /// Angle q_m/N through which the motor has turned since the start, rad.
    pub travel_rad: Vec<f64>,
}

/// Most rows of a recording.
const MOST_ROWS: f64 = 1e7;

/// Fewest samples of the fastest period.
const SAMPLES_A_PERIOD: f64 = 8.0;

/// Steps of the load up to the rated torque, as in the paper: 2 N·m of 30.
const LOAD_STEPS: f64 = 15.0;

/// Defaults of an experiment.
struct Defaults {
    amplitudes: &'static [f64],
    rates_hz: &'static [f64],
    cycles: u32,
    sample_rate_hz: f64,
    duration_s: f64,
}

const fn defaults(experiment: Experiment) -> Defaults {
    let (amplitudes, rates_hz, cycles, sample_rate_hz, duration_s): (&[f64], &[f64], _, _, _) = match experiment {
        Experiment::Cycle => (&[1.0], &[0.025], 3, 50.0, 0.0),
        Experiment::Amplitudes => (&[0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25], &[0.05], 1, 50.0, 0.0),
        Experiment::Rates => (&[1.0], &[0.02, 0.1, 0.5, 2.0], 2, 200.0, 0.0),
        Experiment::Running => (&[1.0], &[0.5], 0, 400.0, 60.0),
        Experiment::Dynamic | Experiment::Joint => (&[1.0], &[5.0], 0, 500.0, 40.0),
        Experiment::Drift => (&[1.0], &[1.0], 0, 500.0, 600.0),
    };
    Defaults { amplitudes, rates_hz, cycles, sample_rate_hz, duration_s }
}

impl Plan {
    pub fn new(
        experiment: Experiment,
        options: &Options,
        params: &Params,
        random: &mut ChaCha8Rng,
    ) -> Result<Self, BenchError> {
        let defaults = defaults(experiment);
        let or = |given: &[f64], default: &[f64]| if given.is_empty() { default.to_vec() } else { given.to_vec() };
        let amplitudes = or(&options.amplitudes, defaults.amplitudes);
        let rates_hz = or(&options.rates_hz, defaults.rates_hz);
        let sample_rate_hz = options.sample_rate_hz.unwrap_or(defaults.sample_rate_hz);
        let rated_torque_nm = params.rated_torque_nm();

        let (time_s, drive) = if is_cyclic(experiment) {
            let count = options.cycles.unwrap_or(defaults.cycles);
            let mut series: Vec<Cycles> = rates_hz
                .iter()
                .flat_map(|&rate_hz| amplitudes.iter().map(move |&amplitude| Cycles { amplitude, rate_hz, count }))
                .collect();
            let mut strokes = profile::strokes(&series, sample_rate_hz);
            if let Some(duration_s) = options.duration_s {
                let faster = profile::length_s(&strokes) / duration_s;
                series.iter_mut().for_each(|cycles| cycles.rate_hz *= faster);
                strokes = profile::strokes(&series, sample_rate_hz);
            }
            let fastest_hz = series.iter().fold(0.0, |a: f64, cycles| a.max(cycles.rate_hz));
            let time_s = times(profile::length_s(&strokes), sample_rate_hz, fastest_hz)?;
            let waveform = options.waveform.unwrap_or_default();
            let shares = profile::follow(&strokes, waveform, 1.0 / LOAD_STEPS, &time_s);
            let scaled = |by: f64| shares.iter().map(|share| share * by).collect();
            let drive = match waveform {
                Waveform::Steps => Drive::Load(scaled(rated_torque_nm)),
                Waveform::Sine | Waveform::Triangle => Drive::Deflection(scaled(params.rated_deflection_rad())),
            };
            (time_s, drive)
        } else {
            let duration_s = options.duration_s.unwrap_or(defaults.duration_s);
            let high_hz = rates_hz[0];
            let time_s = times(duration_s, sample_rate_hz, high_hz)?;
            // The load starts within one of its fastest periods; its slowest tone still has several.
            let load = profile::random_load(0.1 * high_hz, high_hz, 1.0 / high_hz, &time_s, random);
            let drive = match experiment {
                Experiment::Drift => {
                    // Folded at ±1: half of the time beyond two thirds of the amplitude.
                    let peak = amplitudes[0] * params.rated_deflection_rad();
                    Drive::Deflection(load.iter().map(|share| peak * (std::f64::consts::PI * share).sin()).collect())
                }
                _ => Drive::Load(load.iter().map(|share| share * amplitudes[0] * rated_torque_nm).collect()),
            };
            (time_s, drive)
        };
        let travel_rad = if experiment.input_locked() {
            vec![0.0; time_s.len()]
        } else {
            profile::running_angle(
                options.speed_rad_per_s.unwrap_or(1.0),
                time_s.last().copied().unwrap_or(0.0),
                &time_s,
            )
        };
        Ok(Self { time_s, drive, travel_rad })
    }
}

/// Whether the experiment is a series of strokes.
fn is_cyclic(experiment: Experiment) -> bool {
    matches!(experiment, Experiment::Cycle | Experiment::Amplitudes | Experiment::Rates)
}

/// Sample times from 0 to the duration.
fn times(duration_s: f64, sample_rate_hz: f64, fastest_hz: f64) -> Result<Vec<f64>, BenchError> {
    if sample_rate_hz < SAMPLES_A_PERIOD * fastest_hz {
        return Err(BenchError::TooSlow { sample_rate_hz, needed_hz: SAMPLES_A_PERIOD * fastest_hz });
    }
    let rows = (duration_s * sample_rate_hz + 1e-6).floor() + 1.0;
    if !(SAMPLES_A_PERIOD..=MOST_ROWS).contains(&rows) {
        return Err(BenchError::Rows { rows, most: MOST_ROWS });
    }
    Ok((0..rows as usize).map(|k| k as f64 / sample_rate_hz).collect())
}

/// Refuses what the experiment does not have, and what cannot be.
pub(super) fn check(experiment: Experiment, options: &Options) -> Result<(), BenchError> {
    let cyclic = is_cyclic(experiment);
    let joint = experiment == Experiment::Joint;
    let several = |list: &[f64]| list.len() > 1;
    for (option, given) in [
        ("--cycles", options.cycles.is_some() && !cyclic),
        ("--waveform", options.waveform.is_some() && !cyclic),
        ("--speed", options.speed_rad_per_s.is_some() && experiment != Experiment::Running),
        ("--plant", options.plant.is_some() && !joint && experiment != Experiment::Drift),
        ("--compensation", options.compensation.is_some() && !joint),
        ("--hide", !options.hide.is_empty() && joint),
        ("--duration", options.duration_s.is_some() && joint),
        ("--amplitude", !options.amplitudes.is_empty() && joint),
        ("--rate", !options.rates_hz.is_empty() && joint),
        ("--amplitude with several values", several(&options.amplitudes) && experiment != Experiment::Amplitudes),
        ("--rate with several values", several(&options.rates_hz) && experiment != Experiment::Rates),
        ("--rate beside --duration", cyclic && options.duration_s.is_some() && !options.rates_hz.is_empty()),
    ] {
        if given {
            return Err(BenchError::NotInExperiment { option, experiment });
        }
    }
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let all = options.amplitudes.iter().map(|&x| ("--amplitude", x, x > 0.0 && x <= 1.0, "above 0 to 1"));
    let all = all.chain(options.rates_hz.iter().map(|&x| ("--rate", x, positive(x), "greater than zero")));
    let single = [
        ("--duration", options.duration_s),
        ("--sample-rate", options.sample_rate_hz),
        ("--speed", options.speed_rad_per_s),
    ];
    let single = single.into_iter().filter_map(|(option, x)| Some((option, x?)));
    let all = all.chain(single.map(|(option, x)| (option, x, positive(x), "greater than zero")));
    let all = all.chain([("--warm-up", options.warm_up_k, options.warm_up_k.is_finite(), "a finite number")]);
    let cycles = options.cycles.map(|n| ("--cycles", f64::from(n), (1..=10_000).contains(&n), "1 to 10000"));
    match all.chain(cycles).find(|(_, _, fits, _)| !fits) {
        Some((option, value, _, must)) => Err(BenchError::Value { option, value, must }),
        None => Ok(()),
    }
}

/// Cycles of shrinking amplitude with the input locked, for identification: time s, deflection rad.
pub(super) fn nested_cycles(rated_deflection_rad: f64) -> (Vec<f64>, Vec<f64>) {
    const SAMPLE_RATE_HZ: f64 = 50.0;
    let cycles =
        [1.0, 0.75, 0.5, 0.25].map(|share| Cycles { amplitude: share * rated_deflection_rad, rate_hz: 0.1, count: 1 });
    let strokes = profile::strokes(&cycles, SAMPLE_RATE_HZ);
    let rows = (profile::length_s(&strokes) * SAMPLE_RATE_HZ).round() as usize;
    let time_s: Vec<f64> = (0..=rows).map(|k| k as f64 / SAMPLE_RATE_HZ).collect();
    let deflection_rad = profile::follow(&strokes, Waveform::Sine, 1.0, &time_s);
    (time_s, deflection_rad)
}
