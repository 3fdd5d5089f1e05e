//! The paper's own formulas: the rated cycle θ = A sin ωt in closed form, transient included, both kernels.
//!
//! ```text
//! kernel deflection:  m(t) = Aα(ω cos ωt − β sin ωt − ωe^(−βt))/(β² + ω²)
//! kernel rate:        m(t) = Aαω(β cos ωt + ω sin ωt − βe^(−βt))/(β² + ω²)
//! z(t) = abs(cos ωt)·m(t)         T = f(θ) + z         t±(θ) from arcsin(θ/A)
//! ```
//!
//! The printed solution of the paper is that of kernel `deflection`, with β and ω negative; its printed integral is kernel `rate`
//! (MODEL.md section 2). Time starts at θ = 0 moving up, with m = 0. This is the yardstick of the recursive laws on the full cycle, and of
//! their cost.

use crate::elastic::Polynomial;
use crate::params::{Kernel, Params};
use crate::scalar::Float;

/// The rated cycle of one gear in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedForm<S> {
    rated_deflection: S,
    elastic: Polynomial<S>,
    torque_scale: S,
    /// Amplitudes of cos ωt, sin ωt and −e^(−βt) in m.
    cosine: S,
    sine: S,
    transient: S,
    beta: S,
    omega: S,
    inverse_omega: S,
}

impl<S: Float> ClosedForm<S> {
    /// The cycle of a gear with the kernel that its parameters name. ω must be above zero, as in laws `masing` and `phase`; the law itself
    /// does not matter.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let memory = params.memory();
        let a = params.rated_deflection_rad();
        let (e, h) = (a * memory.e(), a * memory.h());
        let (cosine, sine) = match memory.kernel {
            Kernel::Deflection => (h, -e),
            Kernel::Rate => (memory.omega_per_s * e, memory.omega_per_s * h),
        };
        Self {
            rated_deflection: S::from_f64(a),
            elastic: params.elastic().normalised(a, params.torque_scale_nm()).cast(),
            torque_scale: S::from_f64(params.torque_scale_nm()),
            cosine: S::from_f64(cosine),
            sine: S::from_f64(sine),
            transient: S::from_f64(cosine),
            beta: S::from_f64(memory.beta_per_s),
            omega: S::from_f64(memory.omega_per_s),
            inverse_omega: S::from_f64(1.0 / memory.omega_per_s),
        }
    }

    /// θ(t) = A sin ωt, rad.
    #[must_use]
    pub fn deflection(&self, t_s: S) -> S {
        self.rated_deflection * (self.omega * t_s).sin()
    }

    /// m(t), N·m.
    #[must_use]
    pub fn memory(&self, t_s: S) -> S {
        let phase = self.omega * t_s;
        self.cosine * phase.cos() + self.sine * phase.sin() - self.transient * (-(self.beta * t_s)).exp()
    }

    /// z(t) = abs(cos ωt)·m(t), N·m.
    #[must_use]
    pub fn hysteresis(&self, t_s: S) -> S {
        (self.omega * t_s).cos().abs() * self.memory(t_s)
    }

    /// f(θ(t)), N·m.
    #[must_use]
    pub fn elastic(&self, t_s: S) -> S {
        self.elastic_at(self.deflection(t_s))
    }

    /// T(t) = f(θ(t)) + z(t), N·m.
    #[must_use]
    pub fn torque(&self, t_s: S) -> S {
        self.elastic(t_s) + self.hysteresis(t_s)
    }

    /// t±(θ) in s: when the deflection (abs(θ) ≤ A, else the tip) passes on the given branch. Branch 0 is the first rise from θ = 0 to A, branch 1 the fall to −A,
    /// branch 2 the rise to A, and so on.
    #[must_use]
    pub fn time(&self, theta_rad: S, branch: u16) -> S {
        let u = theta_rad.over(self.rated_deflection).clamp(-S::ONE, S::ONE);
        let half_turns = S::from_f64(f64::from(branch) * core::f64::consts::PI);
        let angle = u.asin();
        (if branch.is_multiple_of(2) { half_turns + angle } else { half_turns - angle }) * self.inverse_omega
    }

    /// T(θ) on the given branch (see [`time`](Self::time)), N·m.
    #[must_use]
    pub fn torque_on_branch(&self, theta_rad: S, branch: u16) -> S {
        self.elastic_at(theta_rad) + self.hysteresis(self.time(theta_rad, branch))
    }

    fn elastic_at(&self, theta_rad: S) -> S {
        self.torque_scale * self.elastic.torque(theta_rad.over(self.rated_deflection))
    }
}
