//! Deflections recorded in counts: the motion behind them, and how far it may be from it.
//!
//! The smoothest motion that rounds to the counts stands for the deflection. What it is off by does not average out as noise does: it is smooth, largest where the
//! motion is fast, and the torque follows it as steeply as the loop is there. So other motions that round to the same counts are drawn, each about as smooth, and
//! the change of the model's torque along each says what of the parameters is due to the counts.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::changes;
use super::columns::Rows;
use super::denoise::{FEWEST_ROWS, pieces};
use super::graduation::{Graduation, unround, weight_of_counts};
use super::noise::{Noise, quantisation_step};
use super::prepare::beginning;
use super::problem::{Linear, Problem};

/// What was recorded of a motion.
#[derive(Debug, Clone)]
pub struct Counts<'a> {
    recorded_rad: Cow<'a, [f64]>,
    step_rad: f64,
    /// Taken off the motion since.
    zero_rad: f64,
}

/// Rows that are unrounded together, and rows on both sides that only lead in and out.
const BLOCK: usize = 4096;
const LEAD: usize = 64;

/// Blocks of rows between gaps in time, each also with what leads in and out.
fn blocks(time_s: &[f64]) -> Vec<(Range<usize>, Range<usize>)> {
    let of_run = |run: Range<usize>| {
        let count = run.len().div_ceil(BLOCK);
        (0..count).map(move |k| {
            let own = run.start + run.len() * k / count..run.start + run.len() * (k + 1) / count;
            let wide = own.start.saturating_sub(LEAD).max(run.start)..(own.end + LEAD).min(run.end);
            (own, wide)
        })
    };
    pieces(time_s).into_iter().filter(|run| run.len() >= FEWEST_ROWS).flat_map(of_run).collect()
}

impl<'a> Counts<'a> {
    /// The smoothest motion that rounds to a deflection, and what was recorded of it. The deflection is given back where it was not counted in steps, or where its
    /// steps are below `finest`.
    pub fn found(
        recorded_rad: Cow<'a, [f64]>,
        time_s: &[f64],
        finest: f64,
    ) -> Result<(Vec<f64>, Self), Cow<'a, [f64]>> {
        let Some(step_rad) = quantisation_step(&recorded_rad).filter(|step| *step > finest) else {
            return Err(recorded_rad);
        };
        let counts = Self { recorded_rad, step_rad, zero_rad: 0.0 };
        let smooth = |(own, wide): (Range<usize>, Range<usize>)| {
            let mut motion = vec![0.0; wide.len()];
            unround(&counts.recorded_rad[wide.clone()], 0.5 * step_rad, counts.sd_rad(), &mut motion);
            (own.start, motion[own.start - wide.start..][..own.len()].to_vec())
        };
        let found: Vec<(usize, Vec<f64>)> = blocks(time_s).into_par_iter().map(smooth).collect();
        let mut motion = counts.recorded_rad.to_vec();
        found.into_iter().for_each(|(first, part)| motion[first..][..part.len()].copy_from_slice(&part));
        Ok((motion, counts))
    }

    /// Takes a zero off the motion.
    pub fn shift(&mut self, by_rad: f64) {
        self.zero_rad += by_rad;
    }

    /// The same of the first rows, lent.
    pub fn beginning(&self, rows: usize) -> Counts<'_> {
        Counts { recorded_rad: Cow::Borrowed(&self.recorded_rad[..rows]), ..*self }
    }

    /// A count.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// The standard deviation of what counting takes.
    fn sd_rad(&self) -> f64 {
        self.step_rad / 12.0_f64.sqrt()
    }

    /// Motions that could have been where the one found was.
    fn draw(&self, motion_rad: &[f64], time_s: &[f64], count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let mut drawn = vec![motion_rad.to_vec(); count];
        for (own, wide) in blocks(time_s) {
            let recorded = &self.recorded_rad[wide.clone()];
            let mean = recorded.iter().sum::<f64>() / recorded.len() as f64;
            let centred: Vec<f64> = recorded.iter().map(|x| x - mean).collect();
            let graduation = Graduation::new(wide.len(), weight_of_counts(&centred, self.sd_rad()));
            for motion in &mut drawn {
                let off = graduation.draw(self.sd_rad(), random);
                for (row, off) in own.clone().zip(&off[own.start - wide.start..]) {
                    let (here, count) = (motion[row], self.recorded_rad[row] - self.zero_rad);
                    let (low, high) = (count - 0.5 * self.step_rad, count + 0.5 * self.step_rad);
                    // The motion found may be a little beside its counts.
                    motion[row] = (here + off).clamp(low.min(here), high.max(here));
                }
            }
        }
        drawn
    }
}

/// Motions drawn.
const DRAWS: usize = 32;

/// Rows along which motions are drawn. Further ones are taken to repeat them: a bench that goes to the same angles again meets the same counts there, and nothing
/// averages out.
const DRAWN_ROWS: usize = 10_000;

/// What other motions that round to the same counts would make of the parameters, as `changes::scores` of each. `None` without counted deflections.
pub fn scores(
    problem: &Problem<'_>,
    nonlinear: &[f64],
    linear: &Linear,
    noise: &[Noise],
    seed: u64,
) -> Option<DMatrix<f64>> {
    if problem.rows.iter().all(|rows| rows.counts.is_none()) {
        return None;
    }
    let rows = beginning(problem.rows, DRAWN_ROWS);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let along = |rows: &[Rows<'_>]| problem.on(rows).residuals(nonlinear, linear);
    let found = along(&rows);
    let motions: Vec<Vec<Vec<f64>>> = rows
        .iter()
        .map(|rows| match &rows.counts {
            Some(counts) => counts.draw(&rows.deflection_rad, &rows.recording.time_s[..rows.len()], DRAWS, &mut random),
            None => vec![rows.deflection_rad.to_vec(); DRAWS],
        })
        .collect();
    let drawn: Vec<Vec<Vec<f64>>> = (0..DRAWS)
        .into_par_iter()
        .map(|draw| {
            let moved = rows
                .iter()
                .zip(&motions)
                .map(|(rows, motions)| Rows { deflection_rad: Cow::Borrowed(&motions[draw]), ..rows.clone() });
            changes::between(&found, along(&moved.collect::<Vec<_>>()))
        })
        .collect();
    let count = |rows: &[Rows<'_>]| rows.iter().map(Rows::len).sum::<usize>() as f64;
    let scale = count(problem.rows) / count(&rows) / (DRAWS as f64).sqrt();
    Some(scale * changes::scores(&problem.on(&rows), nonlinear, linear, Some(noise), &drawn))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counted_motion_is_found_within_its_counts() {
        let rows = 10_000;
        let time: Vec<f64> = (0..rows).map(|k| 0.01 * k as f64).collect();
        let motion: Vec<f64> = time.iter().map(|t| t.sin() + 0.3 * (0.31 * t).cos()).collect();
        let step = 0.007;
        let counts: Vec<f64> = motion.iter().map(|x| (x / step).round() * step).collect();
        let (found, of_counts) = Counts::found(Cow::Borrowed(&counts), &time, 1e-4).unwrap();
        let rms = |x: &[f64]| (x.iter().zip(&motion).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / rows as f64).sqrt();
        assert!(rms(&found) < 0.15 * rms(&counts), "{:e} of {:e}", rms(&found), rms(&counts));
        assert!(found.iter().zip(&counts).all(|(a, b)| (a - b).abs() < 0.6 * step));
        assert!(Counts::found(Cow::Borrowed(&motion), &time, 1e-4).is_err());
        assert!(Counts::found(Cow::Borrowed(&counts), &time, 0.01).is_err());
        for drawn in of_counts.draw(&found, &time, 4, &mut ChaCha8Rng::seed_from_u64(1)) {
            assert!(drawn.iter().zip(&counts).all(|(a, b)| (a - b).abs() < 0.6 * step));
            let off = (drawn.iter().zip(&found).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / rows as f64).sqrt();
            assert!((0.5..2.0).contains(&(off / rms(&found))), "{off:e} for {:e}", rms(&found));
        }
    }
}
