//! Exported FMUs in FMPy and in libcosim, beside `gmhm predict`.

use anyhow::{Context, Result};
use xshell::{Shell, cmd};

use crate::program::{self, Profile};
use crate::python::environment;

/// From the package index.
const FMPY: &str = "fmpy==0.3.32";

/// The co-simulation engine of the Open Simulation Platform, which reads FMUs by the FMI Library.
const LIBCOSIM: &str = "libcosimpy==0.0.6";

/// Its script.
const COSIM_SCRIPT: &str = "tools/tests/exported/cosim.py";

/// The script that checks in FMPy, the model, and a recording of its gear.
const SCRIPT: &str = "tools/tests/exported/fmu.py";
const MODEL: &str = "tools/tests/exported/gear_with_terms.toml";
const RECORDING: &str = "examples/bench/running.csv";

/// Laws beside that of the model, which is `masing`.
const LAWS: [&str; 2] = ["phase", "time"];

/// The example that couples a gear with a motor and a link, and its gear.
const EXAMPLE: &str = "examples/fmu/joint.py";
const GEAR: &str = "examples/bench/true_gear.toml";

/// Exports the model as FMUs and predicts the recording, then compares both in FMPy and in libcosim.
pub fn run(shell: &Shell) -> Result<()> {
    let Some(python) = environment(shell, "fmpy", &[FMPY], "fmpy")? else { return Ok(()) };
    let folder = shell.create_temp_dir()?;
    let folder = folder.path();
    for (from, to) in [(RECORDING, "rec.csv"), (MODEL, "gear.toml"), (GEAR, "plain.toml")] {
        shell.copy_file(from, folder.join(to))?;
    }
    let text = shell.read_file(MODEL)?;
    // A softer spring and half the friction, and a recording without a deflection.
    let tuned = text.replace("2.4737e4", "22263.3").replace("torque_nm = 0.3", "torque_nm = 0.15");
    shell.write_file(folder.join("tuned.toml"), tuned)?;
    shell.write_file(folder.join("of_angles.csv"), without_column(&shell.read_file(RECORDING)?, "deflection_rad"))?;
    let mut commands = vec![
        "export gear.toml --to fmu -o gear.fmu".to_owned(),
        "export gear.toml --to fmu --angles -o angles.fmu".to_owned(),
        "export plain.toml --to fmu -o plain.fmu".to_owned(),
        "predict gear.toml rec.csv -o predicted.csv".to_owned(),
        "predict gear.toml of_angles.csv -o angles.csv".to_owned(),
        "predict tuned.toml rec.csv -o tuned.csv".to_owned(),
    ];
    for law in LAWS {
        let of_law = text.replace("[memory]\n", &format!("[memory]\nlaw = \"{law}\"\n"));
        shell.write_file(folder.join(format!("{law}.toml")), of_law)?;
        commands.push(format!("export {law}.toml --to fmu -o {law}.fmu"));
        commands.push(format!("predict {law}.toml rec.csv -o {law}.csv"));
    }
    let program = program::gmhm(shell, Profile::Dev)?;
    {
        let _inside = shell.push_dir(folder);
        for command in &commands {
            let words = command.split(' ');
            let done = cmd!(shell, "{program} --quiet {words...}").quiet().run();
            done.with_context(|| format!("`gmhm {command}` fails"))?;
        }
    }
    let output = cmd!(shell, "{python} {SCRIPT} {folder}")
        .quiet()
        .read()
        .context("the FMU does not agree with `gmhm predict`")?;
    println!("export: FMU in FMPy: {output}");
    if let Some(python) = environment(shell, "libcosim", &[LIBCOSIM], "libcosimpy")? {
        let output = cmd!(shell, "{python} {COSIM_SCRIPT} {folder}")
            .quiet()
            .read()
            .context("the FMU in libcosim does not agree with `gmhm predict`")?;
        println!("export: FMU in libcosim: {output}");
    }
    let gear = folder.join("plain.fmu");
    cmd!(shell, "{python} {EXAMPLE} {gear}")
        .quiet()
        .ignore_stdout()
        .run()
        .context("the example of a flexible joint fails")?;
    println!("export: {EXAMPLE} runs");
    Ok(())
}

/// A CSV without one of its columns.
fn without_column(text: &str, name: &str) -> String {
    let index = text.lines().next().and_then(|header| header.split(',').position(|column| column == name));
    let keep = |line: &str| -> String {
        let cells = line.split(',').enumerate().filter(|(k, _)| Some(*k) != index).map(|(_, cell)| cell);
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(keep).collect()
}
