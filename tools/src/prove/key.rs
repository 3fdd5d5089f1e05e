//! The key of a concealed case: what was hidden in it, and what could look the same there.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::diagnose::diagnosis::ParameterValue;

/// A kind counts as indistinguishable while noise makes it look at least as good as the truth in more than 1 % of
/// repeats: with λ the squared deviations of noise that it leaves unexplained, Φ(−√λ/2) > 0.01, so λ < 21.6.
pub const INDISTINGUISHABLE: f64 = 21.6;

/// From this share (rms) of all that a simulation leaves out, an effect counts as large, and has to be named.
pub const LARGE_SHARE: f64 = 0.08;

/// What a case holds. Written, and its hash published, before the detector sees the recording.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Key {
    /// The block of the proof that the case belongs to.
    pub block: String,
    /// The seed that remakes it.
    pub seed: u64,
    /// `gmhm`, `maxwell`, `butterfly`, `joint` or `simulation`.
    #[serde(rename = "nature")]
    pub plant_model: String,
    /// The experiment.
    pub motion: String,
    /// Whether the recordings start after an excursion that was not recorded.
    pub remanent: bool,
    /// Colour of the torque noise.
    pub noise: String,
    /// Its rms, N·m.
    pub noise_rms_nm: f64,
    /// How the model handed over was made: `true`, `perturbed` or `refitted`.
    pub handed: String,
    /// Kinds taken out of the detector's library.
    pub removed: Vec<String>,
    /// What was hidden; empty for a null.
    #[serde(default)]
    pub effects: Vec<HiddenEffect>,
}

/// Why an effect is in a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Hidden on purpose: to be found.
    #[default]
    Hidden,
    /// The plant model is not the base model's: may be found.
    #[serde(rename = "nature")]
    PlantModel,
    /// A part of the shape of a hidden effect that is an effect of another kind: may be found.
    Shape,
}

/// One hidden effect.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct HiddenEffect {
    /// A kind of MODEL.md section 7, or one of the open world.
    pub kind: String,
    /// Kinds of MODEL.md section 7 whose equation its shape is as well: friction of Dahl's shape is presliding friction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<String>,
    /// The kind as which it was made, where it is called by a plainer one: Stribeck friction whose dip hardly shows is called Coulomb friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_as: Option<String>,
    /// Is it a kind of MODEL.md section 7 that the detector's library holds?
    pub listed: bool,
    /// Hidden on purpose, or part of the plant model.
    pub role: Role,
    /// Its shape, in the generator's words.
    pub shape: String,
    /// What it leaves after the base model is refitted, rms, N·m.
    pub size_nm: f64,
    /// Its rms before that refit, N·m.
    pub before_nm: f64,
    /// Its rms over that of all that is left out together, where several loud effects are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// λ of the effect itself: squared deviations of noise that it leaves. Below [`INDISTINGUISHABLE`] nobody can see it.
    pub evidence: f64,
    /// Could anybody see it?
    pub visible: bool,
    /// Coordinates in which it shows.
    pub coordinates: Vec<String>,
    /// The theoretical class: kinds of the library that explain it equally well in these very recordings, its own among them.
    pub class: Vec<String>,
    /// λ that each kind leaves unexplained, by projection on the noise-free truth.
    pub unexplained: BTreeMap<String, f64>,
    /// Parameters as a model file would hold them; empty where the shape is not one of a model file.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// The generator's own pieces and weights, for the record.
    pub pieces: Vec<String>,
}

impl HiddenEffect {
    /// Whether a name is that of its kind.
    pub fn is(&self, name: &str) -> bool {
        self.kind == name || self.also.iter().any(|kind| kind == name)
    }
}

impl Key {
    /// Effects to be found.
    pub fn hidden(&self) -> impl Iterator<Item = &HiddenEffect> {
        self.effects.iter().filter(|e| e.role == Role::Hidden)
    }

    /// The key as TOML.
    ///
    /// # Panics
    /// Never: every field is a TOML value.
    pub fn to_toml(&self) -> String {
        // TOML integers are signed: a seed beyond i64 is written by its bits.
        toml::to_string(&Portable::from(self)).expect("every field of a key is a TOML value")
    }

    /// Reads what [`to_toml`](Self::to_toml) wrote.
    ///
    /// # Errors
    /// Text that is not the TOML of a key.
    pub fn from_toml(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str::<Portable>(text).map(Self::from)
    }

    /// SHA-256 of [`to_toml`](Self::to_toml), hexadecimal.
    pub fn sha256(&self) -> String {
        sha256(self.to_toml().as_bytes())
    }
}

/// SHA-256, hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}

/// The key with its seed as TOML can hold it.
#[derive(Serialize, Deserialize)]
struct Portable {
    seed_bits: String,
    #[serde(flatten)]
    key: Key,
}

impl From<&Key> for Portable {
    fn from(key: &Key) -> Self {
        Self { seed_bits: format!("{:016x}", key.seed), key: Key { seed: 0, ..key.clone() } }
    }
}

impl From<Portable> for Key {
    fn from(portable: Portable) -> Self {
        Self { seed: u64::from_str_radix(&portable.seed_bits, 16).unwrap_or(0), ..portable.key }
    }
}
