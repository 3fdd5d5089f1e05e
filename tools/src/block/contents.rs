//! What a block holds, in SI units.

use std::fmt;

use gmhm::block::{
    Block, BlockError, FORMAT_VERSION, GEAR, INVERSE, JOINT, LARGEST_STEP, MASING, NAME, PHASE, PREPARED,
    PREPARED_GEAR, Record, RecordInfo, SELF_TEST, ScalarKind, TIME, TermRecord, TorqueUnit,
};
use gmhm::terms::{Form, KeyInfo, Value};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};

use crate::model::unit::per_ampere;
use crate::number::trimmed;

/// A value of a block.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Shown {
    /// A number; in the words of the block it has no more digits than they hold.
    Number(f64),
    /// A count.
    Count(u64),
    /// A list of numbers.
    List(Vec<f64>),
    /// A word or a label.
    Text(String),
    /// None is stated.
    Absent,
}

/// A named value with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Its name, as in model files where they have it.
    pub name: String,
    /// Its value.
    pub value: Shown,
    /// Its unit, empty where it has none.
    pub unit: String,
    /// What it is, in words.
    pub words: String,
}

/// A part of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// Its values.
    pub quantities: Vec<Quantity>,
}

/// What a block holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// Its parts in order.
    pub sections: Vec<Section>,
}

impl Contents {
    /// Reads a verified block.
    ///
    /// # Errors
    /// A record that cannot be, or that must not be skipped and is not known.
    pub fn of(block: &Block<'_>) -> Result<Self, BlockError> {
        let ampere = block.header().torque_unit == TorqueUnit::Ampere;
        let mut sections = vec![header(block)];
        let scales = match block.only(&GEAR)? {
            Some(record) => Fields::of(&record, &GEAR, block.header().scalar)?.scales(),
            None => (1.0, 1.0),
        };
        for record in block.records() {
            sections.push(section(&record, block.header().scalar, scales, ampere)?);
        }
        Ok(Self { sections })
    }

    /// The same as JSON: a map of values a section, terms as a list.
    pub fn json(&self) -> Json {
        let mut root = Map::new();
        let mut terms = Vec::new();
        for section in &self.sections {
            let values = section.quantities.iter().map(|q| (q.name.clone(), json!(q.value)));
            let values: Map<String, Json> = values.collect();
            match section.name.strip_prefix(TERM) {
                Some(_) => terms.push(Json::Object(values)),
                None => drop(root.insert(section.name.clone(), Json::Object(values))),
            }
        }
        root.insert("terms".to_owned(), Json::Array(terms));
        Json::Object(root)
    }
}

const TERM: &str = "term ";

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{}", short(*x)),
            Self::Count(n) => write!(f, "{n}"),
            Self::List(list) => write!(f, "[{}]", list.iter().map(|x| short(*x)).collect::<Vec<_>>().join(", ")),
            Self::Text(text) => f.write_str(text),
            Self::Absent => f.write_str("not stated"),
        }
    }
}

/// A number with the digits that single precision holds.
fn short(x: f64) -> String {
    trimmed(x, 9)
}

impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let longest = |read: fn(&Quantity) -> usize| {
            self.sections.iter().flat_map(|section| &section.quantities).map(read).max().unwrap_or(0)
        };
        let (names, values) = (longest(|q| q.name.chars().count()), longest(|q| value_with_unit(q).chars().count()));
        for (k, section) in self.sections.iter().enumerate() {
            writeln!(f, "{}[{}]", if k > 0 { "\n" } else { "" }, section.name)?;
            for quantity in &section.quantities {
                let line = format!(
                    "  {:names$}  {:values$}  {}",
                    quantity.name,
                    value_with_unit(quantity),
                    quantity.words,
                    values = values.min(40),
                );
                writeln!(f, "{}", line.trim_end())?;
            }
        }
        Ok(())
    }
}

fn value_with_unit(quantity: &Quantity) -> String {
    format!("{} {}", quantity.value, quantity.unit).trim_end().to_owned()
}

fn quantity(name: &str, value: Shown, unit: &str, words: &str) -> Quantity {
    Quantity { name: name.to_owned(), value, unit: unit.to_owned(), words: words.to_owned() }
}

fn header(block: &Block<'_>) -> Section {
    let header = block.header();
    let identity = header.identity.label();
    let identity = if identity.is_empty() { Shown::Absent } else { Shown::Text(identity.to_owned()) };
    let period = if header.period_s > 0.0 { Shown::Number(f64::from(header.period_s)) } else { Shown::Absent };
    let unit = if header.torque_unit == TorqueUnit::Ampere { "A" } else { "N·m" };
    let quantities = vec![
        quantity("gear", identity, "", "which gear the block is for"),
        quantity("format", Shown::Count(u64::from(FORMAT_VERSION)), "", "format version"),
        quantity("sequence", Shown::Count(u64::from(header.sequence)), "", "the newest on a drive counts"),
        quantity("length", Shown::Count(u64::from(header.length)), "bytes", "header and CRC-32 included"),
        quantity("crc32", Shown::Text(format!("0x{:08x}", block.crc())), "", "CRC-32/ISO-HDLC of all before it"),
        quantity("scalar", Shown::Text(header.scalar.name().to_owned()), "", "arithmetic of its words"),
        quantity("period_s", period, "s", "control period"),
        quantity("stack_depth", Shown::Count(u64::from(header.stack_depth)), "", "turning points that are remembered"),
        quantity("torque_unit", Shown::Text(unit.to_owned()), "", "what torques are counted in"),
    ];
    Section { name: "block".to_owned(), quantities }
}

/// The values of a record by name.
struct Fields {
    values: Vec<(&'static KeyInfo, f64)>,
}

impl Fields {
    fn of(record: &Record<'_>, info: &'static RecordInfo, scalar: ScalarKind) -> Result<Self, BlockError> {
        let values = record.values(info, scalar)?;
        Ok(Self { values: values.iter().map(|(field, value)| (&field.key, *value)).collect() })
    }

    fn find(&self, name: &str) -> Option<(&'static KeyInfo, f64)> {
        self.values.iter().find(|(key, _)| key.name == name).copied()
    }

    /// A field by the name that it has in SI units, multiplied by a factor; a choice by its word.
    fn quantity(&self, name: &str, shown: &str, unit: &str, factor: f64) -> Option<Quantity> {
        let (key, value) = self.find(name)?;
        let value = match key.form {
            Form::Choice(words) => Shown::Text((*words.get(value as usize)?).to_owned()),
            _ if name == "ratio" && value == 0.0 => Shown::Absent,
            _ => Shown::Number(value * factor),
        };
        Some(quantity(shown, value, unit, key.words))
    }

    /// A and T_A.
    fn scales(&self) -> (f64, f64) {
        let value = |name| self.find(name).map_or(1.0, |(_, value)| value);
        (value("rated_deflection"), value("torque_scale"))
    }
}

/// Records whose fields are shown in SI units.
const IN_SI: [&RecordInfo; 8] = [&GEAR, &MASING, &PHASE, &TIME, &INVERSE, &JOINT, &SELF_TEST, &LARGEST_STEP];

/// One record in SI units.
fn section(record: &Record<'_>, scalar: ScalarKind, scales: (f64, f64), ampere: bool) -> Result<Section, BlockError> {
    let known = |info| Fields::of(record, info, scalar);
    let (name, quantities) = match record.tag {
        tag if tag == PREPARED.tag || tag == PREPARED_GEAR.tag => {
            let info = if tag == PREPARED.tag { &PREPARED } else { &PREPARED_GEAR };
            let words = known(info)?.values.len() as u64;
            (info.name.to_owned(), vec![quantity("words", Shown::Count(words), "", info.words)])
        }
        tag if tag == NAME.tag => {
            let name = String::from_utf8_lossy(record.payload).trim_end_matches('\0').to_owned();
            (NAME.name.to_owned(), vec![quantity("name", Shown::Text(name), "", NAME.words)])
        }
        tag => match (IN_SI.into_iter().find(|info| info.tag == tag), TermRecord::decode(record)) {
            (Some(info), _) => (info.name.to_owned(), in_si(&known(info)?, info, scalar, scales)),
            (None, Some(term)) => return term.map(|term| term_section(&term, ampere)),
            (None, None) => {
                let bytes = Shown::Count(record.payload.len() as u64);
                (format!("record {tag:#06x}"), vec![quantity("bytes", bytes, "", "not known to this version")])
            }
        },
    };
    let quantities = if ampere { quantities.into_iter().map(per_current).collect() } else { quantities };
    Ok(Section { name, quantities })
}

/// The fields of a record under their names in SI units; numbers of the search and of single steps are left out.
fn in_si(fields: &Fields, info: &RecordInfo, scalar: ScalarKind, (a, t): (f64, f64)) -> Vec<Quantity> {
    // In single precision angles are in rad and torques in N·m already.
    let (angle, torque) = if scalar == ScalarKind::F32 { (1.0, 1.0) } else { (a, t) };
    let of_rate = fields.find("kernel").is_some_and(|(_, kernel)| kernel == 1.0);
    let shown = |name: &'static str| {
        let (shown, unit, factor) = match name {
            "rated_deflection" => ("rated_deflection_rad", "rad", 1.0),
            "torque_scale" => ("torque_scale_nm", "N·m", 1.0),
            "k1" => ("c1_nm_per_rad", "N·m/rad", t / a),
            "k3" => ("c2_nm_per_rad3", "N·m/rad³", t / a.powi(3)),
            "k5" => ("c3_nm_per_rad5", "N·m/rad⁵", t / a.powi(5)),
            "e" => ("e_nm_per_rad", "N·m/rad", t / a),
            "h" => ("h_nm_per_rad", "N·m/rad", t / a),
            "half_play" => ("reversal_play_rad", "rad", 2.0 * angle),
            "quadrature" => ("quadrature_nm", "N·m", t),
            "in_phase" => ("in_phase_nm", "N·m", t),
            "gain" => ("alpha", if of_rate { "N·m/rad" } else { "N·m/(rad·s)" }, t / a),
            "beta" => ("beta_per_s", "1/s", 1.0),
            "range" => ("range_rad", "rad", a),
            "least_slope" => ("least_slope_nm_per_rad", "N·m/rad", t / a),
            "deflection_zero" => ("deflection_zero_rad", "rad", 1.0),
            "solution" => ("solution_rad", "rad", angle),
            "largest_step" => ("largest_step_rad", "rad", angle),
            "rho" | "forgotten" | "ratio" | "gate" | "kernel" | "torque_side" => (name, "", 1.0),
            _ if info.tag == SELF_TEST.tag => return fields.quantity(name, &format!("{name}_nm"), "N·m", torque),
            _ => return None,
        };
        fields.quantity(name, shown, unit, factor)
    };
    info.fields.iter().filter_map(|field| shown(field.key.name)).collect()
}

fn term_section(term: &TermRecord, ampere: bool) -> Section {
    let info = term.info();
    let kind = quantity("kind", Shown::Text(info.name.to_owned()), "", info.equation);
    let values = term.values().map(|(key, value)| {
        let value = match (value, key.form) {
            (Value::Number(x), _) => Shown::Number(f64::from(x)),
            (Value::List(list), _) => Shown::List(list.iter().map(|x| f64::from(*x)).collect()),
            (Value::Choice(number), Form::Choice(words)) => {
                words.get(number).map_or(Shown::Absent, |word| Shown::Text((*word).to_owned()))
            }
            (Value::Choice(_) | Value::NoChoice, _) => Shown::Absent,
        };
        let unit = if key.unit == "1" { "" } else { key.unit };
        let quantity = quantity(key.name, value, unit, key.words);
        if ampere { per_current(quantity) } else { quantity }
    });
    Section { name: format!("{TERM}{}", info.name), quantities: std::iter::once(kind).chain(values).collect() }
}

/// A quantity per ampere where torques are counted so.
fn per_current(quantity: Quantity) -> Quantity {
    let name = per_ampere(&quantity.name).unwrap_or_else(|| quantity.name.clone());
    Quantity { name, unit: quantity.unit.replace("N·m", "A"), ..quantity }
}
