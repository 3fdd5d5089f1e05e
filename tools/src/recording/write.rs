//! Writing recordings, and rows of a recording with columns added, as CSV whose numbers read back exactly.

use std::io::{self, Write};
use std::path::Path;

use super::error::RecordingError;
use super::map::ColumnMap;
use super::read::{Needs, Table};
use super::{Recording, TorqueUnit};

/// A column to write: its name and its values.
pub type Column<'a> = (&'a str, &'a [f64]);

/// Writes columns of one length under their names.
pub fn write_columns(out: &mut dyn Write, columns: &[Column<'_>]) -> io::Result<()> {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    writeln!(out, "{}", names.join(","))?;
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        for (i, (_, values)) in columns.iter().enumerate() {
            if i > 0 {
                out.write_all(b",")?;
            }
            // The shortest decimal that reads back as the same number.
            write!(out, "{:?}", values[row])?;
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

impl Recording {
    /// Writes the recording as CSV under the contract's names.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let torque = match self.torque_unit {
            TorqueUnit::NewtonMetre => "torque_nm",
            TorqueUnit::Ampere => "current_a",
        };
        let optional = [
            ("deflection_rad", &self.deflection_rad),
            ("theta_in_rad", &self.theta_in_rad),
            ("theta_out_rad", &self.theta_out_rad),
            ("velocity_out_rad_per_s", &self.velocity_out_rad_per_s),
            ("temperature_c", &self.temperature_c),
            (torque, &self.torque),
            ("torque_sim_nm", &self.torque_sim_nm),
        ];
        let present = optional.iter().filter_map(|(name, values)| Some((*name, values.as_deref()?)));
        let columns: Vec<Column<'_>> = [("time_s", self.time_s.as_slice())].into_iter().chain(present).collect();
        write_columns(out, &columns)
    }
}

/// Why rows could not be copied.
#[derive(Debug, thiserror::Error)]
pub enum CopyError {
    /// The recording could not be read again.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The rows are not those that the columns were computed from.
    #[error("{file} changed while it was read: {found} rows, then {expected}")]
    Changed {
        /// The recording.
        file: String,
        /// Rows found at first.
        found: usize,
        /// Rows found when copying.
        expected: usize,
    },
    /// The output could not be written.
    #[error("cannot write: {0}")]
    Write(#[from] io::Error),
}

/// Copies the rows of a recording, every field as it stands, with columns added behind. Separator and decimal mark are the recording's;
/// comments and blank rows are left out. `map` and `needs` are those that the recording was read by. A column of the recording that has the name of an added one is replaced by it.
pub fn copy_with_columns(
    path: &Path,
    map: &ColumnMap,
    needs: &Needs,
    added: &[Column<'_>],
    out: &mut dyn Write,
) -> Result<(), CopyError> {
    let mut table = Table::open(path, &|_| {})?;
    let sources = table.sources(map, needs)?;
    let kept: Vec<usize> =
        (0..table.columns().len()).filter(|&i| !added.iter().any(|(name, _)| *name == table.columns()[i])).collect();
    let mut writer = csv::WriterBuilder::new().delimiter(table.dialect.delimiter).from_writer(out);
    let names = kept.iter().map(|&i| table.columns()[i].as_str()).chain(added.iter().map(|(name, _)| *name));
    writer.write_record(names).map_err(into_io)?;
    let rows = added.first().map_or(0, |(_, values)| values.len());
    let mut row = 0;
    let mut text = String::new();
    while table.next_row()? {
        // Only to learn the decimal mark, from the columns that `read` reads.
        for source in &sources {
            table.number(source)?;
        }
        for &i in &kept {
            writer.write_field(table.row[i].trim_ascii()).map_err(into_io)?;
        }
        for (_, values) in added {
            use std::fmt::Write as _;
            text.clear();
            let value = values.get(row).copied().unwrap_or(f64::NAN);
            let _ = write!(text, "{value:?}");
            if table.decimal_comma() {
                text = text.replace('.', ",");
            }
            writer.write_field(&text).map_err(into_io)?;
        }
        writer.write_record(None::<&[u8]>).map_err(into_io)?;
        row += 1;
    }
    if row != rows {
        return Err(CopyError::Changed { file: table.file, found: rows, expected: row });
    }
    writer.flush()?;
    Ok(())
}

fn into_io(error: csv::Error) -> io::Error {
    io::Error::other(error)
}
