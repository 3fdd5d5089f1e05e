//! Reported standard deviations against the scatter of refits, and what a recording cannot tell.

mod gears;

use gears::{Path, cycle, published, record};
use gmhm::{Gate, Kernel, Law, Memory};
use gmhm_tools::estimate::bounded::Bound;
use gmhm_tools::estimate::columns::{Column, Columns, Contribution, Evaluate, Mark, Offset, Past, Rows, Stretch};
use gmhm_tools::estimate::problem::Problem;
use gmhm_tools::estimate::uncertainty::of_columns;
use gmhm_tools::estimate::{Fit, FitOptions, fit};
use gmhm_tools::model::Model;
use gmhm_tools::recording::Recording;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const A: f64 = 1.168e-3;

fn given(memory: Memory) -> FitOptions {
    let mut start = Model { elastic: Some(published().0), memory: Some(memory), ..Model::default() };
    start.gear.rated_deflection_rad = Some(A);
    FitOptions { start: Some(start), ..FitOptions::default() }
}

/// Two amplitudes at two rates.
fn stroke(count: usize) -> Vec<f64> {
    let mut path = cycle(A, count / 2, 2.0);
    path.extend(cycle(0.6 * A, count - count / 2, 5.0));
    path
}

fn with_coloured_noise(recording: &Recording, phi: f64, sd: f64, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = 0.0;
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut recording = recording.clone();
    for (row, torque) in recording.torque.iter_mut().flatten().enumerate() {
        let start = if row == 0 { 1.0 / (1.0 - phi * phi).sqrt() } else { 1.0 };
        noise = phi * noise + sd * start * normal();
        *torque += noise;
    }
    recording
}

/// Scatter of the values over mean reported standard deviation.
fn scatter_over_reported(fits: &[Fit], name: &str) -> f64 {
    let found: Vec<(f64, f64)> =
        fits.iter().map(|f| f.parameter(name).map(|p| (p.value, p.sd.unwrap())).unwrap()).collect();
    let count = found.len() as f64;
    let mean = found.iter().map(|f| f.0).sum::<f64>() / count;
    let scatter = (found.iter().map(|f| (f.0 - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    scatter / (found.iter().map(|f| f.1).sum::<f64>() / count)
}

#[test]
fn standard_deviations_agree_with_the_scatter_of_500_refits() {
    let (elastic, masing) = published();
    let phase = Memory { law: Law::Phase, ..masing };
    let time = Memory {
        law: Law::Time,
        kernel: Kernel::Rate,
        gate: Gate::None,
        alpha: 5e3,
        beta_per_s: 2.5,
        omega_per_s: 0.0,
        ..masing
    };
    for (memory, names) in [
        (masing, &["c1_nm_per_rad", "c3_nm_per_rad5", "e", "h", "rho"][..]),
        (phase, &["c1_nm_per_rad", "h", "rho"]),
        (time, &["c1_nm_per_rad", "alpha", "beta_per_s"]),
    ] {
        for (phi, count) in [(0.0, 400), (0.9, 1200)] {
            if phi == 0.0 && memory.law != Law::Masing {
                continue;
            }
            let path = Path { theta: stroke(count), period_s: 1e-2 };
            let clean = record(A, elastic, memory, &path, 0.0, 0);
            let fits: Vec<Fit> = (0..500)
                .map(|seed| fit(&[with_coloured_noise(&clean, phi, 0.1, seed)], &given(memory), &()).unwrap())
                .collect();
            for name in names {
                let ratio = scatter_over_reported(&fits, name);
                println!("{:?}, noise AR(1) {phi}: {name}: scatter/reported {ratio:.3}", memory.law);
                assert!(
                    (ratio - 1.0).abs() < 0.15,
                    "{:?}, noise AR(1) {phi}: {name}: scatter/reported {ratio}",
                    memory.law
                );
            }
        }
    }
}

#[test]
fn a_quasi_static_loop_gives_no_error_to_what_it_does_not_fix() {
    let (elastic, memory) = published();
    let recording = record(A, elastic, memory, &Path { theta: cycle(A, 64, 1.0), period_s: 0.1 }, 0.1, 3);
    let found = fit(&[recording], &given(memory), &()).unwrap();
    for name in ["alpha", "beta_per_s", "omega_per_s"] {
        let parameter = found.parameter(name).unwrap();
        assert!(parameter.sd.is_none() && parameter.undetermined, "{parameter:?}");
    }
    for name in ["e", "h", "rho", "c1_nm_per_rad"] {
        assert!(found.parameter(name).unwrap().sd.is_some(), "{name}");
    }
    let c3 = found.parameter("c3_nm_per_rad5").unwrap();
    assert!(c3.undetermined && c3.note.as_deref().is_some_and(|n| n.contains("several amplitudes")), "{c3:?}");
}

#[test]
fn a_known_rate_fixes_beta() {
    let (elastic, memory) = published();
    let time = Memory {
        law: Law::Time,
        kernel: Kernel::Rate,
        gate: Gate::None,
        alpha: 5e3,
        beta_per_s: 2.5,
        omega_per_s: 0.0,
        ..memory
    };
    let recording = record(A, elastic, time, &Path { theta: stroke(2000), period_s: 1e-2 }, 0.05, 3);
    let found = fit(&[recording], &given(time), &()).unwrap();
    let beta = found.parameter("beta_per_s").unwrap();
    assert!(!beta.undetermined && (beta.value - 2.5).abs() < 4.0 * beta.sd.unwrap(), "{beta:?}");
}

#[test]
fn a_bound_that_holds_is_said() {
    let (elastic, memory) = published();
    let spring = Memory { alpha: 0.0, ..memory };
    let recording = record(A, elastic, spring, &Path { theta: cycle(A, 200, 2.0), period_s: 0.1 }, 0.1, 8);
    let found = fit(&[recording], &given(memory), &()).unwrap();
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
        torque: Some(vec![0.0; count]),
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
            }];
            let problem = Problem { rows: &rows, corrections: Vec::new(), contributions: vec![&Offset, &waves] };
            let known = of_columns(&problem, &[], None, "");
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
