//! The core for firmware in C: what `include/gmhm.h` declares and explains.
//!
//! `cargo build -p gmhm-c --profile firmware --target thumbv7em-none-eabihf` makes `libgmhm_c.a`.
//!
//! The boundary is the only place of `gmhm` with `unsafe`: bytes behind a pointer from C, and names without mangling. Null pointers are `None`; everything else
//! is Rust's as soon as it has crossed.
#![no_std]

#[cfg(not(target_os = "none"))]
extern crate std;

mod facts;
mod feed_forward;
mod flash;
mod gear;
mod joint;
mod law;
mod link;
mod pair;
mod terms;
mod types;

use core::mem::MaybeUninit;

use gmhm::block::{BlockError, TorqueUnit, sdo_abort};

use crate::joint::SetUp;
use crate::terms::Terms;
use crate::types::Answer;

pub use feed_forward::{
    FEED_FORWARD_WORDS, FeedForwardC, gmhm_feed_forward_clear_diagnostics, gmhm_feed_forward_get_diagnostics,
    gmhm_feed_forward_get_status, gmhm_feed_forward_init, gmhm_feed_forward_init_with_terms, gmhm_feed_forward_load,
    gmhm_feed_forward_needs, gmhm_feed_forward_restart, gmhm_feed_forward_step,
};
pub use flash::{
    FlashC, STORE_WORDS, StoreC, gmhm_stamp, gmhm_store_erase_unreadable, gmhm_store_init, gmhm_store_read,
    gmhm_store_roll_back, gmhm_store_write,
};
pub use gear::{
    GEAR_WORDS, GearC, gmhm_gear_clear_diagnostics, gmhm_gear_get_diagnostics, gmhm_gear_get_status, gmhm_gear_init,
    gmhm_gear_invert, gmhm_gear_load, gmhm_gear_load_amperes, gmhm_gear_restart, gmhm_gear_set_largest_step,
    gmhm_gear_step,
};
pub use joint::Joint;
pub use law::{
    LAW_WORDS, Law, gmhm_law_clear_diagnostics, gmhm_law_get_diagnostics, gmhm_law_init, gmhm_law_load,
    gmhm_law_restart, gmhm_law_step,
};
pub use link::{
    DriveC, LINK_ROOM, LINK_WORDS, LinkC, gmhm_link_boot, gmhm_link_elapse, gmhm_link_init, gmhm_link_lock,
    gmhm_link_receive,
};
pub use pair::{PAIR_WORDS, PairC, gmhm_pair_init, gmhm_pair_read, gmhm_pair_restart, gmhm_read_block};
pub use terms::{TERM_WORDS, TermC};
pub use types::{
    BlockC, ContributionC, DemandC, DiagnosticsC, EncodersC, LimitsC, LiveC, OutputC, SampleC, SolutionC, StatusC,
    flag, need,
};

/// `GMHM_OK`.
pub const OK: u16 = 0;
/// `GMHM_NULL`.
pub const NULL: u16 = 1;
/// `GMHM_VALUE`.
pub const VALUE: u16 = 2;
/// `GMHM_UNIT`.
pub const UNIT: u16 = 3;
/// `GMHM_FLASH`.
pub const FLASH: u16 = 4;
/// `GMHM_NO_BLOCK`.
pub const NO_BLOCK: u16 = 5;
/// `GMHM_NOT_NEWER`.
pub const NOT_NEWER: u16 = 6;
/// `GMHM_NO_SPACE`.
pub const NO_SPACE: u16 = 7;
/// `GMHM_READ_BACK`.
pub const READ_BACK: u16 = 8;
/// `GMHM_PLACE`.
pub const PLACE: u16 = 9;
/// `GMHM_PERIOD`.
pub const PERIOD: u16 = 10;
/// `GMHM_NO_INVERSE`.
pub const NO_INVERSE: u16 = 11;
/// `GMHM_UNREADABLE`.
pub const UNREADABLE: u16 = 12;

/// `GMHM_PLACES`.
pub const PLACES: u16 = 13;

/// 64-bit words of `gmhm_joint`.
pub const JOINT_WORDS: usize = 64;

const _: () = assert!(
    size_of::<Joint>() <= 8 * JOINT_WORDS && align_of::<Joint>() <= align_of::<u64>(),
    "a joint does not fit into GMHM_JOINT_WORDS of gmhm.h"
);

/// The bytes behind a pointer.
///
/// # Safety
/// `length` bytes from `pointer` on can be read and do not change until the call of C returns, or the pointer is null.
unsafe fn bytes<'a>(pointer: *const u8, length: u32) -> Option<&'a [u8]> {
    let length = usize::try_from(length).ok()?;
    // SAFETY: not null, and the caller of the C function vouches for the bytes.
    (!pointer.is_null()).then(|| unsafe { core::slice::from_raw_parts(pointer, length) })
}

/// The code of a refused block; another unit has had one of its own from the beginning.
fn code_of(error: &BlockError) -> u16 {
    if let BlockError::Unit(_) = error { UNIT } else { error.code() }
}

/// Writes what a call answers, or that nothing is loaded, and returns its flags. Nothing is called where there is no place to write to.
fn answer<T: Answer>(to: Option<&mut MaybeUninit<T>>, call: impl FnOnce() -> Option<T>) -> u32 {
    let Some(to) = to else { return flag::NOT_LOADED };
    *to.write(call().unwrap_or_else(T::not_loaded)).flags()
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_init(joint: Option<&mut MaybeUninit<Joint>>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above; no terms.
    unsafe { gmhm_init_with_terms(joint, core::ptr::null_mut(), 0, block, length) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says, the terms for as long as the joint is used.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_init_with_terms(
    joint: Option<&mut MaybeUninit<Joint>>,
    terms: *mut TermC,
    places: u32,
    block: *const u8,
    length: u32,
) -> u16 {
    let Some(joint) = joint else { return NULL };
    // SAFETY: the caller's, as above.
    unsafe {
        let joint = joint.write(Joint::empty(Terms::in_memory(terms, places)));
        gmhm_load(Some(joint), block, length)
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_load(joint: Option<&mut Joint>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above.
    unsafe { load(joint, block, length, TorqueUnit::NewtonMetre, joint::prepared) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_load_amperes(joint: Option<&mut Joint>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above.
    unsafe { load(joint, block, length, TorqueUnit::Ampere, joint::prepared) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_load_any(
    joint: Option<&mut Joint>,
    block: *const u8,
    length: u32,
    in_amperes: u32,
) -> u16 {
    let unit = if in_amperes == 0 { TorqueUnit::NewtonMetre } else { TorqueUnit::Ampere };
    // SAFETY: the caller's, as above.
    unsafe { load(joint, block, length, unit, joint::any) }
}

/// # Safety
/// As [`bytes`].
unsafe fn load(joint: Option<&mut Joint>, block: *const u8, length: u32, unit: TorqueUnit, set_up: SetUp) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(joint), Some(block)) = (joint, unsafe { bytes(block, length) }) else { return NULL };
    joint.load(block, unit, set_up).err().unwrap_or(OK)
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_step_counts(
    joint: Option<&mut Joint>,
    pair: Option<&mut PairC>,
    motor: u32,
    output: u32,
    sample: Option<&SampleC>,
    to: Option<&mut MaybeUninit<OutputC>>,
) -> u32 {
    answer(to, || Some(joint?.step_counts(pair?, motor, output, sample?)))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_restart(joint: Option<&mut Joint>) {
    if let Some(joint) = joint {
        joint.restart();
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_set_largest_step(joint: Option<&mut Joint>, largest_step_rad: f32) -> u16 {
    match joint {
        None => NULL,
        Some(joint) => {
            if joint.set_largest_step(largest_step_rad) {
                OK
            } else {
                VALUE
            }
        }
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_step(
    joint: Option<&mut Joint>,
    sample: Option<&SampleC>,
    to: Option<&mut MaybeUninit<OutputC>>,
) -> u32 {
    answer(to, || Some(joint?.step(sample?)))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_invert(
    joint: Option<&mut Joint>,
    torque_nm: f32,
    sample: Option<&SampleC>,
    to: Option<&mut MaybeUninit<SolutionC>>,
) -> u32 {
    answer(to, || Some(joint?.invert(torque_nm, sample)))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_get_status(joint: Option<&Joint>, to: Option<&mut MaybeUninit<StatusC>>) -> u32 {
    answer(to, || joint.map(Joint::status))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_get_diagnostics(joint: Option<&Joint>, to: Option<&mut MaybeUninit<DiagnosticsC>>) -> u16 {
    match (joint, to) {
        (Some(joint), Some(to)) => {
            to.write(joint.diagnostics());
            OK
        }
        _ => NULL,
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_clear_diagnostics(joint: Option<&mut Joint>) {
    if let Some(joint) = joint {
        joint.clear_diagnostics();
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_sdo_abort(code: u16) -> u32 {
    sdo_abort(code)
}

/// See `gmhm.h`: major, minor and patch, a byte each.
// SAFETY: as for `gmhm_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_version() -> u32 {
    VERSION
}

/// The package's version as `GMHM_VERSION`.
const VERSION: u32 = part(env!("CARGO_PKG_VERSION_MAJOR")) << 16
    | part(env!("CARGO_PKG_VERSION_MINOR")) << 8
    | part(env!("CARGO_PKG_VERSION_PATCH"));

const fn part(text: &str) -> u32 {
    let (bytes, mut at, mut number) = (text.as_bytes(), 0, 0);
    while at < bytes.len() {
        number = 10 * number + (bytes[at] - b'0') as u32;
        at += 1;
    }
    number
}

/// A static library has to have one, but for a program that brings its own in Rust; nothing in it panics.
#[cfg(all(target_os = "none", feature = "panic-handler"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
