//! The drive's end, whatever carries requests and answers: what is staged, on trial and in force, and the rules between them.

use embedded_storage::nor_flash::NorFlash;

use super::drive::{CompensationSetting, Drive};
#[cfg(feature = "lock")]
use super::lock::Key;
use super::message::{
    Answer, Asked, ERASE, Identified, LOAD, LinkDiagnostics, MOST_BYTES, Origin, PROOF_BYTES, Request, SAVE, Status,
    Tag,
};
use super::rating::Bounds;
use super::refusal::{Refusal, Refused};
use crate::block::{BlockError, FORMAT_VERSION, Header, Identity, check_set_up, verify};
use crate::store::{Entry, Store, StoreError, copy_bytes, is_newer};

/// How far parameters may be from those in force when they come on trial on an enabled drive: the largest difference of torques, elastic and hysteresis, as a share of the torque in force.
pub const DEFAULT_BOUND: f32 = 0.3;

/// A trial ends when no request has come for this long, ms.
pub const TRIAL_MS: u32 = 60_000;

/// A compensation that the end of a trial switches off has this long to fade, ms.
pub const FADE_MS: u32 = 1_000;

/// A session is its host's alone until the host has been silent for this long, ms.
pub const SESSION_MS: u32 = 2_000;

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

/// The key, and what makes the challenges of this power-up.
#[cfg(feature = "lock")]
#[derive(Debug, Clone, Copy)]
struct Lock {
    key: Key,
    entropy: [u8; PROOF_BYTES],
}

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    /// Nothing is in force yet. `nonce` should differ from one power-up to the next: it is what tells sessions apart.
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
    pub fn with_lock(self, key: Key, entropy: [u8; PROOF_BYTES]) -> Self {
        Self { lock: Some(Lock { key, entropy }), ..self }
    }

    /// The challenge of the session; `None` without a lock.
    #[cfg(feature = "lock")]
    fn challenge(&self) -> Option<[u8; PROOF_BYTES]> {
        self.lock.map(|lock| lock.key.challenge(&lock.entropy, self.session))
    }

    #[cfg(not(feature = "lock"))]
    fn challenge(&self) -> Option<[u8; PROOF_BYTES]> {
        None
    }

    /// Whether a request that changes something comes from a host that knows the key. One that does not takes no turn.
    #[cfg(feature = "lock")]
    fn check_proof(&self, asked: &Asked<'_>) -> Result<(), Refusal> {
        let Some((lock, challenge)) = self.lock.zip(self.challenge()) else { return Ok(()) };
        let is_proven = asked.proof.is_some_and(|(body, proof)| lock.key.proves(&challenge, body, proof));
        // Before a session was opened, its challenge is not known to anyone.
        if is_proven && self.next_turn.is_some() { Ok(()) } else { Err(Refusal::Locked) }
    }

    #[cfg(not(feature = "lock"))]
    fn check_proof(&self, _: &Asked<'_>) -> Result<(), Refusal> {
        Ok(())
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
    pub fn boot_error(&self) -> u16 {
        self.boot_error
    }

    /// The store again.
    pub fn into_store(self) -> Store<F> {
        self.store
    }

    /// Answers a request of a session, or what was none. The answer to [`Request::Read`] lies in `bytes`. The counters of the line are for the line to fill in.
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

    fn erase_unreadable(&mut self, signature: u32, drive: &impl Drive) -> Result<(), Refusal> {
        if signature != ERASE {
            return Err(Refusal::Signature);
        }
        if drive.is_enabled() {
            return Err(Refusal::Enabled);
        }
        self.store.erase_unreadable().map_err(refusal)
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

    /// A transfer over a bus came.
    pub(super) fn hear_bus(&mut self) {
        self.silent_ms = self.silent_ms.map(|_| 0);
        self.reverts_after_ms = TRIAL_MS;
    }

    /// Whether a bus may change anything: not while a host of the serial link has a session open.
    pub(super) fn admit_bus(&mut self) -> Result<(), Refusal> {
        self.hear_bus();
        // A bus carries no proofs.
        if self.challenge().is_some() {
            return Err(Refusal::Locked);
        }
        if self.next_turn.is_some() && self.is_held() { Err(Refusal::Busy) } else { Ok(()) }
    }

    /// Whether the host of the session was heard a short while ago.
    fn is_held(&self) -> bool {
        self.silent_ms.is_some() && self.session_silent_ms < SESSION_MS
    }

    /// A request came.
    fn hear(&mut self, tag: Tag) {
        self.hear_bus();
        if self.next_turn.is_some() && tag.session == self.session {
            self.session_silent_ms = 0;
        }
    }

    /// Says that time has passed; call it some times a second. Without it no trial ends by itself, and any host may open a session at any time.
    ///
    /// A trial whose host is gone ([`TRIAL_MS`] without a request) ends: the compensation is switched off where it is on, and [`FADE_MS`] later the stored block is
    /// in force again.
    pub fn elapse(&mut self, ms: u32, drive: &mut impl Drive) {
        let silent_ms = self.silent_ms.unwrap_or(0).saturating_add(ms);
        self.silent_ms = Some(silent_ms);
        self.session_silent_ms = self.session_silent_ms.saturating_add(ms);
        if !self.is_on_trial() || silent_ms < self.reverts_after_ms {
            return;
        }
        let compensation = drive.compensation();
        if compensation.on {
            drive.set_compensation(CompensationSetting { on: false, ..compensation });
            self.reverts_after_ms = silent_ms.saturating_add(FADE_MS);
            return;
        }
        self.expired_trials = self.expired_trials.saturating_add(1);
        self.adopt_stored(drive);
    }

    /// Whether a request that changes something is the session's next. Its turn is taken, whatever becomes of it.
    fn admit(&mut self, tag: Tag) -> Result<(), Refusal> {
        let next = self.next_turn.filter(|_| tag.session == self.session).ok_or(Refusal::Session)?;
        if tag.turn != next {
            return Err(Refusal::Order);
        }
        self.next_turn = next.checked_add(1);
        Ok(())
    }

    fn identify(&mut self, tag: Tag, drive: &impl Drive) -> Result<Identified, Refusal> {
        if self.next_turn.is_some() && tag.session != self.session && self.is_held() {
            return Err(Refusal::Busy);
        }
        self.session_silent_ms = 0;
        // A walk through all 2³² numbers: none comes twice while the drive is powered.
        self.session = self.session.wrapping_mul(0x0019_660D).wrapping_add(0x3C6E_F35F);
        self.next_turn = Some(0);
        if !self.is_on_trial() {
            self.staged = None;
        }
        let (scalar, stack_depth) = drive.arithmetic();
        Ok(Identified {
            session: self.session,
            gear: self.gear(drive),
            room: self.room() as u32,
            format_version: FORMAT_VERSION,
            scalar,
            stack_depth,
            challenge: self.challenge(),
        })
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

    pub(super) fn begin(&mut self, length: u32, crc: Option<u32>) -> Result<(), Refusal> {
        if self.is_on_trial() {
            return Err(Refusal::OnTrial);
        }
        let length = length as usize;
        if length > self.room() {
            return Err(Refusal::Room);
        }
        self.staged = Some(Staged { length, crc, received: 0 });
        Ok(())
    }

    pub(super) fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        if self.is_on_trial() {
            return Err(Refusal::OnTrial);
        }
        let staged = self.staged.as_mut().ok_or(Refusal::Incomplete)?;
        let end = staged.received.saturating_add(bytes.len());
        if offset as usize != staged.received || end > staged.length {
            return Err(Refusal::Offset);
        }
        copy_bytes(self.stage.get_mut(staged.received..end).ok_or(Refusal::Offset)?, bytes);
        staged.received = end;
        Ok(())
    }

    fn try_out(&mut self, drive: &mut impl Drive) -> Result<(), Refused> {
        if self.is_on_trial() {
            return Err(Refusal::OnTrial.into());
        }
        if drive.compensation().on {
            return Err(Refusal::Compensating.into());
        }
        let staged = self.staged.filter(|staged| staged.received == staged.length).ok_or(Refusal::Incomplete)?;
        let (newest, gear) = (self.stored_sequence(), self.gear(drive));
        let block = self.stage.get(..staged.length).ok_or(Refusal::Incomplete)?;
        let block = verify(block).map_err(refused_block)?;
        if staged.crc.is_some_and(|announced| announced != block.crc()) {
            return Err(Refusal::Checksum.into());
        }
        if gear != Identity::NONE && block.header().identity != gear {
            return Err(Refusal::Gear.into());
        }
        if !is_newer(block.header().sequence, newest) {
            return Err(Refusal::Sequence.into());
        }
        if drive.is_enabled()
            && let Some(bounds) = &self.bounds
            && !bounds.allow(&block, self.bound)
        {
            return Err(Refusal::Bound.into());
        }
        check_set_up(&block).and_then(|()| drive.adopt(Some(&block))).map_err(refused_block)?;
        self.in_force = InForce::Trial { header: *block.header(), crc: block.crc() };
        Ok(())
    }

    fn revert(&mut self, drive: &mut impl Drive) -> Result<(), Refusal> {
        if !self.is_on_trial() {
            return Err(Refusal::NotOnTrial);
        }
        if drive.compensation().on {
            return Err(Refusal::Compensating);
        }
        self.adopt_stored(drive);
        Ok(())
    }

    fn commit<'b>(&mut self, signature: u32, crc: u32, drive: &impl Drive) -> Result<Answer<'b>, Refused> {
        if signature != SAVE {
            return Err(Refusal::Signature.into());
        }
        if drive.is_enabled() {
            return Err(Refusal::Enabled.into());
        }
        let InForce::Trial { header, crc: on_trial } = self.in_force else {
            return Err(Refusal::NotOnTrial.into());
        };
        if crc != on_trial {
            return Err(Refusal::Checksum.into());
        }
        let bytes = self.stage.get(..header.length as usize).ok_or(Refusal::Incomplete)?;
        let block = verify(bytes).map_err(refused_block)?;
        let entry = self.store.write(&block).map_err(refusal)?;
        // Boot must find it, too.
        if self.store.newest() != Some(entry) {
            return Err(Refusal::ReadBack.into());
        }
        self.bounds = Some(Bounds::of(&block));
        self.in_force = InForce::Stored(entry);
        self.staged = None;
        self.boot_error = 0;
        Ok(Answer::Stored { sequence: entry.header.sequence, crc: entry.crc })
    }

    fn roll_back<'b>(&mut self, signature: u32, sequence: u32, drive: &mut impl Drive) -> Result<Answer<'b>, Refused> {
        if signature != LOAD {
            return Err(Refusal::Signature.into());
        }
        if drive.is_enabled() {
            return Err(Refusal::Enabled.into());
        }
        if drive.compensation().on {
            return Err(Refusal::Compensating.into());
        }
        if self.is_on_trial() {
            return Err(Refusal::OnTrial.into());
        }
        let [Some(newest), Some(before)] = self.store.entries() else { return Err(Refusal::NothingBefore.into()) };
        if newest.header.sequence != sequence {
            return Err(Refusal::Sequence.into());
        }
        self.staged = None;
        self.adopt_entry(&before, drive)?;
        let rolled_back = self.store.roll_back();
        // Whatever has become of the flash, what it holds is in force.
        self.adopt_stored(drive);
        let entry = rolled_back.map_err(refusal)?;
        Ok(Answer::Stored { sequence: entry.header.sequence, crc: entry.crc })
    }

    /// Puts the newest stored block in force that can be loaded, or none.
    fn adopt_stored(&mut self, drive: &mut impl Drive) {
        self.staged = None;
        self.boot_error = 0;
        self.in_force = InForce::Nothing;
        self.bounds = None;
        for entry in self.store.entries().into_iter().flatten() {
            match self.adopt_entry(&entry, drive) {
                Ok(()) => {
                    self.store.keep(Some(entry));
                    self.in_force = InForce::Stored(entry);
                    return;
                }
                Err(refused) if self.boot_error == 0 => self.boot_error = refused.detail,
                Err(_) => {}
            }
        }
        // Nothing is always accepted.
        let _ = drive.adopt(None);
    }

    fn adopt_entry(&mut self, entry: &Entry, drive: &mut impl Drive) -> Result<(), Refused> {
        let bytes = self.stage.get_mut(..entry.header.length as usize).ok_or(refused_block(BlockError::NoRoom))?;
        self.store.read_whole(entry, bytes).map_err(refusal)?;
        let block = verify(bytes).map_err(refused_block)?;
        check_set_up(&block).and_then(|()| drive.adopt(Some(&block))).map_err(refused_block)?;
        self.bounds = Some(Bounds::of(&block));
        Ok(())
    }

    fn is_on_trial(&self) -> bool {
        matches!(self.in_force, InForce::Trial { .. })
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
