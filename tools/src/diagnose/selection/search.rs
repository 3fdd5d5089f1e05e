//! Joint selection of kinds by held-out error: forward, with pairs, swaps and backward steps, each kind with a price.
//!
//! A set S of terms is judged by J(S) = E(S)/P + c ln E(S)/P + Σ price, with E the squared error of eight blocks, each predicted by a fit to the others, and P the squares that
//! any function of the recorded coordinates predicts. A kind enters only if its gain repeats over the blocks and is more than surrogates of the noise give to any kind.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use rayon::prelude::*;

use super::surrogates::{SURROGATES, surrogates};
use crate::kinds::{self, FURTHER_ELEMENT_PRICE};
use crate::numerics::block_gram::{BLOCKS, BlockGram, NO_RIDGE, Targets, t_of_blocks};

/// One way in which a kind may enter: columns of the Gram matrix and what their weights must be.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The kind.
    pub kind: &'static str,
    /// Its columns.
    pub columns: Vec<usize>,
    /// Which weights have to be positive for the kind to be of its kind.
    pub positive: Vec<bool>,
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
    /// The columns and the ridge of the best free description.
    pub free: (Vec<usize>, f64),
    /// The squares that prices are shares of.
    pub scale: f64,
    /// The seed of the surrogates.
    pub seed: u64,
    cache: RefCell<HashMap<Vec<usize>, [f64; BLOCKS]>>,
}

/// A gain that repeats in so many blocks, or whose sum is so many times its scatter over them, is believed.
const MOST_BLOCKS: usize = 7;
const T_SIMPLE: f64 = 1.0;
/// The least t over blocks of a kind that not almost every machine has.
pub const T_OTHERS: f64 = 1.5;

/// A gain of this share of what is predictable, in seven blocks, needs no surrogates.
const BEYOND_DOUBT: f64 = 0.05;

/// A kind that lessens what is left by a factor e is worth this share of what is predictable, be ever so little left,
const RELATIVE: f64 = 0.002;
/// down to this share.
const NEGLIGIBLE: f64 = 1e-4;

/// Kinds that are tried two at a time.
const PAIRED: usize = 10;

/// Steps at most.
const STEPS: usize = 24;

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
        free: (Vec<usize>, f64),
        scale: f64,
        seed: u64,
    ) -> Self {
        let cache = RefCell::default();
        Self { gram, columns, counts, spans, y, targets, base, in_base, candidates, free, scale, seed, cache }
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
        let error = self.gram.error(self.targets, &columns, NO_RIDGE);
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
    fn objectives(&self, sets: &[Set]) -> Vec<f64> {
        let open: Vec<Vec<usize>> = {
            let cache = self.cache.borrow();
            let columns: BTreeSet<Vec<usize>> = sets.iter().map(|s| self.columns_of(s)).collect();
            columns.into_iter().filter(|c| !cache.contains_key(c)).collect()
        };
        let (gram, targets) = (self.gram, self.targets);
        let found: Vec<[f64; BLOCKS]> = open.par_iter().map(|c| gram.error(targets, c, NO_RIDGE)).collect();
        self.cache.borrow_mut().extend(open.into_iter().zip(found));
        sets.iter().map(|s| self.objective(s)).collect()
    }

    /// The weights of a set's columns, candidate by candidate.
    pub fn weights(&self, set: &Set) -> BTreeMap<usize, Vec<f64>> {
        let columns = self.columns_of(set);
        let weights = self.gram.weights(self.targets, &columns, NO_RIDGE);
        let at = |c: &usize| columns.binary_search(c).map_or(0.0, |i| weights[i]);
        set.values().flatten().map(|c| (*c, self.candidates[*c].columns.iter().map(at).collect())).collect()
    }

    /// Whether every weight that has to be positive is, and no refinement is larger than what it refines.
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
        signs && sizes()
    }

    /// Whether every kind has those beside it that it refines.
    fn is_allowed(&self, set: &Set) -> bool {
        let there = |kind: &str| set.contains_key(kind) || self.in_base.contains(&kind);
        set.keys().all(|kind| {
            let refined = kinds::of(kind).map_or(&[][..], |k| k.refines());
            refined.is_empty() || refined.iter().any(|n| there(n))
        }) && set.iter().all(|(_, own)| own.iter().all(|c| self.candidates[*c].refines.is_none_or(there)))
    }

    /// The candidates of a kind.
    fn of_kind(&self, kind: &str) -> Vec<usize> {
        (0..self.candidates.len()).filter(|c| self.candidates[*c].kind == kind).collect()
    }

    fn kinds(&self) -> Vec<&'static str> {
        let kinds: BTreeSet<&'static str> = self.candidates.iter().map(|c| c.kind).collect();
        kinds.into_iter().collect()
    }

    /// The sets with one kind more, or with a further element of one.
    fn larger(&self, set: &Set, banned: &BTreeSet<&'static str>) -> Vec<(&'static str, Set)> {
        let mut larger = Vec::new();
        for kind in self.kinds().into_iter().filter(|k| !banned.contains(k)) {
            for candidate in self.of_kind(kind) {
                let mut with = set.clone();
                match with.get_mut(kind) {
                    None => drop(with.insert(kind, vec![candidate])),
                    Some(own) if self.candidates[candidate].additive && !own.contains(&candidate) => {
                        own.push(candidate)
                    }
                    Some(_) => continue,
                }
                if self.is_allowed(&with) {
                    larger.push((kind, with));
                }
            }
        }
        larger
    }

    /// Finds the set of least J: forward from a set, and forward from all kinds that almost every machine has less those that it can do without. Kinds that
    /// hide each other are found by the second way only.
    pub fn run(&self, start: Set) -> Set {
        let forward = self.forward(start.clone());
        let all = self.significant(self.settled(self.with_common(start), 0));
        let backward = self.forward(all);
        if self.objective(&backward) < self.objective(&forward) - 1e-9 { backward } else { forward }
    }

    /// A set with every common kind beside it, each in its best lawful variant, in the order of what they save.
    fn with_common(&self, mut set: Set) -> Set {
        loop {
            let mut moves = self.larger(&set, &BTreeSet::new());
            moves.retain(|(kind, _)| is_common(kind) && !set.contains_key(kind));
            let sets: Vec<Set> = moves.iter().map(|m| m.1.clone()).collect();
            let mut scored: Vec<(f64, Set)> = self.objectives(&sets).into_iter().zip(sets).collect();
            scored.sort_by(|a, b| a.0.total_cmp(&b.0));
            match scored.into_iter().map(|s| s.1).find(|s| self.is_lawful(s)) {
                Some(larger) => set = larger,
                None => return set,
            }
        }
    }

    /// A set without the kinds whose gain may be chance, the smallest first.
    fn significant(&self, mut set: Set) -> Set {
        loop {
            let mut gains: Vec<(f64, &'static str)> =
                set.keys().map(|kind| (self.gains(kind, &set).iter().sum(), *kind)).collect();
            gains.sort_by(|a, b| a.0.total_cmp(&b.0));
            match gains.into_iter().find(|(_, kind)| !self.is_significant(kind, &set, 0)) {
                Some((_, kind)) => set = self.without(kind, &set),
                None => return set,
            }
        }
    }

    /// Adds kinds to a set as long as J falls, and settles it after each.
    fn forward(&self, start: Set) -> Set {
        let mut set = start;
        let mut banned = BTreeSet::new();
        for step in 0..STEPS {
            let moves = self.larger(&set, &banned);
            let next = self.best_lawful(&set, moves).or_else(|| self.best_pair(&set, &banned));
            let Some((kind, next)) = next else { break };
            let added: Vec<&'static str> = next.keys().copied().filter(|k| next.get(k) != set.get(k)).collect();
            let significant = added.iter().all(|k| self.is_significant(k, &next, step));
            if !significant {
                banned.insert(kind);
                continue;
            }
            set = self.settled(next, step);
            banned.clear();
        }
        set
    }

    /// The set of least J among moves, lawful and better than before.
    fn best_lawful(&self, set: &Set, moves: Vec<(&'static str, Set)>) -> Option<(&'static str, Set)> {
        let now = self.objective(set);
        let sets: Vec<Set> = moves.iter().map(|m| m.1.clone()).collect();
        let mut scored: Vec<(f64, usize)> = self
            .objectives(&sets)
            .into_iter()
            .enumerate()
            .map(|(i, j)| (j, i))
            .filter(|(j, _)| *j < now - 1e-9)
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut moves: Vec<Option<(&'static str, Set)>> = moves.into_iter().map(Some).collect();
        scored.into_iter().find_map(|(_, i)| moves[i].take().filter(|m| self.is_lawful(&m.1)))
    }

    /// Two kinds at once where neither helps alone.
    fn best_pair(&self, set: &Set, banned: &BTreeSet<&'static str>) -> Option<(&'static str, Set)> {
        let firsts = self.larger(set, banned);
        let sets: Vec<Set> = firsts.iter().map(|m| m.1.clone()).collect();
        let scores = self.objectives(&sets);
        // Of each kind the best variant.
        let mut best: BTreeMap<&'static str, (f64, &Set)> = BTreeMap::new();
        for (score, (kind, with)) in scores.iter().zip(&firsts) {
            let better = best.get(kind).is_none_or(|b| *score < b.0);
            if better {
                best.insert(kind, (*score, with));
            }
        }
        let mut order: Vec<(f64, &'static str, &Set)> = best.into_iter().map(|(k, (s, w))| (s, k, w)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.truncate(PAIRED);
        let mut pairs = self.refined_pairs(&firsts);
        for (at, (_, kind, with)) in order.iter().enumerate() {
            for (_, other, also) in &order[at + 1..] {
                let mut both: Set = (*with).clone();
                both.insert(other, also[other].clone());
                if self.is_allowed(&both) {
                    pairs.push((*kind, both));
                }
            }
        }
        self.best_lawful(set, pairs)
    }

    /// Kinds together with one that refines them.
    fn refined_pairs(&self, firsts: &[(&'static str, Set)]) -> Vec<(&'static str, Set)> {
        let mut pairs = Vec::new();
        for (kind, with) in firsts {
            let refines = |other: &str| kinds::of(other).is_some_and(|k| k.refines().contains(kind));
            for (c, candidate) in self.candidates.iter().enumerate() {
                if refines(candidate.kind) && !with.contains_key(candidate.kind) {
                    let mut both = with.clone();
                    both.insert(candidate.kind, vec![c]);
                    if self.is_allowed(&both) {
                        pairs.push((*kind, both));
                    }
                }
            }
        }
        pairs
    }

    /// The most that a lawful kind alone saves.
    pub fn largest_gain(&self) -> f64 {
        let set = Set::new();
        let now = self.squares(&set);
        self.alternatives(&set).into_iter().map(|(_, with)| now - self.squares(&with)).fold(0.0, f64::max)
    }

    /// The most that one of some kinds saves beside a set with a weight of the wrong sign.
    pub fn largest_unlawful_gain(&self, set: &Set, kinds: &[&str]) -> f64 {
        let now = self.squares(set);
        let moves = self.larger(set, &BTreeSet::new()).into_iter().filter(|(kind, _)| kinds.contains(kind));
        let unlawful = moves.filter(|(_, with)| !self.is_lawful(with));
        unlawful.map(|(_, with)| now - self.squares(&with)).fold(0.0, f64::max)
    }

    /// The set with each kind more, in its best lawful variant.
    pub fn alternatives(&self, set: &Set) -> Vec<(&'static str, Set)> {
        let moves = self.larger(set, &BTreeSet::new());
        let sets: Vec<Set> = moves.iter().map(|m| m.1.clone()).collect();
        self.objectives(&sets);
        let mut best: BTreeMap<&'static str, Set> = BTreeMap::new();
        let mut scored: Vec<(f64, usize)> = sets.iter().enumerate().map(|(i, s)| (self.squares(s), i)).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, i) in scored {
            let kind = moves[i].0;
            if !best.contains_key(kind) && self.is_lawful(&sets[i]) {
                best.insert(kind, sets[i].clone());
            }
        }
        best.into_iter().collect()
    }

    /// The set with other variants, without or with other kinds where that is better.
    fn settled(&self, set: Set, step: usize) -> Set {
        let mut set = self.reshaped(set);
        for _ in 0..8 {
            let mut moves: Vec<(&'static str, Set)> = Vec::new();
            for kind in set.keys().copied().collect::<Vec<_>>() {
                let mut rest = set.clone();
                rest.remove(kind);
                if set[kind].len() > 1 {
                    for c in &set[kind] {
                        let mut fewer = set.clone();
                        fewer.insert(kind, set[kind].iter().copied().filter(|o| o != c).collect());
                        moves.push((kind, fewer));
                    }
                }
                if self.is_allowed(&rest) {
                    moves.push((kind, rest.clone()));
                }
                let swaps = self.larger(&rest, &BTreeSet::from([kind]));
                moves.extend(swaps.into_iter().filter(|(other, _)| !set.contains_key(other)));
            }
            let Some((_, next)) = self.best_lawful(&set, moves) else { break };
            let new = next.keys().copied().find(|k| !set.contains_key(k));
            if new.is_some_and(|k| !self.is_significant(k, &next, step)) {
                break;
            }
            set = self.reshaped(next);
        }
        set
    }

    /// The set with the best variant of each kind in turn.
    fn reshaped(&self, mut set: Set) -> Set {
        for _ in 0..3 {
            let before = set.clone();
            for kind in set.keys().copied().collect::<Vec<_>>() {
                if set[kind].len() > 1 {
                    continue;
                }
                let moves: Vec<(&'static str, Set)> = self
                    .of_kind(kind)
                    .into_iter()
                    .map(|c| {
                        let mut other = set.clone();
                        other.insert(kind, vec![c]);
                        (kind, other)
                    })
                    .filter(|(_, other)| self.is_allowed(other))
                    .collect();
                if let Some((_, better)) = self.best_lawful(&set, moves) {
                    set = better;
                }
            }
            if set == before {
                break;
            }
        }
        set
    }

    /// A set without a kind and without what refines it.
    pub fn without(&self, kind: &str, set: &Set) -> Set {
        let mut rest = set.clone();
        rest.remove(kind);
        self.allowed_part(rest)
    }

    /// A set without kinds that lack what they refine.
    pub fn allowed_part(&self, mut set: Set) -> Set {
        while !self.is_allowed(&set) {
            let alone = |k: &&'static str| !self.is_allowed(&Set::from([(*k, set[*k].clone())]));
            let lost = set.keys().copied().find(|k| alone(k));
            let dependent = set.keys().copied().find(|k| {
                let mut fewer = set.clone();
                fewer.remove(k);
                self.is_allowed(&fewer)
            });
            match dependent.or(lost) {
                Some(k) => drop(set.remove(k)),
                None => break,
            }
        }
        set
    }

    /// The gain of each block by a kind in its set.
    pub fn gains(&self, kind: &str, set: &Set) -> [f64; BLOCKS] {
        let rest = self.without(kind, set);
        let (with, without) = (self.blocks(set), self.blocks(&rest));
        std::array::from_fn(|b| without[b] - with[b])
    }

    /// Whether the gain of a kind repeats over blocks, and is more than noise gives to the kinds that it competed with.
    fn is_significant(&self, kind: &'static str, set: &Set, step: usize) -> bool {
        let gains = self.gains(kind, set);
        let total: f64 = gains.iter().sum();
        if total <= 0.0 {
            return false;
        }
        let positive = gains.iter().filter(|g| **g > 0.0).count();
        if !repeats(&gains, if is_common(kind) { T_SIMPLE } else { T_OTHERS }) {
            return false;
        }
        if positive >= MOST_BLOCKS && total > BEYOND_DOUBT * self.scale {
            return true;
        }
        self.beats_surrogates(kind, set, total, step)
    }

    /// Whether a gain is more than surrogates of the noise give to any kind.
    fn beats_surrogates(&self, kind: &'static str, set: &Set, gain: f64, step: usize) -> bool {
        let chosen = self.columns_of(set);
        let mut with_free = chosen.clone();
        with_free.extend(&self.free.0);
        with_free.sort_unstable();
        with_free.dedup();
        let ridges = [(&chosen, NO_RIDGE), (&with_free, 1e-2), (&with_free, 1e-4)];
        let error = |(c, r): &(&Vec<usize>, f64)| self.gram.error(self.targets, c, *r).iter().sum::<f64>();
        let Some((columns, ridge)) = ridges.iter().min_by(|a, b| error(a).total_cmp(&error(b))) else { return true };
        let weights = self.gram.weights(self.targets, columns, *ridge);
        let noise = self.gram.residual(self.columns, self.y, &weights, columns);
        let surrogates = surrogates(&noise, self.spans, self.seed.wrapping_add(step as u64));
        let targets = self.gram.targets(self.columns, &surrogates, self.counts);
        let mut rest = set.clone();
        rest.remove(kind);
        let base = self.columns_of(&rest);
        let of = |columns: &[usize]| -> Vec<f64> {
            let blocks = self.gram.errors(&targets, columns, NO_RIDGE);
            (0..SURROGATES).map(|k| blocks.iter().map(|b| b[k]).sum()).collect()
        };
        let plain = of(&base);
        let competitors: Vec<&Candidate> = self
            .candidates
            .iter()
            .filter(|c| !is_common(kind) || is_common(c.kind))
            .filter(|c| !rest.contains_key(c.kind))
            .collect();
        let gains: Vec<Vec<f64>> = competitors
            .par_iter()
            .map(|c| {
                let mut columns = base.clone();
                columns.extend(&c.columns);
                columns.sort_unstable();
                columns.dedup();
                plain.iter().zip(of(&columns)).map(|(p, w)| p - w).collect()
            })
            .collect();
        let mut most: Vec<f64> =
            (0..SURROGATES).map(|k| gains.iter().map(|g: &Vec<f64>| g[k]).fold(0.0, f64::max)).collect();
        most.sort_by(f64::total_cmp);
        let rank = if is_common(kind) { SURROGATES - 2 } else { SURROGATES - 1 };
        gain > most[rank]
    }
}

/// Whether a gain is there in seven blocks, or its sum is so many times its scatter.
pub fn repeats(gains: &[f64; BLOCKS], least_t: f64) -> bool {
    gains.iter().filter(|g| **g > 0.0).count() >= MOST_BLOCKS || t_of_blocks(gains) >= least_t
}

fn is_common(kind: &str) -> bool {
    kinds::of(kind).is_some_and(|k| k.is_common())
}
