//! Tells the program what it was built from, for `gmhm --version`.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = match std::env::var("PROFILE").as_deref() {
        // Builds for development would be built again with every commit.
        Ok("release") => commit().map_or("commit unknown".to_owned(), |commit| format!("commit {commit}")),
        _ => "development build".to_owned(),
    };
    let with = ["mat73", "probe"]
        .into_iter()
        .filter(|feature| std::env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase())).is_some());
    let features = with.collect::<Vec<_>>().join(", ");
    let features = if features.is_empty() { "none" } else { &features };
    println!("cargo::rustc-env=GMHM_BUILD={commit}; features: {features}");
}

/// The commit, marked where tracked files differ from it.
fn commit() -> Option<String> {
    let log = git(&["rev-parse", "--path-format=absolute", "--git-path", "logs/HEAD"])?;
    println!("cargo::rerun-if-changed={log}");
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_none_or(|files| !files.is_empty());
    Some(if changed { format!("{commit}, changed") } else { commit })
}

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
