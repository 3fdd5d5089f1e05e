//! The adaptation over long times, in release: `cargo test --release -p gmhm-host-tests --test all adapt_long -- --ignored --nocapture`.

use crate::common::adapting::{Case, PERIOD_S, block, run};
use gmhm::Gear;
use gmhm::adapt::{Adaptation, Change, Settings, Warning};
use gmhm::memory::masing::Masing;
use gmhm_host_tests::Constants;
use gmhm_host_tests::drift::{self, Fault, Motion, Mover};

/// The tables of `docs/adaptation.md`.
#[test]
#[ignore = "the tables of the documentation"]
fn tables() {
    println!(
        "| motion | block | adapted | truth | feed-forward, adapted over block | less its level | takeovers | returns |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    for motion in Motion::ALL {
        let outcome = run::<f32>(&Case { motion, drift: [0.9, 1.2], ..Case::default() }, |_, _| {});
        let [block, adapted, truth] = outcome.one_step.map(|rms| 100.0 * rms);
        let [whole, changes] =
            [outcome.feed_forward, outcome.feed_forward_less_level].map(|[fixed, follows]| follows / fixed);
        println!(
            "| {motion:?} | {block:.2} | {adapted:.2} | {truth:.2} | {whole:.3} | {changes:.3} | {} | {} |",
            outcome.taken_over, outcome.given_back
        );
    }
    let rated = block().torque_scale_nm();
    let faults = [
        ("stuck", Fault::Stuck),
        ("zero and noise", Fault::Zero),
        ("offset 1 %", Fault::Offset(0.01 * rated)),
        ("offset 5 %", Fault::Offset(0.05 * rated)),
        ("offset 50 %", Fault::Offset(0.5 * rated)),
        ("delay 1 ms", Fault::Delay(1e-3)),
        ("delay 2.5 ms", Fault::Delay(2.5e-3)),
        ("delay 5 ms", Fault::Delay(5e-3)),
        ("spikes, 1 in 20", Fault::Spikes(20)),
        ("spikes, 1 in 2000", Fault::Spikes(2000)),
        ("spikes one way, 1 in 50", Fault::SpikesUp(50)),
        ("NaN, 1 in 3", Fault::NotNumbers(3)),
        ("NaN", Fault::AllNotNumbers),
    ];
    println!("\n| fault | worst ratio, gear as its block | worst ratio, gear that drifts | reported |");
    println!("|---|---:|---:|---|");
    for (name, fault) in faults {
        let worst = |drift: [f64; 2]| {
            let mut worst = 0.0_f64;
            let mut warnings = std::collections::BTreeSet::new();
            for motion in Motion::FIVE {
                for from in [0.0, 100.3] {
                    let case = Case { motion, fault: (fault, from), seconds: 300.0, drift, ..Case::default() };
                    let outcome = run::<f32>(&case, |_, _| {});
                    let [block, adapted, _] = outcome.one_step;
                    worst = worst.max(adapted / block);
                    if from == 0.0 {
                        warnings.extend(outcome.warnings.iter().map(|warning| warning.name()));
                    }
                }
            }
            (worst, warnings)
        };
        let (still, warnings) = worst([1.0; 2]);
        let (drifts, _) = worst([0.95, 1.1]);
        let warnings: Vec<_> = warnings.into_iter().collect();
        println!("| {name} | {still:.4} | {drifts:.4} | {} |", warnings.join(", "));
    }
}

/// After how many seconds small faults of the signal are reported, by motion.
#[test]
#[ignore = "the tables of the documentation"]
fn small_faults() {
    let rated = block().torque_scale_nm();
    let reported = |case: Case| {
        let faults =
            [Warning::NotANumber, Warning::Spikes, Warning::Dead, Warning::Disturbed, Warning::Delay, Warning::Offset];
        let (mut now, mut first) = (0_u64, None);
        run::<f32>(&case, |_, state| {
            now += 1;
            if first.is_none()
                && let Some(fault) = faults.into_iter().find(|fault| state.warnings().has(*fault))
            {
                first = Some(format!("{:.0} {}", now as f64 * PERIOD_S - case.fault.1, fault.name()));
            }
        });
        first.unwrap_or_else(|| "–".into())
    };
    let faults = [
        ("offset 0.5 %", Fault::Offset(0.005 * rated)),
        ("offset 0.7 %", Fault::Offset(0.007 * rated)),
        ("offset 1 %", Fault::Offset(0.01 * rated)),
        ("delay 0.5 ms", Fault::Delay(0.5e-3)),
        ("delay 0.7 ms", Fault::Delay(0.7e-3)),
        ("delay 1 ms", Fault::Delay(1e-3)),
        ("delay 2.5 ms", Fault::Delay(2.5e-3)),
        ("spikes, 1 in 2000", Fault::Spikes(2000)),
        ("spikes, 1 in 10000", Fault::Spikes(10_000)),
    ];
    for (name, fault) in faults {
        for from in [0.0, 100.3] {
            for drift in [[1.0; 2], [0.95, 1.1]] {
                let times: Vec<_> = Motion::ALL
                    .into_iter()
                    .map(|motion| reported(Case { motion, fault: (fault, from), drift, ..Case::default() }))
                    .collect();
                println!("| {name} from {from} drift {drift:?} | {} |", times.join(" | "));
            }
        }
    }
}

/// Gears that drift, 20 seeds in either direction: in how many of 40 runs that is taken for an offset or a delay of the signal; the worst feed-forward, adapted over block, and the worst one-step error over that of the truth.
#[test]
#[ignore = "the tables of the documentation"]
fn drifts() {
    for seconds in [1200.0, 600.0, 300.0, 150.0, 75.0] {
        for (white, coloured) in [(0.01, [0.0; 2]), (0.007, [0.007, 0.95])] {
            let told = Motion::MOVING.map(|motion| {
                let (mut faults, mut feed_forward, mut one_step) = (0, 0.0_f64, 0.0_f64);
                for drift in [[0.9, 1.2], [1.1, 0.8]] {
                    for seed in 1..=20 {
                        let case = Case { motion, seconds, white, coloured, drift, seed, ..Case::default() };
                        let outcome = run::<f32>(&case, |_, _| {});
                        let [fixed, follows] = outcome.feed_forward;
                        let [_, adapted, truth] = outcome.one_step;
                        feed_forward = feed_forward.max(follows / fixed);
                        one_step = one_step.max(adapted / truth);
                        faults +=
                            u32::from([Warning::Delay, Warning::Offset].iter().any(|of| outcome.warnings.has(*of)));
                    }
                }
                format!("{faults} {feed_forward:.2} {one_step:.2}")
            });
            println!("| {seconds} s, coloured {} | {} |", coloured[0], told.join(" | "));
        }
    }
}

/// A sensor whose offset grows: the one-step rms of what was in force over that of the block, against the true torque and its noise, by what the offset is after 600 s. The worst of both signs, on gears that become
/// softer and stiffer.
#[test]
#[ignore = "the tables of the documentation"]
fn growing_offsets() {
    let rated = block().torque_scale_nm();
    for drifts in [&[[1.0; 2]][..], &[[0.95, 1.1], [1.05, 0.9]]] {
        for percent in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 40.0] {
            let ratios = Motion::MOVING.map(|motion| {
                let (mut worst, mut seen) = (0.0_f64, true);
                for &drift in drifts {
                    for sign in [1.0, -1.0] {
                        let fault = (Fault::Drift(sign * 0.01 * percent * rated / 600.0), 0.0);
                        let outcome = run::<f32>(&Case { motion, fault, drift, ..Case::default() }, |_, _| {});
                        let [block, adapted, _] = outcome.one_step;
                        worst = worst.max(adapted / block);
                        seen &= outcome.warnings.has(Warning::Offset);
                    }
                }
                format!("{worst:.3}{}", if seen { "" } else { "*" })
            });
            println!("| {percent} % | {} |", ratios.join(" | "));
        }
    }
}

/// Standard deviations of a constant offset, over the rated torque, and of a constant delay, s, after 600 s: no estimator that is right on average knows them better, as everything is linear and normal.
/// Every sample is used. The coefficients have the prior of the adaptation and walk by its `drift` as often as it ends a stretch; of offset and delay nothing is known.
fn least_deviations(motion: Motion, stretches: u32, Settings { drift, largest_change, .. }: Settings) -> [f64; 2] {
    const STATES: usize = 7;
    const SECONDS: f64 = 600.0;
    const PER_ROW: u32 = 25;
    let constants = Constants::PUBLISHED;
    let (a, rated) = (constants.a, block().torque_scale_nm());
    let own = {
        let c = constants;
        [c.c1 * a, c.c2 * a.powi(3), c.c3 * a.powi(5), c.e() * a, c.h() * a].map(|k| k / rated)
    };
    let unit_loop = drift::Coefficients { elastic: [0.0; 3], e: 0.0, h: 1.0 / a };
    let mut shape = drift::Gear::new(&constants, 0.0);
    let mut mover = Mover::new(motion, 1);
    let samples = (SECONDS / PERIOD_S) as u32;
    let prior = [0.5 * largest_change; 5].into_iter().chain([10.0, 10.0]);
    let mut covariance = [[0.0; STATES]; STATES];
    for (k, sd) in prior.enumerate() {
        covariance[k][k] = sd * sd;
    }
    let walk = drift * drift * f64::from(stretches) * f64::from(PER_ROW) / f64::from(samples);
    let (mut sum, mut last) = ([0.0; STATES], 0.0);
    for k in 0..samples {
        let u = mover.at(f64::from(k) * PERIOD_S);
        let eta = shape.step(&unit_loop, a * u);
        let x = [u, u.powi(3), u.powi(5), -u * (1.0 - u * u).max(0.0).sqrt(), eta];
        let p: f64 = x.iter().zip(own).map(|(x, own)| x * own).sum();
        let slope = if k > 0 { (p - last) / PERIOD_S } else { 0.0 };
        last = p;
        for (sum, x) in sum.iter_mut().zip(x.into_iter().chain([1.0, -slope])) {
            *sum += x / f64::from(PER_ROW);
        }
        if (k + 1) % PER_ROW == 0 {
            let row = std::mem::take(&mut sum);
            for (k, row) in covariance.iter_mut().enumerate().take(5) {
                row[k] += walk;
            }
            let seen = covariance.map(|line| line.iter().zip(row).map(|(p, x)| p * x).sum::<f64>());
            let total = 0.01_f64.powi(2) / f64::from(PER_ROW) + seen.iter().zip(row).map(|(s, x)| s * x).sum::<f64>();
            for i in 0..STATES {
                for j in 0..STATES {
                    covariance[i][j] -= seen[i] * seen[j] / total;
                }
            }
        }
    }
    [covariance[5][5].sqrt(), covariance[6][6].sqrt()]
}

/// Where the gear is known, the offset is the mean of what is left, and what is not known of the gear makes it less known.
#[test]
fn the_least_deviation_of_a_known_gear_is_that_of_a_mean() {
    let known = Settings { drift: 0.0, largest_change: 0.0, ..Settings::default() };
    let [offset, delay] = least_deviations(Motion::Sine, 400, known);
    let of_mean = 0.01 / (600.0 / PERIOD_S).sqrt();
    assert!((offset / of_mean - 1.0).abs() < 1e-3, "{offset} for {of_mean}");
    // A sine of 1 Hz to 0.9 on a spring that is nearly straight.
    let of_sine = of_mean / (0.9 * std::f64::consts::TAU / 2.0_f64.sqrt());
    assert!((delay / of_sine - 1.0).abs() < 0.2, "{delay} for {of_sine}");
    let [unknown, _] = least_deviations(Motion::OneSided, 400, Settings::default());
    assert!(unknown > 10.0 * of_mean, "{unknown} for {of_mean}");
}

/// The smallest offset and delay that are reported within 600 s, beside the smallest that could be: the limit and five of the least standard deviations.
#[test]
#[ignore = "the tables of the documentation"]
fn smallest_faults() {
    let rated = block().torque_scale_nm();
    let smallest = |motion: Motion, sizes: &[f64], fault: fn(f64) -> Fault, warning: Warning| {
        let is_reported = |size: f64| {
            (1..=3).all(|seed| {
                let case = Case { motion, seed, fault: (fault(size), 0.0), ..Case::default() };
                run::<f32>(&case, |_, _| {}).warnings.has(warning)
            })
        };
        sizes.iter().copied().find(|size| is_reported(*size))
    };
    let steps: Vec<f64> = (0..40).map(|step| 0.5 * 1.1_f64.powi(step)).collect();
    println!(
        "| motion | least sd of offset, % | could be reported, % | is reported, % | least sd of delay, ms | could be reported, ms | is reported, ms |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for motion in Motion::ALL {
        let mut stretches = 0;
        run::<f32>(&Case { motion, ..Case::default() }, |_, state| stretches = state.stretches());
        let [offset, delay] = least_deviations(motion, stretches, Settings::default());
        let offsets: Vec<f64> = steps.iter().map(|percent| 0.01 * percent * rated).collect();
        let delays: Vec<f64> = steps.iter().map(|ms| 1e-3 * ms).filter(|delay| *delay < 0.02).collect();
        let off = smallest(motion, &offsets, Fault::Offset, Warning::Offset);
        let late = smallest(motion, &delays, Fault::Delay, Warning::Delay);
        for (reported, least) in [(off, 0.01 * rated * (0.5 + 500.0 * offset)), (late, 1e-3 * (0.5 + 5e3 * delay))] {
            assert!(reported.is_none_or(|reported| reported >= least), "{motion:?}: {reported:?} is less than {least}");
        }
        let text = |of: Option<f64>, unit: f64| of.map_or("–".into(), |of| format!("{:.2}", of / unit));
        println!(
            "| {motion:?} | {:.3} | {:.2} | {} | {:.3} | {:.2} | {} |",
            100.0 * offset,
            0.5 + 500.0 * offset,
            text(off, 0.01 * rated),
            1e3 * delay,
            0.5 + 5e3 * delay,
            text(late, 1e-3)
        );
    }
}

/// Nothing drifts: 1000 runs of 600 s.
#[test]
#[ignore = "minutes in release"]
fn a_thousand_runs_without_drift() {
    for (white, coloured) in [(0.01, [0.0; 2]), (0.007, [0.007, 0.95])] {
        for motion in Motion::FIVE {
            let (mut beyond, mut worst, mut taken, mut warned) = (0, 0.0_f64, 0, 0);
            for seed in 0..200 {
                let outcome = run::<f32>(&Case { motion, seed, white, coloured, ..Case::default() }, |_, _| {});
                let [fixed, adapted, _] = outcome.one_step;
                assert!(adapted <= 1.02 * fixed, "{motion:?} {seed}: {adapted} for {fixed}");
                worst = worst.max(adapted / fixed);
                beyond += u32::from(outcome.deviations.iter().any(|z| z.abs() > 3.0));
                taken += outcome.taken_over;
                warned += u32::from(outcome.warnings.bits() != 0);
            }
            println!(
                "{motion:?}, coloured {}: {beyond} of 200 beyond 3 sd, worst ratio {worst:.5}, {taken} takeovers, {warned} with warnings",
                coloured[0]
            );
            assert!(beyond <= 2, "{motion:?}: {beyond} of 200");
        }
    }
}

/// 1000 h of normal running without drift: one warning at most.
#[test]
#[ignore = "minutes in release"]
fn false_alarms_in_a_thousand_hours() {
    let mut warned = 0;
    for hour in 0..200 {
        for motion in Motion::FIVE {
            let case = Case { motion, seed: 10_000 + hour, seconds: 3600.0, ..Case::default() };
            let outcome = run::<f32>(&case, |_, _| {});
            if outcome.warnings.bits() != 0 {
                warned += 1;
                println!("{motion:?} {hour}: {:?}", outcome.warnings.iter().collect::<Vec<_>>());
            }
        }
    }
    println!("{warned} of 1000 h with warnings");
    assert!(warned <= 1, "{warned} of 1000 h");
}

/// Samples through excitation that comes and goes, by a gear that wanders: the estimate stays finite and within its prior, the error does not grow.
fn long_run(samples: u64) {
    let block = block();
    let a = block.rated_deflection_rad() as f32;
    let settings = Settings::<f64>::default();
    let prior = (0.5 * settings.largest_change).powi(2) as f32;
    let adaptation = Adaptation::<f32>::new(&block, &settings).expect("law masing");
    let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
    let (mut state, mut path) = (adaptation.start(), gear.start::<16>(0.0));
    let mut in_force = gear;
    let (mut noise, mut errors) = (1_u32, [0.0_f64; 4]);
    let (mut phase, mut mode) = (0.0_f32, 0);
    for k in 0..samples {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // A stay of 100 s in one kind of motion, of 1000 s at rest now and then.
        if k % 100_000 == 0 && (k / 100_000) % 17 != 3 {
            mode = if (k / 100_000) % 17 < 3 {
                noise >> 29
            } else if (k / 100_000) % 17 < 13 {
                7
            } else {
                noise >> 29
            };
        }
        let (speed, amplitude, bias) = match mode {
            0 => (6.0, 0.9, 0.0),
            1 => (0.3, 0.98, 0.0),
            2 => (3.0, 0.1, 0.6),
            3 => (3.0, 0.01, 0.0),
            4 => (20.0, 0.3, 0.0),
            5 => (4.0, 0.4, 0.5),
            6 => (2.0, 0.6, -0.3),
            _ => (0.0, 0.0, 0.4),
        };
        phase = (phase + speed * 1e-3) % std::f32::consts::TAU;
        let u = if k < 4000 { 0.99 * (k as f32 * 1.6e-3).sin() } else { bias + amplitude * phase.sin() };
        // Stiffness and hysteresis wander by 3 % within an hour and a half.
        let wander = 1.0 + 0.03 * (std::f64::consts::TAU * k as f64 / 5e6).sin() as f32;
        let truth = wander * gear.step(&mut path, a * u).torque;
        let torque = truth + 0.6 * ((noise >> 8) as f32 / 16_777_216.0 - 0.5);
        errors[(4 * k / samples) as usize] += f64::from(in_force.output(&path).torque - truth).powi(2);
        match adaptation.period(&mut state, &path, torque) {
            Change::None => {}
            Change::TakenOver => {
                let params = adaptation.params(&state, &block).expect("acceptable parameters");
                in_force = Gear::with_law(&params, Masing::new(&params));
            }
            Change::GivenBack => in_force = gear,
        }
        if k % 1000 == 0 {
            for (value, variance) in state.estimate().into_iter().zip(state.variances()) {
                assert!(value.abs() < 0.25, "sample {k}: {:?}", state.estimate());
                assert!(variance > 0.0 && variance <= prior * 1.000_1, "sample {k}: {variance}");
            }
        }
    }
    let rms = errors.map(|sum| (sum / (samples / 4) as f64).sqrt() / block.torque_scale_nm());
    println!("{samples} samples: error of those in force by quarter, of T_A: {rms:?}; {:?}", state.warnings());
    assert!(rms.iter().all(|rms| *rms < 0.02), "{rms:?}");
    assert!(rms[3] < 1.5 * rms[0] + 2e-3, "{rms:?}");
}

#[test]
fn two_million_samples() {
    long_run(2_000_000);
}

#[test]
#[ignore = "a minute in release"]
fn a_hundred_million_samples() {
    long_run(100_000_000);
}
