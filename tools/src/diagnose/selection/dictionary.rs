//! Everything that may describe what a model leaves, as columns beside a fitted model: the base, the terms found so far, every kind over its shapes, free functions.

use gmhm::terms::{KeyInfo, Role};
use rayon::prelude::*;

use super::criterion::Candidate;
use super::free_functions::{free_functions, wave_pair};
use crate::diagnose::DiagnoseError;
use crate::diagnose::candidates::{Proposal, has_room, proposals_over};
use crate::diagnose::explain::Search;
use crate::diagnose::nonparametric::Coordinates;
use crate::diagnose::ranges::FEWEST_PERIODS;
use crate::kinds::free_coordinate::FreeCoordinate;
use crate::kinds::{self, FURTHER_ELEMENT_PRICE, Kind};
use crate::model::{Model, TermValue};
use crate::numerics::basis::Basis;
use crate::numerics::block_gram::{BlockGram, Chosen};
use crate::numerics::extremes;
use crate::numerics::vector::dot;
use crate::physics::term::sigma;
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// Where a candidate comes from.
pub enum Origin {
    /// A term of the fitted model.
    Found(usize),
    /// What could be added, and which of its numbers.
    Proposed(usize, Vec<usize>),
}

/// All columns of a search, and what they stand for.
#[derive(Default)]
pub struct Dictionary {
    /// The columns.
    pub columns: Vec<Vec<f64>>,
    /// What is to be described: the torque less the base model.
    pub y: Vec<f64>,
    /// Whether the base model has a gear.
    pub(super) has_gear: bool,
    /// Whether another simulation stands in for the base model.
    pub(super) simulation: bool,
    /// Rows that count.
    pub counts: Vec<bool>,
    /// The velocity in the direction in which friction acts on the recorded torque, 0 in rows that do not count; `None` where none is recorded.
    pub against_friction: Option<Vec<f64>>,
    /// Columns of the base model and of each recording's own.
    pub base: Vec<usize>,
    /// Candidates, and where each comes from.
    pub candidates: Vec<Candidate>,
    /// Beside [`candidates`](Self::candidates).
    pub origins: Vec<Origin>,
    /// What could be added.
    pub proposals: Vec<Proposal>,
    /// Free functions: their columns.
    pub free: Vec<(FreeCoordinate, Vec<usize>)>,
}

/// The strongest orders that are looked at.
const MOST_ORDERS: usize = 14;
/// And the strongest beside those where no free function of the angle takes a part of them.
const MOST_SLOW_ORDERS: usize = 3;
/// And so many, one after another, from the residual of the model without free functions: in a short recording, functions of time or velocity can describe a wave, too.
const MOST_ORDERS_ALONE: usize = 5;
/// The first of these orders must explain this part of the squared residual. The strongest order of a cogging does; a wave fitted to an event that occurs once does not.
const LEAST_PART_OF_FIRST: f64 = 0.25;
/// Each further order must explain this part of the squared residual beside the orders before it.
const LEAST_PART_OF_FURTHER: f64 = 0.05;

/// Orders of a turn that mechanisms have: teeth, poles, slots.
fn usual_orders() -> impl Iterator<Item = f64> {
    (1..=60).chain([72, 84, 96, 120]).map(f64::from)
}

/// An order is looked at up to this share of the sampling rate.
const HIGHEST_RATE: f64 = 0.4;

impl Dictionary {
    /// The columns beside a fitted model whose terms from `search.base_terms` on were found.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub fn new(dataset: &Dataset<'_>, fit: &Fitted, search: Search<'_>) -> Result<Self, DiagnoseError> {
        let evaluations = dataset.evaluate(&fit.model)?;
        let mut see = Coordinates::new(dataset, &evaluations);
        if !fit.model.is_simulation() {
            // The load of the base alone: what was found is no coordinate of its own.
            let mut base = fit.model.clone();
            base.terms.truncate(search.base_terms);
            if let Ok(evaluations) = dataset.evaluate(&base) {
                let of_base = Coordinates::new(dataset, &evaluations);
                (see.load, see.load_rate) = (of_base.torque, of_base.torque_rate);
            }
        }
        let mut all = Self {
            y: fit.residual.clone(),
            has_gear: fit.model.has_gear(),
            simulation: fit.model.is_simulation(),
            counts: dataset.rows_that_count(),
            ..Self::default()
        };
        let sign = sigma(&fit.model.gear);
        all.against_friction = see.velocity.as_ref().map(|velocity| {
            let rows = velocity.iter().zip(&all.counts);
            rows.map(|(v, counts)| if *counts { sign * v } else { 0.0 }).collect()
        });
        all.add_fitted(fit, search);
        for function in free_functions(&see, &dataset.spans) {
            let own = all.push_all(function.columns);
            all.free.push((function.over, own));
        }
        Self::without_own(dataset, &all.counts, &mut all.columns);
        Self::without_own(dataset, &all.counts, std::slice::from_mut(&mut all.y));
        let described = all.columns.len();
        let mut ranges = dataset.ranges(&evaluations, fit);
        let peaks = std::mem::take(&mut ranges.motor_orders);
        let orders = all.strongest_orders(dataset, &see, &fit.model, &peaks);
        let mut waves = Vec::new();
        for (motor, order) in &orders {
            let q = if *motor { &see.motor } else { &see.output };
            waves.extend(q.iter().flat_map(|q| wave_pair(q, *order)));
        }
        if !waves.is_empty() {
            let own = all.push_all(waves);
            all.free.push((FreeCoordinate::Orders, own));
        }
        for (motor, order) in orders {
            let known = if motor { &mut ranges.motor_orders } else { &mut ranges.output_orders };
            if known.iter().all(|o: &f64| (o - order).abs() > 1e-6) {
                known.push(order);
            }
        }
        let proposals = proposals_over(dataset, &evaluations, &fit.model, search, &ranges, true);
        for (index, proposal) in proposals.iter().enumerate() {
            all.add_proposal(proposal, index);
        }
        all.proposals = proposals;
        Self::without_own(dataset, &all.counts, &mut all.columns[described..]);
        Ok(all)
    }

    fn push_all(&mut self, columns: Vec<Vec<f64>>) -> Vec<usize> {
        let from = self.columns.len();
        self.columns.extend(columns.into_iter().filter(|c| c.iter().all(|x| x.is_finite())));
        (from..self.columns.len()).collect()
    }

    /// The base model's columns, and each found term as a candidate; what the found terms explain is given back to the target.
    fn add_fitted(&mut self, fit: &Fitted, search: Search<'_>) {
        for (parameter, column) in fit.parameters.iter().zip(&fit.columns) {
            if parameter.is_of_base(search.base_terms) {
                self.base.push(self.columns.len());
                self.columns.push(column.clone());
            }
        }
        for term in search.base_terms..fit.model.terms.len() {
            let mut columns = Vec::new();
            let (mut positive, mut limits) = (Vec::new(), Vec::new());
            let own = &fit.model.terms[term];
            let Some(info) = own.info() else { continue };
            let linear = |parameter: &FreeParameter| matches!(parameter, FreeParameter::Term { key, .. } if key.role == Role::Linear);
            let of_term = || {
                fit.parameters
                    .iter()
                    .zip(&fit.columns)
                    .filter(|(p, _)| matches!(p, FreeParameter::Term { term: t, .. } if *t == term))
            };
            let any_linear = of_term().any(|(p, _)| linear(p));
            for (parameter, column) in of_term().filter(|(p, _)| linear(p) || !any_linear) {
                let value = parameters::value(&fit.model, *parameter);
                self.y.iter_mut().zip(column).for_each(|(y, x)| *y += value * x);
                columns.push(self.columns.len());
                self.columns.push(column.clone());
                let of_kind = match parameter {
                    FreeParameter::Term { key, .. } => kinds::of(info.name).map(|kind| (kind, key)),
                    _ => None,
                };
                positive.push(of_kind.is_some_and(|(kind, key)| self.has_to_be_positive(kind, key)));
                limits.push(of_kind.map_or((f64::NEG_INFINITY, f64::INFINITY), |(kind, key)| kind.limits(key)));
            }
            if columns.is_empty() {
                continue;
            }
            let Some(kind) = kinds::of_term(own) else { continue };
            let further = if kind.elements_are_effects() { kinds::elements(own).saturating_sub(1) } else { 0 };
            let price = kind.price() * (1.0 + FURTHER_ELEMENT_PRICE * further as f64) + kind.shape_price(own);
            self.candidates.push(Candidate {
                kind: info.name,
                largest: self.largest_of(&columns),
                columns,
                positive,
                limits,
                price,
                refines: kind.shape_refines(own),
                additive: kind.elements_are_effects(),
            });
            self.origins.push(Origin::Found(term));
        }
    }

    /// Whether a number has to be positive for a term to be of its kind.
    fn has_to_be_positive(&self, kind: &dyn Kind, key: &KeyInfo) -> bool {
        kind.has_to_be_positive(key) && !kinds::may_be_reversed(kind, self.simulation)
    }

    fn largest_of(&self, columns: &[usize]) -> Vec<f64> {
        columns.iter().map(|c| extremes::largest(&self.columns[*c])).collect()
    }

    fn add_proposal(&mut self, proposal: &Proposal, index: usize) {
        let kind = proposal.info.name;
        let own = self.push_all(proposal.columns.clone());
        let empty = |c: &Vec<f64>| c.iter().all(|x| *x == 0.0);
        if own.len() != proposal.columns.len() || own.is_empty() || proposal.columns.iter().any(empty) {
            return;
        }
        let of = proposal.kind;
        self.candidates.push(Candidate {
            kind,
            largest: self.largest_of(&own),
            columns: own,
            positive: proposal.keys.iter().map(|(key, _)| self.has_to_be_positive(of, key)).collect(),
            limits: proposal.keys.iter().map(|(key, _)| of.limits(key)).collect(),
            price: of.price() + of.shape_price(&proposal.term),
            refines: of.shape_refines(&proposal.term),
            additive: of.elements_are_effects(),
        });
        self.origins.push(Origin::Proposed(index, (0..proposal.columns.len()).collect()));
    }

    /// Takes what is each recording's own (its offset, what the gear remembers from before the first row) out of a line, over all of its rows: no prediction
    /// claims to know it, and part of it shows in one block only.
    pub(super) fn without_own(dataset: &Dataset<'_>, counts: &[bool], lines: &mut [Vec<f64>]) {
        for span in &dataset.spans {
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for nuisance in &dataset.nuisances {
                let mut own: Vec<f64> = span.clone().map(|r| if counts[r] { nuisance[r] } else { 0.0 }).collect();
                let before = dot(&own, &own);
                for _ in 0..2 {
                    basis.iter().for_each(|b| subtract(&mut own, b));
                }
                let after = dot(&own, &own);
                if after > 1e-10 * before && before > 0.0 {
                    let factor = after.sqrt().recip();
                    own.iter_mut().for_each(|x| *x *= factor);
                    basis.push(own);
                }
            }
            lines.par_iter_mut().for_each(|line| {
                let own = &mut line[span.clone()];
                own.iter_mut().zip(&counts[span.clone()]).for_each(|(x, c)| *x *= f64::from(u8::from(*c)));
                basis.iter().for_each(|b| subtract(own, b));
            });
        }
    }

    /// The columns of the free functions over some coordinates.
    pub fn free_columns(&self, over: &[FreeCoordinate]) -> Vec<usize> {
        self.free.iter().filter(|(c, _)| over.contains(c)).flat_map(|(_, columns)| columns.iter().copied()).collect()
    }

    /// Orders of the motor turn and of the output turn: those that explain most of the residual of base and free functions, and those that explain most of the residual of the model without free functions.
    fn strongest_orders(
        &self,
        dataset: &Dataset<'_>,
        see: &Coordinates,
        model: &Model,
        peaks: &[f64],
    ) -> Vec<(bool, f64)> {
        let gram = BlockGram::new(&self.columns, &dataset.spans, &self.counts);
        let targets = gram.targets(&self.columns, std::slice::from_ref(&self.y), &self.counts);
        let left = |without: &[FreeCoordinate]| {
            let free = self.free.iter().filter(|(over, _)| !without.contains(over));
            let free: Vec<usize> = free.flat_map(|(_, c)| c.iter().copied()).collect();
            let chosen = Chosen::with_free(&self.base, &free, 1e-4);
            let weights = gram.weights(&targets, &chosen);
            let mut left = gram.residual(&self.columns, &self.y, &weights, chosen.columns());
            left.iter_mut().zip(&self.counts).for_each(|(l, counts)| *l *= f64::from(u8::from(*counts)));
            left
        };
        // Within a few periods a free function of the angle takes a wave for its own.
        let (left, with_angle) = (left(&[]), left(&[FreeCoordinate::OutputAngle]));
        let rate = dataset.period_s().recip();
        let mut wanted: Vec<(bool, f64)> = Vec::new();
        for (motor, q) in [(true, &see.motor), (false, &see.output)] {
            let Some(q) = q.as_deref() else { continue };
            let turns = dataset.turns(q);
            let fastest = usual_speed(q, dataset) * rate / std::f64::consts::TAU;
            let possible = |order: f64| order * turns >= FEWEST_PERIODS && order * fastest < HIGHEST_RATE * rate;
            let ratio = model.gear.ratio.map_or(1.0, f64::abs);
            if motor || ratio != 1.0 || see.motor.is_none() {
                wanted.extend(usual_orders().filter(|o| possible(*o)).map(|o| (motor, o)));
                if motor {
                    let new = |o: &f64| wanted.iter().all(|(_, known)| (known - o).abs() > 0.5 / turns);
                    let new: Vec<f64> = peaks.iter().copied().filter(new).collect();
                    wanted.extend(new.into_iter().map(|o| (motor, o)));
                }
            }
            if !motor && see.motor.is_none() {
                let lines = crate::numerics::spectrum::high_orders(q, &left, 420.0);
                wanted.extend(lines.into_iter().filter(|o| possible(*o) && *o >= 2.5).map(|o| (motor, o)));
            }
        }
        if see.motor.is_none() {
            wanted.retain(|(_, o)| *o > 1.5);
        }
        let power = |left: &[f64], (motor, order): &(bool, f64)| -> f64 {
            let q = if *motor { see.motor.as_deref() } else { see.output.as_deref() };
            q.map_or(0.0, |q| {
                let [s, c] = q.iter().zip(left).fold([0.0, 0.0], |[s, c], (q, l)| {
                    let (sin, cos) = (order * q).sin_cos();
                    [s + sin * l, c + cos * l]
                });
                s * s + c * c
            })
        };
        let strongest = |left: &[f64], wanted: &[(bool, f64)], most: usize| -> Vec<(bool, f64)> {
            let mut scored: Vec<(f64, (bool, f64))> = wanted.par_iter().map(|w| (power(left, w), *w)).collect();
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            scored.into_iter().take(most).map(|s| s.1).collect()
        };
        let mut found = strongest(&left, &wanted, MOST_ORDERS);
        wanted.retain(|w| !found.contains(w));
        found.extend(strongest(&with_angle, &wanted, MOST_SLOW_ORDERS));
        let mut model = Basis::default();
        let of_found = self.candidates.iter().flat_map(|candidate| &candidate.columns);
        self.base.iter().chain(of_found).for_each(|c| _ = model.add(&self.columns[*c]));
        let mut left = self.y.clone();
        model.reduce(&mut left);
        wanted.extend(&found);
        for further in 0..MOST_ORDERS_ALONE {
            let before = dot(&left, &left);
            let Some(order) = strongest(&left, &wanted, 1).first().copied() else { break };
            let q = if order.0 { &see.motor } else { &see.output };
            let mut waves: Vec<Vec<f64>> = q.iter().flat_map(|q| wave_pair(q, order.1)).collect();
            Self::without_own(dataset, &self.counts, &mut waves);
            waves.iter().for_each(|wave| _ = model.add(wave));
            model.reduce(&mut left);
            let least = if further == 0 { LEAST_PART_OF_FIRST } else { LEAST_PART_OF_FURTHER };
            if dot(&left, &left) > (1.0 - least) * before {
                break;
            }
            wanted.retain(|w| *w != order);
            if !found.contains(&order) {
                found.push(order);
            }
        }
        found
    }

    /// A model with what a set says: proposals added, found terms that are not in it taken out.
    pub fn applied(
        &self,
        model: &Model,
        set: &super::criterion::Set,
        weights: &std::collections::BTreeMap<usize, Vec<f64>>,
    ) -> Model {
        let mut result = model.clone();
        let mut kept = Vec::new();
        for c in set.values().flatten() {
            match &self.origins[*c] {
                Origin::Found(term) => kept.push(*term),
                Origin::Proposed(index, numbers) => {
                    let proposal = self.proposals[*index].only(numbers);
                    result = proposal.applied(&result, &weights[c]);
                    kept.extend(proposal.extends);
                }
            }
        }
        let found = self.origins.iter().filter_map(|o| if let Origin::Found(t) = o { Some(*t) } else { None });
        let mut gone: Vec<usize> = found.filter(|t| !kept.contains(t)).collect();
        gone.sort_unstable();
        for term in gone.into_iter().rev() {
            result.terms.remove(term);
        }
        merged(result)
    }
}

/// Takes the part along a unit vector out of a line.
fn subtract(line: &mut [f64], unit: &[f64]) {
    let along = dot(line, unit);
    line.iter_mut().zip(unit).for_each(|(x, u)| *x -= along * u);
}

/// A model in which lists of the same kind and choices are one term.
fn merged(mut model: Model) -> Model {
    let mut at = 0;
    while at < model.terms.len() {
        let own = model.terms[at].clone();
        let same = |other: &crate::model::Term| {
            other.kind == own.kind
                && has_room(&own, other)
                && kinds::of_term(&own).is_some_and(Kind::elements_are_effects)
                && own.values.iter().all(|(k, v)| matches!(v, TermValue::List(_)) || other.values.get(k) == Some(v))
        };
        match (at + 1..model.terms.len()).find(|o| same(&model.terms[*o])) {
            Some(other) => {
                let other = model.terms.remove(other);
                for (key, value) in other.values {
                    if let (Some(TermValue::List(own)), TermValue::List(new)) =
                        (model.terms[at].values.get_mut(&key), value)
                    {
                        own.extend(new);
                    }
                }
            }
            None => at += 1,
        }
    }
    model
}

/// The speed of an angle that a quarter of the rows exceed, rad a row.
fn usual_speed(q: &[f64], dataset: &Dataset<'_>) -> f64 {
    let mut steps: Vec<f64> =
        dataset.spans.iter().flat_map(|s| q[s.clone()].windows(2).map(|w| (w[1] - w[0]).abs())).collect();
    if steps.is_empty() {
        return 0.0;
    }
    let at = steps.len() * 3 / 4;
    *steps.select_nth_unstable_by(at, f64::total_cmp).1
}
