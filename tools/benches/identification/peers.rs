//! The fit beside common optimisers on the same file.
//!
//! Published loop from rest, σ = 0.1 N·m, 64 and 2000 points, 20,000 evaluations where a method counts them; `gmhm` with uncertainty. All minimise the sum of
//! squares over (c1, c2, c3, α, β, ω) in the box of `fit::pso`, with the offset taken out; the peers get the columns of e and h ready made.
//! Times are the shortest of all seeds, those of Python in CPU time, as others use the machine too. Success is a sum of squares within 1.01 of the bounded
//! optimum. SciPy and pyswarms run in a virtual environment that this command sets up under the target folder (python3 with venv and a package index are
//! needed; without them the rows are missing and the reason is printed). argmin's swarm seeds itself.

use std::collections::BTreeMap;
use std::path::{Path as FilePath, PathBuf};
use std::process::Command;
use std::time::Instant;

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::particleswarm::ParticleSwarm;
use gmhm::Params;
use gmhm::memory::Frame;
use gmhm::memory::masing::{Path as LoopPath, single_valued_column};
use gmhm_tools::fit::{FitOptions, Method};
use gmhm_tools::fit::{fit, pso};
use gmhm_tools::recording::Recording;

#[path = "../peers/environment.rs"]
mod environment;

use environment::environment;

use super::A;
use super::gears::{Path, cycle, given, published, record};

const EVALUATIONS: usize = 20_000;

struct Runs {
    solver: String,
    seconds: Vec<f64>,
    sse: Vec<f64>,
}

pub fn measure(seeds: usize) -> Result<(), Box<dyn std::error::Error>> {
    let mut summary: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let target = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let python = environment("peers-venv", "requirements.txt");
    if let Err(why) = &python {
        println!("SciPy and pyswarms are left out: {why}");
    }
    for count in [64, 2000] {
        let (elastic, memory) = published();
        let recording = record(A, elastic, memory, &Path { theta: cycle(A, count, 1.0), period_s: 0.1 }, 0.1, 11);
        let rows = columns(&recording);
        let size = rows.iter().fold(0.0_f64, |size, row| size.max(row[5].abs()));
        let bounds = pso::bounds(A, size);
        let mut all = vec![own(&recording, seeds, Method::Auto), own(&recording, seeds, Method::Pso)];
        let optimum = all[0].sse[0];
        all.push(argmin_swarm(&rows, &bounds, seeds)?);
        if let Ok(python) = &python {
            let file = target.join(format!("peers_{count}.csv"));
            std::fs::write(&file, csv(&rows))?;
            all.extend(peers(python, &file, seeds, &bounds)?);
        }
        let own_time = shortest(&all[0].seconds);
        println!("\n{count} points, {seeds} seeds; optimum {optimum:.6} N²·m²");
        println!("{:<30} {:>10} {:>8} {:>9} {:>14}", "solver", "time", "ratio", "success", "SSE/optimum");
        for runs in &all {
            let reached = runs.sse.iter().filter(|sse| **sse <= 1.01 * optimum).count();
            let time = shortest(&runs.seconds);
            let ratio = median(&runs.sse) / optimum;
            println!(
                "{:<30} {:>7.2} ms {:>8.1} {reached:>5}/{seeds:<3} {ratio:>14.6}",
                runs.solver,
                1e3 * time,
                time / own_time
            );
            let cells = [format!("{:.0}", time / own_time), format!("{reached}/{seeds}"), format!("{ratio:.4}")];
            summary.entry(runs.solver.clone()).or_default().extend(cells);
        }
    }
    println!(
        "\n| solver | 64 rows: time | success | SSE | 2000 rows: time | success | SSE |\n|---|---|---|---|---|---|---|"
    );
    for (solver, cells) in summary {
        println!("| {solver} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// What the machine allows when nothing else runs.
fn shortest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn own(recording: &Recording, seeds: usize, method: Method) -> Runs {
    let solver = if method == Method::Pso { "gmhm fit --method pso" } else { "gmhm fit" };
    let mut runs = Runs { solver: solver.to_owned(), seconds: Vec::new(), sse: Vec::new() };
    for seed in 0..seeds as u64 {
        let options = FitOptions { method, seed, ..given(A, published().1) };
        let clock = Instant::now();
        let found = fit(std::slice::from_ref(recording), &options, &());
        runs.seconds.push(clock.elapsed().as_secs_f64());
        runs.sse.push(found.map_or(f64::INFINITY, |f| f.rss));
    }
    runs
}

/// θ, θ³, θ⁵, the columns of e and h, and the torque.
fn columns(recording: &Recording) -> Vec<[f64; 6]> {
    let (elastic, memory) = published();
    let Ok(params) = Params::candidate(A, elastic, memory) else { return Vec::new() };
    let frame = Frame::<f64>::new(&params);
    let deflection = recording.deflection_rad.iter().flatten();
    let mut path: Option<LoopPath<f64, 16>> = None;
    deflection
        .zip(recording.torque.iter().flatten())
        .map(|(&theta, &torque)| {
            let eta = path.get_or_insert_with(|| LoopPath::start(theta)).step(&frame, 0.0, theta);
            let [one, three, five] = gmhm::elastic::basis(theta);
            [one, three, five, single_valued_column(&frame, theta), A * eta, torque]
        })
        .collect()
}

fn csv(rows: &[[f64; 6]]) -> String {
    let line = |row: &[f64; 6]| row.map(|x| format!("{x:e}")).join(",") + "\n";
    std::iter::once("theta,theta3,theta5,e,h,torque\n".to_owned()).chain(rows.iter().map(line)).collect()
}

struct Loop<'r> {
    rows: &'r [[f64; 6]],
    bounds: &'r [(f64, f64); 6],
}

impl CostFunction for Loop<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        if x.iter().zip(self.bounds).any(|(x, (low, high))| x < low || x > high) {
            return Ok(f64::INFINITY);
        }
        let speed = (x[4] * x[4] + x[5] * x[5]).max(f64::MIN_POSITIVE);
        let linear = [x[0], x[1], x[2], x[3] * x[4] / speed, x[3] * x[5] / speed];
        let residual = |row: &[f64; 6]| row[5] - row[..5].iter().zip(&linear).map(|(c, b)| c * b).sum::<f64>();
        let (sum, squares) = self.rows.iter().map(residual).fold((0.0, 0.0), |(s, q), r| (s + r, q + r * r));
        Ok(squares - sum * sum / self.rows.len() as f64)
    }
}

fn argmin_swarm(rows: &[[f64; 6]], bounds: &[(f64, f64); 6], seeds: usize) -> Result<Runs, Error> {
    let mut runs = Runs { solver: "argmin ParticleSwarm".to_owned(), seconds: Vec::new(), sse: Vec::new() };
    for _ in 0..seeds {
        let clock = Instant::now();
        let low = bounds.iter().map(|b| b.0).collect();
        let high = bounds.iter().map(|b| b.1).collect();
        let solver: ParticleSwarm<Vec<f64>, f64, _> = ParticleSwarm::new((low, high), 40);
        let iterations = (EVALUATIONS / 40) as u64;
        let found = Executor::new(Loop { rows, bounds }, solver).configure(|s| s.max_iters(iterations)).run()?;
        runs.seconds.push(clock.elapsed().as_secs_f64());
        runs.sse.push(found.state().best_individual.as_ref().map_or(f64::INFINITY, |best| best.cost));
    }
    Ok(runs)
}

fn peers(
    python: &FilePath,
    file: &FilePath,
    seeds: usize,
    bounds: &[(f64, f64); 6],
) -> Result<Vec<Runs>, Box<dyn std::error::Error>> {
    let script = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/peers.py");
    let box_of_search = bounds.iter().flat_map(|(low, high)| [format!("{low:e}"), format!("{high:e}")]);
    let mut command = Command::new(python);
    // pyswarms leaves a log where it runs.
    command
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .arg(script)
        .arg(file)
        .args([seeds.to_string(), EVALUATIONS.to_string()])
        .args(box_of_search);
    let out = command.output()?;
    if !out.status.success() {
        return Err(String::from_utf8_lossy(&out.stderr).into_owned().into());
    }
    let numbers =
        |value: &serde_json::Value| value.as_array().into_iter().flatten().filter_map(|x| x.as_f64()).collect();
    String::from_utf8_lossy(&out.stdout)
        .lines()
        .map(|line| {
            let value: serde_json::Value = serde_json::from_str(line)?;
            let solver = value["solver"].as_str().unwrap_or_default().to_owned();
            Ok(Runs { solver, seconds: numbers(&value["seconds"]), sse: numbers(&value["sse"]) })
        })
        .collect()
}
