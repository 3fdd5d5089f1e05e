//! Every number of the README's table of identification: `cargo bench -p gmhm-tools --bench identification [-- PART…] [COUNT]`.
//!
//! Parts: `speed`, `uncertainty`, `peers`, `plants`; all without any. COUNT: refits of `uncertainty` (2000) and seeds of `peers` (20). All data are synthetic and
//! seeded, but for the friction damper, whose recordings are read where they lie beside the checkout.

#[path = "../../tests/gears/mod.rs"]
mod gears;
mod peers;
mod plants;
mod speed;
mod uncertainty;

/// Rated deflection of the published gear, rad.
const A: f64 = 1.168e-3;

/// A count of an output encoder of some 20 bits, rad.
const COUNT_RAD: f64 = 8e-6;

/// A line of the README's table.
struct Line {
    what: String,
    aim: &'static str,
    measured: String,
}

impl Line {
    fn new(what: impl Into<String>, aim: &'static str, measured: impl Into<String>) -> Self {
        Self { what: what.into(), aim, measured: measured.into() }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let count: Option<usize> = words.iter().find_map(|word| word.parse().ok());
    let parts: Vec<&String> = words.iter().filter(|word| word.parse::<usize>().is_err()).collect();
    let asked = |part: &str| parts.is_empty() || parts.iter().any(|word| *word == part);
    let mut lines = Vec::new();
    // First, because the peak of the memory is that of the whole process.
    if asked("speed") {
        lines.extend(speed::measure()?);
    }
    if asked("uncertainty") {
        lines.extend(uncertainty::measure(count.unwrap_or(2000))?);
    }
    if asked("peers") {
        peers::measure(count.unwrap_or(20))?;
    }
    if asked("plants") {
        plants::measure()?;
    }
    println!("\n| what | aim | measured |\n|---|---|---|");
    for Line { what, aim, measured } in &lines {
        println!("| {what} | {aim} | {measured} |");
    }
    Ok(())
}
