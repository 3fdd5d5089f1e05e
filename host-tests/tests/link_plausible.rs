//! Live changes are plausible: bounded on an enabled drive, taken back when the host is gone, one host at a time, and what went wrong is counted.

use crate::common;
use crate::common::drives;
use crate::common::drives::{Bench, Session, Told, answers, ask, bench, identify};
use gmhm::block::{Header, Identity, Joint, ScalarKind, TorqueUnit, Writer};
use gmhm::diagnostics::{Diagnostics, Fault};
use gmhm::link::server::{DEFAULT_BOUND, FADE_MS, SESSION_MS, TRIAL_MS};
use gmhm::link::{Answer, LineCounts, LinkDiagnostics, Origin, Refusal, Request, Tag};
use gmhm::memory::masing::Masing;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::terms::{KeyInfo, Source, Value};
use gmhm::{Elastic, Gear, Params};

/// The published gear with its torques scaled, and its deflections.
fn gear(torques: f64, deflections: f64) -> Params {
    let (elastic, memory) = (common::elastic(), common::masing().memory());
    let elastic = Elastic {
        c1_nm_per_rad: torques / deflections * elastic.c1_nm_per_rad,
        c2_nm_per_rad3: torques / deflections.powi(3) * elastic.c2_nm_per_rad3,
        c3_nm_per_rad5: torques / deflections.powi(5) * elastic.c3_nm_per_rad5,
    };
    Params::new(deflections * common::A, elastic, memory).expect("a gear")
}

fn block(params: &Params, sequence: u32, scalar: ScalarKind) -> Vec<u8> {
    gated_block(params, sequence, scalar, 0.0, None)
}

/// A block with a control period and a gate, A.
fn gated_block(params: &Params, sequence: u32, scalar: ScalarKind, period_s: f32, step: Option<f64>) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let header = Header { sequence, period_s, ..Header::new(Identity::NONE, scalar) };
    let mut writer = Writer::new(&mut buffer, header);
    match scalar {
        ScalarKind::F32 => writer.gear(&Gear::<f32>::new(params), params),
        ScalarKind::Fixed => writer.gear(&Gear::with_law(params, Masing::<Fixed>::new(params)), params),
    }
    .expect("a gear");
    if let Some(step) = step {
        match scalar {
            ScalarKind::F32 => writer.largest_step((step * params.rated_deflection_rad()) as f32),
            ScalarKind::Fixed => writer.largest_step(Fixed::from_f64(step)),
        }
        .expect("a gate");
    }
    writer.joint(&Joint::default()).expect("a joint");
    let length = writer.finish().expect("room");
    buffer[..length].to_vec()
}

fn diagnostics(port: &mut Bench, drive: &mut Told) -> LinkDiagnostics {
    match ask(port, drive, Request::Diagnostics, Tag::default()) {
        Ok((Answer::Diagnostics(it), _)) => it,
        other => panic!("{other:?}"),
    }
}

#[test]
fn parameters_far_from_those_in_force_do_not_come_on_trial_while_enabled() {
    for scalar in [ScalarKind::F32, ScalarKind::Fixed] {
        let old = block(&gear(1.0, 1.0), 1, scalar);
        for (torques, deflections, fits) in [
            (1.0, 1.0, true),
            (1.25, 1.0, true),
            (0.75, 1.0, true),
            (1.35, 1.0, false),
            (0.65, 1.0, false),
            (1000.0, 1.0, false),
            // The same torque at its own rated deflection, at another deflection.
            (1.0, 0.1, false),
            (1.0, 3.0, false),
        ] {
            let new = block(&gear(torques, deflections), 2, scalar);
            for enabled in [false, true] {
                let (mut port, mut drive) = bench(&[&old]);
                drive.enabled = enabled;
                let mut session = Session::open(&mut port, &mut drive);
                session.stage(&mut port, &mut drive, &new).expect("staged");
                let tried = session.ask(&mut port, &mut drive, Request::Try);
                let expected = if fits || !enabled { Ok(Answer::Done) } else { Err(Refusal::Bound.into()) };
                assert_eq!(tried, expected, "{torques} and {deflections} times, enabled: {enabled}");
                let in_force = if tried.is_ok() { &new } else { &old };
                assert_eq!(drive.in_force.as_ref(), Some(in_force));
            }
        }
    }
}

/// A block comes on trial beside the one in force while the drive is disabled, and without a bound; on an enabled drive with one if it fits.
fn assert_tried(old: &[u8], new: &[u8], fits: bool, case: &str) {
    for (enabled, bound) in [(false, DEFAULT_BOUND), (true, DEFAULT_BOUND), (true, f32::INFINITY)] {
        let (mut port, mut drive) = bench(&[old]);
        let mut session = Session::open(&mut port, &mut drive);
        session.ask(&mut port, &mut drive, Request::Bound { share: bound }).expect("a bound");
        drive.enabled = enabled;
        session.stage(&mut port, &mut drive, new).expect("staged");
        let tried = session.ask(&mut port, &mut drive, Request::Try);
        let is_free = !enabled || bound == f32::INFINITY;
        let expected = if fits || is_free { Ok(Answer::Done) } else { Err(Refusal::Bound.into()) };
        assert_eq!(tried, expected, "{case}, enabled: {enabled}, {bound}");
    }
}

/// A gate that goes, opens or lets more through in a second is judged as torques are; a new or a narrower one refuses samples only.
#[test]
fn a_wider_gate_does_not_come_on_trial_while_enabled() {
    let gear = gear(1.0, 1.0);
    for scalar in [ScalarKind::F32, ScalarKind::Fixed] {
        for (step, other, period_s, fits) in [
            (Some(0.5), Some(0.5), 1e-3, true),
            (Some(0.5), Some(0.6), 1e-3, true),
            (Some(0.5), Some(0.7), 1e-3, false),
            (Some(0.5), None, 1e-3, false),
            (Some(0.5), Some(0.1), 1e-3, true),
            (None, Some(0.1), 1e-3, true),
            (None, None, 1e-3, true),
            // The same step in half the time.
            (Some(0.5), Some(0.5), 5e-4, false),
            (Some(0.5), Some(0.5), 2e-3, true),
        ] {
            let old = gated_block(&gear, 1, scalar, 1e-3, step);
            let new = gated_block(&gear, 2, scalar, period_s, other);
            assert_tried(&old, &new, fits, &format!("{step:?} and {other:?} in {period_s} s"));
        }
    }
}

/// The numbers of Coulomb friction of a torque, N·m.
struct Friction(f32);

impl Source<f32> for Friction {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        Some(Value::Number(if key.name == "torque_nm" { self.0 } else { 0.01 }))
    }
}

/// A block with Coulomb friction of a torque, N·m, and of a gear where one is wanted.
fn block_with_friction(torque_nm: f32, with_gear: bool, sequence: u32) -> Vec<u8> {
    let params = gear(1.0, 1.0);
    let mut buffer = [0; 1024];
    let mut writer = Writer::new(&mut buffer, Header { sequence, ..Header::new(Identity::NONE, ScalarKind::F32) });
    if with_gear {
        writer.gear(&Gear::<f32>::new(&params), &params).expect("a gear");
    }
    writer.joint(&Joint::default()).expect("a joint");
    writer.term("coulomb_friction", &Friction(torque_nm)).expect("a term");
    let length = writer.finish().expect("room");
    buffer[..length].to_vec()
}

#[test]
fn other_terms_do_not_come_on_trial_while_enabled() {
    for with_gear in [true, false] {
        let old = block_with_friction(2.0, with_gear, 1);
        for (torque_nm, gear, fits) in [(2.0, with_gear, true), (2000.0, with_gear, false), (2.0, !with_gear, false)] {
            let new = block_with_friction(torque_nm, gear, 2);
            assert_tried(&old, &new, fits, &format!("{torque_nm} N·m, gear {with_gear} and {gear}"));
        }
    }
}

#[test]
fn another_joint_does_not_come_on_trial_while_enabled() {
    let of = |joint: &Joint, torque_unit, sequence| {
        let params = gear(1.0, 1.0);
        let mut buffer = [0; 1024];
        let header = Header { sequence, torque_unit, ..Header::new(Identity::NONE, ScalarKind::F32) };
        let mut writer = Writer::new(&mut buffer, header);
        writer.gear(&Gear::<f32>::new(&params), &params).expect("a gear");
        writer.joint(joint).expect("a joint");
        let length = writer.finish().expect("room");
        buffer[..length].to_vec()
    };
    let joint = Joint { ratio: Some(100.0), deflection_zero_rad: 0.1255, motor_side: false };
    let newton_metre = TorqueUnit::NewtonMetre;
    let old = of(&joint, newton_metre, 1);
    for (other, unit, fits) in [
        (joint, newton_metre, true),
        // As much of a torque as the rated one.
        (Joint { deflection_zero_rad: 0.1255 + common::A, ..joint }, newton_metre, false),
        (Joint { ratio: Some(101.0), ..joint }, newton_metre, false),
        (Joint { ratio: Some(-100.0), ..joint }, newton_metre, false),
        (Joint { motor_side: true, ..joint }, newton_metre, false),
        (joint, TorqueUnit::Ampere, false),
    ] {
        assert_tried(&old, &of(&other, unit, 2), fits, &format!("{other:?} in {unit:?}"));
    }
}

#[test]
fn the_bound_is_set_while_disabled_and_lasts_until_power_up() {
    let (old, new) = (block(&gear(1.0, 1.0), 1, ScalarKind::F32), block(&gear(1.4, 1.0), 2, ScalarKind::F32));
    let (mut port, mut drive) = bench(&[&old]);
    assert_eq!(diagnostics(&mut port, &mut drive).bound, DEFAULT_BOUND);
    let mut session = Session::open(&mut port, &mut drive);
    session.ask(&mut port, &mut drive, Request::Bound { share: 0.5 }).expect("disabled");
    assert_eq!(diagnostics(&mut port, &mut drive).bound, 0.5);
    drive.enabled = true;
    let wider = session.ask(&mut port, &mut drive, Request::Bound { share: 1.0 });
    assert_eq!(wider, Err(Refusal::Enabled.into()));
    session.stage(&mut port, &mut drive, &new).expect("staged");
    session.ask(&mut port, &mut drive, Request::Try).expect("within half");
    // From where a commit has led, the bound is counted anew.
    drive.enabled = false;
    let commit = Request::Commit { signature: gmhm::link::message::SAVE, crc: drives::crc(&new) };
    session.ask(&mut port, &mut drive, commit).expect("stored");
    drive.enabled = true;
    session.stage(&mut port, &mut drive, &block(&gear(1.9, 1.0), 3, ScalarKind::F32)).expect("staged");
    session.ask(&mut port, &mut drive, Request::Try).expect("within half of 1.4");
    let (mut port, mut drive) = drives::power_up(port.into_store().into_flash(), drive);
    assert_eq!(diagnostics(&mut port, &mut drive).bound, DEFAULT_BOUND);
}

fn on_trial(compensating: bool) -> (Bench, Told, Vec<u8>, Vec<u8>) {
    let (old, new) = (block(&gear(1.0, 1.0), 1, ScalarKind::F32), block(&gear(1.1, 1.0), 2, ScalarKind::F32));
    let (mut port, mut drive) = bench(&[&old]);
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, &new).expect("staged");
    session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
    session.ask(&mut port, &mut drive, Request::Compensate { on: compensating }).expect("switched");
    (port, drive, old, new)
}

fn wait(port: &mut Bench, drive: &mut Told, ms: u32) {
    for _ in 0..ms / 100 {
        port.elapse(100, drive);
    }
}

#[test]
fn a_trial_ends_when_its_host_is_gone() {
    for compensating in [false, true] {
        let (mut port, mut drive, old, new) = on_trial(compensating);
        wait(&mut port, &mut drive, TRIAL_MS - 100);
        assert_eq!((drive.in_force.as_ref(), drive.compensation.on), (Some(&new), compensating));
        wait(&mut port, &mut drive, 100);
        assert!(!drive.compensation.on);
        if compensating {
            wait(&mut port, &mut drive, FADE_MS - 100);
            assert_eq!(drive.in_force.as_ref(), Some(&new), "it fades first");
            wait(&mut port, &mut drive, 100);
        }
        assert_eq!(drive.in_force.as_ref(), Some(&old));
        assert_eq!(diagnostics(&mut port, &mut drive).expired_trials, 1);
        let Ok((Answer::Status(status), _)) = ask(&mut port, &mut drive, Request::Status, Tag::default()) else {
            panic!("a status")
        };
        assert_eq!(status.origin, Origin::Stored);
        wait(&mut port, &mut drive, 10 * TRIAL_MS);
        assert_eq!(diagnostics(&mut port, &mut drive).expired_trials, 1);
    }
}

#[test]
fn a_host_that_asks_keeps_its_trial() {
    let (mut port, mut drive, _, new) = on_trial(true);
    for _ in 0..10 {
        wait(&mut port, &mut drive, TRIAL_MS / 2);
        ask(&mut port, &mut drive, Request::Live, Tag::default()).expect("alive");
    }
    assert_eq!((drive.in_force.as_ref(), drive.compensation.on), (Some(&new), true));
}

#[test]
fn a_second_host_does_not_end_the_session_of_the_first() {
    let old = block(&gear(1.0, 1.0), 1, ScalarKind::F32);
    let (mut port, mut drive) = bench(&[&old]);
    port.elapse(1, &mut drive);
    let mut first = Session::open(&mut port, &mut drive);
    wait(&mut port, &mut drive, SESSION_MS - 100);
    let second = ask(&mut port, &mut drive, Request::Identify, Tag::default());
    assert_eq!(second, Err(Refusal::Busy.into()));
    first.ask(&mut port, &mut drive, Request::Gain { ratio: 0.5 }).expect("the first goes on");
    // The first host may start over, and once it is silent anybody may.
    let again = ask(&mut port, &mut drive, Request::Identify, first.tag);
    assert!(matches!(again, Ok((Answer::Identified(_), _))));
    wait(&mut port, &mut drive, SESSION_MS);
    identify(&mut port, &mut drive);
}

#[test]
fn without_a_clock_any_host_opens_a_session() {
    let (mut port, mut drive) = bench(&[&block(&gear(1.0, 1.0), 1, ScalarKind::F32)]);
    identify(&mut port, &mut drive);
    identify(&mut port, &mut drive);
}

#[test]
fn what_goes_wrong_on_the_line_is_counted_until_it_is_cleared() {
    let (mut port, mut drive) = bench(&[&block(&gear(1.0, 1.0), 1, ScalarKind::F32)]);
    drive.diagnostics = Diagnostics { quarantined: 3, last: Fault::Quarantined, ..Diagnostics::default() };
    let mut session = Session::open(&mut port, &mut drive);
    let mut damaged = Request::Status.encode(Tag::default()).to_vec();
    damaged[2] ^= 0x10;
    assert!(answers(&mut port, &mut drive, &damaged).is_empty());
    assert!(answers(&mut port, &mut drive, &[&[0][..], &[0xFF; 200], &[0]].concat()).is_empty());
    assert!(session.ask(&mut port, &mut drive, Request::Revert).is_err());
    let seen = diagnostics(&mut port, &mut drive);
    assert_eq!((seen.joint, seen.refused_requests), (drive.diagnostics, 1));
    assert_eq!(seen.line.bad_checksums, 1);
    assert!(seen.line.malformed >= 1, "{:?}", seen.line);
    assert_eq!(seen.line.frames, 3);
    session.ask(&mut port, &mut drive, Request::ClearDiagnostics).expect("cleared");
    let cleared = diagnostics(&mut port, &mut drive);
    assert_eq!((cleared.joint, cleared.refused_requests), (Diagnostics::default(), 0));
    assert_eq!(cleared.line, LineCounts { frames: 1, ..LineCounts::default() });
}
