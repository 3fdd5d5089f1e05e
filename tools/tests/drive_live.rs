//! `gmhm drive live` on a terminal: a script presses keys in a pseudo-terminal and reads the screen.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{WorkDir, two_blocks};
use crate::served::{Joint, blank, faulty, serve};
use gmhm::link::CompensationSetting;
use serialport::{SerialPort, TTYPort};

const COLUMNS: usize = 100;
const ROWS: usize = 30;

/// A terminal with `gmhm` in it.
struct Terminal {
    line: TTYPort,
    child: Child,
    screen: Screen,
}

impl Terminal {
    fn start(dir: &WorkDir, words: &str) -> Self {
        let (mut line, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("its name");
        let [columns, rows] = [COLUMNS, ROWS].map(|count| count.to_string());
        let size = Command::new("stty").args(["-F", &name, "cols", &columns, "rows", &rows]).status();
        assert!(size.expect("stty").success());
        line.set_timeout(Duration::from_millis(50)).expect("a timeout");
        let end = || Stdio::from(OpenOptions::new().read(true).write(true).open(&name).expect("the terminal"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_gmhm"));
        command.args(words.split_whitespace()).current_dir(dir.path(".")).env("TERM", "xterm-256color");
        let child = command.stdin(end()).stdout(end()).stderr(end()).spawn().expect("gmhm");
        Self { line, child, screen: Screen::default() }
    }

    /// Presses keys and waits until the screen shows all of this.
    fn press(&mut self, keys: &str, parts: &[&str]) {
        if !keys.is_empty() {
            self.line.write_all(keys.as_bytes()).expect("keys");
        }
        let began = Instant::now();
        while !parts.iter().all(|part| self.screen.text().contains(part)) {
            let ended = self.child.try_wait().expect("a state");
            let late = began.elapsed() > Duration::from_secs(20);
            assert!(
                !late && ended.is_none(),
                "the screen does not show {parts:?} ({ended:?}):\n{}",
                self.screen.text()
            );
            self.read();
        }
    }

    fn read(&mut self) {
        let mut buffer = [0; 4096];
        if let Ok(count) = self.line.read(&mut buffer) {
            self.screen.feed(&buffer[..count]);
        }
    }

    fn end(mut self, key: &str) -> bool {
        self.line.write_all(key.as_bytes()).expect("keys");
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(10) {
            if let Some(status) = self.child.try_wait().expect("a state") {
                return status.success();
            }
            self.read();
        }
        false
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a terminal shows: letters at the cursor, moves of the cursor, and nothing else.
#[derive(Default)]
struct Screen {
    waiting: Vec<u8>,
    cells: BTreeMap<(usize, usize), char>,
    at: (usize, usize),
}

impl Screen {
    fn feed(&mut self, bytes: &[u8]) {
        self.waiting.extend_from_slice(bytes);
        // A letter or a sequence that was cut waits for its end.
        while let Some(used) = self.take() {
            self.waiting.drain(..used);
        }
    }

    fn take(&mut self) -> Option<usize> {
        let first = *self.waiting.first()?;
        if first == 0x1b {
            let end = self.waiting.iter().skip(2).position(u8::is_ascii_alphabetic)? + 2;
            let numbers: Vec<usize> = String::from_utf8_lossy(&self.waiting[2..end])
                .split(';')
                .filter_map(|number| number.parse().ok())
                .collect();
            match (self.waiting[end], &numbers[..]) {
                (b'H', [row, column]) => self.at = (*row, *column),
                (b'J', _) => self.cells.clear(),
                _ => {}
            }
            return Some(end + 1);
        }
        let length = match first {
            0..0x80 => 1,
            0x80..0xE0 => 2,
            0xE0..0xF0 => 3,
            _ => 4,
        };
        let letter = std::str::from_utf8(self.waiting.get(..length)?).ok()?.chars().next()?;
        self.cells.insert(self.at, letter);
        self.at.1 += 1;
        Some(length)
    }

    fn text(&self) -> String {
        let cell = |row, column| self.cells.get(&(row, column)).copied().unwrap_or(' ');
        let line = |row| (1..=COLUMNS).map(|column| cell(row, column)).collect::<String>() + "\n";
        (1..=ROWS).map(line).collect()
    }
}

#[test]
fn keys_switch_the_compensation_and_try_parameters() {
    let dir = two_blocks();
    let served = serve(
        Joint {
            compensation: CompensationSetting { gain_ratio: 0.5, ..CompensationSetting::default() },
            ..Joint::default()
        },
        blank(),
        2,
        None,
    );
    let to = format!("tcp:{}", served.address);
    dir.succeed(&format!("flash params.bin --to {to}"));
    let mut terminal = Terminal::start(&dir, &format!("drive --to {to} live --block softer.bin"));
    terminal.press(
        "",
        &[
            "torque       −1.500 N·m",
            "deflection   0.2500 mrad",
            "out of range",
            "stored, sequence 1",
            "N·m over the last 20 s",
        ],
    );
    terminal.press("t", &["on trial, sequence 2", "on trial: CRC-32"]);
    terminal.press("o", &["compensation on"]);
    // The drive takes no other parameters meanwhile, and the screen says why.
    terminal.press("r", &["the drive refused: the compensation is on"]);
    terminal.press("+", &["gain ratio   0.6000", "gain raised"]);
    terminal.press("o", &["compensation off"]);
    terminal.press("r", &["stored, sequence 1", "trial ended"]);
    assert!(terminal.end("q"));
    let (joint, _) = served.end();
    assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1));
    assert!(!joint.compensation.on && (joint.compensation.gain_ratio - 0.6).abs() < 1e-6);
}

#[test]
fn counters_are_shown_and_cleared() {
    let dir = two_blocks();
    let served = serve(Joint { diagnostics: faulty(), ..Joint::default() }, blank(), 1, None);
    let mut terminal = Terminal::start(&dir, &format!("drive --to tcp:{} live", served.address));
    let shown =
        ["refused      3", "out of range 4", "quarantined  5", "restarted    6", "saturated    7", "merged       8"];
    terminal.press("", &shown);
    terminal.press("", &["last fault   saturated"]);
    terminal.press("c", &["counters cleared", "merged       0", "last fault   none"]);
    assert!(terminal.end("q"));
    served.end();
}

#[test]
fn control_c_leaves_the_screen() {
    let dir = two_blocks();
    let served = serve(Joint::default(), blank(), 1, None);
    let mut terminal = Terminal::start(&dir, &format!("drive --to tcp:{} live", served.address));
    terminal.press("t", &["no block to try", "in force     nothing"]);
    assert!(terminal.end("\u{3}"));
    served.end();
}
