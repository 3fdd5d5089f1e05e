//! The usual servo: position P over velocity PI, its torque limited.
//!
//! With the position error e, its difference over a period through a first-order filter v̂, and the feed-forward torque T_ff:
//! ε = v̂ + k_p·e, T = clamp(T_ff + k_v·ε + I), and I grows by k_v·ω_i·Δ·ε while T is not limited.
//!
//! **Bad input.** A period whose error or feed-forward is not finite is refused: nothing of the state moves, and the torque is the last good one on its way to zero, at
//! the limit per [`FADE_S`]. The velocity is not estimated across a refused period or a change of gains, nor where the error jumps by more than [`TOP_SPEED_RAD_PER_S`]: one good
//! period, and the torque is again what it would have been. The integral stays within the limit.
//!
//! **Other gains** begin where the old ones ended ([`CascadeState::bridge`]): what the torque would jump by fades at the same rate.
//!
//! The compensation of the gear is an offset of the motor's position (MODEL.md section 5), so it enters through e: the error is taken in counts, a large angle
//! never meets a small offset in `f32`.

use core::fmt;

use crate::feedforward::towards;
use crate::gear::LONGEST_PERIOD_S;
use crate::scalar::{Extended, Float};

/// The torque limit fades to zero in this time, s.
pub const FADE_S: f64 = 0.1;

/// No motor turns faster, rad/s: an error that changes faster is another reference, or was misread.
pub const TOP_SPEED_RAD_PER_S: f64 = 1e4;

/// What a servo is tuned to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gains {
    /// Δ > 0, s.
    pub period_s: f64,
    /// k_p ≥ 0, 1/s.
    pub position_per_s: f64,
    /// k_v ≥ 0, N·m·s/rad.
    pub velocity_nms_per_rad: f64,
    /// ω_i ≥ 0, rad/s.
    pub integral_rad_per_s: f64,
    /// Corner of the velocity filter, above 0, rad/s.
    pub filter_rad_per_s: f64,
    /// Most torque either way, above 0, N·m.
    pub limit_nm: f64,
}

/// A gain that is none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct GainsError {
    /// Its field in [`Gains`].
    pub gain: &'static str,
    /// What it was.
    pub value: f64,
}

impl fmt::Display for GainsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} = {} must be finite and not negative; period_s, filter_rad_per_s and limit_nm must be above zero",
            self.gain, self.value
        )
    }
}

impl core::error::Error for GainsError {}

/// A servo; its state is apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cascade<S> {
    rate: S,
    position: S,
    velocity: S,
    integral: S,
    filter: S,
    limit: S,
    largest_change: S,
    fade: S,
}

/// What a servo remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CascadeState<S> {
    error: S,
    velocity: S,
    integral: S,
    /// The last torque.
    torque: S,
    /// What other gains would change the torque by, on its way to zero.
    gap: S,
    bridges: bool,
    refused: bool,
}

impl<S: Float> Cascade<S> {
    /// A servo of these gains, without arithmetic in double precision.
    ///
    /// # Errors
    /// [`GainsError`]: the first that is NaN, infinite, negative, or zero where it must not be, also as the scalar rounds it.
    pub fn new(gains: &Gains) -> Result<Self, GainsError> {
        let Gains { period_s, position_per_s, velocity_nms_per_rad, integral_rad_per_s, filter_rad_per_s, limit_nm } =
            *gains;
        let longest = Extended::of_double(LONGEST_PERIOD_S);
        let checked = |gain, value: f64, may_be_zero, most: Option<Extended>| {
            let size = Extended::of_double(value).filter(|size| most.is_none_or(|most| *size <= most));
            let size = size.ok_or(GainsError { gain, value })?;
            let rounded = S::of_extended(size);
            let is_positive = !value.is_sign_negative() && rounded > S::ZERO && rounded.is_finite();
            if is_positive || may_be_zero && size == Extended::ZERO {
                Ok(size)
            } else {
                Err(GainsError { gain, value })
            }
        };
        let period = checked("period_s", period_s, false, longest)?;
        let position = checked("position_per_s", position_per_s, true, None)?;
        let velocity = checked("velocity_nms_per_rad", velocity_nms_per_rad, true, None)?;
        let integral = checked("integral_rad_per_s", integral_rad_per_s, true, None)?;
        let filter = checked("filter_rad_per_s", filter_rad_per_s, false, None)?;
        let limit = checked("limit_nm", limit_nm, false, None)?;
        let finite = |gain, value, number| {
            Some(S::of_extended(number)).filter(|rounded| rounded.is_finite()).ok_or(GainsError { gain, value })
        };
        // Constants, and constant for the compiler.
        let [top_speed, fade] = [TOP_SPEED_RAD_PER_S, FADE_S].map(|x| Extended::of_double(x).unwrap_or(Extended::ONE));
        Ok(Self {
            rate: finite("period_s", period_s, Extended::ONE.over(period))?,
            position: S::of_extended(position),
            velocity: S::of_extended(velocity),
            integral: finite("integral_rad_per_s", integral_rad_per_s, velocity.times(integral).times(period))?,
            filter: S::of_extended(filter.times(period).decay()),
            limit: S::of_extended(limit),
            largest_change: S::of_extended(top_speed.times(period)),
            fade: S::of_extended(if period < fade { limit.times(period).over(fade) } else { limit }),
        })
    }

    /// One period: the position error, rad, and the feed-forward torque, N·m, to the torque, N·m, always within the limit.
    #[inline]
    #[must_use]
    pub fn step(&self, state: &mut CascadeState<S>, error: S, feed_forward: S) -> S {
        let change = error - state.error;
        let follows = change.abs() <= self.largest_change && !state.refused && !state.bridges;
        let raw = if follows { change * self.rate } else { state.velocity };
        let velocity = state.velocity + self.filter * (raw - state.velocity);
        let deviation = velocity + self.position * error;
        let alone = feed_forward + self.velocity * deviation + state.integral;
        if !alone.is_finite() {
            return self.refuse(state);
        }
        let within = alone.clamp(-self.limit, self.limit);
        let gap = if state.bridges { state.torque - within } else { state.gap };
        let asked = within + gap;
        let torque = asked.clamp(-self.limit, self.limit);
        let free = within == alone && torque == asked;
        let integral = if free { state.integral + self.integral * deviation } else { state.integral };
        *state = CascadeState {
            error,
            velocity,
            integral: integral.clamp(-self.limit, self.limit),
            torque,
            gap: towards(gap, S::ZERO, self.fade),
            bridges: false,
            refused: false,
        };
        torque
    }

    /// One period without input: the state stays, the last torque fades.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn refuse(&self, state: &mut CascadeState<S>) -> S {
        state.refused = true;
        state.torque = towards(state.torque.clamp(-self.limit, self.limit), S::ZERO, self.fade);
        state.torque
    }
}

impl<S: Float> CascadeState<S> {
    /// Whether the last period was refused.
    #[must_use]
    pub fn is_refused(&self) -> bool {
        self.refused
    }

    /// The next period is that of other gains: its torque begins at the last one, and the gap fades.
    pub fn bridge(&mut self) {
        self.bridges = true;
    }

    /// A fresh state that begins at the last torque.
    #[must_use]
    pub fn restarted(&self) -> Self {
        Self { torque: self.torque, bridges: true, ..Self::default() }
    }
}
