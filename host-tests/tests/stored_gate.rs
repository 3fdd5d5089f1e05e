//! A block with the top speed of its drive gates the samples of every gear that is made of it, in every law and scalar; one without it gates none.

use crate::common::{A, params};
use gmhm::block::{
    BlockError, Header, Identity, Joint, LARGEST_STEP, PREPARED, PREPARED_GEAR, Parameters, Prepared, PreparedLaw,
    Word, Writer, check_set_up, crc32, verify,
};
use gmhm::diagnostics::SelfTest;
use gmhm::feedforward::{Controls, Demand, FeedForward, Limits, Source};
use gmhm::memory::masing::Masing;
use gmhm::memory::{AnyLaw, MemoryLaw};
use gmhm::scalar::{Fixed, Scalar};
use gmhm::{Gate, Gear, Inverse, Kernel, Law, Params};

const PERIOD_S: f64 = 1e-3;
/// Of the deflection in a period, over A: the golden samples lie further apart.
const STEP: f64 = 0.05;

fn every_law() -> [Params; 3] {
    [Law::Masing, Law::Phase, Law::Time].map(|law| params(law, Kernel::Deflection, Gate::Cycle))
}

fn block<S: Word, L: PreparedLaw<S>>(params: &Params, law: L, step: Option<S>, is_prepared: bool) -> Vec<u8> {
    let inverse = Inverse::of(params, law, PERIOD_S).expect("an inverse");
    let mut buffer = vec![0; 1024];
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::of_name("bench"), S::KIND) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(inverse.gear(), params).expect("a gear");
    writer.inverse::<S>(params, PERIOD_S).expect("an inverse");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    if is_prepared {
        writer.prepared(&inverse).expect("room");
    }
    if let Some(step) = step {
        writer.largest_step(step).expect("a step");
    }
    writer.joint(&Joint::default()).expect("a joint");
    let length = writer.finish().expect("room");
    buffer.truncate(length);
    buffer
}

/// Whether a gear at 0 quarantines a step, A.
fn quarantines<S: Scalar, L: MemoryLaw<S>>(gear: &Gear<S, L>, step: f64) -> bool {
    let mut state = gear.start::<16>(S::ZERO);
    gear.step(&mut state, gear.frame().deflection(S::from_f64(step)));
    state.status().quarantined
}

#[test]
fn every_gear_of_a_block_takes_its_largest_step() {
    for params in every_law() {
        let law = AnyLaw::<f32>::new(&params, PERIOD_S);
        let missing = if params.memory().law == Law::Masing { PREPARED.tag } else { PREPARED_GEAR.tag };
        for is_prepared in [true, false] {
            for (step, beyond) in [(None, false), (Some((STEP * A) as f32), true)] {
                let bytes = block(&params, law, step, is_prepared);
                check_set_up(&verify(&bytes).expect("a block")).expect("a set-up");
                let loaded = Parameters::<f32>::load_any(&bytes, 16).expect("a good block");
                let stored = Parameters::<f32>::load(&bytes, 16);
                assert_eq!(stored, if is_prepared { Ok(loaded.clone()) } else { Err(BlockError::Missing(missing)) });
                assert_eq!(loaded.self_test, SelfTest::Passed);
                let mut gears = vec![loaded.gear.expect("a gear"), *loaded.inverse.expect("an inverse").gear()];
                if is_prepared {
                    let prepared = Prepared::<f32, AnyLaw<f32>>::load(&bytes, 16).expect("a good block");
                    assert_eq!(prepared.self_test, SelfTest::Passed);
                    gears.push(*prepared.gear());
                }
                for gear in gears {
                    assert!(!quarantines(&gear, 0.9 * STEP));
                    assert_eq!(
                        quarantines(&gear, 1.1 * STEP),
                        beyond,
                        "{:?}, prepared: {is_prepared}",
                        params.memory()
                    );
                }
            }
        }
    }
}

#[test]
fn fixed_point_counts_it_in_rated_deflections() {
    let params = every_law()[0];
    for (step, beyond) in [(None, false), (Some(Fixed::from_f64(STEP)), true)] {
        let bytes = block(&params, Masing::<Fixed>::new(&params), step, true);
        let prepared = Prepared::<Fixed>::load(&bytes, 16).expect("a good block");
        let loaded = Parameters::<Fixed, Masing<Fixed>, ()>::load(&bytes, 16).expect("a good block");
        for gear in [*prepared.gear(), loaded.gear.expect("a gear")] {
            assert!(!quarantines(&gear, 0.9 * STEP));
            assert_eq!(quarantines(&gear, 1.1 * STEP), beyond);
        }
    }
}

/// Whether a feed-forward along the measurement refuses a step from 0, A.
fn refuses(feed: &FeedForward<f32>, step: f64) -> bool {
    let mut state = feed.start::<16>(0.0);
    let controls = Controls { on: true, source: Source::Measurement, ratio: 1.0 };
    [0.0, step].map(|u| feed.step(&mut state, &controls, &Demand { torque: 1.0, deflection: (u * A) as f32 }).refused)
        [1]
}

/// The top speed is that of the block whatever the period of the drive, and the lower of two.
#[test]
fn a_feed_forward_of_the_block_has_its_top_speed() {
    for params in every_law() {
        let bytes = block(&params, AnyLaw::<f32>::new(&params, PERIOD_S), Some((STEP * A) as f32), true);
        let loaded = Parameters::<f32>::load(&bytes, 16).expect("a good block");
        let prepared = Prepared::<f32, AnyLaw<f32>>::load(&bytes, 16).expect("a good block");
        let limits = Limits { period_s: PERIOD_S as f32, ..Limits::default() };
        let lower = Limits { largest_rate_rad_per_s: (0.5 * STEP * A / PERIOD_S) as f32, ..limits };
        let slower = Limits { period_s: 2.0 * limits.period_s, ..limits };
        let is_time = params.memory().law == Law::Time;
        for (limits, step) in [(limits, STEP), (lower, 0.5 * STEP), (slower, 2.0 * STEP)] {
            if is_time && limits.period_s != PERIOD_S as f32 {
                continue;
            }
            for feed in [loaded.feed_forward(&limits), prepared.feed_forward(&limits)] {
                let feed = feed.expect("a feed-forward");
                assert!(!refuses(&feed, 0.9 * step));
                assert!(refuses(&feed, 1.1 * step), "{:?}", params.memory());
            }
        }
    }
}

/// The inverse asks for what it has to, however far.
#[test]
fn what_the_inverse_asks_for_is_no_sample() {
    for params in every_law() {
        let bytes = block(&params, AnyLaw::<f32>::new(&params, PERIOD_S), Some((STEP * A) as f32), true);
        let inverse = Prepared::<f32, AnyLaw<f32>>::load(&bytes, 16).expect("a good block").inverse;
        let mut state = inverse.gear().start::<16>(0.0);
        for torque in [10.0_f32, -12.0] {
            let (_, output) = inverse.commit(&mut state, torque);
            assert!((output.torque - torque).abs() < 1e-3, "{}", output.torque);
            let (_, output) = inverse.commit_after(&mut state, 0.5 * torque, PERIOD_S as f32);
            assert!((output.torque - 0.5 * torque).abs() < 1e-3, "{}", output.torque);
            assert!(!state.status().quarantined);
        }
    }
}

#[test]
fn a_step_that_is_none_is_refused() {
    let params = every_law()[0];
    let bytes = block(&params, AnyLaw::<f32>::new(&params, PERIOD_S), Some(1.0), true);
    let at = bytes.windows(4).position(|four| four == [0x05, 0x80, 4, 0]).expect("the record") + 4;
    for word in [0.0_f32, -1.0, f32::NAN, f32::INFINITY] {
        let mut other = bytes.clone();
        other[at..at + 4].copy_from_slice(&word.to_le_bytes());
        let end = other.len() - 4;
        let crc = crc32(&other[..end]).to_le_bytes();
        other[end..].copy_from_slice(&crc);
        let refused = BlockError::OutOfRange { tag: LARGEST_STEP.tag, field: "largest_step" };
        assert_eq!(Parameters::<f32>::load(&other, 16).map(drop), Err(refused), "{word}");
        let refused = BlockError::Malformed(LARGEST_STEP.tag);
        assert_eq!(Prepared::<f32, AnyLaw<f32>>::load(&other, 16).map(drop), Err(refused), "{word}");
    }
}
