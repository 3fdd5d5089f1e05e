//! Discovery: where recording and simulation differ, what physics was left out, and the fit with it.
//!
//! | file | what |
//! |---|---|
//! | [`pipeline`] | the whole, as `gmhm diagnose` writes it |
//! | [`diagnosis`], `findings` | the result, field for field as `--json`; a verdict in its terms |
//! | `base_search` | the search beside one base; the same gear with another law |
//! | `reduction` | fewer rows of long recordings |
//! | [`candidates`], `ranges` | every kind over a grid of shapes, as columns; what the recordings span |
//! | [`evidence`] | what a result rests on, as types |
//! | [`explain`] | every kind beside a fitted model, refitted together |
//! | [`mod@search`], `shapes` | forward, with swaps, and backward; the shapes of what was found |
//! | [`nonparametric`], `tones`, `jumps` | curves without physics over every coordinate; tones; jumps |
//! | `curve_term`, `curves_in_place` | such a curve as a term of a model; in the place of a kind that only comes close |
//! | [`naming`], `shares` | classes of indistinguishable kinds, names, shares of power |
//! | [`selection`], [`joint_naming`] | joint selection of kinds by held-out error, and its verdicts |
//! | `decision` | which of the two searches is believed |
//! | `doubt` | when likelihood speaks against the names of a selection |
//! | `equivalents` | the class of a named kind by likelihood |
//! | `established` | the name withdrawn of an effect whose size is within its uncertainty of zero |
//! | `hidden_pair` | two kinds that hide each other |
//! | `locked_input` | friction of the output that is a memory of the deflection |
//! | `one_speed` | friction seen at one speed: the kind that does not rise with it |
//! | `similar_kinds` | the name withheld of an effect that changes with what its kind does not know |
//! | `soft_edges` | what a soft edge adds to the uncertainty of a gap |
//! | `other_shapes` | the likeliest shape of what was found, and what the others add to its uncertainty |
//! | `unchanged` | numbers of the base that stay as given |
//! | [`next_experiment`] | what could not have been seen, and the experiment that would show it |
//! | [`report_data`] | what a report shows |

mod alike_waves;
mod base_search;
mod cancelling_waves;
pub mod candidates;
mod confirmation;
mod curve_term;
mod curves_in_place;
mod decision;
pub mod diagnosis;
mod doubt;
mod equivalents;
mod established;
pub mod evidence;
pub mod explain;
mod findings;
mod hidden_pair;
mod included;
pub mod joint_naming;
pub(crate) mod jumps;
mod locked_input;
pub mod naming;
pub mod next_experiment;
pub mod nonparametric;
mod one_speed;
mod other_shapes;
pub(crate) mod past;
pub mod pipeline;
pub(crate) mod ranges;
mod reduction;
pub mod report_data;
pub mod search;
pub mod selection;
pub(crate) mod shapes;
pub(crate) mod shares;
mod similar_kinds;
mod soft_edges;
pub mod suggestion;
pub(crate) mod tones;
mod unchanged;
mod unnamed_rest;

pub use crate::diagnose::pipeline::{Finding, Options, diagnose};

use crate::physics::PredictError;
use crate::regression::error::EstimateError;
use crate::signal::plausible::Implausible;

/// Why nothing was diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// Recordings and model cannot be of one gear.
    #[error(transparent)]
    Implausible(#[from] Implausible),
    /// The recordings cannot be prepared, or the model not be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// The caller asked for it.
    #[error("stopped before the diagnosis was done; nothing was written")]
    Cancelled,
}

impl From<PredictError> for DiagnoseError {
    fn from(error: PredictError) -> Self {
        Self::Estimate(error.into())
    }
}
