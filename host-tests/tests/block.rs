//! Parameter blocks: what is written loads to the bit, what is damaged, strange or out of range is refused by its own code.

use crate::common;
use std::collections::BTreeSet;
use std::fmt::Debug;

use gmhm::block::{
    BlockError, BlockLaw, GEAR, Header, INVERSE, Identity, JOINT, Joint, MASING, PHASE, Parameters, RECORDS, SELF_TEST,
    ScalarKind, Scales, TIME, Writer, crc32, stamp, verify, verify_first,
};
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::terms::{Form, KINDS, KeyInfo, KindInfo, Range, Setting, Source, Stack, Term, TermError, Value};
use gmhm::{Gear, Inverse, Law, Params};

const PERIOD_S: f64 = 1e-3;

fn header() -> Header {
    Header { period_s: PERIOD_S as f32, ..Header::new(Identity::of_name("joint 3"), ScalarKind::F32) }
}

/// A block of `write`'s records, its header and CRC-32 in order.
fn block(header: Header, write: impl FnOnce(&mut Writer<'_>) -> Result<(), BlockError>) -> Vec<u8> {
    let mut buffer = vec![0; 4096];
    let mut writer = Writer::new(&mut buffer, header);
    write(&mut writer).expect("the records are good");
    let length = writer.finish().expect("there is room");
    buffer.truncate(length);
    buffer
}

fn write_gear(writer: &mut Writer<'_>, params: &Params) -> Result<(), BlockError> {
    writer.gear(&Gear::<f32>::with_period(params, PERIOD_S).expect("a period"), params)?;
    if Inverse::<f32>::with_period(params, PERIOD_S).is_ok() {
        writer.inverse::<f32>(params, PERIOD_S)?;
    }
    writer.joint(&Joint { ratio: Some(-100.0), deflection_zero_rad: 0.1, motor_side: true })
}

fn published() -> Vec<u8> {
    block(header(), |writer| write_gear(writer, &common::masing()))
}

/// Bytes as they would be if they had been written so: with length and CRC-32 corrected.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = (bytes.len() as u32).to_le_bytes();
    bytes[8..12].copy_from_slice(&length);
    let end = bytes.len() - 4;
    let crc = crc32(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    bytes
}

fn refusal(bytes: &[u8]) -> BlockError {
    Parameters::<f32>::load_any(bytes, 16).expect_err("the block is bad")
}

/// Values for every key of a kind, growing along lists and from key to key.
struct Any {
    info: &'static KindInfo,
    shape: usize,
    list: [f32; 3],
}

impl Any {
    fn of(info: &'static KindInfo, shape: usize) -> Self {
        Self { info, shape, list: [0.25, 0.5, 2.0] }
    }
}

impl Source<f32> for Any {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        let place = self.info.keys.iter().position(|other| other.name == key.name)?;
        Some(match key.form {
            Form::Number => Value::Number(1.0 + place as f32),
            // Orders of the output are above 1.
            Form::List { .. } if key.name == "orders" => Value::List(&[1.5, 2.0, 4.0]),
            Form::List { .. } => Value::List(&self.list),
            Form::Choice(_) => Value::Choice(self.shape),
        })
    }
}

fn shapes(info: &'static KindInfo) -> usize {
    info.keys
        .iter()
        .find_map(|key| if let Form::Choice(words) = key.form { Some(words.len()) } else { None })
        .unwrap_or(1)
}

#[test]
fn every_law_loads_to_the_bit() {
    let mut with_inverse = 0;
    for params in common::every_law() {
        let bytes = block(header(), |writer| write_gear(writer, &params));
        let loaded = Parameters::<f32>::load_any(&bytes, 16).expect("a good block");
        assert_eq!(loaded.gear, Some(Gear::with_period(&params, PERIOD_S).expect("a period")));
        assert_eq!(loaded.inverse, Inverse::with_period(&params, PERIOD_S).ok());
        assert_eq!(loaded.joint, Joint { ratio: Some(-100.0), deflection_zero_rad: 0.1, motor_side: true });
        assert_eq!(loaded.scales, Some(Scales::of(&params)));
        with_inverse += usize::from(loaded.inverse.is_some());
    }
    assert!(with_inverse >= 4, "the published gear can be inverted in {with_inverse} laws only");
}

#[test]
fn fixed_point_loads_to_the_bit() {
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::NONE, ScalarKind::Fixed) };
    for params in common::every_law() {
        match params.memory().law {
            Law::Masing => fixed_law(header, &params, Masing::<Fixed>::new(&params)),
            Law::Time => fixed_law(header, &params, Time::<Fixed>::new(&params, PERIOD_S)),
            Law::Phase => {}
        }
    }
}

fn fixed_law<L: BlockLaw<Fixed> + PartialEq + Debug>(header: Header, params: &Params, law: L) {
    let gear = Gear::with_law(params, law);
    let inverse = Inverse::of(params, law, PERIOD_S).ok();
    let bytes = block(header, |writer| {
        writer.gear(&gear, params)?;
        if inverse.is_some() {
            writer.inverse::<Fixed>(params, PERIOD_S)?;
        }
        writer.joint(&Joint::default())
    });
    let loaded = Parameters::<Fixed, L, ()>::load_any(&bytes, 16).expect("a good block");
    assert_eq!(loaded.gear, Some(gear));
    assert_eq!(loaded.inverse, inverse);
    assert_eq!(refusal(&bytes), BlockError::Scalar([2, 28]));
    // Whatever the words, nothing panics.
    let (mut refused, mut taken) = (0, 0);
    for at in (48..bytes.len() - 4).step_by(4) {
        for word in STRANGE {
            let mut changed = bytes.clone();
            changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
            match Parameters::<Fixed, L, ()>::load_any(&sealed(changed), 16) {
                Ok(parameters) => {
                    taken += 1;
                    let gear = parameters.gear.expect("its record is still there");
                    let mut state = gear.start::<16>(Fixed::ZERO);
                    for u in [0.3, -0.9, 0.99, 1.5, -1.0, 0.2].map(Fixed::from_f64) {
                        gear.step(&mut state, u);
                        if let Some(inverse) = &parameters.inverse {
                            assert!(inverse.peek(&state, u).steps <= gmhm::inverse::MOST_STEPS);
                        }
                    }
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > STRANGE.len() && taken > STRANGE.len(), "{refused} refused, {taken} taken");
}

#[test]
fn every_kind_of_term_loads_to_the_bit() {
    let (c1, rated_deflection) = (common::elastic().c1_nm_per_rad as f32, common::A as f32);
    let setting = Setting { sigma: 1.0, c1, rated_deflection };
    for info in KINDS {
        for shape in 0..shapes(info) {
            let source = Any::of(info, shape);
            let bytes = block(header(), |writer| {
                write_gear(writer, &common::masing())?;
                writer.term(info.name, &source)
            });
            let loaded = Parameters::<f32>::load_any(&bytes, 16).expect("a good block");
            let stack: Stack<f32, 8> = loaded.terms;
            let written = Term::read(info.name, &source, setting).expect("a good term");
            assert_eq!(stack.terms(), [written], "{} {shape}", info.name);
        }
    }
}

#[test]
fn a_joint_without_gear_has_terms_alone() {
    let gravity = Any::of(KINDS.iter().find(|kind| kind.name == "gravity_load").expect("a kind"), 0);
    let bytes = block(header(), |writer| {
        writer.joint(&Joint::default())?;
        writer.term("gravity_load", &gravity)
    });
    let loaded = Parameters::<f32>::load_any(&bytes, 16).expect("a good block");
    assert!(loaded.gear.is_none() && loaded.inverse.is_none() && !loaded.terms.has_gear());
    let empty = block(header(), |writer| writer.joint(&Joint::default()));
    assert_eq!(refusal(&empty), BlockError::Missing(GEAR.tag));
}

#[test]
fn every_flipped_bit_and_every_missing_byte_is_refused() {
    let bytes = published();
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(verify(&damaged).is_err(), "bit {bit}");
        assert!(verify_first(&damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert!(verify(&bytes[..length]).is_err(), "{length} bytes");
    }
    let longer = [&bytes[..], &[0xff]].concat();
    assert!(matches!(verify(&longer), Err(BlockError::Length { .. })));
    assert_eq!(verify_first(&longer), verify(&bytes));
    assert_eq!(refusal(&[0xff; 1024]), BlockError::Magic);
    assert!(matches!(refusal(&[]), BlockError::Length { .. }));
}

/// A block with one record more, at the end before the CRC-32.
fn appended(block: &[u8], tag: u16, payload: &[u8]) -> Vec<u8> {
    let mut longer = block[..block.len() - 4].to_vec();
    longer.extend(tag.to_le_bytes());
    longer.extend((payload.len() as u16).to_le_bytes());
    longer.extend(payload);
    longer.extend([0; 4]);
    let records = u16::from_le_bytes([longer[40], longer[41]]) + 1;
    longer[40..42].copy_from_slice(&records.to_le_bytes());
    sealed(longer)
}

const IN_FIXED_POINT: &[u8] = include_bytes!("../golden/block-1-masing-fixed.bin");

#[test]
fn every_refusal_has_its_own_code() {
    let bytes = published();
    let with = |at: usize, value: &[u8]| {
        let mut changed = bytes.clone();
        changed[at..at + value.len()].copy_from_slice(value);
        sealed(changed)
    };
    let appended = |tag: u16, payload: &[u8]| appended(&bytes, tag, payload);
    let no_room = {
        let mut buffer = [0; 64];
        let mut writer = Writer::new(&mut buffer, header());
        write_gear(&mut writer, &common::masing()).expect_err("64 bytes are too few")
    };
    let missing = block(header(), |writer| writer.joint(&Joint::default()));
    let mut damaged = bytes.clone();
    damaged[60] ^= 1;
    let negative = [1.0_f32.to_bits().to_le_bytes(), (-1.0_f32).to_bits().to_le_bytes()].concat();
    let coulomb = 0x0100 + 5;
    let without_terms = {
        let fixed = Parameters::<Fixed, Masing<Fixed>, ()>::load_any(IN_FIXED_POINT, 16);
        assert!(fixed.is_ok_and(|parameters| parameters.gear.is_some()));
        let with_term = self::appended(IN_FIXED_POINT, coulomb, &[0; 8]);
        Parameters::<Fixed, Masing<Fixed>, ()>::load_any(&with_term, 16).expect_err("no terms in fixed point")
    };
    let refusals = [
        (refusal(&bytes[..20]), 0x0101),
        (refusal(&with(0, b"GMHN")), 0x0102),
        (refusal(&with(4, &[2, 0])), 0x0103),
        (refusal(&damaged), 0x0104),
        (refusal(&with(34, &[5, 0])), 0x0105),
        (refusal(&with(36, &f32::NAN.to_le_bytes())), 0x0105),
        (refusal(&with(16, &[0, b'x'])), 0x0105),
        (refusal(&with(44, &[1])), 0x0105),
        (refusal(&with(32, &[9, 3])), 0x0106),
        (refusal(&with(34, &[18, 0])), 0x0107),
        (refusal(&with(50, &[255, 255])), 0x0108),
        (refusal(&with(40, &[9, 0])), 0x0108),
        (refusal(&appended(0x0077, &[])), 0x0109),
        (refusal(&appended(0x0100 + 99, &[])), 0x0109),
        (refusal(&appended(coulomb, &[0; 4])), 0x010a),
        (refusal(&appended(coulomb, &[0; 12])), 0x010a),
        (refusal(&appended(JOINT.tag, &[0; 20])), 0x010b),
        (refusal(&appended(TIME.tag, &[0; 56])), 0x010b),
        (refusal(&missing), 0x010c),
        (refusal(&with(52, &f64::NAN.to_le_bytes())), 0x010d),
        (refusal(&with(52, &0.0_f64.to_le_bytes())), 0x010d),
        (refusal(&with(68, &9.0_f32.to_le_bytes())), 0x010d),
        (refusal(&appended(coulomb, &negative)), 0x010e),
        (no_room, 0x010f),
        (without_terms, 0x0110),
        (refusal(&appended(SELF_TEST.tag, &[0; 36])), 0x0111),
    ];
    for (refusal, code) in refusals {
        assert_eq!(refusal.code(), code, "{refusal}");
        assert!(refusal.sdo_abort() >> 24 == 0x05 || refusal.sdo_abort() >> 24 == 0x06);
    }
    let codes: BTreeSet<u16> = refusals.iter().map(|(refusal, _)| refusal.code()).collect();
    assert_eq!(codes, (0x0101..=0x0111).collect());

    // What is not known but may be skipped is.
    assert!(Parameters::<f32>::load_any(&appended(0x8077, &[1; 8]), 16).is_ok());
    // Nine terms do not fit into eight places, and firmware without terms takes none.
    let friction = |count| {
        let info = KINDS.iter().find(|kind| kind.name == "coulomb_friction").expect("a kind");
        block(header(), |writer| {
            write_gear(writer, &common::masing())?;
            (0..count).try_for_each(|_| writer.term(info.name, &Any::of(info, 0)))
        })
    };
    assert_eq!(refusal(&friction(9)), BlockError::Term { tag: coulomb, error: TermError::StackFull });
    assert!(Parameters::<f32>::load_any(&friction(8), 16).is_ok());
    let bare = Parameters::<f32, Masing<f32>, ()>::load_any(&friction(1), 16);
    assert_eq!(bare, Err(BlockError::TermsNotComputed(coulomb)));
    // Firmware of one law refuses the others.
    assert!(Parameters::<f32, Masing<f32>, ()>::load_any(&published(), 16).is_ok());
    for params in common::every_law().iter().skip(1) {
        let other = block(header(), |writer| write_gear(writer, params));
        let tag = if params.memory().law == Law::Phase { PHASE.tag } else { TIME.tag };
        assert_eq!(Parameters::<f32, Masing<f32>, ()>::load_any(&other, 16), Err(BlockError::Unknown(tag)));
    }
}

#[test]
fn a_stamp_changes_the_sequence_alone() {
    let bytes = published();
    let mut stamped = bytes.clone();
    stamp(&mut stamped, 0x1234_5678).expect("a good block");
    assert_eq!(verify(&stamped).expect("still a good block").header().sequence, 0x1234_5678);
    let differing: BTreeSet<usize> = (0..bytes.len()).filter(|&k| bytes[k] != stamped[k]).collect();
    assert!(differing.iter().all(|k| (12..16).contains(k) || *k >= bytes.len() - 4), "{differing:?}");
    stamp(&mut stamped, 0).expect("a good block");
    assert_eq!(stamped, bytes);
    stamped[50] ^= 1;
    let damaged = stamped.clone();
    assert_eq!(stamp(&mut stamped, 1), Err(BlockError::Checksum));
    assert_eq!(stamped, damaged);
}

#[test]
fn a_name_stands_for_people() {
    let named = block(header(), |writer| {
        write_gear(writer, &common::masing())?;
        writer.name("Gelenk 3, Größe 25")
    });
    assert_eq!(verify(&named).expect("a good block").name(), "Gelenk 3, Größe 25");
    assert_eq!(verify(&published()).expect("a good block").name(), "");
    assert!(Parameters::<f32>::load_any(&named, 16).is_ok());
}

/// Words that break things: zeros, infinities, NaN, the largest, the smallest, halves of doubles.
const STRANGE: [u32; 16] = [
    0,
    1,
    0x8000_0000,
    u32::MAX,
    0x7fc0_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7f7f_ffff,
    0x0000_0001,
    0x3f80_0000,
    0xbf80_0000,
    0x4100_0000,
    0x7ff0_0000,
    0x7fef_ffff,
    0x0010_0000,
    0x42c8_0000,
];

/// Every word of a sealed block in turn made one of the values that break things: refused, or computed with without a panic.
#[test]
fn strange_words_are_refused_or_harmless() {
    let (mut refused, mut taken) = (0, 0);
    for params in common::every_law() {
        let terms = |writer: &mut Writer<'_>| {
            KINDS.iter().step_by(4).try_for_each(|info| writer.term(info.name, &Any::of(info, 0)))
        };
        let bytes = block(header(), |writer| write_gear(writer, &params).and_then(|()| terms(writer)));
        for at in (0..bytes.len() - 4).step_by(4) {
            for word in STRANGE {
                let mut changed = bytes.clone();
                changed[at..at + 4].copy_from_slice(&u32::to_le_bytes(word));
                match Parameters::<f32>::load_any(&sealed(changed), 16) {
                    Ok(parameters) => {
                        taken += 1;
                        use_up(&parameters);
                    }
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(refused > 10 * 9 * STRANGE.len() && taken > 10 * 9 * STRANGE.len(), "{refused} refused, {taken} taken");
}

/// A few steps there and back, and their inverse.
fn use_up(parameters: &Parameters) {
    let (Some(gear), Some(scales)) = (&parameters.gear, parameters.scales) else { return };
    let (a, t) = (scales.rated_deflection_rad as f32, scales.torque_scale_nm as f32);
    let mut state = gear.start::<16>(0.0);
    for u in [0.3, -0.9, 0.99, 1.5, -1.0, 0.2] {
        gear.step(&mut state, u * a);
        if let Some(inverse) = &parameters.inverse {
            assert!(inverse.peek(&state, 0.5 * u * t).steps <= gmhm::inverse::MOST_STEPS);
        }
    }
}

#[test]
fn the_registry_is_whole() {
    let tags: BTreeSet<u16> = RECORDS.iter().map(|info| info.tag).collect();
    assert_eq!(tags.len(), RECORDS.len());
    for info in RECORDS {
        for field in info.fields {
            assert!(!field.key.words.is_empty() && !field.key.name.is_empty());
            let lowest = field.key.range.lowest();
            assert!(field.key.range == Range::Any || !field.key.range.holds(lowest - 1.0));
        }
    }
    // Firmware in the field knows these.
    let sizes = [GEAR, MASING, PHASE, TIME, INVERSE, JOINT].map(|info| info.size());
    assert_eq!(sizes, [7, 3, 4, 14, 10, 5]);
    let numbers: Vec<u16> = KINDS.iter().filter_map(|kind| gmhm::terms::tag_of_kind(kind.name)).collect();
    assert_eq!(numbers, (1..=28).collect::<Vec<u16>>());
}

/// Counts of both encoders to the deflection of the model, by what the block says of the joint.
#[test]
fn a_block_turns_counts_into_its_deflection() {
    use gmhm::drive::{EncoderPair, Mounting, SetupError};

    let mounting = Mounting { counts_per_turn: 1 << 20, reversed: false };
    let params = common::masing();
    for (ratio, fraction) in [(100.0, (100, 1)), (-100.0, (100, 1)), (100.5, (201, 2)), (80.0 / 3.0, (80, 3))] {
        let joint = Joint { ratio: Some(ratio), deflection_zero_rad: 0.1255, motor_side: false };
        let bytes = block(header(), |writer| {
            write_gear_alone(writer, &params)?;
            writer.joint(&joint)
        });
        let loaded = Parameters::<f32>::load_any(&bytes, 16).expect("a good block");
        let setup = loaded.encoders(mounting, mounting).expect("a ratio");
        assert_eq!((setup.ratio, setup.motor.reversed), (fraction, ratio < 0.0));
        let pair = EncoderPair::<f32>::new(&setup).expect("encoders");
        // A quarter of the rated deflection, beside the zero.
        let turns = |angle: f64| ((angle / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(1 << 20)) as u32;
        let (output, theta) = (0.3, 0.25 * common::A);
        let reading = pair.start(turns(ratio * (output + theta + 0.1255)), turns(output));
        let error = (f64::from(reading.deflection) - theta).abs();
        // One count of the output.
        assert!(error < std::f64::consts::TAU / f64::from(1 << 20) * 1.1, "{ratio}: {error}");
    }
    let without = block(header(), |writer| {
        write_gear_alone(writer, &params)?;
        writer.joint(&Joint::default())
    });
    let loaded = Parameters::<f32>::load_any(&without, 16).expect("a good block");
    assert_eq!(loaded.encoders(mounting, mounting), Err(SetupError::Ratio));
    let odd = Joint { ratio: Some(std::f64::consts::PI * 1e5), ..Joint::default() };
    assert_eq!(odd.encoders(mounting, mounting, common::A), Err(SetupError::Ratio));
}

fn write_gear_alone(writer: &mut Writer<'_>, params: &Params) -> Result<(), BlockError> {
    writer.gear(&Gear::<f32>::with_period(params, PERIOD_S).expect("a period"), params)
}

#[test]
fn a_block_in_amperes_is_not_taken_for_one_in_newton_metres() {
    use gmhm::block::TorqueUnit;

    for unit in [TorqueUnit::NewtonMetre, TorqueUnit::Ampere] {
        let bytes = block(Header { torque_unit: unit, ..header() }, |writer| {
            write_gear_alone(writer, &common::masing())?;
            writer.joint(&Joint::default())
        });
        for asked in [TorqueUnit::NewtonMetre, TorqueUnit::Ampere] {
            let loaded = Parameters::<f32>::of_any_block(&verify(&bytes).expect("a block"), 16, asked);
            assert_eq!(loaded.map(|_| ()), if asked == unit { Ok(()) } else { Err(BlockError::Unit(unit)) });
        }
        // Without a word of the unit it is newton metres.
        let loaded = Parameters::<f32>::load_any(&bytes, 16).map(|_| ());
        assert_eq!(loaded, if unit == TorqueUnit::NewtonMetre { Ok(()) } else { Err(BlockError::Unit(unit)) });
    }
}

/// Law `time` in a block without a control period steps by no period of its own.
#[test]
fn law_time_without_a_period_refuses_samples() {
    let params = common::every_law().into_iter().find(|params| params.memory().law == Law::Time).expect("a law");
    for (period_s, refused) in [(0.0, true), (PERIOD_S as f32, false)] {
        let bytes = block(Header { period_s, ..header() }, |writer| {
            write_gear_alone(writer, &params)?;
            writer.joint(&Joint::default())
        });
        let gear = Parameters::<f32>::load_any(&bytes, 16).expect("a good block").gear.expect("a gear");
        let mut state = gear.start::<16>(0.0);
        gear.step(&mut state, 1e-4);
        assert_eq!(state.status().refused, refused);
    }
}
