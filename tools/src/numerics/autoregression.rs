//! What the noise of a recording is: coloured, with outliers, quantised.
//!
//! The residual is taken for an autoregressive process, r_t = Σ φ_i r_{t−i} + ε_t, its reflection coefficients by Burg's method (stable by
//! construction), its order by twice the penalty of the Bayesian information criterion, so that white noise is left alone. Filtering
//! recording and columns by 1 − Σ φ_i L^i makes least squares efficient and its covariance honest (Prais and Winsten; Box and Jenkins,
//! *Time Series Analysis*, chapter 7). The first rows of a run use the predictors of lower order from the Levinson recursion, which is the exact
//! likelihood. Outliers are isolated rows that Hampel's identifier finds in the residual (Hampel 1974; Pearson 2002); they do not count.

use std::ops::Range;

use crate::numerics::extremes::largest;
use crate::numerics::mark::Mark;
use crate::numerics::robust;
use crate::numerics::vector::{dot, lattice};

/// An autoregressive noise model of one recording.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Noise {
    /// φ_1 … φ_p; empty for white noise.
    pub coefficients: Vec<f64>,
    /// Standard deviation of ε, N·m.
    pub innovation_sd: f64,
    /// Root mean square of the residual, N·m.
    pub rms: f64,
    /// Rows left out as outliers.
    pub outliers: usize,
    /// Step of the torque column where it is quantised, N·m.
    pub torque_step_nm: Option<f64>,
    /// Step of the deflection column where it is quantised, rad.
    pub deflection_step_rad: Option<f64>,
    /// k_1 … k_p, the reflection coefficients of φ.
    #[serde(skip)]
    pub(crate) reflections: Vec<f64>,
    /// Predictors of orders 0 … p−1 with the factor that brings their error to the sd of ε.
    #[serde(skip)]
    pub(crate) starts: Vec<(Vec<f64>, f64)>,
    /// What the filtered rows are multiplied by: recordings with more noise count less.
    #[serde(skip)]
    pub(crate) weight: f64,
}

impl Noise {
    /// White noise of unit weight.
    pub fn white() -> Self {
        Self {
            coefficients: Vec::new(),
            innovation_sd: 0.0,
            rms: 0.0,
            outliers: 0,
            torque_step_nm: None,
            deflection_step_rad: None,
            reflections: Vec::new(),
            starts: Vec::new(),
            weight: 1.0,
        }
    }

    /// White noise of standard deviation 1.
    pub fn unit() -> Self {
        Self { innovation_sd: 1.0, rms: 1.0, ..Self::white() }
    }

    /// The same noise, rows filtered by it to be in units of the sd of ε.
    #[must_use]
    pub fn in_units_of_itself(self) -> Self {
        Self { weight: if self.innovation_sd > 0.0 { self.innovation_sd.recip() } else { 1.0 }, ..self }
    }

    /// Neither coloured nor of another size than elsewhere.
    pub fn is_white(&self) -> bool {
        self.order() == 0 && self.weight == 1.0
    }

    /// p.
    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// The noise model of a residual. `used_columns` is what the fit took from it in degrees of freedom.
    pub fn of_residual(residual: &[f64], marks: &[Mark], used_columns: usize) -> Self {
        let clean = bridge_outliers(residual, marks);
        let runs: Vec<_> = runs(marks).into_iter().flat_map(|run| without_long_gaps(run, marks)).collect();
        let counted: Vec<f64> = runs.iter().flat_map(|r| &clean[r.clone()]).copied().collect();
        let count = counted.len().max(1) as f64;
        let variance = counted.iter().map(|r| r * r).sum::<f64>() / count;
        let mut noise = Self { rms: variance.sqrt(), innovation_sd: variance.sqrt(), ..Self::white() };
        let highest = (counted.len() / 12).saturating_sub(used_columns / 2).min(HIGHEST_ORDER);
        if variance > 0.0 && highest > 0 {
            noise.choose_order(&clean, &runs, variance, highest);
        }
        let freedom = (count / (count - used_columns as f64).max(1.0)).sqrt();
        noise.innovation_sd *= freedom;
        noise.rms *= freedom;
        noise
    }

    fn choose_order(&mut self, residual: &[f64], runs: &[Range<usize>], variance: f64, highest: usize) {
        let steps = burg(residual, runs, variance, highest);
        let count: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let penalty = 2.0 * (count as f64).ln();
        let score = |order: usize| {
            let variance = if order == 0 { variance } else { steps[order - 1].1 };
            count as f64 * variance.ln() + penalty * order as f64
        };
        let order = (0..=steps.len()).min_by(|&a, &b| score(a).total_cmp(&score(b))).unwrap_or(0);
        if order == 0 {
            return;
        }
        self.innovation_sd = steps[order - 1].1.sqrt();
        self.set_reflections(steps[..order].iter().map(|(k, _)| *k).collect());
    }

    /// Takes the reflection coefficients for those of the noise: predictors by the Levinson recursion.
    fn set_reflections(&mut self, reflections: Vec<f64>) {
        let mut predictor: Vec<f64> = Vec::new();
        let mut left: f64 = reflections.iter().map(|k| 1.0 - k * k).product();
        self.starts.clear();
        for k in &reflections {
            self.starts.push((predictor.clone(), left.sqrt()));
            left /= 1.0 - k * k;
            let reversed: Vec<f64> = predictor.iter().rev().map(|a| k * a).collect();
            predictor.iter_mut().zip(reversed).for_each(|(a, r)| *a -= r);
            predictor.push(*k);
        }
        self.coefficients = predictor;
        self.reflections = reflections;
    }

    /// The same noise with the Fisher transform atanh k_1 moved by `step`: the gain at low frequencies, ∏ 1/(1 − k_i), goes with it.
    pub(crate) fn with_slowness(&self, step: f64) -> Self {
        let mut moved = self.clone();
        let mut reflections = self.reflections.clone();
        if let Some(first) = reflections.first_mut() {
            *first = (first.atanh() + step).tanh();
        }
        moved.set_reflections(reflections);
        moved
    }

    /// ln det of the covariance of `runs` runs of the noise, in units of the variance of ε.
    pub(crate) fn log_determinant(&self, runs: usize) -> f64 {
        -2.0 * runs as f64 * self.starts.iter().map(|(_, factor)| factor.ln()).sum::<f64>()
    }
}

const HIGHEST_ORDER: usize = 20;

/// Rows that the colour is taken from at most.
const COLOUR_ROWS: usize = 200_000;

/// Contiguous ranges of counted rows (outliers inside are bridged).
pub(crate) fn runs(marks: &[Mark]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for (row, mark) in marks.iter().enumerate() {
        match (mark, start) {
            (Mark::Skipped, Some(first)) => {
                runs.push(first..row);
                start = None;
            }
            (Mark::Skipped, None) => {}
            (Mark::First, Some(first)) => {
                runs.push(first..row);
                start = Some(row);
            }
            (_, None) => start = Some(row),
            (_, Some(_)) => {}
        }
    }
    runs.extend(start.map(|first| first..marks.len()));
    runs
}

/// Outliers in a row that are bridged at most.
const LONGEST_BRIDGE: usize = 8;

/// The parts of a run between stretches of outliers that are too long to be bridged.
fn without_long_gaps(run: Range<usize>, marks: &[Mark]) -> Vec<Range<usize>> {
    let is_outlier = |mark: &Mark| *mark == Mark::Outlier;
    let (mut from, mut to) = (run.start, run.start);
    let mut parts = Vec::new();
    for stretch in marks[run].chunk_by(|a, b| is_outlier(a) == is_outlier(b)) {
        if is_outlier(&stretch[0]) && stretch.len() > LONGEST_BRIDGE {
            parts.push(from..to);
            from = to + stretch.len();
        }
        to += stretch.len();
    }
    parts.push(from..to);
    parts.retain(|part| !part.is_empty());
    parts
}

/// The residual with each outlier replaced by the mean of its good neighbours.
fn bridge_outliers(residual: &[f64], marks: &[Mark]) -> Vec<f64> {
    let mut bridged = residual.to_vec();
    let mut last_good = None;
    for row in 0..bridged.len() {
        if marks[row] != Mark::Outlier {
            last_good = Some(row);
            continue;
        }
        let mut near = row + 1..marks.len().min(row + 1 + LONGEST_BRIDGE);
        let next = near.find(|&r| marks[r] != Mark::Outlier).map(|r| residual[r]);
        let before = last_good.map(|r: usize| residual[r]);
        bridged[row] = match (before, next) {
            (Some(a), Some(b)) => 0.5 * (a + b),
            (Some(a), None) | (None, Some(a)) => a,
            (None, None) => 0.0,
        };
    }
    bridged
}

/// The errors of prediction forward and backward that belong together at an order: a higher one has a row less, the earliest of those predicted and the latest of those that predict.
fn of_order((forward, backward): &mut (Vec<f64>, Vec<f64>), order: usize) -> (&mut [f64], &mut [f64]) {
    let lost = (order - 1).min(forward.len());
    let rows = forward.len() - lost;
    (&mut forward[lost..], &mut backward[..rows])
}

/// Reflection coefficient and error variance of the orders 1 … highest, by Burg's recursion over several runs.
fn burg(residual: &[f64], runs: &[Range<usize>], variance: f64, highest: usize) -> Vec<(f64, f64)> {
    // A colour does not need more rows than this.
    let mut left = COLOUR_ROWS;
    let mut take = |run: &Range<usize>| {
        let count = run.len().min(left);
        left -= count;
        residual[run.start..run.start + count].to_vec()
    };
    // Errors of prediction of each run, later rows from earlier ones and earlier from later; those of one index belong together.
    let mut errors: Vec<(Vec<f64>, Vec<f64>)> = runs
        .iter()
        .map(&mut take)
        .map(|run| (run.get(1..).unwrap_or_default().to_vec(), run[..run.len().saturating_sub(1)].to_vec()))
        .collect();
    let mut error = variance;
    let mut steps = Vec::with_capacity(highest);
    for order in 1..=highest {
        let (mut cross, mut power) = (0.0, 0.0);
        for pair in &mut errors {
            let (f, b) = of_order(pair, order);
            cross += dot(f, b);
            power += dot(f, f) + dot(b, b);
        }
        if power <= 0.0 {
            break;
        }
        let reflection = 2.0 * cross / power;
        for pair in &mut errors {
            let (f, b) = of_order(pair, order);
            lattice(reflection, f, b);
        }
        error *= 1.0 - reflection * reflection;
        if error <= 1e-12 * variance {
            break;
        }
        steps.push((reflection, error));
    }
    steps
}

/// Where more than one row in so many stands out, none is an outlier.
const MOST_OUTLIERS: usize = 10;

/// Marks isolated rows that stand out of their neighbours; returns how many.
///
/// A row is an outlier when it differs from the median of the five rows around it by more than √(2 ln n) + 3 robust standard deviations of such
/// differences, which noise without outliers does about once in a thousand recordings. Where more than a tenth of the rows stand out, it is not
/// outliers but structure or another noise, and none is marked.
pub fn mark_outliers(residual: &[f64], marks: &mut [Mark]) -> usize {
    let n = residual.len();
    if n < 16 {
        return 0;
    }
    let median5 = |t: usize| {
        let from = t.saturating_sub(2).min(n - 5);
        let mut window = [0.0; 5];
        window.copy_from_slice(&residual[from..from + 5]);
        window.sort_by(f64::total_cmp);
        window[2]
    };
    let off: Vec<f64> = (0..n).map(|t| (residual[t] - median5(t)).abs()).collect();
    let counted = |t: &usize| marks[*t] != Mark::Skipped;
    let mut sorted: Vec<f64> = (0..n).filter(counted).map(|t| off[t]).filter(|d| *d > 0.0).collect();
    if sorted.len() < 16 {
        return 0;
    }
    // The middle one of five is its own median, so zeros are left out; for white normal noise the rest has this median in units of sd.
    let scale = robust::median(&mut sorted) / 0.745;
    let limit = ((2.0 * (n as f64).ln()).sqrt() + 3.0) * scale;
    let found: Vec<usize> = (0..n).filter(counted).filter(|&t| off[t] > limit).collect();
    // Three and more in a row are something that happened, not a fault of a sample.
    let stands_out = |row: usize| found.binary_search(&row).is_ok();
    let isolated = |row: usize| {
        let before = (1..=2).take_while(|k| row.checked_sub(*k).is_some_and(stands_out)).count();
        let after = (1..=2).take_while(|k| stands_out(row + k)).count();
        before + after < 2
    };
    let outliers: Vec<usize> = found.iter().copied().filter(|&row| isolated(row)).collect();
    if scale <= 0.0 || found.len() * MOST_OUTLIERS > n {
        return 0;
    }
    for &row in &outliers {
        marks[row] = Mark::Outlier;
    }
    outliers.len()
}

/// The step of a quantised column: the smallest change, if all changes of less than 20 such are whole multiples of it, and these are a quarter of all.
pub fn quantisation_step(values: &[f64]) -> Option<f64> {
    let changes: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).take(4096).collect();
    let size = largest(values);
    let step = changes.iter().copied().filter(|d| *d > 1e-12 * size).fold(f64::INFINITY, f64::min);
    let near = || changes.iter().map(|d| d / step).filter(|multiple| *multiple < 20.0);
    let whole = |multiple: f64| (multiple - multiple.round()).abs() < 0.02 * multiple.clamp(1.0, 10.0);
    let count = near().count();
    (count >= 16 && count * 4 > changes.len() && near().all(whole)).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn coloured(count: usize, phi: &[f64], seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut series: Vec<f64> = Vec::new();
        for t in 0..count + 500 {
            let past: f64 = phi.iter().enumerate().filter(|(i, _)| *i < t).map(|(i, p)| p * series[t - 1 - i]).sum();
            let shock: f64 = StandardNormal.sample(&mut random);
            series.push(past + shock);
        }
        series.split_off(500)
    }

    #[test]
    fn recovers_the_coefficients_and_leaves_white_noise_alone() {
        let marks = vec![Mark::Used; 20_000];
        let noise = Noise::of_residual(&coloured(20_000, &[1.2, -0.5], 1), &marks, 0);
        assert_eq!(noise.order(), 2);
        assert!((noise.coefficients[0] - 1.2).abs() < 0.02 && (noise.coefficients[1] + 0.5).abs() < 0.02);
        assert!((noise.innovation_sd - 1.0).abs() < 0.02);
        let orders = (0..200).map(|seed| Noise::of_residual(&coloured(64, &[], seed), &[Mark::Used; 64], 0).order());
        assert!(orders.filter(|o| *o > 0).count() <= 1);
    }

    #[test]
    fn long_gaps_do_not_colour_the_noise() {
        let series = coloured(4000, &[0.7, -0.5, 0.7], 5);
        let mark = |row: usize| if row % 100 < 20 { Mark::Outlier } else { Mark::Used };
        let marks: Vec<Mark> = (0..series.len()).map(mark).collect();
        let noise = Noise::of_residual(&series, &marks, 0);
        assert_eq!(noise.order(), 3, "{noise:?}");
        assert!((noise.innovation_sd - 1.0).abs() < 0.03, "{noise:?}");
    }

    #[test]
    fn marks_isolated_spikes_only() {
        let mut residual = coloured(2000, &[0.9], 2);
        let mut marks = vec![Mark::Used; 2000];
        assert_eq!(mark_outliers(&residual, &mut marks), 0);
        for row in [100, 800, 1503] {
            residual[row] += 40.0;
        }
        assert_eq!(mark_outliers(&residual, &mut marks), 3);
        assert_eq!(marks[800], Mark::Outlier);
    }

    #[test]
    fn sees_the_step_of_a_quantised_column() {
        let smooth: Vec<f64> = (0..1000).map(|k| (0.01 * k as f64).sin()).collect();
        assert_eq!(quantisation_step(&smooth), None);
        let counts: Vec<f64> = smooth.iter().map(|x| (x / 0.003).round() * 0.003).collect();
        assert!((quantisation_step(&counts).unwrap_or(0.0) - 0.003).abs() < 1e-9);
        let fast: Vec<f64> = (0..400).map(|k| ((0.12 * k as f64).sin() / 0.0035).round() * 0.0035 + 0.001).collect();
        assert!((quantisation_step(&fast).unwrap_or(0.0) - 0.0035).abs() < 1e-9);
    }
}
