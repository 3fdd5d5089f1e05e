//! `gmhm completions`, `gmhm man`.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::failure::Failure;
use super::{Cli, Session};
use crate::output::Outputs;

/// Print the completions for a shell
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gmhm completions bash > ~/.local/share/bash-completion/completions/gmhm
  gmhm completions zsh > ~/.zfunc/_gmhm
  gmhm completions fish > ~/.config/fish/completions/gmhm.fish
  gmhm completions powershell >> $PROFILE")]
pub struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

impl CompletionsArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "gmhm", &mut script);
        session.say(format_args!("{}", String::from_utf8_lossy(&script)))
    }
}

/// Write the manual pages: gmhm.1, and one per command
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  gmhm man ~/.local/share/man/man1")]
pub struct ManArgs {
    /// Folder for the pages; created where it is missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl ManArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let mut command = Cli::command();
        command.build();
        let mut outputs = Outputs::new();
        Outputs::make_folder(&self.folder)?;
        let mut pages = 1;
        self.page(&mut outputs, "gmhm", command.clone())?;
        for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help" && !sub.is_hide_set()) {
            let name: &'static str = format!("gmhm-{}", sub.get_name()).leak();
            self.page(&mut outputs, name, sub.clone().name(name))?;
            pages += 1;
        }
        outputs.commit()?;
        session.say(format_args!("{pages} pages written to {}\n", self.folder.display()))
    }

    fn page(&self, outputs: &mut Outputs, name: &str, command: clap::Command) -> Result<(), Failure> {
        let man = clap_mangen::Man::new(command);
        outputs.add(&self.folder.join(format!("{name}.1")), |out| Ok::<_, Failure>(man.render(out)?))
    }
}
