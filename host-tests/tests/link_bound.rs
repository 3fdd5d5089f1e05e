//! What comes on trial on an enabled drive gives the torques in force within the bound, whatever the path: elastic torque and hysteresis, in every law.

use crate::common;
use crate::common::drives::{Session, bench};
use crate::common::{elastic, memory, torques, walk};
use gmhm::block::{
    Header, Identity, Joint, PREPARED, PREPARED_GEAR, PreparedLaw, ScalarKind, Word, Writer, crc32, stamp, verify,
};
use gmhm::link::server::DEFAULT_BOUND;
use gmhm::link::{Answer, Refusal, Request};
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::scalar::Fixed;
use gmhm::{Elastic, Gate, Gear, Inverse, Kernel, Law, Memory, Params};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PERIOD_S: f64 = 1e-3;

fn finish(mut writer: Writer<'_>, joint: &Joint) -> usize {
    writer.joint(joint).expect("a joint");
    writer.finish().expect("room")
}

fn header(scalar: ScalarKind, sequence: u32) -> Header {
    Header { sequence, period_s: PERIOD_S as f32, ..Header::new(Identity::NONE, scalar) }
}

fn block(params: &Params, sequence: u32) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let mut writer = Writer::new(&mut buffer, header(ScalarKind::F32, sequence));
    let gear = Gear::with_law(params, AnyLaw::<f32>::new(params, PERIOD_S));
    writer.gear(&gear, params).expect("a gear");
    let length = finish(writer, &Joint::default());
    buffer[..length].to_vec()
}

fn fixed_block(params: &Params, sequence: u32) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let mut writer = Writer::new(&mut buffer, header(ScalarKind::Fixed, sequence));
    writer.gear(&Gear::with_law(params, Masing::<Fixed>::new(params)), params).expect("a gear");
    let length = finish(writer, &Joint::default());
    buffer[..length].to_vec()
}

/// Whether an enabled drive with the one takes the other on trial.
fn accepts(old: &[u8], new: &[u8]) -> bool {
    let (mut port, mut drive) = bench(&[old]);
    drive.enabled = true;
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, new).expect("staged");
    match session.ask(&mut port, &mut drive, Request::Try) {
        Ok(Answer::Done) => true,
        Err(refused) if refused.refusal == Refusal::Bound => false,
        other => panic!("{other:?}"),
    }
}

/// The largest difference of the torques along a path over what the bound allows there.
fn largest_ratio(old: &Params, new: &Params, path: &[f64]) -> f64 {
    let a = old.rated_deflection_rad();
    let elastic = Gear::<f64>::new(old).elastic().to_owned();
    let scale = old.torque_scale_nm();
    let [before, after] = [old, new].map(|params| torques(params, path, PERIOD_S));
    let ratios = path.iter().zip(before.iter().zip(&after)).map(|(theta, (before, after))| {
        let allowed = f64::from(DEFAULT_BOUND) * scale * elastic.torque(theta.abs() / a).max(elastic.torque(1.0));
        (after - before).abs() / allowed
    });
    ratios.fold(0.0, f64::max)
}

fn every_form() -> Vec<(Law, Kernel, Gate)> {
    let mut all = vec![(Law::Masing, Kernel::Deflection, Gate::Cycle)];
    for law in [Law::Phase, Law::Time] {
        for kernel in [Kernel::Deflection, Kernel::Rate] {
            all.extend([Gate::Cycle, Gate::None].map(|gate| (law, kernel, gate)));
        }
    }
    all
}

#[test]
fn hysteresis_is_bounded_like_the_spring() {
    for (law, kernel, gate) in every_form() {
        let with = |times: f64| {
            let memory = memory(law, kernel, gate);
            Params::candidate(common::A, elastic(), Memory { alpha: times * memory.alpha, ..memory }).expect("numbers")
        };
        let old = block(&with(0.01), 1);
        for (times, fits) in [(0.01, true), (0.0105, true), (0.02, true), (10.0, false), (0.0, true)] {
            assert_eq!(accepts(&old, &block(&with(times), 2)), fits, "{law:?}, {kernel:?}, {gate:?}, {times}");
        }
        if law == Law::Masing {
            let old = fixed_block(&with(1.0), 1);
            assert!(accepts(&old, &fixed_block(&with(1.2), 2)) && !accepts(&old, &fixed_block(&with(8.0), 2)));
        }
    }
    // Another law is bounded by both widths.
    let [masing, phase] = [Law::Masing, Law::Phase].map(|law| common::params(law, Kernel::Deflection, Gate::Cycle));
    assert!(!accepts(&block(&masing, 1), &block(&phase, 2)));
}

/// The difference of the springs vanishes at two deflections, the second the rated one, and is large beyond or between.
#[test]
fn the_spring_is_bounded_between_and_beyond() {
    let old = common::masing();
    let a = common::A;
    let with = |size: f64, square: f64| {
        // size·T_A·u·(u² − square)·(u² − 1)
        let t = size * old.torque_scale_nm();
        let Elastic { c1_nm_per_rad, c2_nm_per_rad3, c3_nm_per_rad5 } = elastic();
        let elastic = Elastic {
            c1_nm_per_rad: c1_nm_per_rad + square * t / a,
            c2_nm_per_rad3: c2_nm_per_rad3 - (1.0 + square) * t / a.powi(3),
            c3_nm_per_rad5: c3_nm_per_rad5 + t / a.powi(5),
        };
        Params::candidate(a, elastic, old.memory()).expect("numbers")
    };
    for (size, square, fits) in
        [(0.1, 0.25, true), (-0.1, 0.25, true), (5.0, 0.25, false), (-5.0, 0.25, false), (1.0, 0.49, false)]
    {
        let new = with(size, square);
        assert_eq!(accepts(&block(&old, 1), &block(&new, 2)), fits, "{size}, {square}");
        let path: Vec<f64> = (0..=1500).map(|k| f64::from(k) * 1e-3 * a).collect();
        assert_eq!(largest_ratio(&old, &new, &path) <= 1.0, fits, "{size}, {square}");
    }
}

#[test]
fn what_is_accepted_is_within_the_bound_on_every_path() {
    let mut random = ChaCha8Rng::seed_from_u64(16);
    let (mut pairs, mut accepted, mut beyond, mut largest) = (0, 0, 0, 0.0_f64);
    for round in 0..120 {
        for (law, kernel, gate) in every_form() {
            // From small changes to ones that no bound lets through.
            let spread = [0.02, 0.1, 0.3, 1.0][round % 4];
            let factor = |random: &mut ChaCha8Rng| f64::exp(spread * random.random_range(-1.0..1.0));
            let scaled = |random: &mut ChaCha8Rng, rated: f64| {
                let (e, m) = (elastic(), memory(law, kernel, gate));
                let elastic = Elastic {
                    c1_nm_per_rad: factor(random) * e.c1_nm_per_rad,
                    c2_nm_per_rad3: factor(random) * e.c2_nm_per_rad3,
                    c3_nm_per_rad5: factor(random) * e.c3_nm_per_rad5,
                };
                let memory = Memory {
                    alpha: 0.5 * factor(random) * m.alpha,
                    beta_per_s: factor(random) * m.beta_per_s,
                    omega_per_s: factor(random) * m.omega_per_s,
                    reversal_play_rad: if law == Law::Masing {
                        0.02 * common::A * random.random_range(0.0..spread)
                    } else {
                        0.0
                    },
                    ..m
                };
                Params::candidate(rated * common::A, elastic, memory).expect("numbers")
            };
            let old = scaled(&mut random, 1.0);
            let rated = if round % 3 == 0 { factor(&mut random) } else { 1.0 };
            let new = scaled(&mut random, rated);
            pairs += 1;
            let is_accepted = accepts(&block(&old, 1), &block(&new, 2));
            let mut worst = 0.0_f64;
            for path in 0..6 {
                let corners: Vec<f64> = (0..40)
                    .map(|k| match path {
                        0 => [0.0, 1.0, -1.0][if k == 0 { 0 } else { 1 + k % 2 }] * common::A,
                        _ => random.random_range(-1.0..1.0) * [1.5, 1.0, 0.7, 0.3, 0.1][path - 1] * common::A,
                    })
                    .collect();
                worst = worst.max(largest_ratio(&old, &new, &walk(&corners, 0.05)));
            }
            accepted += u32::from(is_accepted);
            beyond += u32::from(worst > 1.0);
            if is_accepted {
                largest = largest.max(worst);
                assert!(worst <= 1.0 + 1e-5, "{law:?}, {kernel:?}, {gate:?}: {worst}\n{old:?}\n{new:?}");
            }
        }
    }
    println!("{accepted} of {pairs} accepted, the torques at most {largest:.2} of the bound apart; {beyond} beyond it");
    assert!(accepted > pairs / 3 && beyond > pairs / 20, "{accepted}, {beyond} of {pairs}");
}

/// The place of a record's words.
fn words_of(block: &[u8], tag: u16) -> usize {
    let records = verify(block).expect("a block");
    let record = records.records().find(|record| record.tag == tag).expect("the record");
    record.payload.as_ptr() as usize - block.as_ptr() as usize
}

/// Why a disabled drive refuses a block, and one that boots from it.
fn refusal(block: &[u8]) -> Option<u16> {
    let mut newer = block.to_vec();
    stamp(&mut newer, 2).expect("a block");
    let (mut port, mut drive) = bench(&[]);
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, &newer).expect("staged");
    let tried = session.ask(&mut port, &mut drive, Request::Try).err();
    let (port, drive) = bench(&[block]);
    assert_eq!(drive.in_force.is_some(), tried.is_none());
    assert_eq!(port.boot_error(), tried.map_or(0, |refused| refused.detail));
    tried.map(|refused| {
        assert_eq!(refused.refusal, Refusal::Block);
        refused.detail
    })
}

fn prepared_block<S: Word>(params: &Params) -> Vec<u8> {
    prepared_block_of(params, Masing::<S>::new(params))
}

fn prepared_block_of<S: Word, L: PreparedLaw<S>>(params: &Params, law: L) -> Vec<u8> {
    let inverse = Inverse::<S, L>::of(params, law, PERIOD_S).expect("an inverse");
    let mut buffer = [0; 1024];
    let mut writer = Writer::new(&mut buffer, header(S::KIND, 1));
    writer.gear(inverse.gear(), params).expect("a gear");
    writer.inverse::<S>(params, PERIOD_S).expect("an inverse");
    writer.prepared(&inverse).expect("room");
    let length = finish(writer, &Joint::default());
    buffer[..length].to_vec()
}

/// What is bounded is the record `gear`, what is computed with `prepared`: they are of one gear, or the block is refused.
#[test]
fn a_set_up_of_another_gear_is_refused() {
    let params = common::masing();
    let stiffer = elastic();
    let stiffer = Elastic {
        c1_nm_per_rad: 100.0 * stiffer.c1_nm_per_rad,
        c2_nm_per_rad3: 100.0 * stiffer.c2_nm_per_rad3,
        c3_nm_per_rad5: 100.0 * stiffer.c3_nm_per_rad5,
    };
    let memory = Memory { alpha: 100.0 * params.memory().alpha, ..params.memory() };
    let stiffer = Params::candidate(common::A, stiffer, memory).expect("numbers");
    let (one, other) = (prepared_block::<f32>(&params), prepared_block::<f32>(&stiffer));
    assert_eq!((refusal(&one), refusal(&other)), (None, None));

    let restamp = |mut bytes: Vec<u8>| {
        let end = bytes.len() - 4;
        let crc = crc32(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&crc);
        bytes
    };
    let at = words_of(&one, PREPARED.tag);
    let length = 4 * 28;
    let mut mixed = one.clone();
    mixed[at..at + length].copy_from_slice(&other[at..at + length]);
    assert_eq!(refusal(&restamp(mixed)), Some(0x0112));

    // Each word of scales, spring, slopes and law by itself; limits, tolerances and brackets of the search are vouched for by golden samples.
    let searched = [3, 17, 18, 19, 20, 21, 22, 23, 24, 26, 27];
    for word in (0..28).filter(|word| !searched.contains(word)) {
        for times in [0.9, 1.1] {
            let place = at + 4 * word;
            let value = f32::from_le_bytes(one[place..place + 4].try_into().expect("four bytes"));
            let changed = if value == 0.0 { 0.1 } else { times * value };
            let mut bytes = one.clone();
            bytes[place..place + 4].copy_from_slice(&changed.to_le_bytes());
            assert_eq!(refusal(&restamp(bytes)), Some(0x0112), "word {word}, {value}");
        }
    }
    let fixed = prepared_block::<Fixed>(&params);
    assert_eq!(refusal(&fixed), None);
    let at = words_of(&fixed, PREPARED.tag);
    for word in (0..28).filter(|word| !searched.contains(word)) {
        let mut bytes = fixed.clone();
        // A quarter of 1.
        bytes[at + 4 * word + 3] ^= 0x04;
        assert_eq!(refusal(&restamp(bytes)), Some(0x0112), "word {word}");
    }
    // The other laws, as they are and with another stiffness.
    for (law, kernel, gate) in every_form().into_iter().skip(1) {
        let params = common::params(law, kernel, gate);
        let bytes = prepared_block_of(&params, AnyLaw::<f32>::new(&params, PERIOD_S));
        assert_eq!(refusal(&bytes), None, "{law:?}, {kernel:?}, {gate:?}");
        let rates = if law == Law::Time { [4, 10, 11] } else { [4, 5, 6] };
        for word in rates {
            let mut bytes = bytes.clone();
            let at = words_of(&bytes, PREPARED_GEAR.tag) + 4 * word;
            bytes[at + 2] ^= 0x40;
            assert_eq!(refusal(&restamp(bytes)), Some(0x0112), "{law:?}, {kernel:?}, {gate:?}, word {word}");
        }
    }
}
