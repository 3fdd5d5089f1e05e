//! What a term would add to a model: columns for the estimator and for the search for missing physics.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use gmhm::terms::{Domain, Form, KeyInfo, KindInfo, Role};

use super::error::PredictError;
use super::evaluate::{Followed, RecordingContext};
use super::predict::{add, context};
use super::signals::Signals;
use super::term::{Terms, has_given_base, no_terms};
use crate::model::{Model, ORDERS, Term, TermValue, TorqueSide};
use crate::recording::Recording;

/// A linear parameter of a term and what a unit of it adds to the torque.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitColumn {
    /// The key.
    pub key: &'static KeyInfo,
    /// Which number of the list; `None` where the key holds a number.
    pub index: Option<usize>,
    /// The change of the total per unit, row by row.
    pub values: Vec<f64>,
}

/// What terms add alone to the torque of one recording, by their values: a search asks for the same terms again and again.
#[derive(Debug, Default)]
pub struct Parts(Mutex<Generations>);

/// Lines that were asked for lately, and those that were before them.
#[derive(Debug, Default)]
struct Generations {
    young: HashMap<String, Arc<Vec<f64>>>,
    old: HashMap<String, Arc<Vec<f64>>>,
}

impl Generations {
    /// Numbers that each generation keeps at most.
    const MOST_NUMBERS: usize = 1 << 22;

    fn get(&mut self, key: &str) -> Option<Arc<Vec<f64>>> {
        if let Some(known) = self.young.get(key) {
            return Some(Arc::clone(known));
        }
        let (key, known) = self.old.remove_entry(key)?;
        self.insert(key, Arc::clone(&known));
        Some(known)
    }

    fn insert(&mut self, key: String, line: Arc<Vec<f64>>) {
        if (self.young.len() + 1) * line.len() > Self::MOST_NUMBERS {
            self.old = std::mem::take(&mut self.young);
        }
        self.young.insert(key, line);
    }
}

impl Parts {
    /// What a key stands for, computed where it is not known.
    fn get(
        &self,
        key: String,
        compute: impl FnOnce() -> Result<Vec<f64>, PredictError>,
    ) -> Result<Arc<Vec<f64>>, PredictError> {
        let known = self.0.lock().ok().and_then(|mut known| known.get(&key));
        if let Some(known) = known {
            return Ok(known);
        }
        let part = Arc::new(compute()?);
        if let Ok(mut known) = self.0.lock() {
            known.insert(key, Arc::clone(&part));
        }
        Ok(part)
    }
}

/// A model evaluated on a recording.
#[derive(Debug)]
pub struct Evaluation<'a> {
    context: RecordingContext<'a>,
    terms: Terms,
    followed: Followed,
    total: Vec<f64>,
    side: TorqueSide,
    parts: Option<&'a Parts>,
}

/// Linear keys of deflection terms are moved by this share of their plausible range to take a derivative.
const DEFLECTION_STEP: f64 = 1e-3;

impl<'a> Evaluation<'a> {
    /// Evaluates a model on a recording, like [`predict`](super::predict()).
    ///
    /// # Errors
    /// As there.
    pub fn new(model: &Model, asked_rad: Option<f64>, recording: &'a Recording) -> Result<Self, PredictError> {
        Self::along(model, asked_rad, recording, Signals::new(recording, model), None)
    }

    /// The same for signals that are at hand, with `parts` that other evaluations on this recording have computed.
    ///
    /// # Errors
    /// As there.
    pub fn along(
        model: &Model,
        asked_rad: Option<f64>,
        recording: &'a Recording,
        signals: Signals<'a>,
        parts: Option<&'a Parts>,
    ) -> Result<Self, PredictError> {
        let context = context(model, asked_rad, recording, signals)?;
        let mut terms = no_terms(model, context.rated_deflection_rad);
        model.terms.iter().try_for_each(|term| add(&mut terms, term))?;
        context.check(&terms)?;
        let followed = context.follow(&terms)?;
        let mut own = Self { context, terms, followed, total: Vec::new(), side: model.gear.torque_side, parts };
        own.total = match parts {
            Some(parts) => own.total_with(model, parts)?,
            None => own.context.total(&own.followed, &own.terms),
        };
        Ok(own)
    }

    /// The same, with every part computed anew: what never asks for the same term twice would only fill the store.
    #[must_use]
    pub fn without_parts(self) -> Self {
        Self { parts: None, ..self }
    }

    /// The recording's signals and the gear.
    pub fn context(&self) -> &RecordingContext<'a> {
        &self.context
    }

    /// The corrected deflection, its rate, and the base model along it.
    pub fn followed(&self) -> &Followed {
        &self.followed
    }

    /// The torque of the model, N·m.
    pub fn total(&self) -> &[f64] {
        &self.total
    }

    /// The change of the total by a term, with all its values: exact, deflection terms and delays included.
    ///
    /// # Errors
    /// Keys that are refused, signals that are missing.
    pub fn change(&self, term: &Term) -> Result<Vec<f64>, PredictError> {
        let with = self.with(term)?;
        Ok(with.iter().zip(&self.total).map(|(with, without)| with - without).collect())
    }

    /// The change of the total per linear parameter of a term, at the values of its other keys. Linear keys may be left out.
    ///
    /// Exact where the torque is linear in them: total = [`total`](Self::total) + Σ value · column. For deflection terms the columns are the derivative about the linear values given,
    /// or about 0: dT/dθ along the path times what a unit takes out of the deflection, turning points included; take a step, then ask again there.
    /// Empty for kinds without linear keys (backlash, time skew, thermal friction, a piecewise windup).
    ///
    /// # Errors
    /// Keys that are refused, signals that are missing.
    pub fn columns(&self, term: &Term) -> Result<Vec<UnitColumn>, PredictError> {
        let Some(info) = term.info() else { return self.change(term).map(|_| Vec::new()) };
        let mut zero = term.clone();
        let places = linear_places(info, &mut zero);
        let is_zero = places.iter().all(|(key, index)| get(&zero, key, *index) == 0.0);
        let here = match info.domain {
            // Nothing is taken out of the deflection.
            Domain::Deflection if is_zero => self.total.clone(),
            Domain::Deflection => self.with(&zero)?,
            _ => Vec::new(),
        };
        places
            .into_iter()
            .map(|(key, index)| {
                let values = match info.domain {
                    Domain::Deflection => self.slope(&here, &zero, key, index)?,
                    _ => self.unit(&zero, key, index)?,
                };
                Ok(UnitColumn { key, index, values })
            })
            .collect()
    }

    /// What a term of the model adds to the total at other values of its own; `None` where other parts of the model change with it.
    ///
    /// # Errors
    /// Keys that are refused, signals that are missing.
    pub fn part(&self, term: &Term) -> Result<Option<Vec<f64>>, PredictError> {
        if !self.adds_alone(term) {
            return Ok(None);
        }
        let part = match self.parts.filter(|_| self.is_of_motion_alone(term)) {
            Some(parts) => self.stored(term, parts)?.to_vec(),
            None => self.alone(term)?,
        };
        Ok(Some(self.context.delayed(part, self.terms.delay())))
    }

    /// Whether a term adds a torque that changes no other part of the model, and that none changes.
    fn adds_alone(&self, term: &Term) -> bool {
        let is_given = has_given_base(&self.terms);
        let adds = term.info().is_some_and(|info| match info.domain {
            Domain::Torque | Domain::Friction => true,
            Domain::Load => is_given || !self.terms.terms().iter().any(|other| other.follows_base()),
            Domain::Deflection | Domain::FrictionScale | Domain::Delay => false,
        });
        adds && (is_given || !term.follows_base())
    }

    /// The torque of the model. The columns of terms that depend on the recorded motion only come from `parts`, one for each linear number, so that another value of such a number needs
    /// no new evaluation.
    fn total_with(&self, model: &Model, parts: &Parts) -> Result<Vec<f64>, PredictError> {
        let (stored, others): (Vec<&Term>, Vec<&Term>) =
            model.terms.iter().partition(|term| self.adds_alone(term) && self.is_of_motion_alone(term));
        let mut rest = no_terms(model, self.context.rated_deflection_rad);
        others.into_iter().try_for_each(|term| add(&mut rest, term))?;
        let mut total = self.context.undelayed(&self.followed, &rest);
        for term in stored {
            let mut zero = term.clone();
            let places = term.info().map(|info| linear_places(info, &mut zero)).unwrap_or_default();
            let mut add = |amount: f64, term: &Term| -> Result<(), PredictError> {
                let part = self.stored(term, parts)?;
                total.iter_mut().zip(&*part).for_each(|(total, part)| *total += amount * part);
                Ok(())
            };
            if places.is_empty() {
                add(1.0, term)?;
            }
            for (key, index) in places {
                add(get(term, key, index), &set(&zero, key, index, 1.0))?;
            }
        }
        Ok(self.context.delayed(total, self.terms.delay()))
    }

    /// What a unit of a linear number of a term of the model adds, at the values of its other keys; `None` where the total is not linear in it alone.
    ///
    /// # Errors
    /// Keys that are refused, signals that are missing.
    pub fn unit_part(
        &self,
        term: &Term,
        key: &'static KeyInfo,
        index: Option<usize>,
    ) -> Result<Option<Vec<f64>>, PredictError> {
        let Some(info) = term.info().filter(|info| info.domain != Domain::Deflection) else { return Ok(None) };
        let mut zero = term.clone();
        linear_places(info, &mut zero);
        self.part(&set(&zero, key, index, 1.0))
    }

    /// Whether what a term adds depends on the recorded motion only, and not on the deflection or torque of a gear, which differ from model to model.
    fn is_of_motion_alone(&self, term: &Term) -> bool {
        let is_friction = || term.info().is_some_and(|info| info.domain == Domain::Friction);
        !term.follows_base()
            && (self.context.params.is_none() && self.followed.deflection_rad.is_empty() || is_friction())
    }

    /// What a term that depends on the recorded motion only adds before any delay, from the store where it is known.
    fn stored(&self, term: &Term, parts: &Parts) -> Result<Arc<Vec<f64>>, PredictError> {
        let term = with_active_waves_only(term);
        parts.get(self.key_of(&term), || self.alone(&term))
    }

    /// A term, and all of the model that changes what it adds before any delay.
    fn key_of(&self, term: &Term) -> String {
        let scales = self.terms.only(|term| term.info().domain == Domain::FrictionScale);
        format!("{term:?} {:?} {:?}", scales.terms(), self.side)
    }

    /// The change of the total `here` per unit of a linear number of a deflection term, from a small step of it through the whole chain.
    fn slope(
        &self,
        here: &[f64],
        term: &Term,
        key: &'static KeyInfo,
        index: Option<usize>,
    ) -> Result<Vec<f64>, PredictError> {
        let step = DEFLECTION_STEP * (key.plausible.1 - key.plausible.0);
        let moved = self.with(&set(term, key, index, get(term, key, index) + step))?;
        Ok(moved.iter().zip(here).map(|(moved, here)| (moved - here) / step).collect())
    }

    /// The total with a term more.
    fn with(&self, term: &Term) -> Result<Vec<f64>, PredictError> {
        let mut terms = self.terms.clone();
        add(&mut terms, term)?;
        self.context.check(&terms)?;
        if term.info().is_some_and(|info| info.domain == Domain::Deflection) {
            Ok(self.context.total(&self.context.follow(&terms)?, &terms))
        } else {
            Ok(self.context.total(&self.followed, &terms))
        }
    }

    /// What a unit of a linear key adds.
    fn unit(&self, zero: &Term, key: &'static KeyInfo, index: Option<usize>) -> Result<Vec<f64>, PredictError> {
        let unit = set(zero, key, index, 1.0);
        // T_base of a joint is made of terms: a load changes it, and friction may depend on it.
        self.part(&unit)?.map_or_else(|| self.change(&unit), Ok)
    }

    /// What a torque term adds alone, but for what scales it, before any delay.
    fn alone(&self, term: &Term) -> Result<Vec<f64>, PredictError> {
        let mut alone = self.terms.only(|term| term.info().domain == Domain::FrictionScale);
        add(&mut alone, term)?;
        self.context.check(&alone)?;
        Ok(self.context.torque(&self.followed, &alone))
    }
}

/// The places of the linear keys of a term's shape, which are filled with zeros where they were left out.
fn linear_places(info: &KindInfo, term: &mut Term) -> Vec<(&'static KeyInfo, Option<usize>)> {
    let shape = match term.values.get("shape") {
        Some(TermValue::Text(shape)) => Some(shape.clone()),
        _ => None,
    };
    let lists = term.values.values().filter_map(|value| match value {
        TermValue::List(list) => Some(list.len()),
        _ => None,
    });
    let length = lists.max().unwrap_or(0);
    let keys = info.keys.iter().filter(|key| key.role == Role::Linear && key.belongs_to(shape.as_deref()));
    let mut places = Vec::new();
    for key in keys {
        if let Form::List { .. } = key.form {
            term.values.entry(key.name.to_owned()).or_insert_with(|| TermValue::List(vec![0.0; length]));
            places.extend((0..length).map(|index| (key, Some(index))));
        } else {
            term.values.entry(key.name.to_owned()).or_insert(TermValue::Number(0.0));
            places.push((key, None));
        }
    }
    if info.domain != Domain::Deflection {
        for &(key, index) in &places {
            *term = set(term, key, index, 0.0);
        }
    }
    places
}

/// A series of waves without those whose coefficients are zero: a wave is then the same part whatever the orders beside it. Any other term as it is.
fn with_active_waves_only(term: &Term) -> Cow<'_, Term> {
    let (Some(info), Some(TermValue::List(orders))) = (term.info(), term.values.get(ORDERS)) else {
        return Cow::Borrowed(term);
    };
    let mut is_active = vec![false; orders.len()];
    for key in info.keys.iter().filter(|key| key.role == Role::Linear) {
        let Some(TermValue::List(coefficients)) = term.values.get(key.name) else { continue };
        is_active.iter_mut().zip(coefficients).for_each(|(active, coefficient)| *active |= *coefficient != 0.0);
    }
    // A list is not empty.
    if !is_active.contains(&false) || !is_active.contains(&true) {
        return Cow::Borrowed(term);
    }
    let mut active = term.clone();
    for value in active.values.values_mut() {
        if let TermValue::List(list) = value {
            let mut wave = is_active.iter();
            list.retain(|_| wave.next().is_none_or(|active| *active));
        }
    }
    Cow::Owned(active)
}

/// A number of a term; what it is when left out where there is none.
pub fn get(term: &Term, key: &KeyInfo, index: Option<usize>) -> f64 {
    match (term.values.get(key.name), index) {
        (Some(TermValue::Number(x)), _) => *x,
        (Some(TermValue::List(list)), Some(i)) => list.get(i).copied().unwrap_or(0.0),
        _ => f64::from(key.absent),
    }
}

/// The term with another number in a place.
#[must_use]
pub fn set(term: &Term, key: &KeyInfo, index: Option<usize>, value: f64) -> Term {
    let mut changed = term.clone();
    match (changed.values.get_mut(key.name), index) {
        (Some(TermValue::List(list)), Some(i)) if i < list.len() => list[i] = value,
        _ => {
            changed.values.insert(key.name.to_owned(), TermValue::Number(value));
        }
    }
    changed
}
