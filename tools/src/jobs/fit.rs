//! `gmhm fit` on recordings that are read.

use super::Notes;
use super::ready::ratio_of_joint;
use crate::failure::Failure;
use crate::fit::verdict::Assessment;
use crate::fit::{self, Fit, FitOptions};
use crate::health::{self, condition::Condition};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::report::fit_words::{self, WordedVerdict};
use crate::signal::plausible;

/// Recordings of one gear, fitted, and the fit assessed.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The fit.
    pub fit: Fit,
    /// The recordings, deflections derived and shifted to one zero.
    pub recordings: Vec<Recording>,
    /// How far the fit may be trusted.
    pub assessment: Assessment,
}

/// Fits recordings that are [ready](super::ready::ready), and assesses the fit; with other models beside it where `compares`, which takes several times as long. `name` is
/// the model's; else it is that of the start, or of the first recording.
///
/// # Errors
/// What cannot be fitted or assessed; cancelled by `progress`.
pub fn identify(
    mut recordings: Vec<Recording>,
    options: &FitOptions,
    name: Option<String>,
    compares: bool,
    progress: &dyn Progress,
    notes: Notes<'_>,
) -> Result<Identified, Failure> {
    plausible::repeated(&recordings, &[]).iter().for_each(|remark| notes(&remark.to_string()));
    let mut options = options.clone();
    if let (None, Some(model)) = (options.ratio, &options.start) {
        options.ratio = ratio_of_joint(model, &recordings, notes);
    }
    let mut fit = fit::fit(&recordings, &options, progress)?;
    if let Some(name) = name {
        fit.model.name = name;
    }
    for recording in &mut recordings {
        recording.derive_deflection(fit.model.gear.ratio)?;
    }
    fit.align(&mut recordings)?;
    let assessment = match compares {
        true => Assessment::of(&fit, &recordings, progress)?,
        false => Assessment::of_model_alone(&fit, &recordings, progress)?,
    };
    Ok(Identified { fit, recordings, assessment })
}

/// What `gmhm fit --json` writes.
#[derive(Debug, serde::Serialize)]
pub struct FitResults<'a> {
    /// The verdict in words.
    pub verdict: WordedVerdict,
    /// What it rests on.
    #[serde(flatten)]
    pub assessment: &'a Assessment,
    /// The fit.
    #[serde(flatten)]
    pub fit: &'a Fit,
    /// K1, K2, K3, hysteresis loss and lost motion; none of a joint log.
    pub catalogue: Option<Condition>,
}

impl Identified {
    /// Everything that is known about the fit.
    pub fn results(&self) -> FitResults<'_> {
        let verdict = fit_words::worded(&self.assessment.verdict, self.fit.model.torque_unit);
        let catalogue = health::catalogue_figures(&self.recordings, &self.fit);
        FitResults { verdict, assessment: &self.assessment, fit: &self.fit, catalogue }
    }
}
