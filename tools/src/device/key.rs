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
    let mut key = [0; KEY_BYTES];
    hex::decode_to_slice(text.trim(), &mut key)
        .map_err(|_| refused(format!("it must hold {} hexadecimal digits", 2 * KEY_BYTES)))?;
    Ok(Key(key))
}
