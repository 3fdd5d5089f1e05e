//! The C program beside this file, compiled by the host's C compiler against the header and the static library: its outputs are Rust's to the bit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::Small;
use gmhm::block::{Header, Identity, Joint, Parameters, Prepared, ScalarKind, Writer, verify};
use gmhm::feedforward::{Controls, Demand, Limits};
use gmhm::link::{Answer, Origin, Receiver, Request, Tag};
use gmhm::memory::AnyLaw;
use gmhm::terms::feedforward::CompensatedFeedForward;
use gmhm::terms::{KINDS, Sample, Side, kind};
use gmhm::{Elastic, Gear, Inverse, Memory, Params, Solution};
use gmhm_c::{
    FEED_FORWARD_WORDS, FLASH, GEAR_WORDS, JOINT_WORDS, LAW_WORDS, LINK_WORDS, NO_BLOCK, NO_INVERSE, NO_SPACE,
    NOT_NEWER, NULL, PAIR_WORDS, PERIOD, PLACE, PLACES, READ_BACK, STORE_WORDS, StatusC, TERM_WORDS, UNIT, UNREADABLE,
    VALUE, flag,
};

const PERIOD_S: f64 = 1e-3;
const HEADER: &str = include_str!("../include/gmhm.h");

fn params(scale: f64) -> Params {
    let elastic = Elastic { c1_nm_per_rad: scale * 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
    Params::new(1.168e-3, elastic, memory).expect("the published gear")
}

fn block(params: &Params, terms: &[&str]) -> Vec<u8> {
    let mut buffer = vec![0; 4096];
    let header = Header { period_s: PERIOD_S as f32, ..Header::new(Identity::of_name("joint 3"), ScalarKind::F32) };
    let mut writer = Writer::new(&mut buffer, header);
    writer.gear(&Gear::<f32>::with_period(params, PERIOD_S).expect("a period"), params).expect("a gear");
    writer.inverse::<f32>(params, PERIOD_S).expect("an inverse");
    let inverse = Inverse::<f32>::with_period(params, PERIOD_S).expect("an inverse");
    writer.self_test(inverse.gear(), Some(&inverse)).expect("room");
    writer.prepared(&inverse).expect("room");
    writer.joint(&Joint { ratio: Some(100.0), ..Joint::default() }).expect("a joint");
    for term in terms {
        writer.term(term, &Small).expect("a term");
    }
    let length = writer.finish().expect("a block");
    buffer.truncate(length);
    buffer
}

/// The static library, as a firmware's own build makes it.
fn library(folder: &Path) -> PathBuf {
    let test = std::env::current_exe().expect("this test has a path");
    let target = test.ancestors().nth(3).expect("target/PROFILE/deps/TEST");
    run(Command::new(env!("CARGO"))
        .args(["rustc", "--quiet", "--locked", "--package", "gmhm-c", "--crate-type", "staticlib", "--target-dir"])
        .arg(target)
        .current_dir(env!("CARGO_MANIFEST_DIR")));
    let copy = folder.join("libgmhm_c.a");
    std::fs::copy(target.join("debug/libgmhm_c.a"), &copy).expect("cargo built it");
    copy
}

/// Runs a command that must succeed: its output.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn compile(folder: &Path) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let library = library(folder);
    let program = folder.join("program");
    let warnings = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-O1"];
    run(Command::new("cc")
        .args(warnings)
        .arg("-I")
        .arg(here.join("include"))
        .arg(here.join("tests/program.c"))
        .arg(&library)
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program));
    program
}

fn expected(block: &[u8]) -> Vec<String> {
    let parameters = Parameters::<f32>::load_any(block, 16).expect("a good block");
    let compensated = parameters.compensated().expect("a gear");
    let (gear, inverse) = (&compensated.gear, parameters.inverse.expect("an inverse"));
    let mut lines = Vec::new();
    let limits = Limits {
        period_s: PERIOD_S as f32,
        ramp_s: 0.125,
        offset_slew_rad_per_s: 0.5,
        torque_slew_nm_per_s: 400.0,
        largest_rate_rad_per_s: f32::INFINITY,
    };
    let verified = verify(block).expect("a good block");
    let prepared = Prepared::<f32, AnyLaw<f32>>::of_block(&verified, 16).expect("a prepared block");
    let terms = prepared.terms::<8>(&verified).expect("terms").plant(&verified);
    let feed = CompensatedFeedForward::new(prepared.feed_forward(&limits).expect("limits"), &terms);
    let controls = Controls { on: true, ..Controls::default() };
    let mut fed = None;
    let mut base = gear.start::<16>(0.0);
    let mut whole = None;
    for k in 0..2000_u32 {
        let (phase, size) = (k % 256, 1 + k / 256 % 5);
        let triangle = (if phase < 128 { phase } else { 256 - phase }) as f32 / 64.0 - 1.0;
        let sample = Sample {
            deflection: gear.frame().rated() * triangle * size as f32 / 4.0,
            motor_angle: phase as f32 / 64.0,
            velocity: if phase < 128 { 0.5 } else { -0.5 },
            motor_velocity: if phase < 128 { 2.0 } else { -2.0 },
            time: k as f32 / 1024.0,
            temperature: 20.0 + k as f32 / 128.0,
            period: PERIOD_S as f32,
            ..Sample::default()
        };
        let (torque, out, terms, theta, solution);
        if compensated.stack.terms().is_empty() {
            if k == 0 {
                base = gear.start(sample.deflection);
            } else {
                gear.step(&mut base, sample.deflection);
            }
            out = gear.output(&base);
            (torque, terms, theta) = (out.torque, 0.0, base.theta());
            solution = inverse.peek(&base, 0.5 * torque);
        } else {
            let state = whole.get_or_insert_with(|| compensated.start::<16>(&sample));
            let total = if k == 0 { *state.last() } else { compensated.step(state, &sample) };
            out = total.base;
            (torque, terms, theta) = (total.torque, total.terms, total.deflection);
            let solved = state.solve(&inverse, &compensated.stack, 0.5 * torque, &sample);
            solution = Solution { theta: solved.measured, ..solved.gear };
        }
        let flags = if theta.abs() > gear.frame().rated() { flag::OUT_OF_RANGE } else { 0 };
        let mut line = String::new();
        for number in [torque, out.elastic, out.hysteresis, terms, theta] {
            write!(line, "{:08x} ", number.to_bits()).expect("a string");
        }
        lines.push(format!("{line}{flags:x}"));
        let saturated = if solution.saturated { flag::SATURATED } else { 0 };
        lines.push(format!("{:08x} {saturated:x}", solution.theta.to_bits()));
        let state = fed.get_or_insert_with(|| feed.start::<16>(&sample));
        let demand = Demand { torque: 0.75 * torque, deflection: 0.0 };
        let now = feed.step(state, &controls, &demand, &sample);
        let flags = if state.gear().status().out_of_range { flag::OUT_OF_RANGE } else { 0 };
        let saturated = if now.base.saturated { flag::SATURATED } else { 0 };
        let [offset, hysteresis, joint] = [now.offset, now.base.hysteresis, now.joint_torque].map(f32::to_bits);
        lines.push(format!("{offset:08x} {hysteresis:08x} {joint:08x} {:x}", flags | saturated));
    }
    lines
}

/// Origin and sequence number in the status of a frame, and that the drive counts as enabled.
fn status_of(frame: &str) -> (Origin, u32, bool) {
    let byte = |at: usize| u8::from_str_radix(&frame[at..at + 2], 16).expect("hexadecimal digits");
    let mut receiver = Receiver::new();
    let bodies = (0..frame.len()).step_by(2).filter_map(|at| receiver.feed(byte(at)).map(<[u8]>::to_vec));
    let body = bodies.last().expect("a frame");
    match Answer::decode(&body) {
        Some((_, _, Answer::Status(status))) => (status.origin, status.sequence, status.enabled),
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_frame_of_the_program_asks_for_the_status() {
    let frame = Request::Status.encode(Tag::default());
    let written = frame.iter().map(|byte| format!("{byte:#04x}")).collect::<Vec<_>>().join(", ");
    assert!(include_str!("program.c").contains(&written), "{written}");
}

#[test]
fn a_c_program_computes_the_bits_of_rust() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = compile(folder.path());
    let other = folder.path().join("other.bin");
    std::fs::write(&other, block(&params(1.1), &[])).expect("written");
    for terms in
        [&[][..], &["kinematic_error", "coulomb_friction", "ripple_resonance", "thermal_friction", "sensor_drift"]]
    {
        let bytes = block(&params(1.0), terms);
        let file = folder.path().join("block.bin");
        std::fs::write(&file, &bytes).expect("written");
        let output = run(Command::new(&program).arg(&file).arg(&other));
        let mut lines = output.lines();
        let status: Vec<&str> = lines.next().expect("a status").rsplitn(6, ' ').collect();
        let needs = if terms.is_empty() { "0" } else { "65" };
        assert_eq!((status[0], status[5]), (needs, "joint 3"));
        assert_eq!(status[2], format!("{:08x}", (1.168e-3_f32).to_bits()));
        assert_eq!(lines.next(), Some(format!("0 {needs}").as_str()), "the feed-forward is loaded");
        let mut lines: Vec<&str> = lines.collect();
        let answer = lines.pop().expect("the answer of the link");
        assert_eq!(status_of(answer), (Origin::Stored, 1, true), "{answer}");
        // A sensor's drift is in the block, and nothing of it in what is fed forward.
        let plant: Vec<&str> = terms.iter().copied().filter(|name| *name != "sensor_drift").collect();
        let expected = expected(&block(&params(1.0), &plant));
        for (k, (c, rust)) in lines.iter().zip(&expected).enumerate() {
            assert_eq!(c, rust, "line {k} with {terms:?}");
        }
        assert_eq!(lines.len(), expected.len());
    }
}

/// The value of a `#define` of the header.
fn defined(name: &str) -> u32 {
    let line = HEADER.lines().find_map(|line| line.strip_prefix(&format!("#define {name} ")));
    let word = line.and_then(|line| line.split_whitespace().next()).unwrap_or_else(|| panic!("{name} is not defined"));
    let word = word.trim_end_matches('u');
    match word.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => word.parse(),
    }
    .unwrap_or_else(|_| panic!("{name} is no number"))
}

#[test]
fn the_header_says_what_the_library_does() {
    assert_eq!(defined("GMHM_JOINT_WORDS") as usize, JOINT_WORDS);
    assert_eq!(defined("GMHM_TERM_WORDS") as usize, TERM_WORDS);
    assert_eq!(defined("GMHM_GEAR_WORDS") as usize, GEAR_WORDS);
    assert_eq!(defined("GMHM_LAW_WORDS") as usize, LAW_WORDS);
    assert_eq!(defined("GMHM_FEED_FORWARD_WORDS") as usize, FEED_FORWARD_WORDS);
    assert_eq!(defined("GMHM_PAIR_WORDS") as usize, PAIR_WORDS);
    assert_eq!(defined("GMHM_STORE_WORDS") as usize, STORE_WORDS);
    assert_eq!(defined("GMHM_LINK_WORDS") as usize, LINK_WORDS);
    let codes = [
        ("NULL", NULL),
        ("VALUE", VALUE),
        ("UNIT", UNIT),
        ("FLASH", FLASH),
        ("NO_BLOCK", NO_BLOCK),
        ("NOT_NEWER", NOT_NEWER),
        ("NO_SPACE", NO_SPACE),
        ("READ_BACK", READ_BACK),
        ("PLACE", PLACE),
        ("PERIOD", PERIOD),
        ("NO_INVERSE", NO_INVERSE),
        ("UNREADABLE", UNREADABLE),
        ("PLACES", PLACES),
    ];
    for (name, code) in codes {
        assert_eq!(defined(&format!("GMHM_{name}")), u32::from(code));
    }
    let flags = [
        ("NOT_LOADED", flag::NOT_LOADED),
        ("REFUSED", flag::REFUSED),
        ("OUT_OF_RANGE", flag::OUT_OF_RANGE),
        ("SATURATED", flag::SATURATED),
        ("NOT_CONVERGED", flag::NOT_CONVERGED),
        ("NO_INVERSE", flag::NO_INVERSE),
        ("QUARANTINED", flag::QUARANTINED),
        ("RESTARTED", flag::RESTARTED),
        ("NO_ENCODERS", flag::NO_ENCODERS),
    ];
    for (name, value) in flags {
        assert_eq!(defined(&format!("GMHM_FLAG_{name}")), value);
    }
    let needs = [
        "MOTOR_ANGLE",
        "OUTPUT_ANGLE",
        "VELOCITY",
        "ACCELERATION",
        "DEFLECTION_RATE",
        "TEMPERATURE",
        "MOTOR_VELOCITY",
        "OUTPUT_VELOCITY",
    ];
    for (k, name) in needs.into_iter().enumerate() {
        assert_eq!(defined(&format!("GMHM_NEEDS_{name}")), 1 << k);
    }
    let errors = [
        "LENGTH",
        "MAGIC",
        "VERSION",
        "CHECKSUM",
        "HEADER",
        "SCALAR",
        "STACK_DEPTH",
        "RECORDS",
        "UNKNOWN",
        "MALFORMED",
        "TWICE",
        "MISSING",
        "OUT_OF_RANGE",
        "TERM",
        "NO_ROOM",
        "NO_TERMS",
        "SELF_TEST",
        "DISAGREES",
    ];
    for (k, name) in errors.into_iter().enumerate() {
        assert_eq!(defined(&format!("GMHM_ERROR_{name}")), 0x0101 + k as u32);
    }
    // As C lays the structure out: nine words, twenty characters and four words.
    assert_eq!(size_of::<StatusC>(), 72);
    // Every signal that a term in force can ask for has a bit or is always there; faults of the measurement are never in force.
    for info in KINDS.iter().filter(|info| info.side == Side::Plant) {
        for need in kind(info.name).expect("a kind").needs {
            use gmhm::terms::Need;
            assert!(gmhm_c::need::ALL.contains(need) || matches!(need, Need::Deflection | Need::Gear), "{need:?}");
        }
    }
}

#[test]
fn the_header_is_good_cpp() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("use.cpp");
    std::fs::write(&source, "#include \"gmhm.h\"\nint main() { return static_cast<int>(sizeof(gmhm_status)) - 72; }\n")
        .expect("written");
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    run(Command::new("c++")
        .args(["-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"])
        .arg(include)
        .arg(source));
}
