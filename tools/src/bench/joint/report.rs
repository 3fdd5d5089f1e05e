//! What the compensations left, as a table.

use std::fmt;

use serde::{Serialize, Serializer};

use super::{Compensation, Plant};

/// One gear, parameter set and compensation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Line {
    /// The gear in the joint.
    #[serde(serialize_with = "plant_name")]
    pub plant: Plant,
    /// `fitted`, or `10 % off`: every stiffness too large by 10 %.
    pub parameters: &'static str,
    /// How the drive made up for it.
    #[serde(serialize_with = "compensation_name")]
    pub compensation: Compensation,
    /// Rms error of the link's angle while tracking, rad.
    pub position_error_rad: f64,
    /// Rms error of the torque while pressing, N·m.
    pub torque_error_nm: f64,
}

fn plant_name<S: Serializer>(plant: &Plant, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(plant.name())
}

fn compensation_name<S: Serializer>(compensation: &Compensation, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(compensation.name())
}

/// What each compensation leaves on each gear.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointReport {
    /// The seed of the identification's noise.
    pub seed: u64,
    /// All runs.
    pub lines: Vec<Line>,
}

impl JointReport {
    /// One run.
    pub fn line(&self, plant: Plant, parameters: &str, compensation: Compensation) -> Option<&Line> {
        self.lines.iter().find(|l| l.plant == plant && l.parameters == parameters && l.compensation == compensation)
    }
}

/// Errors, and how many times less than with the compensation off and than by the linear spring.
impl fmt::Display for JointReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:<13} {:<15} {:<12} {:>14} {:>9} {:>10} {:>13} {:>9} {:>10}",
            "gear",
            "parameters",
            "compensation",
            "position µrad",
            "off / it",
            "spring/it",
            "torque N·m",
            "off / it",
            "spring/it"
        )?;
        for line in &self.lines {
            let other = |kind| self.line(line.plant, line.parameters, kind).unwrap_or(line);
            let (off, spring) = (other(Compensation::Off), other(Compensation::Spring));
            writeln!(
                f,
                "{:<13} {:<15} {:<12} {:>14.2} {:>9.1} {:>10.1} {:>13.4} {:>9.1} {:>10.1}",
                line.plant.name(),
                line.parameters,
                line.compensation.name(),
                1e6 * line.position_error_rad,
                off.position_error_rad / line.position_error_rad,
                spring.position_error_rad / line.position_error_rad,
                line.torque_error_nm,
                off.torque_error_nm / line.torque_error_nm,
                spring.torque_error_nm / line.torque_error_nm,
            )?;
        }
        Ok(())
    }
}
