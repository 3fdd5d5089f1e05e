//! The numbers of a column: shared by its copies, lent by another library or its own, and copied before they are changed.

use std::fmt;
use std::ops::{Deref, DerefMut, Range};
use std::sync::Arc;

/// Numbers that lie elsewhere, such as an array of Python. They stay where they are, and what they are, while this lives.
pub type Lender = Arc<dyn AsRef<[f64]> + Send + Sync>;

/// The numbers of a column. A clone shares them; a change through a mutable slice copies them first where they are shared or lent.
#[derive(Clone)]
pub struct Samples(Storage);

#[derive(Clone)]
enum Storage {
    Own(Arc<Vec<f64>>),
    Lent { lender: Lender, rows: Range<usize> },
}

impl Samples {
    /// The numbers of a lender, without a copy.
    pub fn lent(lender: Lender) -> Self {
        let rows = 0..(*lender).as_ref().len();
        Samples(Storage::Lent { lender, rows })
    }

    /// Whether they lie elsewhere.
    pub fn is_lent(&self) -> bool {
        matches!(self.0, Storage::Lent { .. })
    }

    /// Leaves out all rows but some consecutive ones.
    pub fn crop(&mut self, kept: &Range<usize>) {
        match &mut self.0 {
            Storage::Own(numbers) if *kept == (0..numbers.len()) => {}
            Storage::Own(numbers) => {
                let numbers = Arc::make_mut(numbers);
                numbers.truncate(kept.end);
                numbers.drain(..kept.start);
            }
            Storage::Lent { rows, .. } => *rows = rows.start + kept.start..rows.start + kept.end,
        }
    }
}

impl Deref for Samples {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match &self.0 {
            Storage::Own(numbers) => numbers,
            Storage::Lent { lender, rows } => &(**lender).as_ref()[rows.clone()],
        }
    }
}

impl DerefMut for Samples {
    fn deref_mut(&mut self) -> &mut [f64] {
        if let Storage::Lent { .. } = self.0 {
            *self = self.to_vec().into();
        }
        match &mut self.0 {
            Storage::Own(numbers) => Arc::make_mut(numbers).as_mut_slice(),
            Storage::Lent { .. } => unreachable!("lent numbers were copied"),
        }
    }
}

impl Default for Samples {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<f64>> for Samples {
    fn from(numbers: Vec<f64>) -> Self {
        Samples(Storage::Own(Arc::new(numbers)))
    }
}

impl From<Samples> for Vec<f64> {
    fn from(samples: Samples) -> Self {
        match samples.0 {
            Storage::Own(numbers) => Arc::unwrap_or_clone(numbers),
            Storage::Lent { .. } => samples.to_vec(),
        }
    }
}

impl FromIterator<f64> for Samples {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        numbers.into_iter().collect::<Vec<f64>>().into()
    }
}

impl IntoIterator for Samples {
    type Item = f64;
    type IntoIter = std::vec::IntoIter<f64>;

    fn into_iter(self) -> Self::IntoIter {
        Vec::from(self).into_iter()
    }
}

impl<'a> IntoIterator for &'a Samples {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Samples {
    type Item = &'a mut f64;
    type IntoIter = std::slice::IterMut<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl AsRef<[f64]> for Samples {
    fn as_ref(&self) -> &[f64] {
        self
    }
}

impl<T: AsRef<[f64]> + ?Sized> PartialEq<T> for Samples {
    fn eq(&self, other: &T) -> bool {
        **self == *other.as_ref()
    }
}

impl fmt::Debug for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lent() -> (Lender, Samples) {
        let lender: Lender = Arc::new(vec![0.0, 1.0, 2.0, 3.0]);
        (Arc::clone(&lender), Samples::lent(lender))
    }

    #[test]
    fn copies_lie_in_one_place_until_one_is_changed() {
        let (lender, lent) = lent();
        for samples in [lent, vec![0.0, 1.0, 2.0, 3.0].into()] {
            let mut other = samples.clone();
            assert_eq!(samples.as_ptr(), other.as_ptr());
            other[1] = 5.0;
            assert_eq!((&*samples, &*other), (&[0.0, 1.0, 2.0, 3.0][..], &[0.0, 5.0, 2.0, 3.0][..]));
            let place = other.as_ptr();
            other[2] = 5.0;
            assert_eq!(other.as_ptr(), place);
        }
        assert_eq!((*lender).as_ref(), [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn rows_are_left_out_without_a_copy_of_what_is_lent() {
        let (lender, lent) = lent();
        let place = (*lender).as_ref()[2..].as_ptr();
        for (mut samples, stays) in [(lent, true), (vec![0.0, 1.0, 2.0, 3.0].into(), false)] {
            samples.crop(&(1..4));
            samples.crop(&(1..2));
            assert_eq!(*samples, [2.0]);
            assert_eq!(samples.as_ptr() == place, stays);
        }
        let (_, lent) = self::lent();
        assert_eq!(Vec::from(lent), [0.0, 1.0, 2.0, 3.0]);
    }
}
