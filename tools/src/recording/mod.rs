//! Recordings: rows of time, deflection and torque, in SI units, checked once at the door.

mod bytes;
mod columns;
mod csv_table;
mod dialect;
mod error;
mod files;
mod format;
mod guard;
mod header;
mod map;
mod mat5;
#[cfg(feature = "mat73")]
mod mat73;
mod mcap_table;
mod mdf4;
mod name;
mod needs;
mod open;
mod parquet_table;
mod preamble;
mod quantity;
pub mod ratio;
mod read;
mod ros;
mod samples;
mod survey;
mod table;
pub mod turns;
mod unit_text;
mod write;

use std::borrow::Cow;
use std::sync::Arc;

use crate::numerics::robust;

pub use columns::Columns;
pub use error::{ColumnPlace, Mistake, RecordingError, RecordingProblem, shell_word};
pub use files::{file, files_and_listed, paths_and_listed};
pub use format::Format;
pub use map::{ColumnMap, MapError, Mapping};
pub use needs::{Need, Needs};
pub use open::{Progress, RecordingFile};
pub use quantity::{Quantity, Unit};
pub use read::{Reading, read};
pub use samples::{Lender, Samples};
pub use survey::{Survey, SurveyedColumn, Timing};
pub use table::Location;
pub use write::{Column, CopyError, copy_with_columns, write_columns};

/// What the torque column of a recording holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TorqueUnit {
    /// `torque_nm`: parameters are per newton-metre.
    #[default]
    NewtonMetre,
    /// `current_a` stands in for the torque: parameters are per ampere.
    Ampere,
}

impl TorqueUnit {
    /// What names of columns and of parameters end in.
    pub fn suffix(self) -> &'static str {
        match self {
            TorqueUnit::NewtonMetre => "nm",
            TorqueUnit::Ampere => "a",
        }
    }

    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            TorqueUnit::NewtonMetre => "N·m",
            TorqueUnit::Ampere => "A",
        }
    }

    /// What it is, in a word.
    pub fn quantity(self) -> &'static str {
        match self {
            TorqueUnit::NewtonMetre => "torque",
            TorqueUnit::Ampere => "current",
        }
    }

    /// The unit of a parameter, given per newton-metre, as it reads with this torque.
    pub fn of_parameter(self, unit: &str) -> Cow<'_, str> {
        match self {
            TorqueUnit::NewtonMetre => unit.into(),
            TorqueUnit::Ampere => unit.replace("kg·m²", "A·s²/rad").replace("N·m", "A").into(),
        }
    }
}

/// One recording in SI units. Every column present has the length of [`time_s`](Self::time_s), and every number is finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// Where it came from, for messages and reports.
    pub name: String,
    /// SHA-256 of the file's bytes in hexadecimal; empty for a recording made in memory.
    pub sha256: String,
    /// Time, s, strictly increasing.
    pub time_s: Samples,
    /// Transmitted torque, N·m (or A, see [`torque_unit`](Self::torque_unit)); absent where only a prediction is wanted.
    pub torque: Option<Samples>,
    /// What `torque` is measured in.
    pub torque_unit: TorqueUnit,
    /// Torsional deflection θ = q_m/N − q_o, rad.
    pub deflection_rad: Option<Samples>,
    /// Motor-side (wave generator) angle q_m, rad.
    pub theta_in_rad: Option<Samples>,
    /// Output-side angle q_o, rad.
    pub theta_out_rad: Option<Samples>,
    /// Output velocity, rad/s.
    pub velocity_out_rad_per_s: Option<Samples>,
    /// Gear temperature, °C.
    pub temperature_c: Option<Samples>,
    /// Another simulator's torque for the same rows, N·m.
    pub torque_sim_nm: Option<Samples>,
    /// Rows before the first, of which only the path counts: where the deflection turned before. `None` where the recording begins at rest.
    pub past: Option<Arc<Recording>>,
}

impl Recording {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// True for a recording without rows.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// The first rows of it.
    #[must_use]
    pub fn beginning(&self, rows: usize) -> Self {
        self.part(0..rows)
    }

    /// Some consecutive rows of it.
    #[must_use]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Self {
        let end = rows.end.min(self.len());
        self.picked(&(rows.start.min(end)..end).collect::<Vec<usize>>())
    }

    /// Some consecutive rows of it, and of the rows before them those at which the deflection turned and that hysteresis still remembers.
    #[must_use]
    pub fn part_with_past(&self, rows: std::ops::Range<usize>) -> Self {
        let remembered = self.deflection_rad.as_ref().map(|theta| remembered(&theta[..rows.start])).unwrap_or_default();
        let past = (!remembered.is_empty()).then(|| Arc::new(self.picked(&remembered)));
        Self { past, ..self.part(rows) }
    }

    /// Some rows of it, in order.
    ///
    /// # Panics
    /// If it has no such row.
    #[must_use]
    pub fn picked(&self, rows: &[usize]) -> Self {
        let pick = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Samples>();
        let cut = |column: &Option<Samples>| column.as_deref().map(pick);
        Self {
            name: self.name.clone(),
            sha256: self.sha256.clone(),
            time_s: pick(&self.time_s),
            torque: cut(&self.torque),
            torque_unit: self.torque_unit,
            deflection_rad: cut(&self.deflection_rad),
            theta_in_rad: cut(&self.theta_in_rad),
            theta_out_rad: cut(&self.theta_out_rad),
            velocity_out_rad_per_s: cut(&self.velocity_out_rad_per_s),
            temperature_c: cut(&self.temperature_c),
            torque_sim_nm: cut(&self.torque_sim_nm),
            past: self.past.clone(),
        }
    }

    /// The recording in means of so many rows each; of the torque without what stands out of its rows, lest an outlier spoil a mean.
    #[must_use]
    pub fn in_means(&self, rows: usize) -> Self {
        let means = |values: &[f64]| values.chunks(rows).map(mean).collect::<Samples>();
        let thin = |column: &Option<Samples>| column.as_deref().map(means);
        Self {
            name: self.name.clone(),
            sha256: self.sha256.clone(),
            time_s: means(&self.time_s),
            torque: self.torque.as_deref().map(|torque| torque.chunks(rows).map(mean_without_outliers).collect()),
            torque_unit: self.torque_unit,
            deflection_rad: thin(&self.deflection_rad),
            theta_in_rad: thin(&self.theta_in_rad),
            theta_out_rad: thin(&self.theta_out_rad),
            velocity_out_rad_per_s: thin(&self.velocity_out_rad_per_s),
            temperature_c: thin(&self.temperature_c),
            torque_sim_nm: thin(&self.torque_sim_nm),
            past: self.past.clone(),
        }
    }

    /// Computes θ = q_m/N − q_o where no deflection was recorded but both angles were. A recorded deflection wins; a joint log stays without.
    ///
    /// # Errors
    /// [`RecordingProblem::NoRatio`] where there are two angles and no ratio.
    pub fn derive_deflection(&mut self, ratio: Option<f64>) -> Result<(), RecordingError> {
        let (None, Some(input), Some(output)) = (&self.deflection_rad, &self.theta_in_rad, &self.theta_out_rad) else {
            return Ok(());
        };
        let ratio = ratio.ok_or_else(|| self.refuse(RecordingProblem::NoRatio { shown: None }))?;
        self.deflection_rad = Some(input.iter().zip(output).map(|(q_m, q_o)| q_m / ratio - q_o).collect());
        Ok(())
    }

    /// Whether it is a joint log: an angle, and no deflection to be had.
    pub fn is_joint_log(&self) -> bool {
        self.deflection_rad.is_none() && self.theta_in_rad.is_some() != self.theta_out_rad.is_some()
    }

    /// The deflection, or [`RecordingProblem::NoDeflection`].
    pub fn deflection(&self) -> Result<&[f64], RecordingError> {
        self.deflection_rad.as_deref().ok_or_else(|| self.refuse(RecordingProblem::NoDeflection))
    }

    /// The largest abs(θ) about `zero_rad`, rad: the rated deflection where none is stated. `None` without a deflection.
    pub fn largest_deflection_rad(&self, zero_rad: f64) -> Option<f64> {
        self.deflection_rad.as_ref().map(|theta| theta.iter().fold(0.0, |a: f64, x| a.max((x - zero_rad).abs())))
    }

    fn refuse(&self, problem: RecordingProblem) -> RecordingError {
        RecordingError::of_file(&self.name, problem)
    }
}

/// The first row, and those at which a signal turned and has not been passed since: greatest and least, and between the later of them and the end the same again.
fn remembered(signal: &[f64]) -> Vec<usize> {
    /// Turning points at most; later ones are smaller than what a measurement resolves.
    const MOST: usize = 64;
    if signal.is_empty() {
        return Vec::new();
    }
    let last_extreme = |from: usize, sign: f64| {
        (from..signal.len()).max_by(|a, b| (sign * signal[*a]).total_cmp(&(sign * signal[*b]))).unwrap_or(from)
    };
    let (highest, lowest) = (last_extreme(0, 1.0), last_extreme(0, -1.0));
    let mut rows = vec![0, highest.min(lowest), highest.max(lowest)];
    let mut sign = if highest > lowest { -1.0 } else { 1.0 };
    while let Some(&last) = rows.last()
        && last + 1 < signal.len()
        && rows.len() < MOST
    {
        rows.push(last_extreme(last + 1, sign));
        sign = -sign;
    }
    rows.dedup();
    rows
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of what lies within eight median deviations of the median.
fn mean_without_outliers(values: &[f64]) -> f64 {
    const FARTHEST: f64 = 8.0;
    let centre = robust::median(&mut values.to_vec());
    let deviation = robust::median(&mut values.iter().map(|x| (x - centre).abs()).collect::<Vec<f64>>());
    let near: Vec<f64> = values.iter().copied().filter(|x| (x - centre).abs() <= FARTHEST * deviation).collect();
    mean(&near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turning_point_is_remembered_until_it_is_passed() {
        //            0    1    2     3    4    5    6    7    8
        let signal = [0.0, 0.4, -0.3, 1.0, 0.2, 0.6, 0.1, 0.5, 0.3];
        assert_eq!(remembered(&signal), [0, 2, 3, 6, 7, 8]);
        assert_eq!(remembered(&signal[..3]), [0, 1, 2]);
        assert_eq!(remembered(&[0.0, 1.0, 2.0]), [0, 2]);
        assert!(remembered(&[]).is_empty());
    }

    #[test]
    fn means_keep_slopes_and_drop_outliers() {
        let line: Vec<f64> = (0..100).map(f64::from).collect();
        let mut torque = line.clone();
        torque[37] = 1e4;
        let recording = Recording { time_s: line.into(), torque: Some(torque.into()), ..Recording::default() };
        let means = recording.in_means(10);
        assert_eq!(means.time_s, (0..10).map(|k| 4.5 + 10.0 * f64::from(k)).collect::<Vec<f64>>());
        let torque = means.torque.unwrap();
        assert!(means.time_s.iter().zip(&torque).all(|(t, x)| (t - x).abs() < 0.5), "{torque:?}");
    }
}
