//! Parameters on their way into a drive: staged, tried, taken back.

use embedded_storage::nor_flash::NorFlash;

use super::super::drive::{CompensationSetting, Drive};
use super::super::refusal::{Refusal, Refused};
use super::{FADE_MS, InForce, SESSION_END_MS, Server, Staged, refused_block};
use crate::block::{Identity, check_set_up, verify};
use crate::store::{copy_bytes, is_newer};

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    pub(in crate::link) fn begin(&mut self, length: u32, crc: Option<u32>) -> Result<(), Refusal> {
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

    pub(in crate::link) fn take(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
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

    pub(super) fn try_out(&mut self, drive: &mut impl Drive) -> Result<(), Refused> {
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

    pub(super) fn revert(&mut self, drive: &mut impl Drive) -> Result<(), Refusal> {
        if !self.is_on_trial() {
            return Err(Refusal::NotOnTrial);
        }
        if drive.compensation().on {
            return Err(Refusal::Compensating);
        }
        self.adopt_stored(drive);
        Ok(())
    }

    /// Says that time has passed; call it some times a second. Without it neither a trial nor a session ends by itself, and any host may open a session at any time.
    ///
    /// A session whose host is silent for [`SESSION_END_MS`] is over, as after [`Request::Close`](crate::link::Request::Close).
    ///
    /// A trial whose host is gone ([`TRIAL_MS`](super::TRIAL_MS) without a request) ends: the compensation is switched off where it is on, and [`FADE_MS`] later the stored block is
    /// in force again.
    pub fn elapse(&mut self, ms: u32, drive: &mut impl Drive) {
        let silent_ms = self.silent_ms.unwrap_or(0).saturating_add(ms);
        self.silent_ms = Some(silent_ms);
        self.session_silent_ms = self.session_silent_ms.saturating_add(ms);
        if self.session_silent_ms >= SESSION_END_MS {
            self.next_turn = None;
        }
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

    pub(super) fn is_on_trial(&self) -> bool {
        matches!(self.in_force, InForce::Trial { .. })
    }
}
