//! The Python package: installed by pip, tested by pytest, its types checked by mypy and pyright, its notebook run.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

use crate::program::{self, Profile};
use crate::python::environment;
use crate::skips::skipped;

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

/// What a user's pip installs beside the package: to build it, and with it.
const OF_A_USER: [&str; 2] = [PACKAGES[0], PACKAGES[1]];

/// What a user does first.
const FIRST_STEPS: &str = "
import gmhm
recording = gmhm.read(EXAMPLE)
fit = gmhm.fit(recording, rated_deflection_rad=1.168e-3, compare=False)
assert fit.rows == len(recording) and fit.model.predict(recording).torque.shape == (fit.rows,)
print(gmhm.__file__)
";

/// All of them are installed.
const IMPORTS: &str =
    "maturin, numpy, scipy, pandas, polars, matplotlib, pytest, mypy, basedpyright, nbclient, nbformat, ipykernel";

/// Installs the package into an environment of its own and tests it; with `timed` instead builds it in release and measures what it adds to the program's own time.
pub fn run(shell: &Shell, timed: bool) -> Result<()> {
    let Some(python) = environment(shell, "python", &PACKAGES, IMPORTS)? else { return Ok(()) };
    let profile = Profile::timed(timed);
    let gmhm = program::gmhm(shell, profile)?;
    install(shell, &python, profile)?;
    let script = |name: &str| format!("{FOLDER}/tests/{name}");
    if timed {
        let measure = script("measure.py");
        let output = cmd!(shell, "{python} {measure} {gmhm}").quiet().read().context("the measurement fails")?;
        output.lines().for_each(|line| println!("python: {line}"));
        return Ok(());
    }
    {
        let _folder = shell.push_dir(FOLDER);
        let _program = shell.push_env("GMHM", &gmhm);
        let _cache = shell.push_env("MYPY_CACHE_DIR", program::target(shell).join("mypy"));
        let _sources = shell.push_env("PYTHONDONTWRITEBYTECODE", "1");
        cmd!(shell, "{python} -m pytest --quiet -rs -p no:cacheprovider")
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
    fresh(shell)
}

/// Installs the package as docs/python.md says into an environment that has nothing else, and takes the first steps there. Only the profile is not a
/// user's: what was built for the tests is taken.
fn fresh(shell: &Shell) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let [home, constraints] = ["home", "constraints.txt"].map(|name| folder.path().join(name));
    let python = home.join("bin/python");
    shell.write_file(&constraints, OF_A_USER.join("\n"))?;
    let _constraints = shell.push_env("PIP_CONSTRAINT", &constraints);
    cmd!(shell, "python3 -m venv {home}").quiet().run().context("python3 makes no environment")?;
    let pip = ["-m", "pip", "--quiet", "--disable-pip-version-check", "install"];
    if let Err(error) = cmd!(shell, "{python} {pip...} --dry-run {OF_A_USER...}").quiet().run() {
        skipped("pip install ./tools/python into a fresh environment", &format!("pip finds no package: {error}"));
        return Ok(());
    }
    {
        let _arguments = shell.push_env("MATURIN_PEP517_ARGS", "--profile dev --locked");
        cmd!(shell, "{python} {pip...} ./{FOLDER}")
            .quiet()
            .run()
            .with_context(|| format!("`pip install ./{FOLDER}` fails in a fresh environment"))?;
    }
    let recording = shell.current_dir().join("examples/bench/cycle.csv");
    let steps = FIRST_STEPS.replace("EXAMPLE", &format!("{:?}", recording.display().to_string()));
    let _inside = shell.push_dir(folder.path());
    let module = cmd!(shell, "env -i PATH=/usr/bin:/bin {python} -W ignore -c {steps}")
        .quiet()
        .read()
        .context("the package does not work in a fresh environment")?;
    ensure!(Path::new(module.trim()).starts_with(&home), "the fresh environment imports {module}");
    println!("python: `pip install ./{FOLDER}` in a fresh environment, then import and fit");
    Ok(())
}

/// Installs the package by pip, built in a profile of cargo by the maturin of the environment.
fn install(shell: &Shell, python: &Path, profile: Profile) -> Result<()> {
    let profile = profile.name();
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
