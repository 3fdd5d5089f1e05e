//! The drive's end, whatever carries requests and answers: what is staged, on trial and in force, and the rules between them.

mod session;
mod stored;
mod trial;

use embedded_storage::nor_flash::NorFlash;

use super::drive::{CompensationSetting, Drive};
#[cfg(feature = "lock")]
use super::lock::{Key, Lock, PROOF_BYTES};
use super::message::{Answer, Asked, LinkDiagnostics, MOST_BYTES, Origin, Request, Status};
use super::rating::Bounds;
use super::refusal::{Refusal, Refused};
use crate::block::{BlockError, Header, Identity};
use crate::store::{Entry, Store, StoreError, copy_bytes};

/// How far parameters may be from those in force when they come on trial on an enabled drive: the largest difference of torques, elastic and hysteresis, as a share of the torque in force.
pub const DEFAULT_BOUND: f32 = 0.3;

/// A trial ends when no request has come for this long, ms.
pub const TRIAL_MS: u32 = 60_000;

/// A compensation that the end of a trial switches off has this long to fade, ms.
pub const FADE_MS: u32 = 1_000;

/// A session is its host's alone until the host has been silent for this long, ms.
pub const SESSION_MS: u32 = 2_000;

/// A session is over when its host has been silent for this long, ms: what was held back on the way is refused then.
pub const SESSION_END_MS: u32 = 60_000;

/// A block on its way.
#[derive(Debug, Clone, Copy)]
struct Staged {
    length: usize,
    /// As announced; `None` where the way announces none.
    crc: Option<u32>,
    received: usize,
}

#[derive(Debug, Clone, Copy)]
enum InForce {
    Nothing,
    Stored(Entry),
    /// The whole of the stage.
    Trial {
        header: Header,
        crc: u32,
    },
}

/// The state machine of a drive over a store, with room for blocks of `ROOM` bytes: a request in, an answer out.
///
/// [`Port`](super::Port) carries requests over a serial line, [`objects`](super::objects) over a bus with indices. Call [`boot`](Self::boot) once and
/// [`elapse`](Self::elapse) as time passes, all outside the control interrupt: storing a block takes as long as the flash takes to erase a slot.
#[derive(Debug)]
pub struct Server<F, const ROOM: usize> {
    store: Store<F>,
    stage: [u8; ROOM],
    staged: Option<Staged>,
    in_force: InForce,
    boot_error: u16,
    session: u32,
    /// The turn that comes next; `None` where no session is open.
    next_turn: Option<u32>,
    /// Since the last request; `None` where nobody tells the time.
    silent_ms: Option<u32>,
    /// Since the last request of the session.
    session_silent_ms: u32,
    /// When a trial whose host is gone gives way to the stored block.
    reverts_after_ms: u32,
    bound: f32,
    /// Of the stored block in force.
    bounds: Option<Bounds>,
    refused_requests: u32,
    expired_trials: u32,
    #[cfg(feature = "lock")]
    lock: Option<Lock>,
}

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    /// Nothing is in force yet. `nonce` should differ from one power-up to the next: it is what tells sessions apart.
    #[must_use]
    pub fn new(store: Store<F>, nonce: u32) -> Self {
        Self {
            store,
            stage: [0; ROOM],
            staged: None,
            in_force: InForce::Nothing,
            boot_error: 0,
            session: nonce,
            next_turn: None,
            silent_ms: None,
            session_silent_ms: 0,
            reverts_after_ms: TRIAL_MS,
            bound: DEFAULT_BOUND,
            bounds: None,
            refused_requests: 0,
            expired_trials: 0,
            #[cfg(feature = "lock")]
            lock: None,
        }
    }

    /// The same, open to hosts only that know a key. `entropy` must differ from one power-up to the next: random numbers, or a counter that is stored.
    #[cfg(feature = "lock")]
    #[must_use]
    pub fn with_lock(mut self, key: Key, entropy: [u8; PROOF_BYTES]) -> Self {
        self.set_lock(key, entropy);
        self
    }

    /// [`with_lock`](Self::with_lock) of a server in its place. Call it before the first request.
    #[cfg(feature = "lock")]
    pub fn set_lock(&mut self, key: Key, entropy: [u8; PROOF_BYTES]) {
        self.lock = Some(Lock::new(key, entropy));
    }

    /// Puts the newest stored block in force that can be loaded, and says which.
    pub fn boot(&mut self, drive: &mut impl Drive) -> Option<Entry> {
        self.adopt_stored(drive);
        match self.in_force {
            InForce::Stored(entry) => Some(entry),
            _ => None,
        }
    }

    /// Why the newest stored block could not be loaded at boot: [`BlockError::code`], or 0.
    #[must_use]
    pub fn boot_error(&self) -> u16 {
        self.boot_error
    }

    /// The store again.
    #[must_use]
    pub fn into_store(self) -> Store<F> {
        self.store
    }

    /// Answers a request of a session, or what was none. The answer to [`Request::Read`] lies in `bytes`. The counters of the line are for the line to fill in.
    #[must_use]
    pub fn answer<'b>(
        &mut self,
        asked: &Asked<'_>,
        drive: &mut impl Drive,
        bytes: &'b mut [u8; MOST_BYTES],
    ) -> Answer<'b> {
        let tag = asked.tag;
        self.hear(tag);
        let answer = asked.request.map_err(Refused::from).and_then(|request| {
            if request.changes() {
                self.check_proof(asked)?;
                self.admit(tag)?;
            }
            if request == Request::Identify {
                return Ok(Answer::Identified(self.identify(tag, drive)?));
            }
            self.execute(request, drive, bytes)
        });
        self.refused_requests = self.refused_requests.saturating_add(u32::from(answer.is_err()));
        answer.unwrap_or_else(Answer::Refused)
    }

    /// Does what a request asks for, without a session: [`Request::Identify`] has none to open here.
    pub(super) fn execute<'b>(
        &mut self,
        request: Request<'_>,
        drive: &mut impl Drive,
        bytes: &'b mut [u8; MOST_BYTES],
    ) -> Result<Answer<'b>, Refused> {
        match request {
            Request::Identify => return Err(Refusal::Command.into()),
            Request::Status => return Ok(Answer::Status(self.status(drive))),
            Request::Read { offset, length } => {
                let bytes = bytes.get_mut(..usize::from(length)).ok_or(Refusal::Payload)?;
                self.read(offset, bytes)?;
                return Ok(Answer::Bytes { offset, bytes });
            }
            Request::Live => return Ok(Answer::Live(drive.live())),
            Request::Stage { length, crc } => self.begin(length, Some(crc))?,
            Request::Data { offset, bytes } => self.take(offset, bytes)?,
            Request::Try => self.try_out(drive)?,
            Request::Revert => self.revert(drive)?,
            Request::Commit { signature, crc } => return self.commit(signature, crc, drive),
            Request::RollBack { signature, sequence } => return self.roll_back(signature, sequence, drive),
            Request::Compensate { on } => {
                if on && matches!(self.in_force, InForce::Nothing) {
                    return Err(Refusal::NoParameters.into());
                }
                drive.set_compensation(CompensationSetting { on, ..drive.compensation() });
            }
            Request::Gain { ratio } => {
                if !(0.0..=1.0).contains(&ratio) {
                    return Err(Refusal::Value.into());
                }
                drive.set_compensation(CompensationSetting { gain_ratio: ratio, ..drive.compensation() });
            }
            Request::Close => self.next_turn = None,
            Request::Adaptation => return Ok(Answer::Adaptation(drive.adaptation().ok_or(Refusal::NoAdaptation)?)),
            Request::Diagnostics => return Ok(Answer::Diagnostics(self.diagnostics(drive))),
            Request::ClearDiagnostics => {
                (self.refused_requests, self.expired_trials) = (0, 0);
                drive.clear_diagnostics();
            }
            Request::EraseUnreadable { signature } => self.erase_unreadable(signature, drive)?,
            Request::Bound { share } => {
                if drive.is_enabled() {
                    return Err(Refusal::Enabled.into());
                }
                // A NaN compares false.
                if share >= 0.0 {
                    self.bound = share;
                } else {
                    return Err(Refusal::Value.into());
                }
            }
        }
        Ok(Answer::Done)
    }

    /// What went wrong so far, that of the line apart.
    pub(super) fn diagnostics(&self, drive: &impl Drive) -> LinkDiagnostics {
        LinkDiagnostics {
            joint: drive.diagnostics(),
            refused_requests: self.refused_requests,
            expired_trials: self.expired_trials,
            bound: self.bound,
            ..LinkDiagnostics::default()
        }
    }

    pub(super) fn status(&mut self, drive: &impl Drive) -> Status {
        let (origin, header, crc) = match self.in_force {
            InForce::Nothing => (Origin::Nowhere, None, 0),
            InForce::Stored(entry) => (Origin::Stored, Some(entry.header), entry.crc),
            InForce::Trial { header, crc } => (Origin::Trial, Some(header), crc),
        };
        let compensation = drive.compensation();
        Status {
            origin,
            sequence: header.map_or(0, |header| header.sequence),
            crc,
            length: header.map_or(0, |header| header.length),
            stored_sequence: self.stored_sequence(),
            boot_error: self.boot_error,
            enabled: drive.is_enabled(),
            compensating: compensation.on,
            gain_ratio: compensation.gain_ratio,
        }
    }

    pub(super) fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refusal> {
        let end = (offset as usize).checked_add(bytes.len()).ok_or(Refusal::Offset)?;
        match self.in_force {
            InForce::Nothing => Err(Refusal::NoParameters),
            InForce::Stored(entry) if end <= entry.header.length as usize => {
                self.store.read(&entry, offset, bytes).map_err(refusal)
            }
            InForce::Trial { header, .. } if end <= header.length as usize => {
                copy_bytes(bytes, self.stage.get(offset as usize..end).ok_or(Refusal::Offset)?);
                Ok(())
            }
            _ => Err(Refusal::Offset),
        }
    }

    fn stored_sequence(&mut self) -> u32 {
        self.store.newest().map_or(0, |entry| entry.header.sequence)
    }

    /// The gear whose blocks are accepted; none accepts any.
    pub(super) fn gear(&mut self, drive: &impl Drive) -> Identity {
        match drive.gear() {
            Identity::NONE => self.store.newest().map_or(Identity::NONE, |entry| entry.header.identity),
            gear => gear,
        }
    }

    pub(super) fn room(&self) -> usize {
        ROOM.min(self.store.room() as usize)
    }
}

fn refused_block(error: BlockError) -> Refused {
    Refused { refusal: Refusal::Block, detail: error.code() }
}

fn refusal<E>(error: StoreError<E>) -> Refusal {
    match error {
        StoreError::Flash(_) => Refusal::Flash,
        StoreError::NotNewer { .. } => Refusal::Sequence,
        StoreError::TooLong { .. } => Refusal::Room,
        StoreError::ReadBack => Refusal::ReadBack,
        StoreError::NothingBefore => Refusal::NothingBefore,
        StoreError::Unreadable { .. } => Refusal::Unreadable,
    }
}
