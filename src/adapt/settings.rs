//! What an adaptation is set to.

use core::fmt;

use crate::params::Law;
use crate::scalar::Float;

/// Settings of an [`Adaptation`](super::Adaptation): in `f64`, or in its scalar for [`Adaptation::of_gear`](super::Adaptation::of_gear).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings<S = f64> {
    /// Δ, the control period, s.
    pub period_s: S,
    /// How far a coefficient may drift within a stretch, standard deviation as a share of the torque scale: what forgetting is measured by. 0: nothing is forgotten.
    pub drift: S,
    /// The most that a coefficient, and their common factor, may depart from the block's: share of the block's torque at the rated deflection.
    pub largest_change: S,
    /// False-acceptance rate of the sequential test: at most this many takeovers a stretch while the parameters in force are the truth.
    pub false_acceptance: S,
}

impl<S: Float> Default for Settings<S> {
    /// 1 kHz, 0.1 % of the rated torque a stretch, a quarter of it in all, one takeover in a million stretches.
    fn default() -> Self {
        Settings { period_s: 1e-3, drift: 1e-3, largest_change: 0.25, false_acceptance: 1e-6 }.cast()
    }
}

/// Why there is no adaptation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum AdaptError {
    /// A setting lies outside its range.
    Setting {
        /// Its field in [`Settings`].
        setting: &'static str,
        /// What it was, rounded.
        value: f32,
        /// What is accepted.
        accepted: &'static str,
    },
    /// The law is not linear in five coefficients given the path.
    Law(Law),
}

impl fmt::Display for AdaptError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setting { setting, value, accepted } => write!(f, "{setting} = {value} must be {accepted}"),
            Self::Law(law) => write!(
                f,
                "law {} cannot be adapted on the drive: only law masing is linear in its coefficients given the path; fit the gear with law = \"masing\"",
                law.name()
            ),
        }
    }
}

impl core::error::Error for AdaptError {}

impl<S: Float> Settings<S> {
    /// Rounded to another scalar.
    #[must_use]
    pub fn cast<R: Float>(&self) -> Settings<R> {
        let Self { period_s, drift, largest_change, false_acceptance } = *self;
        let [period_s, drift, largest_change, false_acceptance] =
            [period_s, drift, largest_change, false_acceptance].map(|x| R::from_f64(x.to_f64()));
        Settings { period_s, drift, largest_change, false_acceptance }
    }

    /// # Errors
    /// The first setting outside its range.
    pub(super) fn check(&self) -> Result<(), AdaptError> {
        let Self { period_s, drift, largest_change, false_acceptance } = *self;
        let within = |x: S, least: f64, most: f64| x >= S::from_f64(least) && x <= S::from_f64(most);
        for (setting, value, within, accepted) in [
            ("period_s", period_s, period_s > S::ZERO && period_s <= S::ONE, "above 0 and at most 1 s"),
            ("drift", drift, within(drift, 0.0, 0.1), "between 0 and 0.1"),
            (
                "largest_change",
                largest_change,
                largest_change > S::ZERO && largest_change <= S::HALF,
                "above 0 and at most 0.5",
            ),
            ("false_acceptance", false_acceptance, within(false_acceptance, 1e-12, 0.1), "between 1e-12 and 0.1"),
        ] {
            // A NaN compares false.
            if !within {
                return Err(AdaptError::Setting { setting, value: value.to_f64() as f32, accepted });
            }
        }
        Ok(())
    }
}
