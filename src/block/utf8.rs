//! Whether the bytes of a label are UTF-8, as [`core::str::from_utf8`] decides it, in a fifth of its code.

/// Whether these bytes are UTF-8 and then zeros: no byte missing, no overlong form, no surrogate, nothing beyond U+10FFFF.
#[inline(never)]
pub(super) fn is_padded_utf8(bytes: &[u8]) -> bool {
    let mut rest = bytes.iter();
    let mut ended = false;
    while let Some(&first) = rest.next() {
        if ended && first != 0 {
            return false;
        }
        let (further, bits) = match first {
            0x00..=0x7F => {
                ended |= first == 0;
                continue;
            }
            0xC2..=0xDF => (1, first & 0x1F),
            0xE0..=0xEF => (2, first & 0x0F),
            0xF0..=0xF4 => (3, first & 0x07),
            _ => return false,
        };
        let mut code = u32::from(bits);
        for _ in 0..further {
            match rest.next() {
                Some(&byte) if byte & 0xC0 == 0x80 => code = code << 6 | u32::from(byte & 0x3F),
                _ => return false,
            }
        }
        let least = if further == 3 { 0x1_0000 } else { 0x80 << (4 * (further - 1)) };
        if code < least || code > 0x10_FFFF || code >> 11 == 0x1B {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::is_padded_utf8;

    /// The same by the standard library.
    fn reference(bytes: &[u8]) -> bool {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let (label, padding) = bytes.split_at(end);
        core::str::from_utf8(label).is_ok() && padding.iter().all(|byte| *byte == 0)
    }

    #[test]
    fn it_decides_as_the_standard_library() {
        // Every first two bytes, with third and fourth ones from the edges of the ranges.
        let edges = [0x00, 0x41, 0x7F, 0x80, 0x8F, 0x90, 0x9F, 0xA0, 0xBF, 0xC0, 0xC2, 0xE0, 0xED, 0xF4, 0xFF];
        for first in 0..=u8::MAX {
            for second in 0..=u8::MAX {
                for third in edges {
                    for fourth in edges {
                        let bytes = [first, second, third, fourth];
                        for length in 0..=4 {
                            let part = bytes.get(..length).unwrap_or_default();
                            assert_eq!(is_padded_utf8(part), reference(part), "{part:x?}");
                        }
                    }
                }
            }
        }
    }
}
