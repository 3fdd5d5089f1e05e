//! The host tool as a library: read two recordings, fit a gear, judge it, predict a third, pack a block.
//!
//! `cargo run --package gmhm-tools --example fit`

use std::error::Error;
use std::path::Path;

use gmhm_tools::block::{PackOptions, pack};
use gmhm_tools::fit::verdict::Assessment;
use gmhm_tools::fit::{FitOptions, fit};
use gmhm_tools::number::number;
use gmhm_tools::physics::predict;
use gmhm_tools::recording::{self, ColumnMap, Needs, Reading, Recording};

fn read(name: &str) -> Result<Recording, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/bench").join(name);
    let reading = Reading::new(ColumnMap::default(), Needs::FIT);
    Ok(reading.read(&recording::file(&path)?, &|_| {})?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let recordings = [read("cycle.csv")?, read("amplitudes.csv")?];
    let options = FitOptions { rated_deflection_rad: Some(1.168e-3), ..FitOptions::default() };
    let fitted = fit(&recordings, &options, &())?;
    let assessment = Assessment::of(&fitted, &recordings, &())?;
    println!("verdict: {:?}; held out {:.3} N·m rms", assessment.verdict.grade, fitted.heldout_rms);
    for parameter in fitted.uncertainty.parameters.iter().filter(|parameter| parameter.sd.is_some()) {
        println!("{:<16} {:>14} {}", parameter.name, number(parameter.value, 5), parameter.unit);
    }

    // A recording that took no part: the running motor.
    let running = read("running.csv")?;
    let predicted = predict(&fitted.model, None, &running)?;
    let measured = running.torque.as_deref().unwrap_or_default();
    let squares: f64 = measured.iter().zip(&predicted.torque).map(|(a, b)| (a - b).powi(2)).sum();
    println!(
        "running motor: {:.3} N·m rms without friction and kinematic error",
        (squares / measured.len() as f64).sqrt()
    );

    let packed = pack(&fitted.model, &PackOptions::default())?;
    println!("parameter block: {} bytes", packed.bytes.len());
    Ok(())
}
