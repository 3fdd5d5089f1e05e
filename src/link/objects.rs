//! The object dictionary: what a bus with indices, such as CANopen or EtherCAT, reads and writes of a drive.
//!
//! [`OBJECTS`] lists every object with its type, unit, range and access; `gmhm pack --eds` writes them as an electronic data sheet (CiA 306). [`Server`] reads and
//! writes them; [`SdoServer`](super::sdo::SdoServer) carries them over SDO. Values are little-endian.
//!
//! A block is written to [`STAGE`], tried by 2006h, stored by 1010h and given up by 1011h: the same way as over the serial link. The bus confirms every transfer by
//! itself, so objects need no session; while a host of the serial link holds one, writing is refused.

use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

pub use super::abort::Abort;
use super::adaptation::Adapted;
use super::drive::Drive;
use super::message::{MOST_BYTES, Request};
pub use super::object::{Access, DataType, Object};
use super::server::Server;
use crate::block::FORMAT_VERSION;

/// The block that is to come, a domain.
pub const STAGE: (u16, u8) = (0x2005, 2);
/// The block in force, a domain.
pub const IN_FORCE: (u16, u8) = (0x2005, 1);

/// The record of the [adaptation](super::adaptation::Adapted); of a drive without one it is zero.
pub const ADAPTATION: u16 = 0x2007;

const fn read(index: u16, sub: u8, name: &'static str, data_type: DataType, unit: &'static str) -> Object {
    Object { index, sub, name, data_type, unit, access: Access::ReadOnly, range: None }
}

const fn write(index: u16, sub: u8, name: &'static str, data_type: DataType, range: Option<[f32; 2]>) -> Object {
    Object { index, sub, name, data_type, unit: "", access: Access::WriteOnly, range }
}

const fn set(index: u16, sub: u8, name: &'static str, data_type: DataType, range: [f32; 2]) -> Object {
    Object { index, sub, name, data_type, unit: "", access: Access::ReadWrite, range: Some(range) }
}

use DataType::{Domain, Real32, Unsigned8, Unsigned16, Unsigned32, VisibleString};

/// Every object, by index and sub-index. Sub-index 0 of a record, its highest sub-index, goes without saying.
pub const OBJECTS: &[Object] = &[
    read(0x1000, 0, "device_type", Unsigned32, ""),
    read(0x1001, 0, "error_register", Unsigned8, ""),
    write(0x1010, 1, "store", Unsigned32, None),
    write(0x1011, 1, "restore", Unsigned32, None),
    read(0x1018, 1, "vendor_id", Unsigned32, ""),
    read(0x2000, 1, "gear", VisibleString, ""),
    read(0x2000, 2, "room_bytes", Unsigned32, "B"),
    read(0x2000, 3, "block_format", Unsigned16, ""),
    read(0x2000, 4, "scalar_kind", Unsigned8, ""),
    read(0x2000, 5, "turning_points", Unsigned16, ""),
    read(0x2001, 1, "origin", Unsigned8, ""),
    read(0x2001, 2, "sequence", Unsigned32, ""),
    read(0x2001, 3, "crc32", Unsigned32, ""),
    read(0x2001, 4, "length_bytes", Unsigned32, "B"),
    read(0x2001, 5, "stored_sequence", Unsigned32, ""),
    read(0x2001, 6, "boot_error", Unsigned16, ""),
    read(0x2001, 7, "enabled", Unsigned8, ""),
    read(0x2002, 1, "deflection_rad", Real32, "rad"),
    read(0x2002, 2, "torque_nm", Real32, "N·m"),
    read(0x2002, 3, "hysteresis_nm", Real32, "N·m"),
    read(0x2002, 4, "contribution_nm", Real32, "N·m"),
    read(0x2002, 5, "out_of_range", Unsigned8, ""),
    read(0x2002, 6, "refused", Unsigned8, ""),
    read(0x2002, 7, "ticks", Unsigned32, ""),
    read(0x2002, 8, "loop_cost", Unsigned32, ""),
    read(0x2003, 1, "samples_refused", Unsigned32, ""),
    read(0x2003, 2, "samples_out_of_range", Unsigned32, ""),
    read(0x2003, 3, "samples_quarantined", Unsigned32, ""),
    read(0x2003, 4, "new_starts", Unsigned32, ""),
    read(0x2003, 5, "torques_saturated", Unsigned32, ""),
    read(0x2003, 6, "turning_points_merged", Unsigned32, ""),
    read(0x2003, 7, "last_fault", Unsigned8, ""),
    read(0x2003, 8, "self_test", Unsigned8, ""),
    read(0x2003, 9, "requests_refused", Unsigned32, ""),
    read(0x2003, 10, "trials_expired", Unsigned32, ""),
    set(0x2004, 1, "compensation_on", Unsigned8, [0.0, 1.0]),
    set(0x2004, 2, "gain_ratio", Real32, [0.0, 1.0]),
    set(0x2004, 3, "bound_while_enabled", Real32, [0.0, f32::INFINITY]),
    read(IN_FORCE.0, IN_FORCE.1, "block_in_force", Domain, ""),
    write(STAGE.0, STAGE.1, "staged_block", Domain, None),
    write(0x2006, 1, "try_staged_block", Unsigned8, Some([1.0, 1.0])),
    write(0x2006, 2, "revert_trial", Unsigned8, Some([1.0, 1.0])),
    write(0x2006, 3, "clear_diagnostics", Unsigned8, Some([1.0, 1.0])),
    write(0x2006, 4, "erase_unreadable_slots", Unsigned32, None),
    read(ADAPTATION, 1, "taken_over", Unsigned8, ""),
    read(ADAPTATION, 2, "warnings", Unsigned16, ""),
    read(ADAPTATION, 3, "stretches", Unsigned32, ""),
    read(ADAPTATION, 4, "c1_in_force_ratio", Real32, ""),
    read(ADAPTATION, 5, "c2_in_force_ratio", Real32, ""),
    read(ADAPTATION, 6, "c3_in_force_ratio", Real32, ""),
    read(ADAPTATION, 7, "e_in_force_ratio", Real32, ""),
    read(ADAPTATION, 8, "h_in_force_ratio", Real32, ""),
    read(ADAPTATION, 9, "c1_shadow_ratio", Real32, ""),
    read(ADAPTATION, 10, "c2_shadow_ratio", Real32, ""),
    read(ADAPTATION, 11, "c3_shadow_ratio", Real32, ""),
    read(ADAPTATION, 12, "e_shadow_ratio", Real32, ""),
    read(ADAPTATION, 13, "h_shadow_ratio", Real32, ""),
    read(ADAPTATION, 14, "c1_deviation_ratio", Real32, ""),
    read(ADAPTATION, 15, "c2_deviation_ratio", Real32, ""),
    read(ADAPTATION, 16, "c3_deviation_ratio", Real32, ""),
    read(ADAPTATION, 17, "e_deviation_ratio", Real32, ""),
    read(ADAPTATION, 18, "h_deviation_ratio", Real32, ""),
];

/// The names of records by their index.
const RECORDS: [(u16, &str); 11] = [
    (0x1010, "store_parameters"),
    (0x1011, "restore_parameters"),
    (0x1018, "identity_object"),
    (0x2000, "identity"),
    (0x2001, "status"),
    (0x2002, "live"),
    (0x2003, "diagnostics"),
    (0x2004, "settings"),
    (0x2005, "block"),
    (0x2006, "commands"),
    (ADAPTATION, "adaptation"),
];

/// The name of a record; empty where there is none.
#[must_use]
pub fn record_name(index: u16) -> &'static str {
    RECORDS.iter().find(|(known, _)| *known == index).map_or("", |(_, name)| name)
}

/// The highest sub-index of a record; 0 where there is no such record.
#[must_use]
pub fn highest_sub(index: u16) -> u8 {
    OBJECTS.iter().filter(|object| object.index == index).map(|object| object.sub).max().unwrap_or(0)
}

/// The entry of an index and sub-index.
///
/// # Errors
/// There is no such index, or no such sub-index.
pub fn object(index: u16, sub: u8) -> Result<Object, Abort> {
    if let Some(object) = OBJECTS.iter().find(|object| (object.index, object.sub) == (index, sub)) {
        return Ok(*object);
    }
    match highest_sub(index) {
        0 if OBJECTS.iter().any(|object| object.index == index) => Err(Abort::NO_SUB),
        0 => Err(Abort::NO_OBJECT),
        _ if sub == 0 => Ok(read(index, 0, "highest_sub_index", Unsigned8, "")),
        _ => Err(Abort::NO_SUB),
    }
}

/// The bytes of a value that is no domain.
type Value = Vec<u8, 16>;

fn value(bytes: &[u8]) -> Value {
    // There is room: no value is longer.
    Value::from_slice(bytes).unwrap_or_default()
}

/// An entry of the record of an adaptation.
fn adapted(of: &Adapted, sub: u8) -> Value {
    match sub {
        1 => value(&[u8::from(of.taken_over)]),
        2 => value(&of.warnings.to_le_bytes()),
        3 => value(&of.stretches.to_le_bytes()),
        _ => {
            let mut ratios = of.in_force.iter().chain(&of.shadow).chain(&of.deviations);
            value(&ratios.nth(usize::from(sub) - 4).unwrap_or(&0.0).to_le_bytes())
        }
    }
}

impl<F: NorFlash, const ROOM: usize> Server<F, ROOM> {
    /// Copies the bytes of an object from `offset` on, and says how many it has as a whole.
    ///
    /// # Errors
    /// [`Abort`].
    pub fn read_object(
        &mut self,
        index: u16,
        sub: u8,
        drive: &mut impl Drive,
        offset: u32,
        to: &mut [u8],
    ) -> Result<u32, Abort> {
        if object(index, sub)?.access == Access::WriteOnly {
            return Err(Abort::WRITE_ONLY);
        }
        self.hear_bus();
        if (index, sub) == IN_FORCE {
            let length = self.status(drive).length;
            let count = to.len().min(length.saturating_sub(offset) as usize);
            self.read(offset, to.get_mut(..count).unwrap_or_default())?;
            return Ok(length);
        }
        let value = self.value(index, sub, drive);
        let rest = value.get(offset as usize..).unwrap_or_default();
        to.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        Ok(value.len() as u32)
    }

    fn value(&mut self, index: u16, sub: u8, drive: &mut impl Drive) -> Value {
        let u8 = |x: u8| value(&[x]);
        let u16 = |x: u16| value(&x.to_le_bytes());
        let u32 = |x: u32| value(&x.to_le_bytes());
        let f32 = |x: f32| value(&x.to_le_bytes());
        let (status, live, diagnostics) = (self.status(drive), drive.live(), self.diagnostics(drive));
        let (scalar, stack_depth) = drive.arithmetic();
        match (index, sub) {
            (0x1000, 0) | (0x1018, 1) => u32(0),
            (0x1001, 0) => u8(u8::from(status.boot_error != 0)),
            (0x2000, 1) => value(self.gear(drive).bytes()),
            (0x2000, 2) => u32(self.room() as u32),
            (0x2000, 3) => u16(FORMAT_VERSION),
            (0x2000, 4) => u8(scalar.bytes()[0]),
            (0x2000, 5) => u16(stack_depth),
            (0x2001, 1) => u8(status.origin as u8),
            (0x2001, 2) => u32(status.sequence),
            (0x2001, 3) => u32(status.crc),
            (0x2001, 4) => u32(status.length),
            (0x2001, 5) => u32(status.stored_sequence),
            (0x2001, 6) => u16(status.boot_error),
            (0x2001, 7) => u8(u8::from(status.enabled)),
            (0x2002, 1) => f32(live.deflection_rad),
            (0x2002, 2) => f32(live.torque_nm),
            (0x2002, 3) => f32(live.hysteresis_nm),
            (0x2002, 4) => f32(live.contribution_nm),
            (0x2002, 5) => u8(u8::from(live.out_of_range)),
            (0x2002, 6) => u8(u8::from(live.refused)),
            (0x2002, 7) => u32(live.ticks),
            (0x2002, 8) => u32(live.loop_cost),
            (0x2003, 1) => u32(diagnostics.joint.refused),
            (0x2003, 2) => u32(diagnostics.joint.out_of_range),
            (0x2003, 3) => u32(diagnostics.joint.quarantined),
            (0x2003, 4) => u32(diagnostics.joint.restarted),
            (0x2003, 5) => u32(diagnostics.joint.saturated),
            (0x2003, 6) => u32(diagnostics.joint.merged_pairs),
            (0x2003, 7) => u8(diagnostics.joint.last.number()),
            (0x2003, 8) => u8(diagnostics.joint.self_test.number()),
            (0x2003, 9) => u32(diagnostics.refused_requests),
            (0x2003, 10) => u32(diagnostics.expired_trials),
            (0x2004, 1) => u8(u8::from(status.compensating)),
            (0x2004, 2) => f32(status.gain_ratio),
            (0x2004, 3) => f32(diagnostics.bound),
            (ADAPTATION, 1..) => adapted(&drive.adaptation().unwrap_or_default(), sub),
            // Sub-index 0 of a record.
            _ => u8(highest_sub(index)),
        }
    }

    /// Whether an object may be written now.
    ///
    /// # Errors
    /// [`Abort`].
    pub fn admit_object(&mut self, index: u16, sub: u8) -> Result<Object, Abort> {
        let object = object(index, sub)?;
        if object.access == Access::ReadOnly {
            return Err(Abort::READ_ONLY);
        }
        self.admit_bus()?;
        Ok(object)
    }

    /// Writes an object that is no domain.
    ///
    /// # Errors
    /// [`Abort`]: nothing has changed.
    pub fn write_object(&mut self, index: u16, sub: u8, drive: &mut impl Drive, bytes: &[u8]) -> Result<(), Abort> {
        let object = self.admit_object(index, sub)?;
        if object.data_type.bytes() != Some(bytes.len()) {
            return Err(Abort::LENGTH);
        }
        let mut word = [0; 4];
        word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let word = u32::from_le_bytes(word);
        let number = if object.data_type == Real32 { f32::from_bits(word) } else { word as f32 };
        // A NaN lies in no range.
        if object.range.is_some_and(|[low, high]| !(low..=high).contains(&number)) {
            return Err(Abort::VALUE);
        }
        let on_trial = self.status(drive);
        let request = match (index, sub) {
            (0x1010, _) => Request::Commit { signature: word, crc: on_trial.crc },
            (0x1011, _) => Request::RollBack { signature: word, sequence: on_trial.stored_sequence },
            (0x2004, 1) => Request::Compensate { on: word == 1 },
            (0x2004, 2) => Request::Gain { ratio: number },
            (0x2004, _) => Request::Bound { share: number },
            (0x2006, 1) => Request::Try,
            (0x2006, 2) => Request::Revert,
            (0x2006, 4) => Request::EraseUnreadable { signature: word },
            _ => Request::ClearDiagnostics,
        };
        self.execute(request, drive, &mut [0; MOST_BYTES]).map(drop)?;
        Ok(())
    }

    /// Begins to write [`STAGE`], so many bytes.
    ///
    /// # Errors
    /// [`Abort`].
    pub fn begin_domain(&mut self, length: u32) -> Result<(), Abort> {
        self.admit_object(STAGE.0, STAGE.1)?;
        Ok(self.begin(length, None)?)
    }

    /// The next bytes of [`STAGE`].
    ///
    /// # Errors
    /// [`Abort`]: more than announced.
    pub fn write_domain(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Abort> {
        self.admit_object(STAGE.0, STAGE.1)?;
        Ok(self.take(offset, bytes)?)
    }
}
