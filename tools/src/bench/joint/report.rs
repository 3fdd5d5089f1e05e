//! What the compensations left, as tables and as a figure.

use std::fmt;

use serde::Serialize;

use super::{Compensation, Plant};
use crate::report::plot::{Curve, Drawing, Figure, Role};
use crate::text_table::{Head, text_table};

/// How far the drive's knowledge of the gear is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Knows {
    /// As fitted to a noisy recording of the gear.
    Fitted,
    /// The hysteresis 10 % too large.
    MemoryOff,
    /// Stiffness and hysteresis 10 % too large.
    AllOff,
}

impl Knows {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Fitted, Self::MemoryOff, Self::AllOff];

    /// Factors of stiffness and hysteresis.
    pub(super) const fn factors(self) -> [f64; 2] {
        match self {
            Self::Fitted => [1.0, 1.0],
            Self::MemoryOff => [1.0, 1.1],
            Self::AllOff => [1.1, 1.1],
        }
    }

    /// Whether a compensation can tell it from what comes before.
    pub(super) const fn matters_to(self, compensation: Compensation) -> bool {
        match self {
            Self::Fitted => true,
            Self::MemoryOff => compensation.knows_hysteresis(),
            Self::AllOff => !matches!(compensation, Compensation::Off),
        }
    }
}

/// Root mean squares of an error.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Errors {
    /// Of the link's angle while tracking, rad.
    pub position_rad: f64,
    /// Of the torque while pressing, N·m.
    pub torque_nm: f64,
}

impl Errors {
    /// How many times less than another: position and torque.
    pub fn beside(&self, other: &Self) -> [f64; 2] {
        [other.position_rad / self.position_rad, other.torque_nm / self.torque_nm]
    }
}

/// One gear, parameter set and compensation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Line {
    /// The gear in the joint.
    pub plant: Plant,
    /// What the drive knows of it.
    pub knows: Knows,
    /// How the drive made up for it.
    pub compensation: Compensation,
    /// What was off in all.
    pub all: Errors,
    /// What the hysteresis did to it: the difference to a run without, the gear replaced by the middle of its loop and the drive's knowledge by
    /// that of a gear without loop.
    pub by_hysteresis: Errors,
}

/// What law masing cannot say of a gear.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Identified {
    /// The gear.
    pub plant: Plant,
    /// Rms of the torque that the fit leaves, noise and all, N·m.
    pub left_nm: f64,
    /// The same as a deflection of the linear spring, rad.
    pub left_rad: f64,
}

/// What each compensation leaves on each gear.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointReport {
    /// The seed of the identification's and of the sensors' noise.
    pub seed: u64,
    /// What the fits leave: the measure of what a compensation by law masing can reach.
    pub identified: Vec<Identified>,
    /// All runs. What a compensation cannot tell is not run again: off there is one line a gear.
    pub lines: Vec<Line>,
}

impl JointReport {
    /// One run, or the one that equals it.
    pub fn line(&self, plant: Plant, knows: Knows, compensation: Compensation) -> Option<&Line> {
        let of = |line: &&Line| line.plant == plant && line.compensation == compensation;
        let same = if knows.matters_to(compensation) { knows } else { Knows::Fitted };
        self.lines.iter().filter(of).find(|line| line.knows == same)
    }

    /// How many times more the inverse on the reference leaves of the position error with all parameters 10 % too large, and on which gear.
    fn worst_case(&self) -> Option<(f64, Plant)> {
        let factor = |plant| {
            let [fitted, high] =
                [Knows::Fitted, Knows::AllOff].map(|knows| self.line(plant, knows, Compensation::Reference));
            Some((high?.all.position_rad / fitted?.all.position_rad, plant))
        };
        self.identified.iter().filter_map(|gear| factor(gear.plant)).max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// The errors of every gear by compensation; what else was run is in the JSON.
impl fmt::Display for JointReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Error once settled, rms, by compensation, parameters as fitted (synthetic, seed {}):", self.seed)?;
        let table = |number: fn(&Errors) -> String| {
            let rows = self.identified.iter().map(|gear| {
                let [off, spring, reference, measurement] = Compensation::ALL.map(|kind| {
                    let line = self.line(gear.plant, Knows::Fitted, kind);
                    line.map_or("-".to_owned(), |line| number(&line.all))
                });
                [gear.plant.name(), off, spring, reference, measurement]
            });
            let [off, spring, reference, measurement] = Compensation::ALL.map(|kind| Head::Numbers(kind.name()));
            text_table([Head::Words("gear"), off, spring, reference, measurement], rows)
        };
        write!(f, "tracking: link position in µrad\n{}", table(|e| format!("{:.2}", 1e6 * e.position_rad)))?;
        write!(f, "pressing: torque in N·m\n{}", table(|e| format!("{:.4}", e.torque_nm)))?;
        writeln!(
            f,
            "off: no compensation; spring: T/k; reference, measurement: the inverse of the hysteresis model on either"
        )?;
        writeln!(f, "Without compensation the held gear barely deflects, so the error is mostly missing torque.")?;
        if let Some((factor, plant)) = self.worst_case() {
            writeln!(
                f,
                "With stiffness and hysteresis 10 % too large, reference leaves at most {factor:.1} times the position error (gear {}).",
                plant.name()
            )?;
        }
        Ok(())
    }
}

/// The link's position error over time, once settled, by compensation.
pub(super) fn figure(plant: Plant, traces: &[(Compensation, Vec<(f64, f64)>)]) -> Drawing {
    let rms = |trace: &[(f64, f64)]| (trace.iter().map(|p| p.1 * p.1).sum::<f64>() / trace.len() as f64).sqrt();
    let mut off = String::new();
    let mut curves = Vec::new();
    // The reference last, above the others.
    let (order, last) = ([0, 1, 3], 2);
    for (compensation, trace) in order.into_iter().chain([last]).filter_map(|k| traces.get(k)) {
        let rms = rms(trace);
        let (role, words) = match compensation {
            Compensation::Off => {
                off = format!(", off: {rms:.0} µrad rms");
                continue;
            }
            Compensation::Spring => (Role::Second, "linear spring:"),
            Compensation::Reference => (Role::Model, "inverse on the reference:"),
            Compensation::Measurement => (Role::Third, "inverse on the measurement:"),
        };
        let (x, y): (Vec<f64>, Vec<f64>) = trace.iter().copied().unzip();
        curves.push(Curve::new(format!("{words} {rms:.1}"), role, &x, 1.0, &y));
    }
    let title = format!("Link on gear {}, tracking (synthetic{off})", plant.name());
    Figure::of(title, "time, s", "position error, µrad (rms above)", curves).draw()
}
