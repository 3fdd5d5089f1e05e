//! `gmhm export --to c`: compiled, run and compared with the core.

use crate::common::{PUBLISHED, WorkDir};
use crate::exported::{
    Answer, Bytes, COMPILERS, Chance, compile, drive, export, export_as, is_there, model, path, run,
};
use gmhm::terms::{Form, KINDS, KindInfo, Sample, Side};
use gmhm_tools::export::self_test::{Readable, Reference, set_field};
use gmhm_tools::export::{ExportOptions, Precision};
use gmhm_tools::model::Model;
use std::fmt::Write;
use std::process::Command;

const REFUSED: u32 = 2;
const OUT_OF_RANGE: u32 = 4;
const SATURATED: u32 = 8;

/// Sample period of law `time`, s.
const PERIOD_S: f64 = 1e-3;

/// Laws, kernels and gates beside `masing`.
const LAWS: [[&str; 3]; 8] = [
    ["phase", "deflection", "cycle"],
    ["phase", "deflection", "none"],
    ["phase", "rate", "cycle"],
    ["phase", "rate", "none"],
    ["time", "deflection", "cycle"],
    ["time", "deflection", "none"],
    ["time", "rate", "cycle"],
    ["time", "rate", "none"],
];

/// The published gear in a law; kernel rate with an α of its own unit.
fn in_law([law, kernel, gate]: [&str; 3]) -> String {
    let alpha = if kernel == "rate" { "4.0e3" } else { "1.2e6" };
    let text = PUBLISHED.replace("2.6532e6", alpha);
    format!("{text}law = \"{law}\"\nkernel = \"{kernel}\"\ngate = \"{gate}\"\n")
}

fn options(precision: Precision) -> ExportOptions {
    ExportOptions { precision, period_s: Some(PERIOD_S), self_test: true, ..ExportOptions::default() }
}

/// A term of a kind with a value for every key; `choice` numbers the words of its choices.
fn term(info: &KindInfo, choice: usize) -> String {
    let mut text = format!("[[term]]\nkind = \"{}\"\n", info.name);
    let chosen = |key: &gmhm::terms::KeyInfo| match key.form {
        Form::Choice(words) => words.get(choice).copied().unwrap_or(words[0]),
        _ => "",
    };
    let shape = info.key("shape").map(chosen);
    for (number, key) in info.keys.iter().enumerate().filter(|(_, key)| key.belongs_to(shape)) {
        let (low, high) = key.plausible;
        let at = |share: f64| low + (high - low) * share;
        let share = 0.3 + 0.06 * number as f64;
        let _ = match key.form {
            Form::Choice(_) => writeln!(text, "{} = \"{}\"", key.name, chosen(key)),
            Form::Number => writeln!(text, "{} = {:?}", key.name, at(share)),
            Form::List { .. } if key.name == "orders" => writeln!(text, "{} = [2.0, 3.5]", key.name),
            Form::List { .. } => writeln!(text, "{} = [{:?}, {:?}]", key.name, at(share), at(0.1)),
        };
    }
    text
}

/// How many words the longest choice of a kind has.
fn choices(info: &KindInfo) -> usize {
    let choices = info.keys.iter().map(|key| if let Form::Choice(words) = key.form { words.len() } else { 1 });
    choices.max().unwrap_or(1)
}

/// Every kind of the plant, in each of its shapes.
fn plant_terms() -> Vec<(String, String)> {
    let mut terms = Vec::new();
    for info in KINDS.iter().filter(|info| info.side == Side::Plant) {
        for choice in 0..choices(info) {
            terms.push((format!("{} {choice}", info.name), term(info, choice)));
        }
    }
    terms
}

/// The rows of a joint that moves along a path: the fields that the export asks for, and a torque for the inverse.
fn rows<S: Bytes + gmhm::scalar::Float>(
    model: &Model,
    fields: &[&str],
    us: &[f64],
    chance: &mut Chance,
) -> Vec<Vec<S>> {
    let rated = model.gear.rated_deflection_rad.unwrap();
    let scale = model.params(rated).unwrap().unwrap().torque_scale_nm();
    let row = |(k, u): (usize, &f64)| {
        let t = k as f64 * PERIOD_S;
        let (wave, slow) = ((0.7 * t).sin(), (0.05 * t).sin());
        let value = |name: &&str| match *name {
            "deflection_rad" => u * rated,
            "motor_angle_rad" => 40.0 * wave,
            "output_angle_rad" => 0.4 * wave,
            "deflection_rate_rad_per_s" => 0.1 * wave,
            "velocity_rad_per_s" | "output_velocity_rad_per_s" => 0.28 * (0.7 * t).cos(),
            "motor_velocity_rad_per_s" => 28.0 * (0.7 * t).cos(),
            "acceleration_rad_per_s2" => -0.2 * wave,
            "temperature_c" => 25.0 + 10.0 * slow,
            "time_s" => 30.0 * t,
            "period_s" => PERIOD_S,
            other => panic!("{other}"),
        };
        let mut row: Vec<S> = fields.iter().map(|name| S::from_f64(value(name))).collect();
        row.push(S::from_f64(1.2 * scale * chance.next()));
        row
    };
    us.iter().enumerate().map(row).collect()
}

/// The core over the same rows: torque with terms, base, flags, solution.
fn core<S: Readable, const N: usize>(
    model: &Model,
    options: &ExportOptions,
    fields: &[&'static str],
    rows: &[Vec<S>],
) -> Vec<Answer<S>> {
    let mut reference = Reference::<S, N>::new(model, options).unwrap();
    let is_time = model.memory.unwrap().law == gmhm::Law::Time;
    let answer = |row: &Vec<S>| {
        let mut sample = Sample::default();
        fields.iter().zip(row).for_each(|(name, value)| set_field(&mut sample, name, *value));
        let total = reference.step(&sample);
        let status = reference.gear().unwrap().status();
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        let period = if is_time { sample.period } else { S::ZERO };
        let solution = reference.invert(row[fields.len()], period);
        Answer {
            torque: total.torque,
            elastic: total.base.elastic,
            hysteresis: total.base.hysteresis,
            flags: flag(total.refused, REFUSED) | flag(status.out_of_range, OUT_OF_RANGE),
            solution: solution.map(|(theta, saturated)| (theta, flag(saturated, SATURATED))),
        }
    };
    rows.iter().map(answer).collect()
}

/// The largest difference of torques and of solutions, over the largest torque and A.
fn largest_difference<S: Bytes + gmhm::scalar::Float>(model: &Model, c: &[Answer<S>], core: &[Answer<S>]) -> [f64; 2] {
    let rated = model.gear.rated_deflection_rad.unwrap();
    let scale = model.params(rated).unwrap().unwrap().torque_scale_nm();
    let largest = core.iter().fold(scale, |most, answer| most.max(answer.torque.to_f64().abs()));
    c.iter().zip(core).fold([0.0, 0.0], |[torque, deflection], (c, core)| {
        let of_torque = (c.torque - core.torque).to_f64().abs() / largest;
        let of_deflection = match (c.solution, core.solution) {
            (Some((c, _)), Some((core, _))) => (c - core).to_f64().abs() / rated,
            (None, None) => 0.0,
            _ => f64::INFINITY,
        };
        // A NaN must not pass.
        let more = |most: f64, now: f64| if now <= most { most } else { now };
        [more(torque, of_torque), more(deflection, of_deflection)]
    })
}

/// Exports a model and compares it with the core along a path within ±`most` rated deflections.
fn compare<S: Readable + Bytes>(text: &str, precision: Precision, most: f64, count: usize) -> [f64; 2] {
    let (dir, model, options) = (WorkDir::new(), model(text), options(precision));
    let exported = export(&dir.path(""), &model, &options);
    let mut chance = Chance(7);
    let us = path(&mut chance, most, count);
    let rows = rows::<S>(&model, &exported.sample, &us, &mut chance);
    let c = drive(&dir.path(""), &exported, &rows);
    let core = core::<S, 16>(&model, &options, &exported.sample, &rows);
    for (k, (c, core)) in c.iter().zip(&core).enumerate() {
        assert_eq!(c.flags, core.flags, "row {k}\n{text}");
    }
    largest_difference(&model, &c, &core)
}

#[test]
fn law_masing_gives_the_bits_of_the_core() {
    const ROWS: usize = 1_000_000;
    if !is_there("cc") {
        return;
    }
    let mut chance = Chance(1);
    for number in 0..20 {
        let rated = 10_f64.powf(chance.between(-3.6, -2.6));
        let torque = chance.between(5.0, 300.0);
        let mut share = |low, high| chance.between(low, high) * torque / rated;
        let (c1, c3, c5, h, e) =
            (share(0.8, 1.2), share(-0.1, 0.3), share(-0.1, 0.1), share(0.0, 0.15), share(0.0, 0.3));
        let square = rated * rated;
        let speed = 300.0 * (e * e + h * h).sqrt() / (e * e + h * h);
        let play = if number % 3 == 2 { 0.01 * rated } else { 0.0 };
        let text = format!(
            "format = 1\nname = \"m\"\n[gear]\nrated_deflection_rad = {rated:?}\n[elastic]\nc1_nm_per_rad = {c1:?}\nc2_nm_per_rad3 = {:?}\nc3_nm_per_rad5 = {:?}\n[memory]\nalpha = 300.0\nbeta_per_s = {:?}\nomega_per_s = {:?}\nreversal_play_rad = {play:?}\n",
            c3 / square,
            c5 / (square * square),
            e * speed / (e * e + h * h).sqrt(),
            h * speed / (e * e + h * h).sqrt(),
        );
        let model = model(&text);
        let few = number % 4 == 1;
        let options = ExportOptions { turning_points: if few { 4 } else { 16 }, ..ExportOptions::default() };
        let dir = WorkDir::new();
        let exported = export(&dir.path(""), &model, &options);
        let mut us = path(&mut chance, 1.1, ROWS);
        // What no encoder should say.
        for (row, wrong) in [(0, 1.05), (1000, f64::NAN), (2000, f64::INFINITY), (3000, 1e7), (4000, 2.0), (5000, -3.0)]
        {
            us[row + number] = wrong;
        }
        let rows = rows::<f32>(&model, &exported.sample, &us, &mut chance);
        let c = drive(&dir.path(""), &exported, &rows);
        let core = match few {
            true => core::<f32, 4>(&model, &options, &exported.sample, &rows),
            false => core::<f32, 16>(&model, &options, &exported.sample, &rows),
        };
        for (k, (c, core)) in c.iter().zip(&core).enumerate() {
            let bits = |answer: &Answer<f32>| {
                let torques = [answer.torque, answer.elastic, answer.hysteresis].map(f32::to_bits);
                (torques, answer.flags, answer.solution.map(|(theta, flags)| (theta.to_bits(), flags & SATURATED)))
            };
            assert_eq!(bits(c), bits(core), "model {number}, row {k}: {c:?} {core:?}\n{text}");
        }
    }
}

#[test]
fn other_laws_are_within_their_errors() {
    if !is_there("cc") {
        return;
    }
    // A memory that forgets little a sample takes another way through law `time`.
    let slowly = LAWS.map(|law| (law, in_law(law).replace("422.68", "42.268")));
    for (law, text) in LAWS.map(|law| (law, in_law(law))).into_iter().chain(slowly) {
        let [torque, deflection] = compare::<f32>(&text, Precision::F32, 0.999, 200_000);
        assert!(torque <= 4e-6 && deflection <= 2e-5, "{law:?}: {torque:e}, {deflection:e}");
        let [torque, deflection] = compare::<f64>(&text, Precision::F64, 0.999, 200_000);
        assert!(torque <= 1e-12 && deflection <= 1e-11, "{law:?} f64: {torque:e}, {deflection:e}");
        // At the tips the gate magnifies what is rounded.
        let [torque, _] = compare::<f32>(&text, Precision::F32, 1.2, 200_000);
        assert!(torque <= 1e-4, "{law:?} at the tips: {torque:e}");
    }
}

#[test]
fn every_kind_of_the_plant_is_within_its_errors() {
    if !is_there("cc") {
        return;
    }
    for (name, term) in plant_terms() {
        // Friction shows what scales it.
        let friction = term_of("coulomb_friction");
        let text = format!("{PUBLISHED}{term}{friction}");
        let [torque, _] = compare::<f32>(&text, Precision::F32, 0.9, 50_000);
        assert!(torque <= 4e-6, "{name}: {torque:e}");
        let [torque, _] = compare::<f64>(&text, Precision::F64, 0.9, 50_000);
        assert!(torque <= 1e-10, "{name} f64: {torque:e}");
    }
    let all: String = plant_terms().into_iter().step_by(2).map(|(_, term)| term).collect();
    for law in [["masing", "deflection", "cycle"], LAWS[0], LAWS[4]] {
        let [torque, _] = compare::<f64>(&format!("{}{all}", in_law(law)), Precision::F64, 0.9, 20_000);
        assert!(torque <= 1e-10, "all terms, {law:?}: {torque:e}");
    }
}

fn term_of(kind: &str) -> String {
    term(gmhm::terms::kind(kind).unwrap(), 0)
}

#[test]
fn every_export_compiles_without_warnings_and_passes_its_own_test() {
    // Each kind in each shape, each law, and each law with every kind: what is left unused differs among them.
    let every_kind = |shape: usize| -> String {
        let plant = KINDS.iter().filter(|info| info.side == Side::Plant);
        plant.map(|info| term(info, shape % choices(info))).collect()
    };
    let laws = LAWS.map(in_law).into_iter().chain([PUBLISHED.to_owned()]).enumerate();
    let laws = laws.flat_map(|(number, law)| [format!("{law}{}", every_kind(number)), law]);
    let terms = plant_terms().into_iter().map(|(_, term)| format!("{PUBLISHED}{term}"));
    let dir = WorkDir::new();
    let mut texts = Vec::new();
    for (number, text) in laws.chain(terms).enumerate() {
        for (precision, scalar) in [(Precision::F32, "f32"), (Precision::F64, "f64")] {
            let prefix = format!("m{number}_{scalar}");
            export_as(&prefix, &dir.path(""), &model(&text), &options(precision));
            texts.push((prefix, text.clone()));
        }
    }
    let compilers: Vec<_> = COMPILERS.into_iter().filter(|(compiler, _)| is_there(compiler)).collect();
    std::thread::scope(|scope| {
        for (compiler, options) in &compilers {
            scope.spawn(|| compile(&dir.path(""), compiler, options));
        }
    });
    let Some((compiler, _)) = compilers.iter().find(|(compiler, _)| ["gcc", "clang"].contains(compiler)) else {
        return;
    };
    for (prefix, text) in texts {
        let objects = ["", "_self_test"].map(|part| format!("{prefix}{part}.o"));
        let folder = dir.path(compiler);
        run(Command::new(compiler).current_dir(&folder).args(objects).args(["-lm", "-o", "self_test"]));
        let said = run(&mut Command::new(folder.join("self_test")));
        assert!(said.contains("240 samples, 0 wrong"), "{prefix}: {said}\n{text}");
    }
}

#[test]
fn double_precision_agrees_with_predict() {
    if !is_there("cc") {
        return;
    }
    let terms = format!("{}{}{}", term_of("soft_windup"), term_of("creep"), term_of("thermal_stiffness"));
    for law in [["masing", "deflection", "cycle"], LAWS[0], LAWS[6]] {
        let (dir, text) = (WorkDir::new(), format!("{}{terms}", in_law(law)));
        let (model, mut chance) = (model(&text), Chance(3));
        let options = ExportOptions { turning_points: 256, ..options(Precision::F64) };
        let exported = export(&dir.path(""), &model, &options);
        let us = path(&mut chance, 0.999, 5000);
        let mut rows = rows::<f64>(&model, &exported.sample, &us, &mut chance);
        let mut csv = String::from("time_s,deflection_rad,temperature_c\n");
        let place = |name: &str| exported.sample.iter().position(|field| *field == name).unwrap();
        let (theta, temperature, period) = (place("deflection_rad"), place("temperature_c"), place("period_s"));
        let mut time = 0.0;
        for (k, row) in rows.iter_mut().enumerate() {
            let next = (k + 1) as f64 * PERIOD_S;
            row[period] = if k == 0 { 0.0 } else { next - time };
            time = next;
            let _ = writeln!(csv, "{time:?},{:?},{:?}", row[theta], row[temperature]);
        }
        dir.write("m.toml", &text).write("rec.csv", csv);
        dir.succeed("predict m.toml rec.csv -o predicted.csv");
        let expected = dir.column("predicted.csv", "torque_model_nm");
        let scale = model.params(1.168e-3).unwrap().unwrap().torque_scale_nm();
        for (k, (c, expected)) in drive(&dir.path(""), &exported, &rows).iter().zip(&expected).enumerate() {
            let difference = (c.torque - expected).abs() / scale;
            assert!(difference <= 1e-9, "{law:?}, row {k}: {difference:e}");
        }
    }
}

#[test]
fn the_model_of_the_static_checks_has_every_kind_of_the_plant() {
    let text = include_str!("exported/every_term.toml");
    let terms = model(text).terms;
    for info in KINDS.iter().filter(|info| info.side == Side::Plant) {
        assert!(terms.iter().any(|term| term.kind == info.name), "{}", info.name);
    }
}

#[test]
fn the_command_writes_readable_files_or_says_why_not() {
    let dir = WorkDir::new();
    dir.write(
        "m.toml",
        format!("{PUBLISHED}{}[[term]]\nkind = \"sensor_drift\"\nnm_per_s = 0.001\n", term_of("creep")),
    );
    let done = dir.succeed("export m.toml --to c -o source --self-test --prefix j3");
    assert!(done.stderr.contains("`sensor_drift` is a measurement fault"), "{}", done.stderr);
    let header = dir.read("source/j3.h");
    for part in [
        "j3_step(",
        "j3_invert(",
        "J3_RATIO (100.0f)",
        "c1 = 24737.0 N*m/rad",
        "m.toml, SHA-256",
        "Left out: sensor_drift",
        "real tau_s",
    ] {
        let part = part.replace("real", "float");
        assert!(header.contains(&part), "{part}\n{header}");
    }
    let source = dir.read("source/j3.c");
    assert!(header.is_ascii() && source.is_ascii());
    for left in ["@", "gear_", "GEAR_", "_r(", "real "] {
        assert!(!header.contains(left) && !source.contains(left), "{left}\n{header}\n{source}");
    }
    dir.succeed("export m.toml --to c -o source");
    assert!(dir.read("source/published.c").contains("published_step("));
    // A name that looks like a part of the templates.
    dir.write("named.toml", PUBLISHED.replace("published", "gear real @law@"));
    dir.succeed("export named.toml --to c -o source");
    assert!(dir.read("source/gear_real_law.c").contains("\n * gear real (at)law(at): "));
    if is_there("cc") {
        run(Command::new("cc").current_dir(dir.path("source")).args(["-std=c99", "-c", "gear_real_law.c"]));
    }

    dir.write(
        "log.toml",
        "format = 1\nname = \"log\"\n[gear]\n[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 2.0\n",
    );
    dir.refuse("export log.toml --to c -o source", &["no [elastic] and [memory]", "help: "]);
    dir.write("time.toml", in_law(LAWS[4]));
    dir.refuse("export time.toml --to c -o source", &["longest sample period", "--period SECONDS"]);
    dir.refuse(
        "export m.toml --to c -o source --prefix 3j",
        &["`3j` is not a valid name in C", "beginning with a letter"],
    );
    dir.misuse("export m.toml --to c -o source --stack-depth 5", &["even number"]);

    // `cargo xtask export` runs FMUs.
    dir.succeed("export m.toml --to fmu -o m.fmu");
    let fmu = std::fs::read(dir.path("m.fmu")).unwrap();
    let holds = |name: &str| fmu.windows(name.len()).any(|bytes| bytes == name.as_bytes());
    assert!(fmu.starts_with(b"PK\x03\x04") && holds("modelDescription.xml") && holds("sources/published_fmu.c"));
    dir.write("plain.toml", PUBLISHED.replace("ratio = 100.0\n", ""));
    dir.refuse("export plain.toml --to fmu --angles -o m.fmu", &["no ratio in [gear]", "help: "]);
}
