//! `gmhm fit --report`, and what it says of a fit.

use crate::browser::{assert_light_and_dark, assert_self_contained, assert_works};
use crate::common::WorkDir;
use crate::gears::{Path, cycle, published, record};
use gmhm::Elastic;
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::verdict::{Assessment, Grade, structure};
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::recording::{Recording, Samples, TorqueUnit};
use gmhm_tools::report::fit::{loop_figure, page};
use gmhm_tools::report::fit_words::worded;
use gmhm_tools::report::page::Provenance;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const A: f64 = 1.168e-3;

fn assessed(recordings: &[Recording], rated_rad: f64) -> (Fit, Assessment) {
    let options = FitOptions { rated_deflection_rad: Some(rated_rad), ..FitOptions::default() };
    let fit = fit(recordings, &options, &()).unwrap();
    let assessment = Assessment::of(&fit, recordings, &()).unwrap();
    (fit, assessment)
}

fn gear(rows: usize, cycles: f64, noise_nm: f64) -> Recording {
    let (elastic, memory) = published();
    record(A, elastic, memory, &Path { theta: cycle(A, rows, cycles), period_s: 1e-2 }, noise_nm, 5)
}

fn says(assessment: &Assessment, grade: Grade, words: &str) {
    let verdict = &assessment.verdict;
    let worded = worded(verdict, TorqueUnit::NewtonMetre);
    assert!(worded.reasons.iter().any(|r| r.grade == grade && r.words.contains(words)), "{words}: {verdict:#?}");
    assert!(verdict.grade >= grade);
}

#[test]
fn a_gear_of_the_law_is_good_enough() {
    let (_, assessment) = assessed(&[gear(4000, 4.0, 0.1)], A);
    assert_eq!(assessment.verdict.grade, Grade::Good, "{:#?}", assessment.verdict);
    let sentence = worded(&assessment.verdict, TorqueUnit::NewtonMetre).sentence;
    assert!(sentence.starts_with("Good enough to flash: the error held out is 0."));
}

#[test]
fn physics_left_out_is_seen_as_what_repeats() {
    let mut recording = gear(4000, 4.0, 0.1);
    let theta = recording.deflection_rad.clone().unwrap();
    for (torque, theta) in recording.torque.as_mut().unwrap().iter_mut().zip(&theta) {
        *torque += 0.4 * (40.0 * theta / A).sin();
    }
    let (_, assessment) = assessed(&[recording], A);
    says(&assessment, Grade::Caution, "repeats at the same position and direction");
}

#[test]
fn noise_repeats_nothing_however_slow() {
    let motion = gear(4000, 4.0, 0.0);
    let false_alarms = (0..200).filter(|seed| {
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        let mut drift = 0.0;
        let residual: Vec<f64> = (0..4000)
            .map(|_| {
                let shock: f64 = StandardNormal.sample(&mut random);
                drift = 0.98 * drift + shock;
                drift
            })
            .collect();
        structure(std::slice::from_ref(&motion), &[residual], *seed).unwrap().significant
    });
    // One in a hundred is meant; seven of two hundred would be met once in a thousand runs.
    let count = false_alarms.count();
    assert!(count <= 7, "{count} of 200");
}

#[test]
fn short_strokes_a_spring_and_noise_are_told() {
    let (elastic, memory) = published();
    let short = record(A, elastic, memory, &Path { theta: cycle(0.5 * A, 2000, 3.0), period_s: 1e-2 }, 0.05, 5);
    says(&assessed(&[short], A).1, Grade::Caution, "only 50 % of the rated deflection was recorded");

    let spring = Elastic { c1_nm_per_rad: 2e4, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 };
    let none = gmhm::Memory { alpha: 0.0, ..memory };
    let path = Path { theta: cycle(A, 2000, 3.0), period_s: 1e-2 };
    says(&assessed(&[record(A, spring, none, &path, 0.1, 5)], A).1, Grade::Bad, "show no hysteresis");

    says(&assessed(&[gear(2000, 3.0, 6.0)], A).1, Grade::Bad, "of the peak torque");
}

#[test]
fn a_sensor_at_its_end_a_single_stroke_and_a_flipped_sign_are_told() {
    let whole = gear(4000, 2.0, 0.1);
    let limit = |values: &mut Option<Samples>, most: f64| {
        values.iter_mut().flatten().for_each(|x| *x = x.clamp(-most, most));
    };
    let (mut torque, mut deflection) = (whole.clone(), whole.clone());
    limit(&mut torque.torque, 20.0);
    limit(&mut deflection.deflection_rad, 0.7 * A);
    says(&assessed(&[torque], A).1, Grade::Bad, "the torque stays at −20 N·m while the deflection changes");
    says(&assessed(&[deflection], A).1, Grade::Bad, "the deflection stays at −0.8176 mrad while the torque changes");

    let (elastic, memory) = published();
    let stroke: Vec<f64> = (0..2000).map(|k| A * (f64::from(k) / 1000.0 - 1.0)).collect();
    let stroke = record(A, elastic, memory, &Path { theta: stroke, period_s: 1e-2 }, 0.1, 5);
    says(&assessed(&[stroke], A).1, Grade::Caution, "never turns back");

    let mut flipped = whole;
    flipped.torque.iter_mut().flatten().for_each(|x| *x = -*x);
    says(&assessed(&[flipped], A).1, Grade::Bad, "counted backwards");

    // Of another cycle than the one recorded; a smaller stroke of the same is no reason.
    says(
        &assessed(&[gear(4000, 4.0, 0.1)], 1.03 * A).1,
        Grade::Caution,
        "of 1.1680 mrad, the largest recorded, the error of rows held out is",
    );
    let smaller = Path { theta: cycle(0.6 * A, 4000, 4.0), period_s: 1e-2 };
    assert_eq!(assessed(&[record(A, elastic, memory, &smaller, 0.1, 5)], A).1.better_rated, None);

    // Counts of a coarse converter and a gear at rest are no such thing.
    let mut counted = gear(4000, 4.0, 0.1);
    counted.torque.iter_mut().flatten().for_each(|x| *x = (*x / 2.0).round() * 2.0);
    assert!(assessed(&[counted], A).1.clipped.is_empty());
}

#[test]
fn no_line_leads_from_one_recording_to_the_next() {
    // The first ends at the upper tip, the second starts at the lower one.
    let (elastic, memory) = published();
    let part = |theta: Vec<f64>| record(A, elastic, memory, &Path { theta, period_s: 1e-2 }, 0.1, 5);
    let up = cycle(A, 700, 2.25);
    let recordings = [part(up.clone()), part(up.iter().map(|x| -x).rev().collect())];
    let (fit, assessment) = assessed(&recordings, A);
    let svg = loop_figure(&fit, &assessment, &recordings).to_file();
    let mut lines = 0;
    for line in svg.split("<polyline").skip(1).filter(|line| line.contains("stroke=\"#0072B2\"")) {
        let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        let across: Vec<f64> =
            points.split_whitespace().map(|p| p.split(',').next().unwrap().parse().unwrap()).collect();
        assert!(across.windows(2).all(|w| (w[1] - w[0]).abs() < 100.0), "{points}");
        lines += across.len();
    }
    assert!(lines > 100, "{lines} points");
}

#[test]
fn what_is_left_is_what_the_fit_leaves_whatever_the_gear_went_through_before() {
    // The second begins on the rated cycle, which a prediction from rest cannot know.
    let whole = gear(4000, 2.0, 0.1);
    let later = whole.part(2000..4000);
    let recordings = [whole, later];
    let (fit, assessment) = assessed(&recordings, A);
    assert_eq!((&fit.known_start[..], &fit.unsettled_rows[..]), (&[true, false][..], &[0, 0][..]));
    let largest = assessment.residuals.iter().flatten().fold(0.0_f64, |a, r| a.max(r.abs()));
    assert!(largest < 0.6, "{largest} N·m beside noise of 0.1");
    let html = page(&fit, &assessment, &recordings, Provenance::default()).to_html();
    assert!(html.contains("as fitted, with the estimated memory at the first row"));
}

#[test]
fn the_report_of_a_million_rows_is_small() {
    let recording = gear(1_000_000, 300.0, 0.1);
    let options = FitOptions { rated_deflection_rad: Some(A), ..FitOptions::default() };
    let fit = fit(&[recording.beginning(6000)], &options, &()).unwrap();
    let recordings = [recording];
    let assessment = Assessment::of(&fit, &recordings, &()).unwrap();
    let html = page(&fit, &assessment, &recordings, Provenance::default()).to_html();
    assert_self_contained(&html);
    assert!((20_000..25_000).contains(&assessment.comparison_rows), "{}", assessment.comparison_rows);
}

#[test]
fn the_command_writes_a_page_that_a_browser_shows() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    let done = dir.succeed("fit demo/recording.csv -o gear.toml --json fit.json --report fit.html --seed 4");
    let html = dir.read("fit.html");
    assert_self_contained(&html);
    let json: serde_json::Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    let sentence = json["verdict"]["sentence"].as_str().unwrap();
    assert!(done.stdout.starts_with(sentence) && html.contains(sentence), "{sentence}");
    assert!(html.find(sentence).unwrap() < html.find("Hysteresis loop").unwrap(), "the verdict comes first");
    let bytes = std::fs::read(dir.path("demo/recording.csv")).unwrap();
    let hash = hex::encode(<sha2::Sha256 as sha2::Digest>::digest(&bytes));
    for part in [
        hash.as_str(),
        "gmhm fit demo/recording.csv -o gear.toml",
        "<dd>4</dd>",
        "torsional deflection θ in mrad",
        "torque T in N·m",
        "recording minus model in N·m",
        "time in s",
        "correlation of the estimates",
        "rms held out in N·m",
        "in blocks held out",
        "N·m/rad⁵",
        "not determined by itself",
        "deflection rate in mrad/s",
        "Maxwell slip, 16 elements",
        "The search stopped because",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert_works(&dir.path("fit.html"));
    assert_light_and_dark(&dir.path("fit.html"));
}

#[test]
fn a_report_that_cannot_appear_is_refused_before_the_work() {
    let dir = WorkDir::new();
    dir.succeed("demo --out demo");
    dir.refuse("fit demo/recording.csv -o gear.toml --report no/such/fit.html", &["no/such", "does not exist"]);
}
