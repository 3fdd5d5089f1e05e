//! What other kinds do in the place of a selected one.

use statrs::distribution::{ContinuousCDF, Normal};

use super::criterion::{Search, Set};
use super::significance::{T_OTHERS, repeats};
use crate::kinds;
use crate::numerics::block_gram::{BLOCKS, t_of_blocks};

/// A kind that loses at most this part of what another saves in its place is not distinguished from it.
const EQUIVALENT: f64 = 0.1;

/// A kind that takes this part of what is left is not ruled out by its price.
const UNDECIDED: f64 = 0.15;

/// Kinds that hold this one as a part, and that predict clearly better with it than it does alone, but not by more than their price: the recordings cannot decide.
fn undecided(finder: &Search<'_>, set: &Set, kind: &'static str) -> Vec<&'static str> {
    let own = finder.blocks(set);
    let squares: f64 = own.iter().sum();
    let holds = |other: &str| !set.contains_key(other) && kinds::contains(other, kind);
    let better = |with: &Set| {
        let blocks = finder.blocks(with);
        let gains: [f64; BLOCKS] = std::array::from_fn(|b| own[b] - blocks[b]);
        gains.iter().sum::<f64>() > UNDECIDED * squares && repeats(&gains, T_OTHERS)
    };
    let alternatives = finder.alternatives(set).into_iter();
    alternatives.filter(|(other, with)| holds(other) && better(with)).map(|(other, _)| other).collect()
}

/// In the place of a kind: those that save nearly as much, how sure the class is, and what the others save.
pub(super) fn compared(
    finder: &Search<'_>,
    set: &Set,
    kind: &'static str,
) -> (Vec<&'static str>, f64, Vec<(&'static str, f64)>) {
    let own = finder.blocks(set);
    let squares: f64 = own.iter().sum();
    let rest = finder.without(kind, set);
    let without = finder.squares(&rest);
    let mut others = finder.alternatives(&rest);
    others.retain(|(other, _)| *other != kind && !set.contains_key(other));
    let columns = finder.columns_of(set).len();
    others.iter_mut().for_each(|(other, with)| *with = finder.extended(std::mem::take(with), other, columns));
    others.sort_by(|a, b| finder.squares(&a.1).total_cmp(&finder.squares(&b.1)));
    let mut class = Vec::new();
    let mut confidence: f64 = 1.0;
    let mut tried = Vec::new();
    for (other, with) in others {
        let left = finder.squares(&with);
        tried.push((other, without - left));
        if left - squares <= EQUIVALENT * (without - squares) {
            class.push(other);
        } else {
            let theirs = finder.blocks(&with);
            let t = t_of_blocks(&std::array::from_fn::<f64, BLOCKS, _>(|b| theirs[b] - own[b]));
            confidence = confidence.min(Normal::standard().cdf(t));
        }
    }
    class.extend(undecided(finder, set, kind));
    class.dedup();
    tried.truncate(6);
    (class, confidence, tried)
}
