//! The method of Levenberg and Marquardt, as everything that is fitted is polished.
//!
//! The parameters are of two sorts: those that the problem eliminates (exactly, by QR: variable projection) and those that steps move. The loop sees
//! only what is left when the first are out: a triangular factor of the derivatives by the second and of the residual. A step keeps the bounds as part of its
//! least-squares problem, is damped in proportion to the norms of the derivatives (Marquardt), and is taken only if the whole problem, evaluated anew, gets better.

use crate::numerics::bounded;
use crate::numerics::particle_swarm::Stop;
use crate::numerics::qr::Triangle;
use crate::progress::Progress;

/// What a step is computed from.
pub struct Linearisation {
    /// The derivatives by what moves, then the residual, what is eliminated taken out of both.
    pub reduced: Triangle,
    /// Norms of the derivatives before anything was taken out.
    pub norms: Vec<f64>,
    /// How far each parameter may move down (not above 0) and up.
    pub room: Vec<(f64, f64)>,
    /// The squares that are left here.
    pub cost: f64,
}

/// A nonlinear least-squares problem.
pub trait Descend {
    /// Where it stands, with whatever was computed on the way.
    type Point;
    /// Why it cannot go on.
    type Error;

    /// What the next step is computed from. The cost may be measured in another way than before, against a noise known better.
    fn linearise(&mut self, at: &mut Self::Point) -> Result<Linearisation, Self::Error>;

    /// The point a step away and its cost; `None` where the problem refuses it.
    fn moved(&mut self, at: &Self::Point, step: &[f64]) -> Option<(Self::Point, f64)>;

    /// Whether a step that gained so much, and left `cost`, was the last.
    fn is_converged(&self, gain: f64, cost: f64) -> bool;
}

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    /// Steps at most.
    pub most_steps: usize,
    /// Damping tried, in squared norms of the derivatives. A step begins with what the last one needed, or one below where that served at once.
    pub damping: &'static [f64],
}

impl Schedule {
    /// Until nothing is gained any more.
    pub const TO_THE_END: Self =
        Self { most_steps: 30, damping: &[1e-10, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e3] };

    /// Some long steps: what only creeps is not worth its evaluations where many models are compared.
    pub const fn strides(most_steps: usize) -> Self {
        Self { most_steps, damping: &[1e-10, 1e-6, 1e-4, 1e-2, 0.3] }
    }
}

/// A step that promises less than this share of the cost changes nothing but rounding.
const ROUNDING: f64 = 1e-14;

/// Goes down from a point.
///
/// # Errors
/// As [`Descend::linearise`].
pub fn descend<D: Descend>(
    problem: &mut D,
    mut at: D::Point,
    schedule: Schedule,
    progress: &dyn Progress,
) -> Result<(D::Point, Stop), D::Error> {
    let mut damping_index = 0;
    for _ in 0..schedule.most_steps {
        if progress.cancelled() {
            return Ok((at, Stop::Cancelled));
        }
        let Linearisation { reduced, norms, room, cost } = problem.linearise(&mut at)?;
        let left = reduced.norm(norms.len()).powi(2);
        let first = damping_index;
        let (next, after) = loop {
            let Some(&damping) = schedule.damping.get(damping_index) else { return Ok((at, Stop::Converged)) };
            let step = bounded::damped_step(&reduced, &norms, damping, &room);
            let against: Vec<f64> = step.iter().copied().chain([-1.0]).collect();
            if left - reduced.squared_norm_of_product(&against) <= ROUNDING * cost {
                return Ok((at, Stop::Converged));
            }
            match problem.moved(&at, &step) {
                Some((next, after)) if after < cost => break (next, after),
                _ => damping_index += 1,
            }
        };
        damping_index = if damping_index == first { damping_index.saturating_sub(1) } else { damping_index };
        at = next;
        if problem.is_converged(cost - after, after) {
            return Ok((at, Stop::Converged));
        }
    }
    Ok((at, Stop::Evaluations))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::bounded::factor_of_rows;

    /// Rosenbrock's valley: residuals 10 (y − x²) and 1 − x.
    struct Valley {
        highest: f64,
        evaluations: usize,
    }

    fn cost(x: f64, y: f64) -> f64 {
        (10.0 * (y - x * x)).powi(2) + (1.0 - x).powi(2)
    }

    impl Descend for Valley {
        type Point = [f64; 2];
        type Error = ();

        fn linearise(&mut self, &mut [x, y]: &mut [f64; 2]) -> Result<Linearisation, ()> {
            let rows = [vec![-20.0 * x, 10.0, -10.0 * (y - x * x)], vec![-1.0, 0.0, -(1.0 - x)]];
            let reduced = factor_of_rows(&rows);
            let norms = vec![reduced.norm(0), reduced.norm(1)];
            let room = vec![(f64::NEG_INFINITY, self.highest - x), (f64::NEG_INFINITY, f64::INFINITY)];
            Ok(Linearisation { reduced, norms, room, cost: cost(x, y) })
        }

        fn moved(&mut self, at: &[f64; 2], step: &[f64]) -> Option<([f64; 2], f64)> {
            self.evaluations += 1;
            let (x, y) = (at[0] + step[0], at[1] + step[1]);
            assert!(x <= self.highest + 1e-12);
            Some(([x, y], cost(x, y)))
        }

        fn is_converged(&self, gain: f64, cost: f64) -> bool {
            gain <= 1e-12 * cost
        }
    }

    #[test]
    fn the_valley_is_walked_to_its_end_or_to_the_bound() {
        for (highest, expected) in [(10.0, 1.0), (0.5, 0.5)] {
            let mut valley = Valley { highest, evaluations: 0 };
            let ([x, y], stop) = descend(&mut valley, [-1.2, 1.0], Schedule::TO_THE_END, &()).unwrap();
            assert!((x - expected).abs() < 1e-6 && (y - expected * expected).abs() < 1e-6, "{x} {y}");
            assert!(stop == Stop::Converged && valley.evaluations < 40, "{}", valley.evaluations);
        }
    }
}
