//! The score of one case: the diagnosis against the opened key.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::generator::{Case, Unseen, deviation};
use super::key::{HiddenEffect, Key, Role};
use super::table::Rate;
use crate::diagnose::diagnosis::{Diagnosis, Effect, ParameterValue, UNKNOWN};

/// How a detector did on one case.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CaseScore {
    /// Number of the case.
    pub index: usize,
    /// SHA-256 of its key.
    pub key_sha256: String,
    /// Its block.
    pub block: String,
    /// Kinds hidden that anybody could see.
    pub hidden: Vec<String>,
    /// Kinds hidden that nobody could see in this noise.
    pub invisible: Vec<String>,
    /// Are those kinds in the detector's library?
    pub listed: bool,
    /// Number of visible kinds that are in the library.
    #[serde(default)]
    pub to_name: usize,
    /// Names given.
    pub named: Vec<String>,
    /// The detector saw a mismatch.
    pub mismatch: bool,
    /// It saw one where there is none.
    pub false_alarm: bool,
    /// The names given are those hidden, no more and no fewer.
    pub exact: bool,
    /// Visible hidden effects of the library whose kind is in the class of an effect found.
    pub class_hits: usize,
    /// Whether the plant model was named, where it is not the base model's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plant_named: Option<bool>,
    /// For each of them: kinds in that class, and in the theoretical one.
    pub class_sizes: Vec<[usize; 2]>,
    /// Names given that stand for nothing hidden.
    pub wrong_names: Vec<String>,
    /// Visible hidden effects whose coordinate is among the first two reported.
    pub location_hits: usize,
    /// Parameters compared, of effects named exactly.
    pub parameters: Vec<ParameterScore>,
    /// Error on unseen recordings without noise, a constant apart, rms, N·m.
    pub unseen_error_nm: Option<f64>,
    /// What the base model, refitted, leaves there, N·m.
    pub base_leaves_nm: f64,
    /// Time that the detector took, s.
    pub seconds: f64,
    /// Why the detector or its prediction refused.
    pub failed: Option<String>,
}

/// One parameter beside its true value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterScore {
    /// `kind.key`, with the order where there are several.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Estimate.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ParameterScore {
    /// Does the interval of two standard deviations hold the truth?
    pub fn covered(&self) -> bool {
        (self.value - self.truth).abs() <= 2.0 * self.sd
    }

    /// Half width of that interval as a share of the true value.
    pub fn relative_width(&self) -> f64 {
        2.0 * self.sd / self.truth.abs().max(f64::MIN_POSITIVE)
    }
}

impl CaseScore {
    /// Judges names, places and parameters.
    pub fn count(&mut self, key: &Key, diagnosis: &Diagnosis) {
        self.set_key(key);
        self.mismatch = diagnosis.mismatch;
        // A plant whose model is not the base model's does differ from it.
        self.false_alarm = diagnosis.mismatch && key.effects.is_empty();
        self.named = diagnosis.effects.iter().map(|e| e.name.clone()).collect();
        let pairs = assign(key, &diagnosis.effects);
        for (hidden, found) in &pairs {
            if hidden.role == Role::Hidden && hidden.visible && hidden.listed {
                self.class_hits += 1;
                // Repeats in a class, or kinds that were taken out of the library, do not make it larger.
                let kinds: std::collections::BTreeSet<&str> = found.class().collect();
                self.class_sizes.push([kinds.len(), hidden.class.len().max(1)]);
            }
            if hidden.role == Role::Hidden && found.name == hidden.kind {
                self.parameters.extend(parameters(hidden, found));
            }
        }
        let plant = key.effects.iter().find(|e| e.role == Role::PlantModel);
        self.plant_named = plant.map(|n| pairs.iter().any(|(hidden, _)| std::ptr::eq(*hidden, n)));
        self.wrong_names = diagnosis
            .effects
            .iter()
            .filter(|e| {
                !pairs.iter().any(|(_, found)| std::ptr::eq(*found, *e)) && !excused(key, e) && !part_of(&pairs, e)
            })
            .map(|e| e.name.clone())
            .collect();
        let mut visible: Vec<&str> = key.hidden().filter(|e| e.visible).map(|e| e.kind.as_str()).collect();
        let mut names: Vec<&str> = self
            .named
            .iter()
            .map(|n| key.hidden().find(|e| e.is(n)).map_or(n.as_str(), |e| &e.kind))
            .filter(|n| visible.contains(n) || !key.effects.iter().any(|e| e.kind == *n))
            .collect();
        visible.sort_unstable();
        names.sort_unstable();
        self.exact = self.listed && visible == names;
        self.location_hits = key.hidden().filter(|e| e.visible && located(key, e, diagnosis)).count();
    }

    /// A case in which the detector refused: nothing found.
    pub fn judge_failure(&mut self, key: &Key, why: String) {
        self.set_key(key);
        self.failed = Some(why);
    }

    fn set_key(&mut self, key: &Key) {
        self.block = key.block.clone();
        let kinds = |visible: bool| key.hidden().filter(|e| e.visible == visible).map(|e| e.kind.clone()).collect();
        (self.hidden, self.invisible) = (kinds(true), kinds(false));
        self.listed = key.hidden().all(|e| e.listed);
        self.to_name = key.hidden().filter(|e| e.visible && e.listed).count();
        self.plant_named = key.effects.iter().any(|e| e.role == Role::PlantModel).then_some(false);
    }

    /// Judges the prediction of the recordings that nobody saw, against the torque without noise.
    pub fn judge_prediction(&mut self, case: &Case, predicted: &Result<Vec<Vec<f64>>, String>) {
        let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        self.base_leaves_nm = rms(&case.unseen.iter().map(|u| u.base_leaves_nm.powi(2)).collect::<Vec<f64>>());
        let wrong = |(unseen, predicted): (&Unseen, &Vec<f64>)| {
            if predicted.len() != unseen.torque_nm.len() || predicted.iter().any(|x| !x.is_finite()) {
                return Err("the prediction has other rows than the recording, or is not finite".to_owned());
            }
            let left: Vec<f64> = unseen.torque_nm.iter().zip(predicted).map(|(t, p)| t - p).collect();
            Ok(deviation(&left).powi(2))
        };
        let squares: Result<Vec<f64>, String> = predicted.as_ref().map_err(Clone::clone).and_then(|predicted| {
            if predicted.len() != case.unseen.len() {
                return Err("not every unseen recording was predicted".to_owned());
            }
            case.unseen.iter().zip(predicted).map(wrong).collect()
        });
        match squares {
            Ok(squares) => self.unseen_error_nm = Some(rms(&squares)),
            Err(why) => self.failed = Some(why),
        }
    }

    /// Share of the effect's power on unseen recordings that the extended model explains; may be negative. Nothing for nulls.
    pub fn explained(&self) -> Option<f64> {
        // Below a millinewton-metre the effect did not show there, and there is nothing to explain.
        if self.hidden.is_empty() || self.base_leaves_nm < 1e-3 {
            return None;
        }
        Some(self.unseen_error_nm.map_or(0.0, |e| 1.0 - (e / self.base_leaves_nm).powi(2)))
    }
}

/// Which effect found stands for which hidden one, each used once: as many hits as possible, then as many names.
fn assign<'a>(key: &'a Key, found: &'a [Effect]) -> Vec<(&'a HiddenEffect, &'a Effect)> {
    fn best<'a>(hidden: &'a [HiddenEffect], free: &[&'a Effect]) -> Vec<(&'a HiddenEffect, &'a Effect)> {
        let Some((first, rest)) = hidden.split_first() else { return Vec::new() };
        let mut choices = vec![best(rest, free)];
        for (i, effect) in free.iter().enumerate().filter(|(_, e)| e.class().any(|k| first.is(k))) {
            let others = [&free[..i], &free[i + 1..]].concat();
            choices.push([vec![(first, *effect)], best(rest, &others)].concat());
        }
        let worth = |pairs: &Vec<(&HiddenEffect, &Effect)>| {
            let shapes = pairs.iter().filter(|(h, _)| h.role == Role::Shape).count();
            (pairs.len() - shapes, shapes, pairs.iter().filter(|(h, e)| h.is(&e.name)).count())
        };
        choices.into_iter().rev().max_by_key(worth).unwrap_or_default()
    }
    best(&key.effects, &found.iter().collect::<Vec<_>>())
}

/// `unknown` is no wrong name; nor, where the true kind is in no list, one that explains the recording equally well.
fn excused(key: &Key, effect: &Effect) -> bool {
    effect.name == UNKNOWN && !key.effects.is_empty()
        || key.hidden().any(|hidden| !hidden.listed && hidden.class.contains(&effect.name))
}

/// A friction law that was found also counts as its parts: Stribeck friction contains Coulomb and viscous friction, also where the key calls it Coulomb friction because the dip is
/// small. In that case Stribeck friction itself may also be named beside Coulomb friction.
fn part_of(pairs: &[(&HiddenEffect, &Effect)], effect: &Effect) -> bool {
    let name = effect.name.as_str();
    pairs.iter().any(|(hidden, _)| {
        let is_of_law =
            hidden.class.iter().any(|k| k == name) && super::generator::parts(name).contains(&hidden.kind.as_str());
        let law = hidden.made_as.as_ref().unwrap_or(&hidden.kind);
        is_of_law || super::generator::parts(law).contains(&name)
    })
}

/// Is a coordinate of `hidden`, or of a kind that nobody could tell from it, among the first places, two for each effect?
fn located(key: &Key, hidden: &HiddenEffect, diagnosis: &Diagnosis) -> bool {
    let twins = hidden.class.iter().flat_map(|k| super::generator::coordinates(k).iter().copied());
    let accepted: Vec<&str> = hidden.coordinates.iter().map(String::as_str).chain(twins).collect();
    diagnosis.locations.iter().take(2 * key.effects.len()).any(|p| accepted.contains(&p.coordinate.as_str()))
}

fn parameters(hidden: &HiddenEffect, found: &Effect) -> Vec<ParameterScore> {
    let orders = |keys: &dyn Fn(&str) -> Option<ParameterValue>| -> Vec<f64> {
        keys("orders").map_or(vec![0.0], |v| v.numbers().to_vec())
    };
    let value = |name: &str| found.parameters.get(name).map(|p| p.value.clone());
    let (true_orders, found_orders) = (orders(&|k| hidden.parameters.get(k).cloned()), orders(&value));
    let mut scores = Vec::new();
    for (name, truth) in hidden.parameters.iter().filter(|(k, _)| *k != "orders") {
        let Some(estimate) = found.parameters.get(name) else { continue };
        let Some(sd) = &estimate.sd else { continue };
        for (i, order) in true_orders.iter().enumerate() {
            let Some(k) = found_orders.iter().position(|o| (o - order).abs() < 0.05) else { continue };
            if let (Some(&truth), Some(&value), Some(&sd)) =
                (truth.numbers().get(i), estimate.value.numbers().get(k), sd.numbers().get(k))
            {
                let truth = if name == "per_k" { truth_at_reference(hidden, found, truth) } else { truth };
                let suffix = if true_orders.len() > 1 { format!(" order {order}") } else { String::new() };
                scores.push(ParameterScore { name: format!("{}.{name}{suffix}", hidden.kind), truth, value, sd });
            }
        }
    }
    scores
}

/// A coefficient of temperature as the effect found states it: a stiffness c1 (1 − κ (Θ − Θ_0)) about another Θ_0 has another c1, and so another κ.
fn truth_at_reference(hidden: &HiddenEffect, found: &Effect, truth: f64) -> f64 {
    let number = |value: &ParameterValue| value.numbers().first().copied();
    let own = hidden.parameters.get("reference_c").and_then(number);
    let stated = found.parameters.get("reference_c").and_then(|p| number(&p.value));
    own.zip(stated).map_or(truth, |(own, stated)| truth / (1.0 - truth * (stated - own)))
}

/// What was said of one kind, over the cases in which it was hidden alone and anybody could see it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KindRow {
    /// Its cases in which that very name was given.
    pub named: Rate,
    /// Its cases in which it was in a class found.
    pub in_class: Rate,
    /// Every name given, and how often; `""` stands for nothing found.
    pub names: BTreeMap<String, usize>,
}

/// The confusion table. Kinds that the detector's library lacked stand apart, as `KIND (not in the library)`.
pub fn confusion(scores: &[CaseScore]) -> BTreeMap<String, KindRow> {
    let mut cases: BTreeMap<String, Vec<&CaseScore>> = BTreeMap::new();
    for score in scores.iter().filter(|s| s.hidden.len() == 1 && s.invisible.is_empty()) {
        let apart = if score.listed { "" } else { " (not in the library)" };
        cases.entry(format!("{}{apart}", score.hidden[0])).or_default().push(score);
    }
    let row = |scores: Vec<&CaseScore>| {
        let mut names = BTreeMap::new();
        for score in &scores {
            if score.named.is_empty() {
                *names.entry(String::new()).or_default() += 1;
            }
            score.named.iter().for_each(|name| *names.entry(name.clone()).or_default() += 1);
        }
        let count =
            |test: &dyn Fn(&CaseScore) -> bool| Rate::new(scores.iter().filter(|s| test(s)).count(), scores.len());
        KindRow { named: count(&|s| s.named.contains(&s.hidden[0])), in_class: count(&|s| s.class_hits > 0), names }
    };
    cases.into_iter().map(|(kind, scores)| (kind, row(scores))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::diagnosis::{Naming, Parameter, Side};
    use crate::diagnose::evidence::Evidence;
    use crate::prove::key::Role;

    fn hidden(kind: &str, class: &[&str], parameters: &[(&str, f64)]) -> HiddenEffect {
        let parameters = parameters.iter().map(|(k, v)| ((*k).to_owned(), ParameterValue::Number(*v))).collect();
        HiddenEffect {
            kind: kind.to_owned(),
            class: class.iter().map(|k| (*k).to_owned()).collect(),
            role: Role::Hidden,
            visible: true,
            listed: true,
            parameters,
            ..HiddenEffect::default()
        }
    }

    fn found(name: &str, parameters: &[(&str, f64, Option<f64>)]) -> Effect {
        let parameter = |value: f64, sd: Option<f64>| Parameter {
            value: ParameterValue::Number(value),
            sd: sd.map(ParameterValue::Number),
            unit: String::new(),
        };
        Effect {
            name: name.to_owned(),
            verdict: Naming::Named,
            fidelity: None,
            family: String::new(),
            closest: None,
            equivalents: Vec::new(),
            confidence: 1.0,
            share: 1.0,
            parameters: parameters.iter().map(|(k, v, sd)| ((*k).to_owned(), parameter(*v, *sd))).collect(),
            side: Side::Plant,
            why: Evidence::Written(String::new()),
        }
    }

    #[test]
    fn a_dip_that_the_key_counts_as_coulomb_friction_may_be_named_beside_it() {
        let coulomb = found("coulomb_friction", &[]);
        let dip = found("stribeck_friction", &[]);
        let small_dip = hidden("coulomb_friction", &["stribeck_friction", "coulomb_friction"], &[]);
        let no_dip = hidden("coulomb_friction", &["coulomb_friction"], &[]);
        assert!(part_of(&[(&small_dip, &coulomb)], &dip));
        assert!(!part_of(&[(&no_dip, &coulomb)], &dip));
    }

    #[test]
    fn the_viscous_part_of_a_stribeck_friction_may_be_named_beside_its_coulomb_friction() {
        let (coulomb, viscous) = (found("coulomb_friction", &[]), found("viscous_friction", &[]));
        let of_coulomb = hidden("coulomb_friction", &["stribeck_friction", "coulomb_friction"], &[]);
        let of_stribeck = HiddenEffect { made_as: Some("stribeck_friction".to_owned()), ..of_coulomb.clone() };
        assert!(part_of(&[(&of_stribeck, &coulomb)], &viscous));
        assert!(!part_of(&[(&of_coulomb, &coulomb)], &viscous));
    }

    #[test]
    fn a_part_of_a_shape_may_be_named_and_takes_no_name_of_the_effect_itself() {
        let viscous = hidden("viscous_friction", &["coulomb_friction", "viscous_friction"], &[]);
        let part = HiddenEffect { role: Role::Shape, ..hidden("coulomb_friction", &["coulomb_friction"], &[]) };
        let key = Key { effects: vec![viscous, part], ..Key::default() };
        let [coulomb, damping] = ["coulomb_friction", "viscous_friction"].map(|name| found(name, &[]));
        let both = [coulomb, damping];
        assert_eq!(assign(&key, &both).len(), 2);
        // One name alone is that of the effect, where its class holds it.
        let mut class = both[0].clone();
        class.equivalents.push("viscous_friction".to_owned());
        let found = [class];
        let [(effect, _)] = &assign(&key, &found)[..] else { panic!("one pair") };
        assert_eq!(effect.role, Role::Hidden);
        // A name of neither stays wrong.
        assert!(assign(&key, &[self::found("inertia", &[])]).is_empty());
    }

    #[test]
    fn a_thermal_stiffness_is_compared_at_the_reference_that_was_found() {
        // 8000 (1 − 0.007 (Θ − 20)) is 7664 (1 − 0.0073069 (Θ − 26)).
        let truth = hidden("thermal_stiffness", &[], &[("per_k", 0.007), ("reference_c", 20.0)]);
        let stated = found("thermal_stiffness", &[("per_k", 0.0073, Some(1e-5)), ("reference_c", 26.0, None)]);
        let [score] = &parameters(&truth, &stated)[..] else { panic!("one number has a deviation") };
        assert!((score.truth - 0.007 * 8000.0 / 7664.0).abs() < 1e-12, "{}", score.truth);
    }
}
