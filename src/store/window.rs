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
        copy(&mut window.0, bytes);
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

/// Copies as many bytes as both have. No panic is left in it, as one is in `copy_from_slice` where the compiler cannot tell that the lengths agree.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
