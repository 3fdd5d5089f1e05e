//! What an adaptation warns of, latched until it is cleared.

/// A warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[repr(u8)]
pub enum Warning {
    /// The torque was not a finite number.
    NotANumber = 0,
    /// Samples lay far off their neighbours: more than ten a second in a stretch, or some in several stretches.
    Spikes = 1,
    /// The torque followed the deflection with a gain that no admitted coefficients have: a dead signal, another sign, another unit.
    Dead = 2,
    /// A stretch fitted no coefficients at all: the signal jumped, or its noise grew.
    Disturbed = 3,
    /// The torque comes later, or earlier, than the deflection by more than 0.5 ms.
    Delay = 4,
    /// The torque is off by more than 0.5 % of the rated torque.
    Offset = 5,
    /// The common factor of the coefficients changed by more than 3 %: another torque scale, or another gear. The two cannot be distinguished.
    ScaleOrGear = 6,
    /// The elastic torque at the rated deflection changed by more than 5 %.
    Stiffness = 7,
    /// h changed by more than 10 %.
    Hysteresis = 8,
    /// e changed by more than 5 % of the rated torque over A.
    SingleValued = 9,
    /// Lost motion changed by more than 10 %.
    LostMotion = 10,
    /// A bound holds back what was taken over.
    Bound = 11,
}

impl Warning {
    /// All, by their number.
    pub const ALL: [Self; 12] = [
        Self::NotANumber,
        Self::Spikes,
        Self::Dead,
        Self::Disturbed,
        Self::Delay,
        Self::Offset,
        Self::ScaleOrGear,
        Self::Stiffness,
        Self::Hysteresis,
        Self::SingleValued,
        Self::LostMotion,
        Self::Bound,
    ];

    /// Its words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotANumber => "torque not a number",
            Self::Spikes => "torque spikes",
            Self::Dead => "torque dead or of another gain",
            Self::Disturbed => "torque disturbed",
            Self::Delay => "torque delayed",
            Self::Offset => "torque offset",
            Self::ScaleOrGear => "torque scale or gear",
            Self::Stiffness => "stiffness drifted",
            Self::Hysteresis => "hysteresis drifted",
            Self::SingleValued => "single-valued hysteresis drifted",
            Self::LostMotion => "lost motion drifted",
            Self::Bound => "adaptation at its bound",
        }
    }
}

/// Warnings since they were cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Warnings(u16);

impl Warnings {
    /// None.
    pub(super) const NONE: Self = Self(0);

    /// Latches a warning if it happened.
    #[inline]
    pub(super) fn latch(&mut self, happened: bool, warning: Warning) {
        if happened {
            self.0 |= 1 << warning as u8;
        }
    }

    /// Latches others.
    #[inline]
    pub(super) fn add(&mut self, others: Self) {
        self.0 |= others.0;
    }

    /// Latches the warning of a [quantity](super::health): those follow one another from [`Warning::Delay`] on.
    #[inline]
    pub(super) fn latch_quantity(&mut self, happened: bool, number: usize) {
        if happened {
            self.0 |= 1 << (Warning::Delay as usize + number);
        }
    }

    /// Whether a warning is latched.
    #[must_use]
    pub const fn has(self, warning: Warning) -> bool {
        self.0 & (1 << warning as u8) != 0
    }

    /// Bit n is warning number n.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The latched ones.
    pub fn iter(self) -> impl Iterator<Item = Warning> {
        Warning::ALL.into_iter().filter(move |warning| self.has(*warning))
    }
}
