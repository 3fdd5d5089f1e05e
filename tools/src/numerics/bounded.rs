//! Least squares with bounds, solved exactly on a triangular factor.
//!
//! min ‖X·b − y‖ with some b_j ≥ 0 by the active-set method of Lawson and Hanson (*Solving Least Squares Problems*, 1974, chapter 23),
//! with the free coefficients always in the passive set. It ends in the optimum after finitely many steps. Columns that depend on earlier ones get
//! the coefficient 0 and are reported.

use crate::numerics::qr::{Block, Triangle};

/// What a linear coefficient may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bound {
    /// Any number.
    #[default]
    Free,
    /// Zero or more.
    NonNegative,
}

/// The bounded optimum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solution {
    /// One coefficient a column.
    pub coefficients: Vec<f64>,
    /// The residual sum of squares.
    pub rss: f64,
    /// Columns whose coefficient is held at its bound.
    pub at_bound: Vec<bool>,
    /// Columns that are, to rounding, a combination of earlier ones.
    pub dependent: Vec<bool>,
}

/// A column is dependent where less than this share of its norm is left beside the earlier ones.
const DEPENDENT: f64 = 1e-11;

/// The bounded optimum of the factor's columns against its last one.
pub fn solve(factor: &Triangle, bounds: &[Bound]) -> Solution {
    let count = bounds.len();
    debug_assert_eq!(count + 1, factor.columns());
    let all: Vec<usize> = (0..count).collect();
    let unbounded = solve_subset(factor, &all);
    let violated = |x: &[f64]| (0..count).any(|j| bounds[j] == Bound::NonNegative && x[j] < 0.0);
    if !violated(&unbounded.coefficients) {
        return unbounded;
    }
    let mut passive: Vec<bool> = bounds.iter().map(|b| *b == Bound::Free).collect();
    let mut current = solve_passive(factor, &passive);
    // Each pass lowers the sum of squares; the limit only guards against rounding.
    for _ in 0..10 * count + 10 {
        let Some(entering) = most_promising(factor, &current.coefficients, &passive) else { break };
        passive[entering] = true;
        loop {
            let next = solve_passive(factor, &passive);
            let step = (0..count)
                .filter(|&j| passive[j] && bounds[j] == Bound::NonNegative && next.coefficients[j] <= 0.0)
                .map(|j| {
                    let (old, new) = (current.coefficients[j], next.coefficients[j]);
                    if old > new { old / (old - new) } else { 0.0 }
                })
                .fold(f64::INFINITY, f64::min);
            if step.is_infinite() {
                current = next;
                break;
            }
            for j in 0..count {
                let old = current.coefficients[j];
                current.coefficients[j] = old + step * (next.coefficients[j] - old);
                if passive[j] && bounds[j] == Bound::NonNegative && next.coefficients[j] <= 0.0 {
                    // Those that the step brings to zero leave; one that never moved must leave too.
                    if current.coefficients[j] <= f64::EPSILON * old.abs() {
                        passive[j] = false;
                        current.coefficients[j] = 0.0;
                    }
                }
            }
        }
    }
    current
}

/// The column at its bound whose release lowers the sum of squares most, per unit of its norm.
fn most_promising(factor: &Triangle, x: &[f64], passive: &[bool]) -> Option<usize> {
    let n = factor.columns();
    let residual: Vec<f64> =
        (0..n).map(|i| factor.get(i, n - 1) - (i..n - 1).map(|j| factor.get(i, j) * x[j]).sum::<f64>()).collect();
    let size = factor.norm(n - 1);
    (0..n - 1)
        .filter(|&j| !passive[j])
        .map(|j| {
            let gradient: f64 = (0..=j).map(|i| factor.get(i, j) * residual[i]).sum();
            (j, gradient / factor.norm(j).max(f64::MIN_POSITIVE))
        })
        .filter(|&(_, gain)| gain > 1e-13 * size)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(j, _)| j)
}

fn solve_passive(factor: &Triangle, passive: &[bool]) -> Solution {
    let chosen: Vec<usize> = (0..passive.len()).filter(|&j| passive[j]).collect();
    let mut solution = solve_subset(factor, &chosen);
    for (bound, passive) in solution.at_bound.iter_mut().zip(passive) {
        *bound = !passive;
    }
    solution
}

/// Unbounded least squares with the chosen columns only.
pub fn solve_subset(factor: &Triangle, chosen: &[usize]) -> Solution {
    let (n, count) = (factor.columns(), factor.columns() - 1);
    let mut dependent = vec![false; count];
    let mut kept = chosen.to_vec();
    // Dropping a dependent column leaves an equation for the later ones, so the factor is taken again without it.
    let small = loop {
        let columns: Vec<usize> = kept.iter().copied().chain([n - 1]).collect();
        let small = if columns.len() == n { factor.clone() } else { factor.select(&columns) };
        match (0..kept.len()).find(|&j| small.get(j, j).abs() <= DEPENDENT * small.norm(j)) {
            Some(j) => {
                dependent[kept[j]] = true;
                kept.remove(j);
            }
            None => break small,
        }
    };
    let m = kept.len();
    let mut coefficients = vec![0.0; count];
    for (&column, value) in kept.iter().zip(back_substitute(&small, m, &right_hand_side(&small, m))) {
        coefficients[column] = value;
    }
    let rss = small.get(m, m).powi(2);
    Solution { coefficients, rss, at_bound: vec![false; count], dependent }
}

/// A step of least squares on the factor's columns against its last one, damped by `damping` squared `norms` of the columns (Levenberg, Marquardt), that stays in
/// the room of each column: what would leave it is put on its bound, and the others are solved anew.
pub fn damped_step(factor: &Triangle, norms: &[f64], damping: f64, room: &[(f64, f64)]) -> Vec<f64> {
    let count = norms.len();
    let mut step = vec![0.0; count];
    let mut held = vec![false; count];
    loop {
        let free: Vec<usize> = (0..count).filter(|&j| !held[j]).collect();
        let at = |i: usize, j: usize| if j >= i { factor.get(i, j) } else { 0.0 };
        let row = |i: usize| {
            let known: f64 = (0..count).filter(|&j| held[j]).map(|j| at(i, j) * step[j]).sum();
            free.iter().map(|&j| at(i, j)).chain([at(i, count) - known]).collect()
        };
        let mut rows: Vec<Vec<f64>> = (0..=count).map(row).collect();
        for (place, &j) in free.iter().enumerate() {
            let mut row = vec![0.0; free.len() + 1];
            row[place] = damping.sqrt() * norms[j];
            rows.push(row);
        }
        let all: Vec<usize> = (0..free.len()).collect();
        let solved = solve_subset(&factor_of_rows(&rows), &all).coefficients;
        for (&j, value) in free.iter().zip(solved) {
            step[j] = value;
        }
        let forbidden: Vec<usize> = free.into_iter().filter(|&j| step[j] < room[j].0 || step[j] > room[j].1).collect();
        if forbidden.is_empty() {
            return step;
        }
        for j in forbidden {
            held[j] = true;
            step[j] = step[j].clamp(room[j].0, room[j].1);
        }
    }
}

fn right_hand_side(factor: &Triangle, count: usize) -> Vec<f64> {
    (0..count).map(|i| factor.get(i, factor.columns() - 1)).collect()
}

/// x with R·x = rhs for the leading `count` columns.
pub fn back_substitute(factor: &Triangle, count: usize, rhs: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; count];
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|j| factor.get(i, j) * x[j]).sum();
        x[i] = (rhs[i] - known) / factor.get(i, i);
    }
    x
}

/// x with Rᵀ·x = rhs for the leading `count` columns.
pub fn forward_substitute(factor: &Triangle, count: usize, rhs: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; count];
    for i in 0..count {
        let known: f64 = (0..i).map(|j| factor.get(j, i) * x[j]).sum();
        x[i] = (rhs[i] - known) / factor.get(i, i);
    }
    x
}

/// The factor of a small dense matrix given by rows, right-hand side last.
pub fn factor_of_rows(rows: &[Vec<f64>]) -> Triangle {
    let columns = rows.first().map_or(0, Vec::len);
    factor_of_columns(rows.len(), (0..columns).map(|j| rows.iter().map(move |row| row[j])))
}

/// The factor of a dense matrix of so many rows given by columns, right-hand side last.
pub fn factor_of_columns(rows: usize, columns: impl ExactSizeIterator<Item = impl Iterator<Item = f64>>) -> Triangle {
    let mut factor = Triangle::new(columns.len());
    let mut block = Block::new(columns.len(), rows);
    block.set_rows(rows);
    for (j, column) in columns.enumerate() {
        block.column_mut(j).iter_mut().zip(column).for_each(|(to, x)| *to = x);
    }
    factor.absorb(&mut block);
    factor
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_scipy_nnls() {
        let rows = [
            vec![1.0, 2.0, -1.0, 0.5, 2.0],
            vec![0.0, 1.0, 3.0, 1.0, 1.0],
            vec![2.0, 0.0, 1.0, -1.0, -1.0],
            vec![1.0, 1.0, 0.0, 2.0, 2.0],
            vec![-1.0, 1.0, 2.0, 0.0, 0.0],
        ];
        let solution = solve(&factor_of_rows(&rows), &[Bound::NonNegative; 4]);
        // scipy.optimize.nnls(A, b), SciPy 1.17.1.
        for (found, scipy) in solution.coefficients.iter().zip([0.076_923_08, 0.538_461_54, 0.0, 0.769_230_77]) {
            assert!((found - scipy).abs() < 1e-8, "{solution:?}");
        }
        assert!((solution.rss.sqrt() - 0.832_050_294_337_843_9).abs() < 1e-12);
    }

    /// The best of all subsets of the bounded columns that keeps the bounds.
    fn brute_force(rows: &[Vec<f64>], bounds: &[Bound]) -> f64 {
        let factor = factor_of_rows(rows);
        (0..1u32 << bounds.len())
            .map(|set| (0..bounds.len()).filter(|j| set >> j & 1 == 1 || bounds[*j] == Bound::Free).collect::<Vec<_>>())
            .map(|chosen| solve_subset(&factor, &chosen))
            .filter(|s| s.coefficients.iter().zip(bounds).all(|(x, b)| *b == Bound::Free || *x >= 0.0))
            .map(|s| s.rss)
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn bounded_optimum_is_the_best_of_all_active_sets() {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let bounds = [Bound::Free, Bound::NonNegative, Bound::NonNegative, Bound::Free, Bound::NonNegative];
        for _ in 0..200 {
            let rows: Vec<Vec<f64>> =
                (0..9).map(|_| (0..6).map(|_| random.random_range(-1.0..1.0)).collect()).collect();
            let solution = solve(&factor_of_rows(&rows), &bounds);
            let optimum = brute_force(&rows, &bounds);
            assert!((solution.rss - optimum).abs() < 1e-10, "{} {optimum}", solution.rss);
        }
    }

    #[test]
    fn a_dependent_column_is_reported_and_left_out() {
        let rows: Vec<Vec<f64>> = (0..6).map(|i| vec![i as f64, 2.0 * i as f64, 1.0, 3.0 * i as f64 + 1.0]).collect();
        let solution = solve(&factor_of_rows(&rows), &[Bound::Free; 3]);
        assert_eq!(solution.dependent, [false, true, false]);
        assert!((solution.coefficients[0] - 3.0).abs() < 1e-12 && (solution.coefficients[2] - 1.0).abs() < 1e-12);
        assert!(solution.rss < 1e-20);
    }
}
