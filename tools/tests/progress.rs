//! Commands that take long show their progress and the time left on a terminal, and write no file when Ctrl-C ends them.

use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{PUBLISHED, WorkDir};
use serialport::{SerialPort, TTYPort};

/// Rows of the first recording; each trial that ends before it shows anything is repeated with four times as many.
const ROWS: usize = 400_000;
const TRIALS: u32 = 4;

/// A recording of the published gear's motion and torque.
fn recording(rows: usize) -> String {
    let mut text = "time_s,deflection_mrad,torque_nm\n".to_owned();
    for k in 0..rows {
        let swing = (k as f64 * 0.01).sin();
        let _ = writeln!(text, "{},{:.6},{:.6}", 1e-3 * k as f64, 1.1 * swing, 29.0 * swing);
    }
    text
}

/// What a command writes to its terminal until it shows `part`, which ends it by Ctrl-C: its status too. None where it ends before.
fn shows(dir: &WorkDir, words: &str, part: &str) -> Option<Option<i32>> {
    let (mut line, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let name = slave.name().expect("its name");
    let sized = Command::new("stty").args(["-F", &name, "cols", "100", "rows", "30"]).status();
    assert!(sized.expect("stty").success());
    line.set_timeout(Duration::from_millis(50)).expect("a timeout");
    let terminal = OpenOptions::new().read(true).write(true).open(&name).expect("the terminal");
    let mut child = Command::new(env!("CARGO_BIN_EXE_gmhm"))
        .args(words.split_whitespace())
        .current_dir(dir.path("."))
        .env("TERM", "xterm")
        .stdout(Stdio::null())
        .stderr(Stdio::from(terminal))
        .spawn()
        .expect("gmhm");
    let (mut seen, mut buffer) = (Vec::new(), [0; 4096]);
    let began = Instant::now();
    loop {
        if let Ok(count) = line.read(&mut buffer) {
            seen.extend_from_slice(&buffer[..count]);
        }
        if String::from_utf8_lossy(&seen).split('\r').any(|line| line.contains(part) && line.contains(" left")) {
            assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill").success());
            return Some(child.wait().expect("a status").code());
        }
        if child.try_wait().expect("a state").is_some() {
            return None;
        }
        if began.elapsed() > Duration::from_secs(120) {
            let _ = child.kill();
            panic!("`gmhm {words}` never shows {part:?} with the time left: {}", String::from_utf8_lossy(&seen));
        }
    }
}

#[test]
fn work_over_a_second_shows_the_time_left_and_ends_at_ctrl_c() {
    let commands = [
        ("predict m.toml rec.csv -o out.csv", "Writing"),
        ("invert m.toml rec.csv -o out.csv", "Writing"),
        ("adapt m.toml rec.csv -o out.toml", "Adapting"),
        (
            "simulate m.toml --experiment running --hide kinematic_error=0.15 --sample-rate 4000 -o out.csv",
            "Finding the sizes",
        ),
    ];
    let dir = WorkDir::new();
    dir.write("m.toml", PUBLISHED).write("rec.csv", recording(ROWS));
    let mut rows = ROWS;
    for (words, part) in commands {
        let mut trial = 0;
        let status = loop {
            match shows(&dir, words, part) {
                Some(status) => break status,
                None if trial < TRIALS && !words.starts_with("simulate") => {
                    trial += 1;
                    rows *= 4;
                    dir.write("rec.csv", recording(rows));
                }
                None => panic!("`gmhm {words}` does not show {part:?} with the time left"),
            }
        };
        assert_eq!(status, Some(130), "{words}");
        // The output appears whole or not at all; nothing half-written stays.
        let left: Vec<String> = dir.files().into_iter().filter(|name| !name.starts_with("out.")).collect();
        assert_eq!(left, ["m.toml", "rec.csv"], "{words}");
    }
}
