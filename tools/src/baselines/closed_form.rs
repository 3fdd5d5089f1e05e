//! The paper's closed form of the rated cycle beside the elastic torque, once steady: T = f(θ) + z±(θ), a curve for rising and one for falling deflection.
//!
//! It is the gear's own model where the gear swings from tip to tip. On any other path it stands on the curve of that cycle all the same, having no
//! memory of where it turned.

use gmhm::closed_form::ClosedForm;
use gmhm::{Elastic, Memory, Params};

use crate::baselines::{Baseline, Direction, ELASTIC, elastic};
use crate::numerics::bounded::Bound::NonNegative;

/// The first rise and the first fall that begin at a tip.
const BRANCHES: [u16; 2] = [2, 3];

/// ρ = β/ω is searched from a hundredth to a hundred; of α, β and ω the cycle knows no more than that and one scale.
pub fn closed_form(rated_deflection_rad: f64) -> Baseline {
    let baseline = Baseline::new(
        "closed form of the paper",
        &[&ELASTIC[..], &[("alpha", NonNegative)]].concat(),
        move |nonlinear| {
            let memory = Memory { alpha: 1.0, beta_per_s: nonlinear[0].exp(), omega_per_s: 1.0, ..Memory::default() };
            let spring = Elastic { c1_nm_per_rad: 1.0, ..Elastic::default() };
            let form =
                Params::candidate(rated_deflection_rad, spring, memory).map(|params| ClosedForm::<f64>::new(&params));
            let mut direction = Direction::default();
            Box::new(move |theta, out| {
                direction.step(theta);
                let branch = BRANCHES[usize::from(direction.sign < 0.0)];
                elastic(theta, out);
                out[3] = form.as_ref().map_or(f64::NAN, |form| form.hysteresis(form.time(theta, branch)));
            })
        },
    );
    baseline.searching("ln(rho)", 1e-2_f64.ln(), 1e2_f64.ln())
}
