//! Elastic torque f(θ) = c1·θ + c2·θ³ + c3·θ⁵, beyond κA continued by its tangent.

use crate::scalar::{Float, Scalar};

/// The elastic coefficients in SI units (paper, Table 2).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Elastic {
    /// c1, N·m/rad.
    pub c1_nm_per_rad: f64,
    /// c2, N·m/rad³.
    pub c2_nm_per_rad3: f64,
    /// c3, N·m/rad⁵.
    pub c3_nm_per_rad5: f64,
}

impl Elastic {
    /// No spring: for `..Elastic::NONE` in constants.
    pub const NONE: Self = Self { c1_nm_per_rad: 0.0, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 };

    /// The same polynomial in u = θ/A and τ = T/scale.
    #[must_use]
    pub const fn normalised(&self, rated_deflection_rad: f64, torque_scale_nm: f64) -> Polynomial<f64> {
        let a = rated_deflection_rad;
        let a3 = a * a * a;
        Polynomial {
            k1: self.c1_nm_per_rad * a / torque_scale_nm,
            k3: self.c2_nm_per_rad3 * a3 / torque_scale_nm,
            k5: self.c3_nm_per_rad5 * a3 * a * a / torque_scale_nm,
        }
    }

    /// f(θ) in N·m at a deflection in rad, without the tangent that continues it beyond the calibrated range ([`ElasticTorque`]).
    #[must_use]
    pub const fn torque_nm(&self, theta_rad: f64) -> f64 {
        // As `Polynomial::torque`, which no constant can call.
        let square = theta_rad * theta_rad;
        theta_rad * (self.c1_nm_per_rad + square * (self.c2_nm_per_rad3 + square * self.c3_nm_per_rad5))
    }

    /// f′(θ) in N·m/rad at a deflection in rad.
    #[must_use]
    pub fn stiffness_nm_per_rad(&self, theta_rad: f64) -> f64 {
        self.normalised(1.0, 1.0).stiffness(theta_rad)
    }
}

/// k1·u + k3·u³ + k5·u⁵: the elastic torque with coefficients of order one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    #[must_use]
    pub fn torque(&self, u: S) -> S {
        let square = u * u;
        u * (self.k1 + square * (self.k3 + square * self.k5))
    }

    /// u, u³, u⁵: the columns that k1, k3, k5 multiply.
    #[inline]
    #[must_use]
    pub fn columns(u: S) -> [S; 3] {
        let square = u * u;
        [u, u * square, u * (square * square)]
    }

    /// Its derivative at u.
    #[inline]
    #[must_use]
    pub fn stiffness(&self, u: S) -> S {
        let square = u * u;
        let (three, five) = (S::TWO + S::ONE, S::TWO + S::TWO + S::ONE);
        self.k1 + square * (three * self.k3 + square * (five * self.k5))
    }

    /// Rounded to another scalar.
    #[must_use]
    pub fn cast<R: Scalar>(&self) -> Polynomial<R> {
        Polynomial {
            k1: R::from_f64(self.k1.to_f64()),
            k3: R::from_f64(self.k3.to_f64()),
            k5: R::from_f64(self.k5.to_f64()),
        }
    }
}

/// The largest κ: what a strain wave gear bears for a moment is some times its rated torque, and no calibration reaches there.
pub const LARGEST_KNEE: f64 = 1.5;

/// The share of the deflection at which f′ vanishes that κ keeps to.
const KNEE_SHARE: f64 = 0.9;

/// The elastic torque over all deflections: the polynomial up to u = ±κ, its tangent there beyond.
///
/// κ = 0.9 × the largest u with f′ > 0 everywhere below, at least 1 (the calibrated range keeps the polynomial) and at most
/// [`LARGEST_KNEE`]. The torque is continuous, and never falls beyond κ: a spring that falls within ±A stays level outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticTorque<S> {
    polynomial: Polynomial<S>,
    knee: S,
    knee_torque: S,
    knee_stiffness: S,
}

impl<S: Scalar> ElasticTorque<S> {
    /// The torque that a polynomial gives within its range. Computed from the coefficients as they are rounded: the same on host and drive.
    #[must_use]
    pub fn new(polynomial: Polynomial<S>) -> Self {
        let Polynomial { k1, k3, k5 } = polynomial;
        let exact = Polynomial { k1: k1.to_f64(), k3: k3.to_f64(), k5: k5.to_f64() };
        let knee = (KNEE_SHARE * exact.rises_up_to()).clamp(1.0, LARGEST_KNEE);
        Self {
            polynomial,
            knee: S::from_f64(knee),
            knee_torque: S::from_f64(exact.torque(knee)),
            knee_stiffness: S::from_f64(exact.stiffness(knee).max(0.0)),
        }
    }

    /// The words of a prepared block, in order.
    #[cfg(feature = "block")]
    pub(crate) fn words(&self) -> [S; 6] {
        let Polynomial { k1, k3, k5 } = self.polynomial;
        [k1, k3, k5, self.knee, self.knee_torque, self.knee_stiffness]
    }

    /// The torque of such words.
    #[cfg(feature = "block")]
    pub(crate) fn of_words([k1, k3, k5, knee, knee_torque, knee_stiffness]: [S; 6]) -> Self {
        Self { polynomial: Polynomial { k1, k3, k5 }, knee, knee_torque, knee_stiffness }
    }

    /// The polynomial, which holds up to ±κ.
    #[inline]
    #[must_use]
    pub fn polynomial(&self) -> &Polynomial<S> {
        &self.polynomial
    }

    /// κ.
    #[inline]
    #[must_use]
    pub fn knee(&self) -> S {
        self.knee
    }

    /// f(κA) over T_A, where the tangent begins.
    #[must_use]
    pub fn knee_torque(&self) -> S {
        self.knee_torque
    }

    /// The slope of the tangent, over A and T_A.
    #[must_use]
    pub fn knee_stiffness(&self) -> S {
        self.knee_stiffness
    }

    /// f at any u.
    #[inline(always)]
    #[must_use]
    pub fn torque(&self, u: S) -> S {
        let size = u.abs();
        if size <= self.knee {
            return self.polynomial.torque(u);
        }
        let torque = self.knee_torque + (size - self.knee) * self.knee_stiffness;
        if u < S::ZERO { -torque } else { torque }
    }

    /// f′ at any u.
    #[inline]
    #[must_use]
    pub fn stiffness(&self, u: S) -> S {
        if u.abs() <= self.knee { self.polynomial.stiffness(u) } else { self.knee_stiffness }
    }
}

impl<S: Float> Polynomial<S> {
    /// The largest u with a derivative above zero everywhere below; infinite where it never vanishes, 0 where it is not above zero at 0.
    fn rises_up_to(&self) -> S {
        // k1 + 3·k3·w + 5·k5·w² with w = u²: the least root above zero, in the form that does not cancel.
        let infinite = S::from_f64(f64::INFINITY);
        if self.k1 <= S::ZERO {
            return S::ZERO;
        }
        let (half, square) = (S::from_f64(1.5) * self.k3, S::from_f64(5.0) * self.k5);
        let discriminant = half * half - square * self.k1;
        if discriminant < S::ZERO {
            return infinite;
        }
        let divisor = discriminant.sqrt() - half;
        // Both roots are below zero where the divisor is: k1 > 0.
        if divisor > S::ZERO { self.k1.over(divisor).sqrt() } else { infinite }
    }
}

#[cfg(any(feature = "link", feature = "adapt"))]
impl<S: Float> ElasticTorque<S> {
    /// As [`new`](Self::new) within some roundings, computed in the scalar alone.
    pub(crate) fn near(polynomial: Polynomial<S>) -> Self {
        let knee = (S::from_f64(KNEE_SHARE) * polynomial.rises_up_to()).clamp(S::ONE, S::from_f64(LARGEST_KNEE));
        let (knee_torque, knee_stiffness) =
            (polynomial.torque(knee), polynomial.stiffness(knee).clamp(S::ZERO, S::from_f64(S::LARGEST)));
        Self { polynomial, knee, knee_torque, knee_stiffness }
    }
}

/// θ, θ³, θ⁵: the columns that c1, c2, c3 multiply.
#[must_use]
pub fn basis(theta_rad: f64) -> [f64; 3] {
    Polynomial::columns(theta_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tangent_begins_where_the_derivative_says() {
        let of = |k1, k3, k5| ElasticTorque::new(Polynomial { k1, k3, k5 }).knee();
        assert_eq!(of(1.0, 0.0, 0.0), 1.5);
        // 1 − 3w/4 = 0 at u = 2/√3: κ = 0.9·1.1547.
        assert!((of(1.0, -0.25, 0.0) - 0.9 * 2.0 / libm::sqrt(3.0)).abs() < 1e-15);
        // 1 − w² = 0 at u = 1.
        assert_eq!(of(1.0, 0.0, -0.2), 1.0);
        // (1 − w)(1 − w/4): the nearer root counts.
        assert_eq!(of(1.0, -1.25 / 3.0, 0.05), 1.0);
        assert_eq!(of(1.0, 1.0, 1.0), 1.5);
    }
}
