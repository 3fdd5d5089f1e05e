//! Rows near standstill that show only the noise of the velocity. This noise changes the sign of the friction in a model, and the residual is the noise times the slope of the friction.

use std::borrow::Cow;
use std::ops::Range;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::kinds::SMOOTHING;
use crate::model::Model;
use crate::numerics::mark::Mark;
use crate::numerics::robust;
use crate::recording::{Recording, Samples};
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;
use crate::signal::denoise::channel_sd;

/// A row is disturbed where the noise of the motion changes the torque of the model by more than this part of the residual's standard deviation.
const DISTURBED: f64 = 0.7;
/// At least this part of a recording's rows stays.
const LEAST_LEFT: f64 = 0.5;
/// All rows are kept if the variances of the disturbed rows add up to less than this part of the squared residual.
const LEAST_PART: f64 = 0.01;
/// All rows are kept if the residual of the disturbed rows is more than so many times what the noise explains, rms: it is then physics. It was 0.8 to 2.3 times as much for synthetic joints, and 10 to 16 times for a
/// sliding table with stiction.
const PHYSICS: f64 = 5.0;
/// Copies of the recordings with fresh noise.
const COPIES: usize = 4;
/// The variance of a row is averaged with that of so many neighbours on either side: few copies give it few degrees of freedom.
const NEIGHBOURS: usize = 2;

/// What the noise of the measured motion does to a model's torque.
pub struct MotionNoise<'a> {
    /// The motion freed of its noise.
    clean: &'a [Cow<'a, Recording>],
    /// The standard deviations of the noise of each recording's motions.
    sds: Vec<[f64; 3]>,
}

impl<'a> MotionNoise<'a> {
    /// The noise of recordings, and the recordings without it; `None` where the model has no friction that changes its sign, or no motion has noise.
    pub fn new(recorded: &[Recording], clean: &'a [Cow<'a, Recording>], model: &Model) -> Option<Self> {
        let changes_sign = model.terms.iter().any(|term| term.values.contains_key(SMOOTHING));
        let of = |recording: &Recording| motions(recording).map(|m| m.as_deref().map_or(0.0, channel_sd));
        let sds: Vec<[f64; 3]> = if changes_sign { recorded.iter().map(of).collect() } else { Vec::new() };
        sds.iter().flatten().any(|sd| *sd > 0.0).then_some(Self { clean, sds })
    }

    /// The variance of a torque in each row that comes from the noise of the motion, N²·m² or A², all recordings in one line: its scatter over copies of the recordings with fresh white noise of each
    /// motion's standard deviation.
    ///
    /// # Errors
    /// Those of `torque`.
    pub fn variances<E>(&self, seed: u64, torque: impl Fn(&[Recording]) -> Result<Vec<f64>, E>) -> Result<Vec<f64>, E> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut sums, mut squares) = (Vec::new(), Vec::new());
        for _ in 0..COPIES {
            let copies = self.clean.iter().zip(&self.sds).map(|(clean, sds)| noisy(clean, sds, &mut random));
            let torque = torque(&copies.collect::<Vec<_>>())?;
            sums.resize(torque.len(), 0.0);
            squares.resize(torque.len(), 0.0);
            for ((sum, square), torque) in sums.iter_mut().zip(&mut squares).zip(torque) {
                *sum += torque;
                *square += torque * torque;
            }
        }
        let count = COPIES as f64;
        let variances =
            sums.iter().zip(&squares).map(|(sum, square)| ((square - sum * sum / count) / (count - 1.0)).max(0.0));
        let variances: Vec<f64> = variances.collect();
        let about = |row: usize| {
            let near = &variances[row.saturating_sub(NEIGHBOURS)..(row + NEIGHBOURS + 1).min(variances.len())];
            near.iter().sum::<f64>() / near.len() as f64
        };
        Ok((0..variances.len()).map(about).collect())
    }
}

/// Skips the rows of a recording in which the noise of the measured motion changes the torque of a fitted model by more than [`DISTURBED`] of the residual; returns how many. With a friction that
/// changes its sign these are the rows near standstill. All rows are kept if more than half would be skipped, or if their residual is larger than the noise explains.
pub fn skip(residual: &[f64], variances: &[f64], marks: &mut [Mark]) -> usize {
    let rows = disturbed(residual, variances, marks);
    rows.iter().for_each(|row| marks[*row] = Mark::Skipped);
    rows.len()
}

impl Dataset<'_> {
    /// Skips the rows in which the noise of the motion as recorded changes the torque of a fitted model by as much as the residual; returns how many.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn skip_disturbed(&mut self, recorded: &[Recording], fit: &Fitted, seed: u64) -> Result<usize, EstimateError> {
        let Some(noise) = MotionNoise::new(recorded, &self.recordings, &fit.model) else { return Ok(0) };
        let torque =
            |copies: &[Recording]| Ok::<_, EstimateError>(Dataset::new(copies, &fit.model)?.total(&fit.model)?);
        let variances = noise.variances(seed, torque)?;
        let of = |span: &Range<usize>, marks: &mut Vec<Mark>| {
            skip(&fit.residual[span.clone()], &variances[span.clone()], marks)
        };
        Ok(self.spans.iter().zip(&mut self.marks).map(|(span, marks)| of(span, marks)).sum())
    }
}

/// The rows of a recording that count and are disturbed.
fn disturbed(residual: &[f64], variances: &[f64], marks: &[Mark]) -> Vec<usize> {
    let counted: Vec<usize> = (0..marks.len()).filter(|row| marks[*row].counts()).collect();
    let mut sizes: Vec<f64> = counted.iter().map(|row| residual[*row].abs()).collect();
    let limit = (DISTURBED * robust::standard_deviation(&mut sizes)).powi(2);
    let rows: Vec<usize> = counted.iter().copied().filter(|row| variances[*row] > limit).collect();
    let squares = |rows: &[usize]| rows.iter().map(|row| residual[*row].powi(2)).sum::<f64>();
    let noise: f64 = rows.iter().map(|row| variances[*row]).sum();
    let are_few = rows.len() as f64 <= (1.0 - LEAST_LEFT) * counted.len() as f64;
    let are_noise = noise > LEAST_PART * squares(&counted) && squares(&rows) < PHYSICS.powi(2) * noise;
    if are_few && are_noise { rows } else { Vec::new() }
}

/// The channels that a friction follows.
fn motions(recording: &Recording) -> [&Option<Samples>; 3] {
    [&recording.theta_in_rad, &recording.theta_out_rad, &recording.velocity_out_rad_per_s]
}

/// A smoothed recording with fresh noise of these standard deviations on its motions.
fn noisy(clean: &Recording, sds: &[f64; 3], random: &mut ChaCha8Rng) -> Recording {
    let mut copy = clean.clone();
    let channels = [&mut copy.theta_in_rad, &mut copy.theta_out_rad, &mut copy.velocity_out_rad_per_s];
    for (channel, sd) in channels.into_iter().zip(sds).filter(|(_, sd)| **sd > 0.0) {
        let Some(values) = channel else { continue };
        let with_noise = |value: &f64| {
            let normal: f64 = StandardNormal.sample(random);
            value + sd * normal
        };
        *channel = Some(values.iter().map(with_noise).collect::<Vec<f64>>().into());
    }
    copy
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of a thousand rows are disturbed, if the motion's noise changes the torque of one row in `every` by `sd`, and the residual there is `left` times as large; elsewhere it is 1.
    fn found(every: usize, sd: f64, left: f64) -> usize {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let is_disturbed = |row: usize| row.is_multiple_of(every);
        let size = |row: usize| if is_disturbed(row) { left * sd } else { 1.0 };
        let residual: Vec<f64> =
            (0..1000).map(|row| size(row) * Distribution::<f64>::sample(&StandardNormal, &mut random)).collect();
        let variances: Vec<f64> = (0..1000).map(|row| if is_disturbed(row) { sd * sd } else { 0.01 }).collect();
        disturbed(&residual, &variances, &[Mark::Used; 1000]).len()
    }

    #[test]
    fn rows_are_skipped_where_the_noise_of_the_motion_explains_what_is_left() {
        assert_eq!(found(10, 3.0, 1.0), 100, "one row in ten");
        assert_eq!(found(10, 3.0, 10.0), 0, "ten times what the noise explains");
        assert_eq!(found(10, 0.3, 1.0), 0, "less than the residual elsewhere");
        assert_eq!(found(500, 1.5, 1.0), 0, "two rows, less than a hundredth of all squares");
        assert_eq!(found(1, 3.0, 1.0), 0, "all rows");
    }
}
