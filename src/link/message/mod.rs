//! Requests and answers, and their bodies.
//!
//! | file | what |
//! |---|---|
//! | `request` | what a host asks of a drive |
//! | `answer` | what the drive answers |
//! | `report` | what an answer says of a drive |
//! | `coding` | numbers to bytes and back |

mod answer;
mod coding;
mod report;
mod request;

use super::frame;

pub use answer::Answer;
pub use report::{Identified, LinkDiagnostics, Live, Origin, Status};
pub use request::{Asked, Request};

/// The version of the protocol, the first byte of every body.
pub const VERSION: u8 = 1;

/// The most bytes of a block in one [`Request::Data`] or [`Answer::Bytes`].
pub const MOST_BYTES: usize = 128;

/// What [`Request::Commit`] must carry: "save", as object 1010h of CANopen.
pub const SAVE: u32 = u32::from_le_bytes(*b"save");

/// What [`Request::RollBack`] must carry: "load", as object 1011h of CANopen.
pub const LOAD: u32 = u32::from_le_bytes(*b"load");

/// What [`Request::EraseUnreadable`] must carry: "eras".
pub const ERASE: u32 = u32::from_le_bytes(*b"eras");

/// Bytes of a proof at the end of a body: see `docs/link.md`, access.
pub const PROOF_BYTES: usize = 16;

// The longest bodies: version, command, tag, refusal, detail, offset, bytes; version, command, tag, offset, bytes, proof.
const _: () = assert!(2 + 8 + 3 + 4 + MOST_BYTES <= frame::MOST_BODY);
const _: () = assert!(2 + 8 + 4 + MOST_BYTES + PROOF_BYTES <= frame::MOST_BODY);

/// Set in the command of an answer, so that a line which echoes is not taken for a drive.
const ANSWER: u8 = 0x80;

/// Set in the command of a request whose body ends with a proof.
const PROVEN: u8 = 0x40;

/// Which request this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tag {
    /// The session, as [`Identified::session`] has opened it. Free in requests that change nothing.
    pub session: u32,
    /// Its turn among the session's requests that change something: 0, 1, 2, … Free in the others.
    pub turn: u32,
}
