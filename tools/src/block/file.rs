//! The files that a block stands in.
//!
//! | name | what | read by |
//! |---|---|---|
//! | `.bin` | the bytes | every programmer, `gmhm flash` |
//! | `.hex` | Intel HEX at an address | every programmer |
//! | `.h` | an array of bytes in C | a firmware's own build |

use std::fmt::Write as _;
use std::path::Path;

use gmhm::block::{Block, verify};
use ihex::{Reader, Record};

use super::error::FileError;

/// The form of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// The bytes.
    Binary,
    /// Intel HEX.
    IntelHex,
    /// A header for C.
    CHeader,
}

impl Form {
    /// The form that a file's name ends in.
    ///
    /// # Errors
    /// Another ending.
    pub fn of(path: &Path) -> Result<Self, FileError> {
        match path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("bin") => Ok(Self::Binary),
            Some("hex") => Ok(Self::IntelHex),
            Some("h") => Ok(Self::CHeader),
            _ => Err(FileError::Form(path.to_owned())),
        }
    }
}

/// Data bytes of one line of Intel HEX.
const HEX_LINE: usize = 16;
/// Bytes of one line of C.
const C_LINE: usize = 12;

/// The text or bytes of a file of this form. `address` is where Intel HEX puts the block.
///
/// # Errors
/// An address where the block does not fit.
pub fn write(form: Form, path: &Path, block: &Block<'_>, address: u32) -> Result<Vec<u8>, FileError> {
    match form {
        Form::Binary => Ok(block.bytes().to_vec()),
        Form::IntelHex => intel_hex(block.bytes(), address),
        Form::CHeader => Ok(c_header(path, block).into_bytes()),
    }
}

fn intel_hex(bytes: &[u8], address: u32) -> Result<Vec<u8>, FileError> {
    let refused = || FileError::Address { address, length: bytes.len() };
    let end = u32::try_from(bytes.len()).ok().and_then(|length| address.checked_add(length)).ok_or_else(refused)?;
    let mut records = Vec::new();
    let (mut at, mut rest, mut upper) = (address, bytes, None);
    while at < end {
        if upper != Some(at >> 16) {
            upper = Some(at >> 16);
            records.push(Record::ExtendedLinearAddress((at >> 16) as u16));
        }
        // A line ends where its addresses would carry.
        let room = HEX_LINE.min(0x1_0000 - (at as usize & 0xffff));
        let (line, behind) = rest.split_at(room.min(rest.len()));
        records.push(Record::Data { offset: at as u16, value: line.to_vec() });
        (at, rest) = (at + line.len() as u32, behind);
    }
    records.push(Record::EndOfFile);
    let text = ihex::create_object_file_representation(&records).map_err(|_| refused())?;
    Ok(text.into_bytes())
}

fn c_header(path: &Path, block: &Block<'_>) -> String {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let name: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect();
    let name = format!("gmhm_{name}");
    let guard = name.to_uppercase() + "_H";
    let (header, bytes) = (block.header(), block.bytes());
    let mut text = format!(
        "/* Parameter block of gear \"{}\", format {}, CRC-32 0x{:08x}. Written by gmhm pack; do not edit. */\n\
         #ifndef {guard}\n#define {guard}\n\n#include <stdint.h>\n\nstatic const uint8_t {name}[{}] = {{\n",
        comment(header.identity.label()),
        gmhm::block::FORMAT_VERSION,
        block.crc(),
        bytes.len(),
    );
    for line in bytes.chunks(C_LINE) {
        let line: Vec<String> = line.iter().map(|byte| format!("0x{byte:02x}")).collect();
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {},", line.join(", "));
    }
    text + "};\n\n#endif\n"
}

/// A text that does not end a comment.
fn comment(text: &str) -> String {
    text.replace("*/", "* /").replace(char::is_control, " ")
}

/// A block as it was read, and where Intel HEX had put it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockFile {
    /// The bytes of the block.
    pub bytes: Vec<u8>,
    /// The address of its first byte; `None` in `.bin`.
    pub address: Option<u32>,
}

/// Reads a `.bin` or `.hex`, whatever its name, and verifies the block in it.
///
/// # Errors
/// [`FileError`].
pub fn read(path: &Path) -> Result<BlockFile, FileError> {
    let bytes = std::fs::read(path).map_err(|error| FileError::Unreadable { path: path.to_owned(), error })?;
    let file = match std::str::from_utf8(&bytes) {
        Ok(text) if text.trim_start().starts_with(':') => read_hex(path, text)?,
        _ => BlockFile { bytes, address: None },
    };
    verify(&file.bytes).map_err(|error| FileError::Block { path: path.to_owned(), error })?;
    Ok(file)
}

fn read_hex(path: &Path, text: &str) -> Result<BlockFile, FileError> {
    let mut file = BlockFile { bytes: Vec::new(), address: None };
    let mut upper = 0_u32;
    for (line, record) in Reader::new(text).enumerate() {
        let refused = |error: String| FileError::Hex { path: path.to_owned(), line: line + 1, error };
        match record.map_err(|error| refused(error.to_string()))? {
            Record::Data { offset, value } => {
                let at = upper + u32::from(offset);
                let first = *file.address.get_or_insert(at);
                if u64::from(at) != u64::from(first) + file.bytes.len() as u64 {
                    return Err(refused(format!("a gap before the address {at:#x}")));
                }
                file.bytes.extend(value);
            }
            Record::ExtendedLinearAddress(high) => upper = u32::from(high) << 16,
            Record::ExtendedSegmentAddress(segment) => upper = u32::from(segment) << 4,
            Record::EndOfFile => break,
            Record::StartLinearAddress(_) | Record::StartSegmentAddress { .. } => {}
        }
    }
    Ok(file)
}
