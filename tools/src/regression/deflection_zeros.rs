//! Zeros of the deflection encoders as free parameters: one that all recordings share, or one of each.

use std::ops::Range;

use crate::regression::columns::{Correct, Correction, Nonlinear};
use crate::regression::rows::Rows;

/// The name of the zero of the deflection.
pub const DEFLECTION_ZERO: &str = "deflection_zero_rad";

/// The zero of the deflection encoders, subtracted from every sample.
#[derive(Debug, Clone)]
pub struct DeflectionZeros {
    /// One for all recordings, or one for each.
    zeros: Vec<Nonlinear>,
}

/// Zeros are looked for within this share of the rated deflection.
const SPAN: f64 = 0.2;

impl DeflectionZeros {
    /// As many as there are recordings, or a single one that all share.
    pub fn new(count: usize, rated_deflection_rad: f64) -> Self {
        let span = SPAN * rated_deflection_rad;
        let zero = Nonlinear { name: DEFLECTION_ZERO.into(), unit: "rad".into(), low: -span, high: span, smooth: true };
        Self { zeros: vec![zero; count] }
    }

    /// Which zero a recording has.
    pub fn place(&self, recording: usize) -> usize {
        recording.min(self.zeros.len() - 1)
    }
}

struct Shift(f64);

impl Correction for DeflectionZeros {
    fn nonlinear(&self) -> &[Nonlinear] {
        &self.zeros
    }

    fn concerns(&self, parameter: usize, index: usize) -> bool {
        self.place(index) == parameter
    }

    fn start<'a>(&'a self, nonlinear: &[f64], _: &'a Rows<'a>, index: usize) -> Box<dyn Correct + 'a> {
        Box::new(Shift(nonlinear[self.place(index)]))
    }
}

impl Correct for Shift {
    fn correct(&mut self, _: Range<usize>, deflection_rad: &mut [f64]) {
        for theta in deflection_rad {
            *theta -= self.0;
        }
    }
}
