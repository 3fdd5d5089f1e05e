//! MAT files of version 7.3: HDF5 behind MATLAB's header. Structures are groups, arrays are data sets, whose sides stand in reverse.

use hdf5_pure::{AttrValue, File, Group};

use super::bytes::Damage;
use super::error::RecordingError;
use super::format::Format;
use super::guard::guarded;
use super::samples::Samples;
use super::table::{Arrays, ColumnHead, Table};

/// The arrays of a MAT file.
pub(super) struct Mat73Table(Arrays);

/// Structures in structures so deep are no recording.
const DEEPEST: usize = 16;

impl Mat73Table {
    pub(super) fn open(file: &str, bytes: Vec<u8>) -> Result<Self, RecordingError> {
        let read = || {
            let file = File::from_bytes(bytes)?;
            let mut arrays = Arrays::default();
            group(&file.root(), "", &mut arrays, 0)?;
            Ok(arrays)
        };
        guarded(read).map(Mat73Table).map_err(|damage| damage.of(file, Format::Mat73))
    }
}

impl Table for Mat73Table {
    fn heads(&self) -> &[ColumnHead] {
        self.0.heads()
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        Ok(self.0.read(columns))
    }
}

fn group(group: &Group, before: &str, arrays: &mut Arrays, depth: usize) -> Result<(), Damage> {
    if depth > DEEPEST {
        return Ok(());
    }
    let mut names = group.datasets()?;
    names.sort();
    for name in names {
        let data = group.dataset(&name)?;
        let attributes = data.attrs()?;
        // Text is stored as numbers, cells as references, and what is empty as its sides.
        let class = match attributes.get("MATLAB_class") {
            Some(AttrValue::String(class) | AttrValue::AsciiString(class)) => class.as_str(),
            _ => "",
        };
        if matches!(class, "char" | "cell" | "struct" | "function_handle") || attributes.contains_key("MATLAB_empty") {
            continue;
        }
        let sides = data.shape()?.into_iter().rev().map(usize::try_from).collect::<Result<Vec<_>, _>>()?;
        // What are no numbers are no columns.
        if let Ok(numbers) = data.read_f64()
            && numbers.len() == sides.iter().product::<usize>()
        {
            arrays.add_column_major(&format!("{before}{name}"), &sides, numbers);
        }
    }
    let mut names = group.groups()?;
    names.sort();
    // `#refs#` and the like hold what cells refer to.
    for name in names.iter().filter(|name| !name.starts_with('#')) {
        self::group(&group.group(name)?, &format!("{before}{name}."), arrays, depth + 1)?;
    }
    Ok(())
}
