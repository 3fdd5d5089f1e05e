//! Writing recordings, and rows of a recording with columns added, as CSV whose numbers read back exactly.

use std::borrow::Cow;
use std::io::{self, Write};

use super::Recording;
use super::csv_table::CsvTable;
use super::error::RecordingError;
use super::header::Source;
use super::name::{Named, parse_head};
use super::open::{Columns, RecordingFile, open};
use super::quantity::Quantity;
use super::read::Reading;
use super::table::{ColumnHead, Table};
use super::unit_text;
use crate::progress;

/// A column to write: its name and its values.
pub type Column<'a> = (&'a str, &'a [f64]);

/// Writes columns of one length under their names.
pub fn write_columns(out: &mut dyn Write, columns: &[Column<'_>]) -> io::Result<()> {
    write_columns_under(out, columns, &())
}

/// [`write_columns`] with its progress.
fn write_columns_under(
    out: &mut dyn Write,
    columns: &[Column<'_>],
    progress: &dyn progress::Progress,
) -> io::Result<()> {
    let quoted = |name: &str| match name.contains([',', '"']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    };
    let names: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
    writeln!(out, "{}", names.join(","))?;
    let rows = columns.first().map_or(0, |(_, values)| values.len());
    for row in 0..rows {
        progress::at_row(progress, "Writing", row, rows);
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
        self.write_under(out, &())
    }

    /// [`write`](Self::write) with its progress.
    pub fn write_under(&self, out: &mut dyn Write, progress: &dyn progress::Progress) -> io::Result<()> {
        let columns: Vec<Column<'_>> = self.columns().into_iter().map(|(name, values)| (name, &**values)).collect();
        write_columns_under(out, &columns, progress)
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

/// Copies the rows of a recording with columns added behind. Of CSV every field stays as it stands, separator and decimal mark are the recording's, comments and
/// blank rows are left out; of other formats the columns are those that have their rows in common with what was read.
/// `reading` is that which the recording was read by. A column of the recording that has the name of an added one is replaced by it.
///
/// # Errors
/// The file cannot be read again, or is not what it was.
pub fn copy_with_columns(
    file: &RecordingFile,
    reading: &Reading,
    added: &[Column<'_>],
    out: &mut dyn Write,
    progress: &dyn progress::Progress,
) -> Result<(), CopyError> {
    let bytes = file.path.metadata().map_or(0, |data| data.len()).max(1);
    let at = |done: u64| progress.report("Writing", (done as f64 / bytes as f64).min(1.0));
    let mut opened = open(file, &at)?;
    let sources = reading.sources(&file.name, opened.table())?;
    let expected = added.first().map_or(0, |(_, values)| values.len());
    let found = match &mut opened.columns {
        Columns::Csv(table) => copy_text(table, reading, &sources, added, out)?,
        Columns::Binary(table) => copy_numbers(table.as_mut(), reading, &sources, added, out)?,
    };
    if found != expected {
        return Err(CopyError::Changed { file: file.name.clone(), found: expected, expected: found });
    }
    Ok(())
}

/// The columns that none of the added ones replaces.
fn kept(table: &dyn Table, added: &[Column<'_>]) -> Vec<usize> {
    let replaced = |name: &str| added.iter().any(|(other, _)| *other == name);
    (0..table.heads().len()).filter(|i| !replaced(&table.heads()[*i].name)).collect()
}

fn copy_text(
    table: &mut CsvTable<'_>,
    reading: &Reading,
    sources: &[Source],
    added: &[Column<'_>],
    out: &mut dyn Write,
) -> Result<usize, CopyError> {
    let kept = kept(table, added);
    let mut writer = csv::WriterBuilder::new().delimiter(table.dialect.separation.delimiter).from_writer(out);
    let names: Vec<Cow<'_, str>> = kept.iter().map(|&i| with_its_unit(&table.heads()[i])).collect();
    writer
        .write_record(names.iter().map(|name| &**name).chain(added.iter().map(|(name, _)| *name)))
        .map_err(into_io)?;
    let mut row = 0;
    let mut text = String::new();
    while table.next_row()? {
        // To learn the decimal mark too, from the columns that are read.
        let mut keeps = true;
        for source in sources {
            let value = table.value(source)?;
            keeps &= source.quantity != Quantity::Time || reading.keeps(value);
        }
        if !keeps {
            continue;
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
    writer.flush()?;
    Ok(row)
}

fn copy_numbers(
    table: &mut dyn Table,
    reading: &Reading,
    sources: &[Source],
    added: &[Column<'_>],
    out: &mut dyn Write,
) -> Result<usize, CopyError> {
    let group = sources.first().map_or(0, |source| table.heads()[source.index].group);
    let kept: Vec<usize> = kept(table, added).into_iter().filter(|i| table.heads()[*i].group == group).collect();
    let mut columns = table.read(&kept)?;
    if let Some(source) = sources.iter().find(|source| source.quantity == Quantity::Time) {
        let time = table.read(&[source.index])?.pop().unwrap_or_default();
        let keeps: Vec<bool> = time.iter().map(|t| reading.keeps(source.to_si(*t))).collect();
        for values in &mut columns {
            *values = values.iter().zip(&keeps).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect();
        }
    }
    let names: Vec<Cow<'_, str>> = kept.iter().map(|i| with_its_unit(&table.heads()[*i])).collect();
    let copied = names.iter().map(|name| &**name).zip(columns.iter().map(|values| &**values));
    let all: Vec<Column<'_>> = copied.chain(added.iter().copied()).collect();
    let rows = columns.first().map_or(0, |values| values.len());
    if all.iter().all(|(_, values)| values.len() == rows) {
        write_columns(out, &all)?;
    }
    Ok(rows)
}

/// The name of a column; where it says no unit and one stands beside it, with that, so that it reads back.
fn with_its_unit(head: &ColumnHead) -> Cow<'_, str> {
    match &head.unit {
        Some(unit)
            if !matches!(parse_head(&head.name, None), Named::Known(..))
                && matches!(parse_head(&head.name, Some(unit)), Named::Known(..)) =>
        {
            format!("{} [{}]", head.name, unit_text::bare(unit)).into()
        }
        _ => (&*head.name).into(),
    }
}

fn into_io(error: csv::Error) -> io::Error {
    io::Error::other(error)
}
