//! A running FNV-1a hash of words.

/// A running FNV-1a hash of words.
pub struct Hash(u64);

impl Hash {
    /// The hash of nothing.
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds one word.
    pub fn add(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// The upper word.
    pub fn high(&self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The lower word.
    pub fn low(&self) -> u32 {
        self.0 as u32
    }
}
