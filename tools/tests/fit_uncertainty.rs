//! Reported standard deviations against the scatter of refits, and what a recording cannot tell.

use crate::gears::{
    Path, cycle, given, published, record, refits, scatter_cases, scatter_over_reported, stroke, with_coloured_noise,
    with_rate,
};
use gmhm::Memory;
use gmhm_tools::fit::FitOptions;
use gmhm_tools::fit::{Fit, fit};
use gmhm_tools::numerics::bounded::Bound;
use gmhm_tools::numerics::mark::Mark;
use gmhm_tools::recording::Recording;
use gmhm_tools::regression::columns::{Column, Columns, Contribution, Evaluate, Offset, Stretch};
use gmhm_tools::regression::note::{Note, Remedy};
use gmhm_tools::regression::problem::{Problem, Sweep};
use gmhm_tools::regression::rows::{Past, Rows};
use gmhm_tools::regression::uncertainty::of_columns;
use rayon::prelude::*;

const A: f64 = 1.168e-3;

#[test]
fn standard_deviations_agree_with_the_scatter_of_refits() {
    for case in scatter_cases() {
        // 500 leave 3 % unsure.
        let count = if case.steps.1 > 0.0 { 1000 } else { 500 };
        let fits = refits(A, &case, count).unwrap();
        for name in case.names {
            let ratio = scatter_over_reported(&fits, name);
            let told = format!("{case}: {name}: scatter/reported {ratio:.3}");
            println!("{told}");
            assert!((ratio - 1.0).abs() < 0.15, "{told}");
        }
    }
}

#[test]
fn what_is_at_its_bound_makes_the_others_no_better_known() {
    // e is half its standard deviation from its bound.
    let (elastic, memory) = published();
    let memory = Memory { beta_per_s: 0.96, ..memory };
    let path = || Path { theta: stroke(A, 1500), period_s: 1e-2 };
    let refit = |seed: u64| fit(&[record(A, elastic, memory, &path(), 0.1, seed)], &given(A, memory), &()).unwrap();
    let fits: Vec<Fit> = (0..300).into_par_iter().map(refit).collect();
    let within = |fit: &&Fit| {
        let c1 = fit.parameter("c1_nm_per_rad").unwrap();
        (c1.value - elastic.c1_nm_per_rad).abs() < 2.0 * c1.sd.unwrap()
    };
    let share = fits.iter().filter(within).count() as f64 / fits.len() as f64;
    println!("c1 within two standard deviations: {share:.3}");
    assert!(share > 0.93, "{share}");
    let bounded: Vec<_> = fits.iter().map(|fit| fit.parameter("e").unwrap()).filter(|e| e.at_bound).collect();
    assert!((50..150).contains(&bounded.len()), "{}", bounded.len());
    assert!(bounded.iter().all(|e| e.sd.is_none()
        && matches!(e.note, Some(Note::NoEffect { upper_limit: Some(limit) }) if limit.to_string().starts_with('2'))));
}

#[test]
fn a_quasi_static_loop_gives_no_error_to_what_it_does_not_fix() {
    let (elastic, memory) = published();
    let recording = record(A, elastic, memory, &Path { theta: cycle(A, 64, 1.0), period_s: 0.1 }, 0.1, 3);
    let found = fit(&[recording], &given(A, memory), &()).unwrap();
    for name in ["alpha", "beta_per_s", "omega_per_s"] {
        let parameter = found.parameter(name).unwrap();
        assert!(parameter.sd.is_none() && parameter.undetermined, "{parameter:?}");
    }
    for name in ["e", "h", "rho", "c1_nm_per_rad"] {
        assert!(found.parameter(name).unwrap().sd.is_some(), "{name}");
    }
    let c3 = found.parameter("c3_nm_per_rad5").unwrap();
    assert!(c3.undetermined && c3.note.is_some_and(|note| note.remedy() == Some(Remedy::Amplitudes)), "{c3:?}");
}

#[test]
fn a_rated_deflection_taken_from_the_samples_is_as_unsure_as_its_tip() {
    let (elastic, memory) = published();
    let options = || FitOptions { rated_deflection_rad: None, ..FitOptions::default() };
    let mut beyond = 0;
    for seed in 0..20_u64 {
        // Samples miss the tips by another part of a period each time.
        let cycles = 2.0 + 0.02 * (0.618 * seed as f64).fract();
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, 200, cycles), period_s: 1e-2 }, 0.05, seed);
        let recordings = [recording];
        let found = fit(&recordings, &options(), &()).unwrap();
        let given = fit(&recordings, &FitOptions { rated_deflection_rad: Some(A), ..options() }, &()).unwrap();
        let [e, known] = [&found, &given].map(|fit| fit.parameter("e").unwrap().clone());
        assert!(found.rated_is_largest_seen && e.sd > known.sd, "{e:?} {known:?}");
        beyond += usize::from((e.value - memory.e()).abs() > 2.0 * e.sd.unwrap());
    }
    assert!(beyond <= 2, "{beyond} of 20 beyond two standard deviations");
}

#[test]
fn a_known_rate_fixes_beta() {
    let (elastic, _) = published();
    let time = with_rate();
    let recording = record(A, elastic, time, &Path { theta: stroke(A, 2000), period_s: 1e-2 }, 0.05, 3);
    let found = fit(&[recording], &given(A, time), &()).unwrap();
    let beta = found.parameter("beta_per_s").unwrap();
    assert!(!beta.undetermined && (beta.value - 2.5).abs() < 4.0 * beta.sd.unwrap(), "{beta:?}");
}

#[test]
fn a_bound_that_holds_is_said() {
    let (elastic, memory) = published();
    let spring = Memory { alpha: 0.0, ..memory };
    let recording = record(A, elastic, spring, &Path { theta: cycle(A, 200, 2.0), period_s: 0.1 }, 0.1, 8);
    let found = fit(&[recording], &given(A, memory), &()).unwrap();
    for parameter in found.uncertainty.parameters.iter().filter(|p| matches!(p.name.as_ref(), "e" | "h")) {
        assert!(parameter.value >= 0.0);
        assert!(parameter.value > 0.0 || parameter.at_bound, "{parameter:?}");
        assert!(parameter.at_bound || parameter.undetermined, "{parameter:?}");
    }
}

/// A slow sine and a slow square wave, as two columns.
struct Waves([Column; 2]);

impl Contribution for Waves {
    fn columns(&self) -> &[Column] {
        &self.0
    }

    fn start<'a>(&'a self, _: &[f64], _: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(AtWork)
    }
}

struct AtWork;

impl Evaluate for AtWork {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for (at, row) in stretch.range.clone().enumerate() {
            let phase = row as f64 / 40.0;
            columns.set(at, &[phase.sin(), (0.7 * phase).cos().signum()]);
        }
    }
}

#[test]
fn without_a_noise_model_the_scatter_of_blocks_gives_standard_deviations() {
    let waves = Waves(["sine", "square"].map(|name| Column::of_gear(name, "N·m", Bound::Free)));
    let count = 4800;
    let quiet = Recording {
        time_s: (0..count).map(|k| k as f64).collect(),
        torque: Some(vec![0.0; count].into()),
        ..Recording::default()
    };
    let found: Vec<Vec<(f64, f64)>> = (0..400)
        .map(|seed| {
            let recording = with_coloured_noise(&quiet, 0.9, 0.1, seed);
            let rows = [Rows {
                recording: &recording,
                deflection_rad: (&[][..]).into(),
                torque: recording.torque.as_deref().unwrap().into(),
                marks: vec![Mark::Used; count],
                past: Past::Rest,
                counts: None,
            }];
            let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: vec![&Offset, &waves] };
            let linear = problem.solve(&[], Sweep::PLAIN).0;
            let known = of_columns(&problem, &[], &linear, None, Some(Remedy::Amplitudes));
            known.parameters.iter().map(|p| (p.value, p.sd.unwrap())).collect()
        })
        .collect();
    for (k, column) in waves.0.iter().enumerate() {
        let scatter = (found.iter().map(|f| f[k].0.powi(2)).sum::<f64>() / found.len() as f64).sqrt();
        let reported = (found.iter().map(|f| f[k].1.powi(2)).sum::<f64>() / found.len() as f64).sqrt();
        println!("{}: scatter/reported {:.3}", column.name, scatter / reported);
        assert!((scatter / reported - 1.0).abs() < 0.15, "{}: {scatter} {reported}", column.name);
    }
}
