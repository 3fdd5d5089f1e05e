//! The cost that each kind of term states in its own file, held to the count.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};
use xshell::Shell;

use crate::cost::{Call, TOLERANCE};

/// One file a kind, called as the kind.
const KINDS: &str = "src/terms";

/// The field of a kind's entry in the registry.
const FIELD: &str = "        instructions: ";

/// Compares what the registry says of each kind with its most expensive shape, or writes that there.
pub fn check(shell: &Shell, calls: &[Call], overwrite: bool) -> Result<()> {
    let mut counted = BTreeMap::<&str, f64>::new();
    for call in calls {
        if let Some((kind, _)) = call.name.strip_prefix("term `").and_then(|rest| rest.split_once('`')) {
            let most = counted.entry(kind).or_default();
            *most = most.max(call.instructions);
        }
    }
    for path in shell.read_dir(KINDS)?.into_iter().filter(|path| path.is_file()) {
        let text = shell.read_file(&path)?;
        let Some(line) = text.lines().find(|line| line.starts_with(FIELD)) else { continue };
        let kind = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let count = counted.remove(kind).with_context(|| format!("term `{kind}` was not counted"))?;
        if overwrite {
            shell.write_file(&path, text.replacen(line, &format!("{FIELD}{count},"), 1))?;
            continue;
        }
        let stated: f64 = line[FIELD.len()..].trim_end_matches(',').parse().context(line.to_owned())?;
        ensure!(
            (stated - count).abs() <= TOLERANCE,
            "{}: term `{kind}` states {stated} instructions and takes {count}: write that with --overwrite",
            path.display()
        );
    }
    if let Some(kind) = counted.keys().next() {
        bail!("{KINDS}/{kind}.rs states no instructions");
    }
    Ok(())
}
