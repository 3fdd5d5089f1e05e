//! Whether a kind of a set is there, or only noise gives its gain: it repeats over the blocks, and is more than surrogates of the noise give to any kind.

use super::criterion::{Search, Set};
use super::surrogates::{SURROGATES, surrogates};
use crate::kinds::is_common;
use crate::numerics::block_gram::{BLOCKS, Chosen, t_of_blocks};

/// A gain that repeats in so many blocks, or whose sum is so many times its scatter over them, is believed.
const MOST_BLOCKS: usize = 7;
const T_SIMPLE: f64 = 1.0;
/// The least t over blocks of a kind that not almost every machine has.
pub const T_OTHERS: f64 = 1.5;

/// A gain of this share of what is predictable, in seven blocks, needs no surrogates.
const BEYOND_DOUBT: f64 = 0.05;

/// Where blocks do not determine the base of a joint, this part of a gain has to be in others than the best block.
const LEAST_ELSEWHERE: f64 = 0.25;

impl Search<'_> {
    /// The gain of each block by a kind in its set.
    pub fn gains(&self, kind: &str, set: &Set) -> [f64; BLOCKS] {
        let rest = self.without(kind, set);
        let (with, without) = (self.blocks(set), self.blocks(&rest));
        std::array::from_fn(|b| without[b] - with[b])
    }

    /// Whether the gain of a kind repeats over blocks, and is more than noise gives to the kinds that it competed with.
    pub(super) fn is_significant(&self, kind: &'static str, set: &Set, step: usize) -> bool {
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
        self.beats_surrogates(kind, set, &gains, step)
    }

    /// The squares of a line over those that its blocks leave held out, at most 1. Where some block does not determine the base, what is extrapolated there counts many times, and so does what a further
    /// column saves of it.
    fn determined(&self, line: &[f64], held_out: f64) -> f64 {
        let own = line.iter().zip(&self.dictionary.counts).filter(|(_, counts)| **counts);
        (own.map(|(x, _)| x * x).sum::<f64>() / held_out.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Whether a gain is more than surrogates of the noise give to any kind; or would be, were the base of a joint determined by all blocks.
    fn beats_surrogates(&self, kind: &'static str, set: &Set, gains: &[f64; BLOCKS], step: usize) -> bool {
        let gain: f64 = gains.iter().sum();
        let chosen = self.columns_of(set);
        let with_free = |ridge: f64| Chosen::with_free(&chosen, &self.free.0, ridge);
        let described = [Chosen::plain(&chosen), with_free(1e-2), with_free(1e-4)];
        let error = |c: &Chosen| self.gram.error(self.targets, c).iter().sum::<f64>();
        let Some(best) = described.iter().min_by(|a, b| error(a).total_cmp(&error(b))) else { return true };
        let weights = self.gram.weights(self.targets, best);
        let noise = self.gram.residual(&self.dictionary.columns, &self.dictionary.y, &weights, best.columns());
        let surrogates = surrogates(&noise, self.spans, self.seed.wrapping_add(step as u64));
        let targets = self.gram.targets(&self.dictionary.columns, &surrogates, &self.dictionary.counts);
        let mut rest = set.clone();
        rest.remove(kind);
        let base = self.columns_of(&rest);
        let competitors: Vec<&[usize]> = self
            .candidates()
            .iter()
            .filter(|c| !is_common(kind) || is_common(c.kind))
            .filter(|c| !rest.contains_key(c.kind))
            .map(|c| &c.columns[..])
            .collect();
        let gains_of_noise = self.gram.savings(&targets, &base, &competitors);
        let most: Vec<f64> =
            (0..SURROGATES).map(|k| gains_of_noise.iter().map(|g: &Vec<f64>| g[k]).fold(0.0, f64::max)).collect();
        let rank = if is_common(kind) { SURROGATES - 2 } else { SURROGATES - 1 };
        let exceeds = |gain: f64, mut most: Vec<f64>| {
            most.sort_by(f64::total_cmp);
            gain > most[rank]
        };
        if exceeds(gain, most.clone()) {
            return true;
        }
        let largest = gains.iter().fold(0.0, |most: f64, gain| most.max(*gain));
        // What is extrapolated of a gear's base is its spring and its past, which any kind can make up for.
        if self.dictionary.has_gear || gain - largest < LEAST_ELSEWHERE * gain {
            return false;
        }
        let plain = Chosen::plain(&base);
        let mut held = [0.0; SURROGATES];
        for block in self.gram.errors(&targets, &plain) {
            held.iter_mut().zip(block).for_each(|(sum, squares)| *sum += squares);
        }
        let weights = self.gram.weights(self.targets, &plain);
        let left = self.gram.residual(&self.dictionary.columns, &self.dictionary.y, &weights, &base);
        let scaled = (0..SURROGATES).map(|k| most[k] * self.determined(&surrogates[k], held[k])).collect();
        exceeds(gain * self.determined(&left, self.squares(&rest)), scaled)
    }
}

/// Whether a gain is there in seven blocks, or its sum is so many times its scatter.
pub fn repeats(gains: &[f64; BLOCKS], least_t: f64) -> bool {
    gains.iter().filter(|g| **g > 0.0).count() >= MOST_BLOCKS || t_of_blocks(gains) >= least_t
}
