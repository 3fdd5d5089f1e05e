//! A flash by the functions of a C program, and the store in it.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use gmhm::block::{stamp, verify_first};
use gmhm::store::{Store, StoreError};

use crate::{FLASH, NO_BLOCK, NO_SPACE, NOT_NEWER, NULL, OK, PLACE, READ_BACK, UNREADABLE, bytes};

/// `gmhm_flash`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct FlashC {
    /// Handed to each function.
    pub context: *mut c_void,
    /// All bytes.
    pub capacity: u32,
    /// Bytes of an erase sector.
    pub erase_size: u32,
    /// Bytes of the smallest write.
    pub write_size: u32,
    /// Where the first slot begins, bytes.
    pub first_slot: u32,
    /// Where the second slot begins, bytes.
    pub second_slot: u32,
    /// Bytes of each slot.
    pub slot_size: u32,
    /// Reads bytes; 0: done.
    pub read: Option<unsafe extern "C" fn(*mut c_void, u32, *mut u8, u32) -> u32>,
    /// Programs erased bytes; 0: done.
    pub write: Option<unsafe extern "C" fn(*mut c_void, u32, *const u8, u32) -> u32>,
    /// Erases whole sectors from the first address up to the second; 0: done.
    pub erase: Option<unsafe extern "C" fn(*mut c_void, u32, u32) -> u32>,
}

/// Whether these functions say that it is done.
fn done(code: Option<u32>) -> Result<(), FlashError> {
    if code == Some(0) { Ok(()) } else { Err(FlashError) }
}

/// A function of the flash failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlashError;

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for FlashC {
    type Error = FlashError;
}

impl ReadNorFlash for FlashC {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        // SAFETY: the pointers are those of `bytes`; gmhm.h asks the program for a function that keeps to them.
        done(self.read.map(|read| unsafe { read(self.context, offset, bytes.as_mut_ptr(), bytes.len() as u32) }))
    }

    fn capacity(&self) -> usize {
        self.capacity as usize
    }
}

impl NorFlash for FlashC {
    // What is written is padded to this; each smaller unit in it is written once.
    const WRITE_SIZE: usize = 64;
    const ERASE_SIZE: usize = 64;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        // SAFETY: addresses of the program's own flash.
        done(self.erase.map(|erase| unsafe { erase(self.context, from, to) }))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        // SAFETY: as for `read`.
        done(self.write.map(|write| unsafe { write(self.context, offset, bytes.as_ptr(), bytes.len() as u32) }))
    }
}

impl FlashC {
    /// The store in its two slots; `None` where they are no whole sectors, overlap, lie beyond the flash, or a function is missing.
    pub(crate) fn store(&self) -> Option<Store<Self>> {
        let Self { erase_size, write_size, first_slot, second_slot, slot_size, .. } = *self;
        let whole = |at: u32| at.checked_rem(erase_size) == Some(0);
        let sizes = 64_u32.checked_rem(write_size) == Some(0) && erase_size.is_multiple_of(64);
        let functions = self.read.is_some() && self.write.is_some() && self.erase.is_some();
        if !(functions && sizes && [first_slot, second_slot, slot_size].into_iter().all(whole)) {
            return None;
        }
        let slot = |at: u32| Some(at..at.checked_add(slot_size)?);
        Store::new(*self, slot(first_slot)?, slot(second_slot)?).ok()
    }
}

/// The code of a store that refused or failed.
fn code(error: &StoreError<FlashError>) -> u16 {
    match error {
        StoreError::NotNewer { .. } => NOT_NEWER,
        StoreError::TooLong { .. } => NO_SPACE,
        StoreError::ReadBack => READ_BACK,
        StoreError::NothingBefore => NO_BLOCK,
        StoreError::Unreadable { .. } => UNREADABLE,
        _ => FLASH,
    }
}

/// 64-bit words of `gmhm_store`.
pub const STORE_WORDS: usize = 24;

const _: () = assert!(
    size_of::<StoreC>() <= 8 * STORE_WORDS && align_of::<StoreC>() <= align_of::<u64>(),
    "a store does not fit into GMHM_STORE_WORDS of gmhm.h"
);

/// `gmhm_store`.
#[derive(Debug)]
pub struct StoreC(Option<Store<FlashC>>);

/// See `gmhm.h`.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_store_init(store: Option<&mut MaybeUninit<StoreC>>, flash: Option<&FlashC>) -> u16 {
    let (Some(store), Some(flash)) = (store, flash) else { return NULL };
    let store = store.write(StoreC(flash.store()));
    if store.0.is_some() { OK } else { PLACE }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_store_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_store_read(
    store: Option<&mut StoreC>,
    to: *mut u8,
    room: u32,
    length: Option<&mut MaybeUninit<u32>>,
) -> u16 {
    let (Some(store), Some(length), false) = (store, length, to.is_null()) else { return NULL };
    let length = length.write(0);
    let Some(store) = &mut store.0 else { return PLACE };
    let Some(entry) = store.newest() else { return NO_BLOCK };
    if entry.header.length > room {
        return NO_SPACE;
    }
    // SAFETY: not null, and the caller vouches for `room` bytes that nothing else uses until the call returns.
    let to = unsafe { core::slice::from_raw_parts_mut(to, entry.header.length as usize) };
    match store.read_whole(&entry, to) {
        Ok(()) => {
            *length = entry.header.length;
            OK
        }
        Err(error) => code(&error),
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_store_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_store_write(store: Option<&mut StoreC>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(store), Some(block)) = (store, unsafe { bytes(block, length) }) else { return NULL };
    let Some(store) = &mut store.0 else { return PLACE };
    match verify_first(block) {
        Err(error) => error.code(),
        Ok(block) => store.write(&block).err().map_or(OK, |error| code(&error)),
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_store_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_store_roll_back(store: Option<&mut StoreC>) -> u16 {
    let Some(store) = store else { return NULL };
    let Some(store) = &mut store.0 else { return PLACE };
    store.roll_back().err().map_or(OK, |error| code(&error))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_store_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_store_erase_unreadable(store: Option<&mut StoreC>) -> u16 {
    let Some(store) = store else { return NULL };
    let Some(store) = &mut store.0 else { return PLACE };
    store.erase_unreadable().err().map_or(OK, |error| code(&error))
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_store_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_stamp(block: *mut u8, length: u32, sequence: u32) -> u16 {
    // SAFETY: the caller's, as above.
    let Some(whole) = (unsafe { bytes(block, length) }) else { return NULL };
    let length = match verify_first(whole) {
        Ok(verified) => verified.bytes().len(),
        Err(error) => return error.code(),
    };
    // SAFETY: not null, no other reference is left, and the caller vouches for as many bytes.
    match stamp(unsafe { core::slice::from_raw_parts_mut(block, length) }, sequence) {
        Ok(()) => OK,
        Err(error) => error.code(),
    }
}
