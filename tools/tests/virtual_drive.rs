//! `gmhm virtual-drive`: the commands for drives against a simulated one.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

use crate::common::{PUBLISHED, WorkDir};

/// A simulated drive that runs beside the test.
struct Running {
    child: Child,
    output: BufReader<ChildStdout>,
    target: String,
}

impl Running {
    fn start(listen: &str) -> Self {
        Self::start_with(&["--listen", listen])
    }

    fn start_with(words: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_gmhm"))
            .arg("virtual-drive")
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("gmhm");
        let mut running =
            Self { output: BufReader::new(child.stdout.take().expect("its output")), child, target: String::new() };
        let first = running.line();
        running.target = first.strip_prefix("Virtual drive at ").unwrap_or_else(|| panic!("{first}")).to_owned();
        assert!(running.line().starts_with("Keys"));
        running
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).expect("a line");
        line.trim_end().to_owned()
    }

    /// The next line that holds this.
    fn until(&mut self, part: &str) -> String {
        loop {
            let line = self.line();
            assert!(!line.is_empty(), "the drive ended before it said {part:?}");
            if line.contains(part) {
                return line;
            }
        }
    }

    fn press(&mut self, key: &str) {
        writeln!(self.child.stdin.as_mut().expect("its input"), "{key}").expect("a key");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn bench() -> WorkDir {
    let dir = WorkDir::new();
    let term = "[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.4\nsmoothing_rad_per_s = 0.01\n";
    dir.write("gear.toml", PUBLISHED.to_owned() + term);
    dir.write("softer.toml", PUBLISHED.replace("2.4737e4", "2.2e4"));
    dir.succeed("pack gear.toml -o params.bin");
    dir.succeed("pack softer.toml -o softer.bin");
    dir
}

fn commission(listen: &str) {
    let dir = bench();
    let mut drive = Running::start(listen);
    let to = drive.target.clone();
    let told = dir.succeed(&format!("flash params.bin --to {to}")).stdout;
    assert!(told.contains("sequence 1"), "{told}");
    drive.until("sequence 1 in force");

    // What is on trial does not outlive a power cut.
    dir.succeed(&format!("drive --to {to} try softer.bin"));
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("on trial"));
    drive.press("c");
    assert!(drive.until("power cut").contains("sequence 1 in force"));
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("as stored: sequence 1"));

    // An enabled drive stores nothing.
    drive.press("e");
    drive.until("drive enabled");
    dir.refuse(&format!("flash softer.bin --to {to}"), &["the drive is enabled"]);
    drive.press("e");
    drive.until("drive disabled");

    dir.succeed(&format!("drive --to {to} gain 0.5"));
    dir.succeed(&format!("drive --to {to} on"));
    assert!(drive.until("compensation on").contains("gain ratio 0.5"));
    dir.succeed(&format!("drive --to {to} live --seconds 1.2 --every 0.1 --json live.json"));
    let live: serde_json::Value = serde_json::from_str(&dir.read("live.json")).expect("JSON");
    let column = |name: &str| -> Vec<f64> {
        live.as_array().expect("a list").iter().map(|moment| moment[name].as_f64().expect("a number")).collect()
    };
    let (torque, hysteresis, contribution) =
        (column("torque_model_nm"), column("hysteresis_nm"), column("contribution_nm"));
    assert!(torque.iter().any(|t| t.abs() > 5.0), "{torque:?}");
    assert!(hysteresis.iter().zip(&contribution).all(|(h, c)| (0.5 * h - c).abs() < 1e-6));
    let ticks = column("ticks");
    assert!((700.0..2500.0).contains(&(ticks[11] - ticks[0])), "{ticks:?}");

    drive.press("q");
    assert!(drive.child.wait().expect("an end").success());
}

#[test]
fn a_drive_is_commissioned_over_tcp() {
    commission("tcp:127.0.0.1:0");
}

#[cfg(unix)]
#[test]
fn a_drive_is_commissioned_over_a_pseudo_terminal() {
    commission("pty");
}

#[test]
fn a_power_cut_in_a_write_leaves_the_block_before_it() {
    let dir = bench();
    let mut drive = Running::start("tcp:127.0.0.1:0");
    let to = drive.target.clone();
    dir.succeed(&format!("flash params.bin --to {to}"));
    drive.until("sequence 1 in force");
    dir.succeed(&format!("drive --to {to} try softer.bin"));
    drive.press("w");
    drive.until("next write");
    // Nothing answers: the power is gone.
    let done = dir.gmhm(&format!("drive --to {to} commit"));
    assert_eq!(done.status, Some(1));
    assert!(done.stderr.contains("did not answer"), "{}", done.stderr);
    assert!(drive.until("power cut").contains("sequence 1 in force"));
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("newest stored sequence 1"));

    // A flash that meets the cut starts over by itself.
    drive.press("w");
    drive.until("next write");
    assert!(dir.succeed(&format!("flash softer.bin --to {to}")).stdout.contains("sequence 2"));
}

#[cfg(unix)]
#[test]
fn a_terminal_hands_on_keys_without_enter() {
    use serialport::SerialPort;
    let (mut line, slave) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = slave.name().expect("its name");
    let terminal = std::fs::OpenOptions::new().read(true).write(true).open(name).expect("the terminal");
    let mut child = Command::new(env!("CARGO_BIN_EXE_gmhm"))
        .args(["virtual-drive", "--listen", "tcp:127.0.0.1:0"])
        .stdin(terminal)
        .stdout(Stdio::piped())
        .spawn()
        .expect("gmhm");
    let output = BufReader::new(child.stdout.take().expect("its output"));
    let mut drive = Running { child, output, target: String::new() };
    assert!(drive.until("Keys").starts_with("Keys: c cut the power"));
    write!(line, "e").expect("a key");
    drive.until("drive enabled");
    write!(line, "c").expect("a key");
    drive.until("power cut");
    write!(line, "q").expect("a key");
    assert!(drive.child.wait().expect("an end").success());
}

#[test]
fn a_simulated_joint_is_controlled_to_the_bit() {
    let dir = bench();
    let drive = Running::start("tcp:127.0.0.1:0");
    let run = format!("simulate softer.toml --experiment joint --drive {} -o joint.csv", drive.target);
    assert!(dir.succeed(&run).stdout.contains("every bit agrees"));
    // The same line serves the link afterwards.
    dir.succeed(&format!("drive --to {} status", drive.target));
}

#[test]
fn a_line_that_cannot_be_is_refused() {
    let dir = WorkDir::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address");
    dir.refuse(&format!("virtual-drive --listen tcp:{address}"), &["cannot listen there", "help: "]);
    dir.misuse("virtual-drive --listen serial:COM1", &["tcp:HOST:PORT", "or pty"]);
}

#[test]
fn a_locked_drive_is_commissioned_with_its_key_alone() {
    let dir = bench();
    dir.write("drive.key", "00112233445566778899aabbccddeeff".repeat(2) + "\n");
    let key = dir.path("drive.key");
    dir.write("other.key", "ff".repeat(32));
    dir.write("no.key", "secret");
    let drive = Running::start_with(&["--listen", "tcp:127.0.0.1:0", "--key", &key.display().to_string()]);
    let to = &drive.target;
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("locked"));
    dir.refuse(&format!("flash params.bin --to {to}"), &["the drive has a key", "--key"]);
    dir.refuse(&format!("drive --to {to} --key other.key gain 0.5"), &["the drive has a key"]);
    dir.refuse(&format!("drive --to {to} --key no.key gain 0.5"), &["no.key", "64 hexadecimal digits"]);
    dir.succeed(&format!("flash params.bin --to {to} --key drive.key"));
    dir.succeed(&format!("drive --to {to} --key drive.key gain 0.5"));
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("gain ratio 0.5"));
}

/// A gear that warms within two seconds: its adaptation is read, and stored as a block.
#[test]
fn what_a_drive_has_learnt_is_shown_and_stored() {
    let dir = bench();
    let drive = Running::start_with(&["--listen", "tcp:127.0.0.1:0", "--warms", "2"]);
    let to = drive.target.clone();
    dir.refuse(&format!("drive --to {to} adaptation"), &["it adapts nothing"]);
    dir.succeed(&format!("flash params.bin --to {to}"));
    let learnt = || -> serde_json::Value {
        dir.succeed(&format!("drive --to {to} adaptation --json learnt.json -o adapted.bin"));
        serde_json::from_str(&dir.read("learnt.json")).expect("JSON")
    };
    let began = std::time::Instant::now();
    let mut now = learnt();
    while now["taken_over"] == false || now["stretches"].as_u64() < Some(20) {
        assert!(began.elapsed().as_secs() < 120, "{now}");
        std::thread::sleep(std::time::Duration::from_millis(500));
        now = learnt();
    }
    let coefficient = |number: usize, what: &str| now["coefficients"][number][what].as_f64().expect("a number");
    for (number, ratio) in [(0, 0.9), (4, 1.2)] {
        let [block, shadow, sd] = ["block", "shadow", "sd"].map(|what| coefficient(number, what));
        assert!(sd > 0.0 && sd < 0.1 * block, "{now}");
        assert!((shadow - ratio * block).abs() < 5.0 * sd + 0.01 * block, "{now}");
    }
    let [shadow, sd] = ["shadow", "sd"].map(|what| coefficient(0, what));
    // The block of the shadow: its terms and its gear are those of the block in force.
    let inspected = dir.succeed("inspect adapted.bin").stdout;
    assert!(inspected.contains("coulomb_friction"), "{inspected}");
    let told = dir.succeed(&format!("drive --to {to} adaptation --commit")).stdout;
    assert!(told.contains("adapted parameters are in force") && told.contains("sequence 2"), "{told}");
    assert!(dir.succeed(&format!("drive --to {to} status")).stdout.contains("as stored: sequence 2"));
    // What is in force now is the beginning of another adaptation.
    let now = learnt();
    assert!(now["taken_over"] == false && now["stretches"].as_u64() < Some(5), "{now}");
    let stored = now["coefficients"][0]["block"].as_f64().expect("c1");
    assert!((stored - shadow).abs() < 3.0 * sd, "{stored} was stored, {shadow} learnt");
}

mod time {
    use gmhm::link::message::SAVE;
    use gmhm::link::{Answer, Origin, Receiver, Refusal, Request, Status, Tag};
    use gmhm_tools::device::virtual_drive::VirtualDrive;

    /// One request and the body of its answer.
    fn ask(drive: &mut VirtualDrive, request: Request<'_>, tag: Tag) -> Vec<u8> {
        let answer = drive.receive(&request.encode(tag)).expect("an answer");
        let mut receiver = Receiver::new();
        answer.iter().find_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).expect("a body")
    }

    fn session(drive: &mut VirtualDrive, tag: Tag) -> Result<u32, Refusal> {
        match Answer::decode(&ask(drive, Request::Identify, tag)) {
            Some((_, _, Answer::Identified(it))) => Ok(it.session),
            Some((_, _, Answer::Refused(refused))) => Err(refused.refusal),
            other => panic!("{other:?}"),
        }
    }

    fn status(drive: &mut VirtualDrive) -> Status {
        match Answer::decode(&ask(drive, Request::Status, Tag::default())) {
            Some((_, _, Answer::Status(it))) => it,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_trial_expires_and_a_session_is_its_hosts() {
        let dir = super::bench();
        let mut block = std::fs::read(dir.path("params.bin")).expect("a block");
        gmhm::block::stamp(&mut block, 1).expect("a block");
        let crc = gmhm::block::verify(&block).expect("a block").crc();
        let mut drive = VirtualDrive::new(7).expect("a drive");
        let mut tag = Tag { session: session(&mut drive, Tag::default()).expect("a session"), turn: 0 };
        let mut tell = |drive: &mut VirtualDrive, request: Request<'_>| {
            let body = ask(drive, request, tag);
            tag.turn += 1;
            let (_, _, answer) = Answer::decode(&body).expect("an answer");
            assert!(!matches!(answer, Answer::Refused(_)), "{request:?}: {answer:?}");
        };
        tell(&mut drive, Request::Stage { length: block.len() as u32, crc });
        for (k, bytes) in block.chunks(128).enumerate() {
            tell(&mut drive, Request::Data { offset: 128 * k as u32, bytes });
        }
        tell(&mut drive, Request::Try);
        drive.advance(0.5);
        assert_eq!(session(&mut drive, Tag::default()), Err(Refusal::Busy));
        tell(&mut drive, Request::Close);
        let other = session(&mut drive, Tag::default()).expect("a session after the other was closed");
        let commit = Request::Commit { signature: SAVE, crc };
        let late = ask(&mut drive, commit, tag);
        assert!(matches!(Answer::decode(&late), Some((_, _, Answer::Refused(it))) if it.refusal == Refusal::Session));
        assert_eq!(status(&mut drive).origin, Origin::Trial);
        for _ in 0..61 {
            drive.advance(1.0);
        }
        assert_eq!(status(&mut drive).origin, Origin::Nowhere);
        assert_ne!(session(&mut drive, Tag::default()), Ok(other));
    }
}
