//! The `gmhm` program.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    gmhm_tools::cli::run()
}
