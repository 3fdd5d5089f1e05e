//! `gmhm demo`.

use std::path::PathBuf;

use clap::Args;

use super::Session;
use super::common::SeedArgs;
use super::failure::Failure;
use super::progress::Progress;
use crate::demo;
use crate::output::Outputs;

/// Run the whole chain on a built-in recording: identify, write the model, evaluate it as the drive would
///
/// The recording is synthetic: the published gear with noise on its torque. Prints the torque error beside that of a linear spring and two lines,
/// and the tables of the paper next to what is measured.
#[derive(Debug, Default, Args)]
#[command(after_help = "Example:\n  gmhm demo --out gmhm-demo")]
pub struct DemoArgs {
    /// Folder for the recording, the model and the plots; existing files are replaced [default: gmhm-demo, existing files are kept]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    seed: SeedArgs,
}

/// The folder that nobody named.
const FOLDER: &str = "gmhm-demo";

impl DemoArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let demo = demo::run(self.seed.seed, &Progress::new("Fitting", Progress::WHOLE, session.quiet))?;
        let folder = self.out.clone().unwrap_or_else(|| FOLDER.into());
        Outputs::make_folder(&folder)?;
        let mut recording = Vec::new();
        demo.built_in.recording.write(&mut recording)?;
        let mut files = vec![("recording.csv", recording), ("model.toml", demo.fit.model.to_toml().into_bytes())];
        files.extend(demo.plots().into_iter().map(|(name, svg)| (name, svg.to_file().into_bytes())));
        let differs = |(name, bytes): &&(&str, Vec<u8>)| {
            let path = folder.join(name);
            path.exists() && std::fs::read(path).ok().as_ref() != Some(bytes)
        };
        let other = files.iter().find(differs).filter(|_| self.out.is_none()).map(|(name, _)| folder.join(name));
        session.say(format_args!("{demo}"))?;
        if let Some(other) = other {
            session.note(&format!(
                "{} differs from the demo's; the files in {} were kept: gmhm demo --out {} replaces them",
                other.display(),
                folder.display(),
                folder.display()
            ));
            return Ok(());
        }
        let mut outputs = Outputs::new();
        for (name, bytes) in &files {
            outputs.add_contents(&folder.join(name), bytes)?;
        }
        outputs.commit()?;
        session.say(format_args!(
            "\nRecording, model and plots (loop.svg, decomposition.svg, residual.svg) are in {}.\n",
            folder.display()
        ))
    }
}
