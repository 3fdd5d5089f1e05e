//! What there is to know of a kind of term before it has numbers: the source of checks, docs, parameter blocks and the search for missing physics.

use core::cmp::Ordering;

use crate::scalar::Float;

/// Whether a term is physics of the gear or a fault of the measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Side {
    /// Physics: compensated on the drive.
    Plant,
    /// A fault of the measurement, or structure without a name: corrects the fit, is never fed forward.
    Instrument,
}

/// What a term acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Domain {
    /// The deflection: taken out of the measured one before the gear sees it.
    Deflection,
    /// The torque.
    Torque,
    /// The torque, and T_base of a joint log, which has no gear: gravity and inertia.
    Load,
    /// The torque, as friction that a temperature scales.
    Friction,
    /// A factor on all friction.
    FrictionScale,
    /// The time of the total torque.
    Delay,
}

/// What the structure of a residual may depend on (MODEL.md section 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Coordinate {
    /// q_m.
    MotorAngle,
    /// q_o.
    OutputAngle,
    /// v.
    OutputVelocity,
    /// T_base.
    Torque,
    /// dT_base/dt.
    TorqueRate,
    /// θ̇.
    DeflectionRate,
    /// v̇.
    Acceleration,
    /// θ.
    Deflection,
    /// Travel since the last reversal of θ.
    Reversal,
    /// Θ.
    Temperature,
    /// t.
    Time,
}

/// A signal that a term cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Need {
    /// q_m.
    MotorAngle,
    /// q_o.
    OutputAngle,
    /// v.
    Velocity,
    /// v̇.
    Acceleration,
    /// θ.
    Deflection,
    /// θ̇.
    DeflectionRate,
    /// Θ.
    Temperature,
    /// The elastic and hysteresis torque of a gear.
    Gear,
    /// q̇_m.
    MotorVelocity,
    /// q̇_o.
    OutputVelocity,
    /// T_sim, another simulator's torque.
    SimulatedTorque,
}

/// What a key holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Form {
    /// A number.
    Number,
    /// A list of at most so many numbers, as long as the other lists of its term.
    List {
        /// The most it may hold.
        most: usize,
    },
    /// One of these words.
    Choice(&'static [&'static str]),
}

/// Which numbers a key accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Range {
    /// Any finite number.
    Any,
    /// 0 and above.
    AtLeastZero,
    /// Above 0.
    Positive,
    /// Above 0, at most 1.
    Fraction,
    /// 0 to 1.
    Share,
    /// ±8: normalised coefficients are of order 1.
    Normalised,
    /// 0 to 8.
    NormalisedSize,
    /// 1e-12 to 1e12: what others are divided by.
    Measure,
    /// Any but 0.
    NotZero,
    /// Above 1.
    AboveOne,
}

impl Range {
    /// Whether a number lies within it; NaN and infinities never do. In integers: drives check the doubles of a block without arithmetic in double precision.
    #[must_use]
    pub fn holds(self, x: f64) -> bool {
        // Ordered as the numbers are, both zeros as one; what is not finite lies beyond the largest.
        let place = |x: f64| {
            let size = (x.to_bits() & (u64::MAX >> 1)).cast_signed();
            if x.is_sign_negative() { -size } else { size }
        };
        let x = place(x);
        x.abs() <= place(f64::MAX) && self.is_met(|limit| x.cmp(&place(limit)))
    }

    /// [`holds`](Self::holds) in the precision of a drive.
    pub(crate) fn holds_in<S: Float>(self, x: S) -> bool {
        let order = |limit| x.partial_cmp(&S::from_f64(limit)).unwrap_or(Ordering::Less);
        x.is_finite() && self.is_met(order)
    }

    /// Whether a finite number lies within it, by its order with a limit.
    #[inline(always)]
    fn is_met(self, order: impl Fn(f64) -> Ordering) -> bool {
        let within = |low, high| order(low).is_ge() && order(high).is_le();
        match self {
            Self::Any => true,
            Self::AtLeastZero => order(0.0).is_ge(),
            Self::Positive => order(0.0).is_gt(),
            Self::Fraction => order(0.0).is_gt() && order(1.0).is_le(),
            Self::Share => within(0.0, 1.0),
            Self::Normalised => within(-8.0, 8.0),
            Self::NormalisedSize => within(0.0, 8.0),
            Self::Measure => within(1e-12, 1e12),
            Self::NotZero => order(0.0).is_ne(),
            Self::AboveOne => order(1.0).is_gt(),
        }
    }

    /// Nothing below this lies within it.
    #[must_use]
    pub const fn lowest(self) -> f64 {
        match self {
            Self::Any | Self::NotZero => f64::NEG_INFINITY,
            Self::Normalised => -8.0,
            Self::AtLeastZero | Self::Positive | Self::Fraction | Self::Share | Self::NormalisedSize => 0.0,
            Self::Measure => 1e-12,
            Self::AboveOne => 1.0,
        }
    }

    /// What it takes, in words: "must be …".
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Any => "finite",
            Self::AtLeastZero => "zero or greater",
            Self::Positive => "greater than zero",
            Self::Fraction => "greater than 0 and at most 1",
            Self::Share => "between 0 and 1",
            Self::Normalised => "between -8 and 8",
            Self::NormalisedSize => "between 0 and 8",
            Self::Measure => "between 1e-12 and 1e12",
            Self::NotZero => "another number than zero",
            Self::AboveOne => "greater than one",
        }
    }
}

/// What a key is to an estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Role {
    /// The torque (or the deflection that the term takes out) is proportional to it, or a sum over such keys.
    Linear,
    /// It shapes the response.
    Nonlinear,
    /// It is decided, not fitted: a choice, harmonic orders, a reference.
    Structure,
}

/// A key of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct KeyInfo {
    /// Its name in model files, with its unit.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it holds.
    pub form: Form,
    /// Which numbers it accepts.
    pub range: Range,
    /// What it is to an estimator.
    pub role: Role,
    /// Whether it may be left out, and is [`absent`](Self::absent) then.
    pub optional: bool,
    /// What it is where it is left out: a number, or the number of a word. 0 unless stated.
    pub absent: f32,
    /// Whether its kind has got it since the first format of blocks: a record ends before it where it is what it is when left out.
    pub appended: bool,
    /// The shapes that have it; all where empty.
    pub shapes: &'static [&'static str],
    /// From where to where it lies on gears of size 20 to 32.
    pub plausible: (f64, f64),
    /// What it is, in words.
    pub words: &'static str,
}

impl KeyInfo {
    const fn new(name: &'static str, unit: &'static str, form: Form, role: Role, words: &'static str) -> Self {
        let plausible = (0.0, 0.0);
        let (range, shapes) = (Range::Any, &[]);
        Self { name, unit, form, range, role, optional: false, absent: 0.0, appended: false, shapes, plausible, words }
    }

    /// A number that the response is proportional to.
    #[must_use]
    pub const fn linear(name: &'static str, unit: &'static str, words: &'static str) -> Self {
        Self::new(name, unit, Form::Number, Role::Linear, words)
    }

    /// A list of such numbers.
    #[must_use]
    pub const fn linear_list(name: &'static str, unit: &'static str, most: usize, words: &'static str) -> Self {
        Self::new(name, unit, Form::List { most }, Role::Linear, words)
    }

    /// A number that shapes the response.
    #[must_use]
    pub const fn shape(name: &'static str, unit: &'static str, words: &'static str) -> Self {
        Self::new(name, unit, Form::Number, Role::Nonlinear, words)
    }

    /// A list of such numbers.
    #[must_use]
    pub const fn shape_list(name: &'static str, unit: &'static str, most: usize, words: &'static str) -> Self {
        Self::new(name, unit, Form::List { most }, Role::Nonlinear, words)
    }

    /// One of some words.
    #[must_use]
    pub const fn choice(name: &'static str, words_accepted: &'static [&'static str], words: &'static str) -> Self {
        Self::new(name, "", Form::Choice(words_accepted), Role::Structure, words)
    }

    /// Only within a range.
    #[must_use]
    pub const fn within_range(mut self, range: Range) -> Self {
        self.range = range;
        self
    }

    /// Decided beforehand.
    #[must_use]
    pub const fn decided(mut self) -> Self {
        self.role = Role::Structure;
        self
    }

    /// Only 0 and above.
    #[must_use]
    pub const fn at_least_zero(mut self) -> Self {
        self.range = Range::AtLeastZero;
        self
    }

    /// Only above 0.
    #[must_use]
    pub const fn positive(mut self) -> Self {
        self.range = Range::Positive;
        self
    }

    /// May be left out.
    #[must_use]
    pub const fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// May be left out, and is so much then. Its kind has got it since the first format of blocks.
    #[must_use]
    pub const fn appended(mut self, absent: f32) -> Self {
        (self.optional, self.appended, self.absent) = (true, true, absent);
        self
    }

    /// Only for these shapes.
    #[must_use]
    pub const fn of_shapes(mut self, shapes: &'static [&'static str]) -> Self {
        self.shapes = shapes;
        self
    }

    /// Where it usually lies.
    #[must_use]
    pub const fn within(mut self, low: f64, high: f64) -> Self {
        self.plausible = (low, high);
        self
    }

    /// Whether a term of this shape has the key. A shape that is none has all.
    #[must_use]
    pub fn belongs_to(&self, shape: Option<&str>) -> bool {
        match shape {
            Some(shape) if !self.shapes.is_empty() => {
                let mut shapes = self.shapes.iter();
                shapes.any(|s| *s == shape)
            }
            _ => true,
        }
    }
}

/// A kind of term.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct KindInfo {
    /// Its name in model files.
    pub name: &'static str,
    /// Plant or instrument.
    pub side: Side,
    /// What it acts on.
    pub domain: Domain,
    /// Its equation.
    pub equation: &'static str,
    /// The coordinates in which it shows.
    pub coordinates: &'static [Coordinate],
    /// Signals that it cannot do without, whatever its choices.
    pub needs: &'static [Need],
    /// Its keys, in the order of parameter blocks.
    pub keys: &'static [KeyInfo],
    /// Kinds and parameters that it hides behind.
    pub hides_behind: &'static str,
    /// Instructions that its most expensive shape adds to a sample in `f32` on a Cortex-M4F, with lists of two: counted and kept by `cargo xtask cost`.
    pub instructions: u32,
}

impl KindInfo {
    /// The key of this name.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&'static KeyInfo> {
        self.keys.iter().find(|key| key.name == name)
    }
}

impl KindInfo {
    /// Whether its torque follows the deflection or its rate, and so is one of the gear itself.
    #[must_use]
    pub const fn is_of_gear(&self) -> bool {
        let (mut needs, mut follows) = (self.needs, false);
        // A `for` cannot run at compile time.
        while let [need, rest @ ..] = needs {
            follows |= matches!(need, Need::Deflection | Need::DeflectionRate);
            needs = rest;
        }
        follows && matches!(self.domain, Domain::Torque)
    }
}

impl Need {
    /// What it is, in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::MotorAngle => "the motor angle",
            Self::OutputAngle => "the output angle",
            Self::Velocity => "the output velocity",
            Self::Acceleration => "the output acceleration",
            Self::Deflection => "the deflection",
            Self::DeflectionRate => "the rate of the deflection",
            Self::Temperature => "the temperature",
            Self::Gear => "the gear's [elastic] and [memory]",
            Self::MotorVelocity => "the motor velocity",
            Self::OutputVelocity => "the velocity of the output itself",
            Self::SimulatedTorque => "the simulated torque",
        }
    }
}

impl Coordinate {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::MotorAngle,
        Self::OutputAngle,
        Self::OutputVelocity,
        Self::Torque,
        Self::TorqueRate,
        Self::DeflectionRate,
        Self::Acceleration,
        Self::Deflection,
        Self::Reversal,
        Self::Temperature,
        Self::Time,
    ];

    /// Their names, in the order of [`ALL`](Self::ALL).
    pub const NAMES: [&str; 11] = [
        "motor_angle",
        "output_angle",
        "output_velocity",
        "torque",
        "torque_rate",
        "deflection_rate",
        "acceleration",
        "deflection",
        "reversal",
        "temperature",
        "time",
    ];

    /// Its name in model files and diagnoses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The signals that tell it.
    #[must_use]
    pub const fn needs(self) -> &'static [Need] {
        match self {
            Self::MotorAngle => &[Need::MotorAngle],
            Self::OutputAngle => &[Need::OutputAngle],
            Self::OutputVelocity => &[Need::Velocity],
            Self::Torque | Self::TorqueRate => &[],
            Self::DeflectionRate => &[Need::DeflectionRate],
            Self::Acceleration => &[Need::Acceleration],
            Self::Deflection | Self::Reversal => &[Need::Deflection],
            Self::Temperature => &[Need::Temperature],
            Self::Time => &[],
        }
    }
}
