//! `gmhm export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::Session;
use super::common::{depth, ending, positive};
use super::failure::Failure;
use super::files::Files;
use crate::export::fmu::{DeflectionInput, Fmu, fmu};
use crate::export::{self, ExportOptions, Exported, Origin, Precision};
use crate::model;
use crate::output::Outputs;
use crate::physics::CAPACITY;
use crate::report::page::Input;

/// Write a model as source for other tools
///
/// --to c writes one header and one source of C99 without allocation, for the microcontroller or a simulation: the torque of a deflection path, the deflection for a torque, state,
/// status and the model's plant terms. Neither Rust nor this program is needed to use it. Terms that describe measurement faults are omitted.
/// --to fmu writes a co-simulation unit of FMI 2.0 around the same source in double precision, with a binary for Linux where a C compiler is present.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  gmhm export gear.toml --to c --self-test -o gear\n  cc -std=c99 gear/*.c -lm -o self_test && ./self_test\n  gmhm export gear.toml --to fmu -o gear.fmu"
)]
pub struct ExportArgs {
    /// Model file
    #[arg(value_name = "M.toml")]
    model: PathBuf,
    /// What to write
    #[arg(long, value_enum)]
    to: Form,
    /// Arithmetic of the C source; an FMU computes in f64
    #[arg(long, value_enum, default_value_t)]
    scalar: Precision,
    /// Inputs of the FMU are both angles instead of the deflection; requires a ratio in the model
    #[arg(long)]
    angles: bool,
    /// Prefix of every name and file [default: the model's name]
    #[arg(long, value_name = "NAME")]
    prefix: Option<String>,
    /// Longest sample period; required for law time
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = positive)]
    period: Option<f64>,
    /// Turning points that a joint stores, even, 4 or more [default: 16 in C, 256 in an FMU]
    #[arg(long, value_name = "N", value_parser = depth)]
    stack_depth: Option<u16>,
    /// Rated deflection in rad [default: the model's]
    #[arg(long, value_name = "RAD", allow_negative_numbers = true, value_parser = positive)]
    rated_deflection: Option<f64>,
    /// Also write reference samples and a main function that checks the source against them
    #[arg(long)]
    self_test: bool,
    /// Where to write: a folder for c, a file for fmu
    #[arg(short, long, value_name = "DIR|F.fmu")]
    output: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Form {
    /// C99 source, into a folder
    C,
    /// FMI 2.0 co-simulation unit, into one file
    Fmu,
}

impl ExportArgs {
    pub(super) fn run(&self, session: &Session) -> Result<(), Failure> {
        let ending = ending(&self.output);
        match self.to {
            Form::C if ["c", "h", "fmu"].contains(&&*ending) => {
                super::wrong_usage("--to c writes a header and a source file: -o must be a folder")
            }
            Form::Fmu if ending != "fmu" => super::wrong_usage("--to fmu writes one file: -o must end in .fmu"),
            _ => {}
        }
        let model = model::load(&self.model)?;
        let origin = Origin::from(&Input::of_file(&self.model)?);
        let options = ExportOptions {
            precision: self.scalar,
            prefix: self.prefix.clone(),
            period_s: self.period,
            rated_deflection_rad: self.rated_deflection,
            turning_points: self.stack_depth.unwrap_or(match self.to {
                Form::C => 16,
                Form::Fmu => CAPACITY as u16,
            }),
            self_test: self.self_test,
        };
        let left_out = match self.to {
            Form::C => {
                let exported = export::source::c(&model, &origin, &options)?;
                self.write_source(&exported, session)?;
                exported.left_out
            }
            Form::Fmu => {
                let inputs = if self.angles { DeflectionInput::Angles } else { DeflectionInput::Deflection };
                let fmu = fmu(&model, &origin, &options, inputs)?;
                self.write_fmu(&fmu, session)?;
                fmu.left_out
            }
        };
        for kind in left_out {
            session.note(&format!("`{kind}` is a measurement fault and is omitted"));
        }
        Ok(())
    }

    fn write_source(&self, exported: &Exported, session: &Session) -> Result<(), Failure> {
        Outputs::make_folder(&self.output)?;
        let mut files = Files::new(session);
        for (name, text) in &exported.files {
            files.add("Source", Some(&self.output.join(name)), || Ok(text))?;
        }
        if let Some(why) = &exported.without_inverse {
            session.note(&format!("the source can predict but not invert: {why}"));
        }
        files.finish("")
    }

    fn write_fmu(&self, fmu: &Fmu, session: &Session) -> Result<(), Failure> {
        let mut files = Files::new(session);
        files.add("FMU", Some(&self.output), || Ok(&fmu.bytes))?;
        if let Some(why) = &fmu.without_binary {
            session.note(&format!("the FMU contains its sources but no binary: {why}"));
        }
        files.finish("")
    }
}
