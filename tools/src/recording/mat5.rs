//! MAT files of level 5, as MATLAB writes them by `save -v7` and SciPy by `savemat`.
//!
//! The file is a row of tagged elements (MATLAB's "MAT-File Format", 2019, chapter 1). Read of them are arrays of numbers, alone and in structures and cells; strings, sparse and
//! complex arrays and objects are passed over. The crates for this format stop at flat arrays, or panic on damaged files.

use std::io::Read;

use super::bytes::{Cursor, Damage, Number};
use super::error::RecordingError;
use super::format::Format;
use super::samples::Samples;
use super::table::{Arrays, ColumnHead, Table};

/// The arrays of a MAT file.
pub(super) struct Mat5Table(Arrays);

const HEADER: usize = 128;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const COMPLEX: u32 = 0x0800;
/// Structures in structures so deep are no recording.
const DEEPEST: usize = 16;

impl Mat5Table {
    pub(super) fn open(file: &str, bytes: &[u8]) -> Result<Self, RecordingError> {
        let mut arrays = Arrays::default();
        variables(bytes, &mut arrays).map_err(|damage| damage.of(file, Format::Mat5))?;
        Ok(Mat5Table(arrays))
    }
}

impl Table for Mat5Table {
    fn heads(&self) -> &[ColumnHead] {
        self.0.heads()
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        Ok(self.0.read(columns))
    }
}

fn variables(bytes: &[u8], arrays: &mut Arrays) -> Result<(), Damage> {
    let big_endian = match bytes.get(HEADER - 2..HEADER) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(Damage("its header is cut off".to_owned())),
    };
    let mut file = Cursor { at: HEADER, big_endian, ..Cursor::new(bytes) };
    while file.left() >= 8 {
        let element = element(&mut file)?;
        match element.kind {
            MATRIX => array(element.data(big_endian), None, arrays, 0)?,
            COMPRESSED => {
                let mut plain = Vec::new();
                flate2::read::ZlibDecoder::new(element.bytes).read_to_end(&mut plain)?;
                let mut inside = Cursor { big_endian, ..Cursor::new(&plain) };
                let inner = self::element(&mut inside)?;
                if inner.kind == MATRIX {
                    array(inner.data(big_endian), None, arrays, 0)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// A tagged element.
struct Element<'a> {
    kind: u32,
    bytes: &'a [u8],
}

impl<'a> Element<'a> {
    fn data(&self, big_endian: bool) -> Cursor<'a> {
        Cursor { big_endian, ..Cursor::new(self.bytes) }
    }

    /// The numbers of it; `None` for text.
    fn numbers(&self, big_endian: bool) -> Option<Vec<f64>> {
        let (number, size) = match self.kind {
            1 => (Number::Signed, 1),
            2 => (Number::Unsigned, 1),
            3 => (Number::Signed, 2),
            4 => (Number::Unsigned, 2),
            5 => (Number::Signed, 4),
            6 => (Number::Unsigned, 4),
            7 => (Number::Float, 4),
            9 => (Number::Float, 8),
            12 => (Number::Signed, 8),
            13 => (Number::Unsigned, 8),
            _ => return None,
        };
        Some(number.all(self.bytes, size, big_endian))
    }
}

fn element<'a>(from: &mut Cursor<'a>) -> Result<Element<'a>, Damage> {
    let tag = from.u32()?;
    if tag >> 16 != 0 {
        // Up to four bytes stand within the tag.
        let bytes = from.take(4)?;
        return Ok(Element { kind: tag & 0xffff, bytes: &bytes[..4.min((tag >> 16) as usize)] });
    }
    let size = from.u32()? as usize;
    let bytes = from.take(size)?;
    // Compressed elements are not padded; the last of all may not be.
    if tag != COMPRESSED {
        from.take(((8 - size % 8) % 8).min(from.left()))?;
    }
    Ok(Element { kind: tag, bytes })
}

/// Reads an array under the name that it has, or that it is given by the structure it is in.
fn array(mut from: Cursor<'_>, name: Option<String>, arrays: &mut Arrays, depth: usize) -> Result<(), Damage> {
    let big_endian = from.big_endian;
    if from.left() == 0 {
        return Ok(());
    }
    let flags = element(&mut from)?.data(big_endian).u32()?;
    let class = flags & 0xff;
    if class == 17 {
        // Objects of MATLAB's own classes have no dimensions.
        return Ok(());
    }
    let dimensions = element(&mut from)?.numbers(big_endian).unwrap_or_default();
    let dimensions: Vec<usize> = dimensions.into_iter().map(|size| size as usize).collect();
    let own = element(&mut from)?;
    let name = name.unwrap_or_else(|| String::from_utf8_lossy(own.bytes).into_owned());
    let count = dimensions.iter().try_fold(1_usize, |product, size| product.checked_mul(*size));
    let count = count.ok_or_else(|| Damage(format!("`{name}` has impossible dimensions")))?;
    let numbered = |name: &str, at: usize| if count == 1 { name.to_owned() } else { format!("{name}[{at}]") };
    match class {
        6..=15 if flags & COMPLEX == 0 => {
            let numbers = element(&mut from)?.numbers(big_endian).unwrap_or_default();
            if numbers.len() != count {
                return Err(Damage(format!("`{name}` has {} of {count} numbers", numbers.len())));
            }
            arrays.add_column_major(&name, &dimensions, numbers);
        }
        1 if depth < DEEPEST => {
            for at in 0..count {
                let inner = element(&mut from)?;
                array(inner.data(big_endian), Some(format!("{name}[{at}]")), arrays, depth + 1)?;
            }
        }
        2 if depth < DEEPEST => {
            let length = element(&mut from)?.data(big_endian).u32()? as usize;
            let fields = element(&mut from)?.bytes;
            let fields: Vec<String> = fields
                .chunks(length.max(1))
                .map(|field| String::from_utf8_lossy(field).trim_end_matches('\0').to_owned())
                .collect();
            for at in 0..count {
                for field in &fields {
                    let inner = element(&mut from)?;
                    array(inner.data(big_endian), Some(format!("{}.{field}", numbered(&name, at))), arrays, depth + 1)?;
                }
            }
        }
        _ => {}
    }
    Ok(())
}
