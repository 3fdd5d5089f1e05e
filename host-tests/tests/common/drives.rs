//! A drive that remembers what it is told, and a host that talks to it.

use gmhm::block::{Block, BlockError, Identity, ScalarKind, verify};
use gmhm::diagnostics::Diagnostics;
use gmhm::link::frame::Receiver;
use gmhm::link::{Adapted, Answer, CompensationSetting, Drive, Identified, Live, Port, Refused, Request, Tag};
use gmhm::store::Store;
use gmhm_host_tests::flash::HostileFlash;

/// The flash of all these drives: two slots of two sectors.
pub type Flash = HostileFlash<4, 256>;

/// Bytes of a slot.
pub const SLOT: u32 = 512;

/// A port over it.
pub type Bench = Port<Flash, 448>;

/// What a drive has been told.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Told {
    /// The bytes of the block in force.
    pub in_force: Option<Vec<u8>>,
    pub enabled: bool,
    pub compensation: CompensationSetting,
    pub gear: Identity,
    /// Blocks of this sequence number are refused.
    pub dislikes: Option<u32>,
    pub diagnostics: Diagnostics,
    pub adaptation: Option<Adapted>,
}

impl Drive for Told {
    fn gear(&self) -> Identity {
        self.gear
    }

    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, 16)
    }

    fn is_enabled(&self) -> bool {
        self.enabled
    }

    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        if let Some(block) = block
            && self.dislikes == Some(block.header().sequence)
        {
            return Err(BlockError::StackDepth(block.header().stack_depth));
        }
        self.in_force = block.map(|block| block.bytes().to_vec());
        Ok(())
    }

    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }

    fn set_compensation(&mut self, compensation: CompensationSetting) {
        self.compensation = compensation;
    }

    fn live(&self) -> Live {
        Live { deflection_rad: 1e-3, torque_nm: 25.0, ticks: 7, ..Live::default() }
    }

    fn adaptation(&self) -> Option<Adapted> {
        self.adaptation
    }

    fn diagnostics(&self) -> Diagnostics {
        self.diagnostics
    }

    fn clear_diagnostics(&mut self) {
        self.diagnostics.clear();
    }
}

/// The store in a flash.
pub fn store(flash: Flash) -> Store<Flash> {
    Store::new(flash, 0..SLOT, SLOT..2 * SLOT).expect("two slots")
}

/// An empty flash.
pub fn blank() -> Flash {
    Flash::new(4, true, 0)
}

/// A port over a flash that holds these blocks, and its drive.
pub fn bench(blocks: &[&[u8]]) -> (Bench, Told) {
    let mut store = store(blank());
    for block in blocks {
        store.write(&verify(block).expect("a block")).expect("room");
    }
    power_up(store.into_flash(), Told::default())
}

/// A drive that boots from a flash.
pub fn power_up(flash: Flash, mut drive: Told) -> (Bench, Told) {
    let mut port = Bench::new(store(flash), 42);
    drive.in_force = None;
    port.boot(&mut drive);
    (port, drive)
}

/// The bytes of the newest stored block.
pub fn stored(flash: &Flash) -> Option<Vec<u8>> {
    let mut store = store(flash.clone());
    let entry = store.newest()?;
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(&entry, 0, &mut bytes).expect("it reads");
    Some(bytes)
}

/// Whatever the port answers to these bytes.
pub fn answers(port: &mut Bench, drive: &mut Told, bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut bodies = Vec::new();
    port.receive(bytes, drive, |frame| {
        let mut receiver = Receiver::new();
        bodies.extend(frame.iter().filter_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).collect::<Vec<_>>());
    });
    bodies
}

/// One request and its answer, the bytes of `Answer::Bytes` apart.
pub fn ask(
    port: &mut Bench,
    drive: &mut Told,
    request: Request<'_>,
    tag: Tag,
) -> Result<(Answer<'static>, Vec<u8>), Refused> {
    let bodies = answers(port, drive, &request.encode(tag));
    let [body] = bodies.as_slice() else { panic!("{} answers to {request:?}", bodies.len()) };
    let (command, echoed, answer) = Answer::decode(body).expect("an answer");
    assert_eq!((command, echoed), (request.command(), tag));
    match answer {
        Answer::Refused(refused) => Err(refused),
        Answer::Bytes { offset, bytes } => Ok((Answer::Bytes { offset, bytes: &[] }, bytes.to_vec())),
        Answer::Identified(it) => Ok((Answer::Identified(it), Vec::new())),
        Answer::Status(it) => Ok((Answer::Status(it), Vec::new())),
        Answer::Live(it) => Ok((Answer::Live(it), Vec::new())),
        Answer::Diagnostics(it) => Ok((Answer::Diagnostics(it), Vec::new())),
        Answer::Stored { sequence, crc } => Ok((Answer::Stored { sequence, crc }, Vec::new())),
        Answer::Adaptation(it) => Ok((Answer::Adaptation(it), Vec::new())),
        Answer::Done => Ok((Answer::Done, Vec::new())),
    }
}

/// Opens a session.
pub fn identify(port: &mut Bench, drive: &mut Told) -> Identified {
    match ask(port, drive, Request::Identify, Tag::default()) {
        Ok((Answer::Identified(it), _)) => it,
        other => panic!("{other:?}"),
    }
}

/// A session: its number and the next turn.
pub struct Session {
    pub tag: Tag,
}

impl Session {
    pub fn open(port: &mut Bench, drive: &mut Told) -> Self {
        Self { tag: Tag { session: identify(port, drive).session, turn: 0 } }
    }

    /// A request in its turn.
    pub fn ask(
        &mut self,
        port: &mut Bench,
        drive: &mut Told,
        request: Request<'_>,
    ) -> Result<Answer<'static>, Refused> {
        let answer = ask(port, drive, request, self.tag).map(|(answer, _)| answer);
        self.tag.turn += u32::from(request.changes());
        answer
    }

    /// Stages a block.
    pub fn stage(&mut self, port: &mut Bench, drive: &mut Told, block: &[u8]) -> Result<(), Refused> {
        for request in staging(block) {
            self.ask(port, drive, request)?;
        }
        Ok(())
    }
}

/// The requests that carry a block.
pub fn staging(block: &[u8]) -> Vec<Request<'_>> {
    let data = block.chunks(96).enumerate().map(|(k, bytes)| Request::Data { offset: 96 * k as u32, bytes });
    [Request::Stage { length: block.len() as u32, crc: crc(block) }].into_iter().chain(data).collect()
}

/// A block's CRC-32.
pub fn crc(block: &[u8]) -> u32 {
    verify(block).expect("a block").crc()
}
