//! `gmhm drive`.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use gmhm::block::verify;
use gmhm::link::Request;
use gmhm::link::message::ERASE;
use serde::Serialize;

use super::Session;
use super::common::{self, json, positive};
use super::drive_state::{Counted, Moment, State, compensation};
use super::failure::Failure;
use super::files::Files;
use super::live::Screen;
use super::progress::Progress;
use super::tables;
use crate::adapt::Learnt;
use crate::block::{params_of, read, with_params};
use crate::device::{Client, DeviceError, Target, flash, key, line, trial};
use crate::output::Outputs;

/// Monitor a drive; try parameters in its RAM, store or revert them
///
/// Parameters on trial are in force until `revert`, `commit` or the next power-up. A drive accepts other parameters only while its compensation is off, and stores
/// only while it is disabled. Otherwise it reports the reason.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gmhm drive status --to serial:/dev/ttyUSB0\n  gmhm drive --to serial:/dev/ttyUSB0 try params.bin\n  gmhm drive --to serial:/dev/ttyUSB0 gain 0.3\n  gmhm drive --to serial:/dev/ttyUSB0 on\n  gmhm drive --to serial:/dev/ttyUSB0 live --block params.bin\n  gmhm drive --to serial:/dev/ttyUSB0 live --seconds 10 --json live.json"
)]
pub struct DriveArgs {
    /// The drive: serial:PORT or tcp:HOST:PORT
    #[arg(long, value_name = "TARGET", global = true)]
    to: Option<Target>,
    /// Speed of a serial port
    #[arg(long, value_name = "RATE", default_value = "115200", global = true)]
    baud: u32,
    /// The drive's key, 64 hexadecimal digits, if it has one
    #[arg(long, value_name = "FILE", global = true)]
    key: Option<PathBuf>,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Show the drive's identity and the parameters in force
    Status {
        /// Where to write the same as JSON
        #[arg(long, value_name = "F.json")]
        json: Option<PathBuf>,
    },
    /// Show what the drive measures and computes: on a terminal a screen with a running plot and keys, else line by line
    Live {
        /// Print line by line for this time, in s [default: 1 if there is no terminal]
        #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive)]
        seconds: Option<f64>,
        /// The block that the key t of the screen tries, .bin or .hex
        #[arg(long, value_name = "params.bin")]
        block: Option<PathBuf>,
        /// Time between two lines
        #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = positive, default_value = "0.1")]
        every: f64,
        /// Print line by line, and write the same as JSON
        #[arg(long, value_name = "F.json")]
        json: Option<PathBuf>,
    },
    /// Read the block in force into a file
    Read {
        /// The file
        #[arg(short, long, value_name = "F.bin")]
        output: PathBuf,
    },
    /// Try a block in RAM, without storing it
    Try {
        /// The block, .bin or .hex
        #[arg(value_name = "params.bin")]
        block: PathBuf,
    },
    /// End the trial: the stored block is in force again
    Revert,
    /// Store the parameters on trial
    Commit,
    /// Erase the newest stored block and put the one before it in force
    Rollback,
    /// Erase flash slots that cannot be read, if commit is rejected because of them; a block in such a slot is lost
    ///
    /// Readable slots and the slot of the block in force are not changed. Switch the drive off and on first: the fault may disappear.
    EraseUnreadable,
    /// Switch the compensation on
    On,
    /// Switch the compensation off
    Off,
    /// Show errors of the control path and of the line since power-up or the last --clear
    Diagnostics {
        /// Reset the counters afterwards
        #[arg(long)]
        clear: bool,
        /// Where to write the same as JSON
        #[arg(long, value_name = "F.json")]
        json: Option<PathBuf>,
    },
    /// Show the result of the drive's adaptation: old and new coefficients with standard deviations
    ///
    /// The drive never writes its flash by itself. With --output or --commit, this program makes a block of the shadow: the block in force with the adapted coefficients.
    Adaptation {
        /// Where to write the same as JSON
        #[arg(long, value_name = "F.json")]
        json: Option<PathBuf>,
        /// Where to write the block of the shadow
        #[arg(short, long, value_name = "F.bin")]
        output: Option<PathBuf>,
        /// Store the block of the shadow on the drive, as flash does
        #[arg(long)]
        commit: bool,
    },
    /// Set how far parameters tried on an enabled drive may differ from those in force; only while it is disabled
    Bound {
        /// Share of the torque at the rated deflection: 0.3 at power-up, inf for no limit
        #[arg(value_name = "SHARE", value_parser = positive_or_infinite)]
        share: f32,
    },
    /// Set the share of the compensation that is fed forward
    Gain {
        /// From 0 to 1
        #[arg(value_name = "RATIO", value_parser = share, allow_negative_numbers = true)]
        ratio: f32,
    },
}

fn share(text: &str) -> Result<f32, String> {
    let ratio = text.parse().ok().filter(|ratio| (0.0..=1.0).contains(ratio));
    ratio.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}

fn positive_or_infinite(text: &str) -> Result<f32, String> {
    let share = text.parse().ok().filter(|share| *share >= 0.0);
    share.ok_or_else(|| "must be a number of 0 or more, or inf".to_owned())
}

impl DriveArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        match &self.action {
            Action::Status { json } | Action::Live { json, .. } | Action::Diagnostics { json, .. } => {
                json.as_deref().map_or(Ok(()), Outputs::check)?
            }
            Action::Read { output } => Outputs::check(output)?,
            Action::Adaptation { json, output, .. } => {
                for path in [json, output].into_iter().flatten() {
                    Outputs::check(path)?;
                }
            }
            _ => {}
        }
        let block = match &self.action {
            Action::Try { block } | Action::Live { block: Some(block), .. } => read(block)?.bytes,
            _ => Vec::new(),
        };
        let key = self.key.as_deref().map(key::read).transpose()?;
        let mut drive = Client::new(line::open(self.target(), self.baud)?).with_key(key);
        match &self.action {
            Action::Status { json } => {
                let state = State::of(drive.identify()?, drive.status()?);
                session.say(format_args!("{}", state.text()))?;
                write_json(json.as_deref(), &state)
            }
            Action::Live { seconds: None, json: None, block: given, .. } if has_screen() => {
                Screen::new(&mut drive, self.target(), given.is_some().then_some(block))?.run()
            }
            Action::Live { seconds, every, json, .. } => {
                live(&mut drive, seconds.unwrap_or(1.0), *every, json.as_deref(), session)
            }
            Action::Read { output } => {
                let bytes = trial::in_force(&mut drive)?;
                let mut files = Files::new(session);
                files.add("Block in force", Some(output), || Ok(bytes))?;
                files.finish("")
            }
            Action::Adaptation { json, output, commit } => {
                self.adaptation(drive, json.as_deref(), output.as_deref(), *commit, session)
            }
            Action::Try { .. } => {
                let progress = Progress::new("trying", 2 * block.len() as u64, session.quiet);
                let tried = trial::try_out(&block, &mut drive, |done, _| progress.at(done as u64))?;
                self.say(
                    &format!(
                        "on trial, read back: CRC-32 {:#010x}; commit stores it as sequence {}",
                        tried.crc, tried.sequence
                    ),
                    session,
                )
            }
            Action::Revert => {
                drive.change(&Request::Revert)?;
                self.say("trial ended", session)
            }
            Action::Commit => {
                let (sequence, crc) = trial::commit(&mut drive)?;
                self.say(
                    &format!("stored and read back by the drive: sequence {sequence}, CRC-32 {crc:#010x}"),
                    session,
                )
            }
            Action::Rollback => {
                let (sequence, crc) = trial::roll_back(&mut drive)?;
                self.say(&format!("in force again: sequence {sequence}, CRC-32 {crc:#010x}"), session)
            }
            Action::EraseUnreadable => {
                drive.change(&Request::EraseUnreadable { signature: ERASE })?;
                self.say("all slots can be read", session)
            }
            Action::On => self.send(&mut drive, &Request::Compensate { on: true }, session),
            Action::Off => self.send(&mut drive, &Request::Compensate { on: false }, session),
            Action::Gain { ratio } => self.send(&mut drive, &Request::Gain { ratio: *ratio }, session),
            Action::Bound { share } => {
                drive.change(&Request::Bound { share: *share })?;
                self.say(&format!("on an enabled drive, torques may differ by {share} of the rated one"), session)
            }
            Action::Diagnostics { clear, json } => {
                let counted = Counted::of(&drive.diagnostics()?);
                session.say(format_args!("{}", counted.text()))?;
                write_json(json.as_deref(), &counted)?;
                if *clear {
                    drive.change(&Request::ClearDiagnostics)?;
                }
                Ok(())
            }
        }
    }

    /// Shows the result of the adaptation, and makes a block of it if one is wanted.
    fn adaptation(
        &self,
        mut drive: Client,
        json: Option<&Path>,
        output: Option<&Path>,
        commit: bool,
        session: &Session,
    ) -> Result<(), Failure> {
        let adapted = drive.adaptation()?;
        let bytes = trial::in_force(&mut drive)?;
        let block = verify(&bytes).map_err(DeviceError::from)?;
        let learnt = Learnt::of(&params_of(&block)?, &adapted)?;
        session.say(format_args!("{}", tables::learnt(&learnt)))?;
        let mut outputs = Outputs::new();
        if let Some(path) = json {
            outputs.add_contents(path, &common::json(&learnt)?)?;
        }
        if output.is_none() && !commit {
            return Ok(outputs.commit()?);
        }
        let new = with_params(&block, &learnt.shadow)?.bytes;
        if let Some(path) = output {
            outputs.add_contents(path, &new)?;
        }
        outputs.commit()?;
        if !commit {
            return Ok(());
        }
        // Its session ends with it: the next one begins at once.
        drop(drive);
        let key = self.key.as_deref().map(key::read).transpose()?;
        let open = || Ok(Client::new(line::open(self.target(), self.baud)?).with_key(key));
        let progress = Progress::new("storing", 2 * new.len() as u64, session.quiet);
        let flashed = flash(&new, open, |done, _| progress.at(done as u64))?;
        self.say(&format!("stored and read back: sequence {}, CRC-32 {:#010x}", flashed.sequence, flashed.crc), session)
    }

    /// Changes a setting and prints what is in force then.
    fn send(&self, drive: &mut Client, request: &Request<'_>, session: &Session) -> Result<(), Failure> {
        drive.change(request)?;
        let status = drive.status()?;
        self.say(&compensation(status.compensating, status.gain_ratio), session)
    }

    /// The drive asked for; a command line without one is wrong usage, wherever its options stand.
    fn target(&self) -> &Target {
        let missing = || super::wrong_usage("--to is missing: gmhm drive status --to serial:PORT or tcp:HOST:PORT");
        self.to.as_ref().unwrap_or_else(missing)
    }

    fn say(&self, text: &str, session: &Session) -> Result<(), Failure> {
        session.say(format_args!("{}: {text}\n", self.target()))
    }
}

/// Whether there is a terminal for the screen.
fn has_screen() -> bool {
    std::io::stdin().is_terminal() && std::io::stdout().is_terminal()
}

fn write_json(path: Option<&Path>, results: &impl Serialize) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    let mut outputs = Outputs::new();
    outputs.add_contents(path, json(results)?)?;
    Ok(outputs.commit()?)
}

/// Prints the live values of the drive line by line.
fn live(drive: &mut Client, seconds: f64, every: f64, json: Option<&Path>, session: &Session) -> Result<(), Failure> {
    session.say(format_args!("{}\n", Moment::HEADER))?;
    let mut moments = Vec::new();
    let began = Instant::now();
    loop {
        let moment = Moment::of(began.elapsed().as_secs_f64(), &drive.live()?, &drive.diagnostics()?.joint);
        session.say(format_args!("{}\n", moment.text()))?;
        moments.push(moment);
        let next = every * moments.len() as f64;
        if next >= seconds {
            break;
        }
        std::thread::sleep(Duration::from_secs_f64(next).saturating_sub(began.elapsed()));
    }
    write_json(json, &moments)
}
