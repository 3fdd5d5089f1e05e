//! What every format of recordings comes down to: named columns of numbers.

use super::error::RecordingError;
use super::samples::Samples;

/// A column of a file, before it is known what it holds.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ColumnHead {
    /// Its name, one of its kind in the file, such as `torque_nm` or `/joint_states.effort[2]`.
    pub name: String,
    /// Its unit as the file states it beside the name.
    pub unit: Option<String>,
    /// Columns of one group have their rows in common: the channels of a group of MDF4, the fields of a topic of MCAP, arrays of one length.
    pub group: usize,
    /// It is what its group counts time by.
    pub is_time: bool,
}

/// A file of named columns. One implementation a format.
pub(super) trait Table {
    /// Its columns.
    fn heads(&self) -> &[ColumnHead];

    /// Where its columns are named.
    fn header_place(&self) -> Option<Location> {
        None
    }

    /// The numbers of some columns of one group, as the file states them: neither scaled nor checked to be finite.
    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError>;

    /// Where a row stands, counted from 0.
    fn place(&self, row: usize) -> Location {
        Location::Row(row as u64 + 1)
    }
}

/// Where in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// A line of a text, counted from 1.
    Line(u64),
    /// A row of a table, counted from 1.
    Row(u64),
}

impl std::fmt::Display for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Location::Line(line) => write!(f, "line {line}"),
            Location::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// Arrays under names, whole in memory; arrays of one length have their rows in common.
#[derive(Debug, Default)]
pub(super) struct Arrays {
    heads: Vec<ColumnHead>,
    columns: Vec<Samples>,
    lengths: Vec<usize>,
}

/// More columns than this of one array are no channels.
const MOST_COLUMNS: usize = 64;

impl Arrays {
    pub(super) fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    pub(super) fn read(&self, columns: &[usize]) -> Vec<Samples> {
        columns.iter().map(|index| self.columns[*index].clone()).collect()
    }

    /// Adds an array whose first index runs fastest. A vector is a column. Of a matrix the longer side are the rows, and its columns become `name[0]`, `name[1]`, …
    /// Single numbers, and arrays with more sides, are no columns.
    pub(super) fn add_column_major(&mut self, name: &str, dimensions: &[usize], numbers: Vec<f64>) {
        let sides: Vec<usize> = dimensions.iter().copied().filter(|size| *size != 1).collect();
        match sides[..] {
            [rows] if rows > 1 => self.add(name.to_owned(), numbers),
            [rows, columns] if rows >= columns && columns <= MOST_COLUMNS => {
                let parts = numbers.chunks(rows.max(1)).enumerate();
                parts.for_each(|(at, column)| self.add(format!("{name}[{at}]"), column.to_vec()));
            }
            [columns, rows] if columns < rows && columns <= MOST_COLUMNS => {
                let column = |at: usize| numbers.iter().skip(at).step_by(columns.max(1)).copied().collect();
                (0..columns).for_each(|at| self.add(format!("{name}[{at}]"), column(at)));
            }
            _ => {}
        }
    }

    fn add(&mut self, name: String, column: Vec<f64>) {
        let known = self.lengths.iter().position(|length| *length == column.len());
        let group = known.unwrap_or_else(|| {
            self.lengths.push(column.len());
            self.lengths.len() - 1
        });
        self.heads.push(ColumnHead { name, group, ..ColumnHead::default() });
        self.columns.push(column.into());
    }
}

/// Gives columns that share a name the names of their groups in front.
pub(super) fn tell_apart(heads: &mut [ColumnHead], group_name: impl Fn(usize) -> String) {
    let mut count = std::collections::HashMap::<String, usize>::new();
    heads.iter().for_each(|head| *count.entry(head.name.clone()).or_default() += 1);
    for head in heads {
        if count[&head.name] > 1 {
            head.name = format!("{}.{}", group_name(head.group), head.name);
        }
    }
}
