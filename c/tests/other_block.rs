//! Another block in force while the joint runs: its path goes on.

use crate::common::{A, at, block, block_with, gmhm_invert, gmhm_step, joint, without};
use gmhm::block::PREPARED;
use gmhm_c::{Joint, OK, OutputC, SampleC, UNIT, gmhm_load, gmhm_load_any, gmhm_restart};

/// Loads, unloads and loads again, so that two turning points are remembered.
fn walk(joint: &mut Joint) -> OutputC {
    let there = (0..=90).map(|k| k as f32 / 100.0);
    let back = (0..=120).map(|k| 0.9 - k as f32 / 100.0);
    let again = (0..=30).map(|k| -0.3 + k as f32 / 100.0);
    let mut output = OutputC::default();
    for u in there.chain(back).chain(again) {
        output = gmhm_step(Some(joint), Some(&at(u * A)));
    }
    output
}

fn load(joint: &mut Joint, bytes: &[u8]) {
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load(Some(joint), bytes.as_ptr(), bytes.len() as u32) }, OK);
}

#[test]
fn the_same_block_again_changes_nothing() {
    for terms in [&[][..], &["coulomb_friction"]] {
        let bytes = block_with(1.0, terms);
        let mut joint = joint();
        load(&mut joint, &bytes);
        gmhm_restart(Some(&mut joint));
        let before = walk(&mut joint);
        load(&mut joint, &bytes);
        assert_eq!(gmhm_step(Some(&mut joint), Some(&at(0.0))), before, "{terms:?}");
    }
}

#[test]
fn a_stiffer_block_keeps_the_turning_points() {
    let stiffer = block_with(1.1, &[]);
    let (mut changed, mut fresh) = (joint(), joint());
    let before = walk(&mut changed);
    load(&mut changed, &stiffer);
    load(&mut fresh, &stiffer);
    gmhm_restart(Some(&mut fresh));
    let expected = walk(&mut fresh);
    let after = gmhm_step(Some(&mut changed), Some(&at(0.0)));
    assert_eq!(after.flags, 0);
    assert!((after.hysteresis_nm - expected.hysteresis_nm).abs() < 1e-4, "{after:?} for {expected:?}");
    assert!(before.hysteresis_nm.abs() > 0.5, "{before:?}");
}

#[test]
fn terms_come_and_go_beside_the_path() {
    let mut joint = joint();
    let base = walk(&mut joint);
    load(&mut joint, &block_with(1.0, &["viscous_friction", "coulomb_friction"]));
    let mut sample = at(0.0);
    sample.velocity_rad_per_s = 0.5;
    let with_terms = gmhm_step(Some(&mut joint), Some(&sample));
    assert_eq!(with_terms.hysteresis_nm, base.hysteresis_nm);
    assert!(with_terms.terms_nm != 0.0, "{with_terms:?}");
    load(&mut joint, &block_with(1.0, &["coulomb_friction"]));
    let fewer = gmhm_step(Some(&mut joint), Some(&sample));
    assert!(fewer.hysteresis_nm == base.hysteresis_nm && fewer.terms_nm != with_terms.terms_nm, "{fewer:?}");
    load(&mut joint, &block());
    assert_eq!(gmhm_step(Some(&mut joint), Some(&sample)), base);
}

#[test]
fn a_block_without_the_words_of_its_set_up_gives_the_same_bits() {
    let (prepared, other) = (block_with(1.1, &["coulomb_friction"]), block_with(0.9, &[]));
    let plain = without(prepared.clone(), PREPARED.tag);
    let load_any = |joint: &mut Joint, bytes: &[u8]| {
        // SAFETY: the bytes outlive the call.
        unsafe { gmhm_load_any(Some(joint), bytes.as_ptr(), bytes.len() as u32, 0) }
    };
    let mut joints = [joint(), joint()];
    // SAFETY: the bytes outlive the call.
    let refused = unsafe { gmhm_load(Some(&mut joints[1]), plain.as_ptr(), plain.len() as u32) };
    assert_eq!(refused, 0x010C);
    load(&mut joints[0], &prepared);
    assert_eq!(load_any(&mut joints[1], &plain), OK);
    for k in 0..200 {
        let sample = SampleC { velocity_rad_per_s: 0.5, ..at(0.9 * A * (0.1 * k as f32).sin()) };
        let [one, two] = joints.each_mut().map(|joint| {
            let out = gmhm_step(Some(joint), Some(&sample));
            (out, gmhm_invert(Some(joint), 0.5 * out.torque_nm, Some(&sample)))
        });
        assert_eq!(one, two);
    }
    assert_eq!(load_any(&mut joints[1], &other), OK);
    load(&mut joints[0], &other);
    let [one, two] = joints.each_mut().map(|joint| gmhm_step(Some(joint), Some(&at(0.3 * A))));
    assert_eq!(one, two);
    // One in newton metres is none in amperes.
    // SAFETY: the bytes outlive the call.
    let code = unsafe { gmhm_load_any(Some(&mut joints[1]), plain.as_ptr(), plain.len() as u32, 1) };
    assert_eq!(code, UNIT);
}
