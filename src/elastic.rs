//! Elastic torque f(θ) = c1·θ + c2·θ³ + c3·θ⁵.

use crate::scalar::Scalar;

/// The elastic coefficients in SI units (paper, Table 2).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Elastic {
    /// c1, N·m/rad.
    pub c1_nm_per_rad: f64,
    /// c2, N·m/rad³.
    pub c2_nm_per_rad3: f64,
    /// c3, N·m/rad⁵.
    pub c3_nm_per_rad5: f64,
}

impl Elastic {
    /// The same polynomial in u = θ/A and τ = T/scale.
    pub fn normalised(&self, rated_deflection_rad: f64, torque_scale_nm: f64) -> Polynomial<f64> {
        let a = rated_deflection_rad;
        let a3 = a * a * a;
        Polynomial {
            k1: self.c1_nm_per_rad * a / torque_scale_nm,
            k3: self.c2_nm_per_rad3 * a3 / torque_scale_nm,
            k5: self.c3_nm_per_rad5 * a3 * a * a / torque_scale_nm,
        }
    }

    /// f(θ) in N·m at a deflection in rad.
    pub fn torque_nm(&self, theta_rad: f64) -> f64 {
        self.normalised(1.0, 1.0).torque(theta_rad)
    }

    /// f′(θ) in N·m/rad at a deflection in rad.
    pub fn stiffness_nm_per_rad(&self, theta_rad: f64) -> f64 {
        self.normalised(1.0, 1.0).stiffness(theta_rad)
    }
}

/// k1·u + k3·u³ + k5·u⁵: the elastic torque with coefficients of order one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polynomial<S> {
    /// c1·A/T_A.
    pub k1: S,
    /// c2·A³/T_A.
    pub k3: S,
    /// c3·A⁵/T_A.
    pub k5: S,
}

impl<S: Scalar> Polynomial<S> {
    /// The polynomial at u, by Horner's rule: within 3 units in the last place of the largest term.
    #[inline(always)]
    pub fn torque(&self, u: S) -> S {
        let square = u * u;
        u * (self.k1 + square * (self.k3 + square * self.k5))
    }

    /// Its derivative at u.
    #[inline]
    pub fn stiffness(&self, u: S) -> S {
        let square = u * u;
        let (three, five) = (S::TWO + S::ONE, S::TWO + S::TWO + S::ONE);
        self.k1 + square * (three * self.k3 + square * (five * self.k5))
    }

    /// Rounded to another scalar.
    pub fn cast<R: Scalar>(&self) -> Polynomial<R> {
        Polynomial {
            k1: R::from_f64(self.k1.to_f64()),
            k3: R::from_f64(self.k3.to_f64()),
            k5: R::from_f64(self.k5.to_f64()),
        }
    }
}

/// θ, θ³, θ⁵: the columns that c1, c2, c3 multiply.
pub fn basis(theta_rad: f64) -> [f64; 3] {
    let column = |k1: f64, k3: f64, k5: f64| Polynomial { k1, k3, k5 }.torque(theta_rad);
    [column(1.0, 0.0, 0.0), column(0.0, 1.0, 0.0), column(0.0, 0.0, 1.0)]
}
