//! A model as source that needs no Rust: C99, and a co-simulation unit around it.
//!
//! The equations stand in `templates/export`, once for all models: the laws, the search of the inverse, one file a kind of term. They are a second text of the
//! core's, so tests compile and run what is exported beside the core, for every law and every kind. The numbers are the core's own, normalised and rounded as on a drive.
//!
//! | file | what |
//! |---|---|
//! | `plan` | what of a model is exported: gear, inverse, plant terms, the signals that they need |
//! | `numbers` | the coefficients of law and inverse, from the core |
//! | `terms` | structures, values and calls of the terms |
//! | `kinds` | the source of each kind |
//! | [`source`] | header and source |
//! | [`fmu`], `description`, `archive` | the co-simulation unit around the source |
//! | [`self_test`] | golden samples, and the core beside an export |
//! | `template` | slots, helpers, names and precision |

mod archive;
mod description;
mod error;
pub mod fmu;
mod kinds;
mod numbers;
mod plan;
pub mod self_test;
pub mod source;
mod template;
mod terms;

pub use error::ExportError;
pub use plan::Precision;

use crate::report::page::Input;

/// How a model is exported.
#[derive(Debug, Clone)]
pub struct ExportOptions {
    /// What the source computes in.
    pub precision: Precision,
    /// What every name begins with; by default the model's name.
    pub prefix: Option<String>,
    /// The longest sample period, s; law `time` needs it.
    pub period_s: Option<f64>,
    /// A instead of the model's, rad.
    pub rated_deflection_rad: Option<f64>,
    /// Turning points that a joint remembers, even, 4 or more.
    pub turning_points: u16,
    /// Whether golden samples and a `main` that checks them are made, too.
    pub self_test: bool,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self {
            precision: Precision::F32,
            prefix: None,
            period_s: None,
            rated_deflection_rad: None,
            turning_points: 16,
            self_test: false,
        }
    }
}

/// Files of an export, and what they leave out.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// Names and texts.
    pub files: Vec<(String, String)>,
    /// What every name begins with.
    pub prefix: String,
    /// The fields of a sample, in order.
    pub sample: Vec<&'static str>,
    /// Why there is no inverse, where there is none.
    pub without_inverse: Option<String>,
    /// Kinds of the model's terms that are faults of the measurement, and left out.
    pub left_out: Vec<String>,
}

/// What a model comes from.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// The name of its file.
    pub file: String,
    /// SHA-256 of the file, in hexadecimal digits.
    pub sha256: String,
}

impl From<&Input> for Origin {
    fn from(input: &Input) -> Self {
        let file = std::path::Path::new(&input.name).file_name();
        Self {
            file: file.map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            sha256: input.sha256.clone(),
        }
    }
}
