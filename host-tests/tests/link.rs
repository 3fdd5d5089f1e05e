//! The link's rules: what a drive accepts, what it refuses and why, and that no accident of the line changes a parameter.

use crate::common::blocks::block;
use crate::common::drives;
use crate::common::drives::{Session, Told, answers, ask, bench, blank, crc, power_up, staging, store, stored};
use gmhm::block::{BlockError, Identity, verify};
use gmhm::link::message::{ERASE, LOAD, MOST_BYTES, SAVE};
use gmhm::link::{Answer, Origin, Refusal, Request, Tag};

fn of(sequence: u32) -> Vec<u8> {
    block(240, sequence, Identity::NONE, sequence as u8)
}

fn refused(answer: Result<Answer<'static>, gmhm::link::Refused>) -> (Refusal, u16) {
    let refused = answer.expect_err("it must be refused");
    (refused.refusal, refused.detail)
}

#[test]
fn a_block_goes_from_the_line_to_flash_and_back() {
    let (old, new) = (of(1), of(2));
    let (mut port, mut drive) = bench(&[&old]);
    assert_eq!(drive.in_force.as_ref(), Some(&old));
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, &new).expect("staged");
    assert_eq!(drive.in_force.as_ref(), Some(&old), "staging changes nothing");
    session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
    assert_eq!(drive.in_force.as_ref(), Some(&new));
    let status = session.ask(&mut port, &mut drive, Request::Status);
    let Ok(Answer::Status(status)) = status else { panic!("{status:?}") };
    assert_eq!((status.origin, status.sequence, status.crc, status.stored_sequence), (Origin::Trial, 2, crc(&new), 1));
    let commit = Request::Commit { signature: SAVE, crc: crc(&new) };
    let answer = session.ask(&mut port, &mut drive, commit);
    assert_eq!(answer, Ok(Answer::Stored { sequence: 2, crc: crc(&new) }));

    let mut read = Vec::new();
    while read.len() < new.len() {
        let length = (new.len() - read.len()).min(MOST_BYTES) as u8;
        let request = Request::Read { offset: read.len() as u32, length };
        let (_, bytes) = ask(&mut port, &mut drive, request, Tag::default()).expect("bytes");
        assert_eq!(bytes.len(), usize::from(length));
        read.extend(bytes);
    }
    assert_eq!(read, new);

    let flash = port.into_store().into_flash();
    let (mut port, mut drive) = power_up(flash, drive);
    assert_eq!(drive.in_force.as_ref(), Some(&new), "boot finds it");
    let mut session = Session::open(&mut port, &mut drive);
    let back = session.ask(&mut port, &mut drive, Request::RollBack { signature: LOAD, sequence: 2 });
    assert_eq!(back, Ok(Answer::Stored { sequence: 1, crc: crc(&old) }));
    assert_eq!(drive.in_force.as_ref(), Some(&old));
    let (_, drive) = power_up(port.into_store().into_flash(), drive);
    assert_eq!(drive.in_force.as_ref(), Some(&old));
}

#[test]
fn a_trial_ends_with_revert_or_with_power() {
    let (old, new) = (of(1), of(2));
    let (mut port, mut drive) = bench(&[&old]);
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, &new).expect("staged");
    session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
    let (_, bytes) =
        ask(&mut port, &mut drive, Request::Read { offset: 4, length: 100 }, Tag::default()).expect("bytes");
    assert_eq!(bytes, new[4..104], "what is on trial is read, not what is stored");
    // A host that starts over finds the trial as it is.
    let mut session = Session::open(&mut port, &mut drive);
    assert_eq!(drive.in_force.as_ref(), Some(&new));
    session.ask(&mut port, &mut drive, Request::Revert).expect("reverted");
    assert_eq!(drive.in_force.as_ref(), Some(&old));
    session.stage(&mut port, &mut drive, &new).expect("staged again");
    session.ask(&mut port, &mut drive, Request::Try).expect("on trial again");
    let (_, drive) = power_up(port.into_store().into_flash(), drive);
    assert_eq!(drive.in_force.as_ref(), Some(&old));

    // With nothing stored there is nothing to go back to, and nothing is in force.
    let (mut port, mut drive) = bench(&[]);
    let mut session = Session::open(&mut port, &mut drive);
    session.stage(&mut port, &mut drive, &old).expect("staged");
    session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
    session.ask(&mut port, &mut drive, Request::Revert).expect("reverted");
    assert_eq!(drive.in_force, None);
}

#[test]
fn a_stored_block_that_this_firmware_refuses_gives_way_to_the_one_before() {
    let (port, _) = bench(&[&of(1), &of(2)]);
    let drive = Told { dislikes: Some(2), ..Told::default() };
    let (mut port, mut drive) = power_up(port.into_store().into_flash(), drive);
    assert_eq!(drive.in_force, Some(of(1)));
    assert_eq!(port.boot_error(), BlockError::StackDepth(16).code());
    let mut session = Session::open(&mut port, &mut drive);
    let Ok(Answer::Status(status)) = session.ask(&mut port, &mut drive, Request::Status) else { panic!() };
    assert_eq!((status.sequence, status.stored_sequence, status.boot_error), (1, 2, BlockError::StackDepth(16).code()));
}

/// Every reason, reached; after each the parameters in force and in flash are what they were.
#[test]
fn every_refusal_is_reached_and_changes_nothing() {
    let mut reached = Vec::new();
    let mut expect =
        |refusal: Refusal, detail: u16, blocks: &[&[u8]], setting: &dyn Fn(&mut Told), requests: &[Request<'_>]| {
            let (mut port, mut drive) = bench(blocks);
            let mut session = Session::open(&mut port, &mut drive);
            let (last, before) = requests.split_last().expect("a request");
            for request in before {
                session.ask(&mut port, &mut drive, *request).unwrap_or_else(|why| panic!("{request:?}: {why:?}"));
            }
            setting(&mut drive);
            let told = drive.clone();
            assert_eq!(refused(session.ask(&mut port, &mut drive, *last)), (refusal, detail));
            assert_eq!(drive, told, "{refusal:?} changed something");
            let flash = port.into_store().into_flash();
            assert_eq!(stored(&flash), blocks.last().map(|block| block.to_vec()), "{refusal:?} changed the flash");
            reached.push(refusal);
        };
    let (old, new) = (of(1), of(2));
    let other = block(240, 2, Identity::new("another").expect("short"), 0);
    let commit = Request::Commit { signature: SAVE, crc: crc(&new) };
    let roll_back = Request::RollBack { signature: LOAD, sequence: 2 };
    let with = |tail: &[Request<'static>]| [staging(&new), tail.to_vec()].concat();
    let nothing = |_: &mut Told| {};
    let enabled = |drive: &mut Told| drive.enabled = true;
    let compensating = |drive: &mut Told| drive.compensation.on = true;

    expect(Refusal::Enabled, 0, &[&old], &enabled, &with(&[Request::Try, commit]));
    expect(Refusal::Enabled, 0, &[&old, &new], &enabled, &[roll_back]);
    expect(Refusal::Compensating, 0, &[&old], &compensating, &with(&[Request::Try]));
    expect(Refusal::Compensating, 0, &[&old], &compensating, &with(&[Request::Try, Request::Revert]));
    expect(Refusal::Compensating, 0, &[&old, &new], &compensating, &[roll_back]);
    let unsigned = [Request::Try, Request::Commit { signature: LOAD, crc: crc(&new) }];
    expect(Refusal::Signature, 0, &[&old], &nothing, &with(&unsigned));
    expect(Refusal::Signature, 0, &[&old, &new], &nothing, &[Request::RollBack { signature: SAVE, sequence: 2 }]);
    expect(Refusal::Incomplete, 0, &[&old], &nothing, &[Request::Try]);
    expect(Refusal::Incomplete, 0, &[&old], &nothing, &[&staging(&new)[..2], &[Request::Try]].concat());
    expect(Refusal::Incomplete, 0, &[&old], &nothing, &[Request::Data { offset: 0, bytes: &[1] }]);
    expect(Refusal::Offset, 0, &[&old], &nothing, &[staging(&new)[0], staging(&new)[2]]);
    expect(Refusal::Offset, 0, &[&old], &nothing, &with(&[Request::Data { offset: 240, bytes: &[0; 4] }]));
    expect(Refusal::Offset, 0, &[&old], &nothing, &[Request::Read { offset: 200, length: 41 }]);
    expect(Refusal::Offset, 0, &[&old], &nothing, &[Request::Read { offset: u32::MAX, length: 128 }]);
    expect(Refusal::Payload, 0, &[&old], &nothing, &[Request::Read { offset: 0, length: 129 }]);
    expect(Refusal::Room, 0, &[&old], &nothing, &[Request::Stage { length: 449, crc: 0 }]);
    let announced = Request::Stage { length: 240, crc: crc(&new) ^ 1 };
    let misannounced = [&[announced], &staging(&new)[1..], &[Request::Try]].concat();
    expect(Refusal::Checksum, 0, &[&old], &nothing, &misannounced);
    let meant = Request::Commit { signature: SAVE, crc: crc(&new) ^ 1 };
    expect(Refusal::Checksum, 0, &[&old], &nothing, &with(&[Request::Try, meant]));
    let mut damaged = new.clone();
    damaged[60] ^= 1;
    let staged = damaged.chunks(96).enumerate().map(|(k, bytes)| Request::Data { offset: 96 * k as u32, bytes });
    let requests: Vec<_> = [staging(&new)[0]].into_iter().chain(staged).chain([Request::Try]).collect();
    expect(Refusal::Block, BlockError::Checksum.code(), &[&old], &nothing, &requests);
    let dislikes = |drive: &mut Told| drive.dislikes = Some(2);
    expect(Refusal::Block, BlockError::StackDepth(16).code(), &[&old], &dislikes, &with(&[Request::Try]));
    let mounted = |drive: &mut Told| drive.gear = Identity::new("mounted").expect("short");
    expect(Refusal::Gear, 0, &[&old], &mounted, &with(&[Request::Try]));
    expect(Refusal::Gear, 0, &[&old], &mounted, &[staging(&other), vec![Request::Try]].concat());
    // A drive that does not know its gear keeps to that of its newest block.
    let first = block(240, 1, Identity::new("the first").expect("short"), 0);
    expect(Refusal::Gear, 0, &[&first], &nothing, &[staging(&other), vec![Request::Try]].concat());
    expect(Refusal::Sequence, 0, &[&new], &nothing, &with(&[Request::Try]));
    expect(Refusal::Sequence, 0, &[&old, &new], &nothing, &[Request::RollBack { signature: LOAD, sequence: 1 }]);
    expect(Refusal::NothingBefore, 0, &[&new], &nothing, &[roll_back]);
    expect(Refusal::NoAdaptation, 0, &[&old], &nothing, &[Request::Adaptation]);
    expect(Refusal::Value, 0, &[&old], &nothing, &[Request::Gain { ratio: 1.01 }]);
    expect(Refusal::Value, 0, &[&old], &nothing, &[Request::Gain { ratio: f32::NAN }]);
    expect(Refusal::Value, 0, &[&old], &nothing, &[Request::Bound { share: f32::NAN }]);
    expect(Refusal::Value, 0, &[&old], &nothing, &[Request::Bound { share: -0.1 }]);
    expect(Refusal::Enabled, 0, &[&old], &enabled, &[Request::Bound { share: 0.5 }]);
    expect(Refusal::Signature, 0, &[&old], &nothing, &[Request::EraseUnreadable { signature: SAVE }]);
    expect(Refusal::Enabled, 0, &[&old], &enabled, &[Request::EraseUnreadable { signature: ERASE }]);
    expect(Refusal::OnTrial, 0, &[&old], &nothing, &[staging(&new), vec![Request::Try, staging(&new)[0]]].concat());
    expect(Refusal::OnTrial, 0, &[&old], &nothing, &[staging(&new), vec![Request::Try, staging(&new)[1]]].concat());
    expect(Refusal::OnTrial, 0, &[&old], &nothing, &with(&[Request::Try, Request::Try]));
    expect(Refusal::NotOnTrial, 0, &[&old], &nothing, &with(&[commit]));
    expect(Refusal::NotOnTrial, 0, &[&old], &nothing, &[Request::Revert]);
    expect(Refusal::NoParameters, 0, &[], &nothing, &[Request::Compensate { on: true }]);
    expect(Refusal::NoParameters, 0, &[], &nothing, &[Request::Read { offset: 0, length: 1 }]);

    // A trial that a roll-back would pull the ground from.
    let newer = of(3);
    let requests = [staging(&newer), vec![Request::Try, roll_back]].concat();
    expect(Refusal::OnTrial, 0, &[&old, &new], &nothing, &requests);

    // Without a session, in another's, out of turn.
    let (mut port, mut drive) = bench(&[&old]);
    let gain = Request::Gain { ratio: 0.5 };
    let tell = |port: &mut _, drive: &mut _, tag| refused(ask(port, drive, gain, tag).map(|(answer, _)| answer)).0;
    reached.push(tell(&mut port, &mut drive, Tag { session: 42, turn: 0 }));
    let session = Session::open(&mut port, &mut drive).tag.session;
    reached.push(tell(&mut port, &mut drive, Tag { session: session ^ 1, turn: 0 }));
    reached.push(tell(&mut port, &mut drive, Tag { session, turn: 1 }));
    assert_eq!(reached[reached.len() - 3..], [Refusal::Session, Refusal::Session, Refusal::Order]);

    // Commands and versions that are not known, payloads of another length.
    for (body, refusal) in [
        ([1, 19, 0, 0, 0, 0, 0, 0, 0, 0].as_slice(), Refusal::Command),
        (&[2, 7, 0, 0, 0, 0, 0, 0, 0, 0], Refusal::Command),
        (&[1, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0], Refusal::Payload),
        (&[1, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0], Refusal::Payload),
        (&[1, 18, 0, 0, 0, 0, 0, 0, 0, 0], Refusal::Payload),
        (&[1, 11, 0, 0, 0, 0, 0, 0, 0, 0, 2], Refusal::Payload),
    ] {
        let bodies = answers(&mut port, &mut drive, &gmhm::link::frame::encode(body));
        let Some((_, _, Answer::Refused(why))) = Answer::decode(&bodies[0]) else { panic!("{bodies:?}") };
        assert_eq!(why.refusal, refusal);
        reached.push(refusal);
    }
    // What is no request at all stays unanswered: too short, an answer, garbage.
    for body in [[1, 7].as_slice(), &[1, 0x81, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], &[]] {
        assert!(answers(&mut port, &mut drive, &gmhm::link::frame::encode(body)).is_empty());
    }
    let missing: Vec<_> = Refusal::ALL.iter().filter(|refusal| !reached.contains(refusal)).collect();
    // A flash that fails is met where power is cut, one that does not read below, the others among plausible changes and with a lock.
    assert_eq!(
        missing,
        [&Refusal::Flash, &Refusal::ReadBack, &Refusal::Bound, &Refusal::Busy, &Refusal::Locked, &Refusal::Unreadable]
    );
}

#[test]
fn refusals_have_numbers_of_their_own_and_abort_codes_of_canopen() {
    // CiA 301, table of SDO abort codes.
    const ABORT_CODES: [u32; 31] = [
        0x0503_0000,
        0x0504_0000,
        0x0504_0001,
        0x0504_0002,
        0x0504_0003,
        0x0504_0004,
        0x0504_0005,
        0x0601_0000,
        0x0601_0001,
        0x0601_0002,
        0x0602_0000,
        0x0604_0041,
        0x0604_0042,
        0x0604_0043,
        0x0604_0047,
        0x0606_0000,
        0x0607_0010,
        0x0607_0012,
        0x0607_0013,
        0x0609_0011,
        0x0609_0030,
        0x0609_0031,
        0x0609_0032,
        0x0609_0036,
        0x060A_0023,
        0x0800_0000,
        0x0800_0020,
        0x0800_0021,
        0x0800_0022,
        0x0800_0023,
        0x0800_0024,
    ];
    for (k, refusal) in Refusal::ALL.into_iter().enumerate() {
        assert_eq!(usize::from(refusal.number()), k + 1);
        assert_eq!(Refusal::of_number(refusal.number()), Some(refusal));
        assert!(ABORT_CODES.contains(&refusal.abort_code()), "{refusal:?}");
        assert!(!refusal.to_string().is_empty());
    }
    assert_eq!(Refusal::of_number(0), None);
    assert_eq!(Refusal::of_number(27), None);
}

/// Power fails at every moment of a commit: an acknowledgement means that boot finds the new block, and without one it finds the old or the new.
#[test]
fn an_acknowledged_block_outlives_power() {
    let (old, new) = (of(1), of(2));
    let (mut cuts, mut acknowledged, mut failed) = (0, 0, 0);
    for moment in 0.. {
        let mut flash = blank();
        store_one(&mut flash, &old);
        flash.cut_after(moment, moment);
        let (mut port, mut drive) = power_up(flash, Told::default());
        let mut session = Session::open(&mut port, &mut drive);
        session.stage(&mut port, &mut drive, &new).expect("staged");
        session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
        let answer = session.ask(&mut port, &mut drive, Request::Commit { signature: SAVE, crc: crc(&new) });
        let mut flash = port.into_store().into_flash();
        let was_cut = flash.power_up();
        let (_, drive) = power_up(flash, drive);
        match answer {
            Ok(answer) => {
                assert_eq!(answer, Answer::Stored { sequence: 2, crc: crc(&new) });
                assert_eq!(drive.in_force.as_ref(), Some(&new));
                acknowledged += 1;
            }
            Err(why) => {
                assert_eq!(why.refusal, Refusal::Flash);
                assert!([&old, &new].contains(&drive.in_force.as_ref().expect("a block")));
                failed += 1;
            }
        }
        if !was_cut {
            break;
        }
        cuts += 1;
    }
    println!("{cuts} cuts in a commit, {failed} refused, {acknowledged} acknowledged");
    assert!(failed == cuts && acknowledged == 1);
}

/// A flash whose cells stick: the commit is refused, and the old block stays.
#[test]
fn a_flash_that_does_not_keep_what_it_is_told_is_found_out() {
    use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
    use gmhm::link::Port;
    use gmhm::store::Store;

    struct Stuck(drives::Flash, bool);
    impl ErrorType for Stuck {
        type Error = gmhm_host_tests::flash::FlashFault;
    }
    impl ReadNorFlash for Stuck {
        const READ_SIZE: usize = 4;
        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
            self.0.read(offset, bytes)?;
            if self.1 && offset == drives::SLOT + 64 {
                bytes[3] &= 0xFE;
                bytes[4] &= 0xFE;
            }
            Ok(())
        }
        fn capacity(&self) -> usize {
            self.0.capacity()
        }
    }
    impl NorFlash for Stuck {
        const WRITE_SIZE: usize = 4;
        const ERASE_SIZE: usize = 256;
        fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
            self.0.erase(from, to)
        }
        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
            self.0.write(offset, bytes)
        }
    }

    for sticks in [false, true] {
        let mut flash = blank();
        store_one(&mut flash, &of(1));
        let store =
            Store::new(Stuck(flash, sticks), 0..drives::SLOT, drives::SLOT..2 * drives::SLOT).expect("two slots");
        let mut port = Port::<_, 448>::new(store, 7);
        let mut drive = Told::default();
        port.boot(&mut drive);
        let mut last = None;
        let mut session = 0;
        let new = of(2);
        let commit = Request::Commit { signature: SAVE, crc: crc(&new) };
        let requests = [vec![Request::Identify], staging(&new), vec![Request::Try, commit]].concat();
        for (k, request) in requests.iter().enumerate() {
            let tag = Tag { session, turn: (k as u32).saturating_sub(1) };
            port.receive(&request.encode(tag), &mut drive, |frame| {
                let mut receiver = gmhm::link::Receiver::new();
                for byte in frame {
                    if let Some((_, _, answer)) = receiver.feed(*byte).and_then(Answer::decode) {
                        last = match answer {
                            Answer::Identified(it) => {
                                session = it.session;
                                None
                            }
                            Answer::Refused(why) => Some(Err(why.refusal)),
                            _ => Some(Ok(())),
                        };
                    }
                }
            });
        }
        assert_eq!(last, Some(if sticks { Err(Refusal::ReadBack) } else { Ok(()) }));
        assert_eq!(port.boot(&mut drive).map(|entry| entry.header.sequence), Some(if sticks { 1 } else { 2 }));
    }
}

/// The flash does not read when the drive boots: nothing is stored until it does, or until what does not read is erased on purpose.
#[test]
fn a_flash_that_does_not_read_is_not_written() {
    let (old, new) = (of(1), of(2));
    let commit = Request::Commit { signature: SAVE, crc: crc(&new) };
    let try_new = |flash: drives::Flash| {
        let (mut port, mut drive) = power_up(flash, Told::default());
        assert_eq!(drive.in_force, None);
        let mut session = Session::open(&mut port, &mut drive);
        session.stage(&mut port, &mut drive, &new).expect("staged");
        session.ask(&mut port, &mut drive, Request::Try).expect("on trial");
        let answer = session.ask(&mut port, &mut drive, commit);
        assert_eq!(refused(answer), (Refusal::Unreadable, 0));
        (port, drive, session)
    };
    let mut flash = blank();
    store_one(&mut flash, &old);
    flash.hide(0..2 * drives::SLOT as usize);
    let (port, drive, _) = try_new(flash);
    let mut flash = port.into_store().into_flash();
    flash.hide(0..0);
    let (_, drive) = power_up(flash, drive);
    assert_eq!(drive.in_force.as_ref(), Some(&old), "power off and on, and the block in force is there");

    // The first block ever lost its power in the erase before it, and the flash has error correction.
    let mut flash = blank();
    flash.cut_after(3, 0);
    let mut store = store(flash);
    store.write(&verify(&old).expect("a block")).expect_err("no power");
    let mut flash = store.into_flash();
    flash.power_up();
    let (mut port, mut drive, mut session) = try_new(flash);
    let erase = Request::EraseUnreadable { signature: ERASE };
    assert_eq!(session.ask(&mut port, &mut drive, erase), Ok(Answer::Done));
    assert_eq!(session.ask(&mut port, &mut drive, commit), Ok(Answer::Stored { sequence: 2, crc: crc(&new) }));
}

/// One bad read at boot does not put the older block in force.
#[test]
fn a_bad_read_at_boot_changes_nothing() {
    use gmhm_host_tests::flash::ReadFault;

    let (port, drive) = bench(&[&of(1), &of(2)]);
    let mut flash = port.into_store().into_flash();
    flash.disturb_reads(0, 0, ReadFault::Error);
    for fault in [ReadFault::Error, ReadFault::Flip, ReadFault::Erased] {
        for after in 0.. {
            let mut flash = flash.clone();
            let before = flash.reads();
            flash.disturb_reads(after, 1, fault);
            let (port, drive) = power_up(flash, drive.clone());
            assert_eq!((drive.in_force, port.boot_error()), (Some(of(2)), 0), "{fault:?} after {after}");
            if port.into_store().into_flash().reads() - before <= after {
                break;
            }
        }
    }
}

fn store_one(flash: &mut drives::Flash, bytes: &[u8]) {
    let mut store = store(core::mem::replace(flash, blank()));
    store.write(&verify(bytes).expect("a block")).expect("room");
    *flash = store.into_flash();
}
