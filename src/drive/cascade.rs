//! The usual servo: position P over velocity PI, its torque limited.
//!
//! With the position error e, its difference over a period through a first-order filter v̂, and the feed-forward torque T_ff:
//! ε = v̂ + k_p·e, T = clamp(T_ff + k_v·ε + I), and I grows by k_v·ω_i·Δ·ε while T is not limited.
//!
//! The compensation of the gear is an offset of the motor's position (MODEL.md section 5), so it enters through e: the error is taken in counts, a large angle
//! never meets a small offset in `f32`.

use crate::scalar::Float;

/// What a servo is tuned to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Δ, s.
    pub period_s: f64,
    /// k_p, 1/s.
    pub position_per_s: f64,
    /// k_v, N·m·s/rad.
    pub velocity_nms_per_rad: f64,
    /// ω_i, rad/s.
    pub integral_rad_per_s: f64,
    /// Corner of the velocity filter, rad/s.
    pub filter_rad_per_s: f64,
    /// Most torque either way, N·m.
    pub limit_nm: f64,
}

/// A servo; its state is apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cascade<S> {
    rate: S,
    position: S,
    velocity: S,
    integral: S,
    filter: S,
    limit: S,
}

/// What a servo remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CascadeState<S> {
    error: S,
    velocity: S,
    integral: S,
}

impl<S: Float> Cascade<S> {
    /// A servo of these gains.
    pub fn new(gains: &Gains) -> Self {
        Self {
            rate: S::from_f64(1.0 / gains.period_s),
            position: S::from_f64(gains.position_per_s),
            velocity: S::from_f64(gains.velocity_nms_per_rad),
            integral: S::from_f64(gains.velocity_nms_per_rad * gains.integral_rad_per_s * gains.period_s),
            filter: S::from_f64(-libm::expm1(-gains.filter_rad_per_s * gains.period_s)),
            limit: S::from_f64(gains.limit_nm),
        }
    }

    /// One period: the position error, rad, and the feed-forward torque, N·m, to the torque, N·m.
    #[inline]
    pub fn step(&self, state: &mut CascadeState<S>, error: S, feed_forward: S) -> S {
        let raw = (error - state.error) * self.rate;
        state.error = error;
        state.velocity = state.velocity + self.filter * (raw - state.velocity);
        let deviation = state.velocity + self.position * error;
        let asked = feed_forward + self.velocity * deviation + state.integral;
        let torque = asked.clamp(-self.limit, self.limit);
        if torque == asked {
            state.integral = state.integral + self.integral * deviation;
        }
        torque
    }
}
