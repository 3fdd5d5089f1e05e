//! A second implementation of MODEL.md in f64, written apart from the core, to hold the core to.
//!
//! It is the textbook's way of computing each law: a growing list of turning points, the memory integrals by quadrature. It uses nothing of
//! the core, so that no error can be in both by inheritance. Beside it, a [flash] that is out for the store.
#![forbid(unsafe_code)]

pub mod closed_form;
pub mod drift;
pub mod flash;
pub mod integral;
pub mod masing;
pub mod paths;
pub mod sealed;

/// One gear: the symbols of MODEL.md section 1, β and ω not negative, SI units.
#[derive(Debug, Clone, Copy)]
pub struct Constants {
    /// A, rad.
    pub a: f64,
    /// c1, N·m/rad.
    pub c1: f64,
    /// c2, N·m/rad³.
    pub c2: f64,
    /// c3, N·m/rad⁵.
    pub c3: f64,
    /// α; its unit depends on the kernel.
    pub alpha: f64,
    /// β, 1/s.
    pub beta: f64,
    /// ω, 1/s.
    pub omega: f64,
}

impl Constants {
    /// The published gear (Table 2 of the paper), both signs of β and ω flipped, A from its Table 1.
    pub const PUBLISHED: Self =
        Self { a: 1.168e-3, c1: 2.4737e4, c2: 1.0e9, c3: -1.1774e14, alpha: 2.6532e6, beta: 422.68, omega: 226.31 };

    /// f(θ) = c1θ + c2θ³ + c3θ⁵, N·m; beyond κA its tangent there.
    pub fn elastic(&self, theta: f64) -> f64 {
        let edge = if theta.abs() <= self.a { theta.abs() } else { theta.abs().min(self.knee() * self.a) };
        let within = self.c1 * edge + self.c2 * edge.powi(3) + self.c3 * edge.powi(5);
        theta.signum() * (within + (theta.abs() - edge) * self.stiffness(edge).max(0.0))
    }

    fn stiffness(&self, theta: f64) -> f64 {
        self.c1 + 3.0 * self.c2 * theta.powi(2) + 5.0 * self.c3 * theta.powi(4)
    }

    /// κ = 0.9 × the largest abs(θ)/A with f′ > 0 everywhere below, within 1 and 1.5, by search.
    pub fn knee(&self) -> f64 {
        let rises = |u: f64| self.stiffness(u * self.a) > 0.0;
        let Some(falling) = (0..=2000).map(|k| f64::from(k) * 1e-3).find(|u| !rises(*u)) else { return 1.5 };
        let (mut low, mut high) = ((falling - 1e-3).max(0.0), falling);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if rises(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        (0.9 * low).clamp(1.0, 1.5)
    }

    /// g(θ) = √(max(0, (1−θ/A)(1+θ/A))). A ± θ is exact near the tips, where g is ill-conditioned.
    pub fn gate(&self, theta: f64) -> f64 {
        ((self.a - theta) * (self.a + theta)).max(0.0).sqrt() / self.a
    }

    /// e = αβ/(β²+ω²).
    pub fn e(&self) -> f64 {
        self.alpha * self.beta / (self.beta.powi(2) + self.omega.powi(2))
    }

    /// h = αω/(β²+ω²).
    pub fn h(&self) -> f64 {
        self.alpha * self.omega / (self.beta.powi(2) + self.omega.powi(2))
    }
}

/// What the memory integral weighs (MODEL.md section 2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighed {
    /// −θ.
    Deflection,
    /// θ̇.
    Rate,
}
