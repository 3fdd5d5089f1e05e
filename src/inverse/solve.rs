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
//! It converges with the third order, also where dT/dt vanishes (the tips of a gear without e). Its root is the slope that the parabola predicts where
//! it leads, 2√(a² + 2rb): often good enough to finish by a chord, without derivatives. A bracket guards it all: a step that leaves the bracket
//! is replaced by its middle.

use crate::elastic::Polynomial;
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
    pub(super) fn new(elastic: &Polynomial<S>) -> Self {
        let [k3, k5] = [elastic.k3, elastic.k5].map(S::to_f64);
        Self {
            torque: [elastic.k1, elastic.k3, elastic.k5],
            slope: [3.0 * k3, 5.0 * k5].map(S::from_f64),
            bend: [6.0 * k3, 20.0 * k5].map(S::from_f64),
        }
    }
}

#[cfg(feature = "adapt")]
impl<S: crate::scalar::Float> Spring<S> {
    /// [`new`](Self::new), to the bit, computed in the scalar alone.
    pub(super) fn single(elastic: &Polynomial<S>) -> Self {
        let [three, five, six, twenty] = [3.0, 5.0, 6.0, 20.0].map(S::from_f64);
        Self {
            torque: [elastic.k1, elastic.k3, elastic.k5],
            slope: [three * elastic.k3, five * elastic.k5],
            bend: [six * elastic.k3, twenty * elastic.k5],
        }
    }
}

#[cfg(feature = "block")]
impl<S: Scalar> Spring<S> {
    /// The words of a prepared block beside the polynomial's, in order.
    pub(super) fn words(&self) -> [S; 4] {
        let ([s2, s4], [b1, b3]) = (self.slope, self.bend);
        [s2, s4, b1, b3]
    }

    /// The spring of a polynomial and such words.
    pub(super) fn of_words(elastic: &Polynomial<S>, [s2, s4, b1, b3]: [S; 4]) -> Self {
        Self { torque: [elastic.k1, elastic.k3, elastic.k5], slope: [s2, s4], bend: [b1, b3] }
    }
}

impl<S: Scalar> Spring<S> {
    /// The factors of f′ and of f″.
    pub(super) fn derivatives(&self) -> [[S; 2]; 2] {
        [self.slope, self.bend]
    }

    /// f(u), from u and u².
    #[inline]
    pub(super) fn torque(&self, u: S, square: S) -> S {
        let [k1, k3, k5] = self.torque;
        u * (k1 + square * (k3 + square * k5))
    }

    /// f(u) + (linear + quadratic·u)·u.
    #[inline]
    pub(super) fn torque_with(&self, [linear, quadratic]: [S; 2], u: S, square: S) -> S {
        let [k1, k3, k5] = self.torque;
        u * ((k1 + linear) + quadratic * u + square * (k3 + square * k5))
    }

    /// f′(u) and f″(u).
    #[inline]
    pub(super) fn slopes(&self, u: S, square: S) -> [S; 2] {
        let slope = self.torque[0] + square * (self.slope[0] + square * self.slope[1]);
        [slope, u * (self.bend[0] + square * self.bend[1])]
    }

    /// The same with (linear + quadratic·u)·u.
    #[inline]
    pub(super) fn slopes_with(&self, [linear, quadratic]: [S; 2], u: S, square: S) -> [S; 2] {
        let twice = quadratic + quadratic;
        let slope = (self.torque[0] + linear) + twice * u + square * (self.slope[0] + square * self.slope[1]);
        [slope, twice + u * (self.bend[0] + square * self.bend[1])]
    }
}

/// A torque T/T_A along a stretch, as a function of φ: u = sin φ, g = cos φ.
pub(super) trait Stretch<S> {
    /// What the torque and its slopes share beside u².
    type Work: Copy;

    /// T.
    fn torque(&self, u: S, square: S, g: S) -> (S, Self::Work);

    /// T = P(u) + R(φ): the first two derivatives of P by u, then those of R by φ.
    fn slopes(&self, u: S, square: S, g: S, work: Self::Work) -> [[S; 2]; 2];
}

impl<S: Scalar> Stretch<S> for Spring<S> {
    type Work = ();

    #[inline]
    fn torque(&self, u: S, square: S, _g: S) -> (S, ()) {
        (self.torque(u, square), ())
    }

    #[inline]
    fn slopes(&self, u: S, square: S, _g: S, (): ()) -> [[S; 2]; 2] {
        [self.slopes(u, square), [S::ZERO; 2]]
    }
}

/// A point of the half circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point<S> {
    /// tan(φ/2).
    pub(super) t: S,
    /// sin φ.
    pub(super) u: S,
    /// cos φ.
    pub(super) g: S,
    /// 1/(1 + t²) = (1 + g)/2.
    q: S,
}

impl<S: Scalar> Point<S> {
    pub(super) const ZERO: Self = Self { t: S::ZERO, u: S::ZERO, g: S::ONE, q: S::ONE };

    #[inline]
    pub(super) fn of(u: S, g: S) -> Self {
        let one_and_g = S::ONE + g;
        Self { t: u.over(one_and_g), u, g, q: S::HALF * one_and_g }
    }

    #[inline]
    pub(super) fn at(t: S) -> Self {
        let q = (S::ONE + t * t).recip();
        Self { t, u: (t + t) * q, g: (q + q) - S::ONE, q }
    }
}

/// Where the root may lie, t. The edges of the range are ±`edge`; an upper end before that is known to have the root below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bracket<S> {
    pub(super) low: S,
    pub(super) high: S,
    pub(super) edge: S,
}

/// When the search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits<S> {
    /// A residual that counts as none.
    pub(super) tolerance: S,
    /// A step after which the residual is below the tolerance, by the bound on d³T/dt³.
    pub(super) last_step: S,
    /// The largest (Δ² + abs(δ))·abs(δ) of a chord δ after a step Δ that leaves a residual below the tolerance, by the bounds on both derivatives.
    pub(super) last_chord: S,
    /// A bracket within which the torque changes by less than the tolerance, by the bound on dT/dt.
    pub(super) last_width: S,
}

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Root<S> {
    /// θ/A.
    pub(super) u: S,
    /// It is an edge.
    pub(super) saturated: bool,
    pub(super) converged: bool,
    pub(super) steps: u8,
}

/// The point of the bracket at which a stretch meets the aim. The search begins at a point within it, of which the residual is known and what the torque
/// and its slopes share there.
#[inline]
pub(super) fn root<S: Scalar, C: Stretch<S>>(
    stretch: &C,
    (aim, limits): (S, &Limits<S>),
    bracket: Bracket<S>,
    (start, mut residual, mut work): (Point<S>, S, C::Work),
) -> Root<S> {
    let Bracket { mut low, mut high, .. } = bracket;
    // An end is tried at most once: from then on its torque is known.
    let (mut low_tried, mut high_tried) = (false, false);
    let found = |u, steps, saturated| Root { u, saturated, converged: true, steps };
    let mut point = start;
    let mut steps = 0;
    if residual.abs() <= limits.tolerance {
        return found(point.u, steps, false);
    }
    loop {
        let Point { t, u, g, q } = point;
        let up = residual > S::ZERO;
        let room = if up {
            if t >= high {
                return found(u, steps, t >= bracket.edge);
            }
            (low, low_tried) = (t, true);
            high - t
        } else {
            if t <= low {
                return found(u, steps, t <= -bracket.edge);
            }
            (high, high_tried) = (t, true);
            t - low
        };
        if steps == MOST_STEPS {
            return Root { converged: false, ..found(u, steps, false) };
        }
        steps += 1;
        let square = u * u;
        let [[slope, bend], [turn, curl]] = stretch.slopes(u, square, g, work);
        let (turn, curl) = (slope * g + turn, bend * (S::ONE - square) - slope * u + curl);
        let a = q * turn;
        let b = q * q * (curl - t * turn);
        let predicted = S::root_of_parabola(a, residual, b);
        let step = residual.over(a + predicted);
        // A NaN compares false.
        let rising = a > S::ZERO;
        let follows = rising && step.abs() < room;
        let next = if follows {
            t + step
        } else if rising && !(if up { high_tried } else { low_tried }) {
            if up { high } else { low }
        } else if high - low <= limits.last_width {
            return found(u, steps, false);
        } else {
            S::HALF * (low + high)
        };
        point = Point::at(next);
        if follows && step.abs() <= limits.last_step {
            return found(point.u, steps, false);
        }
        let (torque, with) = stretch.torque(point.u, point.u * point.u, point.g);
        (residual, work) = (aim - torque, with);
        if follows && predicted > S::ZERO {
            let chord = residual.over(predicted + predicted);
            let (size, end) = (chord.abs(), next + chord);
            if (step * step + size) * size <= limits.last_chord && low < end && end < high {
                // Along the tangent: the chord is shorter than the root of the spacing of numbers.
                return found(point.u + (chord + chord) * (point.q * point.g), steps, false);
            }
        }
        if residual.abs() <= limits.tolerance {
            return found(point.u, steps, false);
        }
    }
}
