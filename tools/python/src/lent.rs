//! Arrays of Python that a recording reads where they lie, and whether they were written to since.

use std::sync::Arc;

use gmhm_tools::recording::{Lender, Recording, Samples};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

/// An array that stays where it is because it is referred to.
struct Lent {
    _array: Py<PyAny>,
    first: *const f64,
    rows: usize,
}

// SAFETY: the numbers are only read. The reference is given back under the interpreter's lock, by PyO3 if the thread that drops it does not hold it.
unsafe impl Send for Lent {}
// SAFETY: as above.
unsafe impl Sync for Lent {}

impl AsRef<[f64]> for Lent {
    fn as_ref(&self) -> &[f64] {
        // SAFETY: the array is contiguous and aligned, and its buffer lives as long as the reference to it. That nobody writes to it meanwhile is
        // the caller's part (`gmhm.read`); `Prints` finds out where it was not kept.
        unsafe { std::slice::from_raw_parts(self.first, self.rows) }
    }
}

/// The numbers of an array, without a copy.
///
/// # Errors
/// An array that is not contiguous.
pub fn lent(array: &PyReadonlyArray1<'_, f64>) -> PyResult<Samples> {
    let numbers = array.as_slice()?;
    let array: &Bound<'_, PyAny> = array.as_any();
    let lender: Lender =
        Arc::new(Lent { _array: array.clone().unbind(), first: numbers.as_ptr(), rows: numbers.len() });
    Ok(Samples::lent(lender))
}

/// What the lent columns of a recording were when it was made.
pub struct Prints(Vec<(&'static str, u64)>);

impl Prints {
    /// Of the columns that are lent.
    pub fn of(recording: &Recording) -> Self {
        let lent = recording.columns().into_iter().filter(|(_, numbers)| numbers.is_lent());
        Self(lent.map(|(name, numbers)| (name, print(numbers))).collect())
    }

    /// The first column that is no longer what it was.
    pub fn changed(&self, recording: &Recording) -> Option<&'static str> {
        let now = Self::of(recording);
        now.0.iter().zip(&self.0).find(|(now, before)| now != before).map(|((name, _), _)| *name)
    }
}

/// A number that differs when numbers do, but for one chance in 2⁶⁴. Four at a time, for speed: a pass costs as much as reading the memory.
fn print(numbers: &[f64]) -> u64 {
    const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
    let mixed = |lane: u64, number: f64| (lane ^ number.to_bits()).wrapping_mul(ODD).rotate_left(29);
    let (fours, rest) = numbers.as_chunks::<4>();
    let mut lanes = [1, 2, 3, 4];
    for four in fours {
        for (lane, number) in lanes.iter_mut().zip(four) {
            *lane = mixed(*lane, *number);
        }
    }
    let lanes = lanes.into_iter().map(f64::from_bits);
    rest.iter().copied().chain(lanes).fold(0, mixed)
}
