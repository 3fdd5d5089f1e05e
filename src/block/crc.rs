//! CRC-32/ISO-HDLC, half a byte at a time: a table of 16 words, so that a loader stays small.

/// The remainders of the 16 half bytes by the reflected polynomial 0xEDB88320.
const TABLE: [u32; 16] = table();

const fn table() -> [u32; 16] {
    let mut table = [0; 16];
    let mut k = 0;
    while k < 16 {
        let (mut remainder, mut bit) = (k as u32, 0);
        while bit < 4 {
            remainder = (remainder >> 1) ^ (0xEDB8_8320 & (remainder & 1).wrapping_neg());
            bit += 1;
        }
        table[k] = remainder;
        k += 1;
    }
    table
}

/// A call of its own: a loop around it is not unrolled.
#[inline(never)]
const fn add(remainder: u32, byte: u8) -> u32 {
    let low = remainder ^ byte as u32;
    let half = low >> 4 ^ TABLE[(low & 15) as usize];
    half >> 4 ^ TABLE[(half & 15) as usize]
}

/// A check in progress.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Digest(u32);

impl Digest {
    pub(crate) const fn new() -> Self {
        Self(u32::MAX)
    }

    pub(crate) const fn update(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while let Some((byte, tail)) = rest.split_first() {
            self.0 = add(self.0, *byte);
            rest = tail;
        }
    }

    pub(crate) const fn finalize(self) -> u32 {
        !self.0
    }
}

/// The check of blocks and of the link's frames: CRC-32/ISO-HDLC (polynomial 0x04C11DB7, reflected, initially and finally inverted).
///
/// ```
/// assert_eq!(gmhm::block::crc32(b"123456789"), 0xCBF4_3926);
/// ```
#[must_use]
pub const fn crc32(bytes: &[u8]) -> u32 {
    let mut digest = Digest::new();
    digest.update(bytes);
    digest.finalize()
}
