//! What there is to say of a parameter beside its value; `report::note_words` says it in words.

/// What there is to say of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Note {
    /// It was given, not fitted.
    Given,
    /// It was given, or is the middle of the deflections seen.
    GivenOrMiddle,
    /// It was searched, and what it was searched by has no derivative.
    Searched,
    /// It is at its bound.
    AtBound,
    /// It is at its bound 0.
    NoEffect {
        /// Two standard deviations without the bound, in its unit.
        upper_limit: Option<f64>,
    },
    /// A rate-independent loop leaves it open.
    RateIndependent {
        /// Whether e and h are fixed; else α is.
        fixes_e_and_h: bool,
    },
    /// The recordings do not determine it by itself.
    Open(Option<Remedy>),
    /// Its standard deviation is more than half its value.
    Vague {
        /// Standard deviation over value.
        relative: f64,
        /// What would determine it.
        remedy: Option<Remedy>,
    },
}

/// Recordings that would determine a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// The same stroke at several rates.
    Rates,
    /// Cycles at several amplitudes.
    Amplitudes,
    /// A joint that moves through its range.
    JointMotion,
}

impl Note {
    /// What would determine the parameter.
    pub fn remedy(&self) -> Option<Remedy> {
        match self {
            Self::Open(remedy) | Self::Vague { remedy, .. } => *remedy,
            _ => None,
        }
    }
}
