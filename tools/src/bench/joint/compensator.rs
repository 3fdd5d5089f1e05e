//! From the torque that the link needs to the offset of the motor.

use clap::ValueEnum;
use gmhm::{Inverse, Memory, Params, State};

use super::super::BenchError;
use super::drive::DEFLECTION_RESOLUTION_RAD;
use crate::physics::CAPACITY;

/// How the drive makes up for the deflection of the gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
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
}

/// What the drive knows of the gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knowledge {
    pub params: Params,
    pub spring_nm_per_rad: f64,
}

impl Knowledge {
    /// The same with the elastic stiffness and the hysteresis multiplied by these.
    pub fn scaled(&self, elastic_factor: f64, memory_factor: f64) -> Result<Self, gmhm::ParamError> {
        let mut elastic = self.params.elastic();
        elastic.c1_nm_per_rad *= elastic_factor;
        elastic.c2_nm_per_rad3 *= elastic_factor;
        elastic.c3_nm_per_rad5 *= elastic_factor;
        let memory = Memory { alpha: self.params.memory().alpha * memory_factor, ..self.params.memory() };
        Ok(Self {
            params: Params::new(self.params.rated_deflection_rad(), elastic, memory)?,
            spring_nm_per_rad: self.spring_nm_per_rad * elastic_factor,
        })
    }
}

/// A compensation at work.
#[derive(Debug, Clone)]
pub(super) struct Compensator {
    kind: Compensation,
    spring_nm_per_rad: f64,
    inverse: Inverse<f64>,
    state: State<f64, CAPACITY>,
}

impl Compensator {
    /// At rest, unloaded. Along the measurement an input play of four counts of the link's encoder keeps its flicker from turning the memory.
    pub fn new(kind: Compensation, mut knowledge: Knowledge) -> Result<Self, BenchError> {
        if kind == Compensation::Measurement {
            let p = knowledge.params;
            let play = p.memory().reversal_play_rad.max(4.0 * DEFLECTION_RESOLUTION_RAD);
            let memory = Memory { reversal_play_rad: play, ..p.memory() };
            knowledge.params = Params::new(p.rated_deflection_rad(), p.elastic(), memory)?;
        }
        let inverse = Inverse::new(&knowledge.params)?;
        Ok(Self { kind, spring_nm_per_rad: knowledge.spring_nm_per_rad, inverse, state: inverse.gear().start(0.0) })
    }

    /// The motor-side offset for a torque, rad; beyond the range of the model its edge. `deflection_rad` is what the encoders show.
    pub fn offset_rad(&mut self, torque_nm: f64, deflection_rad: f64) -> f64 {
        match self.kind {
            Compensation::Off => 0.0,
            Compensation::Spring => torque_nm / self.spring_nm_per_rad,
            Compensation::Reference => self.inverse.commit(&mut self.state, torque_nm).0.theta,
            Compensation::Measurement => {
                self.inverse.gear().step(&mut self.state, deflection_rad);
                self.inverse.peek(&self.state, torque_nm).theta
            }
        }
    }
}
