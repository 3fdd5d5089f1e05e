//! Coordinates over which free functions are fitted, alone or together with the direction of motion.

use gmhm::terms::{Coordinate, KindInfo};

/// What a free function is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FreeCoordinate {
    /// v.
    Velocity,
    /// v̇.
    Acceleration,
    /// The load: the simulated torque, or that of the base model.
    Load,
    /// The load and the direction of motion.
    LoadAndDirection,
    /// The rate of the load.
    LoadRate,
    /// q_o.
    OutputAngle,
    /// q_o and the direction of motion.
    AngleAndDirection,
    /// Orders of the turn of the motor or the output.
    Orders,
    /// Travel of the output since it turned round.
    OutputReversal,
    /// θ.
    Deflection,
    /// θ̇.
    DeflectionRate,
    /// Travel of the deflection since it turned round, at any load.
    DeflectionReversal,
    /// Θ.
    Temperature,
    /// t.
    Time,
}

impl FreeCoordinate {
    /// The coordinate as `diagnose --json` names it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "output_velocity",
            Self::Acceleration => "acceleration",
            Self::Load | Self::LoadAndDirection => "torque",
            Self::LoadRate => "torque_rate",
            Self::OutputAngle | Self::AngleAndDirection => "output_angle",
            Self::Orders => "motor_angle",
            Self::OutputReversal | Self::DeflectionReversal => "reversal",
            Self::Deflection => "deflection",
            Self::DeflectionRate => "deflection_rate",
            Self::Temperature => "temperature",
            Self::Time => "time",
        }
    }

    /// The free function over the first coordinate in which a kind shows.
    pub fn of(info: &KindInfo) -> &'static [Self] {
        match info.coordinates.first() {
            Some(Coordinate::MotorAngle) => &[Self::Orders],
            Some(Coordinate::OutputAngle) => &[Self::OutputAngle],
            Some(Coordinate::OutputVelocity) => &[Self::Velocity],
            Some(Coordinate::Torque) => &[Self::Load],
            Some(Coordinate::TorqueRate) => &[Self::LoadRate],
            Some(Coordinate::DeflectionRate) => &[Self::DeflectionRate],
            Some(Coordinate::Acceleration) => &[Self::Acceleration],
            Some(Coordinate::Deflection) => &[Self::Deflection],
            Some(Coordinate::Reversal) => &[Self::DeflectionReversal],
            Some(Coordinate::Temperature) => &[Self::Temperature],
            Some(Coordinate::Time) | None => &[Self::Time],
        }
    }
}
