//! GMHM beside the other models on several natures: `cargo bench -p gmhm-tools --bench compare_natures`.
//!
//! Its own (synthetic, the published gear, three amplitudes), one with a rate (synthetic, law `time`, three rates), a foreign one (synthetic, 24 slip elements
//! beside a hardening spring), and a real friction damper where its recordings lie beside the checkout. The last column but one predicts each recording, an
//! amplitude or a rate not seen, from the others.

use std::path::Path as FilePath;

use gmhm::{Gate, Kernel, Law, Memory};
use gmhm_tools::estimate::FitOptions;
use gmhm_tools::estimate::rivals::compare;
use gmhm_tools::recording::{ColumnMap, Needs, Recording, read};

#[path = "../tests/gears/mod.rs"]
mod gears;

use gears::{Path, cycle, foreign, published, record};

const A: f64 = 1.168e-3;
const SIZES: [f64; 3] = [0.4, 0.7, 1.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (elastic, memory) = published();
    let motion = |size: f64, period_s: f64| Path { theta: cycle(size * A, 1500, 2.5), period_s };
    let own = SIZES.map(|size| record(A, elastic, memory, &motion(size, 1e-2), 0.02, (10.0 * size) as u64));
    table("GMHM's own nature: the published gear at three amplitudes (synthetic)", &own, Some(A))?;

    let rate = Memory { law: Law::Time, kernel: Kernel::Rate, gate: Gate::None, alpha: 5e3, beta_per_s: 2.5, ..memory };
    let rates = [1e-3, 4e-3, 16e-3].map(|period_s| record(A, elastic, rate, &motion(1.0, period_s), 0.02, 7));
    table("A gear with a rate: law time, three rates (synthetic)", &rates, Some(A))?;

    let slip = SIZES.map(|size| foreign(A, size, (10.0 * size) as u64));
    table("A foreign gear: 24 slip elements, three amplitudes (synthetic)", &slip, Some(A))?;

    let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let map =
        "time_s=t_s,deflection_rad=disp_m,torque_nm=force_kN".split(',').map(str::parse).collect::<Result<_, _>>()?;
    let map = ColumnMap::new(map)?;
    let files = ["0.25Hz30lbtension0.5amplitude", "0.25Hz30lbtension1amplitude", "1Hz30lbtension1amplitude"];
    let files = files.map(|name| folder.join(format!("friction_damper_{name}.csv")));
    if let Some(missing) = files.iter().find(|file| !file.is_file()) {
        println!("\nThe friction damper is left out: {} is not on this machine", missing.display());
        return Ok(());
    }
    let damper = files.iter().map(|file| read(file, &map, &Needs::FIT, &|_| {})).collect::<Result<Vec<_>, _>>()?;
    table("A real friction damper: two amplitudes, two rates (force in kN for N·m)", &damper, None)
}

fn table(title: &str, recordings: &[Recording], rated: Option<f64>) -> Result<(), Box<dyn std::error::Error>> {
    let lines =
        compare(recordings, &FitOptions { rated_deflection_rad: rated, seed: 1, ..FitOptions::default() }, &())?;
    println!("\n{title}");
    println!(
        "  {:<28} {:>10} {:>12} {:>10} {:>10} {:>16} {:>12}",
        "model", "parameters", "sum of sq.", "rms", "held out", "unseen recording", "instructions"
    );
    for line in lines {
        println!(
            "  {:<28} {:>10} {:>12.3} {:>10.4} {:>10.4} {:>16.4} {:>12}",
            line.model,
            line.parameters,
            line.rss,
            line.rms,
            line.heldout_rms,
            line.unseen_recording_rms.unwrap_or(f64::NAN),
            line.instructions.map_or("-".to_owned(), |count| count.to_string())
        );
    }
    Ok(())
}
