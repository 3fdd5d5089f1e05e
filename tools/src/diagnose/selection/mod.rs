//! Joint selection of the physics that a model lacks, by the prediction error on held-out rows.
//!
//! | file | what |
//! |---|---|
//! | [`free_functions`], `free_description` | functions without physics over every coordinate; all of them together |
//! | [`dictionary`] | base, kinds and free functions as columns beside a fitted model |
//! | `friction_shapes` | frictions whose refitted shape is that of another friction |
//! | `delay` | a delay of the torque that its derivative does not show |
//! | `lawful` | found terms whose refitted numbers make them no term of their kind |
//! | `slip_elements` | which slip elements of a grid a memory has: those of positive torque |
//! | `radii` | radii of the slip elements of a found memory, from several starts |
//! | [`remainder`] | a second selection, of what stays unexplained beside a memory |
//! | `in_place` | what other kinds do in the place of a selected one |
//! | [`mod@fidelity`] | how much of what a free function predicts a kind predicts |
//! | [`criterion`] | what a set of kinds is judged by: held-out error and prices |
//! | [`search`], [`significance`] | the set that is best by it; whether the gain of a kind is more than chance |
//! | [`surrogates`] | series with the spectrum of the noise and no structure |

pub mod criterion;
mod delay;
pub mod dictionary;
pub mod fidelity;
mod free_description;
pub mod free_functions;
mod friction_shapes;
mod in_place;
mod lawful;
mod radii;
pub mod remainder;
pub mod search;
pub mod significance;
mod slip_elements;
pub mod surrogates;

use std::cell::RefCell;

use crate::kinds;
use crate::kinds::free_coordinate::FreeCoordinate;
use crate::numerics::block_gram::{BlockGram, Chosen};
use criterion::{Search, Set};
use dictionary::{Dictionary, Origin};
use fidelity::{BesideBase, fidelity};
use free_description::{ceiling, is_predictable};
use in_place::compared;

use crate::diagnose::DiagnoseError;
use crate::diagnose::explain;
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;

/// A kind that was selected.
#[derive(Debug, Clone)]
pub struct Selected {
    /// The kind.
    pub kind: &'static str,
    /// The squares that it saves on held-out blocks in its place, as a share of what is predictable.
    pub share: f64,
    /// Its part of what a free function of its coordinates would save in its place; `None` where that is not significant.
    pub fidelity: Option<f64>,
    /// Kinds that save nearly as much in its place.
    pub equivalents: Vec<&'static str>,
    /// The squares that it saves in each block.
    pub gains: Vec<f64>,
    /// How sure it is that the kind or its equivalents predict better than any other kind in its place, by the scatter over blocks, 0 to 1.
    pub confidence: f64,
    /// What the best other kinds save in its place.
    pub tried: Vec<(&'static str, f64)>,
    /// Whether it was found after the first selection: in its residual, or by a refit.
    pub in_remainder: bool,
}

impl Selected {
    /// Calls it by what a refit has made of it.
    fn rename(&mut self, kind: &'static str) {
        self.kind = kind;
        self.equivalents.retain(|other| *other != kind);
    }
}

/// What the joint selection found.
#[derive(Clone)]
pub struct Selection {
    /// The model with what was selected, refitted.
    pub fit: Fitted,
    /// What was selected, the largest share first.
    pub selected: Vec<Selected>,
    /// Held-out squares of the refitted base.
    pub base_squares: f64,
    /// Held-out squares of the best free description.
    pub free_squares: f64,
    /// Held-out squares with what was selected.
    pub selected_squares: f64,
    /// What the free functions predict of the rest, largest first: a share of what is predictable.
    pub unexplained: Vec<(FreeCoordinate, f64)>,
    /// What Coulomb or viscous friction of the wrong sign would save, alone or beside what was selected, as a share of what is predictable.
    pub friction_of_wrong_sign: f64,
    /// What the search minimises: held-out error and prices, as a share of what is predictable.
    pub objective: f64,
    /// A delay of the torque, s, beside which free functions leave much less.
    pub likely_delay_s: Option<f64>,
    /// Rows that counted.
    pub rows: usize,
}

/// Held-out squares that a selection is measured by.
#[derive(Clone, Copy)]
struct Reference {
    /// Of the refitted base.
    base: f64,
    /// Of the best free description.
    free: f64,
}

impl Reference {
    /// What is predictable.
    fn scale(self) -> f64 {
        (self.base - self.free).max(1e-12 * self.base).max(f64::MIN_POSITIVE)
    }
}

impl Selection {
    fn reference(&self) -> Reference {
        Reference { base: self.base_squares, free: self.free_squares }
    }

    /// The part of the base's squared error, held out, that any free description predicts, 0 to 1.
    pub fn predictable(&self) -> f64 {
        (1.0 - self.free_squares / self.base_squares.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// Takes over a refit with fewer kinds, and what it leaves on held-out blocks beside the refitted base.
    pub fn refitted(&mut self, dataset: &Dataset<'_>, base: &Fitted, fit: Fitted) {
        self.selected_squares = self.squares_of(dataset, base, &fit);
        self.fit = fit;
    }

    /// The squared error of a fit on held-out blocks, on the scale on which that of the refitted base is `base_squares`.
    fn squares_of(&self, dataset: &Dataset<'_>, base: &Fitted, fit: &Fitted) -> f64 {
        let left = dataset.rms_of_blocks(fit) / dataset.rms_of_blocks(base).max(f64::MIN_POSITIVE);
        self.base_squares * left * left
    }

    /// Lowers the squared error of the best free description to that of the selection, where this is smaller.
    fn bounds_free(&mut self) {
        self.free_squares = self.free_squares.min(self.selected_squares);
    }

    /// Takes over a refit with other kinds; where it leaves less than every free function, it is the best free description.
    fn described_by(&mut self, dataset: &Dataset<'_>, base: &Fitted, fit: Fitted) {
        self.refitted(dataset, base, fit);
        self.bounds_free();
    }

    /// The part that the selected kinds predict, 0 to 1.
    pub fn named(&self) -> f64 {
        (1.0 - self.selected_squares / self.base_squares.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

/// Rounds of selection and refit.
const ROUNDS: usize = 3;
/// Steps of a refit.
const STEPS: usize = 8;
/// Where the linearised base leaves more than so many times the held-out squares of its fit, some block does not determine it; those of the fit take only the directions that are
/// determined. A ridge then holds the others near the fit.
const UNDETERMINED: f64 = 10.0;

impl Dataset<'_> {
    /// Selects what a fitted base model leaves out, each kind at so many times its price.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn select(&self, base: &Fitted, search: explain::Search<'_>, prices: f64) -> Result<Selection, DiagnoseError> {
        self.select_from(base, None, search, prices)
    }

    /// The same from a fit that holds found terms, measured by what another selection found of the base.
    fn select_from(
        &self,
        base: &Fitted,
        given: Option<Reference>,
        search: explain::Search<'_>,
        prices: f64,
    ) -> Result<Selection, DiagnoseError> {
        let of_base = self.mean_square_of_blocks(base) * self.counted() as f64;
        let mut fit = base.clone();
        let mut reference = given;
        let mut likely_delay_s = None;
        let mut result = None;
        let mut beside_base = None;
        for round in 0..ROUNDS {
            let mut dictionary = Dictionary::new(self, &fit, search)?;
            let mut gram = BlockGram::new(&dictionary.columns, &self.spans, &dictionary.counts);
            let targets = gram.targets(&dictionary.columns, std::slice::from_ref(&dictionary.y), &dictionary.counts);
            let most = UNDETERMINED * of_base;
            let plain = gram.steady(&targets, &dictionary.base, most);
            dictionary.prune(&gram, &targets);
            let beside_base = beside_base.get_or_insert_with(|| BesideBase::new(&dictionary, &gram, &targets));
            let plain = if plain > most { of_base } else { plain };
            let (free, ridge, free_squares) = ceiling(&dictionary, &gram, &targets);
            let is_quiet =
                reference.is_none() && !is_predictable(self, &dictionary, &gram, &targets, (&free, ridge), search.seed);
            if reference.is_none() && !is_quiet {
                likely_delay_s = self.likely_delay(&dictionary, &gram, (&free, ridge), &fit);
            }
            let measure = *reference.get_or_insert_with(|| Reference {
                base: plain,
                free: if is_quiet { plain } else { free_squares.min(plain) },
            });
            // A delay that was found is given back by its derivative alone: too much of it.
            let plain = given.map_or(plain, |given| given.base);
            let scale = measure.scale();
            let in_base =
                fit.model.terms[..search.base_terms].iter().filter_map(|t| t.info()).map(|i| i.name).collect();
            let mut finder = Search {
                dictionary: &dictionary,
                gram: &gram,
                targets: &targets,
                spans: &self.spans,
                in_base,
                most_of_a_term: self.most_of_a_term(),
                free: (free, ridge),
                scale,
                seed: search.seed,
                cache: RefCell::default(),
            };
            let mut start = Set::new();
            for (c, origin) in dictionary.origins.iter().enumerate() {
                if matches!(origin, Origin::Found(_)) {
                    start.entry(dictionary.candidates[c].kind).or_default().push(c);
                }
            }
            let largest = if given.is_some() { 0.0 } else { finder.largest_gain(plain) };
            finder.scale = prices * scale.max(plain - finder.squares(&start)).max(largest);
            let mut set = finder.run(start.clone());
            if given.is_some() && round == 0 {
                // What a delay is worth beside what was found just now only a refit shows.
                for (kind, own) in &start {
                    set.entry(kind).or_insert_with(|| own.clone());
                }
            }
            let squares = finder.squares(&set);
            let last = round + 1 == ROUNDS || set == start;
            if last {
                let mut found = self.summed_up(&dictionary, &finder, &set, (measure, squares), beside_base, &fit);
                found.likely_delay_s = likely_delay_s;
                result = Some(found);
                if set == start {
                    break;
                }
            }
            let weights = finder.weights(&set);
            let model = dictionary.applied(&fit.model, &set, &weights);
            let refitted = self.plain_fit(&model, &self.parameters(&model, search), STEPS)?;
            let mut new = set.keys().filter(|kind| !start.contains_key(*kind));
            let has_new_memory = new.any(|kind| kinds::of(kind).is_some_and(|kind| kind.is_of_slip_elements()));
            let refitted = if has_new_memory { self.with_best_radii(refitted, search)? } else { refitted };
            let (refitted, renamed) = self.without_degenerate(refitted, search)?;
            let (refitted, mut lost) = self.without_unlawful(&base.model, refitted, search)?;
            if let (true, Some(result)) = (last, result.as_mut()) {
                for (was, is) in renamed {
                    match is {
                        Some(is) => result.selected.iter_mut().filter(|s| s.kind == was).for_each(|s| s.rename(is)),
                        None => lost.push(was.to_owned()),
                    }
                }
                if lost.is_empty() {
                    result.fit = refitted.clone();
                } else {
                    self.left_without(base, result, &lost, refitted.clone(), search)?;
                }
            }
            fit = refitted;
        }
        result.ok_or_else(|| EstimateError::NoRecording.into())
    }

    /// Takes over the refit of a selection without some of its kinds. What was saved together with them counts for the kinds that are left.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn left_without(
        &self,
        base: &Fitted,
        selection: &mut Selection,
        lost: &[String],
        fit: Fitted,
        search: explain::Search<'_>,
    ) -> Result<(), DiagnoseError> {
        selection.selected.retain(|s| !lost.iter().any(|kind| kind == s.kind));
        selection.refitted(self, base, fit);
        let scale = selection.reference().scale();
        for at in 0..selection.selected.len() {
            let kind = selection.selected[at].kind;
            let mut without = selection.fit.model.clone();
            without.remove_terms(search.base_terms, |term| term.kind == kind);
            let rest = self.plain_fit(&without, &self.parameters(&without, search), STEPS)?;
            let saved = selection.squares_of(self, base, &rest) - selection.selected_squares;
            let found = &mut selection.selected[at];
            if saved > found.gains.iter().sum::<f64>() {
                (found.gains, found.share) = (vec![saved], (saved / scale).clamp(0.0, 1.0));
            }
        }
        Ok(())
    }

    fn summed_up(
        &self,
        dictionary: &Dictionary,
        finder: &Search<'_>,
        set: &Set,
        (reference, selected_squares): (Reference, f64),
        beside_base: &BesideBase,
        fit: &Fitted,
    ) -> Selection {
        let base_squares = reference.base;
        let free_squares = reference.free.min(selected_squares);
        let scale = (base_squares - free_squares).max(f64::MIN_POSITIVE);
        let mut selected: Vec<Selected> = set
            .keys()
            .map(|kind| {
                let gains = finder.gains(kind, set);
                let (equivalents, confidence, tried) = compared(finder, set, kind);
                Selected {
                    kind,
                    share: (gains.iter().sum::<f64>() / scale).clamp(0.0, 1.0),
                    fidelity: fidelity(dictionary, finder, set, kind, beside_base),
                    equivalents,
                    gains: gains.to_vec(),
                    confidence,
                    tried,
                    in_remainder: false,
                }
            })
            .collect();
        selected.sort_by(|a, b| b.share.total_cmp(&a.share));
        let chosen = finder.columns_of(set);
        let mut unexplained: Vec<(FreeCoordinate, f64)> = dictionary
            .free
            .iter()
            .map(|(over, columns)| {
                let left = [1e-4, 1e-3, 1e-2]
                    .map(|ridge| Chosen::with_free(&chosen, columns, ridge))
                    .map(|all| finder.gram.error(finder.targets, &all).iter().sum::<f64>())
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                (*over, (selected_squares - left) / scale)
            })
            .collect();
        unexplained.sort_by(|a, b| b.1.total_cmp(&a.1));
        Selection {
            fit: fit.clone(),
            selected,
            base_squares,
            free_squares,
            selected_squares,
            unexplained,
            friction_of_wrong_sign: [set, &Set::new()]
                .map(|set| finder.largest_unlawful_gain(set, &kinds::JOINT_FRICTION) / scale)
                .into_iter()
                .fold(0.0, f64::max),
            objective: finder.objective(set),
            likely_delay_s: None,
            rows: finder.gram.rows(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_was_renamed_is_not_its_own_equivalent() {
        let mut found = Selected {
            kind: "coulomb_friction",
            share: 1.0,
            fidelity: None,
            equivalents: vec!["viscous_friction", "encoder_skew"],
            gains: Vec::new(),
            confidence: 1.0,
            tried: Vec::new(),
            in_remainder: false,
        };
        found.rename("viscous_friction");
        assert_eq!((found.kind, &found.equivalents[..]), ("viscous_friction", &["encoder_skew"][..]));
    }
}
