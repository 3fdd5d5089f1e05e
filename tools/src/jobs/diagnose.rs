//! `gmhm diagnose` on recordings that are read.

use super::Notes;
use super::ready::ratio_of_joint;
use crate::diagnose::{self, Finding, Options};
use crate::failure::Failure;
use crate::fit::zeros;
use crate::model::{Base, GearSection, Model};
use crate::number::number;
use crate::progress::Progress;
use crate::recording::{Need, Needs, Recording};
use crate::signal::encoder_zeros;

/// Time and torque; motion as far as the terms of the model need it, which its evaluation says.
pub const NEEDS: Needs = Needs { motion: Need::IfPresent, ..Needs::FIT };

/// The base where no model is given: another simulator's torque.
pub fn simulation() -> Model {
    Model { gear: GearSection { base: Base::Simulation, ..GearSection::default() }, ..Model::default() }
}

/// A finding, and the recordings as they were diagnosed.
pub struct Diagnosed {
    /// The finding.
    pub finding: Finding,
    /// The recordings.
    pub recordings: Vec<Recording>,
    /// Those that took no part.
    pub holdout: Vec<Recording>,
}

/// Diagnoses recordings that are [ready](super::ready::ready). With `own_zeros` the deflection of each is first shifted to the zero of the first.
///
/// # Errors
/// Recordings that cannot be used, a model that cannot be evaluated; cancelled by `progress`.
pub fn find(
    mut model: Model,
    mut recordings: Vec<Recording>,
    mut holdout: Vec<Recording>,
    options: &Options,
    own_zeros: bool,
    progress: &dyn Progress,
    notes: Notes<'_>,
) -> Result<Diagnosed, Failure> {
    model.gear.ratio = ratio_of_joint(&model, &recordings, notes);
    if own_zeros {
        let all: Vec<&Recording> = recordings.iter().chain(&holdout).collect();
        let apart = zeros::between(&all, &model)?.unwrap_or_default();
        for (recording, zero) in all.iter().zip(&apart).skip(1) {
            let zero = number(*zero, 5);
            notes(&format!("{}: its zero is {zero} rad from that of {}", recording.name, all[0].name));
        }
        for (recording, zero) in recordings.iter_mut().chain(&mut holdout).zip(apart) {
            encoder_zeros::take_off(recording, zero, model.gear.ratio)?;
        }
    }
    let finding = diagnose::diagnose(&recordings, &model, &holdout, options, progress)?;
    Ok(Diagnosed { finding, recordings, holdout })
}
