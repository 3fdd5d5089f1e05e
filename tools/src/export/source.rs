//! Header and source of a model.

use std::fmt::Write;

use gmhm::Law;

use super::numbers::{literal, numbers};
use super::plan::{Plan, Precision};
use super::template::{comment, fill, finish, helpers, mentions};
use super::{ExportError, ExportOptions, Exported, Origin, self_test, terms};
use crate::model::Model;
use crate::recording::TorqueUnit;

const HEADER: &str = include_str!("../../templates/export/gear.h");
const SOURCE: &str = include_str!("../../templates/export/gear.c");
const BASE: &str = include_str!("../../templates/export/base.c");
const STEP: &str = include_str!("../../templates/export/step.c");
const TRANSMITTED: &str = include_str!("../../templates/export/transmitted.c");
const INVERSE: &str = include_str!("../../templates/export/inverse.c");
const INVERSE_HEADER: &str = include_str!("../../templates/export/inverse.h");

/// What a sample may hold, in order, with its words.
const SAMPLE: [(&str, &str); 11] = [
    ("deflection_rad", "q_m / N - q_o, encoder zeros subtracted"),
    ("motor_angle_rad", "q_m, may be reduced to one turn unless a term has orders that are no integers"),
    ("output_angle_rad", "q_o, the same"),
    ("deflection_rate_rad_per_s", "rate of the deflection"),
    ("velocity_rad_per_s", "v: rate of q_m / N where the torque is taken on the motor side, else of q_o"),
    ("acceleration_rad_per_s2", "rate of v"),
    ("temperature_c", "Theta"),
    ("time_s", "since the start of the recording or of the drive"),
    ("motor_velocity_rad_per_s", "rate of q_m"),
    ("output_velocity_rad_per_s", "rate of q_o"),
    ("period_s", "since the last sample"),
];

/// The texts of a law: its past, its step, a stretch of the inverse, the inverse.
struct LawTexts {
    past: &'static str,
    law: &'static str,
    stretch: [&'static str; 2],
    solve: &'static str,
}

impl LawTexts {
    fn of(law: Law) -> Self {
        macro_rules! text {
            ($file:literal) => {
                include_str!(concat!("../../templates/export/laws/", $file))
            };
        }
        let integral = text!("integral_stretch.c");
        match law {
            Law::Masing => Self {
                past: text!("masing.h"),
                law: text!("masing.c"),
                stretch: [text!("masing_stretch.c"), ""],
                solve: text!("masing_solve.c"),
            },
            Law::Phase => Self {
                past: text!("phase.h"),
                law: text!("phase.c"),
                stretch: [text!("phase_stretch.c"), integral],
                solve: text!("phase_solve.c"),
            },
            Law::Time => Self {
                past: text!("time.h"),
                law: text!("time.c"),
                stretch: [text!("time_stretch.c"), integral],
                solve: text!("time_solve.c"),
            },
        }
    }
}

/// The files of a model in C.
///
/// # Errors
/// [`ExportError`]: what the model lacks, what the core refuses, a term without a source.
pub fn c(model: &Model, origin: &Origin, options: &ExportOptions) -> Result<Exported, ExportError> {
    let plan = Plan::new(model, options)?;
    let texts = LawTexts::of(plan.law);
    let body = body(&plan, &texts);
    let sample: Vec<(&str, &str)> = SAMPLE
        .into_iter()
        .filter(|(name, _)| *name == SAMPLE[0].0 || mentions(&body, &format!("sample->{name}")))
        .collect();
    let body = with_sample(&body, &sample);
    let body = format!("{}{body}", helpers(&body));
    let [turn_1, turn_2, turn_3] = match plan.precision {
        Precision::F32 => ["6.28125f", "0.0019350052f", "3.0199159e-7f"],
        Precision::F64 => ["6.28125", "1.9353071693331003e-3", "1.0253131677018246e-11"],
    };
    let body = fill(&body, &[("turn_1", turn_1), ("turn_2", turn_2), ("turn_3", turn_3)]);
    let about = about(&plan, origin);
    let about: Vec<(&str, &str)> = about.iter().map(|(slot, text)| (*slot, text.as_str())).collect();
    let header = header(&plan, &texts, &body, &sample);
    let source = fill(SOURCE, &[("constants", &constants(&plan, &body))]) + &body;
    let stem = plan.prefix.clone();
    // Names come last: what they hold is no template.
    let done = |text: &str| fill(&finish(text, &plan.prefix, plan.precision), &about);
    let mut files = vec![(format!("{stem}.h"), done(&header)), (format!("{stem}.c"), done(&source))];
    let names: Vec<&'static str> = sample.iter().map(|(name, _)| *name).collect();
    if options.self_test {
        files.push((format!("{stem}_self_test.c"), done(&self_test::text(&plan, &names)?)));
    }
    let Plan { prefix, without_inverse, left_out, .. } = plan;
    Ok(Exported { files, prefix, sample: names, without_inverse, left_out })
}

/// What the heads of the files say of the model.
fn about(plan: &Plan, origin: &Origin) -> [(&'static str, String); 6] {
    let name = if plan.model.name.is_empty() { &plan.prefix } else { &plan.model.name };
    [
        ("title", format!("{}: hysteresis torque of a harmonic drive and its inverse.", comment(name))),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("file", comment(&origin.file)),
        ("hash", comment(&origin.sha256)),
        ("file_stem", plan.prefix.clone()),
        ("law", plan.law.name().to_owned()),
    ]
}

/// Everything behind the constants but the helpers; what depends on the sample has its slots still.
fn body(plan: &Plan, texts: &LawTexts) -> String {
    let mut text = format!("{}\n{BASE}\n", texts.law);
    let functions = terms::functions(plan);
    if mentions(&functions, "transmitted") {
        text.push_str(TRANSMITTED);
    }
    text.push_str(&functions);
    text.push_str(&step(plan));
    if plan.without_inverse.is_none() {
        let [stretch, rest] = texts.stretch;
        text.push('\n');
        text.push_str(&fill(INVERSE, &[("stretch", &format!("{stretch}{rest}")), ("solve", texts.solve)]));
    }
    let is_time = plan.law == Law::Time;
    let at_time = |text: &'static str| if is_time { text } else { "" };
    let slots = [
        ("crossing_tolerance", "1e-13_r"),
        ("starts", ", starts"),
        ("period", at_time(", sample->period_s")),
        ("sample_period", at_time(", sample->period_s")),
        ("period_parameter", at_time(", real period")),
        ("period_value", at_time(", period")),
        ("period_argument", at_time(", real period")),
        ("period_check", at_time(" && (period >= 0.0_r) && (period <= p->longest_period)")),
    ];
    fill(&text, &slots)
}

/// The step with the terms of the model.
fn step(plan: &Plan) -> String {
    let (adds, corrects) = terms::has(plan);
    let mut corrected = String::new();
    let mut calls = ["sample->deflection_rad".to_owned(), "    theta = first->deflection_rad;\n".to_owned()];
    if corrects {
        let statements = terms::corrections(plan);
        let names = parameters(&statements, &["p", "state", "sample", "starts"], true);
        let _ = write!(
            corrected,
            "\n/* theta: what the terms of the deflection say is taken out of the measured one. */\nstatic real corrected({})\n{{\n    real theta = sample->deflection_rad;\n{statements}    return theta;\n}}\n",
            names.0
        );
        calls = [
            format!("corrected({})", names.1.replace("starts", "false")),
            format!(
                "    memory_start(p, &state->memory, 0.0_r);\n    theta = corrected({});\n",
                names.1.replace("sample", "first").replace("starts", "true")
            ),
        ];
    }
    let mut sum = String::new();
    let mut added = String::new();
    if adds {
        let statements = terms::sum(plan);
        let names = parameters(&statements, &["p", "state", "sample", "theta", "base_torque"], false);
        let _ = write!(
            sum,
            "\n/* The torque of the terms, N*m. */\nstatic real terms_torque({})\n{{\n{statements}    return sum;\n}}\n",
            names.0
        );
        let call = names.1.replace("theta", "state->memory.theta").replace("base_torque", "output.torque_nm");
        let _ = write!(
            added,
            "    output.terms_nm = terms_torque({call});\n    output.torque_nm = output.torque_nm + output.terms_nm;\n"
        );
    }
    let of_sample = mentions(&added, "sample");
    let with = |name: &str| if of_sample { format!("p, state, {name}") } else { "p, state".to_owned() };
    let finish_parameters = if of_sample {
        "const gear_parameters *p, gear_state *state, const gear_sample *sample"
    } else {
        "const gear_parameters *p, gear_state *state"
    };
    fill(
        STEP,
        &[
            ("corrected", &corrected),
            ("terms", &sum),
            ("finish_parameters", finish_parameters),
            ("add_terms", &added),
            ("finish_first", &with("first")),
            ("finish_sample", &with("sample")),
            ("start_pasts", &terms::start_pasts(plan)),
            ("start_corrected", &calls[1]),
            ("theta", &calls[0]),
        ],
    )
}

/// Parameters and arguments of a function of these statements: those of some names that they mention.
fn parameters(statements: &str, names: &[&'static str], of_sample: bool) -> (String, String) {
    let declared = |name: &str| match name {
        "p" => "const gear_parameters *p".to_owned(),
        "state" => "gear_state *state".to_owned(),
        "sample" => "const gear_sample *sample".to_owned(),
        "starts" => "bool starts".to_owned(),
        other => format!("real {other}"),
    };
    let used = |name: &&&str| {
        mentions(statements, name)
            || (of_sample && **name == "sample")
            || (**name == "starts" && statements.contains("@starts@"))
    };
    let used: Vec<&str> = names.iter().filter(used).copied().collect();
    (used.iter().map(|name| declared(name)).collect::<Vec<_>>().join(", "), used.join(", "))
}

/// Fills what depends on the signals of the sample.
fn with_sample(body: &str, sample: &[(&str, &str)]) -> String {
    let mut finite = String::new();
    for (name, _) in &sample[1..] {
        if *name == "period_s" {
            finite.push_str("\n        && (sample->period_s >= 0.0_r) && (sample->period_s <= 1e9_r)");
        } else {
            let _ = write!(finite, "\n        && (isfinite(sample->{name}) != 0)");
        }
    }
    fill(body, &[("finite", &finite), ("at_rest", &vec!["0.0_r"; sample.len()].join(", "))])
}

fn constants(plan: &Plan, body: &str) -> String {
    let mut text = String::from("const gear_parameters gear_gear = {\n");
    for number in numbers(plan).iter().filter(|number| mentions(body, &format!("p->{}", number.name))) {
        let _ = writeln!(text, "    .{} = {}, /* {} */", number.name, number.value, number.words);
    }
    text.push_str(&terms::values(plan));
    text.push_str("};\n");
    text
}

fn header(plan: &Plan, texts: &LawTexts, body: &str, sample: &[(&str, &str)]) -> String {
    let mut fields = String::new();
    for (name, words) in sample {
        let _ = writeln!(fields, "    real {name}; /* {words} */");
    }
    let mut members = String::new();
    for number in numbers(plan).iter().filter(|number| mentions(body, &format!("p->{}", number.name))) {
        let kind = if number.is_count { "uint32_t" } else { "real" };
        let _ = writeln!(members, "    {kind} {}; /* {} */", number.name, number.words);
    }
    members.push_str(&terms::members(plan));
    let invertible = plan.without_inverse.is_none();
    let solution = "/* The deflection for a torque. */\ntypedef struct gear_solution {\n    real deflection_rad;\n    uint32_t flags;\n} gear_solution;\n\n";
    let is_time = plan.law == Law::Time;
    let period = if is_time { ", real period" } else { "" };
    let accuracy = match plan.precision {
        Precision::F32 => "3e-6",
        Precision::F64 => "1e-14",
    };
    let inverse = fill(INVERSE_HEADER, &[("accuracy", accuracy), ("period_argument", period)]);
    let usage = " *     gear_solution aim = gear_invert(&gear_gear, &joint, torque_reference);\n";
    let usage_at = usage.replace("reference)", if is_time { "reference, period)" } else { "reference)" });
    let scalar = match plan.precision {
        Precision::F32 => "single precision (float)",
        Precision::F64 => "double precision (double)",
    };
    fill(
        HEADER,
        &[
            ("scalar", scalar),
            ("notes", &notes(plan)),
            ("usage", if invertible { &usage_at } else { "" }),
            ("defines", &defines(plan)),
            ("sample", &fields),
            ("solution", if invertible { solution } else { "" }),
            ("term_types", &terms::types(plan)),
            ("parameters_words", "Deflections are over A and torques over T_A where no unit is given."),
            ("parameters", &members),
            ("law_types", texts.past),
            ("pasts", &terms::pasts(plan)),
            ("invert", if invertible { &inverse } else { "" }),
        ],
    )
}

/// The parameters in SI units, and what is left out, as lines of a comment.
fn notes(plan: &Plan) -> String {
    let (params, memory, elastic) = (&plan.params, plan.params.memory(), plan.params.elastic());
    let unit = if plan.model.torque_unit == TorqueUnit::Ampere { "A" } else { "N*m" };
    let mut lines = vec![
        String::new(),
        format!("A = {:?} rad, T_A = {:?} {unit}", params.rated_deflection_rad(), params.torque_scale_nm()),
        format!(
            "c1 = {:?} {unit}/rad, c2 = {:?} {unit}/rad^3, c3 = {:?} {unit}/rad^5",
            elastic.c1_nm_per_rad, elastic.c2_nm_per_rad3, elastic.c3_nm_per_rad5
        ),
        format!(
            "alpha = {:?}, beta = {:?} /s, omega = {:?} /s, kernel {}, gate {}",
            memory.alpha,
            memory.beta_per_s,
            memory.omega_per_s,
            memory.kernel.name(),
            memory.gate.name()
        ),
    ];
    if memory.reversal_play_rad > 0.0 {
        lines.push(format!("input play before the reversals: {:?} rad", memory.reversal_play_rad));
    }
    if plan.model.torque_unit == TorqueUnit::Ampere {
        lines.push("Torques are counted in amperes of motor current: read A for N*m and _a for _nm.".to_owned());
    }
    for kind in &plan.left_out {
        lines.push(format!("Left out: {kind}, a measurement fault."));
    }
    if let Some(why) = &plan.without_inverse {
        lines.push(format!("Without inverse: {}", comment(why)));
    }
    lines.push(String::new());
    lines.iter().map(|line| if line.is_empty() { " *\n".to_owned() } else { format!(" * {line}\n") }).collect()
}

fn defines(plan: &Plan) -> String {
    let mut text = String::new();
    if let Some(ratio) = plan.model.gear.ratio {
        let _ = writeln!(
            text,
            "#define GEAR_RATIO ({}) /* N, motor turns per output turn; negative where the gear reverses */",
            literal(ratio, plan.precision)
        );
    }
    let zero = plan.model.gear.deflection_zero_rad;
    let _ = writeln!(
        text,
        "#define GEAR_DEFLECTION_ZERO_RAD ({}) /* what the encoders show at no deflection: the caller subtracts it */",
        literal(zero, plan.precision)
    );
    if plan.law == Law::Masing {
        let _ = writeln!(text, "#define GEAR_TURNING_POINTS {}u /* that a joint remembers */", plan.turning_points);
    }
    if plan.law == Law::Time && plan.without_inverse.is_none() {
        let _ = writeln!(
            text,
            "#define GEAR_LONGEST_PERIOD_S ({}) /* of gear_invert, s */",
            literal(plan.period_s, plan.precision)
        );
    }
    text
}
