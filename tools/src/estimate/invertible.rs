//! The fit of law `masing` held where the torque rises with the deflection, so that feed-forward has an inverse over the whole rated range.
//!
//! The slope of the rated cycle, f′(θ) − e(1 − 2u²)/g − 2h with u = θ/A, is linear in (c1, c2, c3, e, h): a least-squares problem under linear inequalities, solved
//! exactly as a least distance (Lawson, Hanson, *Solving Least Squares Problems*, 1974, chapter 23).

use super::bounded::{Bound, back_substitute, factor_of_rows, forward_substitute, solve};
use super::noise::Noise;
use super::polish::Polished;
use super::problem::{Problem, Sweep};
use super::triangle::Triangle;

/// Places of the rated cycle, in steps of its phase, at which the slope is looked at.
const PLACES: u32 = 1000;
/// The worst place joins the bounded ones at most so often.
const ROUNDS: usize = 30;
/// Least slope at a bounded place, over that of the spring.
const LEAST: f64 = 1e-3;
/// The recordings contradict an inverse where it costs more than this many squared standard deviations.
const SIGNIFICANT: f64 = 9.0;

/// Moves the linear parameters of law `masing` to the best ones with an inverse, where they have none and the recordings do not contradict one. Returns whether it did.
pub fn hold(
    problem: &Problem<'_>,
    polished: &mut Polished,
    noise: Option<&[Noise]>,
    rated_deflection_rad: f64,
) -> bool {
    let gear = &polished.linear.gear;
    let slopes = slopes(rated_deflection_rad);
    let worst =
        |x: &[f64]| slopes.iter().min_by(|a, b| dot(*a, x).total_cmp(&dot(*b, x))).filter(|s| dot(*s, x) <= 0.0);
    let Some(first) = worst(gear) else { return false };
    let system = problem.factor(&polished.nonlinear, None, Sweep { noise, ..Sweep::PLAIN }).combine(|_, _| true);
    let least = LEAST * gear[0].abs();
    let mut inequalities = vec![([0.0, 0.0, 0.0, 1.0, 0.0], 0.0), ([0.0, 0.0, 0.0, 0.0, 1.0], 0.0), (*first, least)];
    let held = loop {
        let Some(found) = nearest(&system.shared, &inequalities) else { return false };
        match worst(&found) {
            None => break found,
            Some(_) if inequalities.len() > ROUNDS => return false,
            Some(place) => inequalities.push((*place, least)),
        }
    };
    let rss = |x: &[f64]| {
        let x: Vec<f64> = x.iter().copied().chain([-1.0]).collect();
        system.shared.squared_norm_of_product(&x)
    };
    let free = rss(gear);
    let variance = free / system.rows.saturating_sub(gear.len() + system.nuisances).max(1) as f64;
    if rss(&held) - free > SIGNIFICANT * variance {
        return false;
    }
    polished.linear = system.linear(&held);
    polished.rss = rss(&held);
    true
}

/// What makes the slope of the rated cycle of (c1, c2, c3, e, h), place after place.
fn slopes(a: f64) -> Vec<[f64; 5]> {
    let slope = |k: u32| {
        let (u, g) = (std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(PLACES)).sin_cos();
        let squared = (a * u).powi(2);
        [1.0, 3.0 * squared, 5.0 * squared * squared, -(1.0 - 2.0 * u * u) / g, -2.0]
    };
    (0..PLACES).map(slope).collect()
}

/// The minimum of ‖R·x − d‖ where each row times x is at least its number; `None` where R is singular or nothing meets them.
fn nearest(factor: &Triangle, inequalities: &[([f64; 5], f64)]) -> Option<Vec<f64>> {
    let count = factor.columns() - 1;
    if (0..count).any(|j| factor.get(j, j).abs() <= 1e-11 * factor.norm(j)) {
        return None;
    }
    let right: Vec<f64> = (0..count).map(|i| factor.get(i, count)).collect();
    // z = R·x − d: the shortest z with (g·R⁻¹)·z ≥ l − g·R⁻¹·d.
    let columns: Vec<Vec<f64>> = inequalities
        .iter()
        .map(|(row, least)| {
            let mut column = forward_substitute(factor, count, row);
            let norm = dot(&column, &column).sqrt();
            column.push(least - dot(&column, &right));
            column.iter_mut().for_each(|x| *x /= norm);
            column
        })
        .collect();
    let target = |i: usize| if i == count { 1.0 } else { 0.0 };
    let rows: Vec<Vec<f64>> =
        (0..=count).map(|i| columns.iter().map(|column| column[i]).chain([target(i)]).collect()).collect();
    let multipliers = solve(&factor_of_rows(&rows), &vec![Bound::NonNegative; columns.len()]).coefficients;
    let residual: Vec<f64> = rows.iter().map(|row| dot(row, &multipliers) - row[columns.len()]).collect();
    if residual[count] >= 0.0 {
        return None;
    }
    let moved: Vec<f64> = (0..count).map(|i| right[i] - residual[i] / residual[count]).collect();
    let found = back_substitute(factor, count, &moved);
    found.iter().all(|x| x.is_finite()).then_some(found)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_distance_is_that_of_scipy() {
        let rows = [
            [2.0, 0.3, 0.1, 0.0, 0.2, 1.0],
            [0.1, 1.5, 0.4, 0.2, 0.0, -1.0],
            [0.0, 0.2, 1.2, 0.3, 0.1, 0.5],
            [0.3, 0.0, 0.1, 1.7, 0.4, -0.8],
            [0.2, 0.1, 0.0, 0.3, 1.1, 0.9],
            [0.5, -0.4, 0.6, 0.1, -0.2, 0.3],
        ];
        let factor = factor_of_rows(&rows.map(Vec::from));
        let inequalities =
            [([1.0, 1.0, 0.0, 0.0, -2.0], 0.1), ([0.0, 0.0, 0.0, 1.0, 0.0], 0.0), ([0.0, 0.0, 0.0, 0.0, 1.0], 0.0)];
        let found = nearest(&factor, &inequalities).unwrap();
        for (found, scipy) in found.iter().zip(SCIPY) {
            assert!((found - scipy).abs() < 1e-7, "{found} {scipy}");
        }
    }

    /// scipy.optimize.minimize, method SLSQP, SciPy 1.16.3. All three are active.
    const SCIPY: [f64; 5] = [0.574_009_616_4, -0.474_009_616_4, 0.187_596_251_0, 0.0, 0.0];

    #[test]
    fn what_nothing_meets_is_none() {
        let factor = factor_of_rows(&[vec![1.0, 0.0, 0.5], vec![0.0, 1.0, 0.5]]);
        let against = [([1.0, 0.0, 0.0, 0.0, 0.0], 1.0), ([-1.0, 0.0, 0.0, 0.0, 0.0], 1.0)];
        assert_eq!(nearest(&factor, &against), None);
    }
}
