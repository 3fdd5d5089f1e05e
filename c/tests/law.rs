//! The small type of `gmhm.h`: its contributions are Rust's to the bit, and other blocks come without a step.

use std::mem::MaybeUninit;

use crate::common::{A, LIMITS, number, random, strange};
use gmhm::block::{BlockError, Header, Identity, Joint, Prepared, ScalarKind, Writer};
use gmhm::feedforward::{Controls, Demand, FeedForward, Limits};
use gmhm::memory::masing::Masing;
use gmhm::{Elastic, Inverse, Memory, Params};
use gmhm_c::{
    ContributionC, DemandC, Law, LimitsC, NULL, OK, VALUE, flag, gmhm_law_init, gmhm_law_load, gmhm_law_restart,
    gmhm_law_step, gmhm_version,
};

fn block(stiffness: f64) -> Vec<u8> {
    let elastic = Elastic { c1_nm_per_rad: stiffness * 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    let params = Params::new(1.168e-3, elastic, memory).expect("the published gear");
    let inverse = Inverse::<f32, _>::of(&params, Masing::new(&params), 0.0).expect("an inverse");
    let mut buffer = vec![0; 1024];
    let mut writer = Writer::new(&mut buffer, Header::new(Identity::of_name("joint 3"), ScalarKind::F32));
    writer.gear(inverse.gear(), &params).expect("a gear");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    writer.prepared(&inverse).expect("room");
    writer.joint(&Joint::default()).expect("a joint");
    let length = writer.finish().expect("room");
    buffer.truncate(length);
    buffer
}

fn law(block: &[u8]) -> Box<Law> {
    let mut law = Box::new(MaybeUninit::uninit());
    // SAFETY: the block outlives the call, and gmhm_law_init writes the law.
    unsafe {
        assert_eq!(gmhm_law_init(Some(&mut law), block.as_ptr(), block.len() as u32, Some(&LIMITS)), OK);
        law.assume_init()
    }
}

fn step(law: &mut Law, torque_nm: f32) -> (ContributionC, u32) {
    let demand = DemandC { torque_nm, on: 1, gain_ratio: 1.0, ..DemandC::default() };
    let mut to = MaybeUninit::uninit();
    let flags = gmhm_law_step(Some(law), Some(&demand), Some(&mut to));
    // SAFETY: gmhm_law_step has written it.
    (unsafe { to.assume_init() }, flags)
}

#[test]
fn contributions_are_those_of_rust() {
    let bytes = block(1.0);
    let mut law = law(&bytes);
    let prepared = Prepared::<f32>::load(&bytes, 16).expect("a good block");
    let limits = Limits {
        period_s: 1e-3,
        ramp_s: 0.1,
        offset_slew_rad_per_s: 0.05,
        torque_slew_nm_per_s: 200.0,
        ..Limits::default()
    };
    let feed = FeedForward::of_inverse(&prepared.inverse, &limits).expect("limits");
    let mut state = feed.start::<16>(0.0);
    let controls = Controls { on: true, ..Controls::default() };
    for k in 0..2000 {
        let torque = 25.0 * (0.013 * k as f32).sin();
        let (found, flags) = step(&mut law, torque);
        let expected = feed.step(&mut state, &controls, &Demand { torque, deflection: 0.0 });
        assert_eq!((found.offset_rad, found.hysteresis_nm, flags), (expected.offset, expected.hysteresis, 0), "{k}");
    }
    let (held, flags) = step(&mut law, f32::NAN);
    assert_eq!(flags, flag::REFUSED);
    assert!(held.offset_rad.is_finite());
}

#[test]
fn another_block_makes_no_step() {
    let mut law = law(&block(1.0));
    let before = (0..1000).map(|_| step(&mut law, 20.0).0).last().expect("a step");
    let stiffer = block(1.2);
    // SAFETY: the block outlives the call.
    let code = unsafe { gmhm_law_load(Some(&mut law), stiffer.as_ptr(), stiffer.len() as u32, Some(&LIMITS)) };
    assert_eq!(code, OK);
    let (first, _) = step(&mut law, 20.0);
    assert!((first.offset_rad - before.offset_rad).abs() <= 1.01 * 0.05e-3, "{first:?} after {before:?}");
    let last = (0..1000).map(|_| step(&mut law, 20.0).0).last().expect("a step");
    assert!(last.offset_rad < 0.95 * before.offset_rad, "{last:?}");
    assert_eq!(gmhm_law_restart(Some(&mut law), 0.0), OK);
    let (restarted, _) = step(&mut law, 20.0);
    assert!((restarted.offset_rad - last.offset_rad).abs() <= 1.01 * 0.05e-3);
}

#[test]
fn what_is_none_is_refused_and_changes_nothing() {
    let good = block(1.0);
    let mut law = law(&good);
    let load = |law: &mut Law, bytes: &[u8], limits: &LimitsC| {
        // SAFETY: the block outlives the call.
        unsafe { gmhm_law_load(Some(law), bytes.as_ptr(), bytes.len() as u32, Some(limits)) }
    };
    let mut damaged = good.clone();
    damaged[60] ^= 1;
    let before = step(&mut law, 5.0);
    assert_eq!(load(&mut law, &damaged, &LIMITS), BlockError::Checksum.code());
    assert_eq!(load(&mut law, &good, &LimitsC { ramp_s: 0.0, ..LIMITS }), VALUE);
    assert!(step(&mut law, 5.0).0.offset_rad > before.0.offset_rad);
    // SAFETY: null is what is tested.
    unsafe {
        assert_eq!(gmhm_law_load(None, good.as_ptr(), 0, Some(&LIMITS)), NULL);
        assert_eq!(gmhm_law_load(Some(&mut law), std::ptr::null(), 0, Some(&LIMITS)), NULL);
        assert_eq!(gmhm_law_load(Some(&mut law), good.as_ptr(), good.len() as u32, None), NULL);
    }
    assert_eq!(gmhm_law_restart(None, 0.0), NULL);
    assert_eq!(gmhm_law_step(None, None, None), flag::NOT_LOADED);
    let version = env!("CARGO_PKG_VERSION").split('.').map(|part| part.parse::<u32>().expect("a number"));
    assert_eq!(gmhm_version(), version.fold(0, |sum, part| sum << 8 | part));
}

/// Whatever a period brings, a torn block between, limits that are none: the contribution is finite and within the range, and a good period is taken at once.
#[test]
fn fuzzed_periods_are_answered() {
    let bytes = block(1.0);
    for along_measurement in [0, 1] {
        let (mut law, mut next) = (law(&bytes), random());
        let (mut torn, mut refused) = (bytes.clone(), 0_u64);
        let mut to = MaybeUninit::uninit();
        for k in 0..number("GMHM_FUZZ", 100_000) / 2 {
            let phase = k as f32 * 1e-3;
            let good = DemandC {
                torque_nm: 15.0 * phase.sin(),
                deflection_rad: 0.5e-3 * phase.sin(),
                on: 1,
                gain_ratio: 1.0,
                along_measurement,
            };
            let mut demand = good;
            let is_bad = next().is_multiple_of(8);
            if is_bad {
                let strange = strange(&mut next);
                match next() % 4 {
                    0 => demand.torque_nm = strange,
                    1 => demand.deflection_rad = strange,
                    2 => demand.gain_ratio = strange,
                    _ => (demand.on, demand.along_measurement) = (next(), next()),
                }
            }
            if next().is_multiple_of(1000) {
                let (at, bit) = (next() as usize % torn.len(), next() % 8);
                torn[at] ^= 1 << bit;
                // SAFETY: the block outlives the call.
                let code = unsafe { gmhm_law_load(Some(&mut law), torn.as_ptr(), torn.len() as u32, Some(&LIMITS)) };
                assert_ne!(code, OK, "byte {at}");
                torn[at] ^= 1 << bit;
                let limits = LimitsC { ramp_s: strange(&mut next).min(0.0), ..LIMITS };
                // SAFETY: as above.
                let code = unsafe { gmhm_law_load(Some(&mut law), torn.as_ptr(), torn.len() as u32, Some(&limits)) };
                assert_eq!(code, VALUE, "{limits:?}");
            }
            let flags = gmhm_law_step(Some(&mut law), Some(&demand), Some(&mut to));
            // SAFETY: gmhm_law_step has written it.
            let now = unsafe { to.assume_init() };
            refused += u64::from(flags & flag::REFUSED != 0);
            assert!(now.offset_rad.abs() <= 2.0 * A && now.hysteresis_nm.abs() <= 61.0, "{k}: {now:?}");
            let numbers = [now.change_rad, now.gain, now.certainty, now.model_torque_nm, now.model_hysteresis_nm];
            assert!(numbers.iter().all(|x| x.is_finite()) && (0.0..=1.0).contains(&now.gain), "{k}: {now:?}");
            assert!(is_bad || flags & flag::REFUSED == 0, "{k}: a good period is taken, {flags:x}");
        }
        assert!(refused > 0);
    }
}
