//! How far the torques of two blocks can be apart: what parameters on trial are bounded by while the drive is enabled. Their terms, ratio, zero, side and unit are the same.
//!
//! With f the elastic torque, A the rated deflection in force and Δz the largest difference of the hysteresis torques, whatever the path ([`Hysteresis`]), other parameters
//! are within a share s where for all deflections up to 1.5·A, which no gear bears for long,
//!
//! ```text
//! abs(f_other(θ) − f(θ)) + Δz ≤ s·max(f(A), f(θ))
//! ```
//!
//! The gate on samples (record `largest_step`) is part of it: a wider one, or none, lets through what the block in force keeps from the torque. Within the share it may be wider; a narrower one refuses samples only.
//!
//! All of it in single precision: a share is no finer than that. Both elastic torques are odd polynomials of degree five up to their knees and straight beyond, so the extremes lie at knees, ends and roots of quadratic equations.

use super::hysteresis::Hysteresis;
use crate::block::joint::single;
use crate::block::prepared::words;
use crate::block::{Block, GEAR, LARGEST_STEP, ScalarKind, digest_beside_gear};
use crate::elastic::{ElasticTorque, Polynomial};

/// No deflection counts beyond so many times the rated one.
const LARGEST_KNEE: f32 = crate::elastic::LARGEST_KNEE as f32;

/// What a block in force allows others to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    rating: Option<Rating>,
    beside: u32,
    gate: Gate,
}

impl Bounds {
    /// Those of a block.
    pub(super) fn of(block: &Block<'_>) -> Self {
        let rating = Rating::of(block);
        let gate = Gate::of(block, rating.as_ref());
        Self { rating, beside: digest_beside_gear(block), gate }
    }

    /// Whether another block gives the torques of this one within a share of them, by the same terms, in the same joint and from samples that pass a gate at most this share wider; an infinite share allows every block.
    pub(super) fn allow(&self, block: &Block<'_>, share: f32) -> bool {
        let other = Self::of(block);
        let is_within = match (&self.rating, &other.rating) {
            (Some(rating), Some(other)) => rating.bounds(other, share),
            (rating, other) => rating.is_none() && other.is_none(),
        };
        let is_gated = self.gate.bounds(&other.gate, share);
        share == f32::INFINITY || (other.beside == self.beside && is_gated && is_within)
    }
}

/// The fastest samples that a block takes; infinite where it has no gate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gate {
    largest_step_rad: f32,
    top_speed_rad_per_s: f32,
}

impl Gate {
    fn of(block: &Block<'_>, rating: Option<&Rating>) -> Self {
        let header = block.header();
        let step = match words::<1>(block, LARGEST_STEP.tag) {
            Ok([word]) => header.scalar.number(word),
            Err(_) => f32::INFINITY,
        };
        let unit = match (header.scalar, rating) {
            (ScalarKind::Fixed, Some(rating)) => rating.rated_deflection_rad,
            _ => 1.0,
        };
        let largest_step_rad = unit * step;
        Self { largest_step_rad, top_speed_rad_per_s: largest_step_rad / header.period_s }
    }

    /// Whether another gate is at most a share wider than this one.
    fn bounds(&self, other: &Self, share: f32) -> bool {
        // A NaN compares false.
        other.largest_step_rad <= (1.0 + share) * self.largest_step_rad
            && other.top_speed_rad_per_s <= (1.0 + share) * self.top_speed_rad_per_s
    }
}

/// What a gear transmits, of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rating {
    rated_deflection_rad: f32,
    torque_scale_nm: f32,
    elastic: ElasticTorque<f32>,
    hysteresis: Hysteresis,
}

impl Rating {
    /// That of a block; `None` where it has no gear or not one law.
    fn of(block: &Block<'_>) -> Option<Self> {
        let kind = block.header().scalar;
        let [a0, a1, t0, t1, coefficients @ ..] = words::<7>(block, GEAR.tag).ok()?;
        let [k1, k3, k5] = coefficients.map(|word| kind.number(word));
        let [rated_deflection_rad, torque_scale_nm] = [[a0, a1], [t0, t1]].map(single);
        // A NaN compares false.
        (rated_deflection_rad > 0.0 && torque_scale_nm > 0.0).then_some(())?;
        Some(Self {
            rated_deflection_rad,
            torque_scale_nm,
            elastic: ElasticTorque::near(Polynomial { k1, k3, k5 }),
            hysteresis: Hysteresis::of(block, rated_deflection_rad, torque_scale_nm)?,
        })
    }

    /// Whether another gear gives the torques of this one within a share of them.
    fn bounds(&self, other: &Self, share: f32) -> bool {
        // Deflections as fractions of A: one of the other gear is `ratio` times as many of its own.
        let ratio = self.rated_deflection_rad / other.rated_deflection_rad;
        let torque_nm = |x: f32| self.elastic.torque(x) * self.torque_scale_nm;
        let other_nm = |x: f32| other.elastic.torque(ratio * x) * other.torque_scale_nm;
        let hysteresis_nm = self.hysteresis.largest_difference_nm(&other.hysteresis);
        let rated_nm = libm::fabsf(torque_nm(1.0));
        let is_within = |x: f32| {
            let most = share * torque_nm(x).max(rated_nm);
            // A NaN compares false.
            libm::fabsf(other_nm(x) - torque_nm(x)) + hysteresis_nm <= most
        };

        let [curve, line] = self.pieces(1.0);
        let [other_curve, other_line] = other.pieces(ratio);
        for x in [0.0, 1.0, self.elastic.knee(), other.elastic.knee() / ratio, LARGEST_KNEE] {
            if x <= LARGEST_KNEE && !is_within(x) {
                return false;
            }
        }
        for (one, other) in [(curve, other_curve), (line, other_curve), (curve, other_line)] {
            // Up to A the difference of the torques counts, beyond also a share of the torque itself.
            for times in [1.0, 1.0 + share, 1.0 - share] {
                let [[a, b, c], [x, y, z]] = [one, other];
                for turn in turning_points([x - times * a, y - times * b, z - times * c]) {
                    // A NaN compares false.
                    if turn <= LARGEST_KNEE && !is_within(turn) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// The factors of x, x³ and x⁵ below and beyond the knee, N·m, at a deflection of `ratio`·x·A. Beyond, a constant is left out.
    fn pieces(&self, ratio: f32) -> [[f32; 3]; 2] {
        let Polynomial { k1, k3, k5 } = *self.elastic.polynomial();
        let (first, square) = (ratio * self.torque_scale_nm, ratio * ratio);
        let third = first * square;
        [[first * k1, third * k3, third * square * k5], [first * self.elastic.knee_stiffness(), 0.0, 0.0]]
    }
}

/// Where the derivative of c1·x + c3·x³ + c5·x⁵ vanishes, x > 0; NaN or infinite in the place of what there is none of.
fn turning_points([c1, c3, c5]: [f32; 3]) -> [f32; 2] {
    // c1 + 3·c3·w + 5·c5·w² with w = x², in the form that does not cancel.
    let (half, square) = (1.5 * c3, 5.0 * c5);
    let root = libm::sqrtf(half * half - square * c1);
    let sum = -(half + if half < 0.0 { -root } else { root });
    [sum / square, c1 / sum].map(libm::sqrtf)
}

#[cfg(test)]
mod tests {
    use super::turning_points;

    #[test]
    fn turning_points_are_those_of_the_polynomial() {
        // (x² − 1/4)(x² − 1) as a derivative.
        let found = turning_points([0.25, -1.25 / 3.0, 0.2]);
        assert!((found[0] - 1.0).abs() < 1e-6 && (found[1] - 0.5).abs() < 1e-6, "{found:?}");
        // 1 − x², without a fifth power: one.
        let found = turning_points([1.0, -1.0 / 3.0, 0.0]);
        assert!(found.iter().any(|x| (x - 1.0).abs() < 1e-6), "{found:?}");
        assert!(turning_points([1.0, 1.0, 1.0]).iter().all(|x| x.is_nan()));
    }
}
