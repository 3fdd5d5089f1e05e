//! Whose requests a drive takes: sessions, turns, proofs.

use embedded_storage::nor_flash::NorFlash;

use super::super::drive::Drive;
use super::super::message::{Asked, Identified, PROOF_BYTES, Tag};
use super::super::refusal::Refusal;
use super::{SESSION_MS, Server, TRIAL_MS};
use crate::block::FORMAT_VERSION;

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    /// The challenge of the session; `None` without a lock.
    #[cfg(feature = "lock")]
    pub(super) fn challenge(&self) -> Option<[u8; PROOF_BYTES]> {
        self.lock.map(|lock| lock.challenge(self.session))
    }

    #[cfg(not(feature = "lock"))]
    pub(super) fn challenge(&self) -> Option<[u8; PROOF_BYTES]> {
        None
    }

    /// Whether a request that changes something comes from a host that knows the key. One that does not takes no turn.
    #[cfg(feature = "lock")]
    pub(super) fn check_proof(&self, asked: &Asked<'_>) -> Result<(), Refusal> {
        let Some((lock, challenge)) = self.lock.zip(self.challenge()) else { return Ok(()) };
        let is_proven = asked.proof.is_some_and(|(body, proof)| lock.proves(&challenge, body, proof));
        // Before a session was opened, its challenge is not known to anyone.
        if is_proven && self.next_turn.is_some() { Ok(()) } else { Err(Refusal::Locked) }
    }

    #[cfg(not(feature = "lock"))]
    pub(super) fn check_proof(&self, _: &Asked<'_>) -> Result<(), Refusal> {
        Ok(())
    }

    /// A transfer over a bus came.
    pub(in crate::link) fn hear_bus(&mut self) {
        self.silent_ms = self.silent_ms.map(|_| 0);
        self.reverts_after_ms = TRIAL_MS;
    }

    /// Whether a bus may change anything: not while a host of the serial link has a session open.
    pub(in crate::link) fn admit_bus(&mut self) -> Result<(), Refusal> {
        self.hear_bus();
        // A bus carries no proofs.
        if self.challenge().is_some() {
            return Err(Refusal::Locked);
        }
        if self.next_turn.is_some() && self.is_held() { Err(Refusal::Busy) } else { Ok(()) }
    }

    /// Whether the host of the session was heard a short while ago.
    pub(super) fn is_held(&self) -> bool {
        self.silent_ms.is_some() && self.session_silent_ms < SESSION_MS
    }

    /// A request came.
    pub(super) fn hear(&mut self, tag: Tag) {
        self.hear_bus();
        if self.next_turn.is_some() && tag.session == self.session {
            self.session_silent_ms = 0;
        }
    }

    /// Whether a request that changes something is the session's next. Its turn is taken, whatever becomes of it.
    pub(super) fn admit(&mut self, tag: Tag) -> Result<(), Refusal> {
        let next = self.next_turn.filter(|_| tag.session == self.session).ok_or(Refusal::Session)?;
        if tag.turn != next {
            return Err(Refusal::Order);
        }
        self.next_turn = next.checked_add(1);
        Ok(())
    }

    pub(super) fn identify(&mut self, tag: Tag, drive: &impl Drive) -> Result<Identified, Refusal> {
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
}
