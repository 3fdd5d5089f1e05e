//! `gmhm flash`.

use std::path::PathBuf;

use clap::Args;
use gmhm::block::verify;

use super::Session;
use super::failure::Failure;
use super::progress::Progress;
use crate::block::read;
use crate::device::{self, Flashed, Target, line};
use crate::output::Outputs;

/// Write a parameter block into a drive, read it back and compare
///
/// The block is staged in the drive's RAM, checked there, stored and read back. It gets the sequence number that follows the drive's newest block.
/// A drive that is enabled, on another gear or of another arithmetic refuses; what it had stored stays whole whenever the line or the power breaks.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmhm flash params.bin --to serial:/dev/ttyUSB0\n  gmhm flash params.bin --to tcp:localhost:5000"
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
    /// Write what was read back, too
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
            outputs.add(path, |out| -> Result<(), Failure> { Ok(out.write_all(&flashed.bytes)?) })?;
            outputs.commit()?;
        }
        let gear = verify(&flashed.bytes).map_err(device::DeviceError::from)?.header().identity;
        println!(
            "{}: stored and read back {} bytes for gear \"{}\", sequence {}, CRC-32 {:#010x}",
            self.to,
            flashed.bytes.len(),
            gear.label(),
            flashed.sequence,
            flashed.crc
        );
        Ok(())
    }

    fn flash(&self, block: &[u8], session: &Session) -> Result<Flashed, Failure> {
        let progress = Progress::new("flashing", 2 * block.len() as u64, session.quiet);
        Ok(device::flash(block, || line::open(&self.to, self.baud), |done, _| progress.at(done as u64))?)
    }
}
