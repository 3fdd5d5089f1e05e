//! `gmhm inspect`.

use std::path::PathBuf;

use clap::Args;
use gmhm::block::verify;

use super::Session;
use super::common::json;
use super::failure::Failure;
use super::files::Files;
use crate::block::{Contents, FileError, read};
use crate::output::Outputs;

/// Show what a parameter block holds, in SI units
///
/// Reads .bin and .hex. Damaged, incompatible or invalid blocks are rejected.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm pack gear.toml -o params.bin\n  gmhm inspect params.bin")]
pub struct InspectArgs {
    /// The block
    #[arg(value_name = "params.bin")]
    block: PathBuf,
    /// Where to write the same as JSON
    #[arg(long, value_name = "F.json")]
    json: Option<PathBuf>,
}

impl InspectArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        if let Some(path) = &self.json {
            Outputs::check(path)?;
        }
        let file = read(&self.block)?;
        let refused = |error| FileError::Block { path: self.block.clone(), error };
        let contents = Contents::of(&verify(&file.bytes).map_err(refused)?).map_err(refused)?;
        let mut files = Files::new(session);
        files.add("JSON", self.json.as_ref(), || json(&contents.json()))?;
        files.finish(contents)
    }
}
