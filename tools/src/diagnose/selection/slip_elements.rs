//! Which slip elements of a grid a memory has: those of positive torque.

use rayon::prelude::*;

use super::criterion::Candidate;
use super::dictionary::{Dictionary, Origin};
use crate::kinds::{self, Kind};
use crate::numerics::block_gram::{BlockGram, Chosen, Targets};

/// Those of some columns whose weights are positive beside others, the most negative left out in turn.
fn positive(gram: &BlockGram, targets: &Targets, beside: &[usize], own: &[usize]) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..own.len()).collect();
    loop {
        let chosen: Vec<usize> = beside.iter().copied().chain(kept.iter().map(|k| own[*k])).collect();
        let weights = gram.weights(targets, &Chosen::plain(&chosen));
        let weights = &weights[beside.len()..];
        let worst = (0..kept.len()).filter(|i| weights[*i] <= 0.0).min_by(|a, b| {
            let size = |i: usize| weights[i] * gram.scale_of(own[kept[i]]);
            size(*a).total_cmp(&size(*b))
        });
        match worst {
            Some(worst) => drop(kept.remove(worst)),
            None => return kept,
        }
    }
}

impl Dictionary {
    /// Gives a memory of several elements only those whose torque is positive beside the base, and those whose torque is positive beside the found terms, too; see [`Kind::is_of_slip_elements`].
    pub fn prune(&mut self, gram: &BlockGram, targets: &Targets) {
        let found = |kind: &'static str| {
            let others = self.candidates.iter().zip(&self.origins).filter(move |(c, _)| c.kind != kind);
            others.filter(|(_, origin)| matches!(origin, Origin::Found(_))).flat_map(|(c, _)| c.columns.iter().copied())
        };
        let of_elements = |c: &usize| {
            kinds::of(self.candidates[*c].kind).is_some_and(Kind::is_of_slip_elements)
                && self.candidates[*c].columns.len() > 1
        };
        let memories: Vec<usize> = (0..self.candidates.len()).filter(of_elements).collect();
        let pruned: Vec<(usize, Vec<usize>, Option<Vec<usize>>)> = memories
            .into_par_iter()
            .map(|c| {
                let own = &self.candidates[c];
                let alone = positive(gram, targets, &self.base, &own.columns);
                let beside: Vec<usize> = self.base.iter().copied().chain(found(own.kind)).collect();
                let more = beside.len() > self.base.len() && matches!(self.origins[c], Origin::Proposed(..));
                let beside = more.then(|| positive(gram, targets, &beside, &own.columns));
                let beside = beside.filter(|beside| *beside != alone);
                (c, alone, beside)
            })
            .collect();
        for (c, alone, beside) in pruned {
            if let Some(kept) = beside {
                let (candidate, origin) = self.with_elements(c, kept);
                self.candidates.push(candidate);
                self.origins.push(origin);
            }
            (self.candidates[c], self.origins[c]) = self.with_elements(c, alone);
        }
        let keep: Vec<bool> = self.candidates.iter().map(|c| !c.columns.is_empty()).collect();
        let mut flags = keep.iter();
        self.candidates.retain(|_| *flags.next().unwrap_or(&true));
        let mut flags = keep.iter();
        self.origins.retain(|_| *flags.next().unwrap_or(&true));
    }

    /// A candidate with some of its columns.
    fn with_elements(&self, c: usize, kept: Vec<usize>) -> (Candidate, Origin) {
        let own = &self.candidates[c];
        let candidate = Candidate {
            columns: kept.iter().map(|k| own.columns[*k]).collect(),
            positive: kept.iter().map(|k| own.positive[*k]).collect(),
            limits: kept.iter().map(|k| own.limits[*k]).collect(),
            largest: kept.iter().map(|k| own.largest[*k]).collect(),
            ..own.clone()
        };
        let origin = match self.origins[c] {
            Origin::Proposed(proposal, _) => Origin::Proposed(proposal, kept),
            Origin::Found(term) => Origin::Found(term),
        };
        (candidate, origin)
    }
}
