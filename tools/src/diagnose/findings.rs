//! A verdict as `--json` writes it: where the structure sits, the effects with their parameters, and the evidence.

use std::collections::BTreeMap;

use gmhm::terms::{Form, Role, Side as TermSide};

use crate::diagnose::diagnosis::{Closest, Effect, Location, Parameter, ParameterValue, Side, UNKNOWN};
use crate::diagnose::evidence::{Evidence, Sight};
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict, STRUCTURE, coordinates};
use crate::kinds;
use crate::model::{Term, TermValue};
use crate::regression::dataset::Dataset;
use crate::regression::parameters::FreeParameter;

impl Dataset<'_> {
    /// Where the structure sits: for each effect its own coordinates first, then those of the base model's residual.
    pub(super) fn where_it_sits(&self, verdict: &DiagnosisVerdict) -> Vec<Location> {
        let mut locations: Vec<Location> = Vec::new();
        let mut add = |coordinate: &str, share: f64, detail: Sight, seconds: Vec<[f64; 2]>| {
            if !locations.iter().any(|p| p.coordinate == coordinate) {
                locations.push(Location { coordinate: coordinate.to_owned(), share, detail, seconds });
            }
        };
        for effect in &verdict.effects {
            let Some(best) = effect.curves.first() else { continue };
            let own: Vec<&str> = match effect.name.as_str() {
                UNKNOWN => vec![best.coordinate],
                name => coordinates(name),
            };
            let share =
                |gain: f64| (effect.share * (gain / best.gain.max(effect.gain)).clamp(0.0, 1.0)).clamp(0.0, 1.0);
            let stretches = self.seconds(&best.contribution);
            for coordinate in own.iter().take(2) {
                let gain = effect.curves.iter().find(|p| p.coordinate == *coordinate).map_or(effect.gain, |p| p.gain);
                add(
                    coordinate,
                    share(gain.max(0.5 * best.gain)),
                    detail(effect, coordinate, verdict),
                    stretches.clone(),
                );
            }
            let others = effect.curves.iter().filter(|p| p.net() > STRUCTURE && p.gain > 0.7 * best.gain);
            for other in others.take(2) {
                let sight = Sight::FreeCurve((other.gain / best.gain).min(1.0));
                add(other.coordinate, share(other.gain), sight, stretches.clone());
            }
        }
        locations
    }

    /// The stretches of time in which a contribution is strong.
    fn seconds(&self, contribution: &[f64]) -> Vec<[f64; 2]> {
        let mut stretches: Vec<[f64; 2]> = Vec::new();
        let all = self.time_s();
        for span in &self.spans {
            let (own, time) = (&contribution[span.clone()], &all[span.clone()]);
            let parts = 60.min(own.len());
            let power: Vec<f64> = (0..parts)
                .map(|k| {
                    let rows = own.len() * k / parts..own.len() * (k + 1) / parts;
                    let count = rows.len().max(1) as f64;
                    own[rows].iter().map(|x| x * x).sum::<f64>() / count
                })
                .collect();
            let strongest = power.iter().copied().fold(0.0, f64::max);
            for (k, p) in power.iter().enumerate() {
                if *p < 0.15 * strongest || strongest == 0.0 {
                    continue;
                }
                let (from, to) = (time[own.len() * k / parts], time[(own.len() * (k + 1) / parts).min(own.len() - 1)]);
                match stretches.last_mut() {
                    Some(last) if (last[1] - from).abs() < 1e-9 => last[1] = to,
                    _ => stretches.push([from, to]),
                }
            }
        }
        stretches
    }

    /// The effects of a verdict, each with its parameters and their standard deviations; `variances` are what other shapes of the kinds add to each free number.
    pub(super) fn effects(&self, verdict: &DiagnosisVerdict, variances: &[f64]) -> Vec<Effect> {
        let sds = self.standard_deviations(&verdict.extended).into_iter().zip(variances);
        let sds: Vec<Option<f64>> = sds.map(|(sd, more)| sd.map(|sd| (sd * sd + more).sqrt())).collect();
        let parameters = |term: usize| {
            let term_of = &verdict.extended.model.terms[term];
            let mut all = BTreeMap::new();
            for (name, value) in &term_of.values {
                let key = term_of.info().and_then(|i| i.key(name));
                let sd_at = |wanted: Option<usize>| {
                    let at = verdict.extended.parameters.iter().position(|p| {
                        matches!(p, FreeParameter::Term { term: t, key, index } if *t == term && key.name == name && *index == wanted)
                    });
                    at.and_then(|i| sds[i])
                };
                let (value, sd) = match value {
                    TermValue::Number(x) => (ParameterValue::Number(*x), sd_at(None).map(ParameterValue::Number)),
                    TermValue::List(l) => {
                        let sd: Option<Vec<f64>> = (0..l.len()).map(|i| sd_at(Some(i))).collect();
                        (ParameterValue::List(l.clone()), sd.map(ParameterValue::List))
                    }
                    TermValue::Text(t) => (ParameterValue::Text(t.clone()), None),
                };
                let free = key.is_some_and(|k| k.role != Role::Structure || !matches!(k.form, Form::Choice(_)));
                let unit = self.torque_unit().of_parameter(key.map_or("", |k| k.unit)).into_owned();
                all.insert(name.clone(), Parameter { value, sd: sd.filter(|_| free), unit });
            }
            all
        };
        let effect = |e: &EffectVerdict| {
            let term = e.term.map(|t| &verdict.extended.model.terms[t]);
            let info = term.and_then(|t| t.info()).filter(|i| i.name == e.name);
            let side = match info.map(|i| i.side) {
                _ if e.name == UNKNOWN => Side::Unknown,
                Some(TermSide::Plant) => Side::Plant,
                _ => Side::Instrument,
            };
            let all = match e.term {
                Some(at) if verdict.extended.model.terms[at].kind == e.name => parameters(at),
                _ => BTreeMap::new(),
            };
            Effect {
                name: e.name.clone(),
                verdict: e.naming,
                fidelity: e.fidelity,
                family: kinds::of(&e.name).map_or(kinds::Family::Unknown, |k| k.family()).name().to_owned(),
                closest: e.closest.clone().map(|name| Closest { name, fidelity: e.fidelity }),
                equivalents: e.equivalents.clone(),
                confidence: e.confidence.clamp(0.0, 1.0),
                share: e.share,
                parameters: all,
                side,
                why: why(e, term),
            }
        };
        verdict.effects.iter().map(effect).collect()
    }
}

/// What is seen over a coordinate.
fn detail(effect: &EffectVerdict, coordinate: &str, verdict: &DiagnosisVerdict) -> Sight {
    let orders = effect.term.and_then(|t| verdict.extended.model.terms[t].values.get("orders"));
    match (coordinate, orders) {
        ("motor_angle", Some(TermValue::List(orders))) => Sight::MotorOrders(orders.clone()),
        ("output_angle", _) => Sight::OutputTurn,
        (other, _) => Sight::Along(other.to_owned()),
    }
}

/// The evidence of an effect.
fn why(effect: &EffectVerdict, term: Option<&Term>) -> Evidence {
    let (share, gain) = (effect.share, effect.gain);
    let Some(curve) = effect.curves.first().filter(|_| effect.name == UNKNOWN) else {
        let is_other = |kind: &String| *kind != effect.name && !effect.equivalents.contains(kind);
        let runner_up = effect.tried.iter().filter(|_| effect.name != UNKNOWN).find(|(kind, ..)| is_other(kind));
        return Evidence::Explains { share, gain, runner_up: runner_up.map(|(kind, gain, _)| (kind.clone(), *gain)) };
    };
    let coordinate = curve.coordinate.to_owned();
    match (&effect.closest, term.and_then(|t| t.values.get("coordinate"))) {
        (Some(kind), _) => Evidence::Closest { kind: kind.clone(), coordinate },
        (None, Some(TermValue::Text(along))) => Evidence::Curve { coordinate, along: along.clone() },
        (None, _) => Evidence::NoCurve { coordinate },
    }
}
