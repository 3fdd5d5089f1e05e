//! Steps of the tests. Each says what it took; a part of them runs in a process of its own beside the others, so that no processor waits.

use std::io::{Read, Seek};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};
use xshell::Shell;

use crate::skips;
use crate::time::Stopwatch;

/// A step: its name and its work.
pub type Step = (&'static str, fn(&Shell) -> Result<()>);

/// Runs steps in their order and prints the time of each.
pub fn run(shell: &Shell, steps: &[Step]) -> Result<()> {
    for (name, work) in steps {
        println!("==> {name}");
        let stopwatch = Stopwatch::start();
        work(shell)?;
        println!("    {name}: ({})", stopwatch.taken());
    }
    Ok(())
}

/// A command of this program in a process of its own. Its output is kept, and printed as a whole when it has ended.
pub struct Beside {
    name: &'static str,
    child: Child,
    output: std::fs::File,
}

impl Beside {
    /// Starts it. Skipped checks are noted in the list.
    pub fn start(name: &'static str, arguments: &[&str], list: &std::path::Path) -> Result<Self> {
        let output = tempfile::tempfile().context("no temporary file")?;
        let child = Command::new(std::env::current_exe()?)
            .args(arguments)
            .env(skips::LIST, list)
            .stdin(Stdio::null())
            .stdout(output.try_clone()?)
            .stderr(output.try_clone()?)
            .spawn()
            .with_context(|| format!("the part `{name}` does not start"))?;
        println!("==> {name}: runs beside what follows, and is shown when it has ended");
        Ok(Self { name, child, output })
    }

    /// Waits for its end and prints what it printed.
    pub fn end(mut self) -> Result<()> {
        let status = self.child.wait()?;
        let mut text = Vec::new();
        self.output.rewind()?;
        self.output.read_to_end(&mut text)?;
        println!("==> {}", self.name);
        print!("{}", String::from_utf8_lossy(&text));
        ensure!(status.success(), "the part `{}` failed, see above", self.name);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The program that runs beside is this test program.
    fn beside(arguments: &[&str]) -> Result<()> {
        Beside::start("beside", arguments, std::path::Path::new("list"))?.end()
    }

    #[test]
    fn a_part_that_fails_beside_is_a_failure() {
        beside(&["--list"]).unwrap();
        assert!(beside(&["--no-such-option"]).unwrap_err().to_string().contains("`beside` failed"));
    }

    #[test]
    fn steps_run_in_order_to_the_first_failure() {
        let shell = Shell::new().unwrap();
        let folder = shell.create_temp_dir().unwrap();
        shell.change_dir(folder.path());
        let steps: [Step; 3] = [
            ("one", |shell| Ok(shell.write_file("one", "")?)),
            ("two", |_| anyhow::bail!("it fails")),
            ("three", |shell| Ok(shell.write_file("three", "")?)),
        ];
        assert_eq!(run(&shell, &steps).unwrap_err().to_string(), "it fails");
        assert!(shell.path_exists("one") && !shell.path_exists("three"));
    }
}
