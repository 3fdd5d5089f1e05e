//! Columns of a recording in another unit or of the other sign.

use std::f64::consts::PI;

use crate::model::Model;
use crate::number::trimmed;
use crate::recording::{Recording, TorqueUnit};

/// Columns multiplied by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Which columns.
    pub of: Channel,
    /// The factor.
    pub factor: f64,
}

/// Columns that share a unit and a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Torque or current.
    Torque,
    /// The deflection.
    Deflection,
    /// Both angles.
    Angles,
    /// The motor-side angle.
    Input,
    /// The output-side angle.
    Output,
}

impl Channel {
    pub(crate) fn columns(self, torque: TorqueUnit) -> &'static [&'static str] {
        match (self, torque) {
            (Channel::Torque, TorqueUnit::NewtonMetre) => &["torque_nm"],
            (Channel::Torque, TorqueUnit::Ampere) => &["current_a"],
            (Channel::Deflection, _) => &["deflection_rad"],
            (Channel::Angles, _) => &["theta_in_rad", "theta_out_rad"],
            (Channel::Input, _) => &["theta_in_rad"],
            (Channel::Output, _) => &["theta_out_rad"],
        }
    }
}

impl Conversion {
    pub(crate) fn words(self, torque: TorqueUnit) -> String {
        let columns = self.of.columns(torque).join(" and ");
        if self.factor == -1.0 {
            format!("{columns} negated")
        } else {
            format!("{columns} times {}", trimmed(self.factor, 6))
        }
    }

    pub(crate) fn mistake(self) -> &'static str {
        let near = |factor: f64| (self.factor / factor - 1.0).abs() < 1e-9;
        match self.of {
            Channel::Torque | Channel::Deflection if self.factor == -1.0 => {
                "deflection and torque are counted in opposite directions"
            }
            _ if self.factor == -1.0 => "the angles are counted in another direction than the model's",
            Channel::Torque if near(1e-3) || near(1e3) => "the torque seems to be in another unit",
            Channel::Torque => "the torque seems to be taken on the other side of the gear",
            _ if near(1e-3) => "milliradians seem to be taken for radians",
            _ if near(DEGREE) => "degrees seem to be taken for radians",
            _ if near(DEGREE / 60.0) => "minutes of arc seem to be taken for radians",
            _ => "the column seems to be in another unit",
        }
    }

    /// The `--map` entries that do it.
    pub(crate) fn map(self, torque: TorqueUnit) -> String {
        let near = |factor: f64| (self.factor / factor - 1.0).abs() < 1e-9;
        let entry = |column: &&str| match column.strip_suffix("_rad") {
            _ if self.factor == -1.0 => format!("{column}=-COLUMN"),
            Some(stem) if near(DEGREE) => format!("{stem}_deg=COLUMN"),
            Some(stem) if near(DEGREE / 60.0) => format!("{stem}_arcmin=COLUMN"),
            Some(stem) if near(1e-3) => format!("{stem}_mrad=COLUMN"),
            _ => format!("{column}=COLUMN*{}", self.factor),
        };
        self.of.columns(torque).iter().map(entry).collect::<Vec<_>>().join(",")
    }

    pub(crate) fn applied(self, recording: &Recording) -> Option<Recording> {
        let mut converted = recording.clone();
        let Recording { torque, deflection_rad, theta_in_rad, theta_out_rad, .. } = &mut converted;
        let columns = match self.of {
            Channel::Torque => vec![torque],
            Channel::Deflection => vec![deflection_rad],
            Channel::Angles => vec![theta_in_rad, theta_out_rad],
            Channel::Input => vec![theta_in_rad],
            Channel::Output => vec![theta_out_rad],
        };
        for column in columns {
            column.as_mut()?.iter_mut().for_each(|x| *x *= self.factor);
        }
        Some(converted)
    }
}

/// What people mistake. The deflection first: its sign explains what that of the torque does.
pub(crate) fn conversions(recording: &Recording, model: &Model) -> Vec<Conversion> {
    let angle = [-1.0, 1e-3, 1e3, 1e-6, DEGREE, DEGREE.recip(), DEGREE / 60.0];
    let torque = [-1.0, 1e-3, 1e3].into_iter();
    let sides = model.gear.ratio.into_iter().flat_map(|ratio| [ratio.abs(), ratio.abs().recip()]);
    let mut all = Vec::new();
    let mut add = |of: Channel, factors: &[f64]| all.extend(factors.iter().map(|&factor| Conversion { of, factor }));
    match (&recording.deflection_rad, &recording.theta_in_rad, &recording.theta_out_rad) {
        (Some(_), ..) => add(Channel::Deflection, &angle),
        (None, Some(_), Some(_)) => {
            for of in [Channel::Angles, Channel::Input, Channel::Output] {
                add(of, &angle);
            }
        }
        (None, Some(_), None) => add(Channel::Input, &[DEGREE]),
        (None, None, Some(_)) => add(Channel::Output, &[DEGREE]),
        (None, None, None) => {}
    }
    add(Channel::Torque, &torque.chain(sides).collect::<Vec<f64>>());
    all
}

const DEGREE: f64 = PI / 180.0;
