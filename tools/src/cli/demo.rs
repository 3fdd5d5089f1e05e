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
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm demo --out gmhm-demo")]
pub struct DemoArgs {
    /// Folder for the recording, the model and the plots
    #[arg(long, value_name = "DIR", default_value = "gmhm-demo")]
    out: PathBuf,
    #[command(flatten)]
    seed: SeedArgs,
}

impl Default for DemoArgs {
    fn default() -> Self {
        DemoArgs { out: "gmhm-demo".into(), seed: SeedArgs::default() }
    }
}

impl DemoArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let demo = demo::run(self.seed.seed, &Progress::new("Fitting", Progress::WHOLE, session.quiet))?;
        Outputs::make_folder(&self.out)?;
        let mut outputs = Outputs::new();
        outputs.add(&self.out.join("recording.csv"), |out| Ok::<_, Failure>(demo.built_in.recording.write(out)?))?;
        outputs.add_text(&self.out.join("model.toml"), &demo.fit.model.to_toml())?;
        for (name, svg) in demo.plots() {
            outputs.add_text(&self.out.join(name), &svg.to_file())?;
        }
        outputs.commit()?;
        session.say(format_args!("{demo}"))?;
        session.say(format_args!(
            "\nRecording, model and plots (loop.svg, decomposition.svg, residual.svg) are in {}.\n",
            self.out.display()
        ))?;
        Ok(())
    }
}
