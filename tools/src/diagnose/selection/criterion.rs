//! What a set of kinds is judged by: the squared error of blocks held out, each predicted by a fit to the others, and a price for each kind.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use rayon::prelude::*;

use crate::kinds::{self, FURTHER_ELEMENT_PRICE};
use crate::numerics::block_gram::{BLOCKS, BlockGram, Chosen, Targets};

/// One way in which a kind may enter: columns of the Gram matrix and what their weights must be.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The kind.
    pub kind: &'static str,
    /// Its columns.
    pub columns: Vec<usize>,
    /// Which weights have to be positive for the kind to be of its kind.
    pub positive: Vec<bool>,
    /// The largest value of each column, before what is each recording's own was taken out of it.
    pub largest: Vec<f64>,
    /// What it costs, as a share of what is predictable.
    pub price: f64,
    /// A kind that this shape needs beside it.
    pub refines: Option<&'static str>,
    /// Whether further candidates of the kind may stand beside it: orders, elements.
    pub additive: bool,
}

/// Kinds in a set, each with the candidates that stand for it.
pub type Set = BTreeMap<&'static str, Vec<usize>>;

/// A search over candidates.
pub struct Search<'a> {
    /// Gram matrices of all columns.
    pub gram: &'a BlockGram,
    /// All columns.
    pub columns: &'a [Vec<f64>],
    /// Rows that count.
    pub counts: &'a [bool],
    /// The rows of each recording.
    pub spans: &'a [std::ops::Range<usize>],
    /// The target.
    pub y: &'a [f64],
    /// The target beside the columns.
    pub targets: &'a Targets,
    /// Columns of the base model and the offsets: always in.
    pub base: Vec<usize>,
    /// Kinds that the base model holds.
    pub in_base: Vec<&'static str>,
    /// What may be chosen.
    pub candidates: &'a [Candidate],
    /// The span of the torque.
    pub torque_span: f64,
    /// The columns and the ridge of the best free description.
    pub free: (Vec<usize>, f64),
    /// The squares that prices are shares of.
    pub scale: f64,
    /// The seed of the surrogates.
    pub seed: u64,
    cache: RefCell<HashMap<Vec<usize>, [f64; BLOCKS]>>,
}

/// A kind that lessens what is left by a factor e is worth this share of what is predictable, be ever so little left,
const RELATIVE: f64 = 0.002;
/// down to this share.
const NEGLIGIBLE: f64 = 1e-4;

impl<'a> Search<'a> {
    /// A search; see the fields.
    #[expect(clippy::too_many_arguments, reason = "the fields, in order")]
    pub fn new(
        gram: &'a BlockGram,
        columns: &'a [Vec<f64>],
        counts: &'a [bool],
        spans: &'a [std::ops::Range<usize>],
        y: &'a [f64],
        targets: &'a Targets,
        base: Vec<usize>,
        in_base: Vec<&'static str>,
        candidates: &'a [Candidate],
        torque_span: f64,
        free: (Vec<usize>, f64),
        scale: f64,
        seed: u64,
    ) -> Self {
        let cache = RefCell::default();
        Self {
            gram,
            columns,
            counts,
            spans,
            y,
            targets,
            base,
            in_base,
            candidates,
            torque_span,
            free,
            scale,
            seed,
            cache,
        }
    }

    /// The columns of the base and a set.
    pub fn columns_of(&self, set: &Set) -> Vec<usize> {
        let own = set.values().flatten().flat_map(|c| self.candidates[*c].columns.iter().copied());
        self.base.iter().copied().chain(own).collect::<BTreeSet<usize>>().into_iter().collect()
    }

    /// The held-out squares of each block with a set.
    pub fn blocks(&self, set: &Set) -> [f64; BLOCKS] {
        let columns = self.columns_of(set);
        if let Some(known) = self.cache.borrow().get(&columns) {
            return *known;
        }
        let error = self.gram.error(self.targets, &Chosen::plain(&columns));
        self.cache.borrow_mut().insert(columns, error);
        error
    }

    /// The held-out squares with a set.
    pub fn squares(&self, set: &Set) -> f64 {
        self.blocks(set).iter().sum()
    }

    /// What a set costs.
    pub fn price(&self, set: &Set) -> f64 {
        let of = |(kind, own): (&&'static str, &Vec<usize>)| {
            let first = own.iter().map(|c| self.candidates[*c].price).fold(0.0, f64::max);
            first
                + FURTHER_ELEMENT_PRICE
                    * kinds::of(kind).map_or(0.0, |k| k.price())
                    * own.len().saturating_sub(1) as f64
        };
        set.iter().map(of).sum()
    }

    /// J of a set.
    pub fn objective(&self, set: &Set) -> f64 {
        let left = self.squares(set) / self.scale;
        left + RELATIVE * (left + NEGLIGIBLE).ln() + self.price(set)
    }

    /// J of many sets, in parallel.
    pub(super) fn objectives(&self, sets: &[Set]) -> Vec<f64> {
        let open: Vec<Vec<usize>> = {
            let cache = self.cache.borrow();
            let columns: BTreeSet<Vec<usize>> = sets.iter().map(|s| self.columns_of(s)).collect();
            columns.into_iter().filter(|c| !cache.contains_key(c)).collect()
        };
        let (gram, targets) = (self.gram, self.targets);
        let found: Vec<[f64; BLOCKS]> = open.par_iter().map(|c| gram.error(targets, &Chosen::plain(c))).collect();
        self.cache.borrow_mut().extend(open.into_iter().zip(found));
        sets.iter().map(|s| self.objective(s)).collect()
    }

    /// The weights of a set's columns, candidate by candidate.
    pub fn weights(&self, set: &Set) -> BTreeMap<usize, Vec<f64>> {
        let columns = self.columns_of(set);
        let weights = self.gram.weights(self.targets, &Chosen::plain(&columns));
        let at = |c: &usize| columns.binary_search(c).map_or(0.0, |i| weights[i]);
        set.values().flatten().map(|c| (*c, self.candidates[*c].columns.iter().map(at).collect())).collect()
    }

    /// Whether every weight that has to be positive is, no refinement is larger than what it refines, and nothing is larger than the torque spans: within a
    /// small part of a turn an offset of the recording hides any gravity.
    pub fn is_lawful(&self, set: &Set) -> bool {
        let weights = self.weights(set);
        let signs = weights.iter().all(|(c, weights)| {
            weights.iter().zip(&self.candidates[*c].positive).all(|(w, positive)| !positive || *w > 0.0)
        });
        let size = |kind: &str| -> Option<f64> {
            let own = set.get(kind)?;
            Some(own.iter().flat_map(|c| &weights[c]).map(|w| w * w).sum::<f64>().sqrt())
        };
        let sizes = || {
            set.keys().filter_map(|kind| kinds::of(kind)).all(|kind| {
                let refined = kind.refines().iter().find_map(|refined| size(refined));
                refined.zip(size(kind.name())).is_none_or(|(refined, own)| own <= kind.most_of_refined() * refined)
            })
        };
        let spans = |(c, weights): (&usize, &Vec<f64>)| {
            weights.iter().zip(&self.candidates[*c].largest).all(|(w, largest)| (w * largest).abs() <= self.torque_span)
        };
        signs && sizes() && weights.iter().all(spans)
    }

    /// Whether every kind has those beside it that it refines.
    pub(super) fn is_allowed(&self, set: &Set) -> bool {
        let there = |kind: &str| set.contains_key(kind) || self.in_base.contains(&kind);
        set.keys().all(|kind| {
            let refined = kinds::of(kind).map_or(&[][..], |k| k.refines());
            refined.is_empty() || refined.iter().any(|n| there(n))
        }) && set.iter().all(|(_, own)| own.iter().all(|c| self.candidates[*c].refines.is_none_or(there)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_term_larger_than_the_torque_spans_is_not_lawful() {
        let rows = 800_u32;
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let gravity: Vec<f64> = (0..rows).map(|row| (0.05 * (0.03 * f64::from(row)).sin()).cos()).collect();
        let column: Vec<f64> = gravity.iter().map(|x| x - mean(&gravity)).collect();
        let columns = [column];
        let (spans, counts) = ([0..400, 400..800], vec![true; 800]);
        let gram = BlockGram::new(&columns, &spans, &counts);
        let candidates = [Candidate {
            kind: "gravity_load",
            columns: vec![0],
            positive: vec![false],
            largest: vec![1.0],
            price: 0.01,
            refines: None,
            additive: false,
        }];
        for (amplitude, is_lawful) in [(0.5, true), (-0.5, true), (170.0, false), (-170.0, false)] {
            let y: Vec<f64> = columns[0].iter().map(|x| amplitude * x).collect();
            let targets = gram.targets(&columns, std::slice::from_ref(&y), &counts);
            let none = (Vec::new(), 0.1);
            let search = Search::new(
                &gram,
                &columns,
                &counts,
                &spans,
                &y,
                &targets,
                Vec::new(),
                Vec::new(),
                &candidates,
                1.0,
                none,
                1.0,
                1,
            );
            assert_eq!(search.is_lawful(&Set::from([("gravity_load", vec![0])])), is_lawful, "{amplitude} N·m");
        }
    }
}
