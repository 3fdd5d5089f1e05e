//! Whatever comes over the line: bytes of nobody, and requests with any fields, in their turn and out of it.
#![no_main]

use gmhm::block::{Block, BlockError, HEADER_BYTES, Header, Identity, ScalarKind, verify, crc32};
use gmhm::link::{Answer, CompensationSetting, Drive, Live, Port, Receiver, Request, Tag};
use gmhm::store::{RamFlash, Store};
use libfuzzer_sys::fuzz_target;

const SLOT: usize = 128;

/// A drive that keeps the bytes of its block.
#[derive(Clone, PartialEq, Default)]
struct Joint {
    block: Vec<u8>,
    enabled: bool,
    compensation: CompensationSetting,
}

impl Drive for Joint {
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, 16)
    }
    fn is_enabled(&self) -> bool {
        self.enabled
    }
    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        self.block = block.map_or(Vec::new(), |block| block.bytes().to_vec());
        Ok(())
    }
    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }
    fn set_compensation(&mut self, compensation: CompensationSetting) {
        assert!((0.0..=1.0).contains(&compensation.gain_ratio));
        self.compensation = compensation;
    }
    fn live(&self) -> Live {
        Live::default()
    }
}

/// The shortest block of a sequence number.
fn block(sequence: u32) -> [u8; HEADER_BYTES + 4] {
    let length = HEADER_BYTES as u32 + 4;
    let header = Header { length, sequence, ..Header::new(Identity::NONE, ScalarKind::F32) };
    let mut bytes = [0; HEADER_BYTES + 4];
    bytes[..HEADER_BYTES].copy_from_slice(&header.encode());
    let crc = crc32(&bytes[..HEADER_BYTES]);
    bytes[HEADER_BYTES..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Hands out the input piece by piece.
struct Input<'a>(&'a [u8]);

impl<'a> Input<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn word(&mut self) -> u32 {
        let bytes = [(); 4].map(|()| self.byte().unwrap_or(0));
        u32::from_le_bytes(bytes)
    }

    fn bytes(&mut self) -> &'a [u8] {
        let length = usize::from(self.byte().unwrap_or(0)).min(self.0.len());
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        bytes
    }

    /// A request; small numbers, the right words and the right block are likely.
    fn request(&mut self, choice: u8, next: &'a [u8]) -> Request<'a> {
        let crc = u32::from_le_bytes([next[48], next[49], next[50], next[51]]);
        match choice % 18 {
            0 => Request::Identify,
            1 => Request::Status,
            2 => Request::Read { offset: self.word(), length: self.byte().unwrap_or(0) },
            3 => Request::Live,
            4 => Request::Stage { length: self.word(), crc: self.word() },
            5 => Request::Data { offset: self.word(), bytes: self.bytes() },
            6 => Request::Try,
            7 => Request::Revert,
            8 => Request::Commit { signature: self.word(), crc: self.word() },
            9 => Request::RollBack { signature: self.word(), sequence: self.word() },
            10 => Request::Compensate { on: self.byte().unwrap_or(0) & 1 == 1 },
            11 => Request::Gain { ratio: f32::from_bits(self.word()) },
            12 => Request::Stage { length: next.len() as u32, crc },
            13 => Request::Data { offset: 0, bytes: next },
            14 => Request::Commit { signature: gmhm::link::message::SAVE, crc },
            15 => Request::Close,
            16 => Request::Adaptation,
            _ => Request::RollBack { signature: gmhm::link::message::LOAD, sequence: u32::from(self.byte().unwrap_or(0)) },
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let mut memory = [0xFF; 2 * SLOT];
    let first = block(1);
    memory[..first.len()].copy_from_slice(&first);
    let store = Store::new(RamFlash::<4, 64>::new(&mut memory), 0..SLOT as u32, SLOT as u32..2 * SLOT as u32);
    let mut port = Port::<_, SLOT>::new(store.expect("two slots"), 7);
    let mut joint = Joint::default();
    port.boot(&mut joint);
    assert_eq!(joint.block, first);

    let mut tag = Tag::default();
    let mut stray = Receiver::new();
    let mut input = Input(data);
    while let Some(choice) = input.byte() {
        let before = joint.clone();
        // A new block each time, so that a second commit is possible.
        let next = block(2 + (choice >> 6) as u32);
        let mut may_change = false;
        if choice & 0x30 == 0 {
            let bytes = input.bytes();
            // The fuzzer may come to know the CRC-32: what it then asks for in its turn is asked for.
            for byte in bytes {
                if let Some((_, asked, Ok(request))) = stray.feed(*byte).and_then(Request::decode) {
                    may_change |= request.changes() && asked.session == tag.session || request == Request::Identify;
                }
            }
            port.receive(bytes, &mut joint, |frame| check(frame, &mut tag));
        } else {
            let asked = match choice & 0x30 {
                0x10 => Tag { session: input.word(), turn: input.word() },
                _ => tag,
            };
            let request = Input(input.0).request(choice, &next);
            let frame = request.encode(asked);
            input.0 = input.0.get(6..).unwrap_or(&[]);
            may_change |= asked == tag;
            tag.turn += u32::from(asked == tag && request.changes());
            stray = Receiver::new();
            port.receive(&frame, &mut joint, |frame| check(frame, &mut tag));
        }
        assert!(may_change || joint == before, "changed out of turn");
        assert!(joint.block.is_empty() || verify(&joint.block).is_ok());
        joint.enabled = choice == 0xFF;
    }

    // Whatever was asked, boot finds a whole block.
    let mut store = port.into_store();
    let entry = store.newest().expect("a block");
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(&entry, 0, &mut bytes).expect("it reads");
    assert!(verify(&bytes).is_ok());
});

/// Every answer is one, and a new session begins with its own number.
fn check(frame: &[u8], tag: &mut Tag) {
    let mut receiver = Receiver::new();
    let mut bodies = 0;
    for byte in frame {
        if let Some((_, _, answer)) = receiver.feed(*byte).map(|body| Answer::decode(body).expect("an answer")) {
            bodies += 1;
            if let Answer::Identified(it) = answer {
                *tag = Tag { session: it.session, turn: 0 };
            }
        }
    }
    assert_eq!(bodies, 1);
}
