//! Whether reported standard deviations are the scatter of refits, and what a quasi-static loop cannot tell.

use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::numerics::mark::Mark;
use gmhm_tools::recording::Recording;
use gmhm_tools::regression::assembly::Assembly;
use gmhm_tools::regression::base::Structure;
use gmhm_tools::regression::error::EstimateError;
use gmhm_tools::regression::problem::Sweep;
use gmhm_tools::regression::rows::{Past, Rows};
use gmhm_tools::regression::uncertainty::Estimated;

use super::gears::{
    Path, cycle, given, hard_cases, off_over_reported, published, record, refits, scatter_cases, scatter_over_reported,
};
use super::{A, COUNT_RAD, Line};

/// e by least squares where counts are taken for deflections.
fn e_of_counts(recording: &Recording) -> Result<f64, EstimateError> {
    let rows = [Rows {
        recording,
        deflection_rad: recording.deflection_rad.as_deref().unwrap_or_default().into(),
        torque: recording.torque.as_deref().unwrap_or_default().into(),
        marks: vec![Mark::Used; recording.len()],
        past: Past::Rest,
        counts: None,
    }];
    let assembly = Assembly::new(Structure::MASING, A, &rows, &[true])?;
    let (linear, _) = assembly.problem(&rows).solve(&[], Sweep::PLAIN);
    Ok(assembly.coefficients(&[], &linear, 1.0).1.e())
}

pub fn measure(count: usize) -> Result<Vec<Line>, EstimateError> {
    println!("\n{:<64} {:<16} scatter of {count} refits over reported", "law, noise", "parameter");
    let (mut plain, mut of_counts) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, 0.0_f64));
    for case in scatter_cases() {
        let fits = refits(A, &case, count)?;
        for name in case.names {
            let ratio = scatter_over_reported(&fits, name);
            let (lowest, highest) = if case.steps.1 > 0.0 { &mut of_counts } else { &mut plain };
            (*lowest, *highest) = (lowest.min(ratio), highest.max(ratio));
            println!("{:<64} {name:<16} {ratio:.3}", case.to_string());
        }
    }
    let (elastic, memory) = published();
    let mut hard = Vec::new();
    for case in hard_cases() {
        let fits = refits(A, &case, count)?;
        for name in case.names {
            let truth = match *name {
                "e" => memory.e(),
                "h" => memory.h(),
                _ => elastic.c1_nm_per_rad,
            };
            let (scatter, off) = (scatter_over_reported(&fits, name), off_over_reported(&fits, name, truth));
            println!("{:<64} {name:<16} {scatter:.3}, off by {off:.2}", case.to_string());
            hard.push(format!("{case}: {name} {scatter:.2}, off by {off:.2}"));
        }
    }
    let draw = |seed| {
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, 64, 1.0), period_s: 0.1 }, 0.1, seed);
        fit(&[recording], &given(A, memory), &())
    };
    let draws: Vec<Fit> = (0..count as u64).map(draw).collect::<Result<_, _>>()?;
    let of_c3 = || draws.iter().filter_map(|fit| fit.parameter("c3_nm_per_rad5"));
    let mean_sd = of_c3().filter_map(|p| p.sd).sum::<f64>() / count as f64;
    let percent = 100.0 * mean_sd / elastic.c3_nm_per_rad5.abs();
    let scatter = percent * scatter_over_reported(&draws, "c3_nm_per_rad5");
    let told = of_c3().filter(|p| p.undetermined).count();
    let found = draw(3)?;
    let mut counted = record(A, elastic, memory, &Path { theta: cycle(A, 4000, 2.0), period_s: 1e-3 }, 0.1, 4);
    counted.deflection_rad.iter_mut().flatten().for_each(|theta| *theta = (*theta / COUNT_RAD).round() * COUNT_RAD);
    let as_it_stands = e_of_counts(&counted)? / memory.e() - 1.0;
    let counted = fit(&[counted], &given(A, memory), &())?;
    let of_e = |p: &Estimated| (100.0 * (p.value / memory.e() - 1.0), 100.0 * p.sd.unwrap_or(f64::NAN) / memory.e());
    let (off, sd) = counted.parameter("e").map_or((f64::NAN, f64::NAN), of_e);
    let relative = |name: &str| {
        let parameter = found.parameter(name);
        let sd = parameter.and_then(|p| Some(100.0 * p.sd? / p.value.abs()));
        sd.map_or("none".to_owned(), |sd| format!("{sd:.1} %"))
    };
    let names = [("alpha", "α"), ("beta_per_s", "β"), ("omega_per_s", "ω"), ("e", "e"), ("h", "h"), ("rho", "β/ω")];
    let listed: Vec<String> = names.iter().map(|(name, symbol)| format!("{symbol} {}", relative(name))).collect();
    let note =
        |name: &str| found.parameter(name).and_then(|p| p.note).map_or_else(String::new, |note| note.to_string());
    Ok(vec![
        Line::new(
            format!(
                "scatter of {count} refits over reported standard deviation; laws masing, phase, time; white and AR(1) 0.9; torque quantised; from rest and settled"
            ),
            "0.85 to 1.15",
            format!("{:.3} to {:.3}", plain.0, plain.1),
        ),
        Line::new(
            "laws masing and phase, the deflection counted in steps of 8 or 15 µrad, two amplitudes or band-limited",
            "0.85 to 1.15",
            format!("{:.3} to {:.3}", of_counts.0, of_counts.1),
        ),
        Line::new(
            "scatter over the standard deviation of harder ones, and what they are off by on average",
            "0.85 to 1.15, 0",
            hard.join("; "),
        ),
        Line::new(
            "standard deviations on one quasi-static loop, 64 rows, σ = 0.1 N·m",
            "none of α, β, ω alone",
            listed.join(", "),
        ),
        Line::new(
            format!(
                "c3 on that loop, {count} draws: reported standard deviation over the true value; scatter; undetermined"
            ),
            "as large as it is; yes",
            format!("{percent:.0} %; {scatter:.0} %; in {told}"),
        ),
        Line::new(
            format!("e of two cycles of 2000 rows, their deflection counted in steps of {:.0} µrad", 1e6 * COUNT_RAD),
            "within its uncertainty",
            format!(
                "off by {off:.1} %, standard deviation {sd:.1} %; fitted as it stands {:.0} %",
                100.0 * as_it_stands
            ),
        ),
        Line::new("what one of them (seed 3) is told", "undetermined, with the experiment", note("c3_nm_per_rad5")),
    ])
}
