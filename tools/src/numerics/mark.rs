//! What a row of a series is used for.

/// What a row is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum Mark {
    /// It counts.
    #[default]
    Used,
    /// It counts, and the noise before it is of no concern to it: a gap in time lies between.
    First,
    /// The memory passes through it, but its torque does not count.
    Skipped,
    /// Its torque is an outlier and does not count.
    Outlier,
}

impl Mark {
    /// Whether the torque of the row counts.
    pub fn counts(self) -> bool {
        matches!(self, Mark::Used | Mark::First)
    }
}
