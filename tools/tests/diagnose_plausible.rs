//! Recordings that cannot be of the model's gear, as they stand: refused before anything is concluded, or remarked on.

use std::f64::consts::PI;

use crate::common::{PUBLISHED, WorkDir};
use gmhm_tools::diagnose::{DiagnoseError, Options, diagnose};
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::fit;
use gmhm_tools::model::{Model, parse};
use gmhm_tools::physics::predict;
use gmhm_tools::recording::Recording;
use gmhm_tools::regression::error::EstimateError;
use gmhm_tools::signal::conversion::Channel;
use gmhm_tools::signal::plausible::{Implausible, Remark, examine};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const RATED_RAD: f64 = 1.168e-3;

fn published() -> Model {
    parse("gear.toml", PUBLISHED).unwrap()
}

/// A number in ±1 that looks like noise.
fn scatter(k: usize) -> f64 {
    ((k * 7919 + k * k % 613) % 2003) as f64 / 1001.0 - 1.0
}

/// Four slow cycles of the published gear, a little noise on both channels.
fn cycles() -> Recording {
    let mut recording = Recording {
        name: "cycles.csv".into(),
        time_s: (0..2000).map(|k| 0.01 * k as f64).collect(),
        ..Recording::default()
    };
    let swing = |t: &f64| 0.95 * RATED_RAD * (0.4 * PI * t).sin();
    recording.deflection_rad = Some(recording.time_s.iter().map(swing).collect());
    let torque = predict(&published(), None, &recording).unwrap().torque;
    recording.torque = Some(torque.iter().enumerate().map(|(k, t)| t + 0.05 * scatter(k)).collect());
    for (k, theta) in recording.deflection_rad.iter_mut().flatten().enumerate() {
        *theta += 2e-7 * scatter(3 * k + 1);
    }
    recording
}

fn with(torque: impl Fn(f64) -> f64, deflection: impl Fn(f64) -> f64) -> Recording {
    let mut recording = cycles();
    recording.torque.iter_mut().flatten().for_each(|x| *x = torque(*x));
    recording.deflection_rad.iter_mut().flatten().for_each(|x| *x = deflection(*x));
    recording
}

fn same(x: f64) -> f64 {
    x
}

#[test]
fn what_fits_has_no_remark() {
    assert_eq!(examine(&[cycles()], &[], &published()), Ok(vec![]));
    // A model that is off, as models are.
    let off = PUBLISHED.replace("2.4737e4", "1.8e4").replace("2.6532e6", "4e6");
    assert_eq!(examine(&[cycles()], &[], &parse("off.toml", &off).unwrap()), Ok(vec![]));
}

#[test]
fn a_unit_or_a_sign_is_refused_where_it_explains() {
    let mistakes: [(Recording, Channel, f64); 8] = [
        (with(same, |x| 1e3 * x), Channel::Deflection, 1e-3),
        (with(same, f64::to_degrees), Channel::Deflection, PI / 180.0),
        (with(same, |x| 60.0 * x.to_degrees()), Channel::Deflection, PI / 10_800.0),
        (with(same, |x| 1e-3 * x), Channel::Deflection, 1e3),
        (with(same, |x| -x), Channel::Deflection, -1.0),
        (with(|x| 1e3 * x, same), Channel::Torque, 1e-3),
        (with(|x| 1e-3 * x, same), Channel::Torque, 1e3),
        (with(|x| 1e-2 * x, same), Channel::Torque, 100.0),
    ];
    for (recording, of, factor) in mistakes {
        let refused = examine(std::slice::from_ref(&recording), &[], &published());
        let Err(Implausible::Unit { conversion, missed, left, .. }) = &refused else { panic!("{of:?}: {refused:?}") };
        assert_eq!(conversion.of, of);
        assert!((conversion.factor / factor - 1.0).abs() < 1e-12 && left < missed, "{refused:?}");
        // The same by the diagnosis and by the fit, of recordings held out too.
        let diagnosed = diagnose(&[cycles()], &published(), std::slice::from_ref(&recording), &Options::default(), &());
        assert!(matches!(diagnosed, Err(DiagnoseError::Implausible(_))));
        let options = FitOptions { start: Some(published()), ..FitOptions::default() };
        let fitted = fit(&[recording], &options, &());
        assert!(matches!(fitted, Err(EstimateError::Implausible(_))), "{:?}", fitted.err());
    }
}

#[test]
fn deflections_of_another_gear_or_another_zero_are_refused() {
    let refused = examine(&[with(same, |x| x + 1.0)], &[], &published());
    let Err(Implausible::BeyondRated { middle_rad: Some(middle), rows: 2000, .. }) = refused else {
        panic!("{refused:?}")
    };
    assert!((middle - 1.0).abs() < 1e-5);
    let mut small = published();
    small.gear.rated_deflection_rad = Some(1e-5);
    let refused = examine(&[cycles()], &[], &small);
    assert!(matches!(refused, Err(Implausible::BeyondRated { middle_rad: None, .. })), "{refused:?}");
}

#[test]
fn a_zero_of_its_own_is_suspected_and_taken_off_where_it_is_known_to_be() {
    let other = |by: f64| Recording { name: "other.csv".to_owned(), ..with(same, move |x| x + by) };
    let remarks =
        |by: f64| diagnose(&[cycles(), other(by)], &published(), &[], &Options::default(), &()).unwrap().remarks;
    let [.., Remark::OtherZero { other: name, apart_rad, .. }] = &remarks(1e-4)[..] else { panic!("no remark") };
    assert!(name == "other.csv" && (apart_rad - 1e-4).abs() < 1e-6, "{apart_rad}");
    assert!(!remarks(0.0).iter().any(|remark| matches!(remark, Remark::OtherZero { .. })));

    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("simulate gear.toml --experiment amplitudes --sample-rate 20 -o one.csv");
    dir.succeed("simulate gear.toml --experiment cycle --sample-rate 20 --seed 2 -o two.csv");
    let text = dir.read("two.csv");
    let column = text.lines().next().unwrap().split(',').position(|name| name == "deflection_rad").unwrap();
    let moved = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[column] = cells[column].parse::<f64>().map_or(cells[column].clone(), |x| (x + 7e-3).to_string());
        cells.join(",") + "\n"
    };
    dir.write("two.csv", text.lines().map(moved).collect::<String>());
    dir.refuse("diagnose gear.toml one.csv two.csv -o x.toml", &["two.csv", "--own-zeros"]);
    for words in ["one.csv two.csv", "one.csv --holdout two.csv"] {
        let done = dir.succeed(&format!("diagnose gear.toml {words} --own-zeros -o x.toml"));
        assert!(done.stderr.contains("two.csv: its zero is 0.0070"), "{}", done.stderr);
        assert!(done.stdout.contains("No structure beyond noise"), "{}", done.stdout);
    }
}

#[test]
fn what_does_not_move_or_never_changes_is_refused() {
    let mut resting = cycles();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut noise =
        |size: f64| -> Vec<f64> { StandardNormal.sample_iter(&mut random).take(2000).map(|x: f64| size * x).collect() };
    (resting.deflection_rad, resting.torque) = (Some(noise(1e-6).into()), Some(noise(0.09).into()));
    assert!(matches!(examine(&[resting], &[], &published()), Err(Implausible::Still { .. })));
    let dead = with(same, |_| 2e-4);
    assert!(matches!(examine(std::slice::from_ref(&dead), &[], &published()), Err(Implausible::Still { .. })));
    let silent = with(|_| 5.0, same);
    assert!(matches!(examine(&[silent], &[], &published()), Err(Implausible::NoTorqueChange { .. })));
    // What else moves can be diagnosed.
    let turning = Recording { theta_in_rad: Some(dead.time_s.iter().map(|t| 10.0 * t).collect()), ..dead };
    let remarks = examine(&[turning], &[], &published()).unwrap();
    assert!(matches!(remarks[..], [Remark::DeflectionStill { .. }]), "{remarks:?}");
}

#[test]
fn what_is_odd_is_remarked_on() {
    let remarks = examine(&[with(same, |x| 1.6 * x)], &[], &published()).unwrap();
    assert!(matches!(remarks[..], [Remark::OutOfRange { .. }]), "{remarks:?}");
    let remarks = examine(&[with(|x| 8.0 * x, same)], &[], &published()).unwrap();
    assert!(matches!(remarks[..], [Remark::Stiffness { .. }]), "{remarks:?}");
    let remarks = examine(&[with(|x| x.clamp(-20.0, 20.0), same)], &[], &published()).unwrap();
    assert!(matches!(&remarks[..], [Remark::Clipped(clipped)] if clipped.channel == "torque"), "{remarks:?}");
}

#[test]
fn the_commands_say_so() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    let recording = cycles();
    let (theta, torque) = (recording.deflection_rad.unwrap(), recording.torque.unwrap());
    let rows = recording.time_s.iter().zip(&theta).zip(&torque).map(|((t, x), y)| format!("{t},{x},{y}\n"));
    dir.write("rec.csv", "time_s,deflection_rad,tau\n".to_owned() + &rows.collect::<String>());
    let milli = "--map torque_nm=tau*1000";
    dir.refuse(
        &format!("diagnose gear.toml rec.csv {milli} -o out.toml"),
        &["rec.csv", "--map torque_nm=COLUMN*0.001"],
    );
    dir.refuse(&format!("fit --model gear.toml rec.csv {milli} -o out.toml"), &["--map torque_nm=COLUMN*0.001"]);
    let map = "--map torque_nm=tau";
    dir.refuse(&format!("diagnose gear.toml rec.csv {map} --rated-deflection 1e-5 -o out.toml"), &["rated"]);
    let done = dir.succeed(&format!("diagnose gear.toml rec.csv {map} -o out.toml"));
    assert!(!done.stderr.contains("note:"), "{}", done.stderr);
    let open: Vec<&str> = done.stdout.lines().skip_while(|l| !l.ends_with("cannot show:")).skip(1).collect();
    let list: Vec<&str> = open.into_iter().take_while(|l| l.starts_with("    ")).collect();
    assert!(list.len() > 1 && list.iter().all(|line| line.len() <= 100), "{}", done.stdout);
    let done =
        dir.succeed(&format!("diagnose gear.toml rec.csv {map} --holdout rec.csv -o out.toml --report out.html"));
    assert!(done.stderr.contains("note: ") && done.stderr.contains("held out"), "{}", done.stderr);
    assert!(dir.read("out.html").contains("are the same recording"));
    let done = dir.succeed(&format!("fit rec.csv rec.csv {map} -o out.toml"));
    assert!(done.stderr.contains("counts twice"), "{}", done.stderr);
}
