//! Blocks without physics: a header, one record that any reader may skip, a CRC-32.

use gmhm::block::{HEADER_BYTES, Header, Identity, ScalarKind, crc32, verify};

/// The fewest bytes of such a block.
pub const LEAST: usize = HEADER_BYTES + 8;

/// A block of `length` bytes, a multiple of four, its filling made of `seed`.
pub fn block(length: usize, sequence: u32, identity: Identity, seed: u8) -> Vec<u8> {
    let header = Header { length: length as u32, sequence, records: 1, ..Header::new(identity, ScalarKind::F32) };
    let mut bytes = header.encode().to_vec();
    bytes.extend(0x80FF_u16.to_le_bytes());
    bytes.extend(u16::try_from(length - LEAST).expect("a small block").to_le_bytes());
    // Zeros, ones and mixed bytes, and now and then the magic of a block.
    let filling = (0..length - LEAST).map(|k| match (k / 16 + usize::from(seed)) % 4 {
        0 => 0x00,
        1 => 0xFF,
        2 => b"GMHM"[k % 4],
        _ => (k as u8).wrapping_mul(37) ^ seed,
    });
    bytes.extend(filling);
    bytes.extend(crc32(&bytes).to_le_bytes());
    assert!(verify(&bytes).is_ok());
    bytes
}
