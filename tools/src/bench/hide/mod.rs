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

/// The model with the effects in it, and what they are.
pub(super) fn inject(
    model: &Model,
    hides: &[Hide],
    stage: &Stage,
    random: &mut ChaCha8Rng,
) -> Result<(Model, Vec<Hidden>), BenchError> {
    let mut truth = model.clone();
    let mut hidden = Vec::new();
    for hide in hides {
        let measures = Measures::of(&stage.record(&truth)?);
        let kind = kinds::of(&hide.kind).ok_or_else(|| HideError::Kind { kind: hide.kind.clone() })?;
        let shape = match (&hide.shape, kind.hidden_shapes()) {
            (Some(shape), _) => shape,
            (None, []) => "",
            (None, shapes) => shapes[random.random_range(0..shapes.len())],
        };
        let draft = kind.draft(shape, &measures, random);
        let (term, effect) = sizing::size(&truth, &draft, hide, stage)?;
        truth.terms.push(term);
        hidden.push(effect);
    }
    Ok((truth, hidden))
}
