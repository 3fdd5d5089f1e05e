//! From recordings to rows: deflection, torque, scale, and what each row may be used for.

use crate::fit::options::{FitOptions, Method};
use crate::fit::select;
use crate::fit::start::{Start, decide_start};
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::zeros;
use crate::fit::zeros::Zeros;
use crate::model::GearSection;
use crate::numerics::extremes::range;
use crate::recording::{Recording, TorqueUnit};
use crate::regression::base::Structure;
use crate::regression::error::EstimateError;
use crate::regression::rows;
use crate::regression::rows::Rows;
use crate::regression::rows::torque_size;
use crate::signal::encoder_zeros;
use crate::signal::plausible;

/// Recordings ready to be fitted.
pub struct Prepared<'a> {
    /// Their rows, the deflection beside its zeros.
    pub rows: Vec<Rows<'a>>,
    /// The gear section of the model given, if any.
    pub gear: GearSection,
    /// A, rad.
    pub rated_deflection_rad: f64,
    /// Scale of the torque, N·m.
    pub torque_nm: f64,
    /// How each begins.
    pub start: Start,
    /// What was taken off the deflections beside the zero of the gear section.
    pub zeros: Zeros,
}

impl<'a> Prepared<'a> {
    /// The rows of recordings, their zeros found or `known`.
    ///
    /// # Errors
    /// As [`fit`](crate::fit::fit()).
    pub fn new(recordings: &'a [Recording], options: &FitOptions, known: Option<Zeros>) -> Result<Self, EstimateError> {
        let gear = options.gear(recordings.first().map_or(TorqueUnit::NewtonMetre, |recording| recording.torque_unit));
        if let Some(term) = options.start.as_ref().and_then(|m| m.terms.first()) {
            return Err(EstimateError::HasTerms { kind: term.kind.clone() });
        }
        let mut rows = rows::of_recordings(recordings, &gear)?;
        let torque_nm = torque_size(&rows);
        if torque_nm <= 0.0 {
            return Err(EstimateError::NoTorqueChange { recording: rows[0].recording.name.clone() });
        }
        rows.iter().try_for_each(believable)?;
        all_move(&rows)?;
        let given = options.rated_deflection_rad.or(gear.rated_deflection_rad);
        let zeros = match known {
            Some(zeros) => zeros,
            None => zeros::settle(
                &rows,
                &zeros::structures(options.start.as_ref().and_then(|model| model.memory.as_ref())),
                given,
                options.own_zeros,
            )?,
        };
        rows.iter_mut().zip(&zeros.rad).filter(|(_, zero)| **zero != 0.0).for_each(|(rows, zero)| rows.shift(*zero));
        let rated_deflection_rad = given.unwrap_or_else(|| zeros::largest(&rows, |_| 0.0));
        if encoder_zeros::apart(&zeros.rad).is_none() {
            reach_each_other(&rows)?;
        }
        for (rows, zero) in rows.iter().zip(&zeros.rad) {
            let zero_rad = gear.deflection_zero_rad + zero;
            plausible::within(&rows.recording.name, &rows.deflection_rad, rated_deflection_rad, zero_rad)?;
        }
        let start = decide_start(&mut rows, rated_deflection_rad)?;
        Ok(Self { rows, gear, rated_deflection_rad, torque_nm, start, zeros })
    }

    /// What to choose from: the model's structure if there is one, else all.
    pub fn structures(&self, options: &FitOptions) -> Vec<Structure> {
        match options.start.as_ref().and_then(|m| m.memory.as_ref()) {
            Some(memory) => vec![Structure::of(memory)],
            None if options.method == Method::Pso => vec![Structure::MASING],
            None => select::structures(self.rated_deflection_rad),
        }
    }
}

/// Refuses numbers whose powers and products are none.
pub fn believable(rows: &Rows<'_>) -> Result<(), EstimateError> {
    let [least, most] = THRESHOLDS.believable;
    let unit = rows.recording.torque_unit;
    let channels: [(&'static str, &[f64], &'static str); 2] =
        [("deflection", &rows.deflection_rad, "rad"), (unit.quantity(), &rows.torque, unit.symbol())];
    for (what, values, unit) in channels {
        let (low, high) = range(values);
        let size = high - low;
        if size != 0.0 && !(least..most).contains(&size) {
            return Err(EstimateError::Absurd { recording: rows.recording.name.clone(), what, size, unit });
        }
    }
    Ok(())
}

/// Refuses recordings that tell nothing beside others.
pub fn all_move(rows: &[Rows<'_>]) -> Result<(), EstimateError> {
    for rows in rows.iter().filter(|_| rows.len() > 1) {
        let constant = |values: &[f64]| values.windows(2).all(|pair| pair[0] == pair[1]);
        let recording = || rows.recording.name.clone();
        if constant(&rows.torque) {
            return Err(EstimateError::Still { recording: recording(), what: rows.recording.torque_unit.quantity() });
        }
        if constant(&rows.deflection_rad) {
            return Err(EstimateError::Still { recording: recording(), what: "deflection" });
        }
    }
    Ok(())
}

/// Refuses recordings whose deflections lie too far from each other to be of one gear and one zero.
pub fn reach_each_other(rows: &[Rows<'_>]) -> Result<(), EstimateError> {
    let Some((first, others)) = rows.split_first() else { return Ok(()) };
    let (low, high) = range(&*first.deflection_rad);
    for other in others {
        let (left, right) = range(&*other.deflection_rad);
        let apart_rad = 0.5 * ((left + right) - (low + high)).abs();
        // Loads to one side and to the other meet at least at rest.
        if apart_rad > (high - low) + (right - left) {
            let (first, other) = (first.recording.name.clone(), other.recording.name.clone());
            return Err(EstimateError::OtherZero { first, other, apart_rad });
        }
    }
    Ok(())
}
