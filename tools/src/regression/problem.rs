//! One least-squares problem over all recordings: columns in, triangular factors out, in one pass of bounded memory.
//!
//! A pass walks each recording once in blocks of rows: corrections, columns, derivative columns, noise filter, QR. Nothing of the size of
//! the recording is kept. The nuisances of a recording come first in its factor and are eliminated there, so any number of
//! recordings shares one small triangle.

use std::ops::Range;

use crate::numerics::autoregression::Noise;
use crate::numerics::bounded;
use crate::numerics::bounded::{Bound, Solution};
use crate::numerics::mark::Mark;
use crate::numerics::qr::{Block, Triangle};
use crate::numerics::whitening::Filter;
use crate::regression::columns::{
    Column, Columns, Contribution, Correct, Correction, Evaluate, Nonlinear, Scope, Stretch,
};
use crate::regression::factors::{Factors, Shared};
use crate::regression::rows::Rows;

/// Recordings and what is to explain them.
pub struct Problem<'a> {
    /// The recordings.
    pub rows: &'a [Rows<'a>],
    /// Disturbances of the deflection, in the order in which they are taken out.
    pub corrections: Vec<&'a dyn Correction>,
    /// Parts of the torque.
    pub contributions: Vec<&'a dyn Contribution>,
}

/// The linear parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Linear {
    /// Of the gear.
    pub gear: Vec<f64>,
    /// Of each recording.
    pub recordings: Vec<Vec<f64>>,
}

/// How a pass is done.
#[derive(Debug, Clone, Copy)]
pub struct Sweep<'s> {
    /// Noise of each recording; white where there is none.
    pub noise: Option<&'s [Noise]>,
    /// Contiguous blocks that each recording is cut into for held-out prediction.
    pub folds: usize,
    /// Only every so many rows count; with white noise only.
    pub stride: usize,
}

impl Sweep<'_> {
    /// All rows, one block, white noise.
    pub const PLAIN: Sweep<'static> = Sweep { noise: None, folds: 1, stride: 1 };
}

/// Where the derivatives with respect to some nonlinear parameters are taken.
#[derive(Debug, Clone, Copy)]
pub struct Tangent<'t> {
    /// Which nonlinear parameters.
    pub parameters: &'t [usize],
    /// At which linear ones.
    pub linear: &'t Linear,
}

const BLOCK: usize = 256;

/// A nonlinear parameter is moved by this share of its range (or of itself, if that is less and it has one sign) to take a derivative.
const RELATIVE_STEP: f64 = 1e-5;

impl<'a> Problem<'a> {
    /// The same on other rows.
    pub fn on<'b>(&'b self, rows: &'b [Rows<'b>]) -> Problem<'b> {
        Problem { rows, corrections: self.corrections.clone(), contributions: self.contributions.clone() }
    }

    /// All nonlinear parameters: those of the corrections, then those of the contributions.
    pub fn nonlinear(&self) -> Vec<&Nonlinear> {
        let corrections = self.corrections.iter().flat_map(|c| c.nonlinear());
        corrections.chain(self.contributions.iter().flat_map(|c| c.nonlinear())).collect()
    }

    /// The gear's linear parameters.
    pub fn gear_columns(&self) -> Vec<&Column> {
        self.columns(Scope::Gear)
    }

    /// The nuisances of each recording.
    pub fn nuisance_columns(&self) -> Vec<&Column> {
        self.columns(Scope::Recording)
    }

    fn columns(&self, scope: Scope) -> Vec<&Column> {
        self.contributions.iter().flat_map(|c| c.columns()).filter(|c| c.scope == scope).collect()
    }

    /// The bounds of the gear's linear parameters.
    pub fn bounds(&self) -> Vec<Bound> {
        self.gear_columns().iter().map(|c| c.bound).collect()
    }

    /// One pass over all recordings.
    pub fn factor(&self, nonlinear: &[f64], tangent: Option<Tangent<'_>>, sweep: Sweep<'_>) -> Factors {
        let layout = self.layout();
        let derivatives = tangent.map_or(0, |t| t.parameters.len());
        let triangles =
            (0..self.rows.len()).map(|index| self.factor_one(index, &layout, nonlinear, tangent, sweep)).collect();
        Factors { nuisances: layout.nuisances, gear: layout.gear, derivatives, triangles }
    }

    /// What one recording says of the shared parameters, without derivatives.
    pub fn shared_of(&self, index: usize, nonlinear: &[f64], sweep: Sweep<'_>) -> Shared {
        let layout = self.layout();
        let triangles = vec![self.factor_one(index, &layout, nonlinear, None, sweep)];
        Factors { nuisances: layout.nuisances, gear: layout.gear, derivatives: 0, triangles }.shared(0, |_| true)
    }

    /// The bounded optimum of the linear parameters, and its residual sum of squares.
    pub fn solve(&self, nonlinear: &[f64], sweep: Sweep<'_>) -> (Linear, Solution) {
        let system = self.factor(nonlinear, None, sweep).combine(|_, _| true);
        let solution = bounded::solve(&system.shared, &self.bounds());
        (system.linear(&solution.coefficients), solution)
    }

    /// Recorded torque minus model, row by row, without filtering.
    pub fn residuals(&self, nonlinear: &[f64], linear: &Linear) -> Vec<Vec<f64>> {
        let layout = self.layout();
        let mut residuals = Vec::with_capacity(self.rows.len());
        for (index, rows) in self.rows.iter().enumerate() {
            let weights = layout.coefficients(linear, index);
            let mut residual = rows.torque.to_vec();
            let mut chain = Chain::start(self, &layout, &self.split(nonlinear), rows, index, None);
            let mut block = Block::new(weights.len(), BLOCK);
            let mut deflection = Vec::new();
            for range in stretches(0..rows.len()) {
                block.set_rows(range.len());
                chain.correct(rows, &range, &mut deflection);
                chain.fill(rows, &range, &deflection, &mut block, 0);
                for (column, weight) in weights.iter().enumerate() {
                    let values = residual[range.clone()].iter_mut().zip(block.column(column));
                    values.for_each(|(r, x)| *r -= weight * x);
                }
            }
            residuals.push(residual);
        }
        residuals
    }

    fn layout(&self) -> Layout {
        let (nuisances, gear) = (self.nuisance_columns().len(), self.gear_columns().len());
        let (mut next_nuisance, mut next_gear) = (0..nuisances, nuisances..nuisances + gear);
        let mut place = |column: &Column| match column.scope {
            Scope::Recording => next_nuisance.next(),
            Scope::Gear => next_gear.next(),
            Scope::Known => Some(nuisances + gear),
        };
        let parameters = |c: &&dyn Contribution| c.columns().iter().filter_map(&mut place).collect();
        let at = self.contributions.iter().map(parameters).collect();
        Layout { nuisances, gear, known: !self.columns(Scope::Known).is_empty(), at }
    }

    /// The parameters of each correction, then of each contribution.
    fn split<'p>(&self, nonlinear: &'p [f64]) -> Vec<&'p [f64]> {
        let counts = self.corrections.iter().map(|c| c.nonlinear().len());
        let counts = counts.chain(self.contributions.iter().map(|c| c.nonlinear().len()));
        let mut rest = nonlinear;
        counts
            .map(|count| {
                let (own, after) = rest.split_at(count);
                rest = after;
                own
            })
            .collect()
    }

    /// Which part a nonlinear parameter belongs to: a correction, or a contribution by number.
    fn owner(&self, parameter: usize) -> Option<usize> {
        let corrections: usize = self.corrections.iter().map(|c| c.nonlinear().len()).sum();
        let mut left = parameter.checked_sub(corrections)?;
        self.contributions.iter().position(|c| {
            let count = c.nonlinear().len();
            let here = left < count;
            left = left.wrapping_sub(count);
            here
        })
    }

    /// Whether a nonlinear parameter changes anything in a recording.
    fn concerns(&self, parameter: usize, index: usize) -> bool {
        let mut own = parameter;
        for correction in &self.corrections {
            match own.checked_sub(correction.nonlinear().len()) {
                None => return correction.concerns(own, index),
                Some(after) => own = after,
            }
        }
        true
    }

    /// The values on both sides at which a derivative is taken.
    fn sides(&self, nonlinear: &[f64], parameter: usize) -> (f64, f64) {
        let info = self.nonlinear()[parameter];
        let value = nonlinear[parameter];
        let span = info.high - info.low;
        let of_any_size = info.low < 0.0 && info.high > 0.0;
        let step = RELATIVE_STEP * if of_any_size { span } else { span.min(value.abs()).max(1e-6 * span) };
        ((value - step).max(info.low), (value + step).min(info.high))
    }

    fn factor_one(
        &self,
        index: usize,
        layout: &Layout,
        nonlinear: &[f64],
        tangent: Option<Tangent<'_>>,
        sweep: Sweep<'_>,
    ) -> Vec<(Triangle, usize)> {
        let rows = &self.rows[index];
        let noise = sweep.noise.map(|n| &n[index]);
        let history = noise.map_or(0, Noise::order);
        let modelled = layout.nuisances + layout.gear;
        let derivatives = tangent.map_or(0, |t| t.parameters.len());
        let width = modelled + derivatives + 1;
        let mut chain = Chain::start(self, layout, &self.split(nonlinear), rows, index, None);
        let mut sides = tangent.map_or_else(Vec::new, |t| self.start_sides(t, nonlinear, rows, index, layout));
        let mut raw = Block::new(width, history + BLOCK);
        let mut filtered = Block::new(if history > 0 { width } else { 0 }, BLOCK);
        let mut scratch = Block::new(modelled + 1, BLOCK);
        let (mut deflection, mut moved) = (Vec::new(), Vec::new());
        let mut filter = Filter::start();
        let mut factors = Vec::with_capacity(sweep.folds);
        for fold in 0..sweep.folds {
            let mut factor = Triangle::new(width);
            let mut counted = 0;
            let bounds = rows.len() * fold / sweep.folds..rows.len() * (fold + 1) / sweep.folds;
            for range in stretches(bounds) {
                raw.set_rows(history + range.len());
                chain.correct(rows, &range, &mut deflection);
                chain.fill(rows, &range, &deflection, &mut raw, history);
                // What is known stands where the first derivative or the torque will.
                let known = layout.known.then(|| raw.column(modelled)[history..].to_vec());
                let torque = &mut raw.column_mut(width - 1)[history..];
                torque.copy_from_slice(&rows.torque[range.clone()]);
                torque.iter_mut().zip(known.iter().flatten()).for_each(|(torque, known)| *torque -= known);
                for (k, side) in sides.iter_mut().enumerate() {
                    raw.column_mut(modelled + k)[history..].fill(0.0);
                    for (chain, weights) in side {
                        chain.correct(rows, &range, &mut moved);
                        scratch.set_rows(range.len());
                        chain.fill(rows, &range, &moved, &mut scratch, 0);
                        for &(column, weight) in weights.iter() {
                            let to = raw.column_mut(modelled + k)[history..].iter_mut();
                            to.zip(scratch.column(column)).for_each(|(d, x)| *d += weight * x);
                        }
                    }
                }
                let marks = &rows.marks[range.clone()];
                match noise {
                    Some(noise) if history > 0 => {
                        let exceptions = filter.exceptions(history, marks);
                        filtered.set_rows(range.len());
                        for j in 0..width {
                            noise.filter(&exceptions, raw.column(j), history, filtered.column_mut(j));
                            raw.column_mut(j).copy_within(range.len().., 0);
                        }
                        counted += range.len() - exceptions.iter().filter(|(_, start)| start.is_none()).count();
                        factor.absorb(&mut filtered);
                    }
                    _ => {
                        counted +=
                            choose_rows(&mut raw, marks, range.start, sweep.stride, noise.map_or(1.0, |n| n.weight));
                        factor.absorb(&mut raw);
                    }
                }
            }
            factors.push((factor, counted));
        }
        factors
    }

    fn start_sides(
        &'a self,
        tangent: Tangent<'_>,
        nonlinear: &[f64],
        rows: &'a Rows<'a>,
        index: usize,
        layout: &Layout,
    ) -> Vec<Side<'a>> {
        let coefficients = layout.coefficients(tangent.linear, index);
        let side = |&parameter: &usize| {
            if !self.concerns(parameter, index) {
                return Vec::new();
            }
            let owner = self.owner(parameter);
            let (low, high) = self.sides(nonlinear, parameter);
            let columns: Vec<usize> = match owner {
                Some(contribution) => layout.at[contribution].clone(),
                None => (0..coefficients.len()).collect(),
            };
            let at = |value: f64, sign: f64| {
                let weight = sign / (high - low);
                let mut moved = nonlinear.to_vec();
                moved[parameter] = value;
                let split = self.split(&moved);
                let own: Vec<f64> = columns.iter().map(|&c| coefficients[c]).collect();
                let sum = owner.and_then(|contribution| {
                    let nonlinear = split[self.corrections.len() + contribution];
                    self.contributions[contribution].start_sum(nonlinear, &own, rows, index)
                });
                if let Some(sum) = sum {
                    return (Chain { corrections: Vec::new(), contributions: vec![(sum, vec![0])] }, vec![(0, weight)]);
                }
                let chain = Chain::start(self, layout, &split, rows, index, owner);
                (chain, columns.iter().zip(own).map(|(&c, own)| (c, weight * own)).collect())
            };
            vec![at(high, 1.0), at(low, -1.0)]
        };
        tangent.parameters.iter().map(side).collect()
    }
}

/// The model on both sides of a derivative, and what each of its columns adds to it.
type Side<'a> = Vec<(Chain<'a>, Vec<(usize, f64)>)>;

/// Where the columns of each contribution stand.
struct Layout {
    nuisances: usize,
    gear: usize,
    /// Whether a column after these is known.
    known: bool,
    at: Vec<Vec<usize>>,
}

impl Layout {
    /// The coefficients of all columns in a recording.
    fn coefficients(&self, linear: &Linear, recording: usize) -> Vec<f64> {
        let known = self.known.then_some(&1.0);
        linear.recordings[recording].iter().chain(&linear.gear).chain(known).copied().collect()
    }
}

/// Corrections and contributions at work on one recording, each of these with the places of its columns.
struct Chain<'a> {
    corrections: Vec<Box<dyn Correct + 'a>>,
    contributions: Vec<(Box<dyn Evaluate + 'a>, Vec<usize>)>,
}

impl<'a> Chain<'a> {
    /// All parts, or of the contributions `only` one.
    fn start(
        problem: &'a Problem<'_>,
        layout: &Layout,
        split: &[&[f64]],
        rows: &'a Rows<'a>,
        index: usize,
        only: Option<usize>,
    ) -> Self {
        let first = problem.corrections.len();
        let corrections = problem.corrections.iter().zip(split).map(|(c, p)| c.start(p, rows, index)).collect();
        let chosen = (0..problem.contributions.len()).filter(|number| only.is_none_or(|o| o == *number));
        let started = chosen.map(|number| {
            let evaluate = problem.contributions[number].start(split[first + number], rows, index);
            (evaluate, layout.at[number].clone())
        });
        Self { corrections, contributions: started.collect() }
    }

    fn correct(&mut self, rows: &Rows<'_>, range: &Range<usize>, deflection: &mut Vec<f64>) {
        deflection.clear();
        if !rows.deflection_rad.is_empty() {
            deflection.extend_from_slice(&rows.deflection_rad[range.clone()]);
        }
        for correction in &mut self.corrections {
            correction.correct(range.clone(), deflection);
        }
    }

    fn fill(&mut self, rows: &Rows<'_>, range: &Range<usize>, deflection: &[f64], block: &mut Block, first_row: usize) {
        let stretch = Stretch { rows, range: range.clone(), deflection_rad: deflection };
        for (contribution, at) in &mut self.contributions {
            contribution.fill(&stretch, &mut Columns { block, at, first_row });
        }
    }
}

fn stretches(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range.step_by(BLOCK).map(move |from| from..(from + BLOCK).min(end))
}

/// Clears the rows that do not count; returns how many do.
fn choose_rows(block: &mut Block, marks: &[Mark], first: usize, stride: usize, weight: f64) -> usize {
    let counts = |i: usize| marks[i].counts() && (first + i).is_multiple_of(stride);
    let kept: Vec<usize> = (0..marks.len()).filter(|&i| counts(i)).collect();
    if kept.len() < marks.len() || weight != 1.0 {
        for j in 0..block.columns() {
            let column = block.column_mut(j);
            for (to, &from) in kept.iter().enumerate() {
                column[to] = weight * column[from];
            }
        }
        block.set_rows(kept.len());
    }
    kept.len()
}
