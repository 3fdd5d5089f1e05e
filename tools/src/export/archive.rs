//! A ZIP archive, as FMI asks for (APPNOTE 6.3.3): deflated, without dates, so that the same files give the same bytes.

use std::io::Write;

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// 1 January 1980, the first date of the format.
const DATE: u16 = 0x0021;
/// Version 2.0 of the format: deflated files and folders.
const VERSION: u16 = 20;
/// Method "deflated".
const DEFLATED: u16 = 8;
/// Names in UTF-8.
const FLAGS: u16 = 0x0800;
/// A regular file that everybody may read and, as a shared library, execute.
const ATTRIBUTES: u32 = 0o100_755 << 16;
/// Made on Unix, which the attributes are of.
const MADE_BY: u16 = 3 << 8 | VERSION;

/// The bytes of an archive of these files.
///
/// # Errors
/// A file beyond 4 GiB.
pub fn zip(files: &[(String, Vec<u8>)]) -> std::io::Result<Vec<u8>> {
    let (mut archive, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let mut crc = Crc::new();
        crc.update(bytes);
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes)?;
        let packed = encoder.finish()?;
        let offset = size(archive.len())?;
        let mut entry = Vec::new();
        for word in [VERSION, FLAGS, DEFLATED, 0, DATE] {
            entry.extend(word.to_le_bytes());
        }
        for word in [crc.sum(), size(packed.len())?, size(bytes.len())?] {
            entry.extend(word.to_le_bytes());
        }
        for word in [short(name.len())?, 0] {
            entry.extend(word.to_le_bytes());
        }
        archive.extend(b"PK\x03\x04");
        archive.extend(&entry);
        archive.extend(name.as_bytes());
        archive.extend(&packed);
        directory.extend(b"PK\x01\x02");
        directory.extend(MADE_BY.to_le_bytes());
        directory.extend(&entry);
        // No comment, first disk, no text.
        directory.extend([0; 6]);
        directory.extend(ATTRIBUTES.to_le_bytes());
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (offset, length, count) = (size(archive.len())?, size(directory.len())?, short(files.len())?);
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    archive.extend([length.to_le_bytes(), offset.to_le_bytes()].concat());
    archive.extend([0; 2]);
    Ok(archive)
}

fn size(length: usize) -> std::io::Result<u32> {
    u32::try_from(length).map_err(|_| std::io::Error::other("an archive holds at most 4 GiB"))
}

fn short(length: usize) -> std::io::Result<u16> {
    u16::try_from(length)
        .map_err(|_| std::io::Error::other("an archive holds at most 65535 files and letters of a name"))
}
