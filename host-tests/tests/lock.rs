//! Access: with a key nothing changes without a proof, and a proof holds once.

use crate::common::drives;
use crate::common::drives::{Bench, Told, answers, blank, store};
use gmhm::link::lock::{Key, PROOF_BYTES};
use gmhm::link::server::{SESSION_END_MS, SESSION_MS};
use gmhm::link::{Answer, Identified, Receiver, Refusal, Request, Tag};
use proptest::prelude::*;

const KEY: Key = Key([0x5A; 32]);

fn locked(entropy: u8) -> (Bench, Told) {
    let mut port = Bench::new(store(blank()), 42).with_lock(KEY, [entropy; PROOF_BYTES]);
    let mut drive = Told::default();
    port.boot(&mut drive);
    (port, drive)
}

fn identify(port: &mut Bench, drive: &mut Told) -> Identified {
    let bodies = answers(port, drive, &Request::Identify.encode(Tag::default()));
    match Answer::decode(&bodies[0]) {
        Some((_, _, Answer::Identified(it))) => it,
        other => panic!("{other:?}"),
    }
}

fn refusal(port: &mut Bench, drive: &mut Told, frame: &[u8]) -> Option<Refusal> {
    match Answer::decode(&answers(port, drive, frame)[0]).expect("an answer").2 {
        Answer::Refused(refused) => Some(refused.refusal),
        _ => None,
    }
}

fn gain(ratio: f32) -> Request<'static> {
    Request::Gain { ratio }
}

#[test]
fn a_drive_without_a_key_says_that_it_is_open() {
    let (mut port, mut drive) = drives::bench(&[]);
    assert_eq!(identify(&mut port, &mut drive).challenge, None);
}

#[test]
fn what_changes_something_needs_the_key() {
    let (mut port, mut drive) = locked(1);
    let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
    let challenge = challenge.expect("a locked drive");
    let tag = Tag { session, turn: 0 };
    let changes = [
        Request::Stage { length: 8, crc: 0 },
        Request::Data { offset: 0, bytes: &[1; 128] },
        Request::Try,
        Request::Revert,
        Request::Commit { signature: 0, crc: 0 },
        Request::RollBack { signature: 0, sequence: 0 },
        Request::Compensate { on: true },
        gain(0.5),
        Request::ClearDiagnostics,
        Request::Bound { share: 1.0 },
        Request::Close,
    ];
    for request in changes {
        assert!(request.changes());
        assert_eq!(refusal(&mut port, &mut drive, &request.encode(tag)), Some(Refusal::Locked), "{request:?}");
        let other = Key([0x5B; 32]);
        let forged = request.encode_proven(tag, &other, &challenge);
        assert_eq!(refusal(&mut port, &mut drive, &forged), Some(Refusal::Locked), "{request:?}");
    }
    for request in [Request::Status, Request::Live, Request::Diagnostics] {
        assert_eq!(refusal(&mut port, &mut drive, &request.encode(tag)), None);
    }
    // None of these took a turn.
    let proven = gain(0.5).encode_proven(tag, &KEY, &challenge);
    assert_eq!(refusal(&mut port, &mut drive, &proven), None);
    assert_eq!(drive.compensation.gain_ratio, 0.5);
    // The longest request fits with its proof.
    let bytes = [7; 128];
    let longest = Request::Data { offset: 0, bytes: &bytes };
    let answer = refusal(&mut port, &mut drive, &longest.encode_proven(Tag { session, turn: 1 }, &KEY, &challenge));
    assert_eq!(answer, Some(Refusal::Incomplete));
}

#[test]
fn a_recorded_session_cannot_be_played_back() {
    let (mut port, mut drive) = locked(1);
    let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
    let frames = [0.25, 0.75].map(|ratio| {
        let turn = u32::from(ratio > 0.5);
        gain(ratio).encode_proven(Tag { session, turn }, &KEY, &challenge.expect("locked"))
    });
    for frame in &frames {
        assert_eq!(refusal(&mut port, &mut drive, frame), None);
    }
    // In the same session, in the next, and after a power-up that begins with the same session.
    assert_eq!(refusal(&mut port, &mut drive, &frames[0]), Some(Refusal::Order));
    identify(&mut port, &mut drive);
    assert_eq!(refusal(&mut port, &mut drive, &frames[0]), Some(Refusal::Locked));
    let (mut port, mut drive) = locked(2);
    assert_eq!(refusal(&mut port, &mut drive, &frames[0]), Some(Refusal::Locked));
    assert_eq!(identify(&mut port, &mut drive).session, session);
    for frame in &frames {
        assert_eq!(refusal(&mut port, &mut drive, frame), Some(Refusal::Locked));
    }
    assert_eq!(drive.compensation.gain_ratio, 1.0);
}

/// Silence ends a session, also for who knows its turn and its challenge.
#[test]
fn a_request_held_back_for_a_minute_is_refused() {
    for (ms, passes) in [(SESSION_END_MS - 100, true), (SESSION_END_MS, false)] {
        let (mut port, mut drive) = locked(1);
        let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
        let request = gain(0.25).encode_proven(Tag { session, turn: 0 }, &KEY, &challenge.expect("locked"));
        for _ in 0..ms / 100 {
            port.elapse(100, &mut drive);
        }
        assert_eq!(refusal(&mut port, &mut drive, &request).is_none(), passes, "{ms}");
        assert_eq!(drive.compensation.gain_ratio, if passes { 0.25 } else { 1.0 });
        // Another session goes on from there.
        port.elapse(SESSION_MS, &mut drive);
        let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
        let request = gain(0.5).encode_proven(Tag { session, turn: 0 }, &KEY, &challenge.expect("locked"));
        assert_eq!(refusal(&mut port, &mut drive, &request), None);
    }
}

/// A request that is held back passes in its turn while its session is open, and never afterwards.
#[test]
fn a_late_request_is_refused_once_its_session_is_over() {
    for closes in [true, false] {
        let (mut port, mut drive) = locked(1);
        let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
        let proven = |turn: u32, request: Request<'_>| {
            request.encode_proven(Tag { session, turn }, &KEY, &challenge.expect("locked"))
        };
        port.elapse(10 * SESSION_MS, &mut drive);
        assert_eq!(refusal(&mut port, &mut drive, &proven(0, gain(0.25))), None);
        // Sent, and held back on the way.
        let (first, second) = (proven(1, gain(0.75)), proven(2, gain(0.75)));
        if closes {
            assert_eq!(refusal(&mut port, &mut drive, &proven(1, Request::Close)), None);
        } else {
            port.elapse(SESSION_MS, &mut drive);
            identify(&mut port, &mut drive);
        }
        for late in [first, second] {
            assert!(refusal(&mut port, &mut drive, &late).is_some(), "{closes}");
        }
        assert_eq!(drive.compensation.gain_ratio, 0.25);
    }
}

/// The frame that `docs/link.md` describes, computed by Python's hmac.
#[test]
fn proofs_are_those_of_the_specification() {
    let key = Key(std::array::from_fn(|k| k as u8));
    let entropy = std::array::from_fn(|k| 100 + k as u8);
    let tag = Tag { session: 0x0403_0201, turn: 7 };
    let challenge = key.challenge(&entropy, tag.session);
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    assert_eq!(hex(&challenge), "a4 0d 0a ad d2 76 5c 1d 14 e3 39 0f 3d 12 8f d6");
    let mut receiver = Receiver::new();
    let frame = gain(0.5).encode_proven(tag, &key, &challenge);
    let body = frame.iter().find_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).expect("a body");
    assert_eq!(hex(&body), "01 4c 01 02 03 04 07 00 00 00 00 00 00 3f 10 3d f9 72 d6 c4 12 0b b9 b6 db 25 c7 77 b3 6e");
}

proptest! {
    #[test]
    fn a_changed_request_is_refused(at in 0_usize..30, bit in 0_u32..8) {
        let (mut port, mut drive) = locked(1);
        let Identified { session, challenge, .. } = identify(&mut port, &mut drive);
        let frame = gain(0.5).encode_proven(Tag { session, turn: 0 }, &KEY, &challenge.expect("locked"));
        let mut receiver = Receiver::new();
        let mut body = frame.iter().find_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).expect("a body");
        body[at] ^= 1 << bit;
        let before = drive.clone();
        answers(&mut port, &mut drive, &gmhm::link::frame::encode(&body));
        prop_assert_eq!(drive, before);
    }
}
