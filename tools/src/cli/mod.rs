//! The commands, one small file each; no mathematics here.

mod common;
mod compare;
mod demo;
mod diagnose;
mod drive;
mod failure;
mod fit;
mod flash;
mod health;
mod inspect;
mod invert;
mod pack;
mod predict;
mod progress;
mod prove;
mod simulate;
mod tables;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

pub use failure::Failure;

/// Hysteresis torque of harmonic drives: identify it from recordings, predict it, put it on the drive
#[derive(Debug, Parser)]
#[command(name = "gmhm", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// No progress, no notes: errors only
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Compare(compare::CompareArgs),
    Demo(demo::DemoArgs),
    Diagnose(diagnose::DiagnoseArgs),
    Drive(drive::DriveArgs),
    Fit(fit::FitArgs),
    Flash(flash::FlashArgs),
    Health(health::HealthArgs),
    Inspect(inspect::InspectArgs),
    Invert(invert::InvertArgs),
    Pack(pack::PackArgs),
    Predict(predict::PredictArgs),
    Prove(prove::ProveArgs),
    Simulate(simulate::SimulateArgs),
}

/// What every command knows of how it was called.
pub(crate) struct Session {
    quiet: bool,
}

impl Session {
    /// Tells something worth knowing that is no failure.
    fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("note: {text}");
        }
    }
}

/// Runs the command line. Exit status 0: done; 1: the input was refused or the work failed; 2: wrong usage.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    crate::output::clean_up_on_interrupt();
    let session = Session { quiet: cli.quiet };
    let done = match &cli.command {
        Some(Command::Compare(args)) => args.run(&session),
        Some(Command::Demo(args)) => args.run(&session),
        Some(Command::Diagnose(args)) => args.run(&session),
        Some(Command::Drive(args)) => args.run(&session),
        Some(Command::Fit(args)) => args.run(&session),
        Some(Command::Flash(args)) => args.run(&session),
        Some(Command::Health(args)) => args.run(&session),
        Some(Command::Inspect(args)) => args.run(),
        Some(Command::Invert(args)) => args.run(&session),
        Some(Command::Pack(args)) => args.run(&session),
        Some(Command::Predict(args)) => args.run(&session),
        Some(Command::Prove(args)) => args.run(&session),
        Some(Command::Simulate(args)) => args.run(&session),
        None => demo::DemoArgs::default().run(&session),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.tell();
            ExitCode::from(1)
        }
    }
}

/// Ends the program as clap does on wrong usage, with status 2.
fn wrong_usage(message: &str) -> ! {
    Cli::command().error(clap::error::ErrorKind::ValueValidation, message).exit()
}
