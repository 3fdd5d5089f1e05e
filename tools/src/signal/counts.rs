//! Deflections recorded in counts: the motion behind them, and how far it may be from it.
//!
//! The smoothest motion that rounds to the counts stands for the deflection. What it is off by does not average out as noise does: it is smooth, largest where the
//! motion is fast or turns, and the torque follows it as steeply as the loop is there. So the motion found is counted anew with the counter's zero elsewhere, found
//! again, and compared with itself (a parametric bootstrap: Efron, Tibshirani, *An Introduction to the Bootstrap*, chapter 6). The mean of these errors is taken
//! off the motion; the change of the model's torque along each says what of the parameters is due to the counts.

use std::array;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::numerics::autoregression::quantisation_step;
use crate::numerics::extremes::range;
use crate::numerics::smoothing::unround;
use crate::signal::denoise::{FEWEST_ROWS, pieces};

/// What counting took from a motion.
#[derive(Debug, Clone)]
pub struct Counts {
    step_rad: f64,
    /// What the first rows may be off by, several times.
    errors_rad: Arc<[Vec<[f64; ABREAST]>]>,
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

/// The smoothest motions that round to records abreast.
fn unrounded<const N: usize>(recorded_rad: &[[f64; N]], step_rad: f64, time_s: &[f64]) -> Vec<[f64; N]> {
    let smooth = |(own, wide): (Range<usize>, Range<usize>)| {
        let motion = unround(&recorded_rad[wide.clone()], 0.5 * step_rad, step_rad / 12.0_f64.sqrt());
        (own.start, motion[own.start - wide.start..][..own.len()].to_vec())
    };
    let found: Vec<(usize, Vec<[f64; N]>)> = blocks(time_s).into_par_iter().map(smooth).collect();
    let mut motion = recorded_rad.to_vec();
    found.into_iter().for_each(|(first, part)| motion[first..][..part.len()].copy_from_slice(&part));
    motion
}

impl Counts {
    /// The motion behind a deflection, and what counting took from it. The deflection is given back where it was not counted in steps, or where its
    /// steps are below `finest`. The first `drawn_rows` are counted again; where these are all, the mean of their errors is taken off.
    pub fn found<'a>(
        recorded_rad: Cow<'a, [f64]>,
        time_s: &[f64],
        finest: f64,
        drawn_rows: usize,
    ) -> Result<(Vec<f64>, Self), Cow<'a, [f64]>> {
        let Some(step_rad) = quantisation_step(&recorded_rad).filter(|step| *step > finest) else {
            return Err(recorded_rad);
        };
        let mut motion = unrounded(recorded_rad.as_chunks::<1>().0, step_rad, time_s).into_flattened();
        let rows = drawn_rows.min(motion.len());
        let mut errors_rad = errors(&motion[..rows], step_rad, &time_s[..rows]);
        if rows == motion.len() {
            // What another error differs from the mean of these by has (1 + 1/n) times their variance.
            let draws = DRAWS as f64;
            let wider = ((draws + 1.0) / (draws - 1.0)).sqrt();
            for (row, motion) in motion.iter_mut().enumerate() {
                let mean = errors_rad.iter().flat_map(|errors| errors[row]).sum::<f64>() / draws;
                *motion -= mean;
                errors_rad
                    .iter_mut()
                    .flat_map(|errors| &mut errors[row])
                    .for_each(|error| *error = wider * (*error - mean));
            }
        }
        Ok((motion, Self { step_rad, errors_rad: errors_rad.into() }))
    }

    /// What the first rows may be off by, the `draw`-th of [`DRAWS`] times, rad.
    pub fn errors_rad(&self, draw: usize) -> impl Iterator<Item = f64> {
        self.errors_rad[draw / ABREAST].iter().map(move |errors| errors[draw % ABREAST])
    }

    /// A count.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }
}

/// What the smoothest motion is off by where it is counted with the zero of the counter, and its own size, another part of a count each time.
fn errors(motion_rad: &[f64], step_rad: f64, time_s: &[f64]) -> Vec<Vec<[f64; ABREAST]>> {
    let (low, high) = range(motion_rad);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(f64::MIN_POSITIVE));
    let draw = |abreast: usize| {
        let places: [[f64; 2]; ABREAST] = array::from_fn(|n| {
            // The sequence of Roberts (2018): even over the unit square.
            let parts = [0.754_877_666_246_693, 0.569_840_290_998_053].map(|g| g * (ABREAST * abreast + n + 1) as f64);
            parts.map(|part| step_rad * (part.fract() - 0.5))
        });
        let moved: Vec<[f64; ABREAST]> =
            motion_rad.iter().map(|x| places.map(|[zero, size]| x + zero + (x - middle) / half * size)).collect();
        let counted: Vec<[f64; ABREAST]> =
            moved.iter().map(|moved| moved.map(|x| (x / step_rad).round() * step_rad)).collect();
        let mut errors = unrounded(&counted, step_rad, time_s);
        errors.as_flattened_mut().iter_mut().zip(moved.as_flattened()).for_each(|(found, moved)| *found -= moved);
        errors
    };
    (0..DRAWS / ABREAST).into_par_iter().map(draw).collect()
}

/// Errors drawn, and how many abreast.
pub const DRAWS: usize = 32;
const ABREAST: usize = 4;

/// Rows along which errors are drawn. Further ones are taken to repeat them: a bench that goes to the same angles again meets the same counts there, and nothing
/// averages out.
pub(crate) const DRAWN_ROWS: usize = 10_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_smoothest_motion_lacks_at_its_turns_is_put_back() {
        let rows = 400;
        let time: Vec<f64> = (0..rows).map(f64::from).collect();
        let sine: Vec<f64> = time.iter().map(|t| 70.0 * (std::f64::consts::TAU * t / 80.0).sin()).collect();
        let lacking = |drawn_rows: usize| {
            let of_turns = |zero: f64| {
                let counts: Vec<f64> = sine.iter().map(|x| (x + zero).round() - zero).collect();
                let (found, _) = Counts::found(Cow::Owned(counts), &time, 0.1, drawn_rows).unwrap();
                (20..rows as usize).step_by(40).map(|k| (sine[k] - found[k]) * sine[k].signum()).sum::<f64>() / 10.0
            };
            (0..40).map(|k| of_turns(0.025 * f64::from(k))).sum::<f64>() / 40.0
        };
        let (smoothest, corrected) = (lacking(100), lacking(400));
        assert!(smoothest > 0.02 && corrected.abs() < 0.3 * smoothest, "{smoothest} {corrected}");
    }

    #[test]
    fn a_counted_motion_is_found_within_its_counts() {
        let rows = 10_000;
        let time: Vec<f64> = (0..rows).map(|k| 0.01 * k as f64).collect();
        let motion: Vec<f64> = time.iter().map(|t| t.sin() + 0.3 * (0.31 * t).cos()).collect();
        let step = 0.007;
        let counts: Vec<f64> = motion.iter().map(|x| (x / step).round() * step).collect();
        let (found, of_counts) = Counts::found(Cow::Borrowed(&counts), &time, 1e-4, rows).unwrap();
        let rms = |x: &[f64]| (x.iter().zip(&motion).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / rows as f64).sqrt();
        assert!(rms(&found) < 0.15 * rms(&counts), "{:e} of {:e}", rms(&found), rms(&counts));
        assert!(found.iter().zip(&counts).all(|(a, b)| (a - b).abs() < 0.6 * step));
        assert!(Counts::found(Cow::Borrowed(&motion), &time, 1e-4, rows).is_err());
        assert!(Counts::found(Cow::Borrowed(&counts), &time, 0.01, rows).is_err());
        for draw in 0..DRAWS {
            let errors = of_counts.errors_rad[draw / ABREAST].iter().map(|errors| errors[draw % ABREAST].powi(2));
            let off = (errors.sum::<f64>() / rows as f64).sqrt();
            assert!((0.5..2.0).contains(&(off / rms(&found))), "{off:e} for {:e}", rms(&found));
        }
    }
}
