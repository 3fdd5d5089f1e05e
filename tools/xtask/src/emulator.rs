//! Runs an image in QEMU and reads the lines it prints: defmt frames over semihosting.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use defmt_decoder::{DecodeError, Table};

use crate::machine::Machine;
use crate::setup::EMULATOR;

/// Longer than any image runs; a hanging one is ended.
const TIME_LIMIT: Duration = Duration::from_secs(600);

/// Whether the emulator's clock runs with the instructions, one a nanosecond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// As fast as it goes.
    Free,
    /// Counted: SysTick then counts instructions.
    Instructions,
}

/// Runs an image to its end and hands each line to `line` as it comes.
pub fn run(image: &Path, machine: Machine, clock: Clock, line: impl FnMut(&str)) -> Result<()> {
    let name = image.display();
    let elf = std::fs::read(image).with_context(|| format!("cannot read the image {name}"))?;
    let table = Table::parse(&elf)?.with_context(|| format!("{name} holds no defmt strings: is it one of ours?"))?;
    let mut emulator = Emulator(
        command(image, machine, clock)
            .spawn()
            .with_context(|| format!("cannot start {EMULATOR}: run `cargo xtask setup`, which installs it"))?,
    );
    let output = emulator.0.stdout.take().context("the emulator has no output")?;
    decode(&table, output, line).with_context(|| format!("{name} on {}", machine.board))?;
    let status = emulator.0.wait()?;
    ensure!(status.success(), "{name} on {} ended with {status}", machine.board);
    Ok(())
}

/// The lines of an image that runs to its end.
pub fn lines(image: &Path, machine: Machine, clock: Clock) -> Result<String> {
    let mut text = String::new();
    run(image, machine, clock, |line| {
        text.push_str(line);
        text.push('\n');
    })?;
    Ok(text)
}

fn command(image: &Path, machine: Machine, clock: Clock) -> Command {
    let mut command = Command::new(EMULATOR);
    command.args(["-machine", machine.board, "-nographic", "-monitor", "none", "-serial", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(image);
    if clock == Clock::Instructions {
        command.args(["-icount", "shift=0"]);
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    command
}

/// A running emulator, ended with its owner.
struct Emulator(Child);

impl Drop for Emulator {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn decode(table: &Table, mut output: impl Read + Send + 'static, mut line: impl FnMut(&str)) -> Result<()> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = output.read(&mut buffer) {
            if sender.send(buffer[..count].to_vec()).is_err() {
                break;
            }
        }
    });
    let mut decoder = table.new_stream_decoder();
    loop {
        match receiver.recv_timeout(TIME_LIMIT) {
            Ok(bytes) => decoder.received(&bytes),
            Err(mpsc::RecvTimeoutError::Disconnected) => return Ok(()),
            Err(mpsc::RecvTimeoutError::Timeout) => bail!("printed nothing for {} s", TIME_LIMIT.as_secs()),
        }
        loop {
            match decoder.decode() {
                Ok(frame) => line(&frame.display_message().to_string()),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => bail!("printed a frame that cannot be decoded"),
            }
        }
    }
}
