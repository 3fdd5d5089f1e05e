//! An effect that `--hide` asks for.

use std::fmt;
use std::str::FromStr;

use crate::kinds;
use crate::number::number;

/// An effect to be hidden: `KIND=SIZE` or `KIND:SHAPE=SIZE`.
#[derive(Debug, Clone, PartialEq)]
pub struct Hide {
    /// The kind of term.
    pub kind: String,
    /// Its shape; drawn from the seed where none is given.
    pub shape: Option<String>,
    /// Rms that it leaves after the base model is refitted, N·m.
    pub size_nm: f64,
}

/// Why an effect was not hidden.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HideError {
    /// Not of the form KIND=SIZE.
    #[error("hide {0:?}: write KIND=SIZE or KIND:SHAPE=SIZE, such as kinematic_error=0.15")]
    Form(String),
    /// A size that cannot be.
    #[error("hide {0:?}: the size must be a number of N·m greater than 0")]
    Size(String),
    /// No such kind.
    #[error("hide {}: no such kind of effect; known are {}", .0, gmhm::terms::KINDS.iter().map(|k| k.name).collect::<Vec<_>>().join(", "))]
    Kind(String),
    /// No such shape.
    #[error("hide {kind}:{shape}: no such shape; {}", if known.is_empty() { "this kind has none".to_owned() } else { format!("known are {}", known.join(", ")) })]
    Shape {
        /// The kind.
        kind: String,
        /// What was asked for.
        shape: String,
        /// What there is.
        known: Vec<&'static str>,
    },
    /// Nothing of it is left.
    #[error(
        "hide {0}: invisible in this experiment, the base model takes it up or nothing moves it; choose another experiment"
    )]
    Invisible(String),
    /// It cannot be made so large.
    #[error(
        "hide {kind}: at most {} N·m of it can be hidden in this experiment, not {size_nm}: choose a smaller size or another experiment",
        number(*largest_nm, 3)
    )]
    TooLarge {
        /// The kind.
        kind: String,
        /// What was asked for, N·m.
        size_nm: f64,
        /// What can be had, N·m.
        largest_nm: f64,
    },
}

/// A hidden effect as the key tells it. Its parameters are those of its term in the truth.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Hidden {
    /// Its kind.
    pub kind: String,
    /// Rms that it leaves after the base model is refitted, N·m.
    pub size_nm: f64,
    /// Rms of its torque before that, N·m.
    pub before_nm: f64,
}

impl FromStr for Hide {
    type Err = HideError;

    fn from_str(text: &str) -> Result<Self, HideError> {
        let (name, size) = text.split_once('=').ok_or_else(|| HideError::Form(text.to_owned()))?;
        let (kind, shape) = match name.split_once(':') {
            Some((kind, shape)) => (kind.trim(), Some(shape.trim().to_owned())),
            None => (name.trim(), None),
        };
        let size_nm = size.trim().parse().ok().filter(|x: &f64| *x > 0.0 && x.is_finite());
        let hide =
            Self { kind: kind.to_owned(), shape, size_nm: size_nm.ok_or_else(|| HideError::Size(text.to_owned()))? };
        let known = kinds::of(kind).ok_or_else(|| HideError::Kind(hide.kind.clone()))?.hidden_shapes();
        match &hide.shape {
            Some(shape) if !known.contains(&shape.as_str()) => {
                Err(HideError::Shape { kind: hide.kind.clone(), shape: shape.clone(), known: known.to_vec() })
            }
            _ => Ok(hide),
        }
    }
}

/// As `--hide` reads it back.
impl fmt::Display for Hide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.kind)?;
        if let Some(shape) = &self.shape {
            write!(f, ":{shape}")?;
        }
        write!(f, "={:?}", self.size_nm)
    }
}
