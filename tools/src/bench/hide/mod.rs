//! `--hide`: physics beyond the base model, injected at a size that counts.
//!
//! SIZE is the rms in N·m that an effect leaves after the base model is refitted to the recording of perfect sensors. So an effect is drawn from the seed
//! (shape, phases, widths), put into the gear, the base model and the encoders' zero refitted by the estimator's linear elimination, and the effect scaled until what
//! is left has the size. Each effect is sized by itself, in the order given, with those before it in place; their torque is not counted.

mod request;
mod sizing;

pub use request::{Hidden, Hide, HideError};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::bench::error::BenchError;
use crate::bench::stage::Stage;
use crate::kinds;
use crate::kinds::measures::Measures;
use crate::model::Model;
use crate::progress::Progress;

/// The model with the effects in it, and what they are.
pub(super) fn inject(
    model: &Model,
    hides: &[Hide],
    stage: &Stage,
    random: &mut ChaCha8Rng,
    progress: &dyn Progress,
) -> Result<(Model, Vec<Hidden>), BenchError> {
    let mut truth = model.clone();
    let mut hidden = Vec::new();
    for (at, hide) in hides.iter().enumerate() {
        // How many trials a size takes is not known before: half of what is left, each.
        let tried = |trial: usize| {
            let of_this = 1.0 - 0.5_f64.powi(trial as i32);
            progress.report("Finding the sizes", (at as f64 + of_this) / hides.len() as f64);
        };
        let measures = Measures::of(&stage.record(&truth)?);
        let kind = kinds::of(&hide.kind).ok_or_else(|| HideError::Kind(hide.kind.clone()))?;
        let shape = match (&hide.shape, kind.hidden_shapes()) {
            (Some(shape), _) => shape,
            (None, []) => "",
            (None, shapes) => shapes[random.random_range(0..shapes.len())],
        };
        let draft = kind.draft(shape, &measures, random);
        let (term, effect) = sizing::size(&truth, &draft, hide, stage, &tried)?;
        truth.terms.push(term);
        hidden.push(effect);
    }
    Ok((truth, hidden))
}
