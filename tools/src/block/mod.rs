//! Parameter blocks on the host: from a model file, into files of the kinds that firmware builds and programmers read, and back in words.
//!
//! The format is the core's, [`gmhm::block`].

mod contents;
mod eds;
mod error;
mod file;
mod pack;

pub use contents::{Contents, Quantity, Section, Shown};
pub use eds::eds;
pub use error::{FileError, PackError};
pub use file::{BlockFile, Form, read, write};
pub(crate) use pack::Rounded;
pub use pack::pack;
pub use pack::{Arithmetic, DRIVE_TERMS, PackOptions, Packed, params_of, with_params};
