//! The serial port of a drive: read what is in force, try other parameters, keep them, go back.
//!
//! `docs/link.md` specifies every byte. Requests and answers are COBS frames with a CRC-32; the host of this crate uses the very code of the drive.
//!
//! | file | what |
//! |---|---|
//! | [`frame`] | bytes on the line to bodies and back |
//! | [`adaptation`] | what an adaptation on the drive has learnt |
//! | [`message`] | bodies to requests and answers and back |
//! | `lock` | access by key, with the feature `lock` |
//! | [`refusal`] | why a request was refused, and its CANopen abort code |
//! | [`drive`] | what the link asks of a drive |
//! | [`server`] | the drive's end, whatever carries requests: a [`Server`] over a [`Store`](crate::store::Store) and a [`Drive`] |
//! | [`port`] | requests over a serial line |
//! | [`objects`] | requests as objects with indices, for CANopen, EtherCAT, Modbus |
//! | [`sdo`] | these objects over SDO of CANopen |
//!
//! The way of a block: [`Stage`](Request::Stage) and [`Data`](Request::Data) carry it into RAM, [`Try`](Request::Try) puts it in force there,
//! [`Commit`](Request::Commit) stores what is on trial, [`Revert`](Request::Revert) ends the trial. What changes anything carries the number of its session
//! and of its turn in it, so that a frame which is lost, repeated or late changes nothing, and nothing after it does.

mod abort;
pub mod adaptation;
pub mod drive;
pub mod frame;
mod hysteresis;
#[cfg(feature = "lock")]
pub mod lock;
pub mod message;
mod object;
pub mod objects;
pub mod port;
mod rating;
pub mod refusal;
pub mod sdo;
pub mod server;

pub use adaptation::Adapted;
pub use drive::{CompensationSetting, Drive};
pub use frame::{Frame, LineCounts, Receiver};
pub use message::{Answer, Asked, Identified, LinkDiagnostics, Live, Origin, Request, Status, Tag};
pub use port::Port;
pub use refusal::{Refusal, Refused};
pub use sdo::SdoServer;
pub use server::Server;
