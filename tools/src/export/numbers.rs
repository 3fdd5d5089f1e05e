//! The coefficients of law and inverse, as the core rounds them.

use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::scalar::Float;
use gmhm::{Gate, Inverse, Kernel, Law};

use super::plan::{Plan, Precision};

/// A number of the structure of parameters.
#[derive(Debug, Clone)]
pub(super) struct Number {
    pub(super) name: &'static str,
    /// As C writes it.
    pub(super) value: String,
    pub(super) is_count: bool,
    pub(super) words: &'static str,
}

/// A number as C writes it.
pub(super) fn literal(value: f64, precision: Precision) -> String {
    match precision {
        Precision::F32 => format!("{:?}f", value as f32),
        Precision::F64 => format!("{value:?}"),
    }
}

/// All numbers of a gear: base, law, inverse, setting.
pub(super) fn numbers(plan: &Plan) -> Vec<Number> {
    match plan.precision {
        Precision::F32 => of::<f32>(plan),
        Precision::F64 => of::<f64>(plan),
    }
}

fn of<S: Float>(plan: &Plan) -> Vec<Number> {
    let number =
        |name, value: S, words| Number { name, value: literal(value.to_f64(), plan.precision), is_count: false, words };
    let choice =
        |name, chosen: bool, words| Number { name, value: format!("{}u", u8::from(chosen)), is_count: true, words };
    let params = &plan.params;
    let law = AnyLaw::<S>::new(params, plan.period_s);
    let gear = gmhm::Gear::<S>::with_law(params, law);
    let (frame, elastic) = (gear.frame(), gear.elastic());
    let polynomial = elastic.polynomial();
    let mut all = vec![
        number("rated", frame.rated(), "A, rad"),
        number("inverse_rated", frame.inverse_rated(), "1 / A, 1/rad"),
        number("scale_nm", frame.torque_scale(), "T_A, N*m"),
        number("limit", frame.limit(), "deflections beyond it are refused, rad"),
        number("k1", polynomial.k1, "c1 * A / T_A"),
        number("k3", polynomial.k3, "c2 * A^3 / T_A"),
        number("k5", polynomial.k5, "c3 * A^5 / T_A"),
        number("knee", elastic.knee(), "kappa: beyond kappa * A the spring follows its tangent"),
        number("knee_torque", elastic.knee_torque(), "f there over T_A"),
        number("knee_stiffness", elastic.knee_stiffness(), "slope of the tangent, over A and T_A"),
    ];
    let memory = params.memory();
    let gated = choice("gated", memory.gate == Gate::Cycle, "gate: 1 cycle, z = g * m; 0 none, z = m");
    match plan.law {
        Law::Masing => {
            let Masing { e, h, half_play } = Masing::<S>::new(params);
            all.extend([
                number("e", e, "e * A / T_A, e = alpha * beta / (beta^2 + omega^2)"),
                number("h", h, "h * A / T_A, h = alpha * omega / (beta^2 + omega^2)"),
                number("half_play", half_play, "half the width of the input play, rad"),
            ]);
        }
        Law::Phase => {
            let Phase { quadrature, in_phase, rho, .. } = Phase::<S>::new(params);
            all.extend([
                number("quadrature", quadrature, "q over T_A: what d * g is multiplied by in the steady state"),
                number("in_phase", in_phase, "s over T_A: what u is multiplied by there"),
                number("rho", rho, "beta / omega"),
                gated,
            ]);
        }
        Law::Time => {
            let law = Time::<S>::new(params, plan.period_s);
            all.extend([
                number("gain", law.gain(), "alpha * A / T_A"),
                number("beta_per_s", law.beta_per_s(), "beta, 1/s"),
                choice("of_rate", memory.kernel == Kernel::Rate, "kernel: 1 rate, 0 deflection"),
                gated,
            ]);
        }
    }
    if let Ok(inverse) = Inverse::<S>::of(params, law, plan.period_s) {
        let search = inverse.search_numbers();
        let ([slope_3, slope_5], [bend_3, bend_5]) = (search.slope, search.bend);
        all.extend([
            number("inverse_torque_scale", search.inverse_torque_scale, "1 / T_A, 1/(N*m)"),
            number("largest_torque", search.largest_torque, "torques beyond it are refused, N*m"),
            number("tolerance", search.tolerance, "a residual that counts as none, over T_A"),
            number("last_step", search.last_step, "a step of t that ends the search"),
            number("last_chord", search.last_chord, "(step^2 + |chord|) * |chord| that ends it"),
            number("last_width", search.last_width, "a bracket of t that ends it"),
            number("least_slope", search.least_slope, "least slope of the torque, over A and T_A"),
            number("reach", search.reach, "edge of the invertible range, over A"),
            number("inner_reach", search.inner_reach, "short of it by its rounding"),
            number("inner_half_tangent", search.inner_half_tangent, "the same as t = tan(phi / 2)"),
            number("three_k3", slope_3, "of f'"),
            number("five_k5", slope_5, "of f'"),
            number("six_k3", bend_3, "of f''"),
            number("twenty_k5", bend_5, "of f''"),
            number("longest_period", S::from_f64(plan.period_s), "longest sample period of the inverse, s"),
        ]);
    }
    all.extend([
        number(
            "sigma",
            S::from_f64(plan.sigma),
            "1: the torque is taken on the motor side; -1: by a sensor on the output side",
        ),
        number("c1", S::from_f64(params.elastic().c1_nm_per_rad), "c1, N*m/rad"),
    ]);
    all
}
