//! Kinds of effects: what each may look like in recordings.
//!
//! | file | what |
//! |---|---|
//! | [`library`], `candidate_grid` | candidates as columns over a grid of shapes |
//! | `properties` | what makes a term of its kind, beyond its equation |
//! | `ranges` | what the recordings span |

pub(crate) mod candidate_grid;
pub mod library;
pub(crate) mod properties;
pub(crate) mod ranges;
