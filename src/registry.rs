//! The registry: every name that model files, parameter blocks and the command line know, with its unit, range and words.
//!
//! | list | what |
//! |---|---|
//! | [`SECTIONS`] | the sections of a model file |
//! | [`KINDS`](crate::terms::KINDS) | the kinds of `[[term]]`, in model files and blocks |
//! | [`RECORDS`] | the fixed records of blocks |
//!
//! The reader of model files, the layout of blocks, `gmhm inspect` and the pages in `docs/` follow from these lists.
//!
#![cfg_attr(feature = "block", doc = "[`RECORDS`]: crate::block::RECORDS")]
#![cfg_attr(not(feature = "block"), doc = "[`RECORDS`]: crate#features")]

use crate::params::{Gate, Kernel, Law};
use crate::terms::{KeyInfo, Range};

/// A section of a model file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SectionInfo {
    /// Its name.
    pub name: &'static str,
    /// Its keys.
    pub keys: &'static [KeyInfo],
    /// What it is, in words.
    pub words: &'static str,
}

impl SectionInfo {
    /// The key of this name.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&'static KeyInfo> {
        self.keys.iter().find(|key| key.name == name)
    }
}

/// The names of the laws by their number.
pub const LAWS: &[&str] = &[Law::Masing.name(), Law::Phase.name(), Law::Time.name()];
/// The names of the kernels by their number.
pub const KERNELS: &[&str] = &[Kernel::Deflection.name(), Kernel::Rate.name()];
/// The names of the gates by their number.
pub const GATES: &[&str] = &[Gate::Cycle.name(), Gate::None.name()];
/// The names of the sides on which torque is taken, by their number.
pub const SIDES: &[&str] = &["output", "motor"];

/// `[gear]`.
pub const GEAR: SectionInfo = SectionInfo {
    name: "gear",
    keys: &[
        KeyInfo::linear("ratio", "1", "N, negative where the gear reverses; only where angles are used")
            .within_range(Range::NotZero)
            .decided()
            .optional(),
        KeyInfo::choice("torque_side", SIDES, "where the torque is taken: σ = −1 or 1").optional(),
        KeyInfo::linear("rated_deflection_rad", "rad", "A, the amplitude of the calibrated cycle")
            .positive()
            .decided()
            .optional(),
        KeyInfo::linear("deflection_zero_rad", "rad", "subtracted from every deflection").optional(),
        KeyInfo::choice("torque_unit", &["nm", "a"], "what torques are counted in, where no other key says so")
            .optional(),
        KeyInfo::choice(
            "base",
            &["model", "simulation"],
            "what the terms are added to: the model's own torque, or column torque_sim_nm of each recording",
        )
        .optional(),
    ],
    words: "the gear itself",
};

/// `[elastic]`.
pub const ELASTIC: SectionInfo = SectionInfo {
    name: "elastic",
    keys: &[
        KeyInfo::linear("c1_nm_per_rad", "N·m/rad", "c1 of f(θ) = c1·θ + c2·θ³ + c3·θ⁵"),
        KeyInfo::linear("c2_nm_per_rad3", "N·m/rad³", "c2"),
        KeyInfo::linear("c3_nm_per_rad5", "N·m/rad⁵", "c3"),
    ],
    words: "elastic torque; absent for a joint log",
};

/// `[memory]`.
pub const MEMORY: SectionInfo = SectionInfo {
    name: "memory",
    keys: &[
        KeyInfo::choice("law", LAWS, "which law the memory follows").optional(),
        KeyInfo::choice("kernel", KERNELS, "what the memory integral weighs; laws phase and time").optional(),
        KeyInfo::choice("gate", GATES, "the factor between memory and torque; laws phase and time").optional(),
        KeyInfo::linear("alpha", "N·m/(rad·s); N·m/rad for kernel rate", "α").at_least_zero(),
        KeyInfo::shape("beta_per_s", "1/s", "β; may be negative together with ω"),
        KeyInfo::shape("omega_per_s", "1/s", "ω, speed of the pseudo-time; laws masing and phase"),
        KeyInfo::shape("reversal_play_rad", "rad", "ε, width of the input play before the turning points; law masing")
            .at_least_zero()
            .optional(),
    ],
    words: "hysteresis memory; absent for a joint log",
};

/// The sections of a model file; beside them stand `format = 1`, `name` and the `[[term]]` tables.
pub const SECTIONS: [&SectionInfo; 3] = [&GEAR, &ELASTIC, &MEMORY];
