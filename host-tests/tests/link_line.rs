//! Accidents of the line: whatever is lost, cut short, flipped, repeated, late or invented, a drive changes only by the session's next request, whole.

use crate::common::blocks::block;
use crate::common::drives::{Bench, Session, Told, answers, bench, crc, staging, stored};
use gmhm::block::{Identity, ScalarKind};
use gmhm::diagnostics::{Diagnostics, Fault, SelfTest};
use gmhm::link::frame::{MOST_BODY, MOST_FRAME, encode};
use gmhm::link::message::{LOAD, MOST_BYTES, SAVE};
use gmhm::link::{
    Adapted, Answer, Identified, LineCounts, LinkDiagnostics, Live, Origin, Receiver, Refusal, Refused, Request,
    Status, Tag,
};
use proptest::prelude::*;

fn of(sequence: u32) -> Vec<u8> {
    block(240, sequence, Identity::NONE, sequence as u8)
}

/// Everything that changes a drive, in an order that goes through.
fn transcript(session: u32) -> Vec<Vec<u8>> {
    let new = of(2);
    let requests = [
        staging(&new),
        vec![
            Request::Gain { ratio: 0.25 },
            Request::Try,
            Request::Compensate { on: true },
            Request::Gain { ratio: 0.75 },
            Request::Compensate { on: false },
            Request::Commit { signature: SAVE, crc: crc(&new) },
            Request::Gain { ratio: 1.0 },
            Request::RollBack { signature: LOAD, sequence: 2 },
        ],
    ]
    .concat();
    requests.iter().zip(0..).map(|(request, turn)| request.encode(Tag { session, turn }).to_vec()).collect()
}

/// A drive with one stored block, and the numbers of the session before and of the one that is open.
fn fresh() -> (Bench, Told, [u32; 2]) {
    let (mut port, mut drive) = bench(&[&of(1)]);
    // A session of an earlier host, whose frames may still be about.
    let sessions = [(); 2].map(|()| Session::open(&mut port, &mut drive).tag.session);
    (port, drive, sessions)
}

/// What a drive holds.
fn snapshot(port: Bench, drive: Told) -> (Told, Option<Vec<u8>>) {
    (drive, stored(&port.into_store().into_flash()))
}

#[derive(Debug, Clone)]
enum Happening {
    /// The frame that comes next in the host's order.
    Next,
    /// Any frame: repeated, early or late.
    Any(usize),
    /// A frame without its end.
    Truncated(usize, usize),
    /// A frame with a bit flipped.
    Flipped(usize, usize),
    /// A frame of the session before.
    Stale(usize),
    /// Bytes of nobody.
    Garbage(Vec<u8>),
    /// Another host identifies: the session is over.
    Identify,
}

fn happening() -> impl Strategy<Value = Happening> {
    use Happening::*;
    prop_oneof![
        12 => Just(Next),
        2 => any::<usize>().prop_map(Any),
        2 => (any::<usize>(), any::<usize>()).prop_map(|(frame, length)| Truncated(frame, length)),
        3 => (any::<usize>(), any::<usize>()).prop_map(|(frame, bit)| Flipped(frame, bit)),
        2 => any::<usize>().prop_map(Stale),
        2 => prop::collection::vec(any::<u8>(), 0..300).prop_map(Garbage),
        1 => Just(Identify),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn only_the_next_request_whole_changes_anything(happenings in prop::collection::vec(happening(), 0..60)) {
        let (mut port, mut drive, [before, session]) = fresh();
        let frames = transcript(session);
        let stale = transcript(before);
        let (mut sent, mut taken, mut open) = (0, 0, true);
        for happening in &happenings {
            let (bytes, whole) = match happening {
                Happening::Next => {
                    let next = sent.min(frames.len() - 1);
                    sent += 1;
                    (frames[next].clone(), Some(next))
                }
                Happening::Any(k) => (frames[k % frames.len()].clone(), Some(k % frames.len())),
                Happening::Truncated(k, length) => {
                    // Without the closing zero alone, the opening one of the next frame would complete it.
                    let frame = &frames[k % frames.len()];
                    (frame[..length % (frame.len() - 1)].to_vec(), None)
                }
                Happening::Flipped(k, bit) => {
                    let mut frame = frames[k % frames.len()].clone();
                    let bit = bit % (8 * frame.len());
                    frame[bit / 8] ^= 1 << (bit % 8);
                    (frame, None)
                }
                Happening::Stale(k) => (stale[k % stale.len()].clone(), None),
                Happening::Garbage(bytes) => (bytes.clone(), None),
                Happening::Identify => {
                    open = false;
                    (Request::Identify.encode(Tag::default()).to_vec(), None)
                }
            };
            answers(&mut port, &mut drive, &bytes);
            taken += usize::from(open && whole == Some(taken));
        }
        let (mut clean, mut told, _) = fresh();
        for frame in &frames[..taken] {
            let bodies = answers(&mut clean, &mut told, frame);
            let refused = matches!(Answer::decode(&bodies[0]), Some((_, _, Answer::Refused(_))));
            prop_assert!(!refused);
        }
        prop_assert_eq!(snapshot(port, drive), snapshot(clean, told), "after {} requests", taken);
    }

    #[test]
    fn garbage_is_never_answered(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let (mut port, mut drive, _) = fresh();
        prop_assert!(answers(&mut port, &mut drive, &bytes).is_empty());
        // And the next frame is heard.
        prop_assert_eq!(answers(&mut port, &mut drive, &Request::Status.encode(Tag::default())).len(), 1);
    }

    #[test]
    fn frames_give_their_bodies_back(body in prop::collection::vec(any::<u8>(), 0..=MOST_BODY)) {
        let frame = encode(&body);
        prop_assert!(frame.len() <= MOST_FRAME);
        let mut receiver = Receiver::new();
        let mut bodies = Vec::new();
        for byte in frame.iter() {
            bodies.extend(receiver.feed(*byte).map(<[u8]>::to_vec));
        }
        prop_assert_eq!(bodies, vec![body]);
    }

    #[test]
    fn requests_and_answers_survive_the_line(
        words in prop::array::uniform8(any::<u32>()),
        bytes in prop::collection::vec(any::<u8>(), 0..=MOST_BYTES),
        flags in prop::array::uniform4(any::<bool>()),
        number in 1_u8..=25,
    ) {
        let [a, b, c, d, e, f, g, h] = words;
        let [on, ..] = flags;
        let finite = |word: u32| f32::from_bits(word & !0x4000_0000);
        let tag = Tag { session: a, turn: b };
        for request in [
            Request::Identify,
            Request::Status,
            Request::Read { offset: c, length: number },
            Request::Live,
            Request::Stage { length: c, crc: d },
            Request::Data { offset: c, bytes: &bytes },
            Request::Try,
            Request::Revert,
            Request::Commit { signature: c, crc: d },
            Request::RollBack { signature: c, sequence: d },
            Request::Compensate { on },
            Request::Gain { ratio: finite(c) },
            Request::Diagnostics,
            Request::ClearDiagnostics,
            Request::Bound { share: finite(c) },
            Request::Close,
            Request::Adaptation,
        ] {
            let body = body(&request.encode(tag));
            prop_assert_eq!(Request::decode(&body), Some((request.command(), tag, Ok(request))));
            prop_assert_eq!(Answer::decode(&body), None);
        }
        let identified = Identified {
            session: a,
            gear: Identity::of_name("a name that is longer than sixteen bytes"),
            room: c,
            format_version: d as u16,
            scalar: ScalarKind::F32,
            stack_depth: e as u16,
            challenge: on.then_some([number; 16]),
        };
        let mut status = Status::default();
        status.origin = [Origin::Nowhere, Origin::Stored, Origin::Trial][c as usize % 3];
        status.sequence = d;
        status.crc = e;
        status.length = f;
        status.stored_sequence = g;
        status.boot_error = h as u16;
        status.enabled = flags[1];
        status.compensating = flags[2];
        status.gain_ratio = finite(c);
        let live = Live {
            deflection_rad: finite(c),
            torque_nm: finite(d),
            hysteresis_nm: finite(e),
            words: [a, b],
            contribution_nm: finite(f),
            out_of_range: flags[2],
            refused: flags[3],
            ticks: g,
            loop_cost: h,
        };
        let diagnostics = LinkDiagnostics {
            joint: Diagnostics {
                refused: a,
                out_of_range: b,
                quarantined: c,
                restarted: d,
                saturated: e,
                merged_pairs: f,
                last: Fault::of_number(number % 7).expect("a number"),
                self_test: SelfTest::of_number(number % 3).expect("a number"),
            },
            line: LineCounts { frames: g, bad_checksums: h, malformed: a },
            refused_requests: b,
            expired_trials: c,
            bound: finite(d),
        };
        let adapted = Adapted {
            taken_over: on,
            warnings: c as u16,
            stretches: d,
            in_force: [e, f, g, h, a].map(finite),
            shadow: [f, g, h, a, b].map(finite),
            deviations: [g, h, a, b, c].map(finite),
        };
        let refused = Refused { refusal: Refusal::of_number(number).expect("a number"), detail: c as u16 };
        for (command, answer) in [
            (1, Answer::Identified(identified)),
            (2, Answer::Status(status)),
            (3, Answer::Bytes { offset: c, bytes: &bytes }),
            (4, Answer::Live(live)),
            (7, Answer::Done),
            (9, Answer::Stored { sequence: c, crc: d }),
            (10, Answer::Stored { sequence: c, crc: d }),
            (13, Answer::Diagnostics(diagnostics)),
            (14, Answer::Done),
            (17, Answer::Adaptation(adapted)),
            (8, Answer::Refused(refused)),
        ] {
            let body = body(&answer.encode(command, tag));
            prop_assert_eq!(Answer::decode(&body), Some((command, tag, answer)));
            prop_assert_eq!(Request::decode(&body), None);
        }
    }
}

fn body(frame: &[u8]) -> Vec<u8> {
    let mut receiver = Receiver::new();
    frame.iter().find_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).expect("a body")
}

/// The frames that `docs/link.md` shows.
#[test]
fn frames_are_those_of_the_specification() {
    let hex = |frame: &[u8]| frame.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    let tag = Tag { session: 0x0403_0201, turn: 7 };
    let shown = [
        hex(&Request::Status.encode(Tag::default())),
        hex(&Request::Commit { signature: SAVE, crc: 0x1234_5678 }.encode(tag)),
        hex(&Answer::Refused(Refused { refusal: Refusal::Enabled, detail: 0 }).encode(9, tag)),
    ];
    let specification = include_str!("../../docs/link.md");
    for frame in shown {
        assert!(specification.contains(&format!("    {frame}\n")), "docs/link.md does not show\n    {frame}");
    }
}
