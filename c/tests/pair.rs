//! Raw counts for the types that take a deflection: the same deflection as `gmhm_step_counts`, any counts answered, and what a block says of its joint.

use std::mem::MaybeUninit;

use crate::common::{A, block_of, gmhm_step_counts, joint, number, random};
use gmhm::block::{Joint as JointOfGear, TorqueUnit, verify};
use gmhm_c::{
    BlockC, ContributionC, DemandC, EncodersC, FeedForwardC, LimitsC, NULL, OK, PairC, SampleC, UNIT, VALUE, flag,
    gmhm_feed_forward_init, gmhm_feed_forward_step, gmhm_load, gmhm_pair_init, gmhm_pair_read, gmhm_pair_restart,
    gmhm_read_block,
};

const JOINT: JointOfGear = JointOfGear { ratio: Some(-100.0), deflection_zero_rad: 0.1255, motor_side: true };

const ENCODERS: EncodersC = EncodersC {
    motor_counts_per_turn: 1 << 20,
    output_counts_per_turn: 1 << 20,
    motor_reversed: 0,
    output_reversed: 0,
};

const LIMITS: LimitsC = LimitsC {
    period_s: 1e-3,
    ramp_s: 0.1,
    offset_slew_rad_per_s: f32::INFINITY,
    torque_slew_nm_per_s: f32::INFINITY,
    largest_rate_rad_per_s: f32::INFINITY,
};

fn pair(block: &[u8], encoders: &EncodersC) -> (PairC, u16) {
    let mut pair = MaybeUninit::uninit();
    // SAFETY: the block outlives the call, and gmhm_pair_init writes the pair.
    unsafe {
        let code = gmhm_pair_init(Some(&mut pair), block.as_ptr(), block.len() as u32, Some(encoders));
        (pair.assume_init(), code)
    }
}

fn pair_of(block: &[u8]) -> PairC {
    let (pair, code) = pair(block, &ENCODERS);
    assert_eq!(code, OK);
    pair
}

fn read(block: &[u8]) -> (BlockC, u16) {
    let mut to = MaybeUninit::uninit();
    // SAFETY: the block outlives the call, and gmhm_read_block writes what it says.
    unsafe {
        let code = gmhm_read_block(block.as_ptr(), block.len() as u32, Some(&mut to));
        (to.assume_init(), code)
    }
}

#[test]
fn counts_give_the_sample_of_a_joint() {
    let bytes = block_of(&JOINT, TorqueUnit::NewtonMetre);
    let mut joint = joint();
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) }, OK);
    let (mut pair, code) = pair(&bytes, &ENCODERS);
    assert_eq!(code, OK);
    let mut of_joint = pair_of(&bytes);
    let turns = |angle: f64| ((angle / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(1 << 20)) as u32;
    for k in 0..300 {
        let (output, theta) = (0.01 * f64::from(k), 0.5 * f64::from(A) * (0.1 * f64::from(k)).sin());
        let motor = turns(-100.0 * (output + theta + 0.1255));
        let mut sample = SampleC { temperature_c: 30.0, ..SampleC::default() };
        assert_eq!(gmhm_pair_read(Some(&mut pair), motor, turns(output), Some(&mut sample)), 0);
        assert!((f64::from(sample.deflection_rad) - theta).abs() < 1e-5, "{k}: {} for {theta}", sample.deflection_rad);
        assert_eq!(sample.temperature_c, 30.0);
        let out =
            gmhm_step_counts(Some(&mut joint), Some(&mut of_joint), motor, turns(output), Some(&SampleC::default()));
        assert_eq!(out.deflection_rad.to_bits(), sample.deflection_rad.to_bits(), "{k}");
    }
    // Half a turn of the motor while nobody looked is no deflection.
    let mut sample = SampleC::default();
    assert_eq!(gmhm_pair_restart(Some(&mut pair)), OK);
    assert_eq!(gmhm_pair_read(Some(&mut pair), turns(-100.0 * 0.1255), 0, Some(&mut sample)), 0);
    assert!(sample.deflection_rad.abs() < 1e-5, "{}", sample.deflection_rad);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let bytes = block_of(&JOINT, TorqueUnit::NewtonMetre);
    let (mut none, code) = pair(&bytes, &EncodersC::default());
    assert_eq!(code, VALUE);
    let mut sample = SampleC { deflection_rad: 7.0, ..SampleC::default() };
    assert_eq!(gmhm_pair_read(Some(&mut none), 0, 0, Some(&mut sample)), flag::NO_ENCODERS);
    assert_eq!(gmhm_pair_read(None, 0, 0, Some(&mut sample)), flag::NO_ENCODERS);
    assert_eq!(sample.deflection_rad, 7.0);
    let without = block_of(&JointOfGear::default(), TorqueUnit::NewtonMetre);
    assert_eq!(pair(&without, &ENCODERS).1, VALUE, "no ratio");
    assert_eq!(pair(&bytes[..bytes.len() - 4], &ENCODERS).1, 0x0101);
    assert_eq!(gmhm_pair_restart(None), NULL);
    assert_eq!(gmhm_pair_read(Some(&mut none), 0, 0, None), flag::NO_ENCODERS);
}

#[test]
fn a_block_says_what_its_joint_is() {
    for unit in [TorqueUnit::NewtonMetre, TorqueUnit::Ampere] {
        let bytes = block_of(&JOINT, unit);
        let (found, code) = read(&bytes);
        assert_eq!(code, OK);
        let crc32 = verify(&bytes).expect("a block").crc();
        assert_eq!((found.length as usize, found.sequence, found.crc32), (bytes.len(), 0, crc32));
        assert_eq!((found.ratio, found.deflection_zero_rad, found.rated_deflection_rad), (-100.0, 0.1255, A));
        assert_eq!((found.torque_on_motor_side, found.period_s, found.terms), (1, 1e-3, 0));
        assert_eq!(found.torque_in_amperes, u32::from(unit == TorqueUnit::Ampere));
        assert!(found.gear.starts_with(b"joint 3\0") && found.torque_scale_nm > 20.0);
        // Amperes are fed forward by nothing that counts in newton metres.
        let mut feed = Box::<FeedForwardC>::new_uninit();
        // SAFETY: the block outlives the call.
        let code =
            unsafe { gmhm_feed_forward_init(Some(&mut feed), bytes.as_ptr(), bytes.len() as u32, Some(&LIMITS)) };
        assert_eq!(code, if unit == TorqueUnit::Ampere { UNIT } else { OK });
    }
    let mut damaged = block_of(&JOINT, TorqueUnit::NewtonMetre);
    damaged[60] ^= 1;
    assert_eq!(read(&damaged), (BlockC::default(), 0x0104));
}

/// Whatever the counts, a feed-forward along the measurement stays finite.
#[test]
fn fuzzed_counts_are_answered() {
    let bytes = block_of(&JOINT, TorqueUnit::NewtonMetre);
    let (mut pair, code) = pair(&bytes, &ENCODERS);
    assert_eq!(code, OK);
    let mut feed = Box::<FeedForwardC>::new_uninit();
    // SAFETY: the block outlives the call, and gmhm_feed_forward_init writes the feed-forward.
    let mut feed = unsafe {
        let code = gmhm_feed_forward_init(Some(&mut feed), bytes.as_ptr(), bytes.len() as u32, Some(&LIMITS));
        assert_eq!(code, OK);
        feed.assume_init()
    };
    let mut next = random();
    let demand = DemandC { torque_nm: 10.0, gain_ratio: 1.0, on: 1, along_measurement: 1, ..DemandC::default() };
    for k in 0..number("GMHM_FUZZ", 100_000) {
        // Now and then counts beyond a turn, or a motor that stands.
        let (motor, output) = match next() % 4 {
            0 => (next(), next()),
            1 => (next() % (1 << 20), next() % (1 << 20)),
            2 => (u32::MAX, 0),
            _ => (next() % 1000, next() % 10),
        };
        let mut sample = SampleC::default();
        assert_eq!(gmhm_pair_read(Some(&mut pair), motor, output, Some(&mut sample)), 0);
        let angles = [sample.deflection_rad, sample.motor_angle_rad, sample.output_angle_rad];
        assert!(angles.iter().all(|angle| angle.is_finite()), "{k}: {angles:?}");
        let demand = DemandC { deflection_rad: sample.deflection_rad, ..demand };
        let mut to = MaybeUninit::<ContributionC>::uninit();
        gmhm_feed_forward_step(Some(&mut feed), Some(&demand), Some(&sample), Some(&mut to));
        // SAFETY: gmhm_feed_forward_step has written it.
        let now = unsafe { to.assume_init() };
        let range = 1.01 * A;
        assert!(now.offset_rad.abs() <= range && now.hysteresis_nm.abs() < 100.0, "{k}: {now:?}");
    }
}

/// A motor that turns and a gear that winds up; now and then one or both counts are torn. The reading after is that of the shafts, in whatever turn the motor was taken to be.
#[test]
fn after_torn_counts_the_next_reading_is_right() {
    let bytes = block_of(&JOINT, TorqueUnit::NewtonMetre);
    let (mut pair, code) = pair(&bytes, &ENCODERS);
    assert_eq!(code, OK);
    let mut joint = joint();
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) }, OK);
    let mut of_joint = pair_of(&bytes);
    let mut next = random();
    let turns = |angle: f64| ((angle / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(1 << 20)) as u32;
    for k in 0..number("GMHM_FUZZ", 100_000) {
        let time = k as f64 * 1e-3;
        let (angle, theta) = (2.0 * (0.3 * time).sin(), 0.5 * f64::from(A) * (5.0 * time).sin());
        let [mut motor, mut output] = [-100.0 * (angle + theta + 0.1255), angle].map(turns);
        let is_bad = k > 0 && next().is_multiple_of(8);
        if is_bad {
            let torn = if next().is_multiple_of(2) { next() } else { motor ^ (1 << (next() % 20)) };
            match next() % 3 {
                0 => motor = torn,
                1 => output = torn,
                _ => (motor, output) = (torn, next()),
            }
        }
        let mut sample = SampleC::default();
        assert_eq!(gmhm_pair_read(Some(&mut pair), motor, output, Some(&mut sample)), 0);
        let seen = gmhm_step_counts(Some(&mut joint), Some(&mut of_joint), motor, output, Some(&SampleC::default()));
        assert!(sample.deflection_rad.is_finite() && seen.torque_nm.is_finite(), "{k}: {seen:?}");
        if !is_bad {
            assert!(
                (f64::from(sample.deflection_rad) - theta).abs() < 1e-5,
                "{k}: {} for {theta}",
                sample.deflection_rad
            );
            assert_eq!((seen.flags, seen.deflection_rad), (0, sample.deflection_rad), "{k}");
        }
    }
}

/// Ratio and zero are those of the block in force, whichever the pair began with.
#[test]
fn counts_follow_another_block() {
    let other = JointOfGear { deflection_zero_rad: 0.1255 - 0.25 * f64::from(A), ..JOINT };
    let [first, second] = [&JOINT, &other].map(|joint| block_of(joint, TorqueUnit::NewtonMetre));
    let (mut joint, mut pair) = (joint(), pair_of(&first));
    let motor = ((-100.0 * 0.1255 / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(1 << 20)) as u32;
    for (block, expected) in [(&first, 0.0), (&second, 0.25), (&first, 0.0)] {
        // SAFETY: the block outlives the call.
        assert_eq!(unsafe { gmhm_load(Some(&mut joint), block.as_ptr(), block.len() as u32) }, OK);
        let out = gmhm_step_counts(Some(&mut joint), Some(&mut pair), motor, 0, Some(&SampleC::default()));
        assert_eq!(out.flags, 0);
        assert!((out.deflection_rad / A - expected).abs() < 0.01, "{} for {expected}", out.deflection_rad / A);
    }
    // A block without a ratio has no raw counts.
    let without = block_of(&JointOfGear::default(), TorqueUnit::NewtonMetre);
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_load(Some(&mut joint), without.as_ptr(), without.len() as u32) }, OK);
    let out = gmhm_step_counts(Some(&mut joint), Some(&mut pair), motor, 0, Some(&SampleC::default()));
    assert_eq!(out.flags, flag::NO_ENCODERS);
}
