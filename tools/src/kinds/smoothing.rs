//! The smoothing of the sign of a friction, and its limits.

use super::number_of;
use crate::model::Term;

/// The key of the velocity over which the sign of a friction is smoothed.
pub const SMOOTHING: &str = "smoothing_rad_per_s";
/// The smoothing of a friction's sign is at most this share of the largest velocity.
pub const LARGEST_SMOOTHING: f64 = 0.25;
/// In the base model of a diagnosis it is at most this share where less is given. Friction of a wider smoothing is viscous over much of the speed and hides
/// that viscous friction is missing: with 0.25 the refitted bases of EMPS and KUKA logs without viscous friction are named `unknown`, from 0.05 to 0.1 `viscous_friction`.
pub const LARGEST_BASE_SMOOTHING: f64 = 0.05;
/// Friction whose smoothing exceeds this share of the largest velocity does not come near its torque: within the recordings it is viscous.
pub const WIDER_THAN_SPEEDS: f64 = 0.75;

/// The highest smoothing of a friction of a base model, rad/s.
pub fn highest_base_smoothing(term: &Term, fastest_rad_per_s: f64) -> f64 {
    number_of(term, SMOOTHING).max(LARGEST_BASE_SMOOTHING * fastest_rad_per_s)
}

/// Whether friction saturates within the speeds recorded; true for what is none.
pub fn saturates(term: &Term, fastest_rad_per_s: f64) -> bool {
    number_of(term, SMOOTHING) <= LARGEST_SMOOTHING * fastest_rad_per_s
}
