//! The commands, one small file each; no mathematics here.

mod adapt;
mod columns;
mod common;
mod compare;
mod demo;
mod diagnose;
mod drive;
mod drive_state;
mod each;
mod export;
mod files;
mod fit;
mod flash;
mod health;
mod inspect;
mod invert;
mod keys;
mod live;
mod pack;
mod paint;
mod plot;
mod predict;
mod progress;
mod prove;
mod shell;
mod simulate;
mod tables;
mod virtual_drive;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{CommandFactory, Parser, Subcommand};
use ratatui::crossterm::style::Color;

use crate::failure::{self, Failure};
use crate::fit::verdict::Grade;
use crate::output::OutputError;
use common::ending;

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("GMHM_BUILD"), ")");

/// Hysteresis torque of harmonic drives: identify it from recordings, predict it, put it on the drive
#[derive(Debug, Parser)]
#[command(name = "gmhm", version = VERSION, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print errors only
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Adapt(adapt::AdaptArgs),
    Columns(columns::ColumnsArgs),
    Compare(compare::CompareArgs),
    Completions(shell::CompletionsArgs),
    Demo(demo::DemoArgs),
    Diagnose(diagnose::DiagnoseArgs),
    Drive(drive::DriveArgs),
    Export(export::ExportArgs),
    Fit(fit::FitArgs),
    Flash(flash::FlashArgs),
    Health(health::HealthArgs),
    Inspect(inspect::InspectArgs),
    Invert(invert::InvertArgs),
    Man(shell::ManArgs),
    Pack(pack::PackArgs),
    Plot(plot::PlotArgs),
    Predict(predict::PredictArgs),
    Prove(prove::ProveArgs),
    Simulate(simulate::SimulateArgs),
    VirtualDrive(virtual_drive::VirtualDriveArgs),
}

/// What every command knows of how it was called.
#[derive(Debug, Default)]
pub(crate) struct Session {
    quiet: bool,
    /// Whether `--check` was asked for and what was found is not good.
    objects: AtomicBool,
}

/// Status of a command whose `--check` found something.
const OBJECTS: u8 = 3;

impl Session {
    /// Results to standard output, or to standard error where an output takes that. A reader that has had enough of them, as `head`, is no failure: the files are
    /// written by then.
    ///
    /// # Errors
    /// The system refuses.
    fn say(&self, results: std::fmt::Arguments<'_>) -> Result<(), Failure> {
        use std::io::{ErrorKind, Write, stderr, stdout};
        if self.quiet {
            return Ok(());
        }
        let mut out: Box<dyn Write> = match crate::output::takes_standard_output() {
            true => Box::new(stderr().lock()),
            false => Box::new(stdout().lock()),
        };
        match out.write_fmt(results).and_then(|()| out.flush()) {
            Err(source) if source.kind() != ErrorKind::BrokenPipe => {
                Err(OutputError::System { path: "standard output".into(), source }.into())
            }
            _ => Ok(()),
        }
    }

    /// A session that says nothing.
    fn silent() -> Self {
        Self { quiet: true, ..Self::default() }
    }

    /// Makes the exit status 3 where `--check` was asked for and what was found `is_bad`.
    fn check(&self, asked: bool, is_bad: bool) {
        self.objects.fetch_or(asked && is_bad, Ordering::Relaxed);
    }

    /// Says that an output was written.
    fn written(&self, what: &str, path: &Path) -> Result<(), Failure> {
        if path == Path::new("-") {
            return Ok(());
        }
        if what == "Model" && ending(path) != "toml" {
            self.note(&format!("{}: commands recognise a model file by the ending .toml", path.display()));
        }
        self.say(format_args!("{what} written to {}\n", path.display()))
    }

    /// A file that nobody named, beside an output: none where one is there already, or beside standard output.
    fn side_file(&self, path: &Path, option: &str) -> Option<PathBuf> {
        if crate::output::takes_standard_output() {
            return None;
        }
        if path.exists() {
            self.note(&format!("{} exists and was kept; {option} {0} replaces it", path.display()));
            return None;
        }
        Some(path.to_owned())
    }

    /// Tells something worth knowing that is no failure.
    fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{} {text}", paint::on(&std::io::stderr(), "note:", Color::Cyan));
        }
    }

    /// A verdict in the colour of its grade, where results go to a terminal.
    fn graded(&self, text: &str, grade: Grade) -> String {
        let colour = match grade {
            Grade::Good => Color::Green,
            Grade::Caution => Color::Yellow,
            Grade::Bad => Color::Red,
        };
        match crate::output::takes_standard_output() {
            true => paint::on(&std::io::stderr(), text, colour),
            false => paint::on(&std::io::stdout(), text, colour),
        }
    }
}

/// Runs the command line. Exit status 0: done; 1: the input was refused or the work failed; 2: wrong usage; 3: `--check` found something.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    crate::output::clean_up_on_interrupt();
    let session = Session { quiet: cli.quiet, ..Session::default() };
    let done = match &cli.command {
        Some(Command::Adapt(args)) => args.run(&session),
        Some(Command::Columns(args)) => args.run(&session),
        Some(Command::Compare(args)) => args.run(&session),
        Some(Command::Completions(args)) => args.run(&session),
        Some(Command::Demo(args)) => args.run(&session),
        Some(Command::Diagnose(args)) => args.run(&session),
        Some(Command::Drive(args)) => args.run(&session),
        Some(Command::Export(args)) => args.run(&session),
        Some(Command::Fit(args)) => args.run(&session),
        Some(Command::Flash(args)) => args.run(&session),
        Some(Command::Health(args)) => args.run(&session),
        Some(Command::Inspect(args)) => args.run(&session),
        Some(Command::Invert(args)) => args.run(&session),
        Some(Command::Man(args)) => args.run(&session),
        Some(Command::Pack(args)) => args.run(&session),
        Some(Command::Plot(args)) => args.run(&session),
        Some(Command::Predict(args)) => args.run(&session),
        Some(Command::Prove(args)) => args.run(&session),
        Some(Command::Simulate(args)) => args.run(&session),
        Some(Command::VirtualDrive(args)) => args.run(&session),
        None => session
            .say(format_args!("No command given: running the demo. For all commands: gmhm help\n\n"))
            .and_then(|()| demo::DemoArgs::default().run(&session)),
    };
    match done {
        Ok(()) if session.objects.into_inner() => ExitCode::from(OBJECTS),
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.tell();
            ExitCode::from(if failure.is_wrong_usage() { 2 } else { 1 })
        }
    }
}

/// Ends the program as clap does on wrong usage, with status 2.
fn wrong_usage(message: &str) -> ! {
    Cli::command().error(clap::error::ErrorKind::ValueValidation, message).exit()
}
