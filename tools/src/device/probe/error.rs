//! Why a block did not get into a chip through a debug probe.

use std::path::PathBuf;

use super::sector::Range;

/// Whatever may go wrong with a probe, a chip or the place of a block.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// A file cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A file is no ELF file.
    #[error("{}: is not an ELF file: {error}", path.display())]
    NoElf {
        /// The file.
        path: PathBuf,
        /// Why.
        error: object::Error,
    },
    /// The firmware has no such symbol.
    #[error("{}: has no symbol `{symbol}`", path.display())]
    NoSymbol {
        /// The file.
        path: PathBuf,
        /// The symbol.
        symbol: String,
        /// One of nearly that name.
        nearest: Option<String>,
    },
    /// Neither one place nor two.
    #[error("{0} addresses for blocks: firmware has one block, or two of which the newest is used")]
    Places(usize),
    /// There is no flash.
    #[error("the chip has no flash for the block at {0:#x}")]
    NoFlash(u64),
    /// A place does not begin a sector.
    #[error("{address:#x} is not the start of an erase sector: it lies in the sector from {:#x} to {:#x}", sector.start, sector.end)]
    Unaligned {
        /// The place.
        address: u64,
        /// Its sector.
        sector: Range,
    },
    /// Both places are in one sector.
    #[error("the two blocks share erase sectors: {:#x} to {:#x} and {:#x} to {:#x}", a.start, a.end, b.start, b.end)]
    OnePlace {
        /// The sectors of the first.
        a: Range,
        /// Those of the second.
        b: Range,
    },
    /// The firmware uses the sectors for something else.
    #[error(
        "{}: its section {section} ({:#x} to {:#x}) lies in the sectors of the block ({:#x} to {:#x}), which are erased",
        path.display(), place.start, place.end, sector.start, sector.end
    )]
    InUse {
        /// The firmware.
        path: PathBuf,
        /// The section.
        section: String,
        /// Where it lies.
        place: Range,
        /// The sectors.
        sector: Range,
    },
    /// No probe is attached.
    #[error("no debug probe is attached")]
    NoneAttached,
    /// More than one is.
    #[error("{} debug probes are attached: {}", .0.len(), .0.join("; "))]
    Several(Vec<String>),
    /// Probe or chip failed.
    #[error("the debug probe failed to {doing}: {error}")]
    Failed {
        /// What it was to do.
        doing: &'static str,
        /// Why.
        error: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl ProbeError {
    /// How to fix it.
    pub fn fix(&self) -> Option<String> {
        let text = match self {
            Self::File { .. } | Self::NoElf { .. } => "give the ELF file of the firmware on the drive",
            Self::NoSymbol { nearest: Some(nearest), .. } => {
                return Some(format!("give the symbol with --symbol; the file has `{nearest}`"));
            }
            Self::NoSymbol { .. } => {
                "give the symbols of the blocks with --symbol A,B, or their addresses with --address"
            }
            Self::Places(_) => "give one address or symbol, or two with a comma between",
            Self::NoFlash(_) => "check the address, and the chip after probe:",
            Self::Unaligned { sector, .. } => {
                return Some(format!("give the block separate sectors, for example from {:#x} on", sector.end));
            }
            Self::OnePlace { .. } | Self::InUse { .. } => {
                "give each block separate erase sectors in the firmware's linker script"
            }
            Self::NoneAttached => {
                "attach it, and check that this user may use it (on Linux: the udev rules of probe-rs)"
            }
            Self::Several(_) => "leave one attached",
            Self::Failed { .. } => "check the wiring, the chip's power and its name after probe:",
        };
        Some(text.to_owned())
    }
}
