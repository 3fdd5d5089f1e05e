//! What is asked of a real recording: its known answers, terms dropped from a textbook base, effects added, changes of the machine.

use std::path::Path;

use super::entry::{Entry, KnownAnswer, RealError, SIMULATION};
use super::question::{Part, Question};
use super::textbook::{Channels, Fit};
use crate::model::{Base, GearSection, Model, Term, TermValue};
use crate::physics::predict::predict;
use crate::prove::generator::{PlantModel, Rng, deviation};
use crate::prove::key::sha256;
use crate::recording::{Recording, Samples};

/// A dropped term is asked for if it makes the squared error of the others so much larger.
const WORTH_ASKING: f64 = 0.2;
/// An added effect that lessens the squared error of base and answers by less than this, fitted with its own shape, is not asked for.
const VISIBLE_SHARE: f64 = 0.03;
/// Rms of an added effect over that of the torque.
const ADDED: [f64; 3] = [0.01, 0.03, 0.10];
/// Kinds that can stand in a base as terms.
const TERMS: [&str; 5] = ["gravity_load", "inertia", "coulomb_friction", "viscous_friction", "torque_ripple"];

/// All questions of `parts` about `entry`.
///
/// # Errors
/// The recording cannot be read.
pub fn of(entry: &Entry, folder: &Path, parts: &[Part]) -> Result<Vec<Question>, RealError> {
    let recording = entry.read(folder)?;
    let material = Material { entry, channels: Channels::of(&recording), recording };
    let mut questions = Vec::new();
    for part in parts {
        match part {
            Part::Answers => questions.push(material.answers()),
            Part::Dropped => questions.extend(material.dropped()),
            Part::Added => questions.extend(material.added()),
            Part::Pairs => questions.extend(material.changed(folder)?),
        }
    }
    Ok(questions)
}

struct Material<'a> {
    entry: &'a Entry,
    channels: Channels,
    recording: Recording,
}

/// A kind of a base, with the orders of a ripple.
type Kind = (String, Vec<f64>);

impl Material<'_> {
    /// The torque to be explained by terms.
    fn torque(&self, recording: &Recording) -> Samples {
        let torque = recording.torque.clone().unwrap_or_default();
        match &recording.torque_sim_nm {
            Some(simulated) => torque.iter().zip(simulated).map(|(t, s)| t - s).collect(),
            None => torque,
        }
    }

    /// A textbook fit with `kinds`, and the shape chosen for each.
    fn fit(&self, torque: &[f64], kinds: &[Kind]) -> (Fit, Vec<Option<usize>>) {
        let mut fit = Fit::new(torque);
        let chosen = kinds.iter().map(|(kind, orders)| fit.add(&self.channels.shapes(kind, orders))).collect();
        (fit, chosen)
    }

    fn kinds(names: &[String]) -> Vec<Kind> {
        names.iter().filter(|n| *n != SIMULATION).map(|n| (n.clone(), Vec::new())).collect()
    }

    fn base(&self) -> Vec<Kind> {
        Self::kinds(&self.entry.base)
    }

    fn true_kinds(&self) -> Vec<Kind> {
        self.entry.answer.iter().map(|a: &KnownAnswer| (a.kinds[0].clone(), a.orders.clone())).collect()
    }

    /// The base and, of a log of terms, every answer that can stand in one as a term.
    fn full(&self) -> Vec<Kind> {
        if self.entry.simulated() { self.base() } else { self.with_answers() }
    }

    /// The same, beside a simulation too.
    fn with_answers(&self) -> Vec<Kind> {
        let mut full = self.base();
        if !self.entry.gear() {
            let answers = self.true_kinds().into_iter().filter(|(k, _)| TERMS.contains(&k.as_str()));
            full.extend(answers.filter(|(k, _)| !self.entry.base.contains(k)));
        }
        full
    }

    fn question(
        &self,
        part: Part,
        recording: Recording,
        base: &[Kind],
        truth: &[Kind],
        asked: Vec<Vec<String>>,
    ) -> Question {
        let torque = self.torque(&recording);
        let (fit, chosen) = self.fit(&torque, base);
        let model = self.model(base, &fit.weights(), &chosen);
        let (with, _) = self.fit(&torque, &[base, truth].concat());
        self.asking(part, recording, model, asked, [fit.error(), with.error()])
    }

    /// A question about a recording beside a base, with the errors of the base and of the true terms beside it.
    fn asking(
        &self,
        part: Part,
        recording: Recording,
        base: Model,
        asked: Vec<Vec<String>>,
        [base_error, textbook_error]: [f64; 2],
    ) -> Question {
        Question {
            part,
            file: self.entry.file.clone(),
            machine: self.entry.machine.clone(),
            split: self.entry.split,
            detail: String::new(),
            recording,
            base,
            asked,
            may_also: self.entry.may_also.clone(),
            base_error,
            textbook_error,
        }
    }

    fn answers(&self) -> Question {
        let asked = self.entry.answer.iter().map(|a| a.kinds.clone()).collect();
        self.question(Part::Answers, self.recording.clone(), &self.base(), &self.true_kinds(), asked)
    }

    fn dropped(&self) -> Vec<Question> {
        let full = self.full();
        let only_answer = |kind: &Kind| self.entry.answer.len() == 1 && self.entry.answer[0].kinds.contains(&kind.0);
        if full.iter().any(|(k, _)| !TERMS.contains(&k.as_str())) {
            return Vec::new();
        }
        full.iter()
            .filter(|kind| !only_answer(kind))
            .filter_map(|dropped| {
                let rest: Vec<Kind> = full.iter().filter(|k| *k != dropped).cloned().collect();
                let asked = vec![vec![dropped.0.clone()]];
                let question =
                    self.question(Part::Dropped, self.recording.clone(), &rest, std::slice::from_ref(dropped), asked);
                let worth = (question.base_error / question.textbook_error).powi(2) - 1.0;
                let detail = format!("without {}", dropped.0);
                (worth >= WORTH_ASKING).then(|| Question { detail, ..self.of_dahls_shape(question, &rest) })
            })
            .collect()
    }

    /// A question about Coulomb friction also accepts presliding friction where that predicts the recording better in its place: the friction is then of Dahl's shape.
    fn of_dahls_shape(&self, mut question: Question, rest: &[Kind]) -> Question {
        let asked = &mut question.asked[0];
        if asked[0] == "coulomb_friction" {
            let presliding = ("presliding_friction".to_owned(), Vec::new());
            let kinds = [rest, std::slice::from_ref(&presliding)].concat();
            let (fit, chosen) = self.fit(&self.torque(&question.recording), &kinds);
            if chosen.last().is_some_and(Option::is_some) && fit.error() < question.textbook_error {
                asked.push(presliding.0);
            }
        }
        question
    }

    fn added(&self) -> Vec<Question> {
        let digest = sha256(self.entry.file.as_bytes());
        let seed = u64::from_str_radix(&digest[..16], 16).unwrap_or(0);
        let Some((kind, unit)) = self.addition(&mut Rng::new(seed)) else { return Vec::new() };
        let full = self.full();
        // The answers that the base does not hold are still there: to be named, and not to be taken for the effect.
        let beside: Vec<Kind> = self.true_kinds().into_iter().filter(|k| full.iter().all(|f| f.0 != k.0)).collect();
        let truth = [&beside[..], std::slice::from_ref(&kind)].concat();
        let torque = self.recording.torque.clone().unwrap_or_default();
        let size = deviation(&torque);
        let norm = deviation(&unit).max(1e-12);
        let known: Vec<String> = self.entry.answer.iter().flat_map(|a| a.kinds.clone()).collect();
        ADDED
            .iter()
            .filter_map(|share| {
                let added = torque.iter().zip(&unit).map(|(t, u)| t + share * size / norm * u).collect();
                let recording = Recording { torque: Some(added), ..self.recording.clone() };
                let (mut fit, _) = self.fit(&self.torque(&recording), &[&full[..], &beside].concat());
                let without = fit.error();
                // As it was added: a textbook shape of its kind may take what the machine itself does.
                fit.add(&[vec![unit.clone()]]);
                let visible = 1.0 - (fit.error() / without).powi(2) >= VISIBLE_SHARE;
                let asked = vec![vec![kind.0.clone()]];
                let question = self.question(Part::Added, recording, &full, &truth, asked);
                let may_also = [&question.may_also[..], &known[..]].concat();
                let detail = format!("{} of {} % of the torque", kind.0, 100.0 * share);
                visible.then_some(Question { detail, may_also, ..question })
            })
            .collect()
    }

    /// The recording beside a simulation by the textbook model of the same machine before a change: base and answers, fitted to the recording before. Nothing where there was no change, or
    /// the recording before is not there.
    fn changed(&self, folder: &Path) -> Result<Option<Question>, RealError> {
        let Some(change) = &self.entry.change else { return Ok(None) };
        let entry = Entry::all().into_iter().find(|e| e.file == change.before && folder.join(&e.file).exists());
        let Some(entry) = entry else { return Ok(None) };
        let recording = entry.read(folder)?;
        let before = Material { entry: &entry, channels: Channels::of(&recording), recording };
        let kinds = before.with_answers();
        let (fit, chosen) = before.fit(&before.torque(&before.recording), &kinds);
        let model = before.model(&kinds, &fit.weights(), &chosen);
        let simulated = predict(&model, None, &self.recording)?.torque;
        let recording = Recording { torque_sim_nm: Some(simulated.into()), ..self.recording.clone() };
        let orders = |kind: &str| {
            let known = self.entry.answer.iter().find(|a| a.kinds.iter().any(|k| k == kind));
            known.map_or(Vec::new(), |a| a.orders.clone())
        };
        let truth: Vec<Kind> = change.kinds.iter().map(|kinds| (kinds[0].clone(), orders(&kinds[0]))).collect();
        let torque = self.torque(&recording);
        let errors = [&[][..], &truth].map(|kinds| self.fit(&torque, kinds).0.error());
        let question = self.asking(
            Part::Pairs,
            recording,
            self.model_of(Base::Simulation, Vec::new()),
            change.kinds.clone(),
            errors,
        );
        // What is known of the recording may have changed as well.
        let may_also = self.entry.answer.iter().flat_map(|a| &a.kinds).chain(&self.entry.may_also).cloned().collect();
        Ok(Some(Question { detail: format!("after {}", change.before), may_also, ..question }))
    }

    /// A kind that neither the base nor the answers hold, and its torque along the recording, of any size.
    fn addition(&self, rng: &mut Rng) -> Option<(Kind, Vec<f64>)> {
        if self.entry.gear() {
            return Some((("sensor_drift".to_owned(), Vec::new()), self.recording.time_s.to_vec()));
        }
        let angle = self.recording.theta_out_rad.as_ref()?;
        let (low, high) = angle.iter().fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(*q), b.max(*q)));
        let has = |kind: &str| {
            let answered = self.entry.answer.iter().any(|a| a.kinds.iter().any(|k| k == kind));
            answered || self.entry.base.iter().any(|b| b == kind)
        };
        let friction = self.channels.shapes("position_dependent_friction", &[]);
        // Of one direction of motion it is a ripple of the turn.
        if high - low > 1.0 && rng.chance(0.5) && self.channels.turns_both_ways() && !friction.is_empty() {
            let (cos, sin) = (&friction[0][0], &friction[0][1]);
            let phase = rng.phase();
            let torque = cos.iter().zip(sin).map(|(c, s)| phase.cos() * c + phase.sin() * s).collect();
            return Some((("position_dependent_friction".to_owned(), Vec::new()), torque));
        }
        if has("torque_ripple") {
            return None;
        }
        // Six periods over the range, or a whole order above.
        let order = (6.0 * std::f64::consts::TAU / (high - low)).ceil().max(7.0);
        let phase = rng.phase();
        let torque = angle.iter().map(|q| (order * q + phase).sin()).collect();
        Some((("torque_ripple".to_owned(), vec![order]), torque))
    }

    /// The model file of a base with these textbook weights, the constant's first.
    fn model(&self, base: &[Kind], weights: &[f64], chosen: &[Option<usize>]) -> Model {
        let (ratio, side) = (self.entry.ratio, self.entry.side());
        if self.entry.gear()
            && let Some(gear) = self.channels.gear()
        {
            return PlantModel::Bench(gear).model(&weights[1..], None, ratio.unwrap_or(1.0), side, 0.0);
        }
        let sigma = if self.entry.torque_side == "output" { -1.0 } else { 1.0 };
        let mut left = &weights[1..];
        let mut terms = Vec::new();
        for ((kind, orders), chosen) in base.iter().zip(chosen) {
            let Some(chosen) = chosen else { continue };
            let count = if kind == "gravity_load" { 2 } else { 2 * orders.len() }.max(1);
            let (own, rest) = left.split_at(count);
            left = rest;
            // A friction or an inertia of the wrong sign is none; it starts from next to nothing.
            let positive = (sigma * own[0]).max(1e-3 * own[0].abs()).max(1e-9);
            let number = |key: &str, x: f64| (key.to_owned(), TermValue::Number(x));
            let list = |key: &str, x: Vec<f64>| (key.to_owned(), TermValue::List(x));
            let ratio = ratio.unwrap_or(1.0);
            let values = match kind.as_str() {
                "gravity_load" => vec![number("cos_nm", own[0]), number("sin_nm", own[1])],
                "inertia" => vec![number("inertia_kgm2", positive)],
                "coulomb_friction" => {
                    let smoothing = self.channels.smoothing(*chosen);
                    vec![number("torque_nm", positive), number("smoothing_rad_per_s", smoothing)]
                }
                "viscous_friction" => vec![number("damping_nms_per_rad", positive)],
                _ => vec![
                    list("orders", orders.iter().map(|k| k / ratio).collect()),
                    list("cos_nm", own.iter().copied().step_by(2).collect()),
                    list("sin_nm", own.iter().copied().skip(1).step_by(2).collect()),
                ],
            };
            terms.push(Term { kind: kind.clone(), values: values.into_iter().collect() });
        }
        self.model_of(if self.entry.simulated() { Base::Simulation } else { Base::default() }, terms)
    }

    /// A model file of the recording's joint without a gear.
    fn model_of(&self, base: Base, terms: Vec<Term>) -> Model {
        let (ratio, torque_side) = (self.entry.ratio, self.entry.side());
        Model {
            name: self.entry.file.clone(),
            torque_unit: self.recording.torque_unit,
            gear: GearSection { base, ratio, torque_side, ..GearSection::default() },
            terms,
            ..Model::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint beside a simulation that lacks its friction, swinging through 1.6 rad or turning one way.
    fn material(entry: &Entry, one_way: bool) -> Material<'_> {
        let mut rng = Rng::new(5);
        let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
        let velocity = |t: f64| if one_way { 0.5 + 0.4 * (1.3 * t).cos() } else { 1.04 * (1.3 * t).cos() };
        let angle = |t: f64| if one_way { 0.5 * t + 0.31 * (1.3 * t).sin() } else { 0.8 * (1.3 * t).sin() };
        let velocities: Vec<f64> = time_s.iter().map(|t| velocity(*t)).collect();
        let load: Vec<f64> = time_s.iter().map(|t| 4.0 * angle(*t).sin()).collect();
        let torque = velocities.iter().zip(&load).map(|(v, load)| load + 2.0 * (v / 0.01).tanh() + 0.2 * rng.normal());
        let recording = Recording {
            torque: Some(torque.collect()),
            torque_sim_nm: Some(load.into()),
            theta_out_rad: Some(time_s.iter().map(|t| angle(*t)).collect()),
            velocity_out_rad_per_s: Some(velocities.into()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        Material { entry, channels: Channels::of(&recording), recording }
    }

    #[test]
    fn dropped_coulomb_friction_of_dahls_shape_may_be_named_presliding_friction() {
        let text = "file = \"c.csv\"\nmachine = \"joint\"\nsplit = \"development\"\nsource = \"made\"\ntorque_side = \"motor\"\nbase = []\n\
                    unknown = \"nothing\"\n[[answer]]\nkinds = [\"coulomb_friction\"]\nsource = \"made\"\n\
                    [[answer]]\nkinds = [\"viscous_friction\"]\nsource = \"made\"\n";
        let entry: Entry = toml::from_str(text).unwrap();
        for dahl in [false, true] {
            let mut material = material(&entry, false);
            let friction = if dahl {
                &material.channels.shapes("presliding_friction", &[])[2]
            } else {
                &material.channels.shapes("coulomb_friction", &[])[1]
            };
            let viscous = &material.channels.shapes("viscous_friction", &[])[0][0];
            let torque: Vec<f64> = friction[0].iter().zip(viscous).map(|(f, v)| 2.0 * f + v).collect();
            material.recording.torque = Some(torque.into());
            material.recording.torque_sim_nm = None;
            let questions = material.dropped();
            let question = questions.iter().find(|q| q.detail == "without coulomb_friction");
            assert_eq!(question.map(|q| q.asked[0].len()), Some(if dahl { 2 } else { 1 }), "{dahl}");
        }
    }

    /// An entry whose name draws an added friction over the angle, where that can be.
    fn entry() -> Entry {
        let rest = "machine = \"joint\"\nsplit = \"development\"\nsource = \"made\"\ntorque_side = \"motor\"\nbase = [\"simulation\"]\nunknown = \"nothing\"\n\
                    [[answer]]\nkinds = [\"coulomb_friction\"]\nsource = \"made\"\n";
        let named = |name: char| -> Entry { toml::from_str(&format!("file = \"{name}.csv\"\n{rest}")).unwrap() };
        let draws = |entry: &Entry| material(entry, false).added().iter().all(|q| q.detail.starts_with("position"));
        ('a'..='z').map(named).find(draws).unwrap()
    }

    #[test]
    fn an_effect_is_added_only_where_it_is_seen_beside_the_answers() {
        let entry = entry();
        let questions = material(&entry, false).added();
        // Alone, friction over the angle of any size takes part of the Coulomb friction that the base lacks.
        let details: Vec<&str> = questions.iter().map(|q| q.detail.as_str()).collect();
        assert_eq!(details, ["position_dependent_friction of 10 % of the torque"]);
        assert!(questions.iter().all(|q| q.textbook_error < 0.21 && q.base_error > 1.5));
    }

    #[test]
    fn friction_over_the_angle_is_not_added_to_a_motion_of_one_direction() {
        let entry = entry();
        let questions = material(&entry, true).added();
        assert!(!questions.is_empty() && questions.iter().all(|q| q.detail.starts_with("torque_ripple")));
    }
}
