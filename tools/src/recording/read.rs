//! Reading recordings: the columns that a command needs, in SI, cropped and checked.

use super::error::{ColumnPlace, RecordingError, RecordingProblem};
use super::header::{self, Fault, Source};
use super::map::ColumnMap;
use super::needs::{Need, Needs};
use super::open::{Progress, RecordingFile, open};
use super::quantity::Quantity;
use super::samples::Samples;
use super::table::Table;
use super::{Recording, TorqueUnit};

/// How a recording is read.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Columns under other names.
    pub map: ColumnMap,
    /// What is needed of it.
    pub needs: Needs,
    /// Rows before this time are left out, s.
    pub from_s: Option<f64>,
    /// Rows after this time are left out, s.
    pub to_s: Option<f64>,
}

impl Reading {
    /// All rows.
    pub fn new(map: ColumnMap, needs: Needs) -> Self {
        Reading { map, needs, from_s: None, to_s: None }
    }

    /// Whether a time lies between the first and the last that are read.
    pub(super) fn keeps(&self, time_s: f64) -> bool {
        self.from_s.is_none_or(|from| time_s >= from) && self.to_s.is_none_or(|to| time_s <= to)
    }

    fn crops(&self) -> bool {
        self.from_s.is_some() || self.to_s.is_some()
    }

    /// Where the quantities that are needed stand.
    pub(super) fn sources(&self, file: &str, table: &dyn Table) -> Result<Vec<Source>, RecordingError> {
        let time = if self.crops() { Need::Required } else { self.needs.time };
        let needs = Needs { time, ..self.needs };
        header::resolve(table.heads(), &self.map, &needs).map_err(|Fault { index, problem }| {
            let column = index.map(|index| column_place(table, index));
            RecordingError { place: table.header_place(), column, ..RecordingError::of_file(file, problem) }
        })
    }

    /// Reads a recording.
    ///
    /// The format is recognised by the file's content. Of CSV commas, semicolons, tabs or spaces separate the columns (as the header does); but with commas,
    /// numbers may have decimal commas. A byte-order mark, CRLF, quotes, comment lines (`#`), blank rows and trailing separators are accepted, other columns ignored.
    ///
    /// # Errors
    /// Anything that cannot be read rightly: [`RecordingProblem`], with file, line or row, and column.
    pub fn read(&self, file: &RecordingFile, progress: Progress<'_>) -> Result<Recording, RecordingError> {
        let mut opened = open(file, progress)?;
        let recording = self.read_table(&file.name, opened.table())?;
        Ok(Recording { sha256: opened.sha256(), ..recording })
    }

    /// Reads a recording from a table; `name` is that of the recording.
    pub(super) fn read_table(&self, name: &str, table: &mut dyn Table) -> Result<Recording, RecordingError> {
        let sources = self.sources(name, table)?;
        let mut indices: Vec<usize> = sources.iter().map(|source| source.index).collect();
        indices.sort_unstable();
        indices.dedup();
        let numbers = table.read(&indices)?;
        let rows = numbers.first().map_or(0, |column| column.len());
        let column = |source: &Source| numbers[indices.binary_search(&source.index).unwrap_or(0)].clone();
        let mut columns: Vec<Samples> = sources.iter().map(column).collect();
        // A column that no other source shares is converted where it lies.
        drop(numbers);
        sources.iter().zip(&mut columns).for_each(|(source, values)| source.convert(values));
        let kept = self.kept(name, &sources, &columns, rows)?;
        columns.iter_mut().for_each(|values| values.crop(&kept));
        check(name, table, &sources, &columns, kept.start)?;
        Ok(recording(name, &sources, columns, kept.len()))
    }

    /// The rows between `from_s` and `to_s`.
    fn kept(
        &self,
        name: &str,
        sources: &[Source],
        columns: &[Samples],
        rows: usize,
    ) -> Result<std::ops::Range<usize>, RecordingError> {
        const SOME: [&str; 2] = ["no row", "a single row"];
        let refuse = |problem| Err(RecordingError::of_file(name, problem));
        if rows < 2 {
            return refuse(RecordingProblem::TooShort(SOME[rows]));
        }
        let time = sources.iter().position(|source| source.quantity == Quantity::Time);
        let Some(time) = time.map(|at| &columns[at]).filter(|_| self.crops()) else { return Ok(0..rows) };
        let first = time.iter().position(|t| self.keeps(*t)).unwrap_or(rows);
        let end = time.iter().rposition(|t| self.keeps(*t)).map_or(first, |last| last + 1);
        if end - first < 2 {
            let found = SOME[end - first];
            return refuse(RecordingProblem::NothingBetween { found, first: time[0], last: time[rows - 1] });
        }
        Ok(first..end)
    }
}

/// Reads all rows of a file; see [`Reading::read`].
///
/// # Errors
/// Those of [`Reading::read`].
pub fn read(
    path: &std::path::Path,
    map: &ColumnMap,
    needs: &Needs,
    progress: Progress<'_>,
) -> Result<Recording, RecordingError> {
    Reading::new(map.clone(), *needs).read(&path.into(), progress)
}

fn column_place(table: &dyn Table, index: usize) -> ColumnPlace {
    ColumnPlace { name: table.heads()[index].name.clone(), number: index + 1 }
}

/// Refuses the first row that is not finite, or whose time does not increase. The columns begin at a row of the table.
fn check(
    name: &str,
    table: &dyn Table,
    sources: &[Source],
    columns: &[Samples],
    begin: usize,
) -> Result<(), RecordingError> {
    let mut first: Option<(usize, usize, RecordingProblem)> = None;
    for (at, (source, values)) in sources.iter().zip(columns).enumerate() {
        let not_finite = values.iter().position(|value| !value.is_finite());
        let mut found = not_finite.map(|row| (row, RecordingProblem::NotFinite(format!("{}", values[row]))));
        if source.quantity == Quantity::Time
            && let Some(row) = values.windows(2).position(|pair| pair[1] <= pair[0])
        {
            let (before, after) = (values[row], values[row + 1]);
            let problem = match before == after {
                true => RecordingProblem::TimeRepeats(after),
                false => RecordingProblem::TimeRunsBack { before, after },
            };
            found = Some((row + 1, problem)).into_iter().chain(found).min_by_key(|(row, _)| *row);
        }
        first = first.into_iter().chain(found.map(|(row, problem)| (row, at, problem))).min_by_key(|(row, ..)| *row);
    }
    let Some((row, at, problem)) = first else { return Ok(()) };
    Err(RecordingError {
        file: name.to_owned(),
        place: Some(table.place(begin + row)),
        column: Some(column_place(table, sources[at].index)),
        problem: Box::new(problem),
    })
}

fn recording(name: &str, sources: &[Source], columns: Vec<Samples>, rows: usize) -> Recording {
    let mut recording = Recording { name: name.to_owned(), ..Recording::default() };
    for (source, column) in sources.iter().zip(columns) {
        match source.quantity {
            Quantity::Time => recording.time_s = column,
            Quantity::Torque => recording.torque = Some(column),
            Quantity::Current => {
                recording.torque = Some(column);
                recording.torque_unit = TorqueUnit::Ampere;
            }
            Quantity::Deflection => recording.deflection_rad = Some(column),
            Quantity::ThetaIn => recording.theta_in_rad = Some(column),
            Quantity::ThetaOut => recording.theta_out_rad = Some(column),
            Quantity::VelocityOut => recording.velocity_out_rad_per_s = Some(column),
            Quantity::Temperature => recording.temperature_c = Some(column),
            Quantity::TorqueSim => recording.torque_sim_nm = Some(column),
        }
    }
    if recording.time_s.is_empty() {
        recording.time_s = (0..rows).map(|row| row as f64).collect();
    }
    recording
}
