//! The diagnosis beside common ways to name missing physics, on the concealed cases of `gmhm prove` and by its scorer:
//! `cargo bench -p gmhm-tools --bench prove_peers -- [--cases N] [--seed S]`.
//!
//! Each peer names by its own rule, a kind once; how each is set is printed below the table. pysindy and the three others, in NumPy, run in a virtual environment
//! that this command sets up under the target folder (python3 with venv and a package index are needed).

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Mutex;

use gmhm_tools::diagnose::candidates::{Proposal, proposals};
use gmhm_tools::diagnose::diagnosis::{Diagnosis, Effect, Heldout, Location, Naming, Rms, Side, Unit};
use gmhm_tools::diagnose::evidence::{Evidence, Sight};
use gmhm_tools::diagnose::explain::Search;
use gmhm_tools::diagnose::naming;
use gmhm_tools::numerics::autoregression::mark_outliers;
use gmhm_tools::physics::Evaluation;
use gmhm_tools::prove::Diagnostician;
use gmhm_tools::prove::generator::{Case, Unseen, real_residuals};
use gmhm_tools::prove::key::Key;
use gmhm_tools::prove::table::{BlockRow, ProveReport, Rate};
use gmhm_tools::prove::{Answer, Sealed, mix};
use gmhm_tools::regression::dataset::Dataset;
use gmhm_tools::regression::fit::Fitted;
use gmhm_tools::regression::parameters;
use indicatif::{ProgressBar, ProgressStyle};

#[path = "peers/environment.rs"]
mod environment;

use environment::environment;

type Fault = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Fault> {
    let (cases, seed) = (option("--cases").unwrap_or(30), option("--seed").unwrap_or(1));
    let python = environment("prove-peers-venv", "prove_requirements.txt")?;
    let real = real_residuals(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings"));
    // The blocks before simulation and loud: the peers know no simulation beside the torque.
    let blocks = &mix::BLOCKS[..8];
    let sealed = Sealed::new(seed, mix::only(blocks, seed, usize::try_from(cases)?, &real));
    println!(
        "{} concealed cases of seed {seed}; SHA-256 of the hashes of their keys:\n{}",
        sealed.len(),
        sealed.sha256()
    );
    let pool = Pool { python, idle: Mutex::new(Vec::new()) };
    let answers: Mutex<BTreeMap<usize, Vec<Said>>> = Mutex::new(BTreeMap::new());
    // The first pass asks all peers at once; what each said is scored apart.
    let ask = |index: usize, case: &Case| -> Result<Answer, String> {
        let said = pool.ask(case).map_err(|e| e.to_string())?;
        answers.lock().map_err(|e| e.to_string())?.insert(index, said);
        Err("asked".to_owned())
    };
    let bar = progress("peers", sealed.len());
    let asked = sealed.score(&ask, &|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    if let Some(why) = asked.cases.iter().filter_map(|c| c.failed.as_deref()).find(|why| *why != "asked") {
        return Err(why.into());
    }
    let answers = answers.into_inner()?;
    let methods = answers.values().next().map_or(0, Vec::len);
    let mut columns: Vec<Column> = (0..methods)
        .map(|method| {
            let said = |index: usize| &answers[&index][method];
            let report = sealed.score(&|index, _| Ok(said(index).answer.clone()), &|_| {});
            Column {
                name: said(report.cases[0].index).method.clone(),
                seconds: median(answers.values().map(|all| all[method].seconds).collect()),
                report,
            }
        })
        .collect();
    let bar = progress("gmhm", sealed.len());
    let report = sealed.run(&Diagnostician, &|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let seconds = median(report.cases.iter().map(|c| c.seconds).collect());
    columns.push(Column { name: "gmhm".to_owned(), seconds, report });
    print(&columns);
    Ok(())
}

fn option(name: &str) -> Option<u64> {
    let words: Vec<String> = std::env::args().collect();
    words.iter().position(|w| w == name).and_then(|i| words.get(i + 1)?.parse().ok())
}

fn progress(doing: &str, total: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} cases, {eta} left");
    let bar = ProgressBar::new(total as u64).with_message(doing.to_owned());
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(std::time::Duration::from_secs(1));
    bar
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// What a method said of a case.
struct Said {
    method: String,
    answer: Answer,
    seconds: f64,
}

/// Processes of the peers, one for each thread that asks.
struct Pool {
    python: PathBuf,
    idle: Mutex<Vec<Peer>>,
}

struct Peer {
    child: Child,
    into: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Pool {
    fn peer(&self) -> Result<Peer, Fault> {
        if let Some(peer) = self.idle.lock().map_err(|e| e.to_string())?.pop() {
            return Ok(peer);
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/prove_peers.py");
        let mut command = Command::new(&self.python);
        command.arg(script).env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1");
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (Some(into), Some(from)) = (child.stdin.take(), child.stdout.take()) else {
            return Err("the peers have no pipes".into());
        };
        Ok(Peer { child, into, from: BufReader::new(from) })
    }

    fn ask(&self, case: &Case) -> Result<Vec<Said>, Fault> {
        let table = Table::new(case)?;
        let mut peer = self.peer()?;
        table.write(&mut peer.into)?;
        let mut line = String::new();
        peer.from.read_line(&mut line)?;
        self.idle.lock().map_err(|e| e.to_string())?.push(peer);
        let said: Vec<serde_json::Value> = serde_json::from_str(&line)?;
        said.iter().map(|said| table.said(case, said)).collect()
    }
}

/// A case as the peers see it.
struct Table {
    fit: Fitted,
    counts: Vec<bool>,
    spans: Vec<[usize; 2]>,
    groups: Vec<Proposal>,
}

impl Table {
    fn new(case: &Case) -> Result<Self, Fault> {
        let search = Search {
            removed: &case.removed,
            only: None,
            base_terms: case.base.terms.len(),
            held_terms: None,
            zero: true,
            seed: 1,
        };
        let mut dataset = Dataset::new(&case.recordings, &case.base)?;
        let plain = dataset.fit(&case.base, &dataset.parameters(&case.base, search), None, 2)?;
        for (span, marks) in dataset.spans.iter().zip(&mut dataset.marks) {
            mark_outliers(&plain.residual[span.clone()], marks);
        }
        let fit = dataset.fit(&plain.model, &dataset.parameters(&plain.model, search), None, 12)?;
        let evaluations = dataset.evaluate(&fit.model)?;
        let groups = proposals(&dataset, &evaluations, &fit, search);
        drop(evaluations);
        let counts = (0..dataset.len()).map(|row| dataset.counts(row)).collect();
        let spans = dataset.spans.iter().map(|s| [s.start, s.end]).collect();
        Ok(Self { fit, counts, spans, groups })
    }

    fn write(&self, to: &mut impl Write) -> Result<(), Fault> {
        let mut next = 0;
        let groups: Vec<serde_json::Value> = self
            .groups
            .iter()
            .map(|group| {
                let columns: Vec<usize> = (next..next + group.columns.len()).collect();
                next += group.columns.len();
                serde_json::json!({ "kind": group.info.name, "columns": columns })
            })
            .collect();
        let (rows, base) = (self.counts.len(), self.fit.columns.len());
        let header = serde_json::json!({ "rows": rows, "spans": self.spans, "base": base, "groups": groups });
        writeln!(to, "{header}")?;
        let counts: Vec<f64> = self.counts.iter().map(|c| f64::from(u8::from(*c))).collect();
        let candidates = self.groups.iter().flat_map(|g| &g.columns);
        for column in [&self.fit.residual, &counts].into_iter().chain(&self.fit.columns).chain(candidates) {
            let bytes: Vec<u8> = column.iter().flat_map(|x| x.to_le_bytes()).collect();
            to.write_all(&bytes)?;
        }
        Ok(to.flush()?)
    }

    fn said(&self, case: &Case, said: &serde_json::Value) -> Result<Said, Fault> {
        let numbers = |v: &serde_json::Value| -> Vec<f64> {
            v.as_array().into_iter().flatten().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
        };
        let chosen: Vec<(&Proposal, Vec<f64>)> = said["groups"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|g| Some((self.groups.get(g["group"].as_u64()? as usize)?, numbers(&g["weights"]))))
            .collect();
        let predict =
            |unseen: &Unseen| self.predict(&numbers(&said["base"]), &chosen, unseen).map_err(|e| e.to_string());
        let kinds: Vec<&str> = chosen.iter().map(|(group, _)| group.info.name).collect();
        let unseen = case.unseen.iter().map(predict).collect();
        Ok(Said {
            method: said["method"].as_str().unwrap_or_default().to_owned(),
            answer: Answer { diagnosis: named(&kinds, &case.key), unseen },
            seconds: said["seconds"].as_f64().unwrap_or(f64::NAN),
        })
    }

    /// The base model with its weights moved, and each term beside it.
    fn predict(&self, base: &[f64], chosen: &[(&Proposal, Vec<f64>)], unseen: &Unseen) -> Result<Vec<f64>, Fault> {
        let mut model = self.fit.model.clone();
        for (parameter, change) in self.fit.parameters.iter().zip(base) {
            let value = parameters::value(&model, *parameter) + change;
            parameters::put(&mut model, *parameter, value);
        }
        let evaluation = Evaluation::new(&model, None, &unseen.recording)?;
        let mut total = evaluation.total().to_vec();
        for (group, weights) in chosen {
            let with = group.applied(&model, weights);
            // What the core refuses, such as friction that drives or a gap of less than nothing, adds nothing.
            if let Some(Ok(change)) = with.terms.last().map(|term| evaluation.change(term)) {
                total.iter_mut().zip(change).for_each(|(t, c)| *t += c);
            }
        }
        Ok(total)
    }
}

/// A diagnosis that holds names, in the order chosen, and the coordinates in which they show. A name that nobody could tell from the truth is credited
/// with the truth's class.
fn named(kinds: &[&str], key: &Key) -> Diagnosis {
    let class = |kind: &str| -> Vec<String> {
        let own = key.effects.iter().map(|e| &e.class).find(|class| class.iter().any(|k| k == kind));
        own.into_iter().flatten().filter(|k| *k != kind).cloned().collect()
    };
    let mut diagnosis = Diagnosis::nothing(Unit::NewtonMetre, 0.0, Rms::default(), Heldout::default());
    diagnosis.mismatch = !kinds.is_empty();
    for kind in kinds {
        for coordinate in naming::coordinates(kind) {
            let coordinate = coordinate.to_owned();
            diagnosis.locations.push(Location {
                coordinate,
                share: 0.0,
                detail: Sight::Written(String::new()),
                seconds: Vec::new(),
            });
        }
        diagnosis.effects.push(Effect {
            verdict: Naming::Named,
            fidelity: None,
            family: String::new(),
            closest: None,
            name: (*kind).to_owned(),
            equivalents: class(kind),
            confidence: 1.0,
            share: 0.0,
            parameters: Default::default(),
            side: Side::Unknown,
            why: Evidence::Written(String::new()),
        });
    }
    diagnosis
}

/// One method of the table.
struct Column {
    name: String,
    seconds: f64,
    report: ProveReport,
}

/// What a line of the table tells of a block.
type Cell = fn(&BlockRow) -> String;

fn print(columns: &[Column]) {
    let line = |name: &str, cell: &dyn Fn(&Column) -> String| {
        let cells: String = columns.iter().map(|c| format!("{:>15}", cell(c))).collect();
        println!("{name:<28}{cells}");
    };
    println!();
    line("block", &|c| c.name.clone());
    let rows: [(&str, &str, Cell); 18] = [
        ("null", "false alarms", |b| share(b.false_alarms)),
        ("single 0.15", "class hits", |b| share(b.class_hits)),
        ("single 0.15", "named exactly", |b| share(b.exact)),
        ("single 0.15", "wrong names a case", wrong_names),
        ("single 0.15", "power explained, median", |b| number(b.explained_median)),
        ("single 0.05", "class hits", |b| share(b.class_hits)),
        ("single 0.05", "named exactly", |b| share(b.exact)),
        ("single 0.05", "wrong names a case", wrong_names),
        ("pair", "F1", |b| number(b.f1)),
        ("open world", "mismatch seen", |b| share(b.found)),
        ("open world", "misnamed", |b| share(b.misnamed)),
        ("left out", "misnamed", |b| share(b.misnamed)),
        ("maxwell slip", "class hits", |b| share(b.class_hits)),
        ("maxwell slip", "wrong names a case", wrong_names),
        ("real noise", "class hits", |b| share(b.class_hits)),
        ("all", "located", |b| share(b.located)),
        ("all", "wrong names a case", wrong_names),
        ("all", "error on unseen, N·m", |b| number(b.unseen_error_nm)),
    ];
    let mut last = "";
    for (block, name, cell) in rows {
        let row = |c: &Column| c.report.blocks.iter().find(|b| b.block == block).map_or("-".to_owned(), cell);
        if block != last {
            println!("{block}");
            last = block;
        }
        line(&format!("    {name}"), &row);
    }
    line("seconds a case", &|c| number(Some(c.seconds)));
    println!("{SETTINGS}");
    for column in columns {
        let failed: Vec<&str> = column.report.cases.iter().filter_map(|c| c.failed.as_deref()).collect();
        if let Some(first) = failed.first() {
            println!("{}: {} cases without a prediction, the first: {first}", column.name, failed.len());
        }
    }
}

/// What the reader has to know to judge the table.
const SETTINGS: &str = "
How each was set. Every peer gets the columns that gmhm's own search screens: each kind and shape of the library, orders from the spectrum, evaluated by
the core beside the refitted base model, whose parameters, offsets and encoder zero are free beside every candidate; the same rows are marked as outliers.
    STLSQ        pysindy 2.1, columns of unit rms, the best shape of each kind, threshold of 0.02 to 0.5 or none by 5 held-out blocks
    E-SINDy      pysindy 2.1, the same columns, 20 bags, median, threshold 0.1 (its default)
    forward BIC  groups of columns forward, white noise, at most 6
    block CV     groups forward by the error of 10 held-out blocks, each step by more than its standard error, at most 6
    AR EBIC      groups forward by extended BIC (gamma 1), prewhitened by an autoregression of order 20 fitted anew at every step, at most 6
    gmhm         gmhm diagnose as it stands
Every peer's weights are fitted by generalised least squares, and its model predicts the unseen recordings through the core; a term of a sign that the core
refuses adds nothing. A peer states no class: where it names a kind that nobody could tell from the truth, it is credited with the theoretical class.";

fn wrong_names(block: &BlockRow) -> String {
    number(Some(block.wrong_names as f64 / block.cases as f64))
}

fn share(rate: Rate) -> String {
    if rate.of == 0 { "-".to_owned() } else { format!("{:.2} {}/{}", rate.share(), rate.hits, rate.of) }
}

/// Two digits; of a prediction that ran away only its order.
fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |x| if x.abs() < 1e3 { format!("{x:.2}") } else { format!("{x:.0e}") })
}
