//! Runs an image in QEMU and reads the lines it prints: defmt frames over semihosting.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use defmt_decoder::{DecodeError, Table};
use tempfile::NamedTempFile;

use crate::machine::Machine;
use crate::setup::EMULATOR;

/// Longer than any image runs; a hanging one is ended.
const TIME_LIMIT: Duration = Duration::from_secs(600);

/// How often, and how far apart, an emulator that starts is asked for its port.
const CONNECTION_TRIES: u32 = 200;
const CONNECTION_PAUSE: Duration = Duration::from_millis(50);

/// Whether the emulator's clock runs with the instructions, one a nanosecond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// As fast as it goes.
    Free,
    /// Counted: SysTick then counts instructions.
    Instructions,
}

/// Words that stand in memory before the image starts.
#[derive(Debug, Clone)]
pub struct Script {
    /// Where.
    pub address: u64,
    /// What.
    pub words: Vec<u32>,
}

/// Runs an image to its end and hands each line to `line` as it comes.
pub fn run(
    image: &Path,
    machine: Machine,
    clock: Clock,
    script: Option<&Script>,
    line: impl FnMut(&str),
) -> Result<()> {
    let name = image.display();
    let elf = std::fs::read(image).with_context(|| format!("cannot read the image {name}"))?;
    let table = Table::parse(&elf)?.with_context(|| format!("{name} holds no defmt strings: is it one of ours?"))?;
    let mut emulator = Emulator::start(command(image, machine, clock).stdout(Stdio::piped()), script)?;
    let output = emulator.child.stdout.take().context("the emulator has no output")?;
    decode(&table, output, line).with_context(|| format!("{name} on {}", machine.board))?;
    let status = emulator.child.wait()?;
    ensure!(status.success(), "{name} on {} ended with {status}", machine.board);
    Ok(())
}

/// The lines of an image that runs to its end.
pub fn lines(image: &Path, machine: Machine, clock: Clock) -> Result<String> {
    let mut text = String::new();
    run(image, machine, clock, None, |line| {
        text.push_str(line);
        text.push('\n');
    })?;
    Ok(text)
}

/// Runs an image that logs each stretch of code it enters; what it prints is dropped.
pub fn trace(image: &Path, machine: Machine) -> Result<Emulator> {
    let mut command = command(image, machine, Clock::Instructions);
    command.args(["-d", "exec,nochain"]).stdout(Stdio::null()).stderr(Stdio::piped());
    Emulator::start(&mut command, None)
}

/// Starts an image whose serial port is a TCP port of this host.
pub fn serve(image: &Path, machine: Machine, port: u16) -> Result<Emulator> {
    let mut command = Command::new(EMULATOR);
    command.args(["-machine", machine.board, "-display", "none", "-monitor", "none", "-kernel"]).arg(image);
    command.arg("-serial").arg(format!("tcp:127.0.0.1:{port},server=on,wait=off,nodelay=on"));
    command.args(["-semihosting-config", "enable=on,target=native"]).stdin(Stdio::null()).stdout(Stdio::null());
    let emulator = Emulator::start(&mut command, None)?;
    for _ in 0..CONNECTION_TRIES {
        // Asking for the port by binding it leaves the connection to the one that is to use it.
        if std::net::TcpListener::bind(("127.0.0.1", port)).is_err() {
            return Ok(emulator);
        }
        std::thread::sleep(CONNECTION_PAUSE);
    }
    bail!("the emulator does not open port {port}")
}

fn command(image: &Path, machine: Machine, clock: Clock) -> Command {
    let mut command = Command::new(EMULATOR);
    command.args(["-machine", machine.board, "-nographic", "-monitor", "none", "-serial", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(image);
    if clock == Clock::Instructions {
        command.args(["-icount", "shift=0,sleep=off"]);
    }
    command.stdin(Stdio::null());
    command
}

/// Runs a program that is no image of ours in a folder, with words on its command line, and gives what it prints and what it prints on standard error.
pub fn output(program: &Path, machine: Machine, folder: &Path, words: &[&str]) -> Result<[String; 2]> {
    let mut command = Command::new(EMULATOR);
    command.args(["-machine", machine.board, "-display", "none", "-monitor", "none", "-serial", "none"]);
    command.args(["-chardev", "stdio,id=out", "-semihosting-config"]);
    let words: String = words.iter().map(|word| format!(",arg={word}")).collect();
    command.arg(format!("enable=on,target=native,chardev=out,arg=program{words}")).arg("-kernel").arg(program);
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut emulator = Emulator::start(&mut command, None)?;
    let (Some(output), Some(errors)) = (emulator.child.stdout.take(), emulator.child.stderr.take()) else {
        bail!("the emulator has no output")
    };
    let name = program.display();
    let late = || format!("{name} on {} did not end within {} s", machine.board, TIME_LIMIT.as_secs());
    let [output, errors] = [text(output), text(errors)].map(|text| text.recv_timeout(TIME_LIMIT).with_context(late));
    let (output, errors) = (output??, errors??);
    let status = emulator.child.wait()?;
    ensure!(status.success(), "{name} on {} ended with {status}: {errors}", machine.board);
    Ok([output, errors])
}

/// All that comes, once it has ended.
fn text(mut from: impl Read + Send + 'static) -> mpsc::Receiver<std::io::Result<String>> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut text = String::new();
        let read = from.read_to_string(&mut text);
        // Nobody listens where the time is up.
        let _ = sender.send(read.map(|_| text));
    });
    receiver
}

/// A running emulator, ended with its owner.
pub struct Emulator {
    child: Child,
    /// Kept until the end.
    _script: Option<NamedTempFile>,
}

impl Emulator {
    fn start(command: &mut Command, script: Option<&Script>) -> Result<Self> {
        let mut file = None;
        if let Some(Script { address, words }) = script {
            let words: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            let mut written = NamedTempFile::new()?;
            written.write_all(&words)?;
            let path = written.path().display();
            command.arg("-device").arg(format!("loader,file={path},addr={address:#x},force-raw=on"));
            file = Some(written);
        }
        let child = command
            .spawn()
            .with_context(|| format!("cannot start {EMULATOR}: run `cargo xtask setup`, which installs it"))?;
        Ok(Self { child, _script: file })
    }

    /// What it logs, once.
    pub fn output(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
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
