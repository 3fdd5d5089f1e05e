//! Blocks of the recordings, each predicted by a fit to the others: what is only luck or a few rows does not predict. A block spans all recordings, and its rows are
//! whitened one by one; [`heldout`](crate::regression::heldout) leaves out blocks of single recordings, from triangular factors, and does not filter their errors.

use std::borrow::Cow;

use crate::numerics::autoregression::Noise;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout::FOLDS;

/// Half the quantile of Student's t beyond which seven degrees of freedom stray as often as a normal deviate strays beyond two: what eight blocks tell of a scatter is
/// not exact itself.
const STUDENT: f64 = 1.216;

/// What is believed predicts blocks better by so many squares of the noise, the best and the worst of them left out.
pub const PREDICTS: f64 = 40.0;

/// A block that gains or loses less does not speak.
const SHOWS: f64 = 10.0;

/// The gain of all blocks but the one that gains most and the one that loses most: what shows once is luck, what fails once may be a start or a stop.
pub fn trimmed_sum(gains: &[f64]) -> f64 {
    let (most, least) = gains.iter().fold((0.0_f64, 0.0_f64), |(most, least), g| (most.max(*g), least.min(*g)));
    gains.iter().sum::<f64>() - most - least
}

/// Whether the gains of blocks are those of something that was there in most of those in which it shows at all.
pub fn improves_heldout(gains: &[f64]) -> bool {
    improves_heldout_by(PREDICTS, gains)
}

/// [`improves_heldout`] by so many squares of the noise, the best and the worst block left out.
pub fn improves_heldout_by(least: f64, gains: &[f64]) -> bool {
    let shows = |sign: f64| gains.iter().filter(|g| sign * **g > SHOWS).count();
    shows(1.0) > shows(-1.0) && shows(1.0) > 1 && trimmed_sum(gains) > least
}

impl Dataset<'_> {
    /// What is left of each block, row by row, each predicted by a fit to the others, and how the numbers moved in each; the fit is linearised where it ended.
    /// What is a recording's own, its offset and its past, is no part of the prediction and stays that of all rows.
    fn left_of_blocks(&self, of_gear: &[&[f64]], residual: &[f64], noise: &[Noise]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let layout = self.layout();
        let free: Vec<Vec<f64>> = of_gear.iter().map(|c| self.without_offsets(noise, c)).collect();
        let moves = layout.without_blocks(of_gear, residual, noise);
        let mut left = residual.to_vec();
        for (block, moved) in moves.iter().enumerate() {
            for row in layout.rows_of_block(block).into_iter().flatten() {
                left[row] -= free.iter().zip(moved).map(|(c, m)| c[row] * m).sum::<f64>();
            }
        }
        (left, moves)
    }

    /// Root mean square of blocks, each predicted by a fit to the others.
    pub fn rms_of_blocks(&self, fit: &Fitted) -> f64 {
        let (left, _) = self.left_of_blocks(&fit.parameter_columns(), &fit.residual, &self.weights(fit));
        (self.layout().squares(&left) / self.counted().max(1) as f64).sqrt()
    }

    /// Mean square of [`rms_of_blocks`](Self::rms_of_blocks).
    pub fn mean_square_of_blocks(&self, fit: &Fitted) -> f64 {
        self.rms_of_blocks(fit).powi(2)
    }

    /// By how much a fit predicts each block better than another does, in squares of a noise.
    pub fn gain_of_blocks(&self, with: &Fitted, without: &Fitted, noise: &[Noise]) -> Vec<f64> {
        let squares = |fit: &Fitted| self.squares_of_blocks(&fit.parameter_columns(), &fit.residual, noise);
        squares(without).iter().zip(squares(with)).map(|(a, b)| a - b).collect()
    }

    /// By how much further columns predict each block better than a fit with the columns `beside` it, in squares of a noise.
    pub fn gain_of_columns(
        &self,
        fit: &Fitted,
        beside: &[Vec<f64>],
        columns: &[Vec<f64>],
        noise: &[Noise],
    ) -> Vec<f64> {
        let mut all = fit.parameter_columns();
        all.extend(beside.iter().map(Vec::as_slice));
        let without = self.squares_of_blocks(&all, &fit.residual, noise);
        all.extend(columns.iter().map(Vec::as_slice));
        let with = self.squares_of_blocks(&all, &fit.residual, noise);
        without.iter().zip(with).map(|(a, b)| a - b).collect()
    }

    fn squares_of_blocks(&self, of_gear: &[&[f64]], residual: &[f64], noise: &[Noise]) -> Vec<f64> {
        let white = self.layout().whiten(noise, &self.left_of_blocks(of_gear, residual, noise).0);
        let squares = |block: usize| {
            self.layout().rows_of_block(block).into_iter().map(|rows| dot(&white[rows.clone()], &white[rows])).sum()
        };
        (0..FOLDS).map(squares).collect()
    }

    /// The noise that a fit was weighted by.
    fn weights<'f>(&self, fit: &'f Fitted) -> Cow<'f, [Noise]> {
        if fit.plain { Cow::Owned(self.layout().white()) } else { Cow::Borrowed(&fit.noise) }
    }

    /// Standard deviation of each free number given all others free; `None` where the recordings do not tell it from others. The larger of what the noise says
    /// and of the scatter over blocks (jackknife), which knows nothing of the noise; against coloured noise plain least squares are no better than the fit that weighs by it.
    pub fn standard_deviations(&self, fit: &Fitted) -> Vec<Option<f64>> {
        let (_, moves) = self.left_of_blocks(&fit.parameter_columns(), &fit.residual, &self.weights(fit));
        let scatter = |i: usize| {
            let mean = moves.iter().map(|m| m[i]).sum::<f64>() / FOLDS as f64;
            let squares: f64 = moves.iter().map(|m| (m[i] - mean).powi(2)).sum();
            STUDENT * (squares * (FOLDS - 1) as f64 / FOLDS as f64).sqrt()
        };
        let of_noise =
            self.layout().standard_deviations(&fit.parameter_columns(), &fit.residual).into_iter().enumerate();
        of_noise.map(|(i, sd)| sd.map(|sd| scatter(i).max(sd))).collect()
    }
}
