//! From the chosen structure to the final fit: start of the memory, outliers, colour of the noise, zero of the deflection.

use crate::fit::start::Start;
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::zeros::MOST_TOGETHER;
use crate::numerics::autoregression;
use crate::numerics::autoregression::Noise;
use crate::numerics::bounded;
use crate::numerics::mark::Mark;
use crate::progress::Progress;
use crate::regression::assembly::Assembly;
use crate::regression::base::Structure;
use crate::regression::error::EstimateError;
use crate::regression::factors::Shared;
use crate::regression::heldout::heldout;
use crate::regression::polish::{Polished, polish, project};
use crate::regression::problem::{Problem, Sweep, Tangent};
use crate::regression::rows::Rows;

/// The final fit.
pub struct Refined {
    /// The parts, the zero of the deflection among them where the data show one.
    pub assembly: Assembly,
    /// Against which noise, and how well.
    pub weighted: Weighted,
}

/// A fit, the noise beside it, and whether the one was weighted against the other.
pub struct Weighted {
    /// Where the fit ended.
    pub polished: Polished,
    /// Noise of each recording.
    pub noise: Vec<Noise>,
    /// Whether the rows were filtered white.
    pub prewhitened: bool,
    /// Root mean square on blocks held out, N·m.
    pub heldout_rms: f64,
}

/// Fits and noise estimates in turn, at most so often.
const ROUNDS: usize = 4;

/// In laws `phase` and `time` all rows count, and the memory at the start is a nuisance where it is significant.
pub fn free_start(
    rows: &mut [Rows<'_>],
    start: &mut Start,
    structure: Structure,
    rated_deflection_rad: f64,
    nonlinear: &[f64],
) -> Result<(), EstimateError> {
    for (rows, unsettled) in rows.iter_mut().zip(&mut start.unsettled) {
        rows.marks[..*unsettled].fill(Mark::Used);
        *unsettled = 0;
    }
    start.known.fill(false);
    let size = crate::regression::rows::torque_size(rows);
    let rss = |known: &[bool]| -> Result<f64, EstimateError> {
        let assembly = Assembly::new(structure, rated_deflection_rad, rows, known)?;
        let problem = assembly.problem(rows);
        Ok(polish(&problem, nonlinear, Sweep::PLAIN, &()).rss)
    };
    let count: usize = rows.iter().map(Rows::len).sum();
    let floor = count as f64 * (1e-10 * size).powi(2);
    let is_significant =
        |with: f64, free: f64| with - free > THRESHOLDS.zero_significance.powi(2) * free / count as f64 + floor;
    if rows.len() > MOST_TOGETHER {
        return known_starts(rows, start, structure, rated_deflection_rad, nonlinear, &is_significant);
    }
    let free = rss(&start.known)?;
    for index in 0..rows.len() {
        start.known[index] = true;
        if is_significant(rss(&start.known)?, free) {
            start.known[index] = false;
        }
    }
    Ok(())
}

/// The same for many recordings, the nonlinear parameters as they are: costs no more a recording than with few.
fn known_starts(
    rows: &[Rows<'_>],
    start: &mut Start,
    structure: Structure,
    rated_deflection_rad: f64,
    nonlinear: &[f64],
    is_significant: &dyn Fn(f64, f64) -> bool,
) -> Result<(), EstimateError> {
    let parts = |known: bool| -> Result<Vec<Shared>, EstimateError> {
        let assembly = Assembly::new(structure, rated_deflection_rad, rows, &vec![known; rows.len()])?;
        let problem = assembly.problem(rows);
        Ok((0..rows.len()).map(|index| problem.shared_of(index, nonlinear, Sweep::PLAIN)).collect())
    };
    let (free, known) = (parts(false)?, parts(true)?);
    let bounds = Assembly::new(structure, rated_deflection_rad, rows, &start.known)?.problem(rows).bounds();
    let rss = |all: &Shared| bounded::solve(&all.factor().0, &bounds).rss;
    Shared::each_beside_others(&free, |index, others| {
        start.known[index] = !is_significant(rss(&others.with(&known[index])), rss(&others.with(&free[index])));
        if start.known[index] { known[index].clone() } else { free[index].clone() }
    });
    Ok(())
}

/// Alternates fit and noise, then looks for a zero of the deflection.
pub fn refine(
    assembly: Assembly,
    rows: &mut [Rows<'_>],
    known_start: &[bool],
    start: Vec<f64>,
    free_zeros: usize,
    progress: &dyn Progress,
) -> Result<Refined, EstimateError> {
    progress.report("fitting", 0.0);
    let plain = polish(&assembly.problem(rows), &start, Sweep::PLAIN, progress);
    let residuals = assembly.problem(rows).residuals(&plain.nonlinear, &plain.linear);
    let mut outliers = 0;
    for (rows, residual) in rows.iter_mut().zip(&residuals) {
        outliers += autoregression::mark_outliers(residual, &mut rows.marks);
    }
    drop(residuals);
    let plain =
        if outliers > 0 { polish(&assembly.problem(rows), &plain.nonlinear, Sweep::PLAIN, progress) } else { plain };
    let heldout_rms = heldout(&assembly.problem(rows), &plain.nonlinear, None).rms;
    let mut found = Found { assembly, polished: plain, heldout_rms };
    // One zero that all recordings share; then one of each.
    for count in [1, rows.len()].into_iter().skip(usize::from(rows.len() == 1)) {
        let sure = count == free_zeros;
        if count > MOST_TOGETHER && !sure {
            continue;
        }
        if let Some(better) = found.with_zeros(count, sure, rows, known_start, progress)? {
            found = better;
        }
    }
    let Found { assembly, polished, heldout_rms } = found;
    let weighted = against_noise(&assembly.problem(rows), polished, heldout_rms, progress)?;
    Ok(Refined { assembly, weighted })
}

/// Fits and noise estimates in turn, until neither moves.
///
/// Prewhitening is best where the residual is noise. Where physics was left out, it gives up the slow and large part of the torque for the fast one, and
/// predicts worse: then the plain fit, whose error held out is handed in, is kept.
pub fn against_noise(
    problem: &Problem<'_>,
    plain: Polished,
    plain_heldout_rms: f64,
    progress: &dyn Progress,
) -> Result<Weighted, EstimateError> {
    let mut noise = noise_of(problem, &plain);
    let mut polished = plain.clone();
    for round in 0..ROUNDS {
        progress.report("fitting", 0.3 + 0.7 * round as f64 / ROUNDS as f64);
        if progress.cancelled() {
            return Err(EstimateError::Cancelled);
        }
        if noise.iter().all(Noise::is_white) {
            break;
        }
        let sweep = Sweep { noise: Some(&noise), ..Sweep::PLAIN };
        let used = polished.evaluations;
        polished = polish(problem, &polished.nonlinear, sweep, progress);
        polished.evaluations += used;
        let again = noise_of(problem, &polished);
        let settled = noise.iter().zip(&again).all(|(a, b)| {
            a.order() == b.order() && (a.innovation_sd - b.innovation_sd).abs() <= 1e-3 * b.innovation_sd
        });
        noise = again;
        if settled {
            break;
        }
    }
    if noise.iter().any(|n| n.order() > 0) {
        restore_slowness(problem, &polished.nonlinear, &mut noise);
        let sweep = Sweep { noise: Some(&noise), ..Sweep::PLAIN };
        let used = polished.evaluations;
        polished = polish(problem, &polished.nonlinear, sweep, progress);
        polished.evaluations += used;
    }
    if noise.iter().all(Noise::is_white) {
        return Ok(Weighted { polished, noise, prewhitened: true, heldout_rms: plain_heldout_rms });
    }
    let heldout_rms = heldout(problem, &polished.nonlinear, Some(&noise)).rms;
    if heldout_rms > THRESHOLDS.physics_as_noise_ratio * plain_heldout_rms {
        let noise = noise_of(problem, &plain);
        let polished = Polished { evaluations: polished.evaluations, ..plain };
        return Ok(Weighted { polished, noise, prewhitened: false, heldout_rms: plain_heldout_rms });
    }
    Ok(Weighted { polished, noise, prewhitened: true, heldout_rms })
}

/// Independent samples' worth of rows beyond which the fit takes nothing that matters out of the noise.
const PLENTY: f64 = 3000.0;

/// The columns take up the slow part of the noise, so its residual looks faster than it is and standard deviations come out small. The first reflection
/// coefficient is therefore moved to the optimum of the restricted likelihood, which allows for the columns (Patterson, Thompson 1971; Harville 1977):
/// −2 ln L = (n − k) ln RSS + ln det Ω + ln det XᵀΩ⁻¹X.
fn restore_slowness(problem: &Problem<'_>, nonlinear: &[f64], noise: &mut [Noise]) {
    let rows = problem.rows;
    let bounds = problem.bounds();
    let part = |index: usize, noise: &[Noise]| {
        problem.shared_of(index, nonlinear, Sweep { noise: Some(noise), ..Sweep::PLAIN })
    };
    let parts: Vec<Shared> = (0..noise.len()).map(|index| part(index, noise)).collect();
    Shared::each_beside_others(&parts, |index, others| {
        let criterion = |noise: &[Noise]| {
            let all = others.with(&part(index, noise));
            let solution = bounded::solve(&all.factor().0, &bounds);
            let free = bounds.len() - solution.at_bound.iter().filter(|b| **b).count();
            let freedom = all.rows.saturating_sub(free + all.nuisances) as f64;
            let covariance = noise[index].log_determinant(autoregression::runs(&rows[index].marks).len());
            freedom * solution.rss.ln() + covariance + all.log_determinant(&solution.at_bound)
        };
        slow_down(index, rows[index].len(), noise, &criterion);
        part(index, noise)
    });
}

/// Moves the first reflection coefficient of a recording's noise to the least of a criterion.
fn slow_down(index: usize, rows: usize, noise: &mut [Noise], criterion: &dyn Fn(&[Noise]) -> f64) {
    let Some(&first) = noise[index].reflections.first() else { return };
    let count = rows as f64;
    if first <= 0.0 || count * (1.0 - first) / (1.0 + first) > PLENTY {
        return;
    }
    let width = 1.0 / (count * (1.0 - first * first)).sqrt();
    let original = noise[index].clone();
    let at = |steps: f64, noise: &mut [Noise]| {
        noise[index] = original.with_slowness(steps * width);
        criterion(noise)
    };
    // A parabola through three points a standard error apart, whose middle one is moved up while that helps.
    let (mut middle, mut values) = (0.0, [at(-1.0, noise), at(0.0, noise), at(1.0, noise)]);
    while values[2] < values[1] && middle < 4.0 {
        middle += 1.0;
        values = [values[1], values[2], at(middle + 1.0, noise)];
    }
    let curvature = values[0] - 2.0 * values[1] + values[2];
    let offset = if curvature > 0.0 { (0.5 * (values[0] - values[2]) / curvature).clamp(-1.0, 1.0) } else { 0.0 };
    noise[index] = original.with_slowness((middle + offset) * width);
}

/// A fit without a noise model.
struct Found {
    assembly: Assembly,
    polished: Polished,
    heldout_rms: f64,
}

impl Found {
    /// The fit with so many zeros of the deflection, if they are far from those that it has and predict held-out rows better, or are `sure` to be.
    fn with_zeros(
        &self,
        count: usize,
        sure: bool,
        rows: &[Rows<'_>],
        known_start: &[bool],
        progress: &dyn Progress,
    ) -> Result<Option<Self>, EstimateError> {
        let Self { assembly, polished: without, heldout_rms: before } = self;
        let rated = assembly.rated_deflection_rad;
        let (zeros, own) = assembly.split(&without.nonlinear);
        let zero = zeros.first().copied().unwrap_or(0.0);
        let from: Vec<f64> = std::iter::repeat_n(zero, count).chain(own.iter().copied()).collect();
        let assembly = Assembly::new(assembly.structure, rated, rows, known_start)?.with_free_zeros(count);
        let problem = assembly.problem(rows);
        let row_count = rows.iter().map(Rows::len).sum::<usize>() as f64;
        let explained = without.rss <= crate::regression::rows::rounding(rows);
        // One derivative tells what a zero could explain; most recordings end here.
        let promises = || {
            let smooth: Vec<usize> = (0..from.len()).filter(|&k| problem.nonlinear()[k].smooth).collect();
            let tangent = Tangent { parameters: &smooth, linear: &without.linear };
            let system = problem.factor(&from, Some(tangent), Sweep::PLAIN).combine(|_, _| true);
            let reduced = project(&system.shared, &without.at_bound, smooth.len());
            let promised: f64 = (0..smooth.len()).map(|i| reduced.get(i, smooth.len()).powi(2)).sum();
            promised >= THRESHOLDS.zero_significance.powi(2) * without.rss / row_count
        };
        if !sure && (explained || !promises()) {
            return Ok(None);
        }
        let with = polish(&problem, &from, Sweep::PLAIN, progress);
        let significant = || {
            // Slow noise is beside any slow change of the torque.
            let noise = noise_of(&problem, &with);
            let sweep = Sweep { noise: Some(&noise), ..Sweep::PLAIN };
            let left = polish(&problem, &with.nonlinear, sweep, progress).rss;
            let left_without = polish(&self.assembly.problem(rows), &without.nonlinear, sweep, progress).rss;
            left_without - left > 2.0 * THRESHOLDS.zero_significance.powi(2) * left / row_count
        };
        let (found, _) = assembly.split(&with.nonlinear);
        let moved = |found: &f64| (found - zero).abs() > 1e-6 * rated;
        // A zero that would go farther stands for something else.
        let within =
            |(k, found): (usize, &f64)| problem.nonlinear()[k].low < *found && *found < problem.nonlinear()[k].high;
        if !(found.iter().enumerate().all(within) && (sure || found.iter().any(moved) && significant())) {
            return Ok(None);
        }
        let heldout_rms = heldout(&problem, &with.nonlinear, None).rms;
        let better = sure || heldout_rms < THRESHOLDS.zero_heldout_share * before;
        Ok(better.then_some(Self { assembly, polished: with, heldout_rms }))
    }
}

/// The noise of each recording beside a fit. A recording with clearly more or less noise than the others counts accordingly.
pub fn noise_of(problem: &Problem<'_>, fit: &Polished) -> Vec<Noise> {
    let rows = problem.rows;
    let used = (problem.gear_columns().len() + problem.nonlinear().len()).div_ceil(rows.len()) + 1;
    let size = crate::regression::rows::torque_size(rows);
    let residuals = problem.residuals(&fit.nonlinear, &fit.linear);
    let mut noise: Vec<Noise> = rows
        .iter()
        .zip(&residuals)
        .map(|(rows, residual)| {
            let mut noise = Noise::of_residual(residual, &rows.marks, used);
            if noise.rms < 1e-9 * size {
                // Rounding is no noise to be filtered.
                noise = Noise { rms: noise.rms, innovation_sd: noise.rms, ..Noise::white() };
            }
            noise.outliers = rows.marks.iter().filter(|m| **m == Mark::Outlier).count();
            noise.torque_step_nm = autoregression::quantisation_step(&rows.torque);
            let as_recorded = rows.recording.deflection_rad.as_deref().unwrap_or(&rows.deflection_rad);
            noise.deflection_step_rad = autoregression::quantisation_step(as_recorded);
            noise
        })
        .collect();
    let typical = noise.iter().map(|n| n.innovation_sd).sum::<f64>() / noise.len() as f64;
    let ratio = THRESHOLDS.unequal_noise_ratio;
    let unequal = noise.iter().any(|n| n.innovation_sd > ratio * typical || ratio * n.innovation_sd < typical);
    if unequal && typical > 1e-9 * size {
        for noise in &mut noise {
            noise.weight = typical / noise.innovation_sd.max(1e-3 * typical);
        }
    }
    noise
}
