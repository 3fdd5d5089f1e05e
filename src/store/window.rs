//! The few bytes of flash that the store looks at together.

/// Its size: a multiple of what flashes read and write at least.
pub(super) const WINDOW_BYTES: usize = 64;

/// A piece of flash, aligned to its own size.
pub(super) struct Window([u8; WINDOW_BYTES]);

impl Default for Window {
    fn default() -> Self {
        Self([0xFF; WINDOW_BYTES])
    }
}

impl Window {
    /// At most 64 bytes, the rest as erased.
    pub(super) fn padded(bytes: &[u8]) -> Self {
        let mut window = Self::default();
        window.0.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        window
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.0
    }

    pub(super) fn first(&self, count: usize) -> &[u8] {
        self.between(0, count)
    }

    pub(super) fn between(&self, from: usize, to: usize) -> &[u8] {
        self.0.get(from..to).unwrap_or(&[])
    }
}
