//! What could have been left out: every kind of the core's registry with its shapes over a grid, as columns beside a fitted model.

use gmhm::terms::{KINDS, KeyInfo, KindInfo, Role};
use rayon::prelude::*;

use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::explain::Search;
use crate::kinds::candidate_grid::candidate_grid;
use crate::kinds::properties;
use crate::kinds::ranges::Ranges;
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
    /// The largest velocity of the recordings, rad/s.
    fastest_rad_per_s: f64,
    /// When they begin and end, s.
    time_s: [f64; 2],
}

/// Kinds whose terms hold lists that grow by an element.
fn grows(kind: &str) -> bool {
    matches!(kind, "kinematic_error" | "torque_ripple" | "position_dependent_friction" | "nonlocal_memory" | "creep")
}

/// Where the torque of a kind without linear numbers grows from 0, and the first step there.
fn growth(term: &Term, info: &'static KindInfo, ranges: &Ranges) -> Option<(&'static KeyInfo, f64)> {
    let (name, step) = match term.kind.as_str() {
        "backlash" => ("half_gap_rad", 2e-3 * ranges.rated_rad),
        "time_skew" => ("delay_s", 0.25 * ranges.period_s),
        "thermal_friction" => ("per_k", 1e-3),
        "soft_windup" if term.values.contains_key("k1_nm_per_rad") => {
            ("k1_nm_per_rad", 1e-2 * ranges.torque_nm / ranges.rated_rad)
        }
        _ => return None,
    };
    Some((info.key(name)?, step))
}

/// Every kind that the recordings can tell something of, beside a fitted model.
pub fn proposals(
    dataset: &Dataset<'_>,
    evaluations: &[Evaluation<'_>],
    fit: &Fitted,
    search: Search<'_>,
) -> Vec<Proposal> {
    let ranges = Ranges::new(dataset, evaluations, fit);
    let model = &fit.model;
    let mut wanted: Vec<(&'static KindInfo, Term, Option<usize>)> = Vec::new();
    for info in KINDS.iter().filter(|i| i.name != UNKNOWN && search.allows(i.name)) {
        let present = model.terms.iter().position(|t| t.kind == info.name);
        if present.is_some() && !grows(info.name) && info.name != "soft_windup" {
            continue;
        }
        for term in candidate_grid(info.name, &ranges, model) {
            if let Some(present) = present {
                // An element that the term has already adds nothing.
                let same = ["orders", "radius_rad", "tau_s"].iter().any(|key| {
                    let element = |t: &Term| match t.values.get(*key) {
                        Some(TermValue::List(l)) => l.clone(),
                        _ => Vec::new(),
                    };
                    element(&term).iter().any(|x| element(&model.terms[present]).iter().any(|y| (x - y).abs() < 1e-9))
                });
                let angle = term.values.get("angle") != model.terms[present].values.get("angle");
                if same && !angle {
                    continue;
                }
                let extends = Some(present).filter(|_| grows(info.name) && !angle);
                wanted.push((info, term, extends));
            } else {
                wanted.push((info, term, None));
            }
        }
    }
    let torque_nm = ranges.torque_nm;
    let made = wanted.into_par_iter().filter_map(|(info, term, extends)| {
        let (keys, columns) = columns(dataset, evaluations, &term, info, &ranges, model)?;
        let finite = columns.iter().all(|c| c.iter().all(|x| x.is_finite()));
        (finite && torque_nm > 0.0).then_some(Proposal {
            info,
            term,
            extends,
            keys,
            columns,
            fastest_rad_per_s: ranges.velocity_rad_per_s,
            time_s: [ranges.start_s, ranges.end_s],
        })
    });
    made.collect()
}

type Columns = (Vec<(&'static KeyInfo, Option<usize>)>, Vec<Vec<f64>>);

fn columns(
    dataset: &Dataset<'_>,
    evaluations: &[Evaluation<'_>],
    term: &Term,
    info: &'static KindInfo,
    ranges: &Ranges,
    model: &Model,
) -> Option<Columns> {
    let mut keys = Vec::new();
    let mut stacked: Vec<Vec<f64>> = Vec::new();
    if let Some((key, step)) = growth(term, info, ranges) {
        let mut column = dataset.change(evaluations, &properties::grown(term, key, step)).ok()?;
        column.iter_mut().for_each(|x| *x /= step);
        return Some((vec![(key, None)], vec![column]));
    }
    let mut full = term.clone();
    let length = full.values.values().find_map(|v| if let TermValue::List(l) = v { Some(l.len()) } else { None });
    for key in info.keys.iter().filter(|k| k.role == Role::Linear) {
        // Beside friction in the model, only what differs from it.
        if info.name == "stribeck_friction" && key.name != "static_nm" && base_friction(model) {
            let value = if key.optional { None } else { Some(TermValue::Number(0.0)) };
            if let Some(value) = value {
                full.values.insert(key.name.to_owned(), value);
            }
            continue;
        }
        if let gmhm::terms::Form::List { .. } = key.form {
            full.values.insert(key.name.to_owned(), TermValue::List(vec![0.0; length.unwrap_or(1)]));
        }
    }
    for (index, evaluation) in evaluations.iter().enumerate() {
        let units = evaluation.columns(&full).ok()?;
        for (i, unit) in units.into_iter().enumerate() {
            if index == 0 {
                keys.push((unit.key, unit.index));
                stacked.push(dataset.looked_at(&unit.values).collect());
            } else {
                stacked[i].extend(dataset.looked_at(&unit.values));
            }
        }
    }
    if info.name == "stribeck_friction" && base_friction(model) {
        let kept = keys.iter().position(|(key, _)| key.name == "static_nm")?;
        return Some((vec![keys[kept]], vec![stacked.swap_remove(kept)]));
    }
    Some((keys, stacked))
}

/// Whether the model has friction that a Stribeck term would repeat.
fn base_friction(model: &Model) -> bool {
    model.terms.iter().any(|t| t.kind == "coulomb_friction")
}

impl Proposal {
    /// Its kind, the term that it extends, and the shape of its kind.
    pub fn form(&self) -> (&'static str, Option<usize>, Option<&str>) {
        let shape = self.term.values.get("shape").or(self.term.values.get("angle"));
        let shape = shape.and_then(|v| if let TermValue::Text(t) = v { Some(t.as_str()) } else { None });
        (self.info.name, self.extends, shape)
    }

    /// How many numbers it adds: linear ones and shapes.
    pub fn parameters(&self) -> usize {
        let shapes = self.info.keys.iter().filter(|key| {
            key.role == Role::Nonlinear
                && self.term.values.contains_key(key.name)
                && !self.keys.iter().any(|(k, _)| k.name == key.name)
                && !properties::is_scale(key)
        });
        let orders = usize::from(self.term.values.contains_key("orders"));
        self.keys.len() + shapes.count() + orders
    }

    /// Whether weights are such that the term is of its kind.
    pub fn accepts(&self, weights: &[f64]) -> bool {
        let mut pairs = self.keys.iter().zip(weights);
        pairs.all(|((key, _), weight)| {
            weight.is_finite() && (!properties::positive(self.info.name, key) || *weight > 0.0)
        })
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
            values(key).iter().all(|x| x.is_finite() && (!properties::positive(self.info.name, key) || *x > 0.0))
        };
        let number = |key: &str| properties::number(term, key);
        // Friction that does not saturate within the recordings is viscous friction; without a dip it is no Stribeck friction.
        let saturates = number("smoothing_rad_per_s") <= properties::SATURATES * self.fastest_rad_per_s;
        let dips = self.info.name != "stribeck_friction" || number("static_nm") > number("coulomb_nm");
        // Wear that began long before is stiffness.
        let [from, to] = self.time_s;
        let slack = 0.1 * (to - from);
        let begins = self.info.name != "wear"
            || (number("start_s") >= from - slack && number("duration_s") <= to - from + 2.0 * slack);
        self.keys.iter().all(fits) && begins && saturates && dips && properties::is_soft(term) && term.check().is_ok()
    }

    /// The model with the term in it, its linear numbers as given.
    pub fn applied(&self, model: &Model, weights: &[f64]) -> Model {
        let mut term = self.term.clone();
        for key in self.info.keys.iter().filter(|k| self.keys.iter().any(|(own, _)| own.name == k.name)) {
            if let gmhm::terms::Form::List { .. } = key.form {
                let length = self.keys.iter().filter(|(k, _)| k.name == key.name).count();
                term.values.insert(key.name.to_owned(), TermValue::List(vec![0.0; length]));
            }
        }
        for ((key, index), weight) in self.keys.iter().zip(weights) {
            term = if index.is_some() || key.role == Role::Linear {
                set(&term, key, *index, *weight)
            } else {
                properties::grown(&term, key, *weight)
            };
        }
        if self.info.name == "stribeck_friction" {
            term.values.entry("coulomb_nm".to_owned()).or_insert(TermValue::Number(0.0));
        }
        let mut model = model.clone();
        match self.extends {
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
