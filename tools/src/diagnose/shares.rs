//! What part of the structure each effect explains.

use crate::diagnose::DiagnoseError;
use crate::diagnose::naming::EffectVerdict;
use crate::model::Model;
use crate::numerics::basis::Basis;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

impl Dataset<'_> {
    /// What the term `term` adds to the torque `total` of a model.
    pub fn added_by(&self, model: &Model, total: &[f64], term: usize) -> Result<Vec<f64>, DiagnoseError> {
        let mut without = model.clone();
        without.terms.remove(term);
        Ok(total.iter().zip(self.total(&without)?).map(|(with, without)| with - without).collect())
    }

    /// What part of the structure each term of the extended model explains. Where terms overlap they share what they explain together: a part is the mean product of
    /// the structure with what the term adds to the torque, both beyond what the base model follows, over the mean square of the structure.
    pub fn share_out(
        &self,
        base: &Fitted,
        extended: &Fitted,
        effects: &mut [EffectVerdict],
    ) -> Result<(), DiagnoseError> {
        let mut followed = Basis::default();
        for column in &base.columns {
            followed.add(&self.layout().masked(column));
        }
        let structure: Vec<f64> = base.residual.iter().zip(&extended.residual).map(|(b, e)| b - e).collect();
        let mut structure = self.layout().masked(&structure);
        followed.reduce(&mut structure);
        let whole = dot(&structure, &structure);
        let total = self.total(&extended.model)?;
        for effect in effects.iter_mut() {
            let Some(at) = effect.term else { continue };
            let mut added = self.layout().masked(&self.added_by(&extended.model, &total, at)?);
            followed.reduce(&mut added);
            let part = dot(&added, &structure) / whole.max(f64::MIN_POSITIVE);
            // Of terms that work against each other one has less than no part; what it saves in its place is there all the same.
            effect.share = part.max(effect.share).clamp(0.0, 1.0);
        }
        Ok(())
    }
}
