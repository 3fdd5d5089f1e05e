//! Parameters in flash: put in force, stored, rolled back.

use embedded_storage::nor_flash::NorFlash;

use super::super::drive::Drive;
use super::super::message::{Answer, ERASE, LOAD, SAVE};
use super::super::rating::Bounds;
use super::super::refusal::{Refusal, Refused};
use super::{InForce, Server, refusal, refused_block};
use crate::block::{BlockError, check_set_up, verify};
use crate::store::Entry;

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    pub(super) fn commit<'b>(&mut self, signature: u32, crc: u32, drive: &impl Drive) -> Result<Answer<'b>, Refused> {
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

    pub(super) fn roll_back<'b>(
        &mut self,
        signature: u32,
        sequence: u32,
        drive: &mut impl Drive,
    ) -> Result<Answer<'b>, Refused> {
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
    pub(super) fn adopt_stored(&mut self, drive: &mut impl Drive) {
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

    pub(super) fn adopt_entry(&mut self, entry: &Entry, drive: &mut impl Drive) -> Result<(), Refused> {
        let bytes = self.stage.get_mut(..entry.header.length as usize).ok_or(refused_block(BlockError::NoRoom))?;
        self.store.read_whole(entry, bytes).map_err(refusal)?;
        let block = verify(bytes).map_err(refused_block)?;
        check_set_up(&block).and_then(|()| drive.adopt(Some(&block))).map_err(refused_block)?;
        self.bounds = Some(Bounds::of(&block));
        Ok(())
    }

    pub(super) fn erase_unreadable(&mut self, signature: u32, drive: &impl Drive) -> Result<(), Refusal> {
        if signature != ERASE {
            return Err(Refusal::Signature);
        }
        if drive.is_enabled() {
            return Err(Refusal::Enabled);
        }
        self.store.erase_unreadable().map_err(refusal)
    }
}
