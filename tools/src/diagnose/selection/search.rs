//! Joint selection of kinds by held-out error: forward, with pairs, swaps and backward steps, each kind with a price.
//!
//! A set S of terms is judged by J(S) = E(S)/P + c ln E(S)/P + Σ price, with E the squared error of eight blocks, each predicted by a fit to the others, and P the squares that
//! any function of the recorded coordinates predicts. A kind enters only if its gain repeats over the blocks and is more than surrogates of the noise give to any kind.

use std::collections::{BTreeMap, BTreeSet};

use super::criterion::{Search, Set};
use crate::kinds::{self, is_common};

/// Kinds that are tried two at a time.
const PAIRED: usize = 10;

/// Steps at most.
const STEPS: usize = 24;

impl Search<'_> {
    /// The candidates of a kind.
    fn of_kind(&self, kind: &str) -> Vec<usize> {
        (0..self.candidates().len()).filter(|c| self.candidates()[*c].kind == kind).collect()
    }

    fn kinds(&self) -> Vec<&'static str> {
        let kinds: BTreeSet<&'static str> = self.candidates().iter().map(|c| c.kind).collect();
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
                    Some(own) if self.candidates()[candidate].additive && !own.contains(&candidate) => {
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
        let all = self.significant(self.improved(self.with_common(start), 0));
        let backward = self.forward(all);
        if self.objective(&backward) < self.objective(&forward) - 1e-9 { backward } else { forward }
    }

    /// A set with every common kind beside it, each in its best lawful variant, in the order of what they save.
    fn with_common(&self, mut set: Set) -> Set {
        loop {
            let mut moves = self.larger(&set, &BTreeSet::new());
            moves.retain(|(kind, _)| is_common(kind) && !set.contains_key(kind));
            let sets: Vec<Set> = moves.iter().map(|m| m.1.clone()).collect();
            match self.first_lawful(self.objectives(&sets).into_iter().zip(sets).collect()) {
                Some(larger) => set = larger,
                None => return set,
            }
        }
    }

    /// The lawful set of the least score.
    fn first_lawful(&self, mut scored: Vec<(f64, Set)>) -> Option<Set> {
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.into_iter().map(|(_, set)| set).find(|set| self.is_lawful(set))
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

    /// Adds kinds to a set as long as J falls, and improves it after each.
    fn forward(&self, start: Set) -> Set {
        let mut set = start;
        let mut banned = BTreeSet::new();
        for step in 0..STEPS {
            let mut moves = self.larger(&set, &banned);
            moves.extend(self.with_other_variants(&set, &moves));
            let next = self.best_lawful(&set, moves).or_else(|| self.best_pair(&set, &banned));
            let Some((kind, next)) = next else { break };
            let added: Vec<&'static str> = next.keys().copied().filter(|k| next.get(k) != set.get(k)).collect();
            let significant = added.iter().all(|k| self.is_significant(k, &next, step));
            if !significant {
                banned.insert(kind);
                continue;
            }
            set = self.improved(next, step);
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

    /// Kinds together with one that refines them; common kinds together with one that refines any: a dip of friction hides the rise with the velocity, and the rise the dip.
    fn refined_pairs(&self, firsts: &[(&'static str, Set)]) -> Vec<(&'static str, Set)> {
        let mut pairs = Vec::new();
        for (kind, with) in firsts {
            let refines = |other: &str| {
                kinds::of(other)
                    .is_some_and(|k| k.refines().contains(kind) || is_common(kind) && !k.refines().is_empty())
            };
            for (c, candidate) in self.candidates().iter().enumerate() {
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

    /// A common kind more, and another variant of one that refines some of the set.
    fn with_other_variants(&self, set: &Set, firsts: &[(&'static str, Set)]) -> Vec<(&'static str, Set)> {
        let refining =
            |kind: &&&'static str| kinds::of(kind).is_some_and(|k| !k.refines().is_empty()) && set[**kind].len() == 1;
        let mut moves = Vec::new();
        for (kind, with) in firsts.iter().filter(|(kind, _)| is_common(kind) && !set.contains_key(kind)) {
            for own in set.keys().filter(refining) {
                for variant in self.of_kind(own) {
                    let mut other = with.clone();
                    other.insert(own, vec![variant]);
                    if self.is_allowed(&other) {
                        moves.push((*kind, other));
                    }
                }
            }
        }
        moves
    }

    /// The most that a lawful kind alone saves of the held-out squares that the base leaves.
    pub fn largest_gain(&self, base_squares: f64) -> f64 {
        let with_each = self.alternatives(&Set::new()).into_iter();
        with_each.map(|(_, with)| base_squares - self.squares(&with)).fold(0.0, f64::max)
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

    /// The set with the best further elements of a kind that has several, lawful ones only, up to so many columns.
    pub fn extended(&self, mut set: Set, kind: &'static str, columns: usize) -> Set {
        let others: BTreeSet<&'static str> = self.kinds().into_iter().filter(|other| *other != kind).collect();
        loop {
            let mut larger: Vec<Set> = self.larger(&set, &others).into_iter().map(|(_, with)| with).collect();
            larger.retain(|with| self.columns_of(with).len() <= columns);
            self.objectives(&larger);
            match self.first_lawful(larger.into_iter().map(|with| (self.squares(&with), with)).collect()) {
                Some(with) => set = with,
                None => return set,
            }
        }
    }

    /// The set with other variants, without or with other kinds where that is better.
    fn improved(&self, set: Set, step: usize) -> Set {
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
                // A wave of one kind may be a further order of another.
                let of_elements = kinds::of(kind).is_some_and(|kind| kind.elements_are_effects());
                moves.extend(swaps.into_iter().filter(|(other, _)| of_elements || !set.contains_key(other)));
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
}
