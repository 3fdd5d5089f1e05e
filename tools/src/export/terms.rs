//! Structures, values and calls of the terms.

use std::fmt::Write;

use gmhm::terms::{Domain, Form, KeyInfo, Need, Source, Value};

use super::numbers::literal;
use super::plan::{Plan, PlannedTerm};
use super::template::{comment, fill, mentions};

/// The kinds of a plan's terms, each once, with the longest of its lists.
fn kinds<'a, 'b>(plan: &'b Plan<'a>) -> Vec<(&'b PlannedTerm<'a>, usize)> {
    let mut kinds: Vec<(&PlannedTerm, usize)> = Vec::new();
    for term in &plan.terms {
        let length = term.length();
        match kinds.iter_mut().find(|(known, _)| known.info.name == term.info.name) {
            Some((_, longest)) => *longest = length.max(*longest),
            None => kinds.push((term, length)),
        }
    }
    kinds
}

impl PlannedTerm<'_> {
    fn value(&self, key: &'static KeyInfo) -> Option<Value<'_, f64>> {
        Source::<f64>::get(self.term, key)
    }

    /// Numbers in each of its lists; 0 without lists.
    fn length(&self) -> usize {
        let lists = self.info.keys.iter().filter_map(|key| match self.value(key) {
            Some(Value::List(list)) => Some(list.len()),
            _ => None,
        });
        lists.max().unwrap_or(0)
    }

    /// The keys that its source reads.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'static KeyInfo> {
        let text = self.source.text;
        self.info.keys.iter().filter(move |key| mentions(text, key.name))
    }

    fn is_friction(&self) -> bool {
        self.info.domain == Domain::Friction
    }

    /// How it is called.
    pub(super) fn call(&self) -> String {
        let of_output = self.needs_besides.contains(&Need::OutputAngle);
        let (angle, speed) = if of_output {
            ("sample->output_angle_rad", "sample->output_velocity_rad_per_s")
        } else {
            ("sample->motor_angle_rad", "sample->motor_velocity_rad_per_s")
        };
        let (term, past) = (format!("&p->{}", self.member), format!("&state->{}", self.member));
        let placeholders = [("$term", term.as_str()), ("$past", &past), ("$angle", angle), ("$speed", speed)];
        placeholders.into_iter().fold(self.source.call.to_owned(), |call, (name, text)| call.replace(name, text))
    }
}

/// The structures of the kinds: their numbers, and what they remember.
pub(super) fn types(plan: &Plan) -> String {
    let mut text = String::new();
    for (term, length) in kinds(plan) {
        let name = term.info.name;
        let _ = writeln!(text, "/* Kind {name}. */\ntypedef struct gear_{name} {{");
        if length > 0 {
            text.push_str("    uint32_t count;\n");
        }
        for key in term.keys() {
            let words = comment(&format!("{}{}{}", key.words, if key.unit.is_empty() { "" } else { ", " }, key.unit));
            let field = match key.form {
                Form::Number => format!("real {}", key.name),
                Form::List { .. } => format!("real {}[{length}]", key.name),
                Form::Choice(choices) => {
                    let of: Vec<String> = choices.iter().enumerate().map(|(k, word)| format!("{k} {word}")).collect();
                    let _ = writeln!(text, "    uint32_t {}; /* {words}: {} */", key.name, of.join(", "));
                    continue;
                }
            };
            let _ = writeln!(text, "    {field}; /* {words} */");
        }
        let _ = writeln!(text, "}} gear_{name};\n");
        if !term.source.past.is_empty() {
            let past = fill(term.source.past, &[("length", &length.to_string())]);
            let _ = writeln!(
                text,
                "/* What it remembers. */\ntypedef struct gear_{name}_past {{\n{past}}} gear_{name}_past;\n"
            );
        }
    }
    text
}

/// The members of the structure of parameters.
pub(super) fn members(plan: &Plan) -> String {
    let member = |term: &PlannedTerm| format!("    gear_{} {};\n", term.info.name, term.member);
    plan.terms.iter().map(member).collect()
}

/// The members of the structure of the past.
pub(super) fn pasts(plan: &Plan) -> String {
    let with_past = plan.terms.iter().filter(|term| !term.source.past.is_empty());
    with_past.map(|term| format!("    gear_{}_past {};\n", term.info.name, term.member)).collect()
}

/// What sets the past of every term to nothing.
pub(super) fn start_pasts(plan: &Plan) -> String {
    let mut text = String::new();
    for term in plan.terms.iter().filter(|term| !term.source.past.is_empty()) {
        let (name, member) = (term.info.name, &term.member);
        let _ = writeln!(
            text,
            "    {{\n        static const gear_{name}_past none = {{ false }};\n        state->{member} = none;\n    }}"
        );
    }
    text
}

/// The values of every term.
pub(super) fn values(plan: &Plan) -> String {
    let mut text = String::new();
    for term in &plan.terms {
        let _ = writeln!(text, "    .{} = {{", term.member);
        if term.length() > 0 {
            let _ = writeln!(text, "        .count = {}u,", term.length());
        }
        for key in term.keys() {
            let number = |x: f64| literal(x, plan.precision);
            let value = match (term.value(key), key.form) {
                (Some(Value::Number(x)), _) => number(x),
                (Some(Value::List(list)), _) => {
                    format!("{{ {} }}", list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
                }
                (Some(Value::Choice(chosen)), _) => format!("{chosen}u"),
                (_, Form::Choice(_)) => format!("{}u", key.absent),
                _ => number(f64::from(key.absent)),
            };
            let _ = writeln!(text, "        .{} = {value},", key.name);
        }
        text.push_str("    },\n");
    }
    text
}

/// The functions of the kinds.
pub(super) fn functions(plan: &Plan) -> String {
    kinds(plan).into_iter().map(|(term, _)| format!("{}\n", term.source.text)).collect()
}

/// Statements that take the deflection terms out of `theta`, those last that depend on the path.
pub(super) fn corrections(plan: &Plan) -> String {
    let of = |with_past: bool| {
        let terms = plan.terms.iter().filter(|term| term.info.domain == Domain::Deflection);
        terms.filter(move |term| term.source.past.is_empty() != with_past)
    };
    let known = of(false).map(|term| format!("    theta = theta - {};\n", term.call()));
    let followed = of(true).map(|term| format!("    theta = {};\n", term.call()));
    known.chain(followed).collect()
}

/// Statements that add every torque term to `sum`.
pub(super) fn sum(plan: &Plan) -> String {
    let of = |domains: &'static [Domain]| plan.terms.iter().filter(move |term| domains.contains(&term.info.domain));
    let scales: Vec<String> = of(&[Domain::FrictionScale]).map(PlannedTerm::call).collect();
    let scaled = !scales.is_empty() && plan.terms.iter().any(PlannedTerm::is_friction);
    let mut text = String::new();
    if scaled {
        let _ = writeln!(text, "    const real friction = {};", scales.join(" * "));
    }
    text.push_str("    real sum = 0.0_r;\n");
    for term in of(&[Domain::Torque, Domain::Load, Domain::Friction]) {
        let factor = if scaled && term.is_friction() { "friction * " } else { "" };
        let _ = writeln!(text, "    sum = sum + ({factor}{});", term.call());
    }
    text
}

/// Whether the plan has torque terms, and deflection terms.
pub(super) fn has(plan: &Plan) -> (bool, bool) {
    let of_deflection = |term: &&PlannedTerm| term.info.domain == Domain::Deflection;
    let deflections = plan.terms.iter().filter(of_deflection).count();
    let torques = |term: &&PlannedTerm| matches!(term.info.domain, Domain::Torque | Domain::Load | Domain::Friction);
    (plan.terms.iter().any(|term| torques(&term)), deflections > 0)
}
