//! From a recording to the torques of an emulated drive, and back: fit, pack, flash, reset, compare to the bit, and power cut while it stores.
//!
//! `cargo xtask end-to-end` builds the image `node`, and runs this with it.

#[path = "../../../src/bin/node/arithmetic.rs"]
mod arithmetic;
mod emulator;
mod node;
mod power;
#[path = "../../../src/bin/test_path/mod.rs"]
#[allow(dead_code, reason = "the path at a constant period")]
mod test_path;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use emulator::{Board, Emulator};
use gmhm::block::{BlockError, FIRST_TERM, crc32, verify};
use gmhm::link::Origin;
use gmhm_tools::device::{Client, DeviceError, flash, line};
use gmhm_tools::model;
use node::{Followed, Twin};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The gear that the recording is made of: synthetic, the published one with another spring.
const GEAR: &str = r#"format = 1
name = "bench gear"
[gear]
ratio = 100.0
rated_deflection_rad = 1.168e-3
[elastic]
c1_nm_per_rad = 2.6e4
c2_nm_per_rad3 = 1.0e9
c3_nm_per_rad5 = -1.1774e14
[memory]
alpha = 2.6532e6
beta_per_s = 422.68
omega_per_s = 226.31
"#;

struct Arguments {
    board: Board,
    image: PathBuf,
    gmhm: PathBuf,
    cuts: usize,
    seed: u64,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [board, image, gmhm, cuts, seed] = words.as_slice() else {
        eprintln!("usage: end_to_end BOARD IMAGE GMHM CUTS SEED");
        return ExitCode::from(2);
    };
    let run = || -> Result<(), Failure> {
        let arguments = Arguments {
            board: Board::named(board)?,
            image: image.into(),
            gmhm: gmhm.into(),
            cuts: cuts.parse()?,
            seed: seed.parse()?,
        };
        chain(&arguments)
    };
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {board}: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Runs `gmhm` in a folder and gives what it prints.
fn gmhm(program: &Path, folder: &Path, words: &str) -> Result<String, Failure> {
    let output = Command::new(program).current_dir(folder).args(words.split_whitespace()).output()?;
    if !output.status.success() {
        return Err(format!("gmhm {words}: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(String::from_utf8(output.stdout)?)
}

fn check(holds: bool, what: &str) -> Result<(), Failure> {
    if holds { Ok(()) } else { Err(what.into()) }
}

/// `coulomb_friction` among the terms of blocks.
const COULOMB: u16 = FIRST_TERM + 5;

/// A block with a term more, its CRC-32 right.
fn with_a_term(block: &[u8]) -> Vec<u8> {
    let (records, crc) = (40, block.len() - 4);
    let mut longer = block[..crc].to_vec();
    longer.extend([COULOMB, 8].map(u16::to_le_bytes).as_flattened());
    longer.extend([0.25_f32, 0.0].map(f32::to_le_bytes).as_flattened());
    longer[records] += 1;
    let length = longer.len() as u32 + 4;
    longer[8..12].copy_from_slice(&length.to_le_bytes());
    longer.extend(crc32(&longer).to_le_bytes());
    longer
}

/// The live signals are those of a drive that goes on and feeds half of the hysteresis torque forward.
fn compensates(json: &str) -> Result<(), Failure> {
    let moments: Vec<HashMap<String, serde_json::Value>> = serde_json::from_str(json)?;
    let signal = |name: &str| moments.iter().filter_map(|moment| moment.get(name)?.as_f64()).collect::<Vec<_>>();
    let [ticks, hysteresis, fed] = ["ticks", "hysteresis_nm", "contribution_nm"].map(signal);
    check(ticks.len() > 4 && ticks.is_sorted_by(|a, b| a < b), "the live signals stand still")?;
    check(hysteresis.iter().any(|torque| *torque != 0.0), "no hysteresis torque among the live signals")?;
    let half = hysteresis.iter().zip(&fed).all(|(torque, fed)| (0.5 * torque - fed).abs() <= 1e-6 * torque.abs());
    check(half, "what is fed forward is not half of the hysteresis torque")
}

fn chain(arguments: &Arguments) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let at = |file: &str| folder.path().join(file);
    let run = |words: &str| gmhm(&arguments.gmhm, folder.path(), words);
    let board = arguments.board;

    std::fs::write(at("bench.toml"), GEAR)?;
    run(&format!(
        "simulate bench.toml --experiment amplitudes --noise torque=0.02 --seed {} -o recording.csv",
        arguments.seed
    ))?;
    run("fit recording.csv -o fitted.toml")?;
    let scalar = board.scalar();
    run(&format!("pack fitted.toml --gear bench --scalar {} -o params.bin", scalar.name()))?;
    let twin = Twin::of(&model::load(&at("fitted.toml"))?, scalar)?;

    let emulator = Emulator::start(board, &arguments.image, None, false)?;
    let told = run(&format!("flash params.bin --to {} --read-back back.bin", emulator.target()))?;
    print!("{}: {told}", board.name());
    emulator.reset()?;
    let mut drive = emulator.client()?;
    let status = drive.status()?;
    check(
        status.origin == Origin::Stored && status.sequence == 1,
        "after the reset, what was flashed is not in force",
    )?;
    let back = std::fs::read(at("back.bin"))?;
    check(
        node::block_in_force(&mut drive)? == back,
        "after the reset, the block reads otherwise than when it was flashed",
    )?;
    let Followed { samples, ticks } = twin.follow(&mut drive, 200)?;
    println!(
        "{}: {samples} samples among {ticks} control periods equal the host's to the bit, in {}",
        board.name(),
        scalar.name()
    );

    let shown = |file: &str| -> Result<Vec<String>, Failure> {
        let text = run(&format!("inspect {file}"))?;
        let differs = |line: &&str| !line.contains("sequence") && !line.contains("CRC-32");
        Ok(text.lines().filter(differs).map(str::to_owned).collect())
    };
    check(
        shown("params.bin")? == shown("back.bin")?,
        "inspect shows otherwise what was read back than what was packed",
    )?;

    // A block with a term, of which this image computes none, is refused by a code of its own, and changes nothing.
    drop(drive);
    let refused = flash(&with_a_term(&back), || Ok(Client::new(line::open(&emulator.target(), 0)?)), |_, _| {});
    let code = match refused {
        Err(DeviceError::Refused { refused, .. }) => refused.detail,
        other => return Err(format!("a block with a term was not refused: {other:?}").into()),
    };
    check(
        code == BlockError::TermsNotComputed(COULOMB).code(),
        &format!("a block with a term is refused by {code:#06x}"),
    )?;
    let mut drive = emulator.client()?;
    twin.follow(&mut drive, 50)?;

    // A second block on trial, and taken back.
    let other = GEAR.replace("2.6e4", "2.2e4");
    std::fs::write(at("other.toml"), &other)?;
    run(&format!("pack other.toml --gear bench --scalar {} -o other.bin", scalar.name()))?;
    let other = Twin::of(&model::load(&at("other.toml"))?, scalar)?;
    let to = format!("drive --to {}", emulator.target());
    drop(drive);
    run(&format!("{to} try other.bin"))?;
    run(&format!("{to} on"))?;
    run(&format!("{to} gain 0.5"))?;
    let live = run(&format!("{to} live --seconds 0.5 --every 0.05 --json live.json"))?;
    compensates(&std::fs::read_to_string(at("live.json"))?)?;
    let mut drive = emulator.client()?;
    let status = drive.status()?;
    check(status.origin == Origin::Trial && status.stored_sequence == 1, "the second block is not on trial")?;
    other.follow(&mut drive, 50)?;
    drop(drive);
    run(&format!("{to} off"))?;
    run(&format!("{to} revert"))?;
    let mut drive = emulator.client()?;
    check(drive.status()?.crc == verify(&back)?.crc(), "the trial is not over")?;
    twin.follow(&mut drive, 50)?;
    println!("{}: a second block on trial, {} live lines read, and taken back", board.name(), live.lines().count() - 1);

    // The second block over the first one's neighbour, and back.
    drop(drive);
    run(&format!("flash other.bin --to {}", emulator.target()))?;
    emulator.reset()?;
    let mut drive = emulator.client()?;
    check(drive.status()?.sequence == 2, "the second block is not in force")?;
    other.follow(&mut drive, 50)?;
    drop(drive);
    run(&format!("{to} rollback"))?;
    emulator.reset()?;
    let mut drive = emulator.client()?;
    check(drive.status()?.crc == verify(&back)?.crc(), "the first block is not in force again")?;
    twin.follow(&mut drive, 50)?;
    println!("{}: a second block and back again, over resets", board.name());
    drop(drive);
    drop(emulator);

    power::cut(arguments, folder.path())
}
