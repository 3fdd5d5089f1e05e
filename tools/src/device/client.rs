//! One request, one answer.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use gmhm::link::lock::{Key, PROOF_BYTES};
use gmhm::link::{Adapted, Answer, Frame, Identified, LinkDiagnostics, Live, Receiver, Refusal, Request, Status, Tag};

use super::error::DeviceError;
use super::line::Line;

/// How long a drive may take to answer, and to store a block.
const ANSWERING: Duration = Duration::from_secs(3);
const STORING: Duration = Duration::from_secs(10);
/// Between two attempts to open a session.
const BETWEEN_ATTEMPTS: Duration = Duration::from_millis(250);

/// A drive at the other end of a line.
pub struct Client {
    line: Box<dyn Line>,
    receiver: Receiver,
    session: u32,
    turn: u32,
    key: Option<Key>,
    /// Of the session, where the drive has a key.
    challenge: Option<[u8; PROOF_BYTES]>,
    /// Tells the answers to questions apart.
    questions: u32,
}

/// The body of an answer.
struct Reply(Vec<u8>);

impl Drop for Client {
    /// Leaves the drive to the next host, which else would have to wait until this session is forgotten. The answer is of no use.
    fn drop(&mut self) {
        if self.session != 0 {
            let frame = self.frame(&Request::Close, Tag { session: self.session, turn: self.turn });
            let _ = self.line.write_all(&frame).and_then(|()| self.line.flush());
        }
    }
}

impl Client {
    /// A drive that has not been asked anything.
    pub fn new(line: Box<dyn Line>) -> Self {
        Self { line, receiver: Receiver::new(), session: 0, turn: 0, key: None, challenge: None, questions: 0 }
    }

    /// The same, which proves with every request that changes something that it knows the drive's key.
    #[must_use]
    pub fn with_key(mut self, key: Option<Key>) -> Self {
        self.key = key;
        self
    }

    /// Asks who the drive is, and opens a session with it.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn identify(&mut self) -> Result<Identified, DeviceError> {
        let asked = Instant::now();
        loop {
            match self.open() {
                // Another host's session ends when that has been silent for a while.
                Err(DeviceError::Refused { refused, .. })
                    if refused.refusal == Refusal::Busy && asked.elapsed() < ANSWERING =>
                {
                    std::thread::sleep(BETWEEN_ATTEMPTS);
                }
                answer => return answer,
            }
        }
    }

    fn open(&mut self) -> Result<Identified, DeviceError> {
        match self.ask(&Request::Identify)?.answer() {
            Answer::Identified(identified) => {
                (self.session, self.turn, self.challenge) = (identified.session, 0, identified.challenge);
                Ok(identified)
            }
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Asks what is in force.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn status(&mut self) -> Result<Status, DeviceError> {
        match self.ask(&Request::Status)?.answer() {
            Answer::Status(status) => Ok(status),
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Asks what the drive measures.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn live(&mut self) -> Result<Live, DeviceError> {
        match self.ask(&Request::Live)?.answer() {
            Answer::Live(live) => Ok(live),
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Asks what its adaptation has learnt.
    ///
    /// # Errors
    /// [`DeviceError`]; a drive without adaptation refuses.
    pub fn adaptation(&mut self) -> Result<Adapted, DeviceError> {
        match self.ask(&Request::Adaptation)?.answer() {
            Answer::Adaptation(adapted) => Ok(adapted),
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Asks what has gone wrong so far.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn diagnostics(&mut self) -> Result<LinkDiagnostics, DeviceError> {
        match self.ask(&Request::Diagnostics)?.answer() {
            Answer::Diagnostics(diagnostics) => Ok(diagnostics),
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Reads bytes of the block in force, at most [`MOST_BYTES`](gmhm::link::message::MOST_BYTES).
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn read(&mut self, offset: u32, length: u8) -> Result<Vec<u8>, DeviceError> {
        match self.ask(&Request::Read { offset, length })?.answer() {
            Answer::Bytes { offset: at, bytes } if at == offset && bytes.len() == usize::from(length) => {
                Ok(bytes.to_vec())
            }
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// Has something done: a request that changes something.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn tell(&mut self, request: &Request<'_>) -> Result<(), DeviceError> {
        self.ask(request).map(drop)
    }

    /// [`tell`](Self::tell) in a session of its own.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn change(&mut self, request: &Request<'_>) -> Result<(), DeviceError> {
        self.identify()?;
        self.tell(request)
    }

    /// Has a block stored or erased: the sequence number and the CRC-32 of the newest stored block from then on.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn store(&mut self, request: &Request<'_>) -> Result<(u32, u32), DeviceError> {
        match self.ask(request)?.answer() {
            Answer::Stored { sequence, crc } => Ok((sequence, crc)),
            _ => Err(DeviceError::NotUnderstood),
        }
    }

    /// The frame of a request, with a proof where the drive asks for one and the key is known.
    fn frame(&self, request: &Request<'_>, tag: Tag) -> Frame {
        match (&self.key, &self.challenge) {
            (Some(key), Some(challenge)) if request.changes() => request.encode_proven(tag, key, challenge),
            _ => request.encode(tag),
        }
    }

    fn ask(&mut self, request: &Request<'_>) -> Result<Reply, DeviceError> {
        let tag = if request.changes() {
            let tag = Tag { session: self.session, turn: self.turn };
            self.turn += 1;
            tag
        } else {
            self.questions = self.questions.wrapping_add(1);
            Tag { session: self.session, turn: self.questions }
        };
        let frame = self.frame(request, tag);
        self.line.write_all(&frame)?;
        self.line.flush()?;
        let stores =
            matches!(request, Request::Commit { .. } | Request::RollBack { .. } | Request::EraseUnreadable { .. });
        let patience = if stores { STORING } else { ANSWERING };
        let asked = Instant::now();
        let mut buffer = [0; 256];
        while asked.elapsed() < patience {
            let count = match self.line.read(&mut buffer) {
                Ok(0) => return Err(DeviceError::Closed),
                Ok(count) => count,
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => continue,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(error.into()),
            };
            // The host speaks when it is answered: nothing useful follows the answer.
            for byte in buffer.iter().take(count) {
                let Some(body) = self.receiver.feed(*byte) else { continue };
                match Answer::decode(body) {
                    Some((command, echoed, answer)) if command == request.command() && echoed == tag => {
                        return match answer {
                            Answer::Refused(refused) => Err(DeviceError::Refused { command, refused }),
                            _ => Ok(Reply(body.to_vec())),
                        };
                    }
                    // Late answers to what was given up.
                    _ => {}
                }
            }
        }
        Err(DeviceError::Silent(patience.as_secs()))
    }
}

impl Reply {
    fn answer(&self) -> Answer<'_> {
        // It was decoded once.
        Answer::decode(&self.0).map_or(Answer::Done, |(_, _, answer)| answer)
    }
}
