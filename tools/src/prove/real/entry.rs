//! What is known of each real recording, in a small TOML file beside this one.

use std::path::Path;

use serde::Deserialize;

use crate::model::TorqueSide;
use crate::physics::PredictError;
use crate::recording::{self, ColumnMap, MapError, Need, Needs, Recording, RecordingError};

/// A kind of base that is no term: the recording's own simulation.
pub const SIMULATION: &str = "simulation";
/// A kind of base that is no term: elastic torque and hysteresis.
pub const GEAR: &str = "gear";

/// Which half of the recordings: the one to develop with, or the one to report. Split by machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// May be looked at while the diagnosis is developed.
    #[default]
    Development,
    /// Must not be.
    Heldout,
}

/// Why a real recording could not be asked about.
#[derive(Debug, thiserror::Error)]
pub enum RealError {
    /// Its map of columns.
    #[error("{file}: the map of its columns is wrong: {source}")]
    Map {
        /// The recording.
        file: String,
        /// What is wrong.
        source: MapError,
    },
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The model of the recording before a change, along the recording after it.
    #[error(transparent)]
    Predict(#[from] PredictError),
}

/// One effect that is known to be there beside the base.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownAnswer {
    /// Kinds that are right; the first is the textbook's.
    pub kinds: Vec<String>,
    /// How it is known.
    pub source: String,
    /// Orders of the output turn, for ripples.
    #[serde(default)]
    pub orders: Vec<f64>,
}

/// Another recording of the same machine, and what was changed between the two.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownChange {
    /// File name of the recording before the change.
    pub before: String,
    /// Kinds that are right, one list for each effect of the change; `unknown` for what no kind explains.
    pub kinds: Vec<Vec<String>>,
    /// How it is known.
    pub source: String,
}

/// One real recording and what is known of it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// File name in the folder of recordings.
    pub file: String,
    /// The machine; recordings of one machine are in one half.
    pub machine: String,
    /// The half.
    pub split: Split,
    /// Where it comes from.
    pub source: String,
    /// Columns under other names, as `--map` takes them.
    #[serde(default)]
    pub map: Vec<String>,
    /// `motor` or `output`.
    pub torque_side: String,
    /// Reduction ratio.
    pub ratio: Option<f64>,
    /// Kinds of the base's terms; or `simulation`, or `gear`.
    pub base: Vec<String>,
    /// What is known to be there beside the base.
    #[serde(default)]
    pub answer: Vec<KnownAnswer>,
    /// What was changed since another recording of the machine.
    pub change: Option<KnownChange>,
    /// Kinds that may be there too: no wrong names.
    #[serde(default)]
    pub may_also: Vec<String>,
    /// What nobody can know from this file.
    pub unknown: String,
}

macro_rules! entries {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("recordings/", $name, ".toml")))),*]
    };
}

const FILES: &[(&str, &str)] = entries![
    "ak80_9_stall_ramp_20nm",
    "ak80_9_torque_sweep",
    "cogging_slow_comp_1",
    "cogging_slow_nocomp_1",
    "cyclo_base_init_pos1",
    "cyclo_base_init_pos1_repeat",
    "cyclo_conic_pre1",
    "cyclo_conic_pre5",
    "dfki_double_j1_perturbed1",
    "dfki_double_j1_rep1",
    "emps_normal",
    "friction_damper_0.25Hz30lbtension0.5amplitude",
    "friction_damper_0.25Hz30lbtension1.5amplitude",
    "friction_damper_0.25Hz30lbtension1amplitude",
    "friction_damper_1Hz30lbtension1amplitude",
    "kuka_kr300_a1_A",
    "kuka_kr300_a1_B",
    "kuka_kr300_a1_C",
    "mrdamper_utfpr_A1",
    "mrdamper_utfpr_A5",
    "schunk_lwa4p_j4",
    "tiago_arm2",
    "tiago_arm3",
    "tx40_j2",
    "tx40_j5",
    "ur10e_joint1_sine",
    "ur10e_joint2_sine",
    "ur3_cobotops_j0",
    "xl330_pendulum_lift_and_drop_kp400",
    "xl330_pendulum_sin_sin_kp400",
];

impl Entry {
    /// Every entry of the repository.
    ///
    /// # Panics
    /// Never: a test reads them all.
    pub fn all() -> Vec<Self> {
        FILES
            .iter()
            .map(|(name, text)| toml::from_str(text).unwrap_or_else(|e| panic!("recordings/{name}.toml: {e}")))
            .collect()
    }

    /// Does the simulation in the recording stand for the base?
    pub fn simulated(&self) -> bool {
        self.base.iter().any(|b| b == SIMULATION)
    }

    /// Is the base a gear's elastic torque and hysteresis?
    pub fn gear(&self) -> bool {
        self.base.iter().any(|b| b == GEAR)
    }

    /// σ of the recording.
    pub fn side(&self) -> TorqueSide {
        if self.torque_side == "output" { TorqueSide::Output } else { TorqueSide::Motor }
    }

    /// Reads the recording, or says why it cannot be.
    ///
    /// # Errors
    /// The file is missing or cannot be read.
    pub fn read(&self, folder: &Path) -> Result<Recording, RealError> {
        let map = self.map.iter().map(|m| m.parse()).collect::<Result<_, _>>().and_then(ColumnMap::new);
        let map = map.map_err(|source| RealError::Map { file: self.file.clone(), source })?;
        let simulation = if self.simulated() { Need::Required } else { Need::Ignored };
        let needs = Needs { motion: Need::IfPresent, simulation, ..Needs::FIT };
        let mut recording = recording::read(&folder.join(&self.file), &map, &needs, &|_| ())?;
        if !self.gear() {
            // A joint log: what the second encoder says is another question.
            (recording.deflection_rad, recording.theta_in_rad) = (None, None);
        }
        Ok(recording)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::generator::KINDS;
    use crate::prove::key::sha256;

    /// By the parity of the last digit of the SHA-256 of a machine's name.
    fn half_of(machine: &str) -> Split {
        let odd = sha256(machine.as_bytes()).ends_with(['1', '3', '5', '7', '9', 'b', 'd', 'f']);
        if odd { Split::Heldout } else { Split::Development }
    }

    #[test]
    fn every_entry_can_be_read_and_is_in_the_half_of_its_machine() {
        let entries = Entry::all();
        assert!(entries.len() >= 25);
        for entry in &entries {
            assert_eq!(entry.split, half_of(&entry.machine), "{}", entry.file);
            let newer =
                ["presliding_friction", "torque_scale", "encoder_skew", "ripple_resonance", "load_dependent_memory"];
            let kinds = entry.answer.iter().flat_map(|a| &a.kinds).chain(&entry.may_also);
            for kind in kinds.chain(entry.base.iter().filter(|b| ![SIMULATION, GEAR].contains(&b.as_str()))) {
                assert!(KINDS.contains(&kind.as_str()) || newer.contains(&kind.as_str()), "{}: {kind}", entry.file);
            }
            assert!(["motor", "output"].contains(&entry.torque_side.as_str()) && !entry.unknown.is_empty());
            assert!(entry.answer.iter().all(|a| !a.kinds.is_empty() && !a.source.is_empty()));
            if let Some(change) = &entry.change {
                let before = entries.iter().find(|e| e.file == change.before).unwrap();
                assert!(before.machine == entry.machine && !change.kinds.is_empty() && !change.source.is_empty());
            }
        }
        let halves = [Split::Development, Split::Heldout].map(|h| entries.iter().filter(|e| e.split == h).count());
        assert!(halves.iter().all(|n| *n >= 8), "{halves:?}");
    }
}
