//! A seeded particle swarm for few unknowns.
//!
//! The inertia swarm (Shi, Eberhart 1998; attractions 1.49618 as Clerc and Kennedy, IEEE Trans. Evol. Comput. 6, 2002; inertia 0.65 instead of
//! 0.7298, which converges sooner and is well inside their stable region) with the informants of the standard swarm of 2011 (each particle informs itself
//! and three others, drawn anew when an iteration brings nothing; Zambrano-Bigiarini, Clerc, Rojas, CEC 2013), but its random weights act along the axes of the swarm's own scatter: differences are taken
//! to the coordinates in which the personal bests have unit covariance, weighted there, and taken back. A swarm that weighs coordinate by coordinate fails on
//! ill-conditioned valleys that lie across the axes (Hansen, Ros, Mauny, Schoenauer, Auger, *Impacts of invariance in search*, Applied Soft
//! Computing 11, 2011), and the elastic coefficients of a gear span such a valley.
//!
//! Refused points count as +∞ and never become a best. Positions stay in the box; a particle that meets a wall turns back at half its speed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How a swarm is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwarmOptions {
    /// Number of particles.
    pub particles: usize,
    /// Evaluations allowed, the first positions included.
    pub evaluations: usize,
    /// Seed of every random choice.
    pub seed: u64,
    /// Stop when worst and best personal best differ by less than this share of the best; 0 uses up the evaluations.
    pub tolerance: f64,
}

impl SwarmOptions {
    /// For so many unknowns whose best is polished afterwards.
    pub const fn for_unknowns(unknowns: usize, seed: u64, tolerance: f64) -> Self {
        let particles = 8 + 4 * unknowns;
        Self { particles, evaluations: (1 + 2 * unknowns * unknowns) * particles, seed, tolerance }
    }
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The linear problem has no unknown left to search.
    Exact,
    /// Further steps change nothing that matters.
    Converged,
    /// The evaluations were used up.
    Evaluations,
    /// The caller asked for it.
    Cancelled,
}

/// The best position found.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Its coordinates.
    pub position: Vec<f64>,
    /// The objective there; +∞ when every position was refused.
    pub value: f64,
    /// Evaluations used.
    pub evaluations: usize,
    /// Why the search ended.
    pub stop: Stop,
}

const INERTIA: f64 = 0.65;
const ATTRACTION: f64 = 1.49618;
const INFORMED: usize = 3;

struct Particle {
    position: Vec<f64>,
    velocity: Vec<f64>,
    best: Vec<f64>,
    best_value: f64,
}

/// Minimises `objective` in the box of `bounds` (low, high). The objective answers NaN or +∞ for what it refuses.
pub fn minimise(bounds: &[(f64, f64)], options: &SwarmOptions, mut objective: impl FnMut(&[f64]) -> f64) -> Best {
    let unknowns = bounds.len();
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let scaled =
        |x: &[f64]| -> Vec<f64> { x.iter().zip(bounds).map(|(x, (low, high))| low + x * (high - low)).collect() };
    let mut evaluate = |x: &[f64]| {
        let value = objective(&scaled(x));
        if value.is_nan() { f64::INFINITY } else { value }
    };
    let count = options.particles.min(options.evaluations).max(1);
    let mut swarm: Vec<Particle> = latin_hypercube(count, unknowns, &mut random)
        .into_iter()
        .map(|position| {
            let best_value = evaluate(&position);
            let velocity = position.iter().map(|x| 0.5 * (random.random::<f64>() - x)).collect();
            Particle { best: position.clone(), position, velocity, best_value }
        })
        .collect();
    let mut used = count;
    let mut informants = draw_informants(count, &mut random);
    let stop = loop {
        let values = swarm.iter().map(|p| p.best_value);
        let (lowest, highest) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if highest - lowest <= options.tolerance * lowest.abs() && lowest.is_finite() && options.tolerance > 0.0 {
            break Stop::Converged;
        }
        if used + count > options.evaluations {
            break Stop::Evaluations;
        }
        let axes = scatter_axes(&swarm, unknowns);
        let mut improved = false;
        for i in 0..count {
            let leader =
                informants[i].iter().copied().min_by(|&a, &b| swarm[a].best_value.total_cmp(&swarm[b].best_value));
            let social = swarm[leader.unwrap_or(i)].best.clone();
            let particle = &mut swarm[i];
            let own = weigh(&axes, &difference(&particle.best, &particle.position), &mut random);
            let shared = weigh(&axes, &difference(&social, &particle.position), &mut random);
            for k in 0..unknowns {
                particle.velocity[k] = INERTIA * particle.velocity[k] + own[k] + shared[k];
                particle.position[k] += particle.velocity[k];
                if !(0.0..=1.0).contains(&particle.position[k]) {
                    particle.position[k] = particle.position[k].clamp(0.0, 1.0);
                    particle.velocity[k] *= -0.5;
                }
            }
            let value = evaluate(&particle.position);
            if value < particle.best_value {
                improved |= value < lowest;
                particle.best_value = value;
                particle.best.clone_from(&particle.position);
            }
        }
        used += count;
        if !improved {
            informants = draw_informants(count, &mut random);
        }
    };
    let best = swarm.iter().min_by(|a, b| a.best_value.total_cmp(&b.best_value));
    match best {
        Some(best) => Best { position: scaled(&best.best), value: best.best_value, evaluations: used, stop },
        None => Best { position: Vec::new(), value: f64::INFINITY, evaluations: used, stop },
    }
}

/// Positions that fall into each of `count` slices of each axis once.
fn latin_hypercube(count: usize, unknowns: usize, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; unknowns]; count];
    for k in 0..unknowns {
        let mut slices: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            slices.swap(i, random.random_range(0..=i));
        }
        for (point, slice) in points.iter_mut().zip(slices) {
            point[k] = (slice as f64 + random.random::<f64>()) / count as f64;
        }
    }
    points
}

/// For each particle those that inform it, itself included.
fn draw_informants(count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<usize>> {
    let mut informants: Vec<Vec<usize>> = (0..count).map(|i| vec![i]).collect();
    for i in 0..count {
        for _ in 0..INFORMED {
            informants[random.random_range(0..count)].push(i);
        }
    }
    informants
}

/// The lower Cholesky factor of the covariance of the personal bests.
fn scatter_axes(swarm: &[Particle], unknowns: usize) -> Vec<Vec<f64>> {
    let good: Vec<&Particle> = swarm.iter().filter(|p| p.best_value.is_finite()).collect();
    let count = good.len().max(1) as f64;
    let mean: Vec<f64> = (0..unknowns).map(|k| good.iter().map(|p| p.best[k]).sum::<f64>() / count).collect();
    let mut covariance = vec![vec![0.0; unknowns]; unknowns];
    for particle in &good {
        let off = difference(&particle.best, &mean);
        for i in 0..unknowns {
            for j in 0..=i {
                covariance[i][j] += off[i] * off[j] / count;
            }
        }
    }
    let mut axes = vec![vec![0.0; unknowns]; unknowns];
    for j in 0..unknowns {
        let done: f64 = (0..j).map(|k| axes[j][k] * axes[j][k]).sum();
        // An axis along which the swarm has collapsed keeps a sliver of its width.
        let pivot = (covariance[j][j] - done).max(1e-14 * covariance[j][j]).max(1e-60).sqrt();
        axes[j][j] = pivot;
        for i in j + 1..unknowns {
            let done: f64 = (0..j).map(|k| axes[i][k] * axes[j][k]).sum();
            axes[i][j] = (covariance[i][j] - done) / pivot;
        }
    }
    axes
}

/// The difference, each of its coordinates along the axes weighted by its own random number.
fn weigh(axes: &[Vec<f64>], difference: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
    let n = difference.len();
    let mut along = vec![0.0; n];
    for i in 0..n {
        let known: f64 = (0..i).map(|k| axes[i][k] * along[k]).sum();
        along[i] = (difference[i] - known) / axes[i][i];
    }
    for value in &mut along {
        *value *= ATTRACTION * random.random::<f64>();
    }
    (0..n).map(|i| (0..=i).map(|k| axes[i][k] * along[k]).sum()).collect()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_a_valley_across_the_axes() {
        // Condition number 1e6 in four unknowns, rotated so that no axis is along the valley.
        let valley = |x: &[f64]| {
            let t = [
                x[0] + x[1] + x[2] + x[3],
                x[0] - x[1] + x[2] - x[3],
                x[0] + x[1] - x[2] - x[3],
                x[0] - x[1] - x[2] + x[3],
            ];
            t.iter().zip([1.0, 1e2, 1e4, 1e6]).map(|(t, w)| w * (t - 0.3).powi(2)).sum::<f64>()
        };
        for seed in 0..10 {
            let options = SwarmOptions { particles: 24, evaluations: 12_000, seed, tolerance: 0.0 };
            let best = minimise(&[(-5.0, 5.0); 4], &options, valley);
            assert!(best.value < 1e-6, "seed {seed}: {}", best.value);
        }
    }

    #[test]
    fn refused_points_never_win_and_seeds_repeat() {
        let options = SwarmOptions { particles: 10, evaluations: 400, seed: 3, tolerance: 0.0 };
        let objective = |x: &[f64]| if x[0] < 0.5 { f64::NAN } else { (x[0] - 0.6).powi(2) };
        let best = minimise(&[(0.0, 1.0)], &options, objective);
        assert!(best.value < 1e-8 && best.position[0] >= 0.5);
        assert_eq!(best, minimise(&[(0.0, 1.0)], &options, objective));
        let none = minimise(&[(0.0, 1.0)], &options, |_| f64::INFINITY);
        assert!(none.value.is_infinite() && none.position.len() == 1);
    }
}
