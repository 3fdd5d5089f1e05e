//! A NOR flash that is out for the store: programming only clears bits, a unit is programmed once, and power fails where the test says.

use core::ops::Range;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Flash of sectors of `ERASE` bytes, programmed in units of `WRITE`.
#[derive(Debug, Clone)]
pub struct HostileFlash<const WRITE: usize, const ERASE: usize> {
    bytes: Vec<u8>,
    /// What has become of each unit since its sector was erased.
    units: Vec<Unit>,
    /// Whether a unit that lost its power half-way can be read at all: flash with error correction refuses.
    corrects_errors: bool,
    random: ChaCha8Rng,
    /// Moments left before power fails.
    left: Option<u64>,
    moments: u64,
    dark: bool,
    /// Reads until a fault, how many there are, and what they are.
    fault: Option<(u64, u64, ReadFault)>,
    reads: u64,
    /// Bytes that do not read for now.
    unreadable: Range<usize>,
    /// The write or erase that fails, by its number, and what of it is done.
    change_fault: Option<(u64, ChangeFault)>,
    changes: u64,
}

/// What a read that fails for once does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadFault {
    /// It says so.
    Error,
    /// A bit is wrong.
    Flip,
    /// All bytes are those of an erased flash.
    Erased,
}

/// What of a write or an erase is done that fails for once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeFault {
    /// Nothing.
    Nothing,
    /// Some units or sectors, and one of them in part.
    Part,
    /// All of it.
    All,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Erased,
    Programmed,
    Torn,
}

/// Why the flash refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlashFault {
    /// There is no power.
    Dark,
    /// Alignment or bounds.
    Place(NorFlashErrorKind),
    /// The unit at this byte was programmed before and not erased since.
    Rewritten(usize),
    /// The unit at this byte does not read: its error correction fails.
    Unreadable(usize),
    /// This call failed, the next one may not.
    Transient,
}

impl NorFlashError for FlashFault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place(kind) => *kind,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// In how many states an erase can be interrupted, a sector: untouched, a quarter, half, three quarters of the zeros risen, all bits random, one bit left.
pub const ERASE_MOMENTS: u64 = 6;

impl<const WRITE: usize, const ERASE: usize> HostileFlash<WRITE, ERASE> {
    /// So many erased sectors.
    pub fn new(sectors: usize, corrects_errors: bool, seed: u64) -> Self {
        let size = sectors * ERASE;
        Self {
            bytes: vec![0xFF; size],
            units: vec![Unit::Erased; size / WRITE],
            corrects_errors,
            random: ChaCha8Rng::seed_from_u64(seed),
            left: None,
            moments: 0,
            dark: false,
            fault: None,
            reads: 0,
            unreadable: 0..0,
            change_fault: None,
            changes: 0,
        }
    }

    /// Lets power fail after so many moments more: the bytes of writes, and [`ERASE_MOMENTS`] for each sector that is erased.
    pub fn cut_after(&mut self, moments: u64, seed: u64) {
        self.left = Some(moments);
        self.random = ChaCha8Rng::seed_from_u64(seed);
    }

    /// Power again. True where it had failed.
    pub fn power_up(&mut self) -> bool {
        self.left = None;
        core::mem::take(&mut self.dark)
    }

    /// Lets `count` reads fail, after `reads` that do not.
    pub fn disturb_reads(&mut self, reads: u64, count: u64, fault: ReadFault) {
        self.fault = Some((self.reads + reads, count, fault));
    }

    /// Reads so far.
    pub fn reads(&self) -> u64 {
        self.reads
    }

    /// Lets reads of these bytes fail until it is called again.
    pub fn hide(&mut self, bytes: Range<usize>) {
        self.unreadable = bytes;
    }

    /// Lets one write or erase fail, after `changes` that do not.
    pub fn disturb_change(&mut self, changes: u64, fault: ChangeFault) {
        self.change_fault = Some((self.changes + changes, fault));
    }

    /// Writes and erases so far.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// The fault of the write or erase that begins.
    fn change(&mut self) -> Option<ChangeFault> {
        let fault = self.change_fault.filter(|(at, _)| *at == self.changes);
        self.changes += 1;
        fault.map(|(_, fault)| fault)
    }

    /// Moments that have passed.
    pub fn moments(&self) -> u64 {
        self.moments
    }

    /// Fills a range with these bytes, as a flash that another program has used.
    pub fn plant(&mut self, at: usize, bytes: &[u8]) {
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        self.units[at / WRITE..(at + bytes.len()).div_ceil(WRITE)].fill(Unit::Programmed);
    }

    /// Every byte.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// A moment passes; false where power fails in it.
    fn moment(&mut self) -> bool {
        self.moments += 1;
        match &mut self.left {
            Some(0) => {
                self.dark = true;
                false
            }
            Some(left) => {
                *left -= 1;
                true
            }
            None => true,
        }
    }

    /// The bytes of a unit are programmed together: what follows the first `done` may have begun.
    fn tear_unit(&mut self, at: usize, unit: &[u8], done: usize) {
        for (j, byte) in unit.iter().enumerate().skip(done) {
            let kept: u8 = self.random.random();
            self.bytes[at + j] &= byte | kept;
        }
        self.units[at / WRITE] = Unit::Torn;
    }

    fn tear_sector(&mut self, from: usize, stage: u64) {
        for at in from..from + ERASE {
            let old = self.bytes[at];
            let mut risen = |share: f64| (0..8).fold(0, |bits, k| bits | u8::from(self.random.random_bool(share)) << k);
            self.bytes[at] = match stage {
                0 => old,
                1 => old | risen(0.25),
                2 => old | risen(0.5),
                3 => old | risen(0.75),
                4 => self.random.random(),
                _ => 0xFF,
            };
        }
        if stage == ERASE_MOMENTS - 1 {
            self.bytes[from + self.random.random_range(0..ERASE)] &= !(1 << self.random.random_range(0..8));
        }
        if stage > 0 {
            self.units[from / WRITE..(from + ERASE) / WRITE].fill(Unit::Torn);
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for HostileFlash<WRITE, ERASE> {
    type Error = FlashFault;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for HostileFlash<WRITE, ERASE> {
    const READ_SIZE: usize = WRITE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        if self.dark {
            return Err(FlashFault::Dark);
        }
        check_read(self, offset, bytes.len()).map_err(FlashFault::Place)?;
        let from = offset as usize;
        let units = from / WRITE..(from + bytes.len()).div_ceil(WRITE);
        if let Some(torn) = units.clone().find(|unit| self.corrects_errors && self.units[*unit] == Unit::Torn) {
            return Err(FlashFault::Unreadable(torn * WRITE));
        }
        if from < self.unreadable.end && self.unreadable.start < from + bytes.len() {
            return Err(FlashFault::Unreadable(self.unreadable.start));
        }
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        let disturbed = self.fault.filter(|(first, count, _)| (*first..first + count).contains(&self.reads));
        self.reads += 1;
        match disturbed {
            Some((.., ReadFault::Error)) => return Err(FlashFault::Transient),
            Some((.., ReadFault::Flip)) => {
                bytes[self.random.random_range(0..bytes.len())] ^= 1 << self.random.random_range(0..8)
            }
            Some((.., ReadFault::Erased)) => bytes.fill(0xFF),
            None => {}
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for HostileFlash<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        if self.dark {
            return Err(FlashFault::Dark);
        }
        check_erase(self, from, to).map_err(FlashFault::Place)?;
        let fault = self.change();
        let sectors = (to - from) as usize / ERASE;
        let torn = match fault {
            Some(ChangeFault::Nothing) => return Err(FlashFault::Transient),
            Some(ChangeFault::Part) => self.random.random_range(0..sectors),
            Some(ChangeFault::All) | None => sectors,
        };
        for (k, sector) in (from as usize..to as usize).step_by(ERASE).enumerate() {
            if k == torn {
                let stage = self.random.random_range(1..ERASE_MOMENTS);
                self.tear_sector(sector, stage);
                return Err(FlashFault::Transient);
            }
            for stage in 0..ERASE_MOMENTS {
                if !self.moment() {
                    self.tear_sector(sector, stage);
                    return Err(FlashFault::Dark);
                }
            }
            self.bytes[sector..sector + ERASE].fill(0xFF);
            self.units[sector / WRITE..(sector + ERASE) / WRITE].fill(Unit::Erased);
        }
        fault.map_or(Ok(()), |_| Err(FlashFault::Transient))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        if self.dark {
            return Err(FlashFault::Dark);
        }
        check_write(self, offset, bytes.len()).map_err(FlashFault::Place)?;
        let fault = self.change();
        let count = bytes.len().div_ceil(WRITE);
        let torn = match fault {
            Some(ChangeFault::Nothing) => return Err(FlashFault::Transient),
            Some(ChangeFault::Part) => self.random.random_range(0..count),
            Some(ChangeFault::All) | None => count,
        };
        for (k, unit) in bytes.chunks(WRITE).enumerate() {
            let at = offset as usize + k * WRITE;
            if self.units[at / WRITE] != Unit::Erased {
                return Err(FlashFault::Rewritten(at));
            }
            if k == torn {
                self.tear_unit(at, unit, 0);
                return Err(FlashFault::Transient);
            }
            for (i, byte) in unit.iter().enumerate() {
                if !self.moment() {
                    self.tear_unit(at, unit, i);
                    return Err(FlashFault::Dark);
                }
                self.bytes[at + i] &= byte;
            }
            self.units[at / WRITE] = Unit::Programmed;
        }
        fault.map_or(Ok(()), |_| Err(FlashFault::Transient))
    }
}
