//! The `gmhm` program.

fn main() -> std::process::ExitCode {
    gmhm_tools::cli::run()
}
