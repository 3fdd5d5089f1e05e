//! Recordings from columns in memory: arrays under names, read as a file of that header would be.

use super::Recording;
use super::error::{ColumnPlace, RecordingError, RecordingProblem};
use super::header;
use super::map::ColumnMap;
use super::needs::{Need, Needs};
use super::read::Reading;
use super::samples::Samples;
use super::table::{ColumnHead, Table};

/// Arrays of one length under names.
pub trait Columns {
    /// Their names, in order.
    fn names(&self) -> Vec<String>;

    /// The numbers of the column of this index.
    ///
    /// # Errors
    /// What it holds instead of numbers, in words.
    fn numbers(&mut self, index: usize) -> Result<Samples, String>;
}

struct Memory<'a> {
    name: &'a str,
    heads: Vec<ColumnHead>,
    columns: &'a mut dyn Columns,
}

impl Table for Memory<'_> {
    fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        let mut read: Vec<Samples> = Vec::with_capacity(columns.len());
        for &index in columns {
            let refuse = |problem| RecordingError {
                column: Some(ColumnPlace { name: self.heads[index].name.clone(), number: index + 1 }),
                ..RecordingError::of_file(self.name, problem)
            };
            let numbers = self.columns.numbers(index).map_err(|found| refuse(RecordingProblem::NoNumbers(found)))?;
            if let Some(first) = read.first().filter(|first| first.len() != numbers.len()) {
                let (rows, expected) = (numbers.len(), first.len());
                let other = self.heads[columns[0]].name.clone();
                return Err(refuse(RecordingProblem::OtherLength { rows, other, expected }));
            }
            read.push(numbers);
        }
        Ok(read)
    }
}

impl Reading {
    /// Reads a recording from columns in memory. `name` is its name for messages and reports. Only the columns that are needed are asked for their numbers.
    ///
    /// # Errors
    /// As [`read`](Self::read), with row and column.
    pub fn read_columns(&self, name: &str, columns: &mut dyn Columns) -> Result<Recording, RecordingError> {
        let heads = columns.names().into_iter().map(|name| ColumnHead { name, ..ColumnHead::default() }).collect();
        self.read_table(name, &mut Memory { name, heads, columns })
    }
}

impl Recording {
    /// The columns that are there, under the names that a file would have for them.
    pub fn columns(&self) -> Vec<(&'static str, &Samples)> {
        std::iter::once(("time_s", &self.time_s)).chain(self.channels()).collect()
    }

    /// Checks that a recording that was read for something else has what is needed.
    ///
    /// # Errors
    /// [`RecordingProblem::MissingColumns`].
    pub fn require(&self, needs: &Needs) -> Result<(), RecordingError> {
        let head = |(name, _): (&str, &Samples)| ColumnHead { name: name.to_owned(), ..ColumnHead::default() };
        let heads: Vec<ColumnHead> = self.columns().into_iter().map(head).collect();
        header::resolve(&heads, &ColumnMap::default(), needs)
            .map(drop)
            .map_err(|fault| RecordingError::of_file(&self.name, fault.problem))
    }
}

impl Needs {
    /// Whatever a recording holds. Time is required.
    pub const ANY: Needs =
        Needs { time: Need::Required, torque: Need::IfPresent, motion: Need::IfPresent, simulation: Need::IfPresent };
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Arrays(Vec<(&'static str, Vec<f64>)>);

    impl Columns for Arrays {
        fn names(&self) -> Vec<String> {
            self.0.iter().map(|(name, _)| (*name).to_owned()).collect()
        }

        fn numbers(&mut self, index: usize) -> Result<Samples, String> {
            let (name, numbers) = &self.0[index];
            if *name == "remark" { Err("text".to_owned()) } else { Ok(numbers.clone().into()) }
        }
    }

    fn read(map: &str, columns: Vec<(&'static str, Vec<f64>)>) -> Result<Recording, String> {
        let map = if map.is_empty() { ColumnMap::default() } else { map.parse().unwrap() };
        Reading::new(map, Needs::FIT).read_columns("arrays", &mut Arrays(columns)).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_read_as_a_file_of_their_header() {
        let columns =
            vec![("t_ms", vec![0.0, 1.0]), ("torque_nm", vec![1.0, 2.0]), ("deflection_mrad", vec![0.1, 0.2])];
        let recording = read("time_ms=t_ms", columns).unwrap();
        let expected = [("time_s", [0.0, 1e-3]), ("deflection_rad", [1e-4, 2e-4]), ("torque_nm", [1.0, 2.0])];
        let found: Vec<(&str, Vec<f64>)> =
            recording.columns().into_iter().map(|(name, numbers)| (name, numbers.to_vec())).collect();
        assert_eq!(found, expected.map(|(name, numbers)| (name, numbers.to_vec())));
        assert_eq!(recording.require(&Needs::FIT), Ok(()));
    }

    #[test]
    fn what_is_wrong_with_a_column_is_said_with_its_place() {
        let with = |name, torque: Vec<f64>| {
            vec![("time_s", vec![0.0, 1.0]), ("deflection_rad", torque.clone()), (name, torque)]
        };
        let cases = [
            ("", with("torque_nm", vec![1.0]), "arrays, column 2 `deflection_rad`: has 1 rows, `time_s` has 2"),
            (
                "",
                with("torque_nm", vec![1.0, f64::NAN]),
                "arrays, row 2, column 3 `torque_nm`: `NaN` is not a finite number",
            ),
            ("torque_nm=remark", with("remark", vec![1.0, 2.0]), "arrays, column 3 `remark`: holds text, not numbers"),
            (
                "",
                vec![("time_s", vec![0.0, 1.0])],
                "arrays: has no column `torque_nm` (or `current_a`), `deflection_rad` (or the angles `theta_in_rad` and `theta_out_rad`); its columns are `time_s`",
            ),
        ];
        for (map, columns, expected) in cases {
            assert_eq!(read(map, columns), Err(expected.to_owned()));
        }
    }
}
