//! What a command does between reading its recordings and writing its results. The command line and the Python package call the same.
//!
//! | file | what |
//! |---|---|
//! | [`ready`] | a recording before it is identified from: ratio, deflection, dropouts |
//! | [`fit`] | `gmhm fit` |
//! | [`diagnose`] | `gmhm diagnose` |
//! | [`predict`] | `gmhm predict`, `gmhm invert` |

pub mod diagnose;
pub mod fit;
pub mod predict;
pub mod ready;

/// Receives what is worth knowing and no failure, one sentence a call.
pub type Notes<'a> = &'a mut dyn FnMut(&str);
