//! What the drive knows of the gear, and how it makes up for it: the core's feed-forward, in `f32` as on a drive.

use clap::ValueEnum;
use gmhm::feedforward::{Controls, Source};
use gmhm::{Elastic, Memory, ParamError, Params};
use serde::Serialize;

/// How the drive makes up for the deflection of the gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Compensation {
    /// Not at all
    Off,
    /// By a linear spring, T/k
    Spring,
    /// By the inverse of law masing along the reference torque
    Reference,
    /// By the same inverse, its memory following the measured deflection
    Measurement,
}

impl Compensation {
    /// All of them, the plainest first.
    pub const ALL: [Self; 4] = [Self::Off, Self::Spring, Self::Reference, Self::Measurement];

    /// Its name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Spring => "spring",
            Self::Reference => "reference",
            Self::Measurement => "measurement",
        }
    }

    /// Whether it knows of hysteresis.
    pub const fn knows_hysteresis(self) -> bool {
        matches!(self, Self::Reference | Self::Measurement)
    }

    pub(super) fn controls(self) -> Controls<f32> {
        let source = if self == Self::Measurement { Source::Measurement } else { Source::Reference };
        Controls { on: self != Self::Off, source, ratio: 1.0 }
    }
}

/// What the drive knows of the gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knowledge {
    pub params: Params,
    pub spring_nm_per_rad: f64,
    /// Rms of the torque that the fit left, N·m.
    pub left_nm: f64,
}

impl Knowledge {
    /// The same with the elastic stiffness and the hysteresis multiplied by these.
    pub fn scaled(&self, elastic_factor: f64, memory_factor: f64) -> Result<Self, ParamError> {
        let mut elastic = self.params.elastic();
        elastic.c1_nm_per_rad *= elastic_factor;
        elastic.c2_nm_per_rad3 *= elastic_factor;
        elastic.c3_nm_per_rad5 *= elastic_factor;
        let memory = Memory { alpha: self.params.memory().alpha * memory_factor, ..self.params.memory() };
        Ok(Self {
            params: Params::new(self.params.rated_deflection_rad(), elastic, memory)?,
            spring_nm_per_rad: self.spring_nm_per_rad * elastic_factor,
            ..*self
        })
    }

    /// The same gear without its loop: h = 0, and e as it was.
    pub fn without_loop(&self) -> Result<Self, ParamError> {
        let memory = Memory { alpha: self.params.memory().e(), beta_per_s: 1.0, omega_per_s: 0.0, ..Memory::default() };
        let params = Params::new(self.params.rated_deflection_rad(), self.params.elastic(), memory)?;
        Ok(Self { params, ..*self })
    }

    /// What a compensation is told of the gear. Along the measurement an input play of `play_rad` keeps the noise of the encoders from turning the memory.
    pub fn known(&self, kind: Compensation, play_rad: f64) -> Result<Params, ParamError> {
        let (mut elastic, mut memory) = (self.params.elastic(), self.params.memory());
        match kind {
            Compensation::Off | Compensation::Spring => {
                elastic = Elastic { c1_nm_per_rad: self.spring_nm_per_rad, ..Elastic::default() };
                memory = Memory { alpha: 0.0, ..memory };
            }
            Compensation::Reference => {}
            Compensation::Measurement => memory.reversal_play_rad = memory.reversal_play_rad.max(play_rad),
        }
        Params::new(self.params.rated_deflection_rad(), elastic, memory)
    }
}
