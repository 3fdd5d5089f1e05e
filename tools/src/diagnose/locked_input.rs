//! Friction of the output where the input is locked: the output turns by the deflection alone, so friction that builds up with its travel is a memory of the deflection, too, and viscous friction is damping.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict, unite};
use crate::diagnose::nonparametric::Coordinates;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::signal::plausible::correlation;

/// The input is locked where the output angle follows the deflection with so little left, a part of its standard deviation.
const LEFT_OF_LOCKED: f64 = 0.02;

impl Dataset<'_> {
    /// With the input locked, an effect of the output and one of the deflection can be the same. If both are named, they become one effect; if one is named, the other becomes its equivalent.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn unite_at_locked_input(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let terms = &verdict.extended.model.terms;
        let other_name = |effect: &EffectVerdict| {
            let term = &terms[effect.term?];
            let other = kinds::of(&effect.name)?.at_locked_input(term)?;
            search.allows(other).then_some(other)
        };
        if verdict.effects.iter().all(|effect| other_name(effect).is_none()) || !self.has_locked_input(verdict)? {
            return Ok(());
        }
        let mut at = 0;
        while at < verdict.effects.len() {
            let Some(other) = other_name(&verdict.effects[at]) else {
                at += 1;
                continue;
            };
            let takes_in = |name: &str| kinds::of(name).is_some_and(|kind| kind.takes_in().contains(&other));
            let is_other = |name: &str| name == other || takes_in(name);
            if let Some(whole) = verdict.effects.iter().position(|effect| is_other(&effect.name)) {
                unite(&mut verdict.effects, whole, at);
            } else {
                let class = &mut verdict.effects[at].equivalents;
                class.push(other.to_owned());
                class.sort();
                class.dedup();
                at += 1;
            }
        }
        Ok(())
    }

    /// Whether the output turns by the deflection alone.
    fn has_locked_input(&self, verdict: &DiagnosisVerdict) -> Result<bool, DiagnoseError> {
        let evaluations = self.evaluate(&verdict.base.model)?;
        let see = Coordinates::new(self, &evaluations);
        let (Some(output), Some(deflection)) = (&see.output, &see.deflection) else { return Ok(false) };
        let apart =
            |span: &std::ops::Range<usize>| 1.0 - correlation(&output[span.clone()], &deflection[span.clone()]).powi(2);
        Ok(self.spans.iter().all(|span| apart(span) < LEFT_OF_LOCKED.powi(2)))
    }
}
