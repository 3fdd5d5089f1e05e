//! The object dictionary and SDO: every object answers as the dictionary says, and whatever frames come, nothing changes but by what they ask for.

use crate::common;
use crate::common::drives;
use crate::common::drives::{Flash, Told, blank, store};
use gmhm::block::{BlockError, Header, Identity, Joint, ScalarKind, Writer, verify};
use gmhm::link::lock::{Key, PROOF_BYTES};
use gmhm::link::objects::{Abort, Access, DataType, OBJECTS, STAGE, object};
use gmhm::link::sdo::CanData;
use gmhm::link::server::{FADE_MS, SESSION_MS, TRIAL_MS};
use gmhm::link::{Adapted, Answer, Asked, Origin, Refusal, Request, SdoServer, Server, Tag};
use gmhm::{Gear, Params};
use proptest::prelude::*;

type Bench = Server<Flash, 448>;

fn block(sequence: u32) -> Vec<u8> {
    let params: Params = common::masing();
    let mut buffer = [0; 1024];
    let header = Header { sequence, ..Header::new(Identity::of_name("bench"), ScalarKind::F32) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(&Gear::<f32>::new(&params), &params).expect("a gear");
    writer.joint(&Joint::default()).expect("a joint");
    let length = writer.finish().expect("room");
    buffer[..length].to_vec()
}

fn bench(blocks: &[&[u8]]) -> (Bench, Told) {
    let mut store = store(blank());
    for block in blocks {
        store.write(&verify(block).expect("a block")).expect("room");
    }
    let (mut server, mut drive) = (Bench::new(store, 42), Told::default());
    server.boot(&mut drive);
    (server, drive)
}

#[test]
fn what_an_adaptation_has_learnt_is_read() {
    let (mut server, mut drive) = bench(&[&block(1)]);
    let mut client = Client { sdo: SdoServer::new(), server: &mut server, drive: &mut drive };
    assert_eq!(client.upload(0x2007, 18), Ok(vec![0; 4]), "a drive without one");
    let adapted = Adapted {
        taken_over: true,
        warnings: 0x0140,
        stretches: 70_000,
        in_force: [0.01, 0.02, 0.03, 0.04, 0.05],
        shadow: [0.06, 0.07, 0.08, 0.09, 0.10],
        deviations: [0.11, 0.12, 0.13, 0.14, 0.15],
    };
    client.drive.adaptation = Some(adapted);
    assert_eq!(client.upload(0x2007, 1), Ok(vec![1]));
    assert_eq!(client.upload(0x2007, 2), Ok(vec![0x40, 0x01]));
    assert_eq!(client.upload(0x2007, 3), Ok(70_000_u32.to_le_bytes().to_vec()));
    for sub in 4..=18 {
        let expected = f32::from(sub - 3) / 100.0;
        assert_eq!(client.upload(0x2007, sub), Ok(expected.to_le_bytes().to_vec()), "{sub}");
    }
    assert_eq!(client.upload(0x2007, 19), Err(Abort::NO_SUB.0));
}

/// A client of the other end, written apart: it follows CiA 301.
struct Client<'a> {
    sdo: SdoServer,
    server: &'a mut Bench,
    drive: &'a mut Told,
}

impl Client<'_> {
    fn ask(&mut self, frame: CanData) -> Result<CanData, u32> {
        let answer = self.sdo.answer(&frame, self.server, self.drive).expect("an answer");
        if answer[0] == 0x80 { Err(u32::from_le_bytes(answer[4..].try_into().expect("four"))) } else { Ok(answer) }
    }

    fn upload(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let [i0, i1] = index.to_le_bytes();
        let first = self.ask([0x40, i0, i1, sub, 0, 0, 0, 0])?;
        assert_eq!(first[1..4], [i0, i1, sub]);
        if first[0] & 2 != 0 {
            return Ok(first[4..8 - usize::from(first[0] >> 2 & 3)].to_vec());
        }
        let length = u32::from_le_bytes(first[4..].try_into().expect("four"));
        let (mut bytes, mut toggle) = (Vec::new(), 0);
        loop {
            let segment = self.ask([0x60 | toggle << 4, 0, 0, 0, 0, 0, 0, 0])?;
            assert_eq!(segment[0] >> 4, toggle);
            bytes.extend(&segment[1..8 - usize::from(segment[0] >> 1 & 7)]);
            toggle ^= 1;
            if segment[0] & 1 != 0 {
                assert_eq!(bytes.len(), length as usize);
                return Ok(bytes);
            }
        }
    }

    fn download(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        let [i0, i1] = index.to_le_bytes();
        if let Ok(count @ 1..=4) = u8::try_from(bytes.len()) {
            let mut frame = [0x23 | (4 - count) << 2, i0, i1, sub, 0, 0, 0, 0];
            frame[4..4 + bytes.len()].copy_from_slice(bytes);
            return self.ask(frame).map(drop);
        }
        self.segments(index, sub, bytes)
    }

    fn segments(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        let [i0, i1] = index.to_le_bytes();
        let [a, b, c, d] = (bytes.len() as u32).to_le_bytes();
        self.ask([0x21, i0, i1, sub, a, b, c, d])?;
        for (k, part) in bytes.chunks(7).enumerate() {
            let last = u8::from(7 * (k + 1) >= bytes.len());
            let mut frame = [(k as u8 & 1) << 4 | (7 - part.len() as u8) << 1 | last, 0, 0, 0, 0, 0, 0, 0];
            frame[1..=part.len()].copy_from_slice(part);
            assert_eq!(self.ask(frame)?[0], 0x20 | (k as u8 & 1) << 4);
        }
        Ok(())
    }
}

#[test]
fn every_object_answers_as_the_dictionary_says() {
    let (mut server, mut drive) = bench(&[&block(1)]);
    let mut client = Client { sdo: SdoServer::new(), server: &mut server, drive: &mut drive };
    for entry in OBJECTS {
        let (index, sub) = (entry.index, entry.sub);
        assert_eq!(object(index, sub), Ok(*entry), "{index:04x}:{sub} stands twice");
        let read = client.upload(index, sub);
        if entry.access == Access::WriteOnly {
            assert_eq!(read, Err(Abort::WRITE_ONLY.0), "{}", entry.name);
        } else {
            let length = read.unwrap_or_else(|code| panic!("{}: {code:#x}", entry.name)).len();
            assert!(entry.data_type.bytes().is_none_or(|bytes| bytes == length), "{}: {length}", entry.name);
        }
        if entry.access == Access::ReadOnly {
            assert_eq!(client.download(index, sub, &[0; 4]), Err(Abort::READ_ONLY.0), "{}", entry.name);
        } else if entry.data_type != DataType::Domain {
            assert_eq!(client.download(index, sub, &[0; 3]), Err(Abort::LENGTH.0), "{}", entry.name);
            assert_eq!(client.segments(index, sub, &[0; 5]), Err(Abort::LENGTH.0), "{}", entry.name);
        }
    }
    assert_eq!(client.upload(0x2004, 0), Ok(vec![3]));
    assert_eq!(client.upload(0x2004, 4), Err(Abort::NO_SUB.0));
    assert_eq!(client.upload(0x1000, 1), Err(Abort::NO_SUB.0));
    assert_eq!(client.upload(0x2008, 1), Err(Abort::NO_OBJECT.0));
    assert_eq!(client.upload(0x2000, 1), Ok(Identity::of_name("bench").bytes().to_vec()));
    assert_eq!(client.upload(0x2005, 1), Ok(block(1)));
    // No block transfer, no segment without a transfer, and each segment once.
    assert_eq!(client.ask([0xC0, 5, 0x20, 2, 0, 0, 0, 0]), Err(Abort::COMMAND.0));
    assert_eq!(client.ask([0x60, 0, 0, 0, 0, 0, 0, 0]), Err(Abort::COMMAND.0));
    client.ask([0x40, 5, 0x20, 1, 0, 0, 0, 0]).expect("an upload");
    client.ask([0x60, 0, 0, 0, 0, 0, 0, 0]).expect("a segment");
    assert_eq!(client.ask([0x60, 0, 0, 0, 0, 0, 0, 0]), Err(Abort::TOGGLE.0));
}

#[test]
fn a_block_goes_its_way_over_objects() {
    let (old, new) = (block(1), block(2));
    let (mut server, mut drive) = bench(&[&old]);
    let mut client = Client { sdo: SdoServer::new(), server: &mut server, drive: &mut drive };
    let mut damaged = new.clone();
    damaged[60] ^= 1;
    client.download(STAGE.0, STAGE.1, &damaged).expect("staged");
    assert_eq!(client.download(0x2006, 1, &[1]), Err(BlockError::Checksum.sdo_abort()));
    client.download(STAGE.0, STAGE.1, &new).expect("staged");
    assert_eq!(client.drive.in_force.as_ref(), Some(&old));
    client.download(0x2006, 1, &[1]).expect("on trial");
    assert_eq!(client.drive.in_force.as_ref(), Some(&new));
    assert_eq!(client.upload(0x2001, 1), Ok(vec![Origin::Trial as u8]));
    client.drive.enabled = true;
    assert_eq!(client.download(0x1010, 1, b"save"), Err(Refusal::Enabled.abort_code()));
    client.drive.enabled = false;
    assert_eq!(client.download(0x1010, 1, b"load"), Err(Refusal::Signature.abort_code()));
    client.download(0x1010, 1, b"save").expect("stored");
    assert_eq!(drives::stored(&server.into_store().into_flash()), Some(new));
}

#[test]
fn a_bus_and_a_serial_host_do_not_change_things_at_once() {
    let (mut server, mut drive) = bench(&[&block(1)]);
    server.elapse(1, &mut drive);
    let mut bytes = [0; 128];
    let identified = server.answer(&Asked::plain(Request::Identify, Tag::default()), &mut drive, &mut bytes);
    assert!(matches!(identified, Answer::Identified(_)));
    let ratio = 0.5_f32.to_le_bytes();
    let busy = Abort(Refusal::Busy.abort_code());
    assert_eq!(server.write_object(0x2004, 2, &mut drive, &ratio), Err(busy));
    server.elapse(SESSION_MS, &mut drive);
    assert_eq!(server.write_object(0x2004, 2, &mut drive, &ratio), Ok(()));
    assert_eq!(drive.compensation.gain_ratio, 0.5);
    // A trial of the bus expires as one of the line does.
    let new = block(2);
    server.begin_domain(new.len() as u32).expect("room");
    server.write_domain(0, &new).expect("staged");
    server.write_object(0x2006, 1, &mut drive, &[1]).expect("on trial");
    server.elapse(TRIAL_MS, &mut drive);
    server.elapse(FADE_MS, &mut drive);
    assert_eq!(drive.in_force, Some(block(1)));
}

/// A transfer of a bus carries no proof: with a key every object that can be read is, and none is written.
#[test]
fn a_locked_drive_is_read_and_not_written_over_objects() {
    let (old, new) = (block(1), block(2));
    let mut store = store(blank());
    store.write(&verify(&old).expect("a block")).expect("room");
    let mut server = Bench::new(store, 42).with_lock(Key([0x5A; 32]), [1; PROOF_BYTES]);
    let mut drive = Told::default();
    server.boot(&mut drive);
    let mut client = Client { sdo: SdoServer::new(), server: &mut server, drive: &mut drive };
    let locked = Err(Refusal::Locked.abort_code());
    for entry in OBJECTS.iter().filter(|entry| entry.access != Access::ReadOnly) {
        let bytes = match entry.data_type {
            DataType::Domain => new.clone(),
            _ => vec![1; entry.data_type.bytes().unwrap_or(4)],
        };
        assert_eq!(client.download(entry.index, entry.sub, &bytes), locked, "{:x}h {}", entry.index, entry.sub);
    }
    assert_eq!(client.download(0x1010, 1, b"save"), locked);
    assert_eq!(client.download(0x2004, 2, &0.5_f32.to_le_bytes()), locked);
    assert_eq!(client.upload(0x2005, 1), Ok(old.clone()));
    assert_eq!((&drive.in_force, drive.compensation.gain_ratio), (&Some(old), 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_frames_are_answered(frames in prop::collection::vec(any::<[u8; 8]>(), 0..60), near in any::<bool>()) {
        let (mut server, mut drive) = bench(&[&block(1)]);
        let mut sdo = SdoServer::new();
        for mut frame in frames {
            if near {
                // Commands and indices that there are.
                frame[0] &= 0x7F;
                frame[1] %= 8;
                frame[2] = 0x20;
                frame[3] %= 4;
            }
            let answered = sdo.answer(&frame, &mut server, &mut drive).is_some();
            prop_assert_eq!(answered, frame[0] >> 5 != 4);
            prop_assert!((0.0..=1.0).contains(&drive.compensation.gain_ratio));
            prop_assert_eq!(drive.in_force.as_ref(), Some(&block(1)));
        }
    }
}
