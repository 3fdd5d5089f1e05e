//! What else a drive could compute: the paper's closed form, and an inverse by operators.

use gmhm::closed_form::ClosedForm;
use gmhm::scalar::Scalar;
use gmhm::{Gate, Kernel, Law, Params};

use crate::baselines::ClampTo;
use crate::platform::gears::{self, RATED_RAD};
use crate::{report, say};

/// Elements of the play-operator inverse.
const ELEMENTS: usize = 10;

/// How far the tuned closed form may be from that of `libm`, both in `f32`, N·m.
const TUNED_ERROR_NM: f32 = 1e-5;

/// Measures every one.
#[inline(never)]
pub fn measure() {
    let Ok(params) = gears::published(Law::Masing, Kernel::Deflection, Gate::Cycle, 0.0) else {
        return say!("0 1 parameters refused");
    };
    let path: [f32; 500] = core::array::from_fn(|k| RATED_RAD * 0.99 * (k as f32 / 250.0 - 1.0));
    let closed = ClosedForm::<f32>::new(&params);
    report("closed form of the paper, `libm`", &path, |theta| closed_form(&closed, theta));
    let tuned = TunedClosedForm::new(&params);
    let apart = path.iter().map(|&theta| Scalar::abs(tuned.torque(theta) - closed_form(&closed, theta)));
    if apart.fold(0.0, f32::max) > TUNED_ERROR_NM {
        say!("0 1 the tuned closed form is not the closed form");
    }
    report("closed form of the paper, tuned sine, exponential and arcsine", &path, |theta| tuned.torque(theta));
    let mut inverse = PlayInverse::new();
    report("Prandtl–Ishlinskii inverse, 10 elements", &path, |torque| inverse.step(torque));
}

#[inline(never)]
fn closed_form(form: &ClosedForm<f32>, theta: f32) -> f32 {
    form.torque_on_branch(theta, 2)
}

/// The closed form on a rising branch with polynomials in place of `libm`: no double precision.
struct TunedClosedForm {
    inverse_rated: f32,
    inverse_omega: f32,
    elastic: [f32; 3],
    cosine: f32,
    sine: f32,
    beta: f32,
    omega: f32,
    branch_start_s: f32,
}

impl TunedClosedForm {
    fn new(params: &Params) -> Self {
        let (a, memory, elastic) = (params.rated_deflection_rad(), params.memory(), params.elastic());
        let polynomial = elastic.normalised(a, 1.0);
        Self {
            inverse_rated: (1.0 / a) as f32,
            inverse_omega: (1.0 / memory.omega_per_s) as f32,
            elastic: [polynomial.k1 as f32, polynomial.k3 as f32, polynomial.k5 as f32],
            cosine: (a * memory.h()) as f32,
            sine: (-a * memory.e()) as f32,
            beta: memory.beta_per_s as f32,
            omega: memory.omega_per_s as f32,
            branch_start_s: (core::f64::consts::TAU / memory.omega_per_s) as f32,
        }
    }

    #[inline(never)]
    fn torque(&self, theta: f32) -> f32 {
        let u = theta * self.inverse_rated;
        let t = self.branch_start_s + arcsine(u) * self.inverse_omega;
        let (sine, cosine) = sine_cosine(self.omega * t);
        let memory = self.cosine * cosine + self.sine * sine - self.cosine * exponential(-self.beta * t);
        let [k1, k3, k5] = self.elastic;
        let square = u * u;
        u * (k1 + square * (k3 + square * k5)) + Scalar::abs(cosine) * memory
    }
}

/// sin x and cos x for abs(x) < 100: reduction by π/2 in two parts, Taylor polynomials on ±π/4.
#[inline]
fn sine_cosine(x: f32) -> (f32, f32) {
    let nearest = x * core::f32::consts::FRAC_2_PI + if x < 0.0 { -0.5 } else { 0.5 };
    let quarter = nearest as i32;
    let turns = quarter as f32;
    let r = (x - turns * 1.570_312_5) - turns * 4.838_268e-4;
    let s = r * r;
    let sine = r + r * s * (-1.666_666_6e-1 + s * (8.333_331e-3 + s * -1.984_09e-4));
    let cosine = 1.0 + s * (-0.5 + s * (4.166_664e-2 + s * (-1.388_853e-3 + s * 2.443_315e-5)));
    match quarter & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// e^x for −80 < x ≤ 0: 2^n times a polynomial on ±ln 2/2.
#[inline]
fn exponential(x: f32) -> f32 {
    let x = if x < -80.0 { -80.0 } else { x };
    let n = (x * core::f32::consts::LOG2_E - 0.5) as i32;
    let r = x - n as f32 * core::f32::consts::LN_2;
    let polynomial = 1.0 + r * (1.0 + r * (0.5 + r * (0.166_666_66 + r * (4.166_666e-2 + r * 8.333_333e-3))));
    polynomial * f32::from_bits(((n + 127) << 23) as u32)
}

/// arcsin x for abs(x) ≤ 1: a polynomial up to 1/2, beyond it π/2 − 2·arcsin √((1 − x)/2).
#[inline]
fn arcsine(x: f32) -> f32 {
    let size = Scalar::abs(x);
    let small = size <= 0.5;
    let s = if small { x * x } else { 0.5 * (1.0 - size) };
    let root = if small { size } else { Scalar::sqrt(s) };
    let arc = root
        + root * s * (1.666_675_2e-1 + s * (7.495_3e-2 + s * (4.547_003e-2 + s * (2.418_131e-2 + s * 4.216_32e-2))));
    let angle = if small { arc } else { core::f32::consts::FRAC_PI_2 - (arc + arc) };
    if x < 0.0 { -angle } else { angle }
}

/// The inverse of a Prandtl–Ishlinskii operator is again one: θ = Σ weight·play.
struct PlayInverse {
    radii: [f32; ELEMENTS],
    weights: [f32; ELEMENTS],
    plays: [f32; ELEMENTS],
}

impl PlayInverse {
    fn new() -> Self {
        let radii = core::array::from_fn(|k| RATED_RAD * k as f32 / ELEMENTS as f32);
        Self { radii, weights: [0.1; ELEMENTS], plays: [0.0; ELEMENTS] }
    }

    #[inline(never)]
    fn step(&mut self, torque: f32) -> f32 {
        let mut deflection = 0.0;
        for ((play, radius), weight) in self.plays.iter_mut().zip(&self.radii).zip(&self.weights) {
            *play = torque + (*play - torque).clamp_to(*radius);
            deflection += weight * *play;
        }
        deflection
    }
}
