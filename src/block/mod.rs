//! Parameter blocks: what a drive keeps of a model file, ready for its arithmetic.
//!
//! A block is a header, tagged records of 32-bit words and a CRC-32; `docs/block.md` specifies every byte. [`RECORDS`] is the registry of the fixed records,
//! [`KINDS`](crate::terms::KINDS) that of the terms: names, units, ranges and words for the layout, the checks and the docs.
//!
//! | step | what | refuses |
//! |---|---|---|
//! | [`verify`] | magic, version, header, length, CRC-32, the walk over the records | bytes that are no block, or not the whole of one |
//! | [`Parameters::load`] | every word against its range; gear, inverse and terms, the set-up taken from the block | values that cannot be, records that this firmware does not know, a gear without its set-up |
//! | [`Parameters::load_any`] | the same, gear and inverse set up in double precision | values that cannot be, records that this firmware does not know |
//! | [`Prepared::load`] | the words of law and inverse as the host has computed them: less flash, stack and time | as `verify`, and a block without them |
//! | [`self_test`] | golden samples computed anew | an arithmetic that computes otherwise than the host's |
//!
//! Nothing is changed by a refusal, and whatever the bytes, nothing panics. Coefficients are stored as the host rounded them, so the gear of a block computes
//! the bits of the gear of its model file on every machine.
//!
//! ```
//! use gmhm::block::{Header, Identity, Joint, Parameters, ScalarKind, Writer};
//! use gmhm::{Elastic, Inverse, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let params = Params::new(1.168e-3, elastic, memory)?;
//!
//! // On the host: the block of these parameters.
//! let inverse = Inverse::<f32>::new(&params)?;
//! let gear = inverse.gear();
//! let mut buffer = [0; 512];
//! let mut writer = Writer::new(&mut buffer, Header::new(Identity::of_name("joint 3"), ScalarKind::F32));
//! writer.gear(gear, &params)?;
//! writer.inverse::<f32>(&params, 0.0)?;
//! writer.self_test(gear, Some(&inverse))?; // computed anew by the drive; a block that comes out otherwise is refused
//! writer.prepared(&inverse)?; // the set-up, which the drive takes over
//! writer.joint(&Joint::default())?;
//! let length = writer.finish()?;
//!
//! // On the drive: the same gear, bit by bit.
//! let loaded = Parameters::<f32>::load(&buffer[..length], 16)?;
//! assert_eq!(loaded.gear.as_ref(), Some(gear));
//! assert_eq!(loaded.header.identity.label(), "joint 3");
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod agreement;
mod crc;
mod error;
mod header;
pub(crate) mod joint;
mod law;
mod layout;
mod parameters;
pub mod prepared;
pub(crate) mod record;
mod scales;
pub mod self_test;
mod term;
mod utf8;
mod word;
mod write;

pub use agreement::check_set_up;
#[cfg(feature = "store")]
pub(crate) use crc::Digest;
pub use crc::crc32;
pub use error::{BlockError, sdo_abort};
pub use header::{FORMAT_VERSION, HEADER_BYTES, Header, Identity, MAGIC, TorqueUnit};
pub use joint::{Joint, JointRecord};
pub use law::{BlockLaw, LawWords};
pub use layout::{
    Coding, FIRST_TERM, FieldInfo, GEAR, INVERSE, JOINT, LARGEST_STEP, MASING, MAY_SKIP, NAME, PHASE, PREPARED,
    PREPARED_GEAR, RECORDS, RecordInfo, SELF_TEST, TIME,
};
pub use parameters::{CheckedTerms, Parameters, TermStack};
pub use prepared::{Prepared, PreparedLaw};
pub use record::{Block, FieldValues, MOST_BYTES, Record, Records, verify, verify_first};
pub use scales::{Scales, ScalesRecord};
pub use term::TermRecord;
#[cfg(feature = "link")]
pub(crate) use term::digest_beside_gear;
pub use word::{ScalarKind, Word};
pub use write::{Writer, stamp};
