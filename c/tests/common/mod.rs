//! Blocks of the published gear, and a joint with one in force.

use std::mem::MaybeUninit;

use gmhm::block::{
    HEADER_BYTES, Header, Identity, Joint as JointOfGear, MAY_SKIP, ScalarKind, TorqueUnit, Writer, crc32, verify,
};
use gmhm::terms::{Form, KeyInfo, Source, Value};
use gmhm::{Elastic, Gear, Inverse, Law, Memory, Params};
use gmhm_c::{Joint, LimitsC, OK, OutputC, PairC, SampleC, SolutionC, StatusC, TermC};

/// What a feed-forward may do, at 1 kHz.
pub const LIMITS: LimitsC = LimitsC {
    period_s: 1e-3,
    ramp_s: 0.1,
    offset_slew_rad_per_s: 0.05,
    torque_slew_nm_per_s: 200.0,
    largest_rate_rad_per_s: f32::INFINITY,
};

/// The functions of `gmhm.h`, their results as values.
pub fn gmhm_step(joint: Option<&mut Joint>, sample: Option<&SampleC>) -> OutputC {
    out(|to| gmhm_c::gmhm_step(joint, sample, to))
}

pub fn gmhm_step_counts(
    joint: Option<&mut Joint>,
    pair: Option<&mut PairC>,
    motor: u32,
    output: u32,
    sample: Option<&SampleC>,
) -> OutputC {
    out(|to| gmhm_c::gmhm_step_counts(joint, pair, motor, output, sample, to))
}

pub fn gmhm_invert(joint: Option<&mut Joint>, torque_nm: f32, sample: Option<&SampleC>) -> SolutionC {
    out(|to| gmhm_c::gmhm_invert(joint, torque_nm, sample, to))
}

pub fn gmhm_get_status(joint: Option<&Joint>) -> StatusC {
    out(|to| gmhm_c::gmhm_get_status(joint, to))
}

/// What a call writes.
fn out<T>(call: impl FnOnce(Option<&mut MaybeUninit<T>>) -> u32) -> T {
    let mut to = MaybeUninit::uninit();
    call(Some(&mut to));
    // SAFETY: the call has written it.
    unsafe { to.assume_init() }
}

pub const A: f32 = 1.168e-3;
pub fn block() -> Vec<u8> {
    block_of(&JointOfGear::default(), TorqueUnit::NewtonMetre)
}

pub fn block_of(joint: &JointOfGear, torque_unit: TorqueUnit) -> Vec<u8> {
    write(1.0, &[], joint, torque_unit)
}

/// The published gear with another spring, and these terms.
pub fn block_with(stiffness: f64, terms: &[&str]) -> Vec<u8> {
    write(stiffness, terms, &JointOfGear::default(), TorqueUnit::NewtonMetre)
}

/// The published gear in law `time`, for a control period of 1 ms.
pub fn block_in_time() -> Vec<u8> {
    write_law(Law::Time, 1.0, &[], &JointOfGear::default(), TorqueUnit::NewtonMetre)
}

fn write(stiffness: f64, terms: &[&str], joint: &JointOfGear, torque_unit: TorqueUnit) -> Vec<u8> {
    write_law(Law::Masing, stiffness, terms, joint, torque_unit)
}

fn write_law(law: Law, stiffness: f64, terms: &[&str], joint: &JointOfGear, torque_unit: TorqueUnit) -> Vec<u8> {
    let elastic = Elastic { c1_nm_per_rad: stiffness * 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, law, ..Memory::default() };
    let params = Params::new(f64::from(A), elastic, memory).expect("the published gear");
    let mut buffer = vec![0; 4096];
    let header = Header { period_s: 1e-3, torque_unit, ..Header::new(Identity::of_name("joint 3"), ScalarKind::F32) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(&Gear::<f32>::with_period(&params, 1e-3).expect("a period"), &params).expect("a gear");
    let inverse = Inverse::<f32>::with_period(&params, 1e-3).expect("an inverse");
    writer.inverse::<f32>(&params, 1e-3).expect("an inverse");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    writer.prepared(&inverse).expect("room");
    writer.joint(joint).expect("a joint");
    for term in terms {
        writer.term(term, &Small).expect("a term");
    }
    let length = writer.finish().expect("a block");
    buffer.truncate(length);
    buffer
}

/// The same block with a gate on samples.
pub fn with_largest_step(block: &[u8], step_rad: f32) -> Vec<u8> {
    let block = verify(block).expect("a block");
    let mut buffer = vec![0; 4096];
    let mut writer = Writer::new(&mut buffer, *block.header());
    writer.largest_step(step_rad).expect("a step");
    for record in block.records() {
        writer.record(record.tag, &record.words().collect::<Vec<_>>()).expect("room");
    }
    let length = writer.finish().expect("a block");
    buffer.truncate(length);
    buffer
}

/// The same block, a record of it made one of a tag that nobody knows and everybody skips.
pub fn without(mut block: Vec<u8>, tag: u16) -> Vec<u8> {
    let (mut at, end) = (HEADER_BYTES, block.len() - 4);
    let word = |block: &[u8], at: usize| u16::from_le_bytes([block[at], block[at + 1]]);
    while word(&block, at) != tag {
        at += 4 + usize::from(word(&block, at + 2));
    }
    block[at..at + 2].copy_from_slice(&(MAY_SKIP | 0x7777).to_le_bytes());
    let crc = crc32(&block[..end]).to_le_bytes();
    block[end..].copy_from_slice(&crc);
    block
}

/// The places that joints and feed-forwards have for terms.
pub const PLACES: u32 = 8;

/// Memory for terms, as long as the program.
pub fn places() -> *mut TermC {
    Box::leak(Box::<[TermC]>::new_uninit_slice(PLACES as usize)).as_mut_ptr().cast()
}

pub fn joint() -> Box<Joint> {
    joint_of(&block())
}

pub fn joint_of(block: &[u8]) -> Box<Joint> {
    let mut joint = Box::new(MaybeUninit::uninit());
    // SAFETY: the block outlives the call, the places the joint.
    let code =
        unsafe { gmhm_c::gmhm_init_with_terms(Some(&mut joint), places(), PLACES, block.as_ptr(), block.len() as u32) };
    assert_eq!(code, OK);
    // SAFETY: gmhm_init has written it.
    unsafe { joint.assume_init() }
}

pub fn at(deflection_rad: f32) -> SampleC {
    SampleC { deflection_rad, ..SampleC::default() }
}

/// A number of the environment.
pub fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|_| panic!("{name} must be a number")))
}

/// The xorshift generator (Marsaglia 2003) of `GMHM_FUZZ_SEED`.
pub fn random() -> impl FnMut() -> u32 {
    let mut random = number("GMHM_FUZZ_SEED", 1) as u32 | 1;
    move || {
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        random
    }
}

/// A number that is none, is absurd, or any bits.
pub fn strange(next: &mut impl FnMut() -> u32) -> f32 {
    match next() % 6 {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => -1e30,
        4 => 0.99e5 * A,
        _ => f32::from_bits(next()),
    }
}

/// Small values for every key.
pub struct Small;

impl Source<f32> for Small {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        Some(match key.form {
            Form::Number => Value::Number(if key.name.ends_with("_nm") { 0.25 } else { 0.5 }),
            Form::List { .. } if key.name == "orders" => Value::List(&[2.0, 4.0]),
            Form::List { .. } => Value::List(&[1e-5, -2e-6]),
            Form::Choice(_) => Value::Choice(0),
        })
    }
}
