//! Fuzzing of what takes input from outside: blocks, the link, the store, the control path. Coverage-guided where it pays, on a stable compiler.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

/// The coverage that libFuzzer is guided by. These are the flags of `cargo fuzz --sanitizer none`, none of which needs a nightly compiler.
const COVERAGE: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table -Ccodegen-units=1 --cfg fuzzing";

/// Executions of each among the tests.
pub const IN_TESTS: u64 = 300_000;

/// The targets of `fuzz/`, and the longest input of each: several sessions; both slots.
const TARGETS: [(&str, &str); 2] = [("link", "256"), ("store", "1200")];

/// Seeded tests: what they fuzz, which tests, and what a failure means.
const TESTS: [(&str, &str, &str); 9] = [
    ("block", "block_fuzz::", "a block was neither rejected nor used"),
    (
        "cascade, feed-forward and servo",
        "control_faults::fuzzed",
        "bad input led to a result beyond its limits, or to a lasting error",
    ),
    ("servo with terms", "servo_terms::fuzzed", "bad input led to a result beyond its limits, or to a lasting error"),
    ("library for C", "faults::fuzzed", "a sample was not answered with finite numbers"),
    ("gear for C", "gear::fuzzed", "a sample was not answered with finite numbers, or a good one was not taken"),
    ("law for C", "law::fuzzed", "a period was not answered with finite numbers, or a good one was not taken"),
    ("encoder counts for C", "pair::fuzzed", "counts were not answered with finite numbers"),
    ("torn encoder counts for C", "pair::after_torn", "a good reading after a torn one is wrong"),
    ("feed-forward for C", "feed_forward::fuzzed", "a period was not answered with finite numbers"),
];

/// Runs each fuzzer so often, from one seed.
pub fn run(shell: &Shell, executions: u64, seed: u64) -> Result<()> {
    let (count, seed) = (executions.to_string(), seed.to_string());
    for (what, test, failure) in TESTS {
        println!("fuzz: {what}");
        // With the whole workspace named, what is tested is built already; one package alone has other features.
        cmd!(shell, "cargo test --quiet --locked --workspace --test all -- --nocapture {test}")
            .env("GMHM_FUZZ", &count)
            .env("GMHM_FUZZ_SEED", &seed)
            .quiet()
            .run()
            .context(failure)?;
    }

    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let folder = shell.current_dir().join("target/fuzz");
    // With a target named, the flags are not those of build scripts.
    cmd!(
        shell,
        "cargo build --quiet --locked --release --manifest-path fuzz/Cargo.toml --target {host} --target-dir {folder} --bins"
    )
    .env("RUSTFLAGS", COVERAGE)
    .quiet()
    .run()
    .context("the fuzzers do not build: libFuzzer needs a C++ compiler named `c++`")?;
    for (target, longest) in TARGETS {
        println!("fuzz: {target}");
        let program = folder.join(&host).join("release").join(target);
        let _inside = shell.push_dir(&folder);
        let output = cmd!(shell, "{program} -runs={count} -seed={seed} -max_len={longest}").quiet().read_stderr();
        let output =
            output.with_context(|| format!("the fuzzer `{target}` found something: its input is in target/fuzz"))?;
        for line in output.lines().filter(|line| line.starts_with("Done ") || line.contains("cov: ")).rev().take(2) {
            println!("fuzz: {target}: {}", line.trim());
        }
    }
    Ok(())
}
