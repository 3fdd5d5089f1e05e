//! GMHM beside the other models on several plants.
//!
//! Its own (synthetic, the published gear, three amplitudes), one with a rate (synthetic, law `time`, three rates), a foreign one (synthetic, 24 slip elements
//! beside a hardening spring), and a real friction damper where its recordings lie beside the checkout. The unseen column predicts each recording, an amplitude or
//! a rate not seen, from the others.

use std::path::Path as FilePath;

use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::comparison::{Comparison, compare};
use gmhm_tools::recording::{ColumnMap, Needs, Recording, read};

use super::A;
use super::gears::{Path, cycle, foreign, published, record, with_rate};

const SIZES: [f64; 3] = [0.4, 0.7, 1.0];

pub fn measure() -> Result<(), Box<dyn std::error::Error>> {
    let (elastic, memory) = published();
    let motion = |size: f64, period_s: f64| Path { theta: cycle(size * A, 1500, 2.5), period_s };
    let own = SIZES.map(|size| record(A, elastic, memory, &motion(size, 1e-2), 0.02, (10.0 * size) as u64));
    let rates = [1e-3, 4e-3, 16e-3].map(|period_s| record(A, elastic, with_rate(), &motion(1.0, period_s), 0.02, 7));
    let slip = SIZES.map(|size| foreign(A, size, (10.0 * size) as u64));
    let mut plants = vec![
        ("own gear", table("GMHM's own nature: the published gear at three amplitudes (synthetic)", &own, Some(A))?),
        ("rate", table("A gear with a rate: law time, three rates (synthetic)", &rates, Some(A))?),
        ("24 slip elements", table("A foreign gear: 24 slip elements, three amplitudes (synthetic)", &slip, Some(A))?),
    ];
    match damper()? {
        Ok(damper) => {
            let title = "A real friction damper: two amplitudes, two rates (force in kN for N·m)";
            plants.push(("friction damper", table(title, &damper, None)?));
        }
        Err(missing) => println!("\nThe friction damper is left out: {missing} is not on this machine"),
    }
    summary(&plants);
    Ok(())
}

/// The recordings of the damper, or the path that is missing.
fn damper() -> Result<Result<Vec<Recording>, String>, Box<dyn std::error::Error>> {
    let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let map =
        "time_s=t_s,deflection_rad=disp_m,torque_nm=force_kN".split(',').map(str::parse).collect::<Result<_, _>>()?;
    let map = ColumnMap::new(map)?;
    let files = ["0.25Hz30lbtension0.5amplitude", "0.25Hz30lbtension1amplitude", "1Hz30lbtension1amplitude"];
    let files = files.map(|name| folder.join(format!("friction_damper_{name}.csv")));
    if let Some(missing) = files.iter().find(|file| !file.is_file()) {
        return Ok(Err(missing.display().to_string()));
    }
    Ok(Ok(files.iter().map(|file| read(file, &map, &Needs::FIT, &|_| {})).collect::<Result<_, _>>()?))
}

fn table(
    title: &str,
    recordings: &[Recording],
    rated: Option<f64>,
) -> Result<Vec<Comparison>, Box<dyn std::error::Error>> {
    let lines =
        compare(recordings, &FitOptions { rated_deflection_rad: rated, seed: 1, ..FitOptions::default() }, &())?;
    println!("\n{title}");
    println!(
        "  {:<28} {:>10} {:>12} {:>10} {:>10} {:>16} {:>12}",
        "model", "parameters", "sum of sq.", "rms", "held out", "unseen recording", "instructions"
    );
    for line in &lines {
        println!(
            "  {:<28} {:>10} {:>12.3} {:>10.4} {:>10.4} {:>16.4} {:>12}",
            line.model,
            line.parameters,
            line.rss,
            line.rms,
            line.heldout_rms,
            line.unseen_recording_rms.unwrap_or(f64::NAN),
            instructions(line)
        );
    }
    Ok(lines)
}

fn instructions(line: &Comparison) -> String {
    line.instructions.map_or("-".to_owned(), |count| count.to_string())
}

/// The README's table: what each model leaves of a recording that it has not seen. GMHM's structure differs by nature, and so do its parameters and cost.
fn summary(plants: &[(&str, Vec<Comparison>)]) {
    let Some((_, first)) = plants.first() else { return };
    let names: Vec<&str> = plants.iter().map(|(name, _)| *name).collect();
    println!("\n| model | parameters | instructions | {} |", names.join(" | "));
    println!("|---|---|---|{}", "---|".repeat(names.len()));
    for row in 0..first.len() {
        let unseen = plants.iter().map(|(_, lines)| {
            let line = &lines[row];
            let left = format!("{:.4}", line.unseen_recording_rms.unwrap_or(f64::NAN));
            let own = line.model.strip_prefix("GMHM ");
            own.map_or(left.clone(), |structure| {
                format!("{left} (`{structure}`, {} par., {} instr.)", line.parameters, instructions(line))
            })
        });
        let unseen: Vec<String> = unseen.collect();
        let line = &first[row];
        let (name, parameters, cost) = match line.model.split_once(' ') {
            Some(("GMHM", _)) => ("GMHM", "as chosen".to_owned(), "as chosen".to_owned()),
            _ => (line.model.as_str(), line.parameters.to_string(), instructions(line)),
        };
        println!("| {name} | {parameters} | {cost} | {} |", unseen.join(" | "));
    }
}
