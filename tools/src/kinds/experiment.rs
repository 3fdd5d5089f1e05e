//! Bench tests that show effects.

/// A bench test, by the name that `gmhm simulate --experiment` knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Experiment {
    /// The motor runs while the brake load varies.
    Running,
    /// The load cycle at several rates.
    Rates,
    /// Load cycles at several amplitudes.
    Amplitudes,
    /// Load cycles with holds, cold and warm.
    Cycle,
    /// A band-limited load.
    Dynamic,
}

impl Experiment {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Running, Self::Rates, Self::Amplitudes, Self::Cycle, Self::Dynamic];

    /// Its name in `gmhm simulate --experiment`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Rates => "rates",
            Self::Amplitudes => "amplitudes",
            Self::Cycle => "cycle",
            Self::Dynamic => "dynamic",
        }
    }

    /// What to do.
    pub const fn instruction(self) -> &'static str {
        match self {
            Self::Running => {
                "let the motor run forth and back at several speeds while the brake load varies slowly, both angles recorded"
            }
            Self::Rates => "repeat the load cycle with the input locked at rates a decade apart",
            Self::Amplitudes => {
                "load and unload with the input locked at four amplitudes from a tenth of the rated torque up, small loops among them"
            }
            Self::Cycle => {
                "hold the load for minutes after each reversal, before and after warming the gear up, temperature recorded"
            }
            Self::Dynamic => "load the output with band-limited noise up to the control bandwidth",
        }
    }
}
