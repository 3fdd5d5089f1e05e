//! What all functions without physics predict together.

use super::dictionary::Dictionary;
use super::significance::{T_OTHERS, repeats};
use super::surrogates;
use crate::kinds::free_coordinate::FreeCoordinate;
use crate::numerics::block_gram::{BLOCKS, BlockGram, Chosen, Targets};
use crate::regression::dataset::Dataset;

/// Ridges at which the free description is tried.
const RIDGES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
/// Whether a free description predicts more of the target than it does of noise with the same spectrum.
pub(super) fn is_predictable(
    dataset: &Dataset<'_>,
    dictionary: &Dictionary,
    gram: &BlockGram,
    targets: &Targets,
    (free, ridge): (&[usize], f64),
    seed: u64,
) -> bool {
    let all = Chosen::with_free(&dictionary.base, free, ridge);
    let base = Chosen::plain(&dictionary.base);
    let part = |with: f64, without: f64| 1.0 - with / without.max(f64::MIN_POSITIVE);
    let (plain, with) = (gram.error(targets, &base), gram.error(targets, &all));
    let gains: [f64; BLOCKS] = std::array::from_fn(|b| plain[b] - with[b]);
    if !repeats(&gains, T_OTHERS) {
        return false;
    }
    let own = part(with.iter().sum(), plain.iter().sum());
    let weights = gram.weights(targets, &base);
    let residual = gram.residual(&dictionary.columns, &dictionary.y, &weights, &dictionary.base);
    let noise = surrogates::surrogates(&residual, &dataset.spans, seed);
    let noise = gram.targets(&dictionary.columns, &noise, &dictionary.counts);
    let sums = |columns: &Chosen| {
        let blocks = gram.errors(&noise, columns);
        (0..noise.count()).map(|k| blocks.iter().map(|b| b[k]).sum::<f64>()).collect::<Vec<f64>>()
    };
    let parts = sums(&all).into_iter().zip(sums(&base)).map(|(w, p)| part(w, p));
    parts.filter(|p| *p >= own).count() == 0
}

/// The best free description: its columns, its ridge, its held-out squares.
pub(super) fn ceiling(dictionary: &Dictionary, gram: &BlockGram, targets: &Targets) -> (Vec<usize>, f64, f64) {
    use rayon::prelude::*;
    let without: Vec<usize> = dictionary
        .free
        .iter()
        .filter(|(over, _)| *over != FreeCoordinate::Orders)
        .flat_map(|(_, c)| c.iter().copied())
        .collect();
    let with: Vec<usize> = dictionary.free.iter().flat_map(|(_, c)| c.iter().copied()).collect();
    let tries: Vec<(&Vec<usize>, f64)> = RIDGES.iter().flat_map(|r| [(&without, *r), (&with, *r)]).collect();
    let best = tries
        .par_iter()
        .map(|(free, ridge)| {
            let all = Chosen::with_free(&dictionary.base, free, *ridge);
            (gram.error(targets, &all).iter().sum::<f64>(), *free, *ridge)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((Vec::new(), RIDGES[0], f64::INFINITY), |(squares, free, ridge)| (free.clone(), ridge, squares))
}
