//! What a contribution to the torque is to the estimator.
//!
//! Whatever is fitted, base model or physics term, is a [`Contribution`]: for given nonlinear parameters it yields columns, one a linear
//! parameter, row after row. The estimator eliminates the linear parameters exactly and searches the others, so to plug in a term is to implement two traits:
//!
//! 1. [`Contribution`] names its columns (unit, bound, whether the coefficient belongs to the gear or to one recording) and its nonlinear parameters
//!    (unit, range, whether the columns change smoothly with them), and starts an [`Evaluate`] on a recording;
//! 2. [`Evaluate`] fills stretches of consecutive rows, by the core's own code, keeping whatever state the term has.
//!
//! A term in the deflection domain (kinematic error, eccentricity, backlash) is a [`Correction`] instead. It has no columns: all its parameters are
//! nonlinear. Each evaluation takes it out of the deflection *before* any contribution sees a sample, so the turning points, the gate and the elastic
//! torque follow the corrected path; the polish linearises the whole chain numerically, steps, and evaluates the whole chain anew. That is the iteration: no
//! fixed deflection, no frozen turning points.

use std::borrow::Cow;
use std::ops::Range;

use crate::numerics::bounded::Bound;
use crate::numerics::qr::Block;
use crate::regression::rows::Rows;

/// Whose a linear parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The gear's: one value for all recordings.
    Gear,
    /// A nuisance of each recording: its offset, its memory at the start. Always free of bounds.
    Recording,
    /// Nobody's: what is there whatever the linear parameters are. Its coefficient is 1.
    Known,
}

/// A linear parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name in model files.
    pub name: Cow<'static, str>,
    /// Unit of the coefficient.
    pub unit: Cow<'static, str>,
    /// What the coefficient may be.
    pub bound: Bound,
    /// Whose it is.
    pub scope: Scope,
}

impl Column {
    /// A parameter of the gear.
    pub const fn of_gear(name: &'static str, unit: &'static str, bound: Bound) -> Self {
        Self { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), bound, scope: Scope::Gear }
    }

    /// What is there whatever the linear parameters are.
    pub const fn known() -> Self {
        Self { name: Cow::Borrowed("known"), unit: Cow::Borrowed("1"), bound: Bound::Free, scope: Scope::Known }
    }

    /// A nuisance of each recording.
    pub const fn of_recording(name: &'static str, unit: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), bound: Bound::Free, scope: Scope::Recording }
    }
}

/// A nonlinear parameter in the coordinate it is searched in.
#[derive(Debug, Clone, PartialEq)]
pub struct Nonlinear {
    /// Its name.
    pub name: Cow<'static, str>,
    /// Unit of the coordinate.
    pub unit: Cow<'static, str>,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Whether the columns are differentiable in it. Others are searched but not polished, and carry no standard deviation.
    pub smooth: bool,
}

/// Consecutive rows to be evaluated.
#[derive(Debug, Clone)]
pub struct Stretch<'a> {
    /// The recording.
    pub rows: &'a Rows<'a>,
    /// Which rows.
    pub range: Range<usize>,
    /// Their deflection after all corrections, rad.
    pub deflection_rad: &'a [f64],
}

/// The columns that a contribution fills, in the order in which it named them.
#[derive(Debug)]
pub struct Columns<'b> {
    pub(crate) block: &'b mut Block,
    pub(crate) at: &'b [usize],
    pub(crate) first_row: usize,
}

impl Columns<'_> {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.at.len()
    }

    /// The rows of column `j`.
    pub fn column(&mut self, j: usize) -> &mut [f64] {
        &mut self.block.column_mut(self.at[j])[self.first_row..]
    }

    /// One row of all columns.
    #[inline]
    pub fn set(&mut self, row: usize, values: &[f64]) {
        for (j, value) in values.iter().enumerate() {
            self.block.column_mut(self.at[j])[self.first_row + row] = *value;
        }
    }
}

/// A part of the torque: columns, given nonlinear parameters.
pub trait Contribution: Sync {
    /// Its linear parameters.
    fn columns(&self) -> &[Column];

    /// Its nonlinear parameters.
    fn nonlinear(&self) -> &[Nonlinear] {
        &[]
    }

    /// Starts at the first row of recording number `index`.
    fn start<'a>(&'a self, nonlinear: &[f64], rows: &'a Rows<'a>, index: usize) -> Box<dyn Evaluate + 'a>;

    /// Starts the sum of its columns, each times its coefficient, as a single column, where that costs less than the columns.
    fn start_sum<'a>(
        &'a self,
        _nonlinear: &[f64],
        _coefficients: &[f64],
        _rows: &'a Rows<'a>,
        _index: usize,
    ) -> Option<Box<dyn Evaluate + 'a>> {
        None
    }
}

/// A contribution at work on a recording.
pub trait Evaluate {
    /// Fills the columns of the next rows. Stretches come in order and without gaps.
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>);
}

/// A disturbance of the measured deflection, taken out before the gear sees it.
pub trait Correction: Sync {
    /// Its parameters, all nonlinear.
    fn nonlinear(&self) -> &[Nonlinear];

    /// Whether a parameter, counted within this correction, changes anything in recording number `index`.
    fn concerns(&self, _parameter: usize, _index: usize) -> bool {
        true
    }

    /// Starts at the first row of recording number `index`.
    fn start<'a>(&'a self, nonlinear: &[f64], rows: &'a Rows<'a>, index: usize) -> Box<dyn Correct + 'a>;
}

/// A correction at work on a recording.
pub trait Correct {
    /// Corrects the deflection of the next rows, rad.
    fn correct(&mut self, rows: Range<usize>, deflection_rad: &mut [f64]);
}

/// The constant torque offset of each recording.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offset;

impl Contribution for Offset {
    fn columns(&self) -> &[Column] {
        static COLUMNS: [Column; 1] = [Column::of_recording("offset", "N·m")];
        &COLUMNS
    }

    fn start<'a>(&'a self, _: &[f64], _: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(Self)
    }
}

impl Evaluate for Offset {
    fn fill(&mut self, _: &Stretch<'_>, columns: &mut Columns<'_>) {
        columns.column(0).fill(1.0);
    }
}
