//! The fit held where the torque rises with the deflection, so that feed-forward has an inverse.
//!
//! The least slope of the torque at a deflection, whatever the past, is linear in the linear parameters (c1, c2, c3 with e and h, or with α at a given ρ or β): a
//! least-squares problem under linear inequalities, solved exactly as a least distance (Lawson, Hanson, *Solving Least Squares Problems*, 1974, chapter 23), and
//! searched along ρ or β. The slopes are the core's own, [`least_rising_slope`].
//!
//! Laws `masing` and `time` without gate are held up to the rated deflection. In `phase`, and in `time` with the gate, the torque can fall near the tips whatever the
//! parameters (see [`invertible_range`]), so that no bound reaches there: they are held up to [half of it](HALF), below which no fit is recommended for a drive. In
//! `time` the bound holds at the sample period of the recordings.

use gmhm::gear::LONGEST_PERIOD_S;
use gmhm::inverse::{invertible_range, least_rising_slope};
use gmhm::{Gate, Law, Memory, Params};

use crate::fit::thresholds::THRESHOLDS;
use crate::numerics::autoregression::Noise;
use crate::numerics::bounded::{Bound, back_substitute, factor_of_rows, forward_substitute, solve};
use crate::numerics::qr::Triangle;
use crate::numerics::vector::dot;
use crate::regression::assembly::Assembly;
use crate::regression::deflection_zeros::DEFLECTION_ZERO;
use crate::regression::polish::Polished;
use crate::regression::problem::{Linear, Problem, Sweep};
use crate::regression::rows::Rows;

/// Places on each side of zero, in steps of the phase, at which the slope is looked at.
const PLACES: u32 = 1000;
/// The worst place joins the bounded ones at most so often.
const ROUNDS: usize = 30;
/// Least slope at a bounded place, over that of the spring.
const LEAST: f64 = 1e-3;
/// Of a nonlinear parameter's range, the first step from the free optimum to the one with an inverse; it is doubled at most so often, and the section made so often.
const FIRST_STEP: f64 = 1e-3;
const DOUBLINGS: usize = 10;
const SECTIONS: usize = 12;
/// How far the laws that have no inverse at the tips are held, over the rated deflection.
pub const HALF: f64 = 0.5;

/// The deflection up to which the parameters of a law can be held where there is an inverse, over the rated one.
pub fn reach(memory: &Memory) -> f64 {
    match (memory.law, memory.gate) {
        (Law::Masing, _) | (Law::Time, Gate::None) => 1.0,
        _ => HALF,
    }
}

/// Moves the parameters to the best ones with an inverse, where they have none and the recordings do not contradict one. Returns whether it did.
pub fn hold(assembly: &Assembly, rows: &[Rows<'_>], polished: &mut Polished, noise: Option<&[Noise]>) -> bool {
    let problem = assembly.problem(rows);
    let mut bounded = Bounded { assembly, problem: &problem, noise, period_s: period_s(rows), reach: 1.0 };
    let gear = &polished.linear.gear;
    let Some(params) = bounded.params(&polished.nonlinear, gear) else { return false };
    bounded.reach = reach(&params.memory());
    if invertible_range(&params, bounded.period_s).is_ok_and(|range| range >= bounded.reach) {
        return false;
    }
    let start = &polished.nonlinear;
    let Some(Held { mut nonlinear, mut linear, mut rss, rows }) = bounded.at(start) else { return false };
    if let Some(of_memory) = problem.nonlinear().iter().rposition(|n| n.smooth && n.name != DEFLECTION_ZERO) {
        let info = problem.nonlinear()[of_memory];
        let mut visit = |value: f64| {
            let mut moved = nonlinear.clone();
            moved[of_memory] = value.clamp(info.low, info.high);
            let Some(held) = bounded.at(&moved) else { return f64::INFINITY };
            if held.rss < rss {
                (nonlinear, linear, rss) = (held.nonlinear, held.linear, held.rss);
            }
            held.rss
        };
        minimum(start[of_memory], FIRST_STEP * (info.high - info.low), &mut visit);
    }
    let variance = polished.rss / rows.saturating_sub(gear.len() + start.len()).max(1) as f64;
    if rss - polished.rss > THRESHOLDS.inverse_cost_variances * variance {
        return false;
    }
    *polished = Polished { nonlinear, linear, rss, ..polished.clone() };
    true
}

/// The minimum of a function of one variable from `start`: steps that double while they go down, then the golden section.
fn minimum(start: f64, step: f64, of: &mut impl FnMut(f64) -> f64) {
    let here = of(start);
    let Some(mut step) = [step, -step].into_iter().find(|step| of(start + step) < here) else { return };
    let (mut behind, mut middle, mut value) = (start, start + step, of(start + step));
    for _ in 0..DOUBLINGS {
        let next = of(middle + 2.0 * step);
        if next >= value {
            break;
        }
        (behind, middle, value, step) = (middle, middle + 2.0 * step, next, 2.0 * step);
    }
    let (mut low, mut high) = (behind, middle + 2.0 * step);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut of_left, mut of_right) = (of(left), of(right));
    for _ in 0..SECTIONS {
        if of_left < of_right {
            (high, right, of_right) = (right, left, of_left);
            left = high - golden * (high - low);
            of_left = of(left);
        } else {
            (low, left, of_left) = (left, right, of_right);
            right = low + golden * (high - low);
            of_right = of(right);
        }
    }
}

/// The longest of the recordings' mean sample periods, s.
fn period_s(rows: &[Rows<'_>]) -> f64 {
    let mean = |r: &Rows<'_>| (r.recording.time_s[r.len() - 1] - r.recording.time_s[0]) / (r.len() - 1) as f64;
    rows.iter().map(mean).fold(0.0, f64::max).min(LONGEST_PERIOD_S)
}

/// The fit under the condition that there is an inverse.
struct Bounded<'s> {
    assembly: &'s Assembly,
    problem: &'s Problem<'s>,
    noise: Option<&'s [Noise]>,
    period_s: f64,
    reach: f64,
}

/// The best parameters with an inverse at given nonlinear ones.
struct Held {
    nonlinear: Vec<f64>,
    linear: Linear,
    rss: f64,
    rows: usize,
}

impl Bounded<'_> {
    fn params(&self, nonlinear: &[f64], gear: &[f64]) -> Option<Params> {
        let linear = Linear { gear: gear.to_vec(), recordings: Vec::new() };
        let (elastic, memory) = self.assembly.coefficients(nonlinear, &linear, 1.0);
        Params::candidate(self.assembly.rated_deflection_rad, elastic, memory).ok()
    }

    fn at(&self, nonlinear: &[f64]) -> Option<Held> {
        let sweep = Sweep { noise: self.noise, ..Sweep::PLAIN };
        let system = self.problem.factor(nonlinear, None, sweep).combine(|_, _| true);
        let bounds = self.problem.bounds();
        let places = self.places(nonlinear, bounds.len())?;
        let worst = |x: &[f64]| {
            places.iter().min_by(|a, b| dot(a, x).total_cmp(&dot(b, x))).filter(|s| dot(s, x) <= 0.0).cloned()
        };
        let mut found = solve(&system.shared, &bounds).coefficients;
        let least = LEAST * found[0].abs();
        let signs = (0..bounds.len()).filter(|&j| bounds[j] == Bound::NonNegative);
        let mut inequalities: Vec<(Vec<f64>, f64)> = signs.map(|j| (unit(bounds.len(), j, 1.0), 0.0)).collect();
        while let Some(place) = worst(&found) {
            if inequalities.len() > ROUNDS {
                return None;
            }
            inequalities.push((place, least));
            found = nearest(&system.shared, &inequalities)?;
        }
        // An inequality is met but for rounding.
        for (x, _) in found.iter_mut().zip(&bounds).filter(|(_, bound)| **bound == Bound::NonNegative) {
            *x = x.max(0.0);
        }
        let against: Vec<f64> = found.iter().copied().chain([-1.0]).collect();
        let rss = system.shared.squared_norm_of_product(&against);
        Some(Held { nonlinear: nonlinear.to_vec(), linear: system.linear(&found), rss, rows: system.rows })
    }

    /// What makes the slope of a rising path of the linear parameters, place after place.
    fn places(&self, nonlinear: &[f64], count: usize) -> Option<Vec<Vec<f64>>> {
        let a = self.assembly.rated_deflection_rad;
        let sizes: Vec<f64> =
            (0..count).map(|j| [1.0, a.powi(-2), a.powi(-4)].get(j).copied().unwrap_or(1.0)).collect();
        let spring = self.params(nonlinear, &unit(count, 0, 1.0))?;
        let beside = |j: usize| {
            let mut gear = unit(count, j, sizes[j]);
            gear[0] += 1.0;
            self.params(nonlinear, &gear)
        };
        let units: Vec<Params> = (0..count).map(beside).collect::<Option<_>>()?;
        let at = |phase: f64| {
            let slope = |params: &Params| least_rising_slope(params, self.period_s, a * phase.sin());
            let of_spring = slope(&spring);
            units.iter().zip(&sizes).map(|(params, size)| (slope(params) - of_spring) / size).collect()
        };
        let steps = (0..PLACES).map(|k| std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(PLACES));
        let edge = (self.reach < 1.0).then(|| self.reach.asin());
        let within = steps.take_while(|phase| phase.sin() < self.reach).chain(edge);
        Some(within.flat_map(|phase| [at(phase), at(-phase)]).collect())
    }
}

fn unit(count: usize, j: usize, size: f64) -> Vec<f64> {
    (0..count).map(|i| if i == j { size } else { 0.0 }).collect()
}

/// The minimum of ‖R·x − d‖ where each row times x is at least its number; `None` where R is singular or nothing meets them.
fn nearest(factor: &Triangle, inequalities: &[(Vec<f64>, f64)]) -> Option<Vec<f64>> {
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
        let inequalities = [(vec![1.0, 1.0, 0.0, 0.0, -2.0], 0.1), (unit(5, 3, 1.0), 0.0), (unit(5, 4, 1.0), 0.0)];
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
        let against = [(vec![1.0, 0.0], 1.0), (vec![-1.0, 0.0], 1.0)];
        assert_eq!(nearest(&factor, &against), None);
    }
}
