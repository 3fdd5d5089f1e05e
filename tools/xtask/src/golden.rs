//! Files that say what a run must give, rewritten on request only.

use std::path::Path;

use anyhow::{Context, Result, bail};

/// Compares with the file, or rewrites it.
pub fn check(file: &Path, text: &str, overwrite: bool) -> Result<()> {
    let name = file.display();
    if overwrite {
        return std::fs::write(file, text).with_context(|| format!("cannot write {name}"));
    }
    let golden = std::fs::read_to_string(file)
        .with_context(|| format!("cannot read {name}: write it with the option --overwrite"))?;
    if golden == text {
        return Ok(());
    }
    let lines = golden.lines().map(Some).chain(std::iter::repeat(None));
    let differing = lines.zip(text.lines().map(Some).chain(std::iter::repeat(None))).enumerate();
    for (k, (expected, found)) in differing.take_while(|(_, (a, b))| a.is_some() || b.is_some()) {
        if expected != found {
            let (expected, found) = (expected.unwrap_or("the end"), found.unwrap_or("the end"));
            bail!(
                "{name}, line {}: expected\n  {expected}\nfound\n  {found}\nif that is meant, accept it with --overwrite",
                k + 1
            );
        }
    }
    bail!("{name} differs in its line ends only: accept it with --overwrite")
}
