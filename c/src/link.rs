//! The serial link over a store, the drive behind it by the functions of a C program.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use gmhm::block::{Block, BlockError, ScalarKind};
use gmhm::diagnostics::{Diagnostics, Fault, SelfTest};
use gmhm::link::lock::{KEY_BYTES, Key, PROOF_BYTES};
use gmhm::link::{CompensationSetting, Drive, Live, Port};

use crate::flash::FlashC;
use crate::joint::DEPTH;
use crate::types::{DiagnosticsC, LiveC, flag};
use crate::{NO_BLOCK, NULL, OK, PLACE, bytes};

/// The most bytes of a block that the link takes.
pub const LINK_ROOM: usize = 2048;

/// 64-bit words of `gmhm_link`.
pub const LINK_WORDS: usize = 352;

const _: () = assert!(
    size_of::<LinkC>() <= 8 * LINK_WORDS && align_of::<LinkC>() <= align_of::<u64>(),
    "a link does not fit into GMHM_LINK_WORDS of gmhm.h"
);

/// `gmhm_drive`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct DriveC {
    /// Handed to each function.
    pub context: *mut c_void,
    /// Sends bytes to the host.
    pub send: Option<unsafe extern "C" fn(*mut c_void, *const u8, u32)>,
    /// Puts a block in force, none where the pointer is null.
    pub adopt: Option<unsafe extern "C" fn(*mut c_void, *const u8, u32) -> u16>,
    /// Whether the power stage is on.
    pub is_enabled: Option<unsafe extern "C" fn(*mut c_void) -> u32>,
    /// Switches the compensation.
    pub set_compensation: Option<unsafe extern "C" fn(*mut c_void, u32, f32)>,
    /// What it measures and computes.
    pub get_live: Option<unsafe extern "C" fn(*mut c_void, *mut LiveC)>,
    /// What went wrong on its control path.
    pub get_diagnostics: Option<unsafe extern "C" fn(*mut c_void, *mut DiagnosticsC)>,
    /// Counts that from nothing again.
    pub clear_diagnostics: Option<unsafe extern "C" fn(*mut c_void)>,
}

/// `gmhm_link`.
#[derive(Debug)]
pub struct LinkC {
    port: Option<Port<FlashC, LINK_ROOM>>,
    compensation: CompensationSetting,
}

/// The drive of a call.
struct Callbacks<'a> {
    drive: &'a DriveC,
    compensation: &'a mut CompensationSetting,
}

// SAFETY of the calls below: gmhm.h asks the program for functions that keep to what they are handed, and for the context that they expect.
impl Drive for Callbacks<'_> {
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, DEPTH as u16)
    }

    fn is_enabled(&self) -> bool {
        // A drive that does not say so is taken for enabled: nothing is stored then.
        // SAFETY: see above.
        self.drive.is_enabled.is_none_or(|is_enabled| unsafe { is_enabled(self.drive.context) } != 0)
    }

    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        let Some(adopt) = self.drive.adopt else { return Err(BlockError::Firmware(NULL)) };
        let (pointer, length) =
            block.map_or((core::ptr::null(), 0), |block| (block.bytes().as_ptr(), block.bytes().len()));
        // SAFETY: see above.
        match unsafe { adopt(self.drive.context, pointer, length as u32) } {
            OK => Ok(()),
            code => Err(BlockError::Firmware(code)),
        }
    }

    fn compensation(&self) -> CompensationSetting {
        *self.compensation
    }

    fn set_compensation(&mut self, compensation: CompensationSetting) {
        *self.compensation = compensation;
        if let Some(set) = self.drive.set_compensation {
            // SAFETY: see above.
            unsafe { set(self.drive.context, u32::from(compensation.on), compensation.gain_ratio) };
        }
    }

    fn live(&self) -> Live {
        let mut live = LiveC::default();
        if let Some(get) = self.drive.get_live {
            // SAFETY: see above.
            unsafe { get(self.drive.context, &raw mut live) };
        }
        Live {
            deflection_rad: live.deflection_rad,
            torque_nm: live.torque_nm,
            hysteresis_nm: live.hysteresis_nm,
            words: [live.torque_nm, live.hysteresis_nm].map(f32::to_bits),
            contribution_nm: live.contribution_nm,
            out_of_range: live.flags & flag::OUT_OF_RANGE != 0,
            refused: live.flags & (flag::REFUSED | flag::QUARANTINED) != 0,
            ticks: live.ticks,
            loop_cost: live.loop_cost,
        }
    }

    fn diagnostics(&self) -> Diagnostics {
        let mut found = DiagnosticsC::default();
        if let Some(get) = self.drive.get_diagnostics {
            // SAFETY: see above.
            unsafe { get(self.drive.context, &raw mut found) };
        }
        let DiagnosticsC { refused, out_of_range, quarantined, restarted, saturated, merged_pairs, .. } = found;
        let DiagnosticsC { last_fault, self_test, .. } = found;
        let last = u8::try_from(last_fault).ok().and_then(Fault::of_number).unwrap_or_default();
        let self_test = u8::try_from(self_test).ok().and_then(SelfTest::of_number).unwrap_or_default();
        Diagnostics { refused, out_of_range, quarantined, restarted, saturated, merged_pairs, last, self_test }
    }

    fn clear_diagnostics(&mut self) {
        if let Some(clear) = self.drive.clear_diagnostics {
            // SAFETY: see above.
            unsafe { clear(self.drive.context) };
        }
    }
}

impl LinkC {
    fn with<'a>(&'a mut self, drive: &'a DriveC) -> Option<(&'a mut Port<FlashC, LINK_ROOM>, Callbacks<'a>)> {
        let Self { port, compensation } = self;
        Some((port.as_mut()?, Callbacks { drive, compensation }))
    }
}

/// See `gmhm.h`.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_link_init(link: Option<&mut MaybeUninit<LinkC>>, flash: Option<&FlashC>, nonce: u32) -> u16 {
    let (Some(link), Some(flash)) = (link, flash) else { return NULL };
    let port = flash.store().map(|store| Port::new(store, nonce));
    let link = link.write(LinkC { port, compensation: CompensationSetting::default() });
    if link.port.is_some() { OK } else { PLACE }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_link_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_link_lock(
    link: Option<&mut LinkC>,
    key: Option<&[u8; KEY_BYTES]>,
    entropy: Option<&[u8; PROOF_BYTES]>,
) -> u16 {
    let (Some(link), Some(key), Some(entropy)) = (link, key, entropy) else { return NULL };
    let Some(port) = &mut link.port else { return PLACE };
    port.set_lock(Key(*key), *entropy);
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_link_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_link_boot(link: Option<&mut LinkC>, drive: Option<&DriveC>) -> u16 {
    let (Some(link), Some(drive)) = (link, drive) else { return NULL };
    let Some((port, mut drive)) = link.with(drive) else { return PLACE };
    match (port.boot(&mut drive), port.boot_error()) {
        (Some(_), _) => OK,
        (None, 0) => NO_BLOCK,
        (None, code) => code,
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_link_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_link_receive(
    link: Option<&mut LinkC>,
    drive: Option<&DriveC>,
    from: *const u8,
    length: u32,
) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(link), Some(drive), Some(received)) = (link, drive, unsafe { bytes(from, length) }) else { return NULL };
    let Some((port, mut callbacks)) = link.with(drive) else { return PLACE };
    port.receive(received, &mut callbacks, |frame| {
        if let Some(send) = drive.send {
            // SAFETY: the frame lives until the call returns.
            unsafe { send(drive.context, frame.as_ptr(), frame.len() as u32) };
        }
    });
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_link_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_link_elapse(link: Option<&mut LinkC>, drive: Option<&DriveC>, ms: u32) -> u16 {
    let (Some(link), Some(drive)) = (link, drive) else { return NULL };
    let Some((port, mut callbacks)) = link.with(drive) else { return PLACE };
    port.elapse(ms, &mut callbacks);
    OK
}
