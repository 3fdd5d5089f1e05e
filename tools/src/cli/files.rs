//! The files that a command writes: complete together, and named when they are there.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::Session;
use super::failure::Failure;
use crate::output::Outputs;

/// The files of a command, each with what it is called.
pub(super) struct Files<'s> {
    session: &'s Session,
    outputs: Outputs,
    named: Vec<(&'static str, PathBuf)>,
}

impl<'s> Files<'s> {
    /// No file yet.
    pub fn new(session: &'s Session) -> Self {
        Self { session, outputs: Outputs::new(), named: Vec::new() }
    }

    /// A file, if one is asked for.
    pub fn add<C: AsRef<[u8]>>(
        &mut self,
        what: &'static str,
        path: Option<&PathBuf>,
        contents: impl FnOnce() -> Result<C, Failure>,
    ) -> Result<(), Failure> {
        let Some(path) = path else { return Ok(()) };
        let contents = contents()?;
        self.stream(what, path, |out| Ok(out.write_all(contents.as_ref())?))
    }

    /// A file that is written piece by piece.
    pub fn stream(
        &mut self,
        what: &'static str,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.outputs.add(path, write)?;
        self.named.push((what, path.to_owned()));
        Ok(())
    }

    /// Lets all files appear, prints the results of the command, and names the files.
    pub fn finish(self, results: impl Display) -> Result<(), Failure> {
        self.outputs.commit()?;
        self.session.say(format_args!("{results}"))?;
        self.named.iter().try_for_each(|(what, path)| self.session.written(what, path))
    }
}
