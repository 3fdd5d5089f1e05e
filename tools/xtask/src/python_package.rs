//! The Python package: installed by pip, tested by pytest, its types checked by mypy and pyright, its notebook run.

use std::path::Path;

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::program;
use crate::python::environment;

const FOLDER: &str = "tools/python";

/// From the package index: what builds the package, and what its tests need.
const PACKAGES: [&str; 12] = [
    "maturin==1.16.0",
    "numpy==2.4.6",
    "scipy==1.17.1",
    "pandas==3.1.1",
    "polars==2.1.0",
    "matplotlib==3.11.2",
    "pytest==9.2.0",
    "mypy==2.4.1",
    // Pyright with the JavaScript engine that it needs.
    "basedpyright==1.40.2",
    "nbclient==0.11.0",
    "nbformat==5.11.1",
    "ipykernel==7.4.0",
];

/// All of them are installed.
const IMPORTS: &str =
    "maturin, numpy, scipy, pandas, polars, matplotlib, pytest, mypy, basedpyright, nbclient, nbformat, ipykernel";

/// Installs the package into an environment of its own and tests it; with `timed` instead builds it in release and measures what it adds to the program's own time.
pub fn run(shell: &Shell, timed: bool) -> Result<()> {
    let Some(python) = environment(shell, "python", &PACKAGES, IMPORTS)? else { return Ok(()) };
    let gmhm = program::gmhm(shell, timed)?;
    install(shell, &python, if timed { "release" } else { "dev" })?;
    let script = |name: &str| format!("{FOLDER}/tests/{name}");
    if timed {
        let measure = script("measure.py");
        let said = cmd!(shell, "{python} {measure} {gmhm}").quiet().read().context("the measurement fails")?;
        said.lines().for_each(|line| println!("python: {line}"));
        return Ok(());
    }
    {
        let _folder = shell.push_dir(FOLDER);
        let _program = shell.push_env("GMHM", &gmhm);
        let _cache = shell.push_env("MYPY_CACHE_DIR", program::target(shell).join("mypy"));
        let _sources = shell.push_env("PYTHONDONTWRITEBYTECODE", "1");
        cmd!(shell, "{python} -m pytest --quiet -p no:cacheprovider")
            .quiet()
            .run()
            .context("a test of the Python package fails")?;
        cmd!(shell, "{python} -m mypy python tests")
            .quiet()
            .run()
            .context("the types of the Python package do not hold")?;
        cmd!(shell, "{python} -m basedpyright --pythonpath {python} --warnings")
            .quiet()
            .run()
            .context("pyright finds fault with the types of the Python package")?;
        cmd!(shell, "{python} -m mypy.stubtest gmhm._gmhm --ignore-disjoint-bases")
            .quiet()
            .run()
            .context("the stubs of the native module are not what it has")?;
    }
    println!("python: the package installs, its tests pass, its types hold, its notebook runs");
    Ok(())
}

/// Installs the package by pip, built in a profile of cargo by the maturin of the environment.
fn install(shell: &Shell, python: &Path, profile: &str) -> Result<()> {
    let _arguments = shell.push_env("MATURIN_PEP517_ARGS", format!("--profile {profile} --locked"));
    let programs = python.parent().unwrap_or(python).to_string_lossy().into_owned();
    let _path = shell.push_env("PATH", format!("{programs}:{}", shell.var("PATH").unwrap_or_default()));
    let pip = ["-m", "pip", "--quiet", "--disable-pip-version-check"];
    let options = ["--no-deps", "--no-build-isolation", "--force-reinstall"];
    cmd!(shell, "{python} {pip...} install {options...} ./{FOLDER}")
        .quiet()
        .run()
        .context("pip does not install the Python package")
}
