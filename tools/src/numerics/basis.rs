//! An orthonormal basis of columns, to which many others are compared.

use crate::numerics::vector::{axpy, dot};

/// An orthonormal basis of whitened columns; at first the span of nothing.
#[derive(Default)]
pub struct Basis {
    columns: Vec<Vec<f64>>,
}

/// What is left of a column whose share below this is in the span of others already.
const DEPENDENT: f64 = 1e-5;

impl Basis {
    /// Takes a column in; false where it is in the span already.
    pub fn add(&mut self, column: &[f64]) -> bool {
        let before = dot(column, column).sqrt();
        let mut rest = column.to_vec();
        // Twice is enough (Kahan, Parlett).
        self.reduce(&mut rest);
        self.reduce(&mut rest);
        let after = dot(&rest, &rest).sqrt();
        if after.is_nan() || after <= DEPENDENT * before || before == 0.0 {
            return false;
        }
        rest.iter_mut().for_each(|x| *x /= after);
        self.columns.push(rest);
        true
    }

    /// Takes the span out of a column.
    pub fn reduce(&self, column: &mut [f64]) {
        for q in &self.columns {
            axpy(-dot(q, column), q, column);
        }
    }

    /// How much of the squared length of `y`, which has nothing in this basis, the columns explain beyond it, and by how many of them.
    pub fn gain(&self, columns: &[Vec<f64>], y: &[f64]) -> (f64, usize) {
        let own = self.beyond(columns);
        (own.iter().map(|q| dot(q, y).powi(2)).sum(), own.len())
    }

    /// An orthonormal basis of what columns have beyond this one.
    pub fn beyond(&self, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut own = Self::default();
        for column in columns {
            let before = dot(column, column).sqrt();
            let mut rest = column.clone();
            self.reduce(&mut rest);
            self.reduce(&mut rest);
            if dot(&rest, &rest).sqrt() > DEPENDENT * before {
                own.add(&rest);
            }
        }
        own.columns
    }
}
