//! One root on one smooth stretch of torque, in a bounded number of steps.
//!
//! The unknown is t = tan(φ/2), sin φ = u = θ/A: u = 2t/(1 + t²) and g = (1 − t²)/(1 + t²) are rational in t, so that the square-root tips of the
//! gate are smooth and no root has to be taken. With q = 1/(1 + t²) the derivatives of the torque are
//!
//! ```text
//! dT/dt = 2q·T_φ          d²T/dt² = 4q²·(T_φφ − t·T_φ)
//! ```
//!
//! and Euler's step takes the root of the parabola through them: with residual r = T* − T, a = q·T_φ and b = q²·(T_φφ − t·T_φ)
//!
//! ```text
//! Δt = r/(a + √(a² + 2rb))
//! ```
//!
//! It converges with the third order, also where dT/dt vanishes (the tips of a gear without e). A bracket guards it: a step that leaves the bracket is
//! replaced by its middle.

use crate::scalar::Scalar;

/// Steps after which the search ends in any case.
pub const MOST_STEPS: u8 = 16;

/// The elastic torque with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spring<S> {
    torque: [S; 3],
    slope: [S; 2],
    bend: [S; 2],
}

impl<S: Scalar> Spring<S> {
    pub(super) fn new([k1, k3, k5]: [f64; 3]) -> Self {
        Self {
            torque: [k1, k3, k5].map(S::from_f64),
            slope: [3.0 * k3, 5.0 * k5].map(S::from_f64),
            bend: [6.0 * k3, 20.0 * k5].map(S::from_f64),
        }
    }

    /// f/T_A.
    #[inline]
    pub(super) fn torque(&self, u: S) -> S {
        let [k1, k3, k5] = self.torque;
        let square = u * u;
        u * (k1 + square * (k3 + square * k5))
    }

    /// f/T_A and its first two derivatives by φ.
    #[inline]
    fn at(&self, u: S, g: S) -> [S; 3] {
        let square = u * u;
        let slope = self.torque[0] + square * (self.slope[0] + square * self.slope[1]);
        let bend = u * (self.bend[0] + square * self.bend[1]);
        [self.torque(u), slope * g, bend * g * g - slope * u]
    }
}

/// A hysteresis torque z/T_A along a stretch, as a function of φ.
pub(super) trait Stretch<S> {
    /// z and its first two derivatives by φ, at u = sin φ and g = cos φ.
    fn at(&self, u: S, g: S) -> [S; 3];
}

/// Where the root may lie, t. The ends of the range are edges; the other ends are known to hold the root between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bracket<S> {
    pub(super) low: S,
    pub(super) high: S,
    pub(super) low_is_edge: bool,
    pub(super) high_is_edge: bool,
}

/// What the search aims at and when it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim<S> {
    /// T*/T_A.
    pub(super) torque: S,
    /// A residual that counts as none.
    pub(super) tolerance: S,
    /// A step after which the residual is below the tolerance, by the bound on d³T/dt³.
    pub(super) last_step: S,
    /// A bracket within which the torque changes by less than the tolerance, by the bound on dT/dt.
    pub(super) last_width: S,
}

impl<S: Scalar> Aim<S> {
    /// The same for a stretch mirrored by `sign`.
    #[inline]
    pub(super) fn mirrored(&self, sign: S) -> Self {
        Self { torque: sign * self.torque, ..*self }
    }
}

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Root<S> {
    /// θ/A; ±1 where it is an edge.
    pub(super) u: S,
    pub(super) saturated: bool,
    pub(super) converged: bool,
    pub(super) steps: u8,
}

/// tan(φ/2) from sin φ and cos φ ≥ 0.
#[inline]
pub(super) fn half_tangent<S: Scalar>(u: S, g: S) -> S {
    u.over(S::ONE + g)
}

/// sin φ from tan(φ/2).
#[inline]
fn sine<S: Scalar>(t: S) -> S {
    (t + t).over(S::ONE + t * t)
}

/// The t in the bracket at which f + z meets the aim, from `start` on.
#[inline]
pub(super) fn root<S: Scalar>(
    spring: &Spring<S>,
    stretch: &impl Stretch<S>,
    aim: &Aim<S>,
    bracket: Bracket<S>,
    start: S,
) -> Root<S> {
    let Bracket { mut low, mut high, .. } = bracket;
    // An end is tried at most once: from then on its torque is known.
    let (mut low_tried, mut high_tried) = (false, false);
    let mut t = start.clamp(low, high);
    let mut found = Root { u: S::ZERO, saturated: false, converged: true, steps: 0 };
    while found.steps < MOST_STEPS {
        found.steps += 1;
        let q = (S::ONE + t * t).recip();
        let (u, g) = ((t + t) * q, (q + q) - S::ONE);
        let (f, z) = (spring.at(u, g), stretch.at(u, g));
        let residual = aim.torque - (f[0] + z[0]);
        found.u = u;
        if residual.abs() <= aim.tolerance {
            return found;
        }
        if residual > S::ZERO {
            if t >= high {
                found.saturated = bracket.high_is_edge;
                found.u = if found.saturated { S::ONE } else { u };
                return found;
            }
            (low, low_tried) = (t, true);
        } else {
            if t <= low {
                found.saturated = bracket.low_is_edge;
                found.u = if found.saturated { -S::ONE } else { u };
                return found;
            }
            (high, high_tried) = (t, true);
        }
        let slope = f[1] + z[1];
        let a = q * slope;
        let b = q * q * (f[2] + z[2] - t * slope);
        let next = t + residual.over(a + (a * a + (residual + residual) * b).sqrt());
        // A NaN compares false.
        let rising = a > S::ZERO;
        if rising && next > low && next < high {
            let step = (next - t).abs();
            t = next;
            if step <= aim.last_step {
                found.u = sine(t);
                return found;
            }
        } else if rising && next >= high && !high_tried {
            t = high;
        } else if rising && next <= low && !low_tried {
            t = low;
        } else if high - low <= aim.last_width {
            return found;
        } else {
            t = S::HALF * (low + high);
        }
    }
    found.converged = false;
    found
}
