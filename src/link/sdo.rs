//! An SDO server of CANopen (CiA 301) over the [object dictionary](super::objects): expedited and segmented transfers, one client.
//!
//! ```text
//! COB-ID 600h + node (client → drive)   8 bytes in → [`SdoServer::answer`]
//! COB-ID 580h + node (drive → client)   8 bytes out
//! ```
//!
//! Block transfers are aborted; clients then fall back to segments.

use embedded_storage::nor_flash::NorFlash;

use super::drive::Drive;
use super::objects::{Abort, STAGE, object};
use super::server::Server;

/// The data of a CAN frame.
pub type CanData = [u8; 8];

/// Bytes of a segment.
const SEGMENT: usize = 7;
/// The most bytes of an object that is no domain and may be written.
const MOST_WRITTEN: usize = 4;

/// One client's transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SdoServer {
    transfer: Transfer,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Transfer {
    #[default]
    Idle,
    /// To the client.
    Upload { index: u16, sub: u8, offset: u32, toggle: bool },
    /// From the client; `short` holds what is no domain.
    Download { index: u16, sub: u8, offset: u32, toggle: bool, short: [u8; MOST_WRITTEN] },
}

impl SdoServer {
    /// No transfer.
    #[must_use]
    pub const fn new() -> Self {
        Self { transfer: Transfer::Idle }
    }

    /// Answers a frame of the client; `None` for an abort, which is not answered.
    #[must_use]
    pub fn answer<F: NorFlash, const ROOM: usize>(
        &mut self,
        frame: &CanData,
        server: &mut Server<F, ROOM>,
        drive: &mut impl Drive,
    ) -> Option<CanData> {
        let [command, i0, i1, sub, data @ ..] = *frame;
        let asked = (u16::from_le_bytes([i0, i1]), sub);
        // Segments carry no index: that of the transfer stands in an abort.
        let (index, sub) = match self.transfer {
            Transfer::Upload { index, sub, .. } | Transfer::Download { index, sub, .. }
                if command >> 5 == 0 || command >> 5 == 3 =>
            {
                (index, sub)
            }
            _ => asked,
        };
        let answer = match command >> 5 {
            0 => self.download_segment(frame, server, drive),
            1 => self.begin_download(command, (index, sub), data, server, drive),
            2 => self.begin_upload((index, sub), server, drive),
            3 => self.upload_segment(command, server, drive),
            4 => {
                self.transfer = Transfer::Idle;
                return None;
            }
            _ => Err(Abort::COMMAND),
        };
        Some(answer.unwrap_or_else(|Abort(code)| {
            self.transfer = Transfer::Idle;
            with_index(0x80, (index, sub), code.to_le_bytes())
        }))
    }

    fn begin_download<F: NorFlash, const ROOM: usize>(
        &mut self,
        command: u8,
        (index, sub): (u16, u8),
        data: [u8; 4],
        server: &mut Server<F, ROOM>,
        drive: &mut impl Drive,
    ) -> Result<CanData, Abort> {
        let (expedited, sized) = (command & 2 != 0, command & 1 != 0);
        if expedited {
            // Without a size the length is the object's.
            let unused = usize::from(command >> 2 & 3);
            let count = if sized { 4 - unused } else { object(index, sub)?.data_type.bytes().unwrap_or(4) };
            self.transfer = Transfer::Idle;
            server.write_object(index, sub, drive, data.get(..count).ok_or(Abort::LENGTH)?)?;
        } else {
            let length = u32::from_le_bytes(data);
            if (index, sub) == STAGE {
                // What is to come is announced: no drive has room for any length.
                server.begin_domain(if sized { length } else { return Err(Abort::LENGTH) })?;
            } else {
                let object = server.admit_object(index, sub)?;
                if sized && object.data_type.bytes() != Some(length as usize) {
                    return Err(Abort::LENGTH);
                }
            }
            self.transfer = Transfer::Download { index, sub, offset: 0, toggle: false, short: [0; MOST_WRITTEN] };
        }
        Ok(with_index(0x60, (index, sub), [0; 4]))
    }

    fn download_segment<F: NorFlash, const ROOM: usize>(
        &mut self,
        [command, data @ ..]: &CanData,
        server: &mut Server<F, ROOM>,
        drive: &mut impl Drive,
    ) -> Result<CanData, Abort> {
        let Transfer::Download { index, sub, offset, toggle, mut short } = self.transfer else {
            return Err(Abort::COMMAND);
        };
        check_toggle(*command, toggle)?;
        let count = SEGMENT - usize::from(command >> 1 & 7);
        let bytes = data.get(..count).ok_or(Abort::COMMAND)?;
        let (is_last, end) = (command & 1 != 0, offset.saturating_add(count as u32));
        if (index, sub) == STAGE {
            server.write_domain(offset, bytes)?;
        } else {
            let to = short.get_mut(offset as usize..end as usize).ok_or(Abort::LENGTH)?;
            to.copy_from_slice(bytes);
            if is_last {
                server.write_object(index, sub, drive, short.get(..end as usize).ok_or(Abort::LENGTH)?)?;
            }
        }
        self.transfer = if is_last {
            Transfer::Idle
        } else {
            Transfer::Download { index, sub, offset: end, toggle: !toggle, short }
        };
        Ok([0x20 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0])
    }

    fn begin_upload<F: NorFlash, const ROOM: usize>(
        &mut self,
        (index, sub): (u16, u8),
        server: &mut Server<F, ROOM>,
        drive: &mut impl Drive,
    ) -> Result<CanData, Abort> {
        let mut data = [0; 4];
        let length = server.read_object(index, sub, drive, 0, &mut data)?;
        if let Ok(count @ 1..=4) = u8::try_from(length) {
            self.transfer = Transfer::Idle;
            return Ok(with_index(0x43 | (4 - count) << 2, (index, sub), data));
        }
        self.transfer = Transfer::Upload { index, sub, offset: 0, toggle: false };
        Ok(with_index(0x41, (index, sub), length.to_le_bytes()))
    }

    fn upload_segment<F: NorFlash, const ROOM: usize>(
        &mut self,
        command: u8,
        server: &mut Server<F, ROOM>,
        drive: &mut impl Drive,
    ) -> Result<CanData, Abort> {
        let Transfer::Upload { index, sub, offset, toggle } = self.transfer else { return Err(Abort::COMMAND) };
        check_toggle(command, toggle)?;
        let mut data = [0; SEGMENT];
        let rest = server.read_object(index, sub, drive, offset, &mut data)?.saturating_sub(offset);
        let count = rest.min(SEGMENT as u32) as u8;
        let is_last = rest <= SEGMENT as u32;
        self.transfer = if is_last {
            Transfer::Idle
        } else {
            Transfer::Upload { index, sub, offset: offset + SEGMENT as u32, toggle: !toggle }
        };
        let [a, b, c, d, e, f, g] = data;
        let head = u8::from(toggle) << 4 | (SEGMENT as u8 - count) << 1 | u8::from(is_last);
        Ok([head, a, b, c, d, e, f, g])
    }
}

fn check_toggle(command: u8, expected: bool) -> Result<(), Abort> {
    if (command & 0x10 != 0) == expected { Ok(()) } else { Err(Abort::TOGGLE) }
}

fn with_index(command: u8, (index, sub): (u16, u8), [a, b, c, d]: [u8; 4]) -> CanData {
    let [i0, i1] = index.to_le_bytes();
    [command, i0, i1, sub, a, b, c, d]
}
