//! Whether the bytes of a label are UTF-8, as [`core::str::from_utf8`] decides it, in a fifth of its code.

/// Whether these bytes are UTF-8 and then zeros: no byte missing, no overlong form, no surrogate, nothing beyond U+10FFFF.
#[inline(never)]
pub(super) fn is_padded_utf8(bytes: &[u8]) -> bool {
    let (mut further, mut least, mut most, mut ended) = (0, 0x80, 0xBF, false);
    for &byte in bytes {
        if further > 0 {
            if byte < least || byte > most {
                return false;
            }
            (further, least, most) = (further - 1, 0x80, 0xBF);
            continue;
        }
        if ended && byte != 0 {
            return false;
        }
        match byte {
            0 => ended = true,
            0x01..=0x7F => {}
            0xC2..=0xDF => further = 1,
            // No overlong form, no surrogate, nothing beyond U+10FFFF.
            0xE0 => (further, least) = (2, 0xA0),
            0xED => (further, most) = (2, 0x9F),
            0xE1..=0xEF => further = 2,
            0xF0 => (further, least) = (3, 0x90),
            0xF4 => (further, most) = (3, 0x8F),
            0xF1..=0xF3 => further = 3,
            _ => return false,
        }
    }
    further == 0
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
