//! Fit and compare on recordings of real machines, where the folder `shared/recordings` lies beside the checkout.

use std::path::{Path, PathBuf};

use crate::common::skips::real_recording;
use crate::common::{Done, WorkDir};

const DAMPER: &str = "--map time_s=t_s,deflection_rad=disp_m,torque_nm=force_kN";

fn succeed(dir: &WorkDir, command: &str, files: &[&PathBuf], rest: &str) -> Done {
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    dir.succeed(&format!("{command} {} {DAMPER} {rest}", files.join(" ")))
}

#[test]
fn the_friction_damper_is_fitted() {
    let Some(rec) = real_recording("friction_damper_0.25Hz30lbtension1amplitude.csv") else { return };
    let dir = WorkDir::new();
    succeed(&dir, "fit", &[&rec], "-o damper.toml --json fit.json");
    let fit: serde_json::Value = serde_json::from_str(&dir.read("fit.json")).unwrap();
    let rms = fit["rms"].as_f64().expect("an rms");
    let force = column_rms(&rec, 2);
    // A damper with backlash is no harmonic drive: most of the force is explained, not all.
    assert!(rms < 0.5 * force, "{rms} kN of {force} kN left");
    succeed(&dir, "predict damper.toml", &[&rec], "-o out.csv");
}

#[test]
fn the_friction_damper_is_compared() {
    let (Some(one), Some(other)) = (
        real_recording("friction_damper_0.25Hz30lbtension1amplitude.csv"),
        real_recording("friction_damper_1Hz30lbtension1amplitude.csv"),
    ) else {
        return;
    };
    let dir = WorkDir::new();
    succeed(&dir, "compare", &[&one, &other], "--json compare.json");
    let table: serde_json::Value = serde_json::from_str(&dir.read("compare.json")).unwrap();
    let text = table.to_string();
    for model in ["GMHM", "Dahl", "Bouc", "Maxwell"] {
        assert!(text.contains(model), "{model} is missing: {text}");
    }
}

/// Root mean square of a column of a recording as it lies in the file.
fn column_rms(path: &Path, column: usize) -> f64 {
    let text = std::fs::read_to_string(path).expect("a recording");
    let values: Vec<f64> =
        text.lines().skip(1).filter_map(|line| line.split(',').nth(column)?.trim().parse().ok()).collect();
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// A model file that gives `fit` law masing, as docs/adaptation.md has it.
const MASING: &str = "format = 1\nname = \"law masing\"\n[gear]\nrated_deflection_rad = 0.055\n\
    [elastic]\nc1_nm_per_rad = 1\nc2_nm_per_rad3 = 0\nc3_nm_per_rad5 = 0\n\
    [memory]\nlaw = \"masing\"\nalpha = 1\nbeta_per_s = 1\nomega_per_s = 1\n";

/// The first half fitted, the second adapted to: no worse than the block.
#[test]
fn cycloidal_reducers_are_predicted_no_worse_than_by_their_block() {
    for name in ["base_init_pos1", "base_init_pos1_repeat", "conic_pre1", "conic_pre5"] {
        let Some(rec) = real_recording(&format!("cyclo_{name}.csv")) else { return };
        let (dir, rec) = (WorkDir::new(), rec.display());
        dir.write("masing.toml", MASING);
        dir.succeed(&format!("fit {rec} --model masing.toml --to 40 -o block.toml"));
        assert!(dir.read("block.toml").contains("law = \"masing\""), "{name}");
        dir.succeed(&format!("adapt block.toml {rec} --from 40 -o adapted.toml --json adapted.json"));
        let found: serde_json::Value = serde_json::from_str(&dir.read("adapted.json")).unwrap();
        let [block, adapted] = ["block", "adapted"].map(|of| found["rms"][of].as_f64().expect("an rms"));
        assert!(adapted <= block, "{name}: {adapted} for {block} N·m");
    }
}
