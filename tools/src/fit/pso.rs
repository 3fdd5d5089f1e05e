//! The paper's identification: a particle swarm over \[c1, c2, c3, α, β, ω\] that minimises the sum of squared errors.
//!
//! One evaluation is the sum of squares over all counted rows at one position of the six parameters, the constant torque offset of
//! each recording at its optimum. In law `masing` the torque is linear in (c1, c2, c3, e, h), so that sum is ‖R·(c1, c2, c3, e, h, −1)‖² with the triangular
//! factor R of the recordings, equal to the sum over the rows up to rounding: an evaluation costs the same for 64 and for a million rows. In the other
//! laws each evaluation is a pass over the recordings. Nothing else is eliminated and nothing is polished: that is the default method.
//!
//! Bounds, from the largest deflection A and torque T_m of the recordings alone: c1 in 0 … 10 T_m/A, c2 within ±10 T_m/A³, c3 within ±10 T_m/A⁵,
//! α in 0 … 1000 T_m/A, β and ω in 0 … 1000 1/s.

use gmhm::Law;

use crate::numerics::particle_swarm::{SwarmOptions, minimise};
use crate::progress::Progress;
use crate::regression::assembly::Assembly;
use crate::regression::error::EstimateError;
use crate::regression::polish::Polished;
use crate::regression::problem::{Linear, Sweep};
use crate::regression::rows::Rows;

/// Evaluations by default.
pub const EVALUATIONS: usize = 20_000;

const PARTICLES: usize = 24;

/// What the swarm found.
pub struct Found {
    /// In the shape of the default method's result, its nonlinear and linear parameters.
    pub polished: Polished,
    /// ω, which is the gauge.
    pub omega_per_s: f64,
}

/// The box of the search: (low, high) of c1, c2, c3, α, β, ω.
pub fn bounds(rated_deflection_rad: f64, torque_nm: f64) -> [(f64, f64); 6] {
    let a = rated_deflection_rad;
    let cubic = 10.0 * torque_nm / a.powi(3);
    let quintic = 10.0 * torque_nm / a.powi(5);
    let stiffness = torque_nm / a;
    [
        (0.0, 10.0 * stiffness),
        (-cubic, cubic),
        (-quintic, quintic),
        (0.0, 1000.0 * stiffness),
        (0.0, 1000.0),
        (0.0, 1000.0),
    ]
}

/// Runs the swarm on a base model.
pub fn search(
    assembly: &Assembly,
    rows: &[Rows<'_>],
    torque_nm: f64,
    evaluations: usize,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Found, EstimateError> {
    let problem = assembly.problem(rows);
    let law = assembly.structure.law;
    let quick = (law == Law::Masing).then(|| problem.factor(&[], None, Sweep::PLAIN).combine(|_, _| true));
    let mut done = 0;
    let objective = |x: &[f64]| {
        done += 1;
        if done % 256 == 0 {
            progress.report("particle swarm", done as f64 / evaluations as f64);
        }
        if progress.cancelled() {
            return f64::INFINITY;
        }
        let (coordinates, gear) = to_internal(law, x);
        match &quick {
            Some(system) => with_torque(&system.shared, &gear),
            None => with_torque(&problem.factor(&coordinates, None, Sweep::PLAIN).combine(|_, _| true).shared, &gear),
        }
    };
    let options = SwarmOptions { particles: PARTICLES, evaluations, seed, tolerance: 0.0 };
    let best = minimise(&bounds(assembly.rated_deflection_rad, torque_nm), &options, objective);
    if progress.cancelled() {
        return Err(EstimateError::Cancelled);
    }
    let (nonlinear, gear) = to_internal(law, &best.position);
    let system = problem.factor(&nonlinear, None, Sweep::PLAIN).combine(|_, _| true);
    let linear: Linear = system.linear(&gear);
    let at_bound = vec![false; gear.len()];
    let polished =
        Polished { nonlinear, linear, at_bound, rss: best.value, evaluations: best.evaluations, stop: best.stop };
    Ok(Found { polished, omega_per_s: best.position[5] })
}

fn with_torque(shared: &crate::numerics::qr::Triangle, gear: &[f64]) -> f64 {
    let x: Vec<f64> = gear.iter().copied().chain([-1.0]).collect();
    shared.squared_norm_of_product(&x)
}

/// The nonlinear coordinate and the linear parameters of a position.
fn to_internal(law: Law, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (alpha, beta, omega) = (x[3], x[4], x[5]);
    let speed = (beta * beta + omega * omega).sqrt().max(f64::MIN_POSITIVE);
    let mut gear = x[..3].to_vec();
    match law {
        Law::Masing => {
            gear.extend([alpha * beta / (speed * speed), alpha * omega / (speed * speed)]);
            (Vec::new(), gear)
        }
        Law::Phase => {
            gear.push(alpha / speed);
            (vec![beta.atan2(omega).min(1e3_f64.atan())], gear)
        }
        Law::Time => {
            gear.push(alpha);
            (vec![beta.max(1e-9).ln()], gear)
        }
    }
}
