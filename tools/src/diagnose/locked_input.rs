//! Friction of the output where the input is locked: the output turns by the deflection alone, so friction that builds up with its travel is a memory of the deflection, too.

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::Search;
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::nonparametric::Coordinates;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::signal::plausible::correlation;

/// The input is locked where the output angle follows the deflection with so little left, a part of its standard deviation.
const LEFT_OF_LOCKED: f64 = 0.02;

impl Dataset<'_> {
    /// Where the input is locked: a friction that is a memory of the deflection there becomes a part of such a memory where both are named, and has it as an equivalent where it is named alone.
    pub(super) fn unite_with_memory(
        &self,
        verdict: &mut DiagnosisVerdict,
        search: Search<'_>,
    ) -> Result<(), DiagnoseError> {
        let memory_of = |name: &str| kinds::of(name)?.at_locked_input().filter(|memory: &&str| search.allows(memory));
        let mut frictions = verdict.effects.iter().enumerate();
        let Some((at, memory)) = frictions.find_map(|(at, effect)| Some((at, memory_of(&effect.name)?))) else {
            return Ok(());
        };
        if !self.has_locked_input(verdict)? {
            return Ok(());
        }
        let takes_in = |name: &str| kinds::of(name).is_some_and(|kind| kind.takes_in().contains(&memory));
        let is_memory = |name: &str| name == memory || takes_in(name);
        if let Some(whole) = verdict.effects.iter().position(|effect| is_memory(&effect.name)) {
            let share = verdict.effects[at].share;
            let whole = &mut verdict.effects[whole];
            whole.share = (whole.share + share).min(1.0);
            verdict.effects.remove(at);
        } else {
            let class = &mut verdict.effects[at].equivalents;
            class.push(memory.to_owned());
            class.sort();
            class.dedup();
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
