//! The feed-forward of `gmhm.h`: what cannot be is refused by its code, another block makes no step, and whatever a program hands over, it answers with finite numbers and is back at the next good period.
//!
//! `GMHM_FUZZ=10000000 cargo test --release -p gmhm-c --test all feed_forward` fuzzes as many periods; `GMHM_FUZZ_SEED` chooses others.

use std::mem::MaybeUninit;

use crate::common::{A, LIMITS, PLACES, block_in_time, block_of, block_with, number, places, random, without};
use gmhm::block::{Joint, PREPARED, TorqueUnit};
use gmhm::terms::Need;
use gmhm_c::{
    ContributionC, DemandC, FeedForwardC, LimitsC, NO_INVERSE, NULL, OK, PERIOD, SampleC, UNIT, VALUE, flag,
    gmhm_feed_forward_init_with_terms, gmhm_feed_forward_load, gmhm_feed_forward_needs, gmhm_feed_forward_restart,
    gmhm_feed_forward_step, need,
};

const PERIOD_S: f32 = 1e-3;
const DEMAND: DemandC = DemandC { torque_nm: 0.0, deflection_rad: 0.0, gain_ratio: 1.0, on: 1, along_measurement: 0 };

fn feed_forward(block: &[u8]) -> Box<FeedForwardC> {
    let mut feed = Box::new(MaybeUninit::uninit());
    // SAFETY: the block outlives the call, and gmhm_feed_forward_init writes the feed-forward.
    unsafe {
        let (block, length) = (block.as_ptr(), block.len() as u32);
        let code = gmhm_feed_forward_init_with_terms(Some(&mut feed), places(), PLACES, block, length, Some(&LIMITS));
        assert_eq!(code, OK);
        feed.assume_init()
    }
}

fn load(feed: &mut FeedForwardC, block: &[u8], limits: &LimitsC) -> u16 {
    // SAFETY: the block outlives the call.
    unsafe { gmhm_feed_forward_load(Some(feed), block.as_ptr(), block.len() as u32, Some(limits)) }
}

fn step(feed: &mut FeedForwardC, demand: &DemandC, sample: &SampleC) -> (ContributionC, u32) {
    let mut to = MaybeUninit::uninit();
    let flags = gmhm_feed_forward_step(Some(feed), Some(demand), Some(sample), Some(&mut to));
    // SAFETY: gmhm_feed_forward_step has written it.
    (unsafe { to.assume_init() }, flags)
}

/// The last of so many periods under a torque, turning slowly.
fn held(feed: &mut FeedForwardC, torque_nm: f32, periods: u32) -> ContributionC {
    let sample = SampleC { velocity_rad_per_s: 0.5, temperature_c: 20.0, ..SampleC::default() };
    let demand = DemandC { torque_nm, ..DEMAND };
    (0..periods).map(|_| step(feed, &demand, &sample).0).last().expect("a period")
}

#[test]
fn what_cannot_be_is_refused_by_its_code() {
    let good = block_with(1.0, &["coulomb_friction"]);
    let mut feed = feed_forward(&good);
    let velocity = need::ALL.iter().position(|need| *need == Need::Velocity).expect("a need");
    assert_eq!(gmhm_feed_forward_needs(Some(&feed)), 1 << velocity);
    let before = held(&mut feed, 20.0, 1000);
    assert_eq!(load(&mut feed, &block_of(&Joint::default(), TorqueUnit::Ampere), &LIMITS), UNIT);
    assert_eq!(load(&mut feed, &good, &LimitsC { ramp_s: 0.0, ..LIMITS }), VALUE);
    let unprepared = without(good, PREPARED.tag);
    assert_eq!(load(&mut feed, &unprepared, &LIMITS), 0x010C);
    assert_eq!(load(&mut feed, &without(unprepared, gmhm::block::INVERSE.tag), &LIMITS), NO_INVERSE);
    assert_eq!(load(&mut feed, &block_in_time(), &LimitsC { period_s: 2.0 * PERIOD_S, ..LIMITS }), PERIOD);
    assert_eq!(gmhm_feed_forward_restart(None, 0.0), NULL);
    // Nothing of it moved what is in force.
    let after = held(&mut feed, 20.0, 1);
    assert_eq!((after.offset_rad, after.joint_terms_nm), (before.offset_rad, before.joint_terms_nm));
}

#[test]
fn another_block_and_a_restart_make_no_step() {
    let mut feed = feed_forward(&block_with(1.0, &["coulomb_friction"]));
    let slew = 1.01 * LIMITS.offset_slew_rad_per_s * PERIOD_S;
    let mut before = held(&mut feed, 20.0, 1000);
    for (stiffness, terms) in [(1.2, &["coulomb_friction"][..]), (1.2, &[]), (1.0, &["viscous_friction"])] {
        assert_eq!(load(&mut feed, &block_with(stiffness, terms), &LIMITS), OK);
        let first = held(&mut feed, 20.0, 1);
        assert!((first.offset_rad - before.offset_rad).abs() <= slew, "{first:?} after {before:?}");
        let terms_step = (first.joint_terms_nm - before.joint_terms_nm).abs();
        assert!(terms_step <= 2.0 * PERIOD_S / LIMITS.ramp_s * before.joint_terms_nm.abs().max(0.25), "{first:?}");
        let last = held(&mut feed, 20.0, 1000);
        assert_ne!(last.offset_rad, before.offset_rad, "{stiffness} {terms:?}");
        before = last;
    }
    assert_eq!(gmhm_feed_forward_restart(Some(&mut feed), 0.5 * A), OK);
    let first = held(&mut feed, 20.0, 1);
    assert!((first.offset_rad - before.offset_rad).abs() <= slew, "{first:?} after {before:?}");
    assert_ne!(first.offset_rad, before.offset_rad, "the past is unknown");
}

#[test]
fn terms_of_gear_and_joint_are_told_apart() {
    let of_gear = held(&mut feed_forward(&block_with(1.0, &["stiffness_asymmetry"])), 20.0, 1000);
    assert!(of_gear.gear_terms_nm != 0.0 && of_gear.joint_terms_nm == 0.0, "{of_gear:?}");
    let of_joint = held(&mut feed_forward(&block_with(1.0, &["coulomb_friction"])), 20.0, 1000);
    assert!(of_joint.gear_terms_nm == 0.0 && of_joint.joint_terms_nm != 0.0, "{of_joint:?}");
}

#[test]
fn terms_take_the_period_that_was_loaded_last() {
    let damped = block_with(1.0, &["viscous_damping"]);
    let mut feeds = [(); 2].map(|()| feed_forward(&damped));
    for feed in &mut feeds {
        held(feed, 0.0, 1);
    }
    assert_eq!(load(&mut feeds[1], &damped, &LimitsC { period_s: 20.0 * PERIOD_S, ..LIMITS }), OK);
    let [fast, slow] = feeds.each_mut().map(|feed| held(feed, 20.0, 1).gear_terms_nm);
    assert!(fast > 5.0 * slow.abs(), "the same motion in 20 times the time: {fast} {slow}");
}

#[test]
fn a_torque_beyond_the_range_says_so() {
    let mut feed = feed_forward(&block_with(1.0, &[]));
    let (_, flags) = step(&mut feed, &DemandC { torque_nm: 200.0, ..DEMAND }, &SampleC::default());
    assert_eq!(flags & flag::SATURATED, flag::SATURATED);
}

#[test]
fn fuzzed_periods_are_answered() {
    let mut next = random();
    let blocks = [&[][..], &["coulomb_friction", "viscous_friction"]].map(|terms| block_with(1.0, terms));
    for (block, along_measurement) in [(&blocks[0], 0), (&blocks[0], 1), (&blocks[1], 0), (&blocks[1], 1)] {
        let mut feed = feed_forward(block);
        let mut refused = 0_u64;
        for k in 0..number("GMHM_FUZZ", 100_000) / 4 {
            let phase = k as f32 * 1e-3;
            let mut demand = DemandC {
                torque_nm: 15.0 * phase.sin(),
                deflection_rad: 0.5 * A * phase.sin(),
                along_measurement,
                ..DEMAND
            };
            let mut sample = SampleC { velocity_rad_per_s: phase.cos(), ..SampleC::default() };
            let bad = next().is_multiple_of(8);
            if bad {
                let strange = match next() % 5 {
                    0 => f32::NAN,
                    1 => f32::INFINITY,
                    2 => -1e30,
                    _ => f32::from_bits(next()),
                };
                match next() % 4 {
                    0 => demand.torque_nm = strange,
                    1 => demand.deflection_rad = strange,
                    2 => demand.gain_ratio = strange,
                    _ => sample.velocity_rad_per_s = strange,
                }
            }
            let (now, flags) = step(&mut feed, &demand, &sample);
            refused += u64::from(flags & flag::REFUSED != 0);
            assert!(now.offset_rad.abs() <= 2.0 * A && now.hysteresis_nm.abs() <= 40.0, "{k}: {now:?}");
            let numbers = [now.change_rad, now.gain, now.certainty, now.gear_terms_nm, now.joint_terms_nm];
            assert!(numbers.iter().all(|x| x.is_finite()), "{k}: {now:?}");
            assert!(bad || flags & flag::REFUSED == 0, "{k}: a good period is taken, {flags:x}");
        }
        assert!(refused > 0);
    }
}
