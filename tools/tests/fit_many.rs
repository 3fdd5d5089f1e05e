//! Long recordings, and many of them.

use std::fs;

use crate::common::skips::skipped;
use crate::gears::{Path, band_limited, published, record, with_coloured_noise};
use gmhm_tools::bench::{Experiment, Options, simulate};
use gmhm_tools::fit::verdict::{Assessment, Grade};
use gmhm_tools::fit::{FitOptions, fit};
use gmhm_tools::model::{GearSection, Model};
use gmhm_tools::recording::Recording;

fn model() -> Model {
    let (elastic, memory) = published();
    let gear = GearSection { rated_deflection_rad: Some(1.168e-3), ..GearSection::default() };
    Model { gear, elastic: Some(elastic), memory: Some(memory), ..Model::default() }
}

#[test]
fn the_law_is_chosen_over_the_whole_of_a_recording_whose_beginning_has_no_loop() {
    // The first 20 000 rows are an eighth of the first stroke.
    let options = Options { sample_rate_hz: Some(4000.0), duration_s: Some(40.0), cycles: Some(1), ..Options::new() };
    let (recording, _) = simulate(&model(), Experiment::Cycle, &options, 1).unwrap();
    let recordings = [recording];
    let found = fit(&recordings, &FitOptions::default(), &()).unwrap();
    let assessment = Assessment::of(&found, &recordings, &()).unwrap();
    assert_eq!(assessment.verdict.grade, Grade::Good, "{:?}", assessment.verdict);
    let (memory, true_memory) = (found.model.memory.unwrap(), published().1);
    assert!((memory.e() / true_memory.e() - 1.0).abs() < 0.1, "{memory:?}");
    assert!((memory.h() / true_memory.h() - 1.0).abs() < 0.1, "{memory:?}");
    assert!((15_000..25_000).contains(&found.selection_rows), "{}", found.selection_rows);
    let json = serde_json::to_value(&found).unwrap();
    assert_eq!(json["selection_rows"], found.selection_rows);
}

/// Processor time of this process so far, ticks. `None` where the system does not tell it.
fn ticks() -> Option<u64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    Some(fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?)
}

fn recordings(count: u64) -> Vec<Recording> {
    let (elastic, memory) = published();
    let one = |seed| {
        let path = Path { theta: band_limited(1.168e-3, 1300, seed), period_s: 0.01 };
        with_coloured_noise(&record(1.168e-3, elastic, memory, &path, 0.0, seed), 0.9, 0.05, seed)
    };
    (0..count).map(one).collect()
}

#[test]
fn many_recordings_take_time_in_proportion_to_their_number() {
    let time_of = |count: u64| {
        let recordings = recordings(count);
        let before = ticks()?;
        fit(&recordings, &FitOptions::default(), &()).unwrap();
        Some(ticks()? - before)
    };
    let (Some(few), Some(many)) = (time_of(20), time_of(120)) else {
        return skipped("the time of many recordings", "this system does not state the processor time of a process");
    };
    println!("20 recordings: {few} ticks, 120 recordings: {many} ticks");
    assert!(many < 10 * few.max(20), "{few} ticks for 20 recordings, {many} for 120");
}

#[test]
fn units_that_no_gear_has_are_not_called_good_enough() {
    let scaled = |deflection: f64, torque: f64| {
        let mut recording = recordings(1).swap_remove(0);
        recording.deflection_rad.iter_mut().flatten().for_each(|x| *x *= deflection);
        recording.torque.iter_mut().flatten().for_each(|x| *x *= torque);
        let recordings = [recording];
        let found = fit(&recordings, &FitOptions::default(), &()).unwrap();
        let assessment = Assessment::of(&found, &recordings, &()).unwrap();
        let columns: Vec<&str> = assessment.doubtful_units.iter().map(|unit| unit.column).collect();
        (columns, assessment.verdict.grade)
    };
    assert_eq!(scaled(1.0, 1.0).0, [""; 0]);
    // Milliradians and newton-millimetres read as radians and newton-metres.
    assert_eq!(scaled(1e3, 1.0), (vec!["deflection_rad"], Grade::Bad));
    assert_eq!(scaled(1e3, 1e3), (vec!["deflection_rad", "torque_nm"], Grade::Bad));
}
