//! A model as a co-simulation unit of FMI 2.0, around its C source in double precision.

use std::fmt::Write;
use std::process::Command;

use gmhm::terms::{Source, Value};
use gmhm::{Kernel, Law};

use super::archive::zip;
use super::plan::{Plan, Precision};
use super::template::{comment, fill, finish};
use super::{ExportError, ExportOptions, Exported, Origin, source};
use crate::model::Model;

const TEMPLATE: &str = include_str!("../../templates/export/fmu.c");

/// What an FMU reads the deflection from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeflectionInput {
    /// The deflection itself.
    #[default]
    Deflection,
    /// Both angles and the ratio.
    Angles,
}

/// An FMU.
#[derive(Debug)]
pub struct Fmu {
    /// The bytes of its file.
    pub bytes: Vec<u8>,
    /// What it leaves out.
    pub left_out: Vec<String>,
    /// Why it holds no binary, where it holds none.
    pub without_binary: Option<String>,
}

/// Numbers of the variables.
const FIRST_INPUT: u32 = 1;
pub(super) const FIRST_OUTPUT: u32 = 100;
pub(super) const STATUS: u32 = 200;
const FIRST_SETTING: u32 = 1000;
const FIRST_TERM: u32 = 2000;

/// A number of the unit that can be read or set.
pub(super) struct Variable {
    pub(super) reference: u32,
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) words: String,
    pub(super) start: f64,
    /// Where it stands in C.
    expression: String,
    pub(super) fixed: bool,
}

/// The unit in which numbers of a key count, by the end of its name.
fn unit_of(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 19] = [
        ("_rad_per_s2", "rad/s2"),
        ("_rad_per_s", "rad/s"),
        ("_nms_per_rad", "N.m.s/rad"),
        ("_nm_per_rad5", "N.m/rad5"),
        ("_nm_per_rad3", "N.m/rad3"),
        ("_nm_per_rad2", "N.m/rad2"),
        ("_nm_per_rad", "N.m/rad"),
        ("_nm_per_s", "N.m/s"),
        ("_nm_per_k", "N.m/K"),
        ("inertia_kgm2", "kg.m2"),
        ("per_k", "1/K"),
        ("_per_s", "1/s"),
        ("_rad", "rad"),
        ("_nm", "N.m"),
        ("_hz", "Hz"),
        ("_c", "degC"),
        ("time_s", "s"),
        ("tau_s", "s"),
        ("_s", "s"),
    ];
    UNITS.iter().find(|(end, _)| name.ends_with(end)).map_or("1", |(_, unit)| unit)
}

/// What an input of the unit is called: as recordings name it.
fn input_name(field: &'static str) -> &'static str {
    match field {
        "motor_angle_rad" => "theta_in_rad",
        "output_angle_rad" => "theta_out_rad",
        "output_velocity_rad_per_s" => "velocity_out_rad_per_s",
        other => other,
    }
}

/// An FMU of a model; a C compiler, where there is one, makes its binary.
///
/// # Errors
/// [`ExportError`], as of the source; no ratio for two angles.
pub fn fmu(
    model: &Model,
    origin: &Origin,
    options: &ExportOptions,
    deflection: DeflectionInput,
) -> Result<Fmu, ExportError> {
    // The period concerns the inverse alone, which an FMU does not ask.
    let period_s = Some(options.period_s.unwrap_or(1.0));
    let options = ExportOptions { precision: Precision::F64, self_test: false, period_s, ..options.clone() };
    let plan = Plan::new(model, &options)?;
    let exported = source::c(model, origin, &options)?;
    let angles = deflection == DeflectionInput::Angles;
    if angles && model.gear.ratio.is_none() {
        return Err(ExportError::NoRatio);
    }
    let inputs = inputs(&exported, angles);
    let settings = settings(&plan, angles);
    let terms = term_variables(&plan);
    let guid = guid(origin, &inputs);
    let c = wrapper(&plan, origin, &exported, &Tables { inputs: &inputs, settings: &settings, terms: &terms }, &guid);
    let description = super::description::xml(&plan, &inputs, &settings, &terms, &guid);
    let stem = &plan.prefix;
    let wrapper_name = format!("{stem}_fmu.c");
    let mut sources = exported.files.clone();
    sources.push((wrapper_name, c));
    let mut files = vec![("modelDescription.xml".to_owned(), description.into_bytes())];
    files.extend(sources.iter().map(|(name, text)| (format!("sources/{name}"), text.clone().into_bytes())));
    let binary = binary(&sources, stem);
    let without_binary = match binary {
        Ok(bytes) => {
            files.push((format!("binaries/{PLATFORM}/{stem}.so"), bytes));
            None
        }
        Err(why) => Some(why),
    };
    let bytes = zip(&files).map_err(|error| ExportError::Archive(error.to_string()))?;
    Ok(Fmu { bytes, left_out: exported.left_out, without_binary })
}

/// The platform of the binary, as FMI names it.
const PLATFORM: &str = "linux64";

/// The shared library of sources, or why there is none.
fn binary(sources: &[(String, String)], stem: &str) -> Result<Vec<u8>, String> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return Err("binaries are made on Linux on x86-64 only".to_owned());
    }
    let system = |error: std::io::Error| error.to_string();
    let folder = tempfile::tempdir().map_err(system)?;
    for (name, text) in sources {
        std::fs::write(folder.path().join(name), text).map_err(system)?;
    }
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let mut words = compiler.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or("cc"));
    command.args(words).current_dir(folder.path());
    command.args(["-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden"]);
    command.args(sources.iter().map(|(name, _)| name).filter(|name| name.ends_with(".c")));
    let library = format!("{stem}.so");
    let output = command.args(["-lm", "-o", &library]).output();
    let output = output.map_err(|error| format!("the C compiler `{compiler}` does not run: {error}"))?;
    if !output.status.success() {
        return Err(format!("the C compiler `{compiler}` failed: {}", String::from_utf8_lossy(&output.stderr)));
    }
    std::fs::read(folder.path().join(library)).map_err(system)
}

/// The variables of a unit.
struct Tables<'a> {
    inputs: &'a [Variable],
    settings: &'a [Variable],
    terms: &'a [Variable],
}

fn inputs(exported: &Exported, angles: bool) -> Vec<Variable> {
    let mut names: Vec<&'static str> = Vec::new();
    if angles {
        names.extend(["theta_in_rad", "theta_out_rad"]);
    }
    // The unit knows the time itself.
    let fields = exported.sample.iter().filter(|name| !matches!(**name, "period_s" | "time_s"));
    for name in fields.filter(|name| !(angles && **name == "deflection_rad")) {
        let name = input_name(name);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let words = |name: &str| match name {
        "deflection_rad" => "torsional deflection q_m/N - q_o, as the encoders show it",
        "theta_in_rad" => "angle of the motor q_m",
        "theta_out_rad" => "angle of the output q_o",
        "velocity_rad_per_s" => "v: rate of q_m/N where the torque is taken on the motor side, else of q_o",
        "acceleration_rad_per_s2" => "rate of v",
        "deflection_rate_rad_per_s" => "rate of the deflection",
        "temperature_c" => "temperature of the gear",
        "motor_velocity_rad_per_s" => "rate of q_m",
        _ => "rate of q_o",
    };
    let variable = |(number, name): (usize, &'static str)| Variable {
        reference: FIRST_INPUT + number as u32,
        name: name.to_owned(),
        unit: unit_of(name),
        words: words(name).to_owned(),
        start: if name == "temperature_c" { 20.0 } else { 0.0 },
        expression: name.to_owned(),
        fixed: false,
    };
    names.into_iter().enumerate().map(variable).collect()
}

fn settings(plan: &Plan, angles: bool) -> Vec<Variable> {
    let (params, gear) = (&plan.params, &plan.model.gear);
    let (elastic, memory) = (params.elastic(), params.memory());
    let alpha = if memory.kernel == Kernel::Rate && plan.law == Law::Time { "N.m/rad" } else { "1" };
    let mut all = vec![
        ("rated_deflection_rad", "rad", "A, amplitude of the calibrated cycle", params.rated_deflection_rad(), true),
        ("c1_nm_per_rad", "N.m/rad", "c1 of f = c1*theta + c2*theta^3 + c3*theta^5", elastic.c1_nm_per_rad, false),
        ("c2_nm_per_rad3", "N.m/rad3", "c2", elastic.c2_nm_per_rad3, false),
        ("c3_nm_per_rad5", "N.m/rad5", "c3", elastic.c3_nm_per_rad5, false),
        ("alpha", alpha, "alpha of the memory factor", memory.alpha, false),
        ("beta_per_s", "1/s", "beta of the memory factor", memory.beta_per_s, false),
    ];
    if plan.law != Law::Time {
        all.push(("omega_per_s", "1/s", "omega, speed of the pseudo-time", memory.omega_per_s, false));
    }
    if plan.law == Law::Masing {
        all.push(("reversal_play_rad", "rad", "width of the input play", memory.reversal_play_rad, false));
    }
    all.push(("deflection_zero_rad", "rad", "subtracted from the deflection", gear.deflection_zero_rad, false));
    if let (true, Some(ratio)) = (angles, gear.ratio) {
        all.push(("ratio", "1", "N, motor turns per output turn", ratio, true));
    }
    let variable =
        |(number, (name, unit, words, start, fixed)): (usize, (&str, &'static str, &str, f64, bool))| Variable {
            reference: FIRST_SETTING + number as u32,
            name: name.to_owned(),
            unit,
            words: words.to_owned(),
            start,
            expression: format!("m->setting.{name}"),
            fixed,
        };
    all.into_iter().enumerate().map(variable).collect()
}

/// The numbers of the terms: each key, of a list each element.
fn term_variables(plan: &Plan) -> Vec<Variable> {
    let mut all: Vec<Variable> = Vec::new();
    for term in &plan.terms {
        for key in term.keys() {
            let mut add = |index: Option<usize>, start: f64| {
                let at = index.map_or(String::new(), |k| format!("[{k}]"));
                let shown = index.map_or(String::new(), |k| format!("[{}]", k + 1));
                all.push(Variable {
                    reference: FIRST_TERM + all.len() as u32,
                    name: format!("{}.{}{shown}", term.member, key.name),
                    unit: unit_of(key.name),
                    words: comment(key.words),
                    start,
                    expression: format!("m->p.{}.{}{at}", term.member, key.name),
                    fixed: false,
                });
            };
            match Source::<f64>::get(term.term, key) {
                Some(Value::Number(x)) => add(None, x),
                Some(Value::List(list)) => list.iter().enumerate().for_each(|(k, x)| add(Some(k), *x)),
                _ => {}
            }
        }
    }
    all
}

/// The unit's identity: it changes with the model and with what can be set.
fn guid(origin: &Origin, inputs: &[Variable]) -> String {
    use sha2::Digest;
    let mut hash = sha2::Sha256::new();
    hash.update(&origin.sha256);
    inputs.iter().for_each(|input| hash.update(&input.name));
    hash.update(env!("CARGO_PKG_VERSION"));
    let digits = hex::encode(&hash.finalize()[..16]);
    format!("{{{}-{}-{}-{}-{}}}", &digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..])
}

/// The C of the unit.
fn wrapper(plan: &Plan, origin: &Origin, exported: &Exported, tables: &Tables, guid: &str) -> String {
    let Tables { inputs, settings, terms } = *tables;
    let fields = |variables: &[Variable]| -> String {
        variables.iter().map(|v| format!("    double {}; /* {}, {} */\n", v.name, v.words, v.unit)).collect()
    };
    let case = |reference: u32, expression: &str| {
        format!("    case {reference}u:\n        at = &{expression};\n        break;\n")
    };
    let mut output_cases = String::new();
    for (number, name) in OUTPUTS.iter().map(|(name, ..)| name).enumerate() {
        let reference = FIRST_OUTPUT + number as u32;
        let _ = write!(
            output_cases,
            "            case {reference}u:\n                at = &me->now.output.{name};\n                break;\n"
        );
    }
    let field_of = |field: &'static str| match field {
        "deflection_rad" if inputs.iter().all(|input| input.name != "deflection_rad") => {
            "((m->input.theta_in_rad / m->setting.ratio) - m->input.theta_out_rad) - m->setting.deflection_zero_rad"
                .to_owned()
        }
        "deflection_rad" => "m->input.deflection_rad - m->setting.deflection_zero_rad".to_owned(),
        "period_s" => "period".to_owned(),
        "time_s" => "m->time".to_owned(),
        other => format!("m->input.{}", input_name(other)),
    };
    let samples: String =
        exported.sample.iter().map(|field| format!("    sample.{field} = {};\n", field_of(field))).collect();
    let moves: String = inputs
        .iter()
        .map(|v| format!("    me->now.input.{0} = me->now.input.{0} + (step * me->now.derivative.{0});\n", v.name))
        .collect();
    let starts: String = inputs
        .iter()
        .filter(|v| v.start != 0.0)
        .map(|v| format!("    m->input.{} = {:?};\n", v.name, v.start))
        .collect();
    let parameter_cases: String = settings.iter().chain(terms).map(|v| case(v.reference, &v.expression)).collect();
    let input_cases: String = inputs.iter().map(|v| case(v.reference, &format!("inputs->{}", v.expression))).collect();
    let start_values: Vec<String> = settings.iter().map(|v| format!("{:?}", v.start)).collect();
    let slots = [
        ("input_fields", fields(inputs)),
        ("setting_fields", fields(settings)),
        ("settings", start_values.join(", ")),
        ("derive", derive(plan)),
        ("input_cases", input_cases),
        ("parameter_cases", parameter_cases),
        ("output_cases", output_cases),
        ("sample_values", samples),
        ("input_starts", starts),
        ("move_inputs", moves),
        ("status", format!("{STATUS}u")),
        ("first_term", format!("{FIRST_TERM}u")),
    ];
    let slots: Vec<(&str, &str)> = slots.iter().map(|(slot, text)| (*slot, text.as_str())).collect();
    let text = finish(&fill(TEMPLATE, &slots), &plan.prefix, Precision::F64);
    // Names come last: what they hold is no template.
    let names = [
        ("guid", guid.to_owned()),
        ("file_stem", plan.prefix.clone()),
        ("title", format!("{}:", comment(if plan.model.name.is_empty() { &plan.prefix } else { &plan.model.name }))),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("file", comment(&origin.file)),
        ("hash", comment(&origin.sha256)),
    ];
    let names: Vec<(&str, &str)> = names.iter().map(|(slot, text)| (*slot, text.as_str())).collect();
    fill(&text, &names)
}

/// How the numbers of law and terms follow from the settings.
fn derive(plan: &Plan) -> String {
    let text = match plan.law {
        Law::Masing => include_str!("../../templates/export/laws/masing_derive.c"),
        Law::Phase => include_str!("../../templates/export/laws/phase_derive.c"),
        Law::Time => include_str!("../../templates/export/laws/time_derive.c"),
    };
    let (quadrature, in_phase) = match plan.params.memory().kernel {
        Kernel::Deflection => ("h", "-e"),
        Kernel::Rate => ("omega * e", "omega * h"),
    };
    let follows_c1 = plan.terms.iter().any(|term| term.source.call.contains("p->c1"));
    let c1 = if follows_c1 { "    p->c1 = s->c1_nm_per_rad;\n" } else { "" };
    fill(text, &[("quadrature", quadrature), ("in_phase", in_phase)]) + c1
}

/// Outputs: fields in C, names, units, words.
pub(super) const OUTPUTS: [(&str, &str, &str, &str); 5] = [
    ("torque_nm", "torque_nm", "N.m", "T = f + z + terms"),
    ("elastic_nm", "elastic_nm", "N.m", "elastic torque f"),
    ("hysteresis_nm", "hysteresis_nm", "N.m", "hysteresis torque z"),
    ("terms_nm", "terms_nm", "N.m", "torque of the terms"),
    ("deflection_rad", "gear_deflection_rad", "rad", "deflection of the gear, kinematic error and backlash taken out"),
];
