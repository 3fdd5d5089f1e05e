//! Regression: models fitted to recordings against coloured noise, with standard deviations.
//!
//! | file | what |
//! |---|---|
//! | [`columns`], [`base`], [`assembly`], [`ready`] | contributions to the torque as columns; the base model as such |
//! | [`problem`], [`factors`], [`polish`] | one pass over the recordings, its triangular factors, the descent |
//! | [`likelihood`], [`heldout`], `heldout_rows` | likelihood and held-out error |
//! | [`uncertainty`], [`note`], `spread`, `changes` | standard deviations, and what the recordings cannot determine |
//! | `disturbed_rows` | rows near standstill that show only the noise of the velocity |
//! | [`dataset`], [`parameters`], [`variable_projection`], [`fit`] | models with terms: recordings, free parameters, descent, fit |

pub mod assembly;
pub mod base;
pub(crate) mod changes;
pub mod columns;
pub(crate) mod count_errors;
pub mod dataset;
pub mod deflection_zeros;
pub(crate) mod disturbed_rows;
pub mod error;
pub mod factors;
pub mod fit;
pub mod heldout;
pub(crate) mod heldout_rows;
pub mod likelihood;
pub mod model_part;
pub mod note;
pub mod parameters;
pub mod polish;
pub mod problem;
pub mod ready;
pub mod rows;
pub(crate) mod spread;
pub mod uncertainty;
pub mod variable_projection;
