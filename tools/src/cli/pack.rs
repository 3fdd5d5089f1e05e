//! `gmhm pack`.

use std::path::{Path, PathBuf};

use clap::Args;
use gmhm::block::{GEAR, Identity, verify};
use gmhm::terms::Side;

use super::Session;
use super::common::{address, depth, positive};
use super::failure::Failure;
use super::files::Files;
use crate::block::{self, Arithmetic, FileError, Form, PackOptions};
use crate::model;
use crate::output::Outputs;

/// Make the parameter block of a model, ready for a drive
///
/// The ending of the output selects the format: .bin is the bytes, .hex is Intel HEX at --address, .h is an array for C.
/// The block contains the normalised coefficients that the drive computes with, a checksum, and the gear it is for.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm pack gear.toml --period 0.0001 -o params.bin\n  gmhm inspect params.bin")]
pub struct PackArgs {
    /// Model file
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// Arithmetic of the drive
    #[arg(long, value_enum, default_value_t)]
    scalar: Arithmetic,
    /// Control period of the drive; required for law time
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = positive)]
    period: Option<f64>,
    /// Top speed of the deflection, rad/s: faster samples are quarantined; requires --period
    #[arg(long, value_name = "RAD_PER_S", allow_negative_numbers = true, value_parser = positive)]
    top_speed: Option<f64>,
    /// Gear that the block is for, at most 16 bytes [default: the model's name]
    #[arg(long, value_name = "LABEL", value_parser = identity)]
    gear: Option<Identity>,
    /// Turning points that the drive has room for, even, 4 or more
    #[arg(long, value_name = "N", value_parser = depth, default_value = "16")]
    stack_depth: u16,
    /// Address of the block in Intel HEX, such as 0x3F000
    #[arg(long, value_name = "ADDRESS", value_parser = address, default_value = "0")]
    address: u32,
    /// Rated deflection in rad [default: the model's]
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, value_parser = positive)]
    rated_deflection: Option<f64>,
    /// Also write the object dictionary of the drive as an electronic data sheet for CANopen tools (CiA 306)
    #[arg(long, value_name = "FILE.eds")]
    eds: Option<PathBuf>,
    /// Where to write the block
    #[arg(short, long, value_name = "params.bin|.hex|.h")]
    output: PathBuf,
}

fn identity(label: &str) -> Result<Identity, String> {
    Identity::new(label).ok_or_else(|| "must have at most 16 bytes".to_owned())
}

impl PackArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let form = Form::of(&self.output)?;
        Outputs::check(&self.output)?;
        self.eds.as_deref().map_or(Ok(()), Outputs::check)?;
        let model = model::load(&self.model)?;
        let options = PackOptions {
            arithmetic: self.scalar,
            period_s: self.period,
            top_speed_rad_per_s: self.top_speed,
            rated_deflection_rad: self.rated_deflection,
            identity: self.gear,
            stack_depth: Some(self.stack_depth),
        };
        let packed = block::pack(&model, &options)?;
        let refused = |error| FileError::Block { path: self.output.clone(), error };
        let block = verify(&packed.bytes).map_err(refused)?;
        let bytes = block::write(form, &self.output, &block, self.address)?;

        let mut files = Files::new(session);
        files.add("Block", Some(&self.output), || Ok(&bytes))?;
        files.add("Data sheet", self.eds.as_ref(), || {
            let name = self.eds.as_deref().and_then(Path::file_name).unwrap_or_default();
            Ok(block::eds(&name.to_string_lossy()))
        })?;
        files.finish(format_args!(
            "Block of gear \"{}\", {} bytes, CRC-32 {:#010x}\n",
            block.header().identity.label(),
            packed.bytes.len(),
            block.crc()
        ))?;
        if let Some(why) = &packed.without_inverse {
            session.note(&format!("the drive can predict but not invert: {why}"));
        }
        if self.top_speed.is_none() && block.records().any(|record| record.tag == GEAR.tag) {
            session.note(
                "the block sets no gate on samples: a misread encoder moves the gear's path; set --top-speed and --period",
            );
        }
        for term in &model.terms {
            if term.info().is_some_and(|info| info.side == Side::Instrument) {
                session.note(&format!("`{}` is a measurement fault: drives do not feed it forward", term.kind));
            }
        }
        Ok(())
    }
}
