//! Columns that stand ready: those of a model linearised where it stands, and of whatever may be added to it.

use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Stretch};
use crate::regression::rows::Rows;

/// A contribution whose columns were evaluated before.
pub struct Ready<'v> {
    columns: Vec<Column>,
    recordings: Vec<Vec<&'v [f64]>>,
}

impl<'v> Ready<'v> {
    /// The columns of each recording, in the order of `columns`.
    pub fn new(columns: Vec<Column>, recordings: Vec<Vec<&'v [f64]>>) -> Self {
        Self { columns, recordings }
    }
}

impl Contribution for Ready<'_> {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn start<'a>(&'a self, _: &[f64], _: &'a Rows<'a>, index: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(Copied(&self.recordings[index]))
    }
}

struct Copied<'v>(&'v [&'v [f64]]);

impl Evaluate for Copied<'_> {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for (j, values) in self.0.iter().enumerate() {
            columns.column(j).copy_from_slice(&values[stretch.range.clone()]);
        }
    }
}
