//! What could have been left out: every kind of the core's registry with its shapes over a grid, as columns beside a fitted model.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use gmhm::terms::{KINDS, KeyInfo, KindInfo, Range};
use rayon::prelude::*;

use super::explain::Search;
use super::fit::Fitted;
use super::spectrum;
use super::subject::Subject;
use crate::diagnosis::UNKNOWN;
use crate::model::{Model, Term, TermValue};
use crate::physics::Evaluation;
use crate::physics::columns::set;

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
}

/// What the recordings span.
pub struct Ranges {
    rated_rad: f64,
    velocity_rad_per_s: f64,
    torque_nm: f64,
    start_s: f64,
    end_s: f64,
    period_s: f64,
    temperature_c: Option<f64>,
    motor_orders: Vec<f64>,
    friction_orders: Vec<f64>,
    motor_turns: f64,
    output_turns: f64,
}

/// An angle that turns less than this says nothing of what turns with it, turns.
const FEWEST_MOTOR_TURNS: f64 = 0.16;
const FEWEST_OUTPUT_TURNS: f64 = 0.016;

impl Ranges {
    /// What the recordings span, and the orders that the residual of a fit holds.
    pub fn new(subject: &Subject<'_>, evaluations: &[Evaluation<'_>], fit: &Fitted) -> Self {
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let travel = |angle: &Option<Vec<f64>>| {
            angle.as_deref().map_or(0.0, |q| {
                let spans = subject.spans.iter().map(|span| {
                    let own = &q[span.clone()];
                    own.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                        - own.iter().copied().fold(f64::INFINITY, f64::min)
                });
                spans.fold(0.0, f64::max) / TAU
            })
        };
        let motor = subject.signal(evaluations, |s| s.motor_angle_rad.as_deref());
        let output = subject.signal(evaluations, |s| s.output_angle_rad.as_deref());
        let velocity = subject.signal(evaluations, |s| s.velocity_rad_per_s.as_deref());
        let temperature = subject.signal(evaluations, |s| s.temperature_c);
        let time = subject.time_s();
        let motor_turns = travel(&motor);
        let period_s = (time[subject.spans[0].end - 1] - time[0]) / (subject.spans[0].len() - 1) as f64;
        let mut ranges = Self {
            rated_rad: fit.model.gear.rated_deflection_rad.unwrap_or(0.0),
            velocity_rad_per_s: velocity.as_deref().map_or(0.0, largest),
            torque_nm: largest(&subject.target),
            start_s: time.iter().copied().fold(f64::INFINITY, f64::min),
            end_s: time.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            period_s,
            temperature_c: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64),
            motor_orders: Vec::new(),
            friction_orders: Vec::new(),
            motor_turns,
            output_turns: travel(&output),
        };
        if let Some(motor) = motor.filter(|_| motor_turns > FEWEST_MOTOR_TURNS) {
            let u = subject.filtered_twice(fit);
            let lines = subject.order_spectrum(fit, &motor, &u);
            ranges.motor_orders = spectrum::peaks(&lines, motor_turns, 4);
            // What the noise takes for its own colour still stands out of the plain residual.
            let plain = spectrum::spectrum(&motor, &subject.layout().masked(&fit.residual), |_| 1.0);
            for order in spectrum::peaks(&plain, motor_turns, 3) {
                if ranges.motor_orders.iter().all(|o| (o - order).abs() > 0.5 / motor_turns) {
                    ranges.motor_orders.push(order);
                }
            }
            if let Some(v) = velocity {
                let soft = 0.02 * ranges.velocity_rad_per_s;
                let signed: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u * (v / soft).tanh()).collect();
                let lines = subject.order_spectrum(fit, &motor, &signed);
                ranges.friction_orders = spectrum::peaks(&lines, motor_turns, 3);
            }
        }
        ranges
    }
}

impl Subject<'_> {
    /// The residual of a fit, filtered by its noise forth and back: its product with a column is what least squares sees of that column.
    pub fn filtered_twice(&self, fit: &Fitted) -> Vec<f64> {
        let white = self.layout().whiten(&fit.noise, &fit.residual);
        let mut u = vec![0.0; white.len()];
        for ((span, marks), noise) in self.spans.iter().zip(&self.marks).zip(&fit.noise) {
            noise.whiten_transposed(marks, &white[span.clone()], &mut u[span.clone()]);
        }
        u
    }

    /// The spectrum over the orders of an angle, in multiples of the noise.
    pub fn order_spectrum(&self, fit: &Fitted, angle: &[f64], u: &[f64]) -> Vec<spectrum::Line> {
        let steps = angle.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / angle.len() as f64;
        spectrum::spectrum(angle, u, |order| self.noise_gain(fit, order * steps))
    }

    /// What the noise filter multiplies the power of a wave with that advances by `radians` a sample.
    pub fn noise_gain(&self, fit: &Fitted, radians: f64) -> f64 {
        let noise = &fit.noise[0];
        let w = radians.min(std::f64::consts::PI);
        let (mut re, mut im) = (1.0, 0.0);
        for (i, a) in noise.coefficients.iter().enumerate() {
            let phase = w * (i + 1) as f64;
            re -= a * phase.cos();
            im += a * phase.sin();
        }
        (re * re + im * im) / noise.innovation_sd.max(1e-12).powi(2)
    }
}

fn term(kind: &str, values: &[(&str, TermValue)]) -> Term {
    let values: BTreeMap<String, TermValue> = values.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    Term { kind: kind.to_owned(), values }
}

fn number(x: f64) -> TermValue {
    TermValue::Number(x)
}

fn list(x: f64) -> TermValue {
    TermValue::List(vec![x])
}

fn text(x: &str) -> TermValue {
    TermValue::Text(x.to_owned())
}

/// The shapes in which a kind is tried.
fn prototypes(kind: &str, ranges: &Ranges, model: &Model) -> Vec<Term> {
    let a = ranges.rated_rad;
    let fastest = ranges.velocity_rad_per_s;
    let turning = ranges.motor_turns > FEWEST_MOTOR_TURNS;
    let swinging = ranges.output_turns > FEWEST_OUTPUT_TURNS;
    let smoothings = [0.003, 0.01, 0.03, 0.09].map(|x| x * fastest);
    let duration = ranges.end_s - ranges.start_s;
    let has = |kind: &str| model.terms.iter().any(|t| t.kind == kind);
    let waves = |orders: &[f64]| -> Vec<Term> {
        let mut unique: Vec<f64> = Vec::new();
        for &order in orders {
            if unique.iter().all(|o: &f64| (o - order).abs() > 1e-9) {
                unique.push(order);
            }
        }
        unique.into_iter().map(|order| term(kind, &[("orders", list(order))])).collect()
    };
    match kind {
        "kinematic_error" if turning => waves(&[&ranges.motor_orders[..], &[1.0, 2.0, 4.0]].concat()),
        "torque_ripple" if turning => waves(&[&ranges.motor_orders[..], &[1.0, 2.0, 3.0, 4.0, 6.0]].concat()),
        "encoder_eccentricity" | "gravity_load" if swinging => vec![term(kind, &[])],
        "coulomb_friction" | "load_dependent_friction" if fastest > 0.0 => {
            smoothings.iter().map(|&s| term(kind, &[("smoothing_rad_per_s", number(s))])).collect()
        }
        "viscous_friction" | "inertia" if fastest > 0.0 => vec![term(kind, &[])],
        "viscous_damping" => vec![term(kind, &[])],
        "stribeck_friction" if fastest > 0.0 => {
            let mut terms = Vec::new();
            for smoothing in [0.01, 0.03].map(|x| x * fastest) {
                for velocity in [0.05, 0.12, 0.28].map(|x| x * fastest) {
                    for exponent in [0.7, 1.0, 2.0] {
                        terms.push(term(
                            kind,
                            &[
                                ("stribeck_velocity_rad_per_s", number(velocity)),
                                ("exponent", number(exponent)),
                                ("smoothing_rad_per_s", number(smoothing)),
                            ],
                        ));
                    }
                }
            }
            terms
        }
        "position_dependent_friction" if fastest > 0.0 => {
            let mut terms = Vec::new();
            for &smoothing in &smoothings[..3] {
                let mut add = |angle: &str, order: f64| {
                    terms.push(term(
                        kind,
                        &[("angle", text(angle)), ("orders", list(order)), ("smoothing_rad_per_s", number(smoothing))],
                    ));
                };
                if turning {
                    let mut orders = vec![1.0, 2.0];
                    orders.extend(ranges.friction_orders.iter().filter(|o| **o != 1.0 && **o != 2.0));
                    orders.into_iter().for_each(|order| add("motor", order));
                }
                if swinging {
                    add("output", 1.0);
                    add("output", 2.0);
                }
            }
            terms
        }
        "soft_windup" if a > 0.0 => {
            let shapes = ["tanh", "rational", "gaussian"];
            let widths = [0.05, 0.08, 0.13, 0.2, 0.32, 0.5].map(|x| x * a);
            let both = |shape: &'static str| {
                widths.map(|w| term(kind, &[("shape", text(shape)), ("width_rad", number(w))])).to_vec()
            };
            shapes.into_iter().flat_map(both).collect()
        }
        "stiffness_asymmetry" => ["square", "abs"].map(|s| term(kind, &[("shape", text(s))])).to_vec(),
        "backlash" if a > 0.0 => {
            ["clearance", "play"].map(|s| term(kind, &[("shape", text(s)), ("half_gap_rad", number(0.0))])).to_vec()
        }
        "nonlocal_memory" if a > 0.0 => {
            [0.03, 0.05, 0.08, 0.13, 0.2, 0.32, 0.5, 0.8].map(|r| term(kind, &[("radius_rad", list(r * a))])).to_vec()
        }
        "creep" => {
            let mut taus = Vec::new();
            let mut tau = (30.0 * ranges.period_s).max(0.3);
            while tau < 0.7 * duration {
                taus.push(term(kind, &[("tau_s", list(tau))]));
                tau *= 1.8;
            }
            taus
        }
        "time_skew" => vec![term(kind, &[("delay_s", number(0.0))])],
        "thermal_stiffness" | "thermal_zero_drift" => {
            let reference = ranges.temperature_c.map(|t| (10.0 * t).round() / 10.0);
            reference.map(|r| vec![term(kind, &[("reference_c", number(r))])]).unwrap_or_default()
        }
        "thermal_friction" if has("coulomb_friction") || has("stribeck_friction") || has("viscous_friction") => {
            let reference = ranges.temperature_c.map(|t| (10.0 * t).round() / 10.0);
            reference
                .map(|r| vec![term(kind, &[("per_k", number(0.0)), ("reference_c", number(r))])])
                .unwrap_or_default()
        }
        "sensor_drift" => vec![term(kind, &[])],
        "wear" => {
            let mut terms = Vec::new();
            for start in [0.0, 0.12, 0.25, 0.35, 0.45, 0.55, 0.65, 0.8].map(|x| ranges.start_s + x * duration) {
                terms.push(term(kind, &[("shape", text("step")), ("start_s", number(start))]));
                for length in [0.15, 0.3].map(|x| x * duration) {
                    terms.push(term(
                        kind,
                        &[("shape", text("ramp")), ("start_s", number(start)), ("duration_s", number(length))],
                    ));
                }
            }
            let whole =
                [("shape", text("ramp")), ("start_s", number(ranges.start_s)), ("duration_s", number(duration))];
            terms.push(term(kind, &whole));
            terms
        }
        _ => Vec::new(),
    }
}

/// Kinds whose terms hold lists that grow by an element.
fn grows(kind: &str) -> bool {
    matches!(kind, "kinematic_error" | "torque_ripple" | "position_dependent_friction" | "nonlocal_memory" | "creep")
}

/// Whether one kind holds another as a special case.
pub fn generalises(kind: &str, special: &str) -> bool {
    matches!((kind, special), ("stribeck_friction", "coulomb_friction" | "viscous_friction"))
}

/// Where the torque of a kind without linear numbers grows from 0, and the first step there.
fn growth(term: &Term, info: &'static KindInfo, ranges: &Ranges) -> Option<(&'static KeyInfo, f64)> {
    let (name, step) = match term.kind.as_str() {
        "backlash" => ("half_gap_rad", 2e-3 * ranges.rated_rad),
        "time_skew" => ("delay_s", 0.25 * ranges.period_s),
        "thermal_friction" => ("per_k", 1e-3),
        _ => return None,
    };
    Some((info.key(name)?, step))
}

/// Every kind that the recordings can tell something of, beside a fitted model.
pub fn proposals(
    subject: &Subject<'_>,
    evaluations: &[Evaluation<'_>],
    fit: &Fitted,
    search: Search<'_>,
) -> Vec<Proposal> {
    let ranges = Ranges::new(subject, evaluations, fit);
    let model = &fit.model;
    let mut wanted: Vec<(&'static KindInfo, Term, Option<usize>)> = Vec::new();
    for info in KINDS.iter().filter(|i| i.name != UNKNOWN && search.allows(i.name)) {
        let present = model.terms.iter().position(|t| t.kind == info.name);
        if present.is_some() && !grows(info.name) && info.name != "soft_windup" {
            continue;
        }
        for term in prototypes(info.name, &ranges, model) {
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
        let (keys, columns) = columns(subject, evaluations, &term, info, &ranges, model)?;
        let finite = columns.iter().all(|c| c.iter().all(|x| x.is_finite()));
        (finite && torque_nm > 0.0).then_some(Proposal { info, term, extends, keys, columns })
    });
    made.collect()
}

type Columns = (Vec<(&'static KeyInfo, Option<usize>)>, Vec<Vec<f64>>);

fn columns(
    subject: &Subject<'_>,
    evaluations: &[Evaluation<'_>],
    term: &Term,
    info: &'static KindInfo,
    ranges: &Ranges,
    model: &Model,
) -> Option<Columns> {
    let mut keys = Vec::new();
    let mut stacked: Vec<Vec<f64>> = Vec::new();
    if let Some((key, step)) = growth(term, info, ranges) {
        let mut column = Vec::new();
        for evaluation in evaluations {
            let change = evaluation.change(&set(term, key, None, step)).ok()?;
            column.extend(subject.looked_at(&change).map(|x| x / step));
        }
        return Some((vec![(key, None)], vec![column]));
    }
    let mut full = term.clone();
    let length = full.values.values().find_map(|v| if let TermValue::List(l) = v { Some(l.len()) } else { None });
    for key in info.keys.iter().filter(|k| k.role == gmhm::terms::Role::Linear) {
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
                stacked.push(subject.looked_at(&unit.values).collect());
            } else {
                stacked[i].extend(subject.looked_at(&unit.values));
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
    /// How many numbers it adds: linear ones and shapes.
    pub fn parameters(&self) -> usize {
        let shapes = self.info.keys.iter().filter(|key| {
            key.role == gmhm::terms::Role::Nonlinear
                && self.term.values.contains_key(key.name)
                && !self.keys.iter().any(|(k, _)| k.name == key.name)
        });
        let orders = usize::from(self.term.values.contains_key("orders"));
        self.keys.len() + shapes.count() + orders
    }

    /// Whether weights are such that the term is of its kind.
    pub fn accepts(&self, weights: &[f64]) -> bool {
        let mut pairs = self.keys.iter().zip(weights);
        pairs.all(|((key, _), weight)| weight.is_finite() && (!positive(self.info.name, key) || *weight > 0.0))
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
            values(key).iter().all(|x| x.is_finite() && (!positive(self.info.name, key) || *x > 0.0))
        };
        self.keys.iter().all(fits) && term.check().is_ok()
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
            term = set(&term, key, *index, *weight);
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

/// Whether a kind's number has to be positive to be of its kind: friction brakes, creep and slipping elements resist, windup is soft, wear weakens. Temperature
/// may act either way.
fn positive(kind: &str, key: &KeyInfo) -> bool {
    let plausibly = key.plausible.0 >= 0.0 && !kind.starts_with("thermal") && key.name != "coulomb_nm" && !key.optional;
    matches!(key.range, Range::AtLeastZero | Range::Positive) || plausibly
}
