//! Compiles and runs what `gmhm export --to c` writes.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use gmhm_tools::export::{ExportOptions, Exported, Origin, source};
use gmhm_tools::model::{Model, parse};

use crate::common::skips::skipped;

/// The warnings that an export has none of.
pub const WARNINGS: [&str; 7] = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"];

/// Compilers, each with its options beside [`WARNINGS`]. Warnings that need the optimiser do not depend on the processor, so only gcc optimises.
pub const COMPILERS: [(&str, &[&str]); 3] = [
    ("gcc", &["-O1", "-c"]),
    ("clang", &["-fsyntax-only"]),
    ("arm-none-eabi-gcc", &["-fsyntax-only", "-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]),
];

/// Whether a program can be run; says so where not.
pub fn is_there(program: &str) -> bool {
    let quiet = |command: &mut Command| command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    let there = quiet(Command::new(program).arg("--version"));
    if !there {
        skipped(&format!("exported source by {program}"), &format!("no {program} on the PATH"));
    }
    there
}

pub fn model(text: &str) -> Model {
    parse("gear.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The files of a model with the prefix `gear`, in a folder.
pub fn export(folder: &Path, model: &Model, options: &ExportOptions) -> Exported {
    export_as("gear", folder, model, options)
}

/// The same with another prefix.
pub fn export_as(prefix: &str, folder: &Path, model: &Model, options: &ExportOptions) -> Exported {
    let options = ExportOptions { prefix: Some(prefix.to_owned()), ..options.clone() };
    let origin = Origin { file: "gear.toml".to_owned(), sha256: "0".repeat(64) };
    let exported = source::c(model, &origin, &options).unwrap_or_else(|error| panic!("{error}"));
    for (name, text) in &exported.files {
        std::fs::write(folder.join(name), text).unwrap();
    }
    exported
}

/// Runs a command that must succeed: its output.
pub fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Compiles the sources of a folder, all in one process; objects are in a folder below it that is named after the compiler.
pub fn compile(folder: &Path, compiler: &str, options: &[&str]) {
    let is_source = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "c");
    let sources = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(is_source);
    let objects = folder.join(compiler);
    std::fs::create_dir(&objects).unwrap();
    let mut command = Command::new(compiler);
    let done = command.current_dir(objects).args(WARNINGS).args(options).args(sources).output().unwrap();
    assert!(done.status.success(), "{compiler} {options:?}\n{}", String::from_utf8_lossy(&done.stderr));
}

/// A number in the bytes of C.
pub trait Bytes: Copy {
    const NAME: &'static str;
    const SIZE: usize;
    fn put(self, to: &mut Vec<u8>);
    fn get(from: &[u8]) -> Self;
}

macro_rules! bytes {
    ($scalar:ty, $name:literal) => {
        impl Bytes for $scalar {
            const NAME: &'static str = $name;
            const SIZE: usize = size_of::<$scalar>();
            fn put(self, to: &mut Vec<u8>) {
                to.extend(self.to_ne_bytes());
            }
            fn get(from: &[u8]) -> Self {
                Self::from_ne_bytes(from.try_into().unwrap())
            }
        }
    };
}
bytes!(f32, "float");
bytes!(f64, "double");

/// What C answers to a row.
#[derive(Debug, Clone, Copy)]
pub struct Answer<S> {
    pub torque: S,
    pub elastic: S,
    pub hysteresis: S,
    pub flags: u32,
    /// The deflection for a torque, and its flags.
    pub solution: Option<(S, u32)>,
}

/// Runs an export over rows: the fields of a sample and a torque for the inverse.
pub fn drive<S: Bytes>(folder: &Path, exported: &Exported, rows: &[Vec<S>]) -> Vec<Answer<S>> {
    let inverts = exported.without_inverse.is_none();
    let driver = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exported/driver.c");
    let mut options = vec!["-O2".to_owned(), "-ffp-contract=off".to_owned(), format!("-DREAL={}", S::NAME)];
    options.extend(inverts.then(|| "-DINVERTS".to_owned()));
    let mut compiler = Command::new("cc");
    compiler.current_dir(folder).args(WARNINGS).args(&options).args(["-I", ".", "gear.c"]).arg(driver);
    run(compiler.args(["-lm", "-o", "driver"]));
    let mut input = Vec::new();
    rows.iter().flatten().for_each(|x| x.put(&mut input));
    std::fs::write(folder.join("in"), input).unwrap();
    let open = |name: &str| std::fs::File::open(folder.join(name)).unwrap();
    let out = std::fs::File::create(folder.join("out")).unwrap();
    let status = Command::new(folder.join("driver")).stdin(open("in")).stdout(out).status().unwrap();
    assert!(status.success());
    let bytes = std::fs::read(folder.join("out")).unwrap();
    // A word for the flags, padded to the size of a number.
    let (output, solution) = (6 * S::SIZE, if inverts { 2 * S::SIZE } else { 0 });
    assert_eq!(bytes.len(), rows.len() * (output + solution));
    let word = |from: &[u8]| u32::from_ne_bytes(from[..4].try_into().unwrap());
    let answers = bytes.chunks_exact(output + solution).map(|bytes| {
        let number = |k: usize| S::get(&bytes[k * S::SIZE..(k + 1) * S::SIZE]);
        Answer {
            torque: number(0),
            elastic: number(1),
            hysteresis: number(2),
            flags: word(&bytes[5 * S::SIZE..]),
            solution: inverts.then(|| (number(6), word(&bytes[7 * S::SIZE..]))),
        }
    });
    answers.collect()
}

/// Numbers that look like chance, from −1 to 1, the same every time.
pub struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64) / f64::from(1u32 << 26) / f64::from(1u32 << 26) - 1.0
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * 0.5 * (1.0 + self.next())
    }
}

/// A path in fractions of the rated deflection, within ±`most`: long strokes, nested loops, noise, rests.
pub fn path(chance: &mut Chance, most: f64, rows: usize) -> Vec<f64> {
    let (mut u, mut aim, mut rate) = (0.0_f64, 0.0_f64, 0.01);
    let mut path = Vec::with_capacity(rows);
    for _ in 0..rows {
        if (u - aim).abs() <= rate {
            // Mostly a shorter stroke than the last, so that loops nest.
            aim = if chance.next() > -0.4 { u + 0.7 * (u - aim) + 0.5 * chance.next() } else { most * chance.next() };
            aim = aim.clamp(-most, most);
            rate = chance.between(0.001, 0.08);
        }
        let kind = chance.next();
        u += if kind > 0.9 {
            0.002 * chance.next()
        } else if kind < -0.97 {
            0.0
        } else {
            rate * (aim - u).signum()
        };
        u = u.clamp(-most, most);
        path.push(u);
    }
    path
}
