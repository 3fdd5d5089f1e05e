//! Power cuts on an emulated board: at random moments of a commit its store is taken as it is, the emulator killed, and another boots with it.

use std::collections::HashSet;
use std::ops::Range;
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use gmhm::block::{stamp, verify, verify_first};
use gmhm::link::message::{MOST_BYTES, SAVE};
use gmhm::link::{Origin, Request};
use gmhm_tools::device::{Client, DeviceError, flash, line};
use gmhm_tools::model;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::emulator::{Emulator, SLOT};
use crate::node::{Twin, block_in_force};
use crate::{Arguments, Failure, GEAR, check, gmhm};

/// Commits that are cut, at most.
const MOST_COMMITS: usize = 400;

/// Looks at the flash during one commit, at most.
const MOST_SNAPSHOTS: usize = 1000;

/// How often a starved emulator is tried again.
const ATTEMPTS: usize = 4;

/// How long a drive may take until it can commit.
const PATIENCE: Duration = Duration::from_secs(60);

/// A block, and the drive it makes.
struct Version {
    bytes: Vec<u8>,
    twin: Twin,
}

fn version(arguments: &Arguments, folder: &Path, stiffness: &str, sequence: u32) -> Result<Version, Failure> {
    // A long name makes a long block, and long writes.
    let name = "bench gear ".repeat(50);
    let text = GEAR.replace("2.6e4", stiffness).replace("bench gear", &name);
    std::fs::write(folder.join("version.toml"), text)?;
    let scalar = arguments.board.scalar();
    let pack = format!("pack version.toml --gear bench --scalar {} -o version.bin", scalar.name());
    gmhm(&arguments.gmhm, folder, &pack)?;
    let mut bytes = std::fs::read(folder.join("version.bin"))?;
    stamp(&mut bytes, sequence)?;
    Ok(Version { bytes, twin: Twin::of(&model::load(&folder.join("version.toml"))?, scalar)? })
}

/// Cuts power until `arguments.cuts` flashes were found that are neither the old nor the new one.
pub fn cut(arguments: &Arguments, folder: &Path) -> Result<(), Failure> {
    let place = &arguments.board.store();
    let mut random = ChaCha8Rng::seed_from_u64(arguments.seed);
    let [old, new] =
        [("2.6e4", 3), ("2.2e4", 4)].map(|(stiffness, sequence)| version(arguments, folder, stiffness, sequence));
    let (old, new) = (old?, new?);
    let [before, after] = ["before.flash", "after.flash"].map(|file| folder.join(file));
    patiently(|| fill(arguments, &old, place, &before))?;
    let untouched = std::fs::read(&before)?;

    let mut flashes = HashSet::new();
    let (mut boots, mut torn, mut found_old, mut found_new) = (0, 0, 0, 0);
    for _ in 0..MOST_COMMITS {
        if torn >= arguments.cuts {
            break;
        }
        let snapshots = patiently(|| interrupted(arguments, folder, &before, place, &new, &mut random))?;
        for snapshot in snapshots {
            if snapshot == untouched || !flashes.insert(snapshot.clone()) {
                continue;
            }
            std::fs::write(&after, &snapshot)?;
            let is_new = patiently(|| boot(arguments, &after, &old, &new))?;
            (found_old, found_new) = (found_old + usize::from(!is_new), found_new + usize::from(is_new));
            torn += usize::from(!is_complete(&snapshot));
            boots += 1;
        }
    }
    println!(
        "{}: {boots} power cuts while a block was stored, {torn} of them in the middle of it (seed {}): the old block {found_old} times, the new one {found_new} times, whole",
        arguments.board.name(),
        arguments.seed
    );
    check(torn >= arguments.cuts, "too few power cuts met the write")
}

/// Boots from a flash: whether the new block is in force, not the old one, whole, to the last bit of its torques. Neither is a failure.
fn boot(arguments: &Arguments, flash_file: &Path, old: &Version, new: &Version) -> Result<bool, Failure> {
    let emulator = Emulator::start(arguments.board, &arguments.image, Some(flash_file), false)?;
    let mut drive = emulator.client()?;
    check(drive.status()?.origin == Origin::Stored, "after a power cut the drive holds no block")?;
    let found = block_in_force(&mut drive)?;
    let version = [old, new].into_iter().find(|version| version.bytes == found);
    let version = version.ok_or("after a power cut the drive holds neither the old nor the new block")?;
    version.twin.follow(&mut drive, 20)?;
    drop(drive);
    // And it can be flashed as if nothing had been.
    let again = flash(&old.bytes, || Ok(Client::new(line::open(&emulator.target(), 0)?)), |_, _| {})?;
    let follows = again.sequence == verify(&found)?.header().sequence + 1;
    check(follows, "after a power cut the drive cannot be flashed")?;
    Ok(version.bytes == new.bytes)
}

/// A busy host may starve the emulator until a request goes unanswered, or is answered late: then all is done again.
fn patiently<T>(mut work: impl FnMut() -> Result<T, Failure>) -> Result<T, Failure> {
    for _ in 1..ATTEMPTS {
        match work() {
            Err(failure) if failure.downcast_ref().is_some_and(DeviceError::is_of_the_line) => {}
            done => return done,
        }
    }
    work()
}

/// Whether both slots hold a whole block.
fn is_complete(store: &[u8]) -> bool {
    store.chunks(SLOT).all(|slot| verify_first(slot).is_ok())
}

/// Leaves the old block twice in flash, so that the next commit has something to erase.
fn fill(arguments: &Arguments, old: &Version, place: &Range<u32>, file: &Path) -> Result<(), Failure> {
    let emulator = Emulator::start(arguments.board, &arguments.image, None, false)?;
    for sequence in [2, 3] {
        let mut bytes = old.bytes.clone();
        stamp(&mut bytes, sequence)?;
        let mut drive = emulator.client()?;
        stage(&mut drive, &bytes)?;
        drive.tell(&Request::Commit { signature: SAVE, crc: verify(&bytes)?.crc() })?;
    }
    let mut monitor = emulator.monitor()?;
    monitor.command("stop")?;
    monitor.save(place, file)
}

fn stage(drive: &mut Client, bytes: &[u8]) -> Result<(), Failure> {
    drive.tell(&Request::Stage { length: bytes.len() as u32, crc: verify(bytes)?.crc() })?;
    let mut offset = 0;
    for bytes in bytes.chunks(MOST_BYTES) {
        drive.tell(&Request::Data { offset, bytes })?;
        offset += bytes.len() as u32;
    }
    drive.tell(&Request::Try)?;
    Ok(())
}

/// The flash at random moments of one commit, which is never heard the end of.
fn interrupted(
    arguments: &Arguments,
    folder: &Path,
    before: &Path,
    place: &Range<u32>,
    new: &Version,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Vec<u8>>, Failure> {
    let emulator = Emulator::start(arguments.board, &arguments.image, Some(before), true)?;
    let mut monitor = emulator.monitor()?;
    let file = folder.join("moment.flash");
    let (begins, begun) = mpsc::channel();
    std::thread::scope(|scope| {
        let commit = scope.spawn(|| commit(&emulator, new, &begins));
        let mut snapshots = Vec::new();
        // Where nothing begins, the thread says why.
        if begun.recv_timeout(PATIENCE).is_ok() {
            while !commit.is_finished() && snapshots.len() < MOST_SNAPSHOTS {
                std::thread::sleep(Duration::from_micros(random.random_range(0..1000)));
                monitor.command("stop")?;
                monitor.save(place, &file)?;
                snapshots.push(std::fs::read(&file)?);
                monitor.command("cont")?;
            }
        }
        monitor.kill();
        match commit.join() {
            // A commit that was cut in the middle has failed as it should.
            Ok(Err(why)) if snapshots.is_empty() => Err(why),
            _ => Ok(snapshots),
        }
    })
}

fn commit(emulator: &Emulator, new: &Version, begins: &mpsc::Sender<()>) -> Result<(), Failure> {
    let mut drive = emulator.client()?;
    stage(&mut drive, &new.bytes)?;
    let crc = verify(&new.bytes)?.crc();
    begins.send(())?;
    Ok(drive.tell(&Request::Commit { signature: SAVE, crc })?)
}
