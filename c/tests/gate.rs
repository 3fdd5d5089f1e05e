//! A block with the top speed of its drive gates the samples of every type of the library; what the program sets counts more.

use std::mem::MaybeUninit;

use crate::common::{A, PLACES, at, block, block_in_time, block_with, places, with_largest_step};
use gmhm_c::{
    ContributionC, DemandC, FeedForwardC, GearC, Joint, Law, LimitsC, OK, OutputC, SampleC, flag,
    gmhm_feed_forward_init, gmhm_feed_forward_step, gmhm_gear_init, gmhm_gear_load, gmhm_gear_set_largest_step,
    gmhm_gear_step, gmhm_init_with_terms, gmhm_law_init, gmhm_law_step, gmhm_load_any, gmhm_set_largest_step,
    gmhm_step,
};

const STEP_RAD: f32 = 0.05 * A;
const LIMITS: LimitsC = LimitsC {
    period_s: 1e-3,
    ramp_s: 0.5,
    offset_slew_rad_per_s: f32::INFINITY,
    torque_slew_nm_per_s: f32::INFINITY,
    largest_rate_rad_per_s: f32::INFINITY,
};

/// Whether a step from 0 is quarantined, by the flags of a call.
fn quarantines(step_rad: f32, mut call: impl FnMut(f32) -> u32) -> bool {
    assert_eq!(call(0.0) & flag::QUARANTINED, 0);
    call(step_rad) & flag::QUARANTINED != 0
}

fn gear_of(block: &[u8]) -> GearC {
    let mut gear = MaybeUninit::uninit();
    // SAFETY: the block outlives the call, which writes the gear.
    unsafe {
        assert_eq!(gmhm_gear_init(Some(&mut gear), block.as_ptr(), block.len() as u32), OK);
        gear.assume_init()
    }
}

fn joint_of(block: &[u8], with_any: bool) -> Box<Joint> {
    let mut joint = Box::new(MaybeUninit::uninit());
    // SAFETY: as above.
    let mut joint = unsafe {
        gmhm_init_with_terms(Some(&mut joint), places(), PLACES, block.as_ptr(), block.len() as u32);
        joint.assume_init()
    };
    if with_any {
        // SAFETY: as above.
        assert_eq!(unsafe { gmhm_load_any(Some(&mut joint), block.as_ptr(), block.len() as u32, 0) }, OK);
    }
    joint
}

fn gear_step(gear: &mut GearC, deflection_rad: f32) -> u32 {
    gmhm_gear_step(Some(gear), deflection_rad, Some(&mut MaybeUninit::<OutputC>::uninit()))
}

fn joint_step(joint: &mut Joint, deflection_rad: f32) -> u32 {
    gmhm_step(Some(joint), Some(&at(deflection_rad)), Some(&mut MaybeUninit::<OutputC>::uninit()))
}

#[test]
fn gear_and_joint_take_the_step_of_their_block() {
    for plain in [block(), block_in_time(), block_with(1.0, &["coulomb_friction"])] {
        let gated = with_largest_step(&plain, STEP_RAD);
        for (bytes, beyond) in [(&plain, false), (&gated, true)] {
            for (step, expected) in [(0.9 * STEP_RAD, false), (1.1 * STEP_RAD, beyond)] {
                let mut gear = gear_of(bytes);
                assert_eq!(quarantines(step, |theta| gear_step(&mut gear, theta)), expected);
                for with_any in [false, true] {
                    let mut joint = joint_of(bytes, with_any);
                    assert_eq!(quarantines(step, |theta| joint_step(&mut joint, theta)), expected, "{with_any}");
                }
            }
        }
        // What the program sets stays, whatever a block says.
        let mut gear = gear_of(&gated);
        assert_eq!(gmhm_gear_set_largest_step(Some(&mut gear), f32::INFINITY), OK);
        // SAFETY: the block outlives the call.
        assert_eq!(unsafe { gmhm_gear_load(Some(&mut gear), gated.as_ptr(), gated.len() as u32) }, OK);
        assert!(!quarantines(2.0 * STEP_RAD, |theta| gear_step(&mut gear, theta)));
        let mut joint = joint_of(&gated, false);
        assert_eq!(gmhm_set_largest_step(Some(&mut joint), 4.0 * STEP_RAD), OK);
        assert!(!quarantines(2.0 * STEP_RAD, |theta| joint_step(&mut joint, theta)));
    }
}

#[test]
fn feed_forwards_take_the_lower_of_block_and_limits() {
    let gated = with_largest_step(&block(), STEP_RAD);
    let lower = LimitsC { largest_rate_rad_per_s: 0.5 * STEP_RAD / LIMITS.period_s, ..LIMITS };
    for (bytes, limits, step) in [(&gated, LIMITS, STEP_RAD), (&gated, lower, 0.5 * STEP_RAD)] {
        for (step, expected) in [(0.9 * step, false), (1.1 * step, true)] {
            let demand = |deflection_rad| DemandC {
                deflection_rad,
                gain_ratio: 1.0,
                on: 1,
                along_measurement: 1,
                torque_nm: 1.0,
            };
            let (pointer, length) = (bytes.as_ptr(), bytes.len() as u32);
            let mut to = MaybeUninit::<ContributionC>::uninit();
            let mut law = MaybeUninit::<Law>::uninit();
            // SAFETY: the block outlives the call, which writes the law.
            let law = unsafe {
                assert_eq!(gmhm_law_init(Some(&mut law), pointer, length, Some(&limits)), OK);
                law.assume_init_mut()
            };
            let found = quarantines(step, |theta| gmhm_law_step(Some(law), Some(&demand(theta)), Some(&mut to)));
            assert_eq!(found, expected);
            let mut feed = Box::new(MaybeUninit::<FeedForwardC>::uninit());
            // SAFETY: as above.
            let feed = unsafe {
                assert_eq!(gmhm_feed_forward_init(Some(&mut feed), pointer, length, Some(&limits)), OK);
                feed.assume_init_mut()
            };
            let found = quarantines(step, |theta| {
                let sample = SampleC { deflection_rad: theta, ..SampleC::default() };
                gmhm_feed_forward_step(Some(feed), Some(&demand(theta)), Some(&sample), Some(&mut to))
            });
            assert_eq!(found, expected);
        }
    }
}
