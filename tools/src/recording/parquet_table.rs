//! Parquet, as pandas, Polars and Arrow write it. Columns of lists and of text are passed over.

use bytes::Bytes;
use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::error::RecordingError;
use super::format::Format;
use super::guard::guarded;
use super::samples::Samples;
use super::table::{ColumnHead, Table};

/// The columns of a Parquet file.
pub(super) struct ParquetTable {
    file: String,
    reader: SerializedFileReader<Bytes>,
    heads: Vec<ColumnHead>,
    /// Column of the file, and what its numbers are.
    leaves: Vec<(usize, Kind)>,
}

/// What whole numbers stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Plain,
    Unsigned,
    /// Instants, so many a second: counted from the first one, since a double cannot hold today's date in nanoseconds.
    Instants(f64),
    /// Times, so many a second.
    Durations(f64),
}

impl ParquetTable {
    pub(super) fn open(file: &str, bytes: Vec<u8>) -> Result<Self, RecordingError> {
        let reader = guarded(|| Ok(SerializedFileReader::new(Bytes::from(bytes))?));
        let reader = reader.map_err(|damage| damage.of(file, Format::Parquet))?;
        let (mut heads, mut leaves) = (Vec::new(), Vec::new());
        for (index, column) in reader.metadata().file_metadata().schema_descr().columns().iter().enumerate() {
            let Some(kind) = kind(column) else { continue };
            let in_seconds = matches!(kind, Kind::Instants(_) | Kind::Durations(_));
            heads.push(ColumnHead {
                name: column.path().string(),
                unit: in_seconds.then(|| "s".to_owned()),
                group: 0,
                is_time: matches!(kind, Kind::Instants(_)),
            });
            leaves.push((index, kind));
        }
        Ok(ParquetTable { file: file.to_owned(), reader, heads, leaves })
    }

    fn column(&self, index: usize, kind: Kind) -> Result<Vec<f64>, ParquetError> {
        let rows = self.reader.metadata().file_metadata().num_rows();
        let mut out = Vec::with_capacity(usize::try_from(rows).unwrap_or(0).min(1 << 26));
        let mut first = None;
        for at in 0..self.reader.num_row_groups() {
            let group = self.reader.get_row_group(at)?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let nullable = group.metadata().column(index).column_descr().max_def_level();
            let mut whole = |x: i64| match kind {
                Kind::Plain => x as f64,
                Kind::Unsigned => x as u64 as f64,
                Kind::Instants(a_second) => x.wrapping_sub(*first.get_or_insert(x)) as f64 / a_second,
                Kind::Durations(a_second) => x as f64 / a_second,
            };
            match group.get_column_reader(index)? {
                ColumnReader::BoolColumnReader(r) => append(r, nullable, rows, &mut out, |x| f64::from(u8::from(x)))?,
                ColumnReader::Int32ColumnReader(r) => append(r, nullable, rows, &mut out, |x: i32| match kind {
                    Kind::Unsigned => f64::from(x as u32),
                    _ => whole(i64::from(x)),
                })?,
                ColumnReader::Int64ColumnReader(r) => append(r, nullable, rows, &mut out, whole)?,
                ColumnReader::FloatColumnReader(r) => append(r, nullable, rows, &mut out, f64::from)?,
                ColumnReader::DoubleColumnReader(r) => append(r, nullable, rows, &mut out, |x| x)?,
                _ => return Err(ParquetError::General("a column changes its type".to_owned())),
            }
        }
        Ok(out)
    }
}

impl Table for ParquetTable {
    fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        let read = |index: &usize| {
            let (leaf, kind) = self.leaves[*index];
            guarded(|| Ok(self.column(leaf, kind)?.into())).map_err(|damage| damage.of(&self.file, Format::Parquet))
        };
        columns.iter().map(read).collect()
    }
}

/// What a column holds, if it is numbers, one a row.
fn kind(column: &ColumnDescriptor) -> Option<Kind> {
    if column.max_rep_level() > 0 {
        return None;
    }
    let a_second = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e3,
        TimeUnit::MICROS => 1e6,
        TimeUnit::NANOS => 1e9,
    };
    let whole = matches!(column.physical_type(), Type::INT32 | Type::INT64);
    match (column.physical_type(), column.logical_type_ref(), column.converted_type()) {
        (Type::BOOLEAN | Type::FLOAT | Type::DOUBLE, ..) => Some(Kind::Plain),
        _ if !whole => None,
        (_, Some(LogicalType::Timestamp(instant)), _) => Some(Kind::Instants(a_second(&instant.unit))),
        (_, Some(LogicalType::Time(time)), _) => Some(Kind::Durations(a_second(&time.unit))),
        (_, Some(LogicalType::Integer(integer)), _) if !integer.is_signed => Some(Kind::Unsigned),
        (_, Some(LogicalType::Integer(_)), _) => Some(Kind::Plain),
        (_, None, ConvertedType::TIMESTAMP_MILLIS) => Some(Kind::Instants(1e3)),
        (_, None, ConvertedType::TIMESTAMP_MICROS) => Some(Kind::Instants(1e6)),
        (_, None, ConvertedType::DATE | ConvertedType::DECIMAL) => None,
        (_, None, _) => Some(Kind::Plain),
        _ => None,
    }
}

/// Appends the values of a column in a row group; those that are missing become NaN.
fn append<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    nullable: i16,
    rows: usize,
    out: &mut Vec<f64>,
    mut number: impl FnMut(T::T) -> f64,
) -> Result<(), ParquetError> {
    let mut left = rows;
    while left > 0 {
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let levels_wanted = (nullable > 0).then_some(&mut levels);
        let (read, ..) = reader.read_records(left.min(1 << 16), levels_wanted, None, &mut values)?;
        if read == 0 {
            return Err(ParquetError::General(format!("a column ends {left} rows early")));
        }
        let mut values = values.into_iter();
        if nullable == 0 {
            out.extend(values.map(&mut number));
        } else {
            let there = |level: &i16| *level == nullable;
            out.extend(levels.iter().map(|level| match there(level).then(|| values.next()).flatten() {
                Some(value) => number(value),
                None => f64::NAN,
            }));
        }
        left -= read;
    }
    Ok(())
}
