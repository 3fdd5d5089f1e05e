//! What a set of kinds is judged by: the squared error of blocks held out, each predicted by a fit to the others, and a price for each kind.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;

use super::dictionary::Dictionary;
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
    /// The range of each weight outside which the term is of another kind.
    pub limits: Vec<(f64, f64)>,
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

/// A search over the candidates of a dictionary.
pub struct Search<'a> {
    /// All columns, what they stand for, and the target.
    pub dictionary: &'a Dictionary,
    /// Gram matrices of all columns.
    pub gram: &'a BlockGram,
    /// The target beside the columns.
    pub targets: &'a Targets,
    /// The rows of each recording.
    pub spans: &'a [Range<usize>],
    /// Kinds that the base model holds.
    pub in_base: Vec<&'static str>,
    /// What no term of the torque exceeds.
    pub most_of_a_term: f64,
    /// The columns and the ridge of the best free description.
    pub free: (Vec<usize>, f64),
    /// The squares that prices are shares of.
    pub scale: f64,
    /// The seed of the surrogates.
    pub seed: u64,
    /// Held-out squares of the sets of columns seen so far.
    pub(super) cache: RefCell<HashMap<Vec<usize>, [f64; BLOCKS]>>,
}

/// A kind that lessens what is left by a factor e is worth this share of what is predictable, be ever so little left,
const RELATIVE: f64 = 0.002;
/// down to this share.
const NEGLIGIBLE: f64 = 1e-4;

impl Search<'_> {
    /// What may be chosen.
    pub(super) fn candidates(&self) -> &[Candidate] {
        &self.dictionary.candidates
    }

    /// The columns of the base and a set.
    pub fn columns_of(&self, set: &Set) -> Vec<usize> {
        let own = set.values().flatten().flat_map(|c| self.candidates()[*c].columns.iter().copied());
        self.dictionary.base.iter().copied().chain(own).collect::<BTreeSet<usize>>().into_iter().collect()
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
            let first = own.iter().map(|c| self.candidates()[*c].price).fold(0.0, f64::max);
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
        let found = self.gram.errors_of_sets(self.targets, &open);
        self.cache.borrow_mut().extend(open.into_iter().zip(found));
        sets.iter().map(|s| self.objective(s)).collect()
    }

    /// The weights of a set's columns, candidate by candidate.
    pub fn weights(&self, set: &Set) -> BTreeMap<usize, Vec<f64>> {
        let columns = self.columns_of(set);
        let weights = self.gram.weights(self.targets, &Chosen::plain(&columns));
        let at = |c: &usize| columns.binary_search(c).map_or(0.0, |i| weights[i]);
        set.values().flatten().map(|c| (*c, self.candidates()[*c].columns.iter().map(at).collect())).collect()
    }

    /// Whether every weight that has to be positive is, every weight is within the limits of its kind, no refinement is larger than what it refines, and nothing is larger than the recorded torque: within a
    /// small part of a turn an offset of the recording hides any gravity.
    pub fn is_lawful(&self, set: &Set) -> bool {
        let weights = self.weights(set);
        let numbers = weights.iter().all(|(c, weights)| {
            let candidate = &self.candidates()[*c];
            let within = |(w, limits): (&f64, &(f64, f64))| (limits.0..=limits.1).contains(w);
            weights.iter().zip(&candidate.positive).all(|(w, positive)| !positive || *w > 0.0)
                && weights.iter().zip(&candidate.limits).all(within)
        });
        let size = |kind: &str| -> Option<f64> {
            let own = set.get(kind)?;
            Some(own.iter().flat_map(|c| &weights[c]).map(|w| w * w).sum::<f64>().sqrt())
        };
        let sizes = || {
            set.keys().filter_map(|kind| kinds::of(kind)).all(|kind| {
                let refined = kind.refines().iter().filter_map(|refined| size(refined)).reduce(f64::max);
                refined.zip(size(kind.name())).is_none_or(|(refined, own)| own <= kind.most_of_refined() * refined)
            })
        };
        let spans = |(c, weights): (&usize, &Vec<f64>)| {
            // At a step of the torque the derivative, which stands for a delay, is larger than any delay makes of it.
            let is_delay = kinds::of(self.candidates()[*c].kind).is_some_and(kinds::shifts_time);
            is_delay
                || weights
                    .iter()
                    .zip(&self.candidates()[*c].largest)
                    .all(|(w, largest)| (w * largest).abs() <= self.most_of_a_term)
        };
        numbers && sizes() && weights.iter().all(spans) && self.dissipates(&weights)
    }

    /// Whether the friction of a set, all kinds together, takes energy from the motion recorded: friction of the position beside a small Coulomb friction can
    /// turn the sign of the whole.
    fn dissipates(&self, weights: &BTreeMap<usize, Vec<f64>>) -> bool {
        let Some(velocity) = &self.dictionary.against_friction else { return true };
        let own: Vec<(&[f64], f64)> = weights
            .iter()
            .filter(|(c, _)| kinds::of(self.candidates()[**c].kind).is_some_and(kinds::is_friction))
            .flat_map(|(c, weights)| self.candidates()[*c].columns.iter().zip(weights))
            .map(|(column, weight)| (self.dictionary.columns[*column].as_slice(), *weight))
            .collect();
        if own.len() < 2 {
            return true;
        }
        let torque = |row: usize| own.iter().map(|(column, weight)| weight * column[row]).sum::<f64>();
        velocity.iter().enumerate().map(|(row, velocity)| velocity * torque(row)).sum::<f64>() > 0.0
    }

    /// Whether every kind has those beside it that it refines.
    pub(super) fn is_allowed(&self, set: &Set) -> bool {
        let there = |kind: &str| set.contains_key(kind) || self.in_base.contains(&kind);
        set.keys().all(|kind| {
            let refined = kinds::of(kind).map_or(&[][..], |k| k.refines());
            refined.is_empty() || refined.iter().any(|n| there(n))
        }) && set.iter().all(|(_, own)| own.iter().all(|c| self.candidates()[*c].refines.is_none_or(there)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 800;
    const SPANS: [Range<usize>; 2] = [0..400, 400..800];

    fn candidate(kind: &'static str, column: usize) -> Candidate {
        Candidate {
            kind,
            columns: vec![column],
            positive: vec![false],
            limits: vec![(f64::NEG_INFINITY, f64::INFINITY)],
            largest: vec![1.0],
            price: 0.01,
            refines: None,
            additive: false,
        }
    }

    /// Whether all candidates together are lawful for a target that is the sum of their columns, each so many times.
    fn is_lawful(dictionary: &Dictionary, amplitudes: &[f64], most_of_a_term: f64) -> bool {
        let rows = 0..ROWS;
        let columns = || dictionary.columns.iter().zip(amplitudes);
        let y: Vec<f64> = rows.map(|row| columns().map(|(column, amplitude)| amplitude * column[row]).sum()).collect();
        let gram = BlockGram::new(&dictionary.columns, &SPANS, &dictionary.counts);
        let targets = gram.targets(&dictionary.columns, std::slice::from_ref(&y), &dictionary.counts);
        let search = Search {
            dictionary,
            gram: &gram,
            targets: &targets,
            spans: &SPANS,
            in_base: Vec::new(),
            most_of_a_term,
            free: (Vec::new(), 0.1),
            scale: 1.0,
            seed: 1,
            cache: RefCell::default(),
        };
        search.is_lawful(&dictionary.candidates.iter().enumerate().map(|(at, c)| (c.kind, vec![at])).collect())
    }

    #[test]
    fn a_term_larger_than_the_torque_is_not_lawful() {
        let gravity: Vec<f64> = (0..ROWS).map(|row| (0.05 * (0.03 * row as f64).sin()).cos()).collect();
        let mean = gravity.iter().sum::<f64>() / ROWS as f64;
        let dictionary = Dictionary {
            columns: vec![gravity.iter().map(|x| x - mean).collect()],
            counts: vec![true; ROWS],
            candidates: vec![candidate("gravity_load", 0)],
            ..Dictionary::default()
        };
        for (amplitude, expected) in [(0.5, true), (-0.5, true), (170.0, false), (-170.0, false)] {
            assert_eq!(is_lawful(&dictionary, &[amplitude], 1.0), expected, "{amplitude} N·m");
        }
    }

    #[test]
    fn a_weight_beyond_the_limits_of_its_kind_is_not_lawful() {
        let rate: Vec<f64> = (0..ROWS).map(|row| (0.03 * row as f64).cos()).collect();
        let dictionary = Dictionary {
            columns: vec![rate],
            counts: vec![true; ROWS],
            candidates: vec![Candidate { limits: vec![(-0.04, 0.04)], ..candidate("time_skew", 0) }],
            ..Dictionary::default()
        };
        for (delay_s, expected) in [(0.01, true), (-0.03, true), (-0.12, false), (0.05, false)] {
            assert_eq!(is_lawful(&dictionary, &[delay_s], 10.0), expected, "{delay_s} s");
        }
    }

    #[test]
    fn a_delay_is_lawful_where_the_torque_has_steps() {
        // Of 1 N·m in one row of 2 ms.
        let rate: Vec<f64> = (0..ROWS).map(|row| if row % 100 == 50 { 500.0 } else { 0.0 }).collect();
        let with = |kind| Dictionary {
            columns: vec![rate.clone()],
            counts: vec![true; ROWS],
            candidates: vec![Candidate { largest: vec![500.0], ..candidate(kind, 0) }],
            ..Dictionary::default()
        };
        assert!(is_lawful(&with("time_skew"), &[0.01], 2.0));
        // Of another kind, that is more than the torque.
        assert!(!is_lawful(&with("torque_scale"), &[0.01], 2.0));
    }

    #[test]
    fn friction_that_drives_the_joint_is_not_lawful() {
        let angle = |row: usize| 0.8 * (0.03 * row as f64).sin();
        let velocity: Vec<f64> = (0..ROWS).map(|row| (0.03 * row as f64).cos()).collect();
        let sign: Vec<f64> = velocity.iter().map(|v| (v / 0.02).tanh()).collect();
        let of_position = sign.iter().enumerate().map(|(row, s)| s * angle(row).cos()).collect();
        let dictionary = Dictionary {
            columns: vec![sign, of_position],
            counts: vec![true; ROWS],
            against_friction: Some(velocity),
            candidates: vec![candidate("coulomb_friction", 0), candidate("position_dependent_friction", 1)],
            ..Dictionary::default()
        };
        // Coulomb friction of 1 N·m; less than that beside it, more that points the same way, more that turns the whole round.
        for (of_position, expected) in [(-0.5, true), (2.0, true), (-2.0, false)] {
            assert_eq!(is_lawful(&dictionary, &[1.0, of_position], 10.0), expected, "{of_position} N·m");
        }
    }
}
