//! `gmhm flash` against a drive behind a TCP port: the core's own port over a RAM-backed store.

mod common;

use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use common::{PUBLISHED, WorkDir};
use gmhm::block::{Block, BlockError, Identity, Parameters, ScalarKind};
use gmhm::link::{Drive, Live, Port};
use gmhm::store::{RamFlash, Store};

/// A gear with a term.
fn model() -> String {
    PUBLISHED.to_owned() + "[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.4\nsmoothing_rad_per_s = 0.01\n"
}

const SLOT: u32 = 1024;

/// A drive that loads blocks as firmware does.
#[derive(Debug, Clone, Default)]
struct Joint {
    parameters: Option<Parameters>,
    gear: Identity,
    enabled: bool,
    compensating: bool,
}

impl Drive for Joint {
    fn gear(&self) -> Identity {
        self.gear
    }
    fn arithmetic(&self) -> (ScalarKind, u16) {
        (ScalarKind::F32, 16)
    }
    fn is_enabled(&self) -> bool {
        self.enabled
    }
    fn adopt(&mut self, block: Option<&Block<'_>>) -> Result<(), BlockError> {
        self.parameters = block.map(|block| Parameters::of_block(block, 16)).transpose()?;
        Ok(())
    }
    fn is_compensating(&self) -> bool {
        self.compensating
    }
    fn compensate(&mut self, on: bool) {
        self.compensating = on;
    }
    fn gain_ratio(&self) -> f32 {
        1.0
    }
    fn set_gain_ratio(&mut self, _: f32) {}
    fn live(&self) -> Live {
        Live::default()
    }
}

/// An accident of the line.
#[derive(Debug, Clone, Copy)]
enum Accident {
    /// The connection breaks after so many bytes from the host.
    BreaksAfter(usize),
    /// The answer with this number, counted from 1 over all connections, never arrives.
    SwallowsAnswer(usize),
    /// So many bytes from the host arrive with a bit flipped.
    FlipsByte(usize),
}

/// A drive behind a TCP port that serves so many connections; what it holds afterwards.
struct Served {
    address: String,
    thread: JoinHandle<()>,
    joint: Arc<Mutex<Joint>>,
    memory: Arc<Mutex<Vec<u8>>>,
}

fn serve(joint: Joint, memory: Vec<u8>, connections: usize, accident: Option<Accident>) -> Served {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let (joint, memory) = (Arc::new(Mutex::new(joint)), Arc::new(Mutex::new(memory)));
    let (shared, flash) = (joint.clone(), memory.clone());
    let thread = std::thread::spawn(move || {
        let mut memory = flash.lock().expect("the memory");
        let store = Store::new(RamFlash::<4, 1024>::new(&mut memory), 0..SLOT, SLOT..2 * SLOT).expect("two slots");
        let mut port = Port::<_, 1024>::new(store, 99);
        port.boot(&mut *shared.lock().expect("the joint"));
        let (mut heard, mut answered) = (0, 0);
        for stream in listener.incoming().take(connections) {
            let mut stream = stream.expect("a connection");
            let mut buffer = [0; 64];
            while let Ok(count @ 1..) = stream.read(&mut buffer) {
                let mut bytes = buffer[..count].to_vec();
                heard += count;
                match accident {
                    Some(Accident::BreaksAfter(limit)) if heard - count < limit && heard >= limit => break,
                    Some(Accident::FlipsByte(place)) if (heard - count..heard).contains(&place) => {
                        bytes[place - (heard - count)] ^= 0x10;
                    }
                    _ => {}
                }
                let mut answers = Vec::new();
                port.receive(&bytes, &mut *shared.lock().expect("the joint"), |frame| answers.push(frame.to_vec()));
                for answer in answers {
                    answered += 1;
                    if !matches!(accident, Some(Accident::SwallowsAnswer(k)) if k == answered) {
                        let _ = stream.write_all(&answer);
                    }
                }
            }
        }
    });
    Served { address, thread, joint, memory }
}

impl Served {
    fn end(self) -> (Joint, Vec<u8>) {
        self.thread.join().expect("the drive");
        let joint = self.joint.lock().expect("the joint").clone();
        let memory = self.memory.lock().expect("the memory").clone();
        (joint, memory)
    }
}

fn blank() -> Vec<u8> {
    vec![0xFF; 2 * SLOT as usize]
}

fn packed(dir: &WorkDir) {
    dir.write("gear.toml", model());
    dir.succeed("pack gear.toml -o params.bin");
}

#[test]
fn a_block_is_stored_and_read_back() {
    let dir = WorkDir::new();
    packed(&dir);
    let served = serve(Joint { compensating: true, ..Joint::default() }, blank(), 2, None);
    let to = format!("flash params.bin --to tcp:{} --read-back back.bin", served.address);
    let first = dir.succeed(&to).stdout;
    assert!(first.contains("for gear \"published\", sequence 1"), "{first}");
    assert!(dir.succeed(&to).stdout.contains("sequence 2"));
    let (joint, _) = served.end();
    let parameters = joint.parameters.expect("parameters in force");
    assert_eq!((parameters.header.sequence, parameters.terms.terms().len()), (2, 1));
    assert!(joint.compensating, "the compensation is on again");

    // What was read back is what was packed, but for the sequence number and with it the CRC-32.
    let lines = |file: &str| -> Vec<String> {
        let text = dir.succeed(&format!("inspect {file}")).stdout;
        text.lines().filter(|line| !line.contains("sequence") && !line.contains("CRC-32")).map(str::to_owned).collect()
    };
    assert_eq!(lines("back.bin"), lines("params.bin"));
    assert!(lines("params.bin").len() > 10);
    let [packed, back] = ["params.bin", "back.bin"].map(|file| std::fs::read(dir.path(file)).expect("a block"));
    let differing: Vec<_> = packed.iter().zip(&back).enumerate().filter(|(_, (a, b))| a != b).map(|(k, _)| k).collect();
    assert_eq!(packed.len(), back.len());
    assert!(differing.iter().all(|k| (12..16).contains(k) || *k >= packed.len() - 4), "{differing:?}");
}

#[test]
fn a_broken_line_is_started_over() {
    let dir = WorkDir::new();
    packed(&dir);
    for accident in [
        Accident::BreaksAfter(10),
        Accident::BreaksAfter(150),
        Accident::BreaksAfter(260),
        Accident::FlipsByte(100),
        Accident::SwallowsAnswer(2),
        // The answer to the commit: the block is stored, and the second attempt finds it there.
        Accident::SwallowsAnswer(7),
    ] {
        let served = serve(Joint::default(), blank(), 2, Some(accident));
        let told = dir.succeed(&format!("flash params.bin --to tcp:{}", served.address)).stdout;
        assert!(told.contains("sequence 1"), "{accident:?}: {told}");
        let (joint, _) = served.end();
        assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1), "{accident:?}");
    }
}

#[test]
fn refusals_are_told_and_leave_the_drive_as_it_was() {
    let dir = WorkDir::new();
    packed(&dir);
    let served = serve(Joint::default(), blank(), 1, None);
    dir.succeed(&format!("flash params.bin --to tcp:{}", served.address));
    let (joint, memory) = served.end();

    dir.succeed("pack gear.toml --gear other -o other.bin");
    dir.succeed("pack gear.toml --stack-depth 32 -o deep.bin");
    for (joint, block, told) in [
        (Joint { enabled: true, ..joint.clone() }, "params.bin", "the drive is enabled"),
        (joint.clone(), "other.bin", "for gear \"other\", and the drive is on gear \"published\""),
        (joint.clone(), "deep.bin", "32 turning points, and the drive has room for 16"),
    ] {
        let served = serve(joint, memory.clone(), 1, None);
        dir.refuse(&format!("flash {block} --to tcp:{}", served.address), &[told, "help: "]);
        let (joint, after) = served.end();
        assert_eq!(joint.parameters.map(|parameters| parameters.header.sequence), Some(1));
        assert_eq!(after, memory);
    }
}

#[test]
fn a_target_that_is_not_there_is_named() {
    let dir = WorkDir::new();
    packed(&dir);
    let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let unreachable = format!("tcp:{free}: cannot be opened");
    dir.refuse(&format!("flash params.bin --to tcp:{free}"), &[&unreachable, "help: "]);
    dir.refuse("flash params.bin --to serial:/no/such/port", &["serial:/no/such/port: cannot be opened", "help: "]);
    dir.write("no.bin", "no block");
    dir.refuse("flash no.bin --to tcp:localhost:1", &["no.bin"]);
    assert_eq!(dir.gmhm("flash params.bin --to nowhere").status, Some(2));
}
