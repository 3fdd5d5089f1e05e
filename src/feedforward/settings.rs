//! How fast a contribution may change.

use core::fmt;

use crate::inverse::InverseError;
use crate::memory::Frame;
use crate::params::Params;
use crate::scalar::{Float, Scalar};

/// What the feed-forward of a joint is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Δ, the control period, s.
    pub period_s: f64,
    /// The gain takes this long from 0 to 1 or back, s.
    pub ramp_s: f64,
    /// The most that the offset changes, rad/s at the output; may be infinite.
    pub offset_slew_rad_per_s: f64,
    /// The most that the hysteresis torque changes, N·m/s; may be infinite.
    pub torque_slew_nm_per_s: f64,
    /// The top speed of the deflection, rad/s; may be infinite. Along the measurement a sample that it does not allow is
    /// [quarantined](crate::Gear::with_largest_step).
    pub largest_rate_rad_per_s: f64,
}

impl Default for Settings {
    /// 1 kHz, a ramp of half a second, no slew limits, no top speed.
    fn default() -> Self {
        Self {
            period_s: 1e-3,
            ramp_s: 0.5,
            offset_slew_rad_per_s: f64::INFINITY,
            torque_slew_nm_per_s: f64::INFINITY,
            largest_rate_rad_per_s: f64::INFINITY,
        }
    }
}

/// [`Settings`] in the scalar of the feed-forward, for a set-up without double precision.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits<S> {
    /// Δ, the control period, s.
    pub period_s: S,
    /// The gain takes this long from 0 to 1 or back, s.
    pub ramp_s: S,
    /// The most that the offset changes, rad/s at the output; may be infinite.
    pub offset_slew_rad_per_s: S,
    /// The most that the hysteresis torque changes, N·m/s; may be infinite.
    pub torque_slew_nm_per_s: S,
    /// The top speed of the deflection, rad/s; may be infinite.
    pub largest_rate_rad_per_s: S,
}

impl<S: Float> Default for Limits<S> {
    /// Those of [`Settings`].
    fn default() -> Self {
        Self::of(&Settings::default())
    }
}

impl<S: Scalar> Limits<S> {
    /// Settings, each rounded: a feed-forward of a stored block with them is that of [`FeedForward::of`](super::FeedForward::of) with the settings, to the bit.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let Settings { period_s, ramp_s, offset_slew_rad_per_s, torque_slew_nm_per_s, largest_rate_rad_per_s } =
            *settings;
        Self {
            period_s: S::from_f64(period_s),
            ramp_s: S::from_f64(ramp_s),
            offset_slew_rad_per_s: S::from_f64(offset_slew_rad_per_s),
            torque_slew_nm_per_s: S::from_f64(torque_slew_nm_per_s),
            largest_rate_rad_per_s: S::from_f64(largest_rate_rad_per_s),
        }
    }

    /// As [`Settings::steps`], for a scalar in SI units.
    pub(super) fn steps(&self, rated: S, torque_scale: S) -> Result<(Steps<S>, S), FeedForwardError> {
        let Self { period_s, ramp_s, offset_slew_rad_per_s, torque_slew_nm_per_s, largest_rate_rad_per_s } = *self;
        let finite = S::from_f64(S::LARGEST);
        for (setting, value, must_be_finite) in [
            ("period_s", period_s, true),
            ("ramp_s", ramp_s, true),
            ("offset_slew_rad_per_s", offset_slew_rad_per_s, false),
            ("torque_slew_nm_per_s", torque_slew_nm_per_s, false),
            ("largest_rate_rad_per_s", largest_rate_rad_per_s, false),
        ] {
            // A NaN compares false.
            if !(value > S::ZERO && (!must_be_finite || value <= finite)) {
                return Err(FeedForwardError::Limit { setting });
            }
        }
        let four = S::TWO + S::TWO;
        let step = |step: S, measure: S| step.clamp(S::from_f64(S::EPSILON) * measure, four * measure);
        let steps = Steps {
            gain: step(period_s.over(ramp_s), S::ONE),
            offset: step(offset_slew_rad_per_s * period_s, rated),
            torque: step(torque_slew_nm_per_s * period_s, torque_scale),
        };
        Ok((steps, (largest_rate_rad_per_s * period_s).min(S::from_f64(2.0 * S::REFUSED_BEYOND) * rated)))
    }
}

/// Why there is no feed-forward.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum FeedForwardError {
    /// A setting must be greater than zero, times finite.
    Setting {
        /// Its field in [`Settings`].
        setting: &'static str,
        /// What it was.
        value: f64,
    },
    /// One of [`Limits`] must be greater than zero, times finite.
    Limit {
        /// Its field.
        setting: &'static str,
    },
    /// The parameters have no inverse.
    Inverse(InverseError),
    /// The stored block has no inverse.
    NoInverse,
    /// The stored block was made for another control period, which its law `time` depends on.
    Period {
        /// That of the block, s; 0 where it states none.
        stored_s: f32,
    },
}

impl From<InverseError> for FeedForwardError {
    fn from(error: InverseError) -> Self {
        Self::Inverse(error)
    }
}

impl fmt::Display for FeedForwardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setting { setting, value } => {
                let finite = if setting.ends_with("_per_s") { "" } else { " and finite" };
                write!(f, "{setting} = {value} must be greater than zero{finite}")
            }
            Self::Limit { setting } => {
                let finite = if setting.ends_with("_per_s") { "" } else { " and finite" };
                write!(f, "{setting} must be greater than zero{finite}")
            }
            Self::Inverse(error) => error.fmt(f),
            Self::NoInverse => {
                f.write_str("the stored block has no inverse: make it by gmhm pack of a model that can be inverted")
            }
            Self::Period { stored_s } => {
                write!(f, "the stored block was made for a control period of {stored_s} s: set --period of gmhm pack")
            }
        }
    }
}

impl core::error::Error for FeedForwardError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Inverse(error) => Some(error),
            Self::Setting { .. } | Self::Limit { .. } | Self::NoInverse | Self::Period { .. } => None,
        }
    }
}

/// The most that each may change in a period, in the scalar's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Steps<S> {
    pub(super) gain: S,
    pub(super) offset: S,
    pub(super) torque: S,
}

impl Settings {
    /// What each may change, and the largest step of the measured deflection. A step that the scalar cannot tell from none counts as its spacing next to 1, that nothing stands still.
    pub(super) fn steps<S: Scalar>(
        &self,
        params: &Params,
        frame: &Frame<S>,
    ) -> Result<(Steps<S>, S), FeedForwardError> {
        let Self { period_s, ramp_s, offset_slew_rad_per_s, torque_slew_nm_per_s, largest_rate_rad_per_s } = *self;
        for (setting, value, most) in [
            ("period_s", period_s, f64::MAX),
            ("ramp_s", ramp_s, f64::MAX),
            ("offset_slew_rad_per_s", offset_slew_rad_per_s, f64::INFINITY),
            ("torque_slew_nm_per_s", torque_slew_nm_per_s, f64::INFINITY),
            ("largest_rate_rad_per_s", largest_rate_rad_per_s, f64::INFINITY),
        ] {
            // A NaN compares false.
            if !(value > 0.0 && value <= most) {
                return Err(FeedForwardError::Setting { setting, value });
            }
        }
        if S::SI {
            return Limits::of(self).steps(frame.rated(), frame.torque_scale());
        }
        let (a, scale) = (params.rated_deflection_rad(), params.torque_scale_nm());
        // Beyond ±4 of its measure no contribution can be.
        let step = |per_s: f64, measure: f64| S::from_f64((per_s * period_s / measure).clamp(S::EPSILON, 4.0));
        let steps = Steps {
            gain: step(1.0 / ramp_s, 1.0),
            offset: step(offset_slew_rad_per_s, a),
            torque: step(torque_slew_nm_per_s, scale),
        };
        // No gear is accepted as far apart as this.
        Ok((steps, S::from_f64((largest_rate_rad_per_s * period_s / a).min(2.0 * S::REFUSED_BEYOND))))
    }
}
