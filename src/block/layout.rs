//! The registry of the fixed records: for each field its name, unit, range and words.
//!
//! The records of terms follow from [`KINDS`](crate::terms::KINDS) instead.

use core::ops::RangeInclusive;

use crate::registry::{GATES, KERNELS, SIDES};
use crate::terms::{Form, KeyInfo, Range};

/// Set in the tag of a record that a reader may skip if it does not know it.
pub const MAY_SKIP: u16 = 0x8000;
/// The tag of a term is this plus the number of its kind.
pub const FIRST_TERM: u16 = 0x0100;
/// The tags that are kept for terms.
pub const TERM_TAGS: RangeInclusive<u16> = FIRST_TERM..=FIRST_TERM + 0xFF;

/// How a field is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Coding {
    /// A word of the block's scalar.
    Scalar,
    /// A gain of the block's scalar: two words.
    Gain,
    /// IEEE 754 double precision, whatever the scalar: two words, the lower first.
    Double,
    /// The number of one of the key's choices, counted from 0.
    Choice,
}

impl Coding {
    /// How many 32-bit words it takes.
    #[must_use]
    pub const fn words(self) -> usize {
        if matches!(self, Self::Gain | Self::Double) { 2 } else { 1 }
    }
}

/// A field of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct FieldInfo {
    /// Name, unit, range and words.
    pub key: KeyInfo,
    /// How it is stored.
    pub coding: Coding,
}

/// A record of fixed layout.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RecordInfo {
    /// Its tag.
    pub tag: u16,
    /// Its name.
    pub name: &'static str,
    /// Its fields in order.
    pub fields: &'static [FieldInfo],
    /// What it is for, in words.
    pub words: &'static str,
}

impl RecordInfo {
    /// How many 32-bit words it takes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.fields.iter().map(|field| field.coding.words()).sum()
    }
}

const fn field(coding: Coding, name: &'static str, unit: &'static str, range: Range, words: &'static str) -> FieldInfo {
    FieldInfo { key: KeyInfo::linear(name, unit, words).within_range(range), coding }
}

const fn scalar(name: &'static str, unit: &'static str, range: Range, words: &'static str) -> FieldInfo {
    field(Coding::Scalar, name, unit, range, words)
}

const fn gain(name: &'static str, range: Range, words: &'static str) -> FieldInfo {
    field(Coding::Gain, name, "1", range, words)
}

const fn double(name: &'static str, unit: &'static str, range: Range, words: &'static str) -> FieldInfo {
    field(Coding::Double, name, unit, range, words)
}

const fn choice(name: &'static str, accepted: &'static [&'static str], words: &'static str) -> FieldInfo {
    FieldInfo { key: KeyInfo::choice(name, accepted, words), coding: Coding::Choice }
}

/// Scales and elastic coefficients; absent for a joint without motor-side angle.
pub const GEAR: RecordInfo = RecordInfo {
    tag: 0x0001,
    name: "gear",
    fields: &[
        double("rated_deflection", "rad", Range::Measure, "A"),
        double("torque_scale", "N·m", Range::Measure, "T_A, what torques are divided by"),
        scalar("k1", "1", Range::Normalised, "c1·A/T_A"),
        scalar("k3", "1", Range::Normalised, "c2·A³/T_A"),
        scalar("k5", "1", Range::Normalised, "c3·A⁵/T_A"),
    ],
    words: "scales and elastic torque τ = k1·u + k3·u³ + k5·u⁵, u = θ/A, τ = T/T_A",
};

/// Law `masing`.
pub const MASING: RecordInfo = RecordInfo {
    tag: 0x0002,
    name: "masing",
    fields: &[
        scalar("e", "1", Range::NormalisedSize, "e·A/T_A"),
        scalar("h", "1", Range::NormalisedSize, "h·A/T_A"),
        scalar(
            "half_play",
            "rad; 1 in fixed point",
            Range::AtLeastZero,
            "half the input play ε; over A in fixed point",
        ),
    ],
    words: "memory: turning points (MODEL.md section 3)",
};

/// Law `phase`.
pub const PHASE: RecordInfo = RecordInfo {
    tag: 0x0003,
    name: "phase",
    fields: &[
        choice("gate", GATES, "factor between memory and torque"),
        scalar("quadrature", "1", Range::Normalised, "what d·g is multiplied by in the steady state, over T_A"),
        scalar("in_phase", "1", Range::Normalised, "what u is multiplied by in the steady state, over T_A"),
        scalar("rho", "1", Range::AtLeastZero, "β/ω, decay per radian of pseudo-time"),
    ],
    words: "memory: the integral in pseudo-time (MODEL.md section 4)",
};

/// Law `time`.
pub const TIME: RecordInfo = RecordInfo {
    tag: 0x0004,
    name: "time",
    fields: &[
        choice("kernel", KERNELS, "what the integral weighs"),
        choice("gate", GATES, "factor between memory and torque"),
        double("gain", "1/s; 1 for kernel rate", Range::AtLeastZero, "α·A/T_A, for periods that vary"),
        double("beta", "1/s", Range::AtLeastZero, "β, for periods that vary"),
        gain("forgotten", Range::Share, "1 − e^(−βΔ) at the control period"),
        gain("level", Range::Any, "what the last u adds in a step"),
        gain("increment", Range::Any, "what the increment of u adds in a step"),
        scalar("bound", "1", Range::AtLeastZero, "largest m/T_A that a past within ±A can leave"),
        scalar("bound_growth", "1", Range::AtLeastZero, "what abs(u) adds to it"),
    ],
    words: "memory: the integral in real time (MODEL.md section 4)",
};

/// What the inverse has to know of the torque; absent where the parameters have none.
pub const INVERSE: RecordInfo = RecordInfo {
    tag: 0x0005,
    name: "inverse",
    fields: &[
        double("range", "1", Range::Fraction, "r: the torque increases for all abs(θ) ≤ r·A, whatever the past"),
        double("least_slope", "1", Range::AtLeastZero, "bound from below of d(T/T_A)/du there"),
        double("slope", "1", Range::Positive, "bound of abs(dT/dt)/T_A, t = tan(φ/2), u = sin φ"),
        double("bend", "1", Range::Positive, "bound of abs(d²T/dt²)/T_A"),
        double("jerk", "1", Range::Positive, "bound of abs(d³T/dt³)/T_A"),
    ],
    words: "from torque to deflection (MODEL.md section 5)",
};

/// The joint that the gear sits in.
pub const JOINT: RecordInfo = RecordInfo {
    tag: 0x0006,
    name: "joint",
    fields: &[
        double("ratio", "1", Range::Any, "N, negative where the gear reverses; 0 where not stated"),
        double("deflection_zero", "rad", Range::Any, "subtracted from every deflection"),
        choice("torque_side", SIDES, "where the torque is taken: σ = −1 or 1"),
    ],
    words: "what terms and the deflection refer to",
};

/// What the gear gives along the path of [`self_test`](super::self_test); absent in blocks of before.
pub const SELF_TEST: RecordInfo = RecordInfo {
    tag: MAY_SKIP | 0x0002,
    name: "self_test",
    fields: &[
        sample("torque_1", "T at 1/2 A, the first step from a start at 0"),
        sample("torque_2", "T at 3/4 A"),
        sample("torque_3", "T at 0"),
        sample("torque_4", "T at −5/8 A"),
        sample("torque_5", "T at −1/8 A"),
        sample("torque_6", "T at 1/2 A"),
        sample("torque_7", "T at −3/8 A"),
        sample("torque_8", "T at 1/4 A"),
        field(
            Coding::Scalar,
            "solution",
            "rad; A in fixed point",
            Range::Any,
            "the deflection for half of the last torque; 0 without `inverse`",
        ),
    ],
    words: "golden samples: the drive computes them and rejects the block if one differs",
};

const fn sample(name: &'static str, words: &'static str) -> FieldInfo {
    field(Coding::Scalar, name, "N·m; T_A in fixed point", Range::Any, words)
}

/// What the set-up of law `masing` and its inverse comes to; absent in other laws, which have [`PREPARED_GEAR`], without an inverse and in blocks of before.
pub const PREPARED: RecordInfo = RecordInfo {
    tag: MAY_SKIP | 0x0003,
    name: "prepared",
    fields: &[
        word("rated", "A in input units"),
        word("inverse_rated", "its inverse"),
        word("torque_scale", "T_A in output units"),
        word("deflection_limit", "larger deflections are refused"),
        word("k1", "as in `gear`"),
        word("k3", "as in `gear`"),
        word("k5", "as in `gear`"),
        word("knee", "κ, beyond which the elastic torque follows its tangent"),
        word("knee_torque", "τ at κ"),
        word("knee_stiffness", "dτ/du beyond κ"),
        word("e", "as in `masing`"),
        word("h", "as in `masing`"),
        word("half_play", "as in `masing`"),
        word("slope_2", "3·k3"),
        word("slope_4", "5·k5"),
        word("bend_1", "6·k3"),
        word("bend_3", "20·k5"),
        word("tolerance", "of the search, over T_A"),
        word("last_step", "a step of t after which the residual is below it"),
        word("last_chord", "the same of a chord"),
        word("last_width", "the same of a bracket"),
        word("least_slope", "as in `inverse`"),
        word("reach", "r"),
        word("inner_reach", "short of r by its rounding"),
        word("inner_half_tangent", "the same as t"),
        word("inverse_torque_scale", "1/T_A; 1 in fixed point"),
        word("torque_limit", "larger torques are refused"),
        word("longest_period", "s"),
    ],
    words: "law `masing` and its inverse as the host has set them up, for loaders without double precision",
};

/// What the set-up of laws `phase` and `time` and of their inverse comes to; absent in law `masing`, without an inverse and in blocks of before.
pub const PREPARED_GEAR: RecordInfo = RecordInfo {
    tag: MAY_SKIP | 0x0004,
    name: "prepared_gear",
    fields: &[
        word("rated", "as in `prepared`"),
        word("inverse_rated", "as in `prepared`"),
        word("torque_scale", "as in `prepared`"),
        word("deflection_limit", "as in `prepared`"),
        word("k1", "as in `gear`"),
        word("k3", "as in `gear`"),
        word("k5", "as in `gear`"),
        word("knee", "as in `prepared`"),
        word("knee_torque", "as in `prepared`"),
        word("knee_stiffness", "as in `prepared`"),
        word("gain", "as in `time`; 0 in law `phase`"),
        word("beta", "as in `time`; 0 in law `phase`"),
        word("slope_2", "as in `prepared`"),
        word("slope_4", "as in `prepared`"),
        word("bend_1", "as in `prepared`"),
        word("bend_3", "as in `prepared`"),
        word("tolerance", "as in `prepared`"),
        word("last_step", "as in `prepared`"),
        word("last_chord", "as in `prepared`"),
        word("last_width", "as in `prepared`"),
        word("least_slope", "as in `inverse`"),
        word("reach", "r"),
        word("inner_reach", "as in `prepared`"),
        word("inner_half_tangent", "as in `prepared`"),
        word("inverse_torque_scale", "as in `prepared`"),
        word("torque_limit", "as in `prepared`"),
        word("longest_period", "s"),
    ],
    words: "laws `phase` and `time` and their inverse as the host has set them up, for loaders without double precision; the coefficients of the law are in its own record",
};

/// The gate on samples; absent where the host was told no top speed.
pub const LARGEST_STEP: RecordInfo = RecordInfo {
    tag: MAY_SKIP | 0x0005,
    name: "largest_step",
    fields: &[field(
        Coding::Scalar,
        "largest_step",
        "rad; A in fixed point",
        Range::Positive,
        "the most that the deflection moves in the control period of the header",
    )],
    words: "gate on samples: the drive quarantines what moves faster",
};

const fn word(name: &'static str, words: &'static str) -> FieldInfo {
    field(Coding::Scalar, name, "1", Range::Any, words)
}

/// The name of the model file: UTF-8, padded with zeros to whole words.
pub const NAME: RecordInfo =
    RecordInfo { tag: MAY_SKIP | 0x0001, name: "name", fields: &[], words: "the model file's name, for people" };

/// All of them.
pub const RECORDS: [&RecordInfo; 11] =
    [&GEAR, &MASING, &PHASE, &TIME, &INVERSE, &JOINT, &NAME, &SELF_TEST, &PREPARED, &PREPARED_GEAR, &LARGEST_STEP];

impl FieldInfo {
    /// The words that it chooses among; none where it is a number.
    #[must_use]
    pub const fn choices(&self) -> &'static [&'static str] {
        match self.key.form {
            Form::Choice(words) => words,
            Form::Number | Form::List { .. } => &[],
        }
    }
}
