//! The structure of `tools/src`: size of folders, import cycles, and files that match on the name of a kind; the public types of the core.

mod graph;
mod imports;
mod types;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, bail};
use xshell::Shell;

use graph::{Graph, components};
use imports::Source;

// The limits hold what was reached. They may be lowered, never raised.

/// Files in an import cycle, at most.
const LARGEST_FILE_CYCLE: usize = 3;

/// Folders in an import cycle, at most: 1 where imports go one way.
const LARGEST_FOLDER_CYCLE: usize = 1;

/// Files outside `kinds/` and `prove/` that hold the name of a kind as a string, at most.
const FILES_WITH_KIND_NAMES: usize = 0;

/// Folders that may name kinds: the kinds themselves, and the proof, which shares nothing with them.
const MAY_NAME_KINDS: [&str; 2] = ["kinds/", "prove/"];

/// Strings that are the name of something else, too: a field of parameter blocks.
const OTHER_MEANINGS: [(&str, &str); 1] = [("block/contents.rs", "torque_scale")];

/// Prints the structure; fails where a limit is exceeded.
pub fn run(shell: &Shell) -> Result<()> {
    let root = shell.current_dir();
    let sources = imports::read(&root.join("tools/src"))?;
    let kinds = kind_names(&root.join("src/terms"))?;

    print_folders(&sources);
    let files = Graph::of_files(&sources);
    let file_cycle = print_cycles("files", &files);
    let folder_cycle = print_cycles("folders", &Graph::of_folders(&sources));
    let named = print_kind_names(&sources, &kinds);

    let limits = [
        ("files in the largest import cycle", file_cycle, LARGEST_FILE_CYCLE),
        ("folders in the largest import cycle", folder_cycle, LARGEST_FOLDER_CYCLE),
        ("files outside kinds/ that hold the name of a kind", named, FILES_WITH_KIND_NAMES),
    ];
    println!();
    let mut exceeded = Vec::new();
    for (what, found, limit) in limits {
        println!("{what}: {found} (limit {limit})");
        if found > limit {
            exceeded.push(format!("{what}: {found}, at most {limit} are allowed"));
        }
    }
    tests_are_listed(&root)?;
    types::check(&root.join("src"))?;
    if !exceeded.is_empty() {
        bail!("the structure of tools/src has got worse:\n  {}", exceeded.join("\n  "));
    }
    Ok(())
}

/// Fails where a file beside `tests/all.rs` is not one of its modules: its tests would never run.
fn tests_are_listed(root: &Path) -> Result<()> {
    for package in ["tools", "host-tests", "c"] {
        let folder = root.join(package).join("tests");
        let all = std::fs::read_to_string(folder.join("all.rs"))?;
        for entry in std::fs::read_dir(&folder)? {
            let path = entry?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let is_test = path.extension().is_some_and(|extension| extension == "rs") && name != "all";
            if is_test && !all.lines().any(|line| line == format!("mod {name};")) {
                bail!("{} is not tested: add `mod {name};` to {package}/tests/all.rs", path.display());
            }
        }
    }
    Ok(())
}

/// Lines per folder, and their sum.
fn print_folders(sources: &[Source]) {
    let mut folders: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for source in sources {
        let entry = folders.entry(source.folder()).or_default();
        entry.0 += source.lines;
        entry.1 += 1;
    }
    for (folder, (lines, files)) in &folders {
        println!("{lines:>6} lines in {files:>2} files  {folder}");
    }
    let total: usize = folders.values().map(|(lines, _)| lines).sum();
    println!("{total:>6} lines in {:>2} files", sources.len());
}

/// The cycles of a graph, largest first; the size of the largest, 1 where there is none.
fn print_cycles(what: &str, graph: &Graph) -> usize {
    let mut cycles: Vec<Vec<usize>> = components(graph).into_iter().filter(|c| c.len() > 1).collect();
    cycles.sort_by_key(|cycle| std::cmp::Reverse(cycle.len()));
    for cycle in &cycles {
        let members: BTreeSet<usize> = cycle.iter().copied().collect();
        println!("\ncycle of {} {what}:", cycle.len());
        for &from in &members {
            let to: Vec<&str> = graph.edges[from].intersection(&members).map(|&i| graph.names[i].as_str()).collect();
            println!("  {} → {}", graph.names[from], to.join(", "));
        }
    }
    cycles.first().map_or(1, Vec::len)
}

/// The files that hold the name of a kind and may not; their count.
fn print_kind_names(sources: &[Source], kinds: &BTreeSet<String>) -> usize {
    let mut count = 0;
    println!();
    for source in sources.iter().filter(|s| !MAY_NAME_KINDS.iter().any(|folder| s.path.starts_with(folder))) {
        let found = source.strings.intersection(kinds).map(String::as_str);
        let found: Vec<&str> = found.filter(|name| !OTHER_MEANINGS.contains(&(source.path.as_str(), name))).collect();
        if !found.is_empty() {
            count += 1;
            println!("{} names {}", source.path, found.join(", "));
        }
    }
    count
}

/// The names of the core's kinds: the strings behind `name:` in the files of its terms.
fn kind_names(terms: &Path) -> Result<BTreeSet<String>> {
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(terms).with_context(|| format!("cannot read {}", terms.display()))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let values = text.split("KindInfo {").skip(1).filter_map(|rest| rest.split("name: \"").nth(1));
            names.extend(values.filter_map(|rest| rest.split('"').next()).map(str::to_owned));
        }
    }
    if names.is_empty() {
        bail!("no kind was found in {}", terms.display());
    }
    Ok(names)
}
