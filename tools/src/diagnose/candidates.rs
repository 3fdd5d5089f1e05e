//! Candidates: every kind with its shapes over a grid, as columns beside a fitted model.

use gmhm::terms::{Form, KeyInfo, KindInfo, Role};
use rayon::prelude::*;

use crate::diagnose::explain::Search;
use crate::kinds::ranges::{Extent, Ranges};
use crate::kinds::{self, ALL, Kind, UNKNOWN};
use crate::model::{Model, Term, TermValue};
use crate::physics::Evaluation;
use crate::physics::columns::set;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;

/// What a kind would add, its linear numbers free.
pub struct Proposal {
    /// Its kind.
    pub info: &'static KindInfo,
    /// The term, its linear numbers at 0.
    pub term: Term,
    /// The term of the model that it would be added to, a further element of its lists.
    pub extends: Option<usize>,
    /// Its linear numbers, or the one that the torque grows with from 0.
    pub keys: Vec<(&'static KeyInfo, Option<usize>)>,
    /// The change of the torque with each.
    pub columns: Vec<Vec<f64>>,
    /// Its kind, as the tools use it.
    pub kind: &'static dyn Kind,
    /// What the recordings span.
    extent: Extent,
}

/// Every kind that the recordings can tell something of, beside a fitted model.
pub fn proposals(
    dataset: &Dataset<'_>,
    evaluations: &[Evaluation<'_>],
    fit: &Fitted,
    search: Search<'_>,
) -> Vec<Proposal> {
    proposals_over(dataset, evaluations, &fit.model, search, &dataset.ranges(evaluations, fit), false)
}

/// Every kind that the recordings can tell something of, over given ranges, beside a model. For a joint selection (`jointly`) each kind adds only what it has
/// beyond the kinds that it refines, which stand beside it.
pub fn proposals_over(
    dataset: &Dataset<'_>,
    evaluations: &[Evaluation<'_>],
    model: &Model,
    search: Search<'_>,
    ranges: &Ranges,
    jointly: bool,
) -> Vec<Proposal> {
    let beside = if jointly { with_refined(model) } else { model.clone() };
    let mut wanted: Vec<(&'static dyn Kind, Term, Option<usize>)> = Vec::new();
    // A rated deflection says that another simulator stands in for a gear.
    let may_have_spring = model.has_gear() || model.is_simulation() && model.gear.rated_deflection_rad.is_some();
    let is_tried = |kind: &&&'static dyn Kind| {
        kind.name() != UNKNOWN && search.allows(kind.name()) && (may_have_spring || !kind.changes_spring())
    };
    for &kind in ALL.iter().filter(is_tried) {
        let present = model.terms.iter().position(|t| t.kind == kind.name());
        if present.is_some() && !kind.repeatable() {
            continue;
        }
        let shapes = if jointly { kind.joint_candidates(ranges, &beside) } else { kind.candidates(ranges, model) };
        for term in shapes {
            let Some(present) = present else {
                wanted.push((kind, term, None));
                continue;
            };
            // An element that the term has already adds nothing.
            let same = ["orders", "radius_rad", "tau_s"].iter().any(|key| {
                let element = |t: &Term| match t.values.get(*key) {
                    Some(TermValue::List(l)) => l.clone(),
                    _ => Vec::new(),
                };
                element(&term).iter().any(|x| element(&model.terms[present]).iter().any(|y| (x - y).abs() < 1e-9))
            });
            let angle = term.values.get("angle") != model.terms[present].values.get("angle");
            if !same || angle {
                let room = has_room(&model.terms[present], &term);
                wanted.push((kind, term, Some(present).filter(|_| kind.extends() && !angle && room)));
            }
        }
    }
    let made = wanted.into_par_iter().filter_map(|(kind, term, extends)| {
        let info = kind.info()?;
        let (keys, columns) = columns(dataset, evaluations, &term, kind, info, ranges, &beside)?;
        let finite = columns.iter().all(|c| c.iter().all(|x| x.is_finite()));
        (finite && ranges.torque_nm > 0.0).then_some(Proposal {
            info,
            term,
            extends,
            keys,
            columns,
            kind,
            extent: ranges.extent(),
        })
    });
    made.collect()
}

/// The model with the kinds that others refine.
fn with_refined(model: &Model) -> Model {
    let mut with = model.clone();
    for name in ALL.iter().flat_map(|kind| kind.refines()) {
        if !with.has_term(name) {
            with.terms.push(Term { kind: (*name).to_owned(), values: std::collections::BTreeMap::new() });
        }
    }
    with
}

type Columns = (Vec<(&'static KeyInfo, Option<usize>)>, Vec<Vec<f64>>);

fn columns(
    dataset: &Dataset<'_>,
    evaluations: &[Evaluation<'_>],
    term: &Term,
    kind: &'static dyn Kind,
    info: &'static KindInfo,
    ranges: &Ranges,
    model: &Model,
) -> Option<Columns> {
    if let Some((name, step)) = kind.growth(term, ranges) {
        let key = info.key(name)?;
        let mut column = dataset.change(evaluations, &kind.with_more(term, key, step)).ok()?;
        if kind.grows_both_ways() {
            let other = dataset.change(evaluations, &kind.with_more(term, key, -step)).ok()?;
            column.iter_mut().zip(other).for_each(|(x, other)| *x = 0.5 * (*x - other));
        }
        column.iter_mut().for_each(|x| *x /= step);
        return Some((vec![(key, None)], vec![column]));
    }
    let only = kind.only_free_key(model);
    let mut full = term.clone();
    let length = full.values.values().find_map(|v| if let TermValue::List(l) = v { Some(l.len()) } else { None });
    for key in info.keys.iter().filter(|k| k.role == Role::Linear) {
        if only.is_some_and(|only| key.name != only) {
            let value = if key.optional { None } else { Some(TermValue::Number(0.0)) };
            if let Some(value) = value {
                full.values.insert(key.name.to_owned(), value);
            }
            continue;
        }
        if let Form::List { .. } = key.form {
            full.values.insert(key.name.to_owned(), TermValue::List(vec![0.0; length.unwrap_or(1)]));
        }
    }
    let columns = dataset.unit_columns(evaluations, &full).ok()?.into_iter();
    let (keys, mut stacked): (Vec<_>, Vec<_>) = columns.map(|unit| ((unit.key, unit.index), unit.values)).unzip();
    if let Some(only) = only {
        let kept = keys.iter().position(|(key, _)| key.name == only)?;
        return Some((vec![keys[kept]], vec![stacked.swap_remove(kept)]));
    }
    Some((keys, stacked))
}

/// Whether the lists of a term have room for those of another of its kind.
pub fn has_room(own: &Term, other: &Term) -> bool {
    kinds::most_elements(own).is_none_or(|most| kinds::elements(own) + kinds::elements(other) <= most)
}

impl Proposal {
    /// Its kind, the term that it extends, and the shape of its kind.
    pub fn form(&self) -> (&'static str, Option<usize>, Option<&str>) {
        let shape = self.term.values.get("shape").or(self.term.values.get("angle"));
        let shape = shape.and_then(|v| if let TermValue::Text(t) = v { Some(t.as_str()) } else { None });
        (self.info.name, self.extends, shape)
    }

    /// The proposal with some of its numbers only: elements of its lists.
    #[must_use]
    pub fn only(&self, numbers: &[usize]) -> Self {
        let mut term = self.term.clone();
        if numbers.len() < self.keys.len() {
            for value in term.values.values_mut() {
                if let TermValue::List(list) = value
                    && list.len() == self.keys.len()
                {
                    *list = numbers.iter().map(|i| list[*i]).collect();
                }
            }
        }
        let keys = if numbers.len() < self.keys.len() {
            numbers.iter().enumerate().map(|(at, i)| (self.keys[*i].0, self.keys[*i].1.map(|_| at))).collect()
        } else {
            self.keys.clone()
        };
        Self {
            info: self.info,
            term,
            extends: self.extends,
            keys,
            columns: Vec::new(),
            kind: self.kind,
            extent: self.extent,
        }
    }

    /// How many numbers it adds: linear ones and shapes.
    pub fn parameters(&self) -> usize {
        let shapes = self.info.keys.iter().filter(|key| {
            key.role == Role::Nonlinear
                && self.term.values.contains_key(key.name)
                && !self.keys.iter().any(|(k, _)| k.name == key.name)
                && !self.kind.is_scale(key)
        });
        let orders = usize::from(self.term.values.contains_key("orders"));
        self.keys.len() + shapes.count() + orders
    }

    /// Whether weights are such that the term is of its kind.
    pub fn accepts(&self, weights: &[f64]) -> bool {
        let mut pairs = self.keys.iter().zip(weights);
        pairs.all(|((key, _), weight)| weight.is_finite() && (!self.kind.has_to_be_positive(key) || *weight > 0.0))
    }

    /// Whether a fitted model's term of this proposal is of its kind.
    pub fn accepts_fitted(&self, model: &Model) -> bool {
        let Some(term) = self.extends.map_or(model.terms.last(), |at| model.terms.get(at)) else { return false };
        let values = |key: &'static KeyInfo| match term.values.get(key.name) {
            Some(TermValue::Number(x)) => vec![*x],
            Some(TermValue::List(l)) => l.clone(),
            _ => Vec::new(),
        };
        let fits = |(key, _): &(&'static KeyInfo, Option<usize>)| {
            values(key).iter().all(|x| x.is_finite() && (!self.kind.has_to_be_positive(key) || *x > 0.0))
        };
        self.keys.iter().all(fits) && self.kind.is_of_kind(term, &self.extent) && term.check().is_ok()
    }

    /// The model with the term in it, its linear numbers as given.
    pub fn applied(&self, model: &Model, weights: &[f64]) -> Model {
        let mut term = self.term.clone();
        for key in self.info.keys.iter().filter(|k| self.keys.iter().any(|(own, _)| own.name == k.name)) {
            if let Form::List { .. } = key.form {
                let length = self.keys.iter().filter(|(k, _)| k.name == key.name).count();
                term.values.insert(key.name.to_owned(), TermValue::List(vec![0.0; length]));
            }
        }
        for ((key, index), weight) in self.keys.iter().zip(weights) {
            term = if index.is_some() || key.role == Role::Linear {
                set(&term, key, *index, *weight)
            } else {
                self.kind.with_more(&term, key, *weight)
            };
        }
        self.kind.complete(&mut term);
        let mut model = model.clone();
        match self.extends.filter(|at| has_room(&model.terms[*at], &term)) {
            Some(at) => {
                for (key, value) in &term.values {
                    if let (Some(TermValue::List(own)), TermValue::List(new)) =
                        (model.terms[at].values.get_mut(key), value)
                    {
                        own.extend(new);
                    }
                }
            }
            None => model.terms.push(term),
        }
        model
    }
}
