//! Rated deflection and torque scale of a gear.

use super::error::BlockError;
use super::joint::single;
use super::layout::GEAR;
use super::prepared::words;
use super::record::{Block, double};
use crate::params::Params;
use crate::scalar::Extended;

/// A and T_A in SI units, also where samples enter as fractions of them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scales {
    /// A, rad.
    pub rated_deflection_rad: f64,
    /// T_A, N·m.
    pub torque_scale_nm: f64,
}

impl Scales {
    /// Those of parameters.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        Self { rated_deflection_rad: params.rated_deflection_rad(), torque_scale_nm: params.torque_scale_nm() }
    }
}

/// [`Scales`] as a block holds them: a drive reads what it needs of them without arithmetic in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ScalesRecord([u32; 4]);

impl ScalesRecord {
    /// Those of a block, its words as they are.
    ///
    /// # Errors
    /// [`BlockError`]: no gear, two, or a record of another length.
    pub fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        let [a0, a1, t0, t1, ..] = words::<7>(block, GEAR.tag)?;
        Ok(Self([a0, a1, t0, t1]))
    }

    /// What they say, in double precision.
    #[must_use]
    pub fn scales(&self) -> Scales {
        let [a0, a1, t0, t1] = self.0;
        let [rated_deflection_rad, torque_scale_nm] = [[a0, a1], [t0, t1]].map(double);
        Scales { rated_deflection_rad, torque_scale_nm }
    }

    /// [`Scales::rated_deflection_rad`], rounded.
    #[must_use]
    pub fn rated_deflection_rad(&self) -> f32 {
        let [low, high, ..] = self.0;
        single([low, high])
    }

    /// k1·T_A/A, rounded; 0 where one of them is not finite.
    pub(super) fn stiffness_nm_per_rad(&self, k1: f32) -> f32 {
        let [a0, a1, t0, t1] = self.0;
        let [rated, scale] = [[a0, a1], [t0, t1]].map(double).map(Extended::of_double);
        let size =
            rated.zip(scale).zip(Extended::of_single(k1)).map(|((rated, scale), k1)| k1.times(scale).over(rated));
        size.map_or(0.0, Extended::single).copysign(k1)
    }

    /// [`Scales::torque_scale_nm`], rounded.
    #[must_use]
    pub fn torque_scale_nm(&self) -> f32 {
        let [.., low, high] = self.0;
        single([low, high])
    }
}
