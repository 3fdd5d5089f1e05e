//! Two kinds that hide each other: a delay of the torque and damping cancel each other almost, and neither explains what is left of them alone.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates::Proposal;
use crate::diagnose::explain::{Search, is_delay};
use crate::diagnose::search::MARGIN;
use crate::kinds;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::heldout_rows::improves_heldout;

/// Two kinds hide each other where they explain so many times together what they explain apart.
const LEAST_TOGETHER: f64 = 2.0;
/// Pairs of kinds that are fitted.
const MOST_TRIED: usize = 4;
/// Steps of their fit.
const STEPS: usize = 6;
/// Two candidates of which one has less than this part beyond the other are one.
const DEPENDENT: f64 = 1e-3;

impl Dataset<'_> {
    /// A fit with two kinds beside which each is needed, where none is alone; `None` where there are none. `proposals` are the candidates beside `fit`.
    pub(super) fn with_hidden_pair(
        &self,
        fit: &Fitted,
        proposals: &[Proposal],
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let mut best: Option<(f64, Fitted)> = None;
        for both in self.pairs(fit, proposals) {
            let Some(with) = self.fitted_pair(fit, both, search)? else { continue };
            let added = fit.model.terms.len()..with.model.terms.len();
            let delay = added.clone().find(|term| is_delay(&with.model.terms[*term]));
            let net = self.gain_of(delay.unwrap_or(added.start), &with, fit) - self.price(both);
            let is_better = net > 0.0 && best.as_ref().is_none_or(|(most, _)| net > *most);
            if is_better && improves_heldout(&self.gain_of_blocks(&with, fit, &with.noise)) {
                best = Some((net, with));
            }
        }
        Ok(best.map(|(_, with)| with))
    }

    /// What two candidates have to gain of −2 ln L before they are believed.
    fn price(&self, both: [&Proposal; 2]) -> f64 {
        both.iter().map(|proposal| self.penalty(proposal.parameters())).sum::<f64>() + MARGIN
    }

    /// Of each two kinds that hide each other the best candidates, the best pair first.
    fn pairs<'p>(&self, fit: &Fitted, proposals: &'p [Proposal]) -> Vec<[&'p Proposal; 2]> {
        let (layout, noise) = (self.layout(), &fit.noise);
        let (base, y) = self.whitened(fit, noise);
        let own = |proposal: &Proposal| -> Vec<Vec<f64>> {
            base.beyond(&proposal.columns.iter().map(|column| layout.whiten(noise, column)).collect::<Vec<_>>())
        };
        let apart: Vec<&Proposal> = proposals.iter().filter(|proposal| proposal.extends.is_none()).collect();
        let columns: Vec<Vec<Vec<f64>>> = apart.par_iter().map(|proposal| own(proposal)).collect();
        let places: Vec<std::ops::Range<usize>> = columns
            .iter()
            .scan(0, |end, own| {
                let start = *end;
                *end += own.len();
                Some(start..*end)
            })
            .collect();
        let all: Vec<f64> = columns.into_iter().flatten().flatten().collect();
        let all = DMatrix::from_vec(y.len(), all.len() / y.len().max(1), all);
        let (products, against) = (all.tr_mul(&all), all.tr_mul(&DVector::from_vec(y)));
        let explained = |columns: &[usize]| -> Option<f64> {
            let among = products.select_rows(columns).select_columns(columns).cholesky()?;
            let is_distinct = among.l_dirty().diagonal().iter().all(|pivot| pivot * pivot > DEPENDENT);
            let against = against.select_rows(columns);
            is_distinct.then(|| against.dot(&among.solve(&against)))
        };
        let alone: Vec<f64> =
            places.iter().map(|own| own.clone().map(|column| against[column].powi(2)).sum()).collect();
        // Of each two kinds what the best candidates gain net, and these.
        let mut best: BTreeMap<[&str; 2], (f64, [&'p Proposal; 2])> = BTreeMap::new();
        for (i, first) in apart.iter().enumerate() {
            for (j, second) in apart.iter().enumerate().skip(i + 1) {
                let kinds = [first.info.name, second.info.name];
                let [one, other] = kinds;
                if one == other || kinds::contains(one, other) || kinds::contains(other, one) {
                    continue;
                }
                let columns: Vec<usize> = places[i].clone().chain(places[j].clone()).collect();
                let Some(gain) = explained(&columns) else { continue };
                let net = gain - self.price([first, second]);
                let is_best = best.get(&kinds).is_none_or(|(most, _)| net > *most);
                if net > 0.0 && gain > LEAST_TOGETHER * (alone[i] + alone[j]) && is_best {
                    best.insert(kinds, (net, [first, second]));
                }
            }
        }
        let mut best: Vec<(f64, [&Proposal; 2])> = best.into_values().collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.into_iter().take(MOST_TRIED).map(|(_, both)| both).collect()
    }

    /// A fit with two candidates; `None` where one of them ends as no term of its kind.
    fn fitted_pair(
        &self,
        fit: &Fitted,
        [first, second]: [&Proposal; 2],
        search: Search<'_>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let both = first.columns.iter().chain(&second.columns);
        let (profile, weights) = self.profile_beside(fit, &fit.noise, both);
        let (of_first, of_second) = weights.split_at(first.columns.len());
        if !first.accepts(of_first) || !second.accepts(of_second) {
            return Ok(None);
        }
        let with_first = first.applied(&fit.model, of_first);
        let start = second.applied(&with_first, of_second);
        let with = self.fit(&start, &self.parameters(&start, search), Some(&profile.noise), STEPS)?;
        let mut first_alone = with.model.clone();
        first_alone.terms.pop();
        Ok((first.accepts_fitted(&first_alone) && second.accepts_fitted(&with.model)).then_some(with))
    }
}
