//! Two places in flash for parameter blocks, so that one is whole at any moment.
//!
//! Each slot is a run of erase sectors of its own. The newest valid block, the one with the larger sequence number, is in force; a block is written over
//! the *other* slot, so that what is in force is never touched:
//!
//! 1. erase the other slot;
//! 2. program everything but the first unit of the block, which holds its magic;
//! 3. program the first unit;
//! 4. read all of it back and compare.
//!
//! A power cut before the end of step 3 leaves a slot that has no magic or a wrong CRC-32, and boot finds the old block; after it, boot finds the new one.
//! [`roll_back`](Store::roll_back) erases the newest block, and what was before it is the newest again: cut in the middle, either of them is found whole.
//! The slots are read through a window of 64 bytes: no buffer of a block's size is needed to find the newest.
//!
//! **Read faults.** A slot that does not read as a block is read again, [`ATTEMPTS`] times in all, before it counts as none. The block in force is remembered once it was
//! [found](Store::newest), written or [named](Store::keep): from then on no fault of its slot makes a write erase it. While none is remembered and a slot gives nothing but
//! read errors, [`write`](Store::write) refuses: that slot may hold the block in force. A sector with error correction whose erase was interrupted may give read errors
//! for ever; [`erase_unreadable`](Store::erase_unreadable) is the deliberate way out. A flash that lies without an error, every time, cannot be told from an empty one.
//!
//! **Sequence.** The larger sequence number is the newer one, and after `u32::MAX` comes 1 ([`next_sequence`]).
//!
//! Programmed units are never programmed again before an erase, so flash with error correction is served too. What no store can see is a sector whose
//! interrupted erase reads well now and badly later; such a slot is erased anew before anything is written into it.

mod error;
mod ram;
mod window;

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

use crate::block::{Block, Digest, HEADER_BYTES, Header, crc32};
pub use error::{PlaceError, StoreError};
pub use ram::RamFlash;
#[cfg(feature = "link")]
pub(crate) use window::copy as copy_bytes;
use window::{WINDOW_BYTES, Window, copy};

/// How often a slot is read before it counts as no block.
pub const ATTEMPTS: u32 = 3;

/// The sequence number that follows another; 0 is that of a block that no drive has stored.
#[must_use]
pub const fn next_sequence(sequence: u32) -> u32 {
    if sequence == u32::MAX { 1 } else { sequence + 1 }
}

/// Whether a block of sequence number `a` is newer than one of `b`.
#[must_use]
pub const fn is_newer(a: u32, b: u32) -> bool {
    match (a, b) {
        (1, u32::MAX) => true,
        (u32::MAX, 1) => false,
        _ => a > b,
    }
}

/// One of the two places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Slot {
    /// The first.
    A,
    /// The second.
    B,
}

impl Slot {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// A whole block in flash.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Entry {
    /// Where it lies.
    pub slot: Slot,
    /// Its header.
    pub header: Header,
    /// Its CRC-32.
    pub crc: u32,
}

/// The two slots.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    slots: [Range<u32>; 2],
    in_force: Option<Entry>,
    /// The first slot that gave nothing but read errors when both were read last.
    unreadable: Option<Slot>,
}

impl<F: NorFlash> Store<F> {
    /// The store in these two ranges of a flash, in bytes from its beginning.
    ///
    /// Flash whose erase sector is no multiple of 64 bytes, or whose smallest read or write does not divide 64, does not compile.
    ///
    /// # Errors
    /// A range is empty, not made of whole sectors or beyond the end of the flash, or the two overlap.
    pub fn new(flash: F, a: Range<u32>, b: Range<u32>) -> Result<Self, PlaceError> {
        const {
            assert!(F::ERASE_SIZE.is_multiple_of(WINDOW_BYTES), "erase sectors must be multiples of 64 bytes");
            assert!(WINDOW_BYTES.is_multiple_of(F::WRITE_SIZE), "the smallest write must divide 64 bytes");
            assert!(WINDOW_BYTES.is_multiple_of(F::READ_SIZE), "the smallest read must divide 64 bytes");
        }
        for place in [&a, &b] {
            let aligned = [place.start, place.end].iter().all(|x| (*x as usize).is_multiple_of(F::ERASE_SIZE));
            if !aligned || place.is_empty() {
                return Err(PlaceError::Sectors { erase_size: F::ERASE_SIZE });
            }
            if place.end as usize > flash.capacity() {
                return Err(PlaceError::Beyond { capacity: flash.capacity() });
            }
        }
        if a.start < b.end && b.start < a.end {
            return Err(PlaceError::Overlap);
        }
        Ok(Self { flash, slots: [a, b], in_force: None, unreadable: None })
    }

    /// The most bytes of a block that either slot holds.
    #[must_use]
    pub fn room(&self) -> u32 {
        self.slots.iter().map(|place| place.end.saturating_sub(place.start)).min().unwrap_or(0)
    }

    /// The whole blocks there are, the newest first. A slot that cannot be read holds none, unless it is that of the block in force.
    #[inline(never)]
    pub fn entries(&mut self) -> [Option<Entry>; 2] {
        let [(a, reads_a), (b, reads_b)] = [Slot::A, Slot::B].map(|slot| self.content(slot));
        self.unreadable = match (reads_a, reads_b) {
            (false, _) => Some(Slot::A),
            (true, false) => Some(Slot::B),
            (true, true) => None,
        };
        match (a, b) {
            (Some(first), Some(second)) if is_newer(second.header.sequence, first.header.sequence) => [b, a],
            (None, Some(_)) => [b, a],
            _ => [a, b],
        }
    }

    /// Names the block that the drive runs on: [`write`](Self::write) goes to the other slot, also where that holds a newer block that the drive refused. Without it the newest
    /// block counts.
    pub fn keep(&mut self, entry: Option<Entry>) {
        self.in_force = entry;
    }

    /// The block of a slot, and whether the slot could be read; that of the block in force always counts as read.
    fn content(&mut self, slot: Slot) -> (Option<Entry>, bool) {
        let mut readable = false;
        for _ in 0..ATTEMPTS {
            match self.entry(slot) {
                Ok(Some(entry)) => return (Some(entry), true),
                Ok(None) => readable = true,
                Err(_) => {}
            }
        }
        let in_force = self.in_force.filter(|entry| entry.slot == slot);
        (in_force, readable || in_force.is_some())
    }

    /// The newest whole block. It counts as the one in force from then on where none does yet: call it at boot.
    #[inline(never)]
    pub fn newest(&mut self) -> Option<Entry> {
        let [newest, _] = self.entries();
        self.in_force = self.in_force.or(newest);
        newest
    }

    /// Copies bytes of a block, `offset` from its beginning.
    ///
    /// # Errors
    /// The flash could not be read, or the bytes lie beyond the slot.
    pub fn read(&mut self, entry: &Entry, offset: u32, bytes: &mut [u8]) -> Result<(), StoreError<F::Error>> {
        let place = self.place(entry.slot);
        let at = place.start.checked_add(offset).ok_or(StoreError::TooLong { room: self.room() })?;
        let end = at.checked_add(bytes.len() as u32).ok_or(StoreError::TooLong { room: self.room() })?;
        if end > place.end {
            return Err(StoreError::TooLong { room: self.room() });
        }
        let mut rest = bytes;
        self.windows(at..end, |_, found| {
            if let Some((head, tail)) = core::mem::take(&mut rest).split_at_mut_checked(found.len()) {
                copy(head, found);
                rest = tail;
            }
        })
    }

    /// Copies a whole block into as many bytes, and reads again, [`ATTEMPTS`] times in all, what fails or is not the block that was found.
    ///
    /// # Errors
    /// The flash could not be read, or reads otherwise than it did; the bytes are not those of the block's length.
    pub fn read_whole(&mut self, entry: &Entry, bytes: &mut [u8]) -> Result<(), StoreError<F::Error>> {
        let mut result = Err(StoreError::ReadBack);
        for _ in 0..ATTEMPTS {
            result = self.read(entry, 0, bytes);
            let is_same =
                |(checked, crc): (&[u8], &[u8; 4])| *crc == entry.crc.to_le_bytes() && crc32(checked) == entry.crc;
            match result {
                Ok(()) if bytes.split_last_chunk().is_some_and(is_same) => return Ok(()),
                Ok(()) => result = Err(StoreError::ReadBack),
                Err(_) => {}
            }
        }
        result
    }

    /// Stores a block beside the one in force and reads it back: it is the newest from then on, and the one in force.
    ///
    /// # Errors
    /// The block is not newer than the newest, or longer than a slot; no block is known to be in force, and a slot cannot be read: nothing was touched. The flash
    /// failed, or reads back otherwise: the block in force is what it was.
    pub fn write(&mut self, block: &Block<'_>) -> Result<Entry, StoreError<F::Error>> {
        let [newest, _] = self.entries();
        let sequence = newest.map_or(0, |entry| entry.header.sequence);
        if !is_newer(block.header().sequence, sequence) {
            return Err(StoreError::NotNewer { newest: sequence });
        }
        if block.bytes().len() > self.room() as usize {
            return Err(StoreError::TooLong { room: self.room() });
        }
        match (self.in_force, self.unreadable) {
            (None, Some(slot)) => return Err(StoreError::Unreadable { slot }),
            (None, None) => self.in_force = newest,
            (Some(_), _) => {}
        }
        let slot = self.in_force.map_or(Slot::A, |entry| entry.slot.other());
        let place = self.place(slot);
        self.flash.erase(place.start, place.end).map_err(StoreError::Flash)?;
        self.program(place.start, block.bytes()).map_err(StoreError::Flash)?;

        let entry = Entry { slot, header: *block.header(), crc: block.crc() };
        let mut same = true;
        let mut expected = block.bytes();
        self.windows(place.start..place.start.saturating_add(block.bytes().len() as u32), |_, found| {
            let (head, tail) = expected.split_at_checked(found.len()).unwrap_or_default();
            same &= head == found;
            expected = tail;
        })?;
        if !same {
            return Err(StoreError::ReadBack);
        }
        self.in_force = Some(entry);
        Ok(entry)
    }

    /// Erases the newest block: the one before it is the newest again.
    ///
    /// # Errors
    /// There is none before it: nothing was touched. The flash failed, or the erased block is still there.
    pub fn roll_back(&mut self) -> Result<Entry, StoreError<F::Error>> {
        let [Some(newest), Some(before)] = self.entries() else { return Err(StoreError::NothingBefore) };
        let place = self.place(newest.slot);
        // From here on it is the one before that must not be lost.
        self.in_force = Some(before);
        self.flash.erase(place.start, place.end).map_err(StoreError::Flash)?;
        if self.newest() == Some(before) { Ok(before) } else { Err(StoreError::ReadBack) }
    }

    /// Erases each slot that gives nothing but read errors, never one that reads, nor that of the block in force: the way out of [`StoreError::Unreadable`] where a
    /// slot does not read again after power was switched off and on. A block that lay in it is lost.
    ///
    /// # Errors
    /// The flash failed, or the erased slot still cannot be read.
    pub fn erase_unreadable(&mut self) -> Result<(), StoreError<F::Error>> {
        for slot in [Slot::A, Slot::B] {
            if self.content(slot).1 {
                continue;
            }
            let place = self.place(slot);
            self.flash.erase(place.start, place.end).map_err(StoreError::Flash)?;
            if self.content(slot) != (None, true) {
                return Err(StoreError::ReadBack);
            }
        }
        Ok(())
    }

    /// The flash again.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.flash
    }

    fn place(&self, slot: Slot) -> Range<u32> {
        let [a, b] = &self.slots;
        match slot {
            Slot::A => a.clone(),
            Slot::B => b.clone(),
        }
    }

    /// The block of a slot; `None` where its bytes are no whole block.
    fn entry(&mut self, slot: Slot) -> Result<Option<Entry>, StoreError<F::Error>> {
        let place = self.place(slot);
        let mut head = [0; HEADER_BYTES];
        let head_end = place.start.saturating_add(HEADER_BYTES as u32).min(place.end);
        self.windows(place.start..head_end, |at, found| {
            let from = at.saturating_sub(place.start) as usize;
            if let Some(to) = head.get_mut(from..from.saturating_add(found.len())) {
                copy(to, found);
            }
        })?;
        let Ok(header) = Header::decode(&head) else { return Ok(None) };
        let room = place.end.saturating_sub(place.start);
        let Some(checked) = header.length.checked_sub(4).filter(|_| header.length <= room) else { return Ok(None) };
        if (checked as usize) < HEADER_BYTES {
            return Ok(None);
        }
        let body_end = place.start.saturating_add(checked);
        let mut digest = Digest::new();
        let mut same = true;
        self.windows(place.start..body_end, |at, found| {
            digest.update(found);
            // The header that was decoded is the one that the CRC-32 is of.
            let rest = head.get(at.saturating_sub(place.start) as usize..).unwrap_or_default();
            same &= rest.iter().zip(found).all(|(head, found)| head == found);
        })?;
        let mut stored = [0; 4];
        let mut count = 0;
        self.windows(body_end..body_end.saturating_add(4), |_, found| {
            for byte in found {
                if let Some(to) = stored.get_mut(count) {
                    *to = *byte;
                }
                count = count.saturating_add(1);
            }
        })?;
        let crc = u32::from_le_bytes(stored);
        Ok((same && digest.finalize() == crc).then_some(Entry { slot, header, crc }))
    }

    /// Programs a block into an erased slot, its first unit last.
    fn program(&mut self, at: u32, bytes: &[u8]) -> Result<(), F::Error> {
        let unit = F::WRITE_SIZE;
        let (first, rest) = bytes.split_at_checked(unit).unwrap_or((bytes, &[]));
        let whole = rest.len().saturating_sub(rest.len() % unit);
        let (rest, tail) = rest.split_at_checked(whole).unwrap_or((rest, &[]));
        let mut at_tail = at.saturating_add(unit as u32);
        if !rest.is_empty() {
            self.flash.write(at_tail, rest)?;
            at_tail = at_tail.saturating_add(whole as u32);
        }
        if !tail.is_empty() {
            let padded = Window::padded(tail);
            self.flash.write(at_tail, padded.first(unit))?;
        }
        self.flash.write(at, Window::padded(first).first(unit))
    }

    /// Hands out a range of the flash in pieces, with the place of each.
    fn windows(&mut self, range: Range<u32>, mut piece: impl FnMut(u32, &[u8])) -> Result<(), StoreError<F::Error>> {
        let mut at = range.start;
        while at < range.end {
            let from = at - at % WINDOW_BYTES as u32;
            let end = from.saturating_add(WINDOW_BYTES as u32).min(range.end);
            let mut window = Window::default();
            self.flash.read(from, window.bytes_mut()).map_err(StoreError::Flash)?;
            piece(at, window.between((at - from) as usize, (end - from) as usize));
            at = end;
        }
        Ok(())
    }
}
