//! Why a drive was not reached, or did not do what it was asked.

use gmhm::block::{BlockError, Identity};
use gmhm::link::{Refusal, Refused};
use gmhm::store::PlaceError;

use super::probe::ProbeError;
use super::target::Target;
use super::virtual_drive::listen::Listen;

/// Whatever may go wrong between host and drive.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// No line to it.
    #[error("{target}: cannot be opened: {error}")]
    Unreachable {
        /// The target.
        target: Target,
        /// Why.
        error: std::io::Error,
    },
    /// A simulated drive without a line.
    #[error("{listen}: cannot listen there: {error}")]
    NotListening {
        /// Where.
        listen: Listen,
        /// Why.
        error: std::io::Error,
    },
    /// A simulated drive without a store.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// A debug probe has no line to the firmware.
    #[error("a debug probe writes flash and cannot communicate with the firmware")]
    NoLine,
    /// This program was built without debug probes.
    #[error("this gmhm was built without debug probes")]
    NoProbe,
    /// The line broke.
    #[error("the connection to the drive failed: {0}")]
    Line(#[from] std::io::Error),
    /// The other end hung up.
    #[error("the drive closed the connection")]
    Closed,
    /// No answer.
    #[error("the drive did not answer within {0} s")]
    Silent(u64),
    /// An answer that makes no sense.
    #[error("the drive's answer is not understood: the drive may use a newer version of the link")]
    NotUnderstood,
    /// The drive refused.
    #[error("the drive refused: {}{}", refused.refusal, detail(*refused))]
    Refused {
        /// The command.
        command: u8,
        /// Why.
        refused: Refused,
    },
    /// The block is for another gear.
    #[error("the block is for gear \"{}\", but the drive has gear \"{}\"", block.label(), drive.label())]
    OtherGear {
        /// That of the block.
        block: Identity,
        /// That of the drive.
        drive: Identity,
    },
    /// The drive computes in another arithmetic.
    #[error("the block is for {block}, but the drive computes in {drive}")]
    OtherScalar {
        /// That of the block.
        block: &'static str,
        /// That of the drive.
        drive: &'static str,
    },
    /// The block asks for more than the drive has.
    #[error("the block needs {needed} {what}, but the drive has room for {room}")]
    TooLarge {
        /// Bytes or turning points.
        what: &'static str,
        /// What it takes.
        needed: u32,
        /// What there is.
        room: u32,
    },
    /// The drive is enabled.
    #[error("the drive is enabled: storing parameters would stall its control loop")]
    Enabled,
    /// What was read back is not what was sent.
    #[error("byte {offset} reads back as {found:#04x}, but {expected:#04x} was written")]
    ReadBack {
        /// The first byte that differs.
        offset: usize,
        /// What was sent.
        expected: u8,
        /// What came back.
        found: u8,
    },
    /// A key that cannot be read.
    #[error("{}: {problem}", path.display())]
    Key {
        /// Its file.
        path: std::path::PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The bytes are no block.
    #[error(transparent)]
    Block(#[from] BlockError),
    /// A debug probe, or the place of the block in the chip behind it.
    #[error(transparent)]
    Probe(#[from] ProbeError),
}

fn refusal_mend(refusal: Refusal) -> Option<String> {
    let fix = match refusal {
        Refusal::Compensating => "switch the compensation off with gmhm drive --to TARGET off, then repeat",
        Refusal::OnTrial => "end the trial with gmhm drive --to TARGET revert, or store it with commit, then repeat",
        Refusal::NotOnTrial => "try a block first: gmhm drive --to TARGET try params.bin",
        Refusal::NoParameters => "store a block first: gmhm flash params.bin --to TARGET",
        Refusal::Bound => {
            "disable the drive, or widen the bound while it is disabled: gmhm drive --to TARGET bound SHARE"
        }
        Refusal::Unreadable => {
            "switch the drive off and on, then repeat; if the error remains, erase the slot with gmhm drive --to TARGET erase-unreadable: a block in it is lost"
        }
        Refusal::Locked => "give the drive's key with --key FILE",
        Refusal::Busy => "end the other program that is connected to the drive, then repeat",
        _ => return None,
    };
    Some(fix.to_owned())
}

fn detail(refused: Refused) -> String {
    if refused.detail == 0 { String::new() } else { format!(" (code {:#06x})", refused.detail) }
}

impl DeviceError {
    /// Whether another attempt may help: the line failed, not the drive.
    pub fn is_of_the_line(&self) -> bool {
        matches!(self, Self::Line(_) | Self::Closed | Self::Silent(_))
            || matches!(self, Self::Refused { refused, .. } if matches!(refused.refusal, Refusal::Session | Refusal::Order))
    }

    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::Unreachable { target: Target::Serial(_), .. } => {
                "give the system's name of the serial port, and close other programs that use it"
            }
            Self::Unreachable { .. } => "check host and port, and that the drive or its bridge is listening",
            Self::NotListening { .. } => "choose another port; port 0 takes a free one",
            Self::NoLine => "give the drive's connection: serial:PORT or tcp:HOST:PORT",
            Self::NoProbe => {
                "build gmhm with `--features probe`, use serial: or tcp:, or write the file of gmhm pack -o params.hex --address ADDRESS with the tool of the probe"
            }
            Self::Line(_) | Self::Closed | Self::Silent(_) => {
                "check cable, power and --baud; the stored block is unchanged or completely replaced"
            }
            Self::Enabled => "disable the drive, then flash again",
            Self::OtherGear { .. } => "if it is the right gear, pack the block with the drive's label: --gear LABEL",
            Self::OtherScalar { drive, .. } => return Some(format!("pack the block with --scalar {drive}")),
            Self::TooLarge { what: "bytes", .. } => "pack a model with fewer terms",
            Self::TooLarge { .. } => "pack the block with a smaller --stack-depth",
            Self::ReadBack { .. } => "flash again; if the error remains, the drive's flash is worn out",
            Self::Probe(error) => return error.fix(),
            Self::Refused { refused, .. } => return refusal_mend(refused.refusal),
            Self::Key { .. } => "make a key with: openssl rand -hex 32 > drive.key",
            Self::NotUnderstood | Self::Block(_) | Self::Place(_) => return None,
        };
        Some(text.to_owned())
    }
}
