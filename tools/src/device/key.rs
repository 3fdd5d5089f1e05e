//! The key of a drive in a file: 64 hexadecimal digits.

use std::path::Path;

use gmhm::link::lock::{KEY_BYTES, Key};

use super::error::DeviceError;

/// Reads a key. White space around it is skipped.
///
/// # Errors
/// [`DeviceError::Key`]: no file, or no key in it.
pub fn read(path: &Path) -> Result<Key, DeviceError> {
    let refused = |problem: String| DeviceError::Key { path: path.to_owned(), problem };
    let text = std::fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
    let digits = text.trim().as_bytes();
    let mut key = [0; KEY_BYTES];
    let wrong = || refused(format!("it must hold {} hexadecimal digits", 2 * KEY_BYTES));
    if digits.len() != 2 * KEY_BYTES {
        return Err(wrong());
    }
    for (byte, pair) in key.iter_mut().zip(digits.chunks(2)) {
        let digit = |at: usize| pair.get(at).and_then(|digit| char::from(*digit).to_digit(16));
        let (high, low) = digit(0).zip(digit(1)).ok_or_else(wrong)?;
        *byte = (high << 4 | low) as u8;
    }
    Ok(Key(key))
}
