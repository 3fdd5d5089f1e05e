//! Model files from TOML, every key checked at its place.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use gmhm::registry::{self, SectionInfo};
use gmhm::terms::{KINDS, KeyInfo};
use gmhm::{Elastic, Gate, Kernel, Law, Memory, ParamError};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{ModelError, ModelProblem};
use super::unit::per_newton_metre;
use super::{Base, GearSection, Model, Term, TermValue, TorqueSide};
use crate::recording::TorqueUnit;

/// Reads a model file.
///
/// # Errors
/// Whatever is not exactly a model file: [`ModelProblem`], with file, line and key.
pub fn load(path: &Path) -> Result<Model, ModelError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| ModelError {
        file: file.clone(),
        text: "".into(),
        span: None,
        key: String::new(),
        problem: Box::new(match e.kind() {
            std::io::ErrorKind::InvalidData => ModelProblem::NotText,
            _ => ModelProblem::Unreadable(e.to_string()),
        }),
    })?;
    parse(&file, &text)
}

/// Reads the text of a model file; `file` is its name for messages.
///
/// # Errors
/// As [`load`].
pub fn parse(file: &str, text: &str) -> Result<Model, ModelError> {
    // A byte-order mark would be a syntax error; the spans count without it.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    read(text).map_err(|fault| ModelError {
        file: file.to_owned(),
        text: text.into(),
        span: fault.span,
        key: fault.key,
        problem: Box::new(fault.problem),
    })
}

struct Fault {
    span: Option<Range<usize>>,
    key: String,
    problem: ModelProblem,
}

type Checked<T> = Result<T, Fault>;

const ROOT: &[&str] = &["format", "name", "gear", "elastic", "memory", "term"];

fn read(text: &str) -> Checked<Model> {
    let document = DeTable::parse(text).map_err(|e| Fault {
        span: e.span(),
        key: String::new(),
        problem: ModelProblem::Syntax(e.message().to_owned()),
    })?;
    let mut unit = UnitSeen::default();
    let root = Section::of("", document.get_ref(), 0..0, &mut unit, Known::Names(ROOT))?;
    check_format(&root)?;
    let name = root.text("name")?.unwrap_or_default().to_owned();
    let gear_section = root.table(&registry::GEAR, &mut unit)?;
    let elastic_section = root.table(&registry::ELASTIC, &mut unit)?;
    let memory_section = root.table(&registry::MEMORY, &mut unit)?;
    let terms = read_terms(&root, &mut unit)?;
    let torque_unit = unit.unit();

    let gear = gear_section
        .as_ref()
        .map(|s| read_gear(s, torque_unit))
        .transpose()?
        .unwrap_or(GearSection { torque_side: default_side(torque_unit), ..GearSection::default() });
    let elastic = elastic_section.as_ref().map(read_elastic).transpose()?;
    let memory = memory_section.as_ref().map(read_memory).transpose()?;
    if elastic.is_some() != memory.is_some() {
        let missing = if elastic.is_some() { "[memory]" } else { "[elastic]" };
        return Err(root.fault(None, ModelProblem::Missing(missing.to_owned())));
    }
    if let (Base::Simulation, Some(section)) = (gear.base, &elastic_section) {
        return Err(section.fault(None, ModelProblem::GearBesideSimulation));
    }
    let model = Model { name, torque_unit, gear, elastic, memory, terms };
    // Where the rated deflection is left to the command, everything else is checked at a stand-in.
    let rated = model.gear.rated_deflection_rad.unwrap_or(1e-3);
    if let (Some(Err(error)), Some(elastic), Some(memory)) = (model.params(rated), &elastic_section, &memory_section) {
        let key = key_of(&error);
        let sections = [memory, elastic, gear_section.as_ref().unwrap_or(memory)];
        let section = sections.into_iter().find(|s| s.entries.contains_key(key)).unwrap_or(elastic);
        return Err(section.fault(Some(key), ModelProblem::Refused(error)));
    }
    Ok(model)
}

fn check_format(root: &Section<'_>) -> Checked<()> {
    let Some(entry) = root.entries.get("format") else {
        return Err(root.fault(None, ModelProblem::Missing("format = 1".to_owned())));
    };
    match entry.value.get_ref() {
        DeValue::Integer(n) if n.as_str() == "1" => Ok(()),
        DeValue::Integer(n) => Err(root.fault(Some("format"), ModelProblem::Format(n.as_str().to_owned()))),
        other => Err(root.wrong_type("format", "the number 1", other)),
    }
}

fn default_side(unit: TorqueUnit) -> TorqueSide {
    match unit {
        TorqueUnit::NewtonMetre => TorqueSide::Output,
        TorqueUnit::Ampere => TorqueSide::Motor,
    }
}

fn read_gear(section: &Section<'_>, unit: TorqueUnit) -> Checked<GearSection> {
    let sides = [("output", TorqueSide::Output), ("motor", TorqueSide::Motor)];
    Ok(GearSection {
        ratio: section.number("ratio")?,
        torque_side: section.choice("torque_side", &sides)?.unwrap_or(default_side(unit)),
        rated_deflection_rad: section.number("rated_deflection_rad")?,
        deflection_zero_rad: section.number("deflection_zero_rad")?.unwrap_or(0.0),
        base: section.choice("base", &[("model", Base::Model), ("simulation", Base::Simulation)])?.unwrap_or_default(),
    })
}

fn read_elastic(section: &Section<'_>) -> Checked<Elastic> {
    Ok(Elastic {
        c1_nm_per_rad: section.required("c1_nm_per_rad")?,
        c2_nm_per_rad3: section.required("c2_nm_per_rad3")?,
        c3_nm_per_rad5: section.required("c3_nm_per_rad5")?,
    })
}

fn read_memory(section: &Section<'_>) -> Checked<Memory> {
    let law = section.choice("law", &[Law::Masing, Law::Phase, Law::Time].map(|l| (l.name(), l)))?.unwrap_or_default();
    let kernels = [Kernel::Deflection, Kernel::Rate].map(|k| (k.name(), k));
    let gates = [Gate::Cycle, Gate::None].map(|g| (g.name(), g));
    let omega = match law {
        Law::Time => section.number("omega_per_s")?.unwrap_or(0.0),
        Law::Masing | Law::Phase => section.required("omega_per_s")?,
    };
    Ok(Memory {
        law,
        kernel: section.choice("kernel", &kernels)?.unwrap_or_default(),
        gate: section.choice("gate", &gates)?.unwrap_or_default(),
        alpha: section.required("alpha")?,
        beta_per_s: section.required("beta_per_s")?,
        omega_per_s: omega,
        reversal_play_rad: section.number("reversal_play_rad")?.unwrap_or(0.0),
    })
}

/// The key that an error of the core is about.
fn key_of(error: &ParamError) -> &'static str {
    match error {
        ParamError::NotFinite { parameter }
        | ParamError::NotPositive { parameter, .. }
        | ParamError::Negative { parameter, .. }
        | ParamError::OutOfRange { parameter, .. }
        | ParamError::NotInLaw { parameter, .. } => parameter.split(' ').next().unwrap_or(parameter),
        ParamError::MixedSigns { .. } => "omega_per_s",
        ParamError::NoSpeed => "beta_per_s",
        // Without torque, and what the core may come to refuse beside it.
        _ => "c1_nm_per_rad",
    }
}

fn read_terms(root: &Section<'_>, unit: &mut UnitSeen) -> Checked<Vec<Term>> {
    let Some(entry) = root.entries.get("term") else { return Ok(Vec::new()) };
    let DeValue::Array(tables) = entry.value.get_ref() else {
        return Err(root.wrong_type("term", "[[term]] tables", entry.value.get_ref()));
    };
    let mut terms = Vec::new();
    for table in tables {
        let DeValue::Table(entries) = table.get_ref() else {
            return Err(root.wrong_type("term", "[[term]] tables", table.get_ref()));
        };
        let section = Section::of("[[term]]", entries, table.span(), unit, Known::Later)?;
        terms.push(read_term(&section)?);
    }
    Ok(terms)
}

fn read_term(section: &Section<'_>) -> Checked<Term> {
    let kind = section.text("kind")?;
    let kind = kind.ok_or_else(|| section.fault(None, ModelProblem::Missing("kind".to_owned())))?.to_owned();
    let mut values = BTreeMap::new();
    for key in section.entries.keys().filter(|key| *key != "kind") {
        values.insert(key.clone(), section.term_value(key)?);
    }
    let term = Term { kind, values };
    if term.info().is_none() {
        let known: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
        return Err(section.fault(Some("kind"), unknown("kind of term", &term.kind, &known)));
    }
    if let (known, Some(unknown_key)) = term.known_keys() {
        return Err(section.fault(Some(unknown_key), unknown("key", unknown_key, &known)));
    }
    match term.check() {
        Ok(()) => Ok(term),
        Err(error) => Err(section.fault(error.key(), ModelProblem::Term(error))),
    }
}

/// Whether the keys so far were per newton-metre or per ampere, and which one said so.
#[derive(Default)]
struct UnitSeen(Option<(TorqueUnit, String)>);

impl UnitSeen {
    fn unit(&self) -> TorqueUnit {
        self.0.as_ref().map_or(TorqueUnit::NewtonMetre, |(unit, _)| *unit)
    }

    fn see(&mut self, unit: TorqueUnit, key: &str) -> Result<(), ModelProblem> {
        match &self.0 {
            Some((first_unit, first)) if *first_unit != unit => {
                let ampere = *first_unit == TorqueUnit::Ampere;
                Err(ModelProblem::MixedUnits { first: first.clone(), ampere })
            }
            Some(_) => Ok(()),
            None => {
                self.0 = Some((unit, key.to_owned()));
                Ok(())
            }
        }
    }
}

struct Entry<'a> {
    key: Range<usize>,
    value: &'a Spanned<DeValue<'a>>,
}

/// A table whose keys are known and per newton-metre.
struct Section<'a> {
    name: &'static str,
    span: Range<usize>,
    entries: BTreeMap<String, Entry<'a>>,
    known: Known,
}

/// What a table may hold.
#[derive(Clone, Copy)]
enum Known {
    /// These names.
    Names(&'static [&'static str]),
    /// The keys of a section, each within its range.
    Section(&'static SectionInfo),
    /// That depends on a value in it.
    Later,
}

impl Known {
    fn names(self) -> Option<Vec<&'static str>> {
        match self {
            Self::Names(names) => Some(names.to_vec()),
            Self::Section(info) => Some(info.keys.iter().map(|key| key.name).collect()),
            Self::Later => None,
        }
    }

    fn key(self, name: &str) -> Option<&'static KeyInfo> {
        if let Self::Section(info) = self { info.key(name) } else { None }
    }
}

impl<'a> Section<'a> {
    fn of(
        name: &'static str,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        unit: &mut UnitSeen,
        known: Known,
    ) -> Checked<Self> {
        let mut section = Section { name, span, entries: BTreeMap::new(), known };
        let known = known.names();
        for (key, value) in table {
            let written = key.get_ref().as_ref();
            let (canonical, ampere) = per_newton_metre(written);
            let place = |problem| Fault { span: Some(key.span()), key: section.named(written), problem };
            if let Some(known) = &known
                && !known.contains(&canonical.as_ref())
            {
                return Err(place(unknown(if name.is_empty() { "key or section" } else { "key" }, written, known)));
            }
            let torque = super::unit::per_ampere(&canonical).is_some();
            let stated = (canonical == "torque_unit").then(|| value.get_ref().as_str()).flatten();
            let ampere = ampere || stated == Some("a");
            if torque || stated.is_some() {
                let seen = if ampere { TorqueUnit::Ampere } else { TorqueUnit::NewtonMetre };
                unit.see(seen, written).map_err(place)?;
            }
            let entry = Entry { key: key.span(), value };
            if section.entries.insert(canonical.into_owned(), entry).is_some() {
                let problem = ModelProblem::Syntax("the key stands twice, per newton-metre and per ampere".to_owned());
                return Err(section.fault(Some(written), problem));
            }
        }
        if section.entries.contains_key("torque_unit") {
            section.choice("torque_unit", &[("nm", ()), ("a", ())])?;
        }
        Ok(section)
    }

    fn table(&self, info: &'static SectionInfo, unit: &mut UnitSeen) -> Checked<Option<Section<'a>>> {
        let key = info.name;
        let Some(entry) = self.entries.get(key) else { return Ok(None) };
        let name = match key {
            "gear" => "[gear]",
            "elastic" => "[elastic]",
            _ => "[memory]",
        };
        match entry.value.get_ref() {
            DeValue::Table(table) => Section::of(name, table, entry.key.clone(), unit, Known::Section(info)).map(Some),
            other => Err(self.wrong_type(key, "a section", other)),
        }
    }

    fn number(&self, key: &str) -> Checked<Option<f64>> {
        let Some(entry) = self.entries.get(key) else { return Ok(None) };
        let value = self.finite(key, entry.value)?;
        match self.known.key(key) {
            Some(info) if !info.range.holds(value) => {
                Err(self.fault(Some(key), ModelProblem::OutOfRange { value, range: info.range.words() }))
            }
            _ => Ok(Some(value)),
        }
    }

    fn required(&self, key: &str) -> Checked<f64> {
        self.number(key)?.ok_or_else(|| self.fault(None, ModelProblem::Missing(key.to_owned())))
    }

    fn finite(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Checked<f64> {
        let place = |problem| Fault { span: Some(value.span()), key: self.named(key), problem };
        let text = match value.get_ref() {
            DeValue::Float(x) => x.as_str(),
            DeValue::Integer(n) if n.radix() == 10 => n.as_str(),
            other => return Err(place(ModelProblem::WrongType { expected: "a number", found: type_name(other) })),
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(place(ModelProblem::NotFinite(text.to_owned()))),
        }
    }

    fn text(&self, key: &str) -> Checked<Option<&str>> {
        let Some(entry) = self.entries.get(key) else { return Ok(None) };
        match entry.value.get_ref() {
            DeValue::String(text) => Ok(Some(text.as_ref())),
            other => Err(self.wrong_type(key, "a text in quotes", other)),
        }
    }

    fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Checked<Option<T>> {
        let Some(found) = self.text(key)? else { return Ok(None) };
        if let Some((_, value)) = choices.iter().find(|(name, _)| *name == found) {
            return Ok(Some(*value));
        }
        let accepted = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        Err(self.fault(Some(key), ModelProblem::NoChoice { found: found.to_owned(), accepted }))
    }

    fn term_value(&self, key: &str) -> Checked<TermValue> {
        let value = self.entries[key].value;
        match value.get_ref() {
            DeValue::String(text) => Ok(TermValue::Text(text.to_string())),
            DeValue::Array(items) => {
                let numbers: Checked<Vec<f64>> = items.iter().map(|item| self.finite(key, item)).collect();
                Ok(TermValue::List(numbers?))
            }
            DeValue::Float(_) | DeValue::Integer(_) => Ok(TermValue::Number(self.finite(key, value)?)),
            other => Err(self.wrong_type(key, "a number, a list of numbers or a text", other)),
        }
    }

    fn wrong_type(&self, key: &str, expected: &'static str, found: &DeValue<'_>) -> Fault {
        self.fault(Some(key), ModelProblem::WrongType { expected, found: type_name(found) })
    }

    /// Blames the value of a key, or the section where there is no such key.
    fn fault(&self, key: Option<&str>, problem: ModelProblem) -> Fault {
        let entry = key.and_then(|key| self.entries.get(key));
        let span = entry.map_or(self.span.clone(), |e| match e.value.get_ref() {
            DeValue::Table(_) => e.key.clone(),
            _ => e.value.span(),
        });
        Fault { span: (!span.is_empty()).then_some(span), key: self.named(key.unwrap_or_default()), problem }
    }

    fn named(&self, key: &str) -> String {
        format!("{} {key}", self.name).trim().to_owned()
    }
}

fn type_name(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a section",
    }
}

fn unknown(what: &'static str, found: &str, known: &[&str]) -> ModelProblem {
    let near = known
        .iter()
        .map(|name| (strsim::jaro_winkler(found, name), *name))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name.to_owned());
    ModelProblem::Unknown { what, near, accepted: known.join(", ") }
}
