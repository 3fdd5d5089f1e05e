//! How much of what a free function of its coordinates predicts a kind predicts.

use crate::diagnose::selection::criterion::{Search, Set};
use crate::diagnose::selection::dictionary::Dictionary;
use crate::diagnose::selection::significance::{T_OTHERS, repeats};
use crate::kinds;
use crate::kinds::free_coordinate::FreeCoordinate;
use crate::numerics::block_gram::{BLOCKS, BlockGram, Chosen, Targets};

/// Ridges at which a free function is tried.
const RIDGES: [f64; 3] = [1e-5, 1e-4, 1e-3];

type Squares = [f64; BLOCKS];

/// What the refitted base leaves on held-out blocks, alone and with a free function of each kind's coordinates beside it.
///
/// A model with a kind is linearised where it fits, which may be far from the base; a free function in the kind's place is then not what it could be, so the one beside the base counts
/// too.
pub struct BesideBase {
    alone: Squares,
    with_free: Vec<(&'static [FreeCoordinate], Squares)>,
}

impl BesideBase {
    /// That of a dictionary that is linearised at the refitted base.
    pub fn new(dictionary: &Dictionary, gram: &BlockGram, targets: &Targets) -> Self {
        let mut with_free: Vec<(&'static [FreeCoordinate], Squares)> = Vec::new();
        for over in kinds::ALL.iter().map(|kind| kind.measured_by()) {
            if with_free.iter().all(|(known, _)| *known != over) {
                let described = described(&dictionary.base, &dictionary.free_columns(over));
                with_free.extend(described.map(|all| (over, least(&all, |all| gram.error(targets, all)))));
            }
        }
        Self { alone: gram.error(targets, &Chosen::plain(&dictionary.base)), with_free }
    }
}

/// The reduction of the held-out error by the kinds that share a coordinate, over that by a free function of it in their place; `None` where the free function's own gain does not repeat.
pub fn fidelity(
    dictionary: &Dictionary,
    finder: &Search<'_>,
    set: &Set,
    kind: &'static str,
    beside_base: &BesideBase,
) -> Option<f64> {
    let own = measured_by(kind);
    let mut rest = set.clone();
    rest.retain(|other, _| measured_by(other)[0] != own[0]);
    let base = finder.columns_of(&rest);
    let described = described(&base, &dictionary.free_columns(own))?;
    // A refinement cannot stand without what it refines.
    let mut plain = finder.blocks(&finder.allowed_part(rest.clone()));
    let mut free = lesser(plain, least(&described, |all| finder.gram.error(finder.targets, all)));
    if rest.is_empty() {
        plain = lesser(plain, beside_base.alone);
        let beside = beside_base.with_free.iter().filter(|(over, _)| *over == own);
        free = beside.fold(free, |least, (_, squares)| lesser(least, *squares));
    }
    let gains: Squares = std::array::from_fn(|b| plain[b] - free[b]);
    // A free function that does not gain itself measures nothing.
    if !repeats(&gains, T_OTHERS) {
        return None;
    }
    let [without, with, free] = [plain, finder.blocks(set), free].map(|blocks| blocks.iter().sum::<f64>());
    let (kinds, any) = (without - with, without - free.min(with));
    (any > 0.0).then(|| (kinds / any).clamp(0.0, 1.0))
}

/// A base with free columns at each ridge; `None` where they add none.
fn described(base: &[usize], free: &[usize]) -> Option<[Chosen; 3]> {
    let described = RIDGES.map(|ridge| Chosen::with_free(base, free, ridge));
    described[0].has_free().then_some(described)
}

fn least(described: &[Chosen], squares: impl Fn(&Chosen) -> Squares) -> Squares {
    described.iter().map(squares).fold([f64::INFINITY; BLOCKS], lesser)
}

/// Of two errors the one with the lesser sum.
fn lesser(a: Squares, b: Squares) -> Squares {
    if b.iter().sum::<f64>() < a.iter().sum::<f64>() { b } else { a }
}

/// The free functions that a kind is measured by.
fn measured_by(kind: &str) -> &'static [FreeCoordinate] {
    kinds::of(kind).map_or(&[FreeCoordinate::Time], |k| k.measured_by())
}
