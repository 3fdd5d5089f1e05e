//! Recorded channels before anything is fitted: noise, counts, dropouts, clipping, units and signs.
//!
//! | file | what |
//! |---|---|
//! | [`dropouts`] | rows at which an angle sensor failed |
//! | [`clipping`] | sensors driven beyond their range |
//! | [`conversion`], [`plausible`] | units, signs, zeros, dead channels |
//! | `denoise`, [`counts`] | angles freed of noise; the motion behind a quantised deflection |
//! | [`acceleration`], [`recorded`] | the acceleration of a noisy motion; a noisy motion as a model sees it |

pub mod acceleration;
pub mod clipping;
pub mod conversion;
pub mod counts;
pub(crate) mod denoise;
pub mod dropouts;
pub mod encoder_zeros;
pub mod plausible;
pub mod recorded;
