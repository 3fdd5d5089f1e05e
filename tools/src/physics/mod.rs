//! Base model and terms over whole recordings, by the core's own code in `f64`.
//!
//! | file | what |
//! |---|---|
//! | [`signals`] | what the terms may see of a recording, derived once |
//! | [`term`] | terms of model files as terms of the core |
//! | [`evaluate`] | one pass of the gear, one of the terms |
//! | [`predict`](mod@predict) | the columns of `gmhm predict` |
//! | [`invert`] | the deflection for a torque |
//! | [`columns`] | what a term would add to a model, per linear parameter |
//!
//! No equation stands here: all of them are those of `gmhm::terms`.

pub mod columns;
mod error;
pub mod evaluate;
pub mod invert;
pub mod predict;
pub mod signals;
pub mod term;

pub use columns::{Evaluation, Parts, UnitColumn};
pub use error::PredictError;
pub use evaluate::CAPACITY;
pub use predict::{Prediction, predict};
pub use signals::Signals;
