//! A simulated drive on this computer: the core, its store and its link, to try `gmhm flash`, `drive` and `simulate --drive` without hardware.
//!
//! | file | what |
//! |---|---|
//! | [`chip`] | the flash of the drive, whose power can be cut |
//! | [`machine`] | the gear under a slow oscillating load, computed by the core in `f32` |
//! | [`listen`] | where it listens |
//! | [`serve`] | the line: a TCP port or a pseudo-terminal |
//!
//! A line carries both protocols: [`gmhm::link`] and [`gmhm::drive::lockstep`].

pub mod chip;
pub mod listen;
pub mod machine;
pub mod serve;

use gmhm::drive::lockstep;
use gmhm::link::frame::{self, Receiver};
use gmhm::link::lock::{Key, PROOF_BYTES};
use gmhm::link::{Drive, Port};
use gmhm::store::{PlaceError, Store};

use chip::{Chip, SLOTS};
use machine::Machine;

/// The most bytes of a block.
const ROOM: usize = 1024;

/// Bytes of a start of lock-step: kind, flags, four counts, fifteen numbers.
const START_BYTES: usize = 2 + 4 * 4 + 15 * 8;
/// Bytes of a period of lock-step.
const PERIOD_BYTES: usize = 1 + 8 + 4 * 4;

/// What is in force on a drive, for its log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InForce {
    /// Sequence number of the block; `None` where nothing is in force.
    pub sequence: Option<u32>,
    /// Whether the power stage is on.
    pub enabled: bool,
    /// Whether the compensation is on.
    pub compensating: bool,
    /// The share that is fed forward.
    pub gain_ratio: f32,
}

/// A simulated drive.
pub struct VirtualDrive {
    chip: Chip,
    port: Port<Chip, ROOM>,
    machine: Machine,
    receiver: Receiver,
    lockstep: lockstep::Drive,
    in_lockstep: bool,
    nonce: u32,
    restarts: u32,
    waiting_ms: f64,
    lock: Option<(Key, [u8; PROOF_BYTES])>,
}

/// The link of a drive that has just got power.
fn port(chip: &Chip, nonce: u32) -> Result<Port<Chip, ROOM>, PlaceError> {
    let [a, b] = SLOTS;
    Ok(Port::new(Store::new(chip.clone(), a, b)?, nonce))
}

impl VirtualDrive {
    /// A drive whose flash is erased. `nonce` should differ from run to run: it distinguishes sessions.
    ///
    /// # Errors
    /// [`PlaceError`]: the slots do not fit the flash.
    pub fn new(nonce: u32) -> Result<Self, PlaceError> {
        let chip = Chip::erased();
        let mut drive = Self {
            port: port(&chip, nonce)?,
            chip,
            machine: Machine::default(),
            receiver: Receiver::new(),
            lockstep: lockstep::Drive::default(),
            in_lockstep: false,
            nonce,
            restarts: 0,
            waiting_ms: 0.0,
            lock: None,
        };
        drive.port.boot(&mut drive.machine);
        Ok(drive)
    }

    /// The same with a key. `entropy` should be random.
    ///
    /// # Errors
    /// As [`restart`](Self::restart).
    pub fn with_key(mut self, key: Key, entropy: [u8; PROOF_BYTES]) -> Result<Self, PlaceError> {
        self.lock = Some((key, entropy));
        self.restart()?;
        self.restarts = 0;
        Ok(self)
    }

    /// The same with a gear that warms within so many seconds from the start of its parameters on: its stiffness falls by 10 %, its hysteresis grows by 20 %.
    #[must_use]
    pub fn warming(mut self, seconds: f32) -> Self {
        self.machine.warms_s = Some(seconds);
        self
    }

    /// Takes bytes from the line and returns the bytes to answer. A power cut in the middle of a write leaves the host without an answer, and the drive restarts.
    ///
    /// # Errors
    /// As [`restart`](Self::restart).
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<u8>, PlaceError> {
        let mut answers = Vec::new();
        for byte in bytes {
            let Some(body) = self.receiver.feed(*byte) else { continue };
            let starts = body.first() == Some(&1) && body.len() == START_BYTES && body.get(1).is_some_and(|f| *f < 4);
            self.in_lockstep = starts || (self.in_lockstep && body.len() == PERIOD_BYTES);
            if self.in_lockstep {
                answers.extend(self.lockstep.answer(body).iter().flat_map(|answer| frame::encode(answer).to_vec()));
                continue;
            }
            let before = answers.len();
            let frame = frame::encode(body);
            self.port.receive(&frame, &mut self.machine, |answer| answers.extend_from_slice(answer));
            if !self.chip.is_powered() {
                answers.truncate(before);
                self.restart()?;
            }
        }
        Ok(answers)
    }

    /// Lets so many seconds pass: a trial or a session may end, and control periods pass, at most those of one second.
    pub fn advance(&mut self, seconds: f64) {
        self.machine.advance(seconds);
        self.waiting_ms += 1e3 * seconds;
        let whole = self.waiting_ms.floor();
        self.waiting_ms -= whole;
        // Beyond what fits, a trial is over in any case.
        self.port.elapse(whole as u32, &mut self.machine);
    }

    /// Cuts the power and switches it on again: what was in RAM is lost, the newest whole block in flash is in force.
    ///
    /// # Errors
    /// [`PlaceError`]: the slots do not fit the flash.
    pub fn restart(&mut self) -> Result<(), PlaceError> {
        self.chip.switch_on();
        self.restarts = self.restarts.wrapping_add(1);
        self.nonce = self.nonce.wrapping_mul(0x0019_660D).wrapping_add(0x3C6E_F35F);
        self.port = port(&self.chip, self.nonce)?;
        if let Some((key, mut entropy)) = self.lock {
            // No two power-ups have the same.
            entropy.iter_mut().zip(self.restarts.to_le_bytes()).for_each(|(byte, count)| *byte ^= count);
            self.port = port(&self.chip, self.nonce)?.with_lock(key, entropy);
        }
        let warms_s = self.machine.warms_s;
        self.machine = Machine::default();
        self.machine.warms_s = warms_s;
        self.receiver = Receiver::new();
        self.lockstep = lockstep::Drive::default();
        self.in_lockstep = false;
        self.port.boot(&mut self.machine);
        Ok(())
    }

    /// Cuts the power in the middle of the next write to the flash.
    pub fn cut_in_next_write(&mut self) {
        self.chip.cut_in_next_write();
    }

    /// Switches the power stage on or off.
    pub fn switch_enabled(&mut self) {
        self.machine.enabled = !self.machine.enabled;
    }

    /// How often the power was cut.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// What is in force.
    pub fn in_force(&self) -> InForce {
        InForce {
            sequence: self.machine.sequence(),
            enabled: self.machine.enabled,
            compensating: self.machine.compensation().on,
            gain_ratio: self.machine.compensation().gain_ratio,
        }
    }
}
