//! `gmhm flash`.

use std::path::PathBuf;

use clap::Args;
use gmhm::block::verify;

use super::Session;
use super::common::address;
use super::failure::Failure;
use super::progress::Progress;
use crate::block::read;
use crate::device::probe::{self, Elf, ProbeError};
use crate::device::{self, Client, DeviceError, Flashed, Target, key, line};
use crate::output::Outputs;

/// Write a parameter block into a drive, read it back and compare
///
/// The block is staged in the drive's RAM, checked there, stored and read back. It gets the sequence number that follows the drive's newest block.
/// The drive rejects the block if it is enabled, if it is for another gear, or if its arithmetic differs. The stored block stays intact if the line or the power fails.
///
/// With a debug probe (gmhm built with --features probe) the flash of the chip is written directly, at --address or at the symbols of --elf. Each block needs its own
/// erase sectors. Of two addresses the one without the newest block is written. The probe halts and restarts the core: switch the power stage off first.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmhm flash params.bin --to serial:/dev/ttyUSB0\n  gmhm flash params.bin --to tcp:localhost:5000\n  gmhm flash params.bin --to probe:nRF51822_xxAA --elf firmware.elf"
)]
pub struct FlashArgs {
    /// The block, .bin or .hex
    #[arg(value_name = "params.bin")]
    block: PathBuf,
    /// The drive: serial:PORT, tcp:HOST:PORT, probe or probe:CHIP
    #[arg(long, value_name = "TARGET")]
    to: Target,
    /// Speed of a serial port
    #[arg(long, value_name = "RATE", default_value = "115200")]
    baud: u32,
    /// The drive's key, 64 hexadecimal digits, if it has one
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// With a probe: address of the firmware's block in flash, or of both blocks
    #[arg(long, value_name = "ADDRESS[,ADDRESS]", value_parser = address, value_delimiter = ',', conflicts_with = "elf")]
    address: Vec<u32>,
    /// With a probe: the firmware; its symbols give the addresses
    #[arg(long, value_name = "FIRMWARE.elf")]
    elf: Option<PathBuf>,
    /// Names of these symbols
    #[arg(long, value_name = "NAME[,NAME]", value_delimiter = ',', default_value = "gmhm_slot_a,gmhm_slot_b")]
    symbol: Vec<String>,
    /// Also write the block that was read back
    #[arg(long, value_name = "F.bin")]
    read_back: Option<PathBuf>,
}

impl FlashArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        if let Some(path) = &self.read_back {
            Outputs::check(path)?;
        }
        let block = read(&self.block)?.bytes;
        let flashed = self.flash(&block, session)?;
        if let Some(path) = &self.read_back {
            let mut outputs = Outputs::new();
            outputs.add_contents(path, &flashed.bytes)?;
            outputs.commit()?;
        }
        let gear = verify(&flashed.bytes).map_err(DeviceError::from)?.header().identity;
        session.say(format_args!(
            "{}: stored and read back {} bytes for gear \"{}\", sequence {}, CRC-32 {:#010x}\n",
            self.to,
            flashed.bytes.len(),
            gear.label(),
            flashed.sequence,
            flashed.crc
        ))?;
        Ok(())
    }

    fn flash(&self, block: &[u8], session: &Session) -> Result<Flashed, Failure> {
        let progress = Progress::new("flashing", 2 * block.len() as u64, session.quiet);
        let at = |done, _| progress.at(done as u64);
        let Target::Probe(chip) = &self.to else {
            if self.elf.is_some() || !self.address.is_empty() {
                super::wrong_usage("--address and --elf are for a debug probe: --to probe:CHIP");
            }
            let key = self.key.as_deref().map(key::read).transpose()?;
            let open = || Ok(Client::new(line::open(&self.to, self.baud)?).with_key(key));
            return Ok(device::flash(block, open, at)?);
        };
        let firmware = self.elf.as_deref().map(Elf::load).transpose().map_err(DeviceError::from)?;
        let places = self.places(firmware.as_ref()).map_err(DeviceError::from)?;
        Ok(probe::flash_attached(block, &places, firmware.as_ref(), chip.as_deref(), at)?)
    }

    fn places(&self, firmware: Option<&Elf>) -> Result<Vec<u64>, ProbeError> {
        match firmware {
            Some(elf) => self.symbol.iter().map(|name| elf.address(name)).collect(),
            None if self.address.is_empty() => {
                super::wrong_usage("a debug probe needs the address of the blocks in flash: --address or --elf")
            }
            None => Ok(self.address.iter().copied().map(u64::from).collect()),
        }
    }
}
