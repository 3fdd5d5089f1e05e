//! A drive behind a TCP port, played by the core's own port over a RAM-backed store.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use gmhm::block::{Block, BlockError, Identity, Parameters, ScalarKind, TorqueUnit};
use gmhm::diagnostics::{Diagnostics, Fault, SelfTest};
use gmhm::link::{CompensationSetting, Drive, Live, Port};
use gmhm::store::{RamFlash, Store};

const SLOT: u32 = 1024;

/// A drive that loads blocks as firmware does.
#[derive(Debug, Clone, Default)]
pub struct Joint {
    pub parameters: Option<Parameters>,
    pub gear: Identity,
    pub enabled: bool,
    pub compensation: CompensationSetting,
    pub diagnostics: Diagnostics,
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
        self.parameters =
            block.map(|block| Parameters::of_any_block(block, 16, TorqueUnit::NewtonMetre)).transpose()?;
        Ok(())
    }
    fn compensation(&self) -> CompensationSetting {
        self.compensation
    }
    fn set_compensation(&mut self, compensation: CompensationSetting) {
        self.compensation = compensation;
    }
    fn diagnostics(&self) -> Diagnostics {
        self.diagnostics
    }
    fn clear_diagnostics(&mut self) {
        self.diagnostics.clear();
    }
    fn live(&self) -> Live {
        Live {
            deflection_rad: 2.5e-4,
            torque_nm: -1.5,
            hysteresis_nm: 0.25,
            out_of_range: true,
            ticks: 77,
            ..Live::default()
        }
    }
}

/// Each counter at a number of its own.
pub fn faulty() -> Diagnostics {
    Diagnostics {
        refused: 3,
        out_of_range: 4,
        quarantined: 5,
        restarted: 6,
        saturated: 7,
        merged_pairs: 8,
        last: Fault::Saturated,
        self_test: SelfTest::Passed,
    }
}

/// A compensation that is on.
pub const ON: CompensationSetting = CompensationSetting { on: true, gain_ratio: 1.0 };

/// An accident of the line.
#[derive(Debug, Clone, Copy)]
pub enum Accident {
    /// The connection breaks after so many bytes from the host.
    BreaksAfter(usize),
    /// The answer with this number, counted from 1 over all connections, never arrives.
    SwallowsAnswer(usize),
    /// So many bytes from the host arrive with a bit flipped.
    FlipsByte(usize),
}

/// A drive behind a TCP port that serves so many connections; what it holds afterwards.
pub struct Served {
    pub address: String,
    thread: JoinHandle<()>,
    joint: Arc<Mutex<Joint>>,
    memory: Arc<Mutex<Vec<u8>>>,
}

pub fn serve(joint: Joint, memory: Vec<u8>, connections: usize, accident: Option<Accident>) -> Served {
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
    pub fn end(self) -> (Joint, Vec<u8>) {
        self.thread.join().expect("the drive");
        let joint = self.joint.lock().expect("the joint").clone();
        let memory = self.memory.lock().expect("the memory").clone();
        (joint, memory)
    }
}

pub fn blank() -> Vec<u8> {
    vec![0xFF; 2 * SLOT as usize]
}
