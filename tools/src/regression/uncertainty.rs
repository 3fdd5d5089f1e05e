//! How well each parameter is known, and which the recordings cannot tell.
//!
//! The model's torque is differentiated by every parameter of the model file, through the core, filtered by the noise model. Its singular directions are
//! what the recordings say nothing about: a parameter with a share in one gets no standard deviation, whatever the reason (a gauge, a term the law does not
//! have, an experiment that never moved it). Combinations without such a share keep theirs.

use std::borrow::Cow;

use gmhm::{Elastic, Gear, Kernel, Law, Memory, Params, State};
use nalgebra::DVector;

use crate::model::key_per;
use crate::numerics::autoregression::Noise;
use crate::numerics::bounded::Bound;
use crate::recording::TorqueUnit;
use crate::regression::base::TURNING_POINTS;
use crate::regression::changes;
use crate::regression::columns::{Column, Columns, Contribution, Correction, Evaluate, Nonlinear, Offset, Stretch};
use crate::regression::count_errors;
use crate::regression::deflection_zeros::{DEFLECTION_ZERO, DeflectionZeros};
use crate::regression::error::EstimateError;
use crate::regression::note::{Note, Remedy};
use crate::regression::problem::Problem;
use crate::regression::rows::{Past, Rows};
use crate::regression::spread::Spread;

/// One parameter as it goes into reports.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Estimated {
    /// Its name in model files, that of a term after its kind and a dot; e, h and ρ by their symbols.
    pub name: Cow<'static, str>,
    /// Its value.
    pub value: f64,
    /// Standard deviation under the noise found; absent where the recordings do not fix the parameter by itself.
    pub sd: Option<f64>,
    /// Its unit.
    pub unit: Cow<'static, str>,
    /// Held at a bound.
    pub at_bound: bool,
    /// The recordings do not tell it from zero, or not at all.
    pub undetermined: bool,
    /// What there is to say, and the experiment that would determine it.
    pub note: Option<Note>,
}

/// Parameters, and the correlations of those that have a standard deviation.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Uncertainty {
    /// Every parameter.
    pub parameters: Vec<Estimated>,
    /// Names in the order of `correlation`.
    pub correlated: Vec<Cow<'static, str>>,
    /// Correlation matrix, by rows.
    pub correlation: Vec<Vec<f64>>,
}

impl Uncertainty {
    /// Names and units as they read where current stands in for the torque.
    pub(crate) fn per(&mut self, unit: TorqueUnit) {
        let in_unit = |name: &mut Cow<'static, str>| {
            let spelled = name.split('.').map(|part| key_per(part, unit)).collect::<Vec<_>>().join(".");
            *name = spelled.into();
        };
        for parameter in &mut self.parameters {
            in_unit(&mut parameter.name);
            parameter.unit = unit.of_parameter(&parameter.unit).into_owned().into();
        }
        self.correlated.iter_mut().for_each(in_unit);
    }
}

/// A singular value below this share of the largest is a direction the recordings say nothing about. Derivatives are good to 1e-9.
pub(crate) const SINGULAR: f64 = 1e-7;

/// The gear with its parameters as the file has them, as one contribution.
struct WholeGear {
    rated_deflection_rad: f64,
    memory: Memory,
    known_start: Vec<bool>,
    nonlinear: Vec<Nonlinear>,
    columns: [Column; 2],
}

const NAMES: [(&str, &str); 6] = [
    ("c1_nm_per_rad", "N·m/rad"),
    ("c2_nm_per_rad3", "N·m/rad³"),
    ("c3_nm_per_rad5", "N·m/rad⁵"),
    ("alpha", ""),
    ("beta_per_s", "1/s"),
    ("omega_per_s", "1/s"),
];

impl WholeGear {
    fn values(elastic: &Elastic, memory: &Memory) -> [f64; 6] {
        let Elastic { c1_nm_per_rad, c2_nm_per_rad3, c3_nm_per_rad5 } = *elastic;
        [c1_nm_per_rad, c2_nm_per_rad3, c3_nm_per_rad5, memory.alpha, memory.beta_per_s, memory.omega_per_s]
    }

    fn new(rated_deflection_rad: f64, elastic: Elastic, memory: Memory, known_start: &[bool], torque_nm: f64) -> Self {
        let a = rated_deflection_rad;
        let speed = memory.beta_per_s.max(memory.omega_per_s).max(f64::MIN_POSITIVE);
        let sizes = [torque_nm / a, torque_nm / a.powi(3), torque_nm / a.powi(5), torque_nm / a, speed, speed];
        let nonlinear = Self::values(&elastic, &memory)
            .into_iter()
            .zip(sizes)
            .enumerate()
            .map(|(k, (value, size))| {
                let span = if value == 0.0 { size } else { value.abs() };
                let low = if k >= 3 && value == 0.0 { 0.0 } else { value - span };
                Nonlinear { name: NAMES[k].0.into(), unit: NAMES[k].1.into(), low, high: value + span, smooth: true }
            })
            .collect();
        let columns = [Column::of_gear("torque", "1", Bound::Free), Column::of_recording("start", "1")];
        Self { rated_deflection_rad, memory, known_start: known_start.to_vec(), nonlinear, columns }
    }
}

struct GearPath {
    gear: Option<Gear<f64>>,
    state: Option<State<f64, TURNING_POINTS>>,
    /// The tip of the rated cycle that it comes from; law `masing`.
    tip_rad: Option<f64>,
    known_start: bool,
}

impl Contribution for WholeGear {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.nonlinear
    }

    fn start<'a>(&'a self, p: &[f64], rows: &'a Rows<'a>, index: usize) -> Box<dyn Evaluate + 'a> {
        let tip_rad = match rows.past {
            _ if self.memory.law != Law::Masing => None,
            Past::Rest => None,
            Past::Rising => Some(-self.rated_deflection_rad),
            Past::Falling => Some(self.rated_deflection_rad),
        };
        let elastic = Elastic { c1_nm_per_rad: p[0], c2_nm_per_rad3: p[1], c3_nm_per_rad5: p[2] };
        let memory = Memory { alpha: p[3], beta_per_s: p[4], omega_per_s: p[5], ..self.memory };
        let params = Params::candidate(self.rated_deflection_rad, elastic, memory);
        let known_start = self.memory.law == Law::Masing || self.known_start.get(index).copied().unwrap_or(false);
        Box::new(GearPath { gear: params.ok().map(|p| Gear::new(&p)), state: None, tip_rad, known_start })
    }
}

impl Evaluate for GearPath {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        let Some(gear) = &self.gear else {
            columns.column(0).fill(0.0);
            columns.column(1).fill(0.0);
            return;
        };
        if let (None, Some(tip)) = (&self.state, self.tip_rad) {
            let state = self.state.insert(gear.start(-tip));
            gear.step(state, 0.0);
            gear.step(state, tip);
        }
        for (row, &theta) in stretch.deflection_rad.iter().enumerate() {
            let out = match &mut self.state {
                Some(state) => gear.step_after(state, theta, stretch.rows.period_s(stretch.range.start + row)),
                empty => gear.output(empty.insert(gear.start(theta))),
            };
            let start = match &self.state {
                Some(state) if !self.known_start => gear.start_uncertainty(state),
                _ => 0.0,
            };
            columns.set(row, &[out.torque, start]);
        }
    }
}

/// What is fitted, in the terms of the model file.
pub struct Fitted<'f> {
    /// A, rad.
    pub rated_deflection_rad: f64,
    /// Elastic coefficients.
    pub elastic: Elastic,
    /// Memory.
    pub memory: Memory,
    /// Recordings that start with an empty memory.
    pub known_start: &'f [bool],
    /// The deflection zeros that were fitted.
    pub zeros: Option<&'f DeflectionZeros>,
    /// Their values, beside what is already subtracted from the rows, rad.
    pub zeros_rad: &'f [f64],
    /// Deflection zero as it goes into the file, rad.
    pub stored_zero_rad: f64,
    /// Whether the play was searched.
    pub searched_play: bool,
    /// Scale of the torque, N·m.
    pub torque_nm: f64,
    /// How unsure A is, rad.
    pub rated_sd_rad: f64,
}

/// Standard deviations and notes of a fit against `noise`, or without, and the standard deviations of the deflection zeros that were fitted, rad.
pub fn assess(
    fitted: &Fitted<'_>,
    rows: &[Rows<'_>],
    noise: Option<&[Noise]>,
) -> Result<(Uncertainty, Vec<Option<f64>>), EstimateError> {
    let whole = WholeGear::new(
        fitted.rated_deflection_rad,
        fitted.elastic,
        fitted.memory,
        fitted.known_start,
        fitted.torque_nm,
    );
    let corrections: Vec<&dyn Correction> = fitted.zeros.iter().map(|zeros| *zeros as &dyn Correction).collect();
    let zeros = fitted.zeros_rad.len();
    let problem = Problem { rows, corrections, contributions: vec![&Offset, &whole] };
    let values = WholeGear::values(&fitted.elastic, &fitted.memory);
    let nonlinear: Vec<f64> = fitted.zeros_rad.iter().copied().chain(values).collect();
    let count = nonlinear.len();
    // The first column is the torque itself. What is at its bound varies with the others, lest these look better known than they are.
    let places: Vec<usize> = (1..=count).collect();
    let (mut spread, linear) = Spread::of(&problem, &nonlinear, noise, &places);
    // Without a noise model the residual says what the counts do, too.
    if let Some(scores) = noise.and_then(|noise| count_errors::scores(&problem, &nonlinear, &linear, noise)) {
        spread.widen(&scores.select_rows(&places));
    }

    if fitted.rated_sd_rad > 0.0 {
        let rated = fitted.rated_deflection_rad + fitted.rated_sd_rad;
        let other = WholeGear::new(rated, fitted.elastic, fitted.memory, fitted.known_start, fitted.torque_nm);
        let of_other = Problem { contributions: vec![&Offset, &other], ..problem.on(rows) };
        let residuals = |problem: &Problem<'_>| problem.residuals(&nonlinear, &linear);
        let change = changes::between(&residuals(&problem), residuals(&of_other));
        spread.widen(&changes::scores(&problem, &nonlinear, &linear, noise, &[change]).select_rows(&places));
    }

    let unit_of = |place: usize| DVector::from_fn(count, |i, _| if i == place { 1.0 } else { 0.0 });
    let unit_vector = |k: usize| unit_of(zeros + k);
    let zero_sd = |k: usize| spread.direction(&unit_of(k)).map(|direction| spread.sd(&direction));
    let mut report =
        Report { law: fitted.memory.law, kernel: fitted.memory.kernel, spread: &spread, lines: Vec::new() };
    let alpha_unit = if fitted.memory.kernel == Kernel::Rate { "N·m/rad" } else { "N·m/(rad·s)" };
    for (k, (name, unit)) in NAMES.into_iter().enumerate() {
        let unit = if k == 3 { alpha_unit } else { unit };
        if !(fitted.memory.law == Law::Time && k == 5) {
            report.push(name, unit, values[k], unit_vector(k), k >= 3 && values[k] == 0.0);
        }
    }
    for (name, unit, value, gradient) in combinations(&fitted.memory) {
        let gradient = unit_vector(3) * gradient[0] + unit_vector(4) * gradient[1] + unit_vector(5) * gradient[2];
        report.push(name, unit, value, gradient, value == 0.0);
    }
    if fitted.memory.law == Law::Masing && fitted.memory.reversal_play_rad > 0.0 {
        let note = if fitted.searched_play { Note::Searched } else { Note::Given };
        report.plain("reversal_play_rad", fitted.memory.reversal_play_rad, note);
    }
    if zeros > 0 {
        report.push(DEFLECTION_ZERO, "rad", fitted.stored_zero_rad, unit_of(0), false);
    } else if fitted.stored_zero_rad != 0.0 {
        report.plain(DEFLECTION_ZERO, fitted.stored_zero_rad, Note::GivenOrMiddle);
    }
    Ok((report.finish(), (0..zeros).map(zero_sd).collect()))
}

/// Standard deviations of a problem whose parameters are those of the model file: the gear's linear ones as named by their columns, then the nonlinear ones.
/// Notes on parameters that the recordings do not determine name `remedy`.
pub fn of_columns(problem: &Problem<'_>, nonlinear: &[f64], noise: Option<&[Noise]>, remedy: Remedy) -> Uncertainty {
    let columns = problem.gear_columns();
    let count = columns.len() + nonlinear.len();
    let all: Vec<usize> = (0..count).collect();
    let (spread, linear) = Spread::of(problem, nonlinear, noise, &all);
    let infos = problem.nonlinear();
    let line = |k: usize| {
        let (name, unit, value) = match k.checked_sub(columns.len()) {
            None => (&columns[k].name, &columns[k].unit, linear.gear[k]),
            Some(own) => (&infos[own].name, &infos[own].unit, nonlinear[own]),
        };
        let at_bound = columns.get(k).is_some_and(|column| column.bound == Bound::NonNegative) && value == 0.0;
        let direction = spread.direction(&DVector::from_fn(count, |i, _| if i == k { 1.0 } else { 0.0 }));
        let sd = direction.as_ref().map(|d| spread.sd(d));
        if at_bound {
            return bounded(name.clone(), unit.clone(), sd);
        }
        let vague = sd.is_some_and(|sd| 2.0 * sd >= value.abs());
        let note = match sd {
            None => Some(Note::Open(Some(remedy))),
            Some(sd) if vague => Some(Note::Vague { relative: sd / value.abs(), remedy: Some(remedy) }),
            _ => None,
        };
        let undetermined = sd.is_none() || vague;
        let (name, unit) = (name.clone(), unit.clone());
        (Estimated { name, value, sd, unit, at_bound, undetermined, note }, direction)
    };
    let lines: Vec<(Estimated, Option<DVector<f64>>)> = (0..count).map(line).collect();
    correlated(lines)
}

/// What there is to say of a parameter at its bound 0, whose standard deviation would be `sd` without that.
fn bounded(name: Cow<'static, str>, unit: Cow<'static, str>, sd: Option<f64>) -> (Estimated, Option<DVector<f64>>) {
    let note = Some(Note::NoEffect { upper_limit: sd.map(|sd| 2.0 * sd) });
    (Estimated { name, value: 0.0, sd: None, unit, at_bound: true, undetermined: false, note }, None)
}

struct Report<'s> {
    law: Law,
    kernel: Kernel,
    spread: &'s Spread,
    lines: Vec<(Estimated, Option<DVector<f64>>)>,
}

impl Report<'_> {
    fn push(&mut self, name: &'static str, unit: &'static str, value: f64, gradient: DVector<f64>, at_bound: bool) {
        let direction = self.spread.direction(&gradient).filter(|_| gradient.norm() > 0.0);
        let sd = direction.as_ref().map(|d| self.spread.sd(d));
        if at_bound {
            return self.lines.push(bounded(name.into(), unit.into(), sd));
        }
        // A zero of the encoders that is not distinguishable from 0 is as good as any.
        let vague = sd.is_some_and(|sd| 2.0 * sd >= value.abs()) && name != DEFLECTION_ZERO;
        let note = match sd {
            None => Some(left_open(self.law, self.kernel, name)),
            Some(sd) if vague => Some(Note::Vague { relative: sd / value.abs(), remedy: Some(remedy_of(name)) }),
            _ => None,
        };
        let undetermined = sd.is_none() || vague;
        let (name, unit) = (name.into(), unit.into());
        self.lines.push((Estimated { name, value, sd, unit, at_bound, undetermined, note }, direction));
    }

    fn plain(&mut self, name: &'static str, value: f64, note: Note) {
        let (name, unit) = (name.into(), "rad".into());
        let line = Estimated { name, value, sd: None, unit, at_bound: false, undetermined: false, note: Some(note) };
        self.lines.push((line, None));
    }

    fn finish(self) -> Uncertainty {
        correlated(self.lines)
    }
}

/// Parameters with the directions of those that have a standard deviation.
pub(crate) fn correlated(lines: Vec<(Estimated, Option<DVector<f64>>)>) -> Uncertainty {
    let known: Vec<(&Cow<'static, str>, &DVector<f64>)> =
        lines.iter().filter_map(|(l, d)| d.as_ref().filter(|d| d.norm() > 0.0).map(|d| (&l.name, d))).collect();
    let correlation =
        known.iter().map(|(_, a)| known.iter().map(|(_, b)| a.dot(b) / (a.norm() * b.norm())).collect()).collect();
    let correlated = known.iter().map(|(name, _)| (*name).clone()).collect();
    Uncertainty { correlated, correlation, parameters: lines.into_iter().map(|(line, _)| line).collect() }
}

/// What a quasi-static loop can tell of (α, β, ω): name, unit, value, gradient.
fn combinations(memory: &Memory) -> Vec<(&'static str, &'static str, f64, [f64; 3])> {
    let Memory { law, kernel, alpha: a, beta_per_s: b, omega_per_s: w, .. } = *memory;
    let mut lines = Vec::new();
    let q = b * b + w * w;
    if law == Law::Time || q == 0.0 {
        return lines;
    }
    if kernel == Kernel::Deflection {
        let turn = (w * w - b * b) / (q * q);
        lines.push(("e", "N·m/rad", memory.e(), [b / q, a * turn, -2.0 * a * b * w / (q * q)]));
        lines.push(("h", "N·m/rad", memory.h(), [w / q, -2.0 * a * b * w / (q * q), -a * turn]));
    }
    if w > 0.0 {
        lines.push(("rho", "1", memory.rho(), [0.0, 1.0 / w, -b / (w * w)]));
    }
    lines
}

/// Of a number that the recordings do not determine by itself.
fn left_open(law: Law, kernel: Kernel, name: &str) -> Note {
    match (law, name) {
        (Law::Time, _) => Note::Open(Some(Remedy::Rates)),
        (_, "alpha" | "beta_per_s" | "omega_per_s") => {
            Note::RateIndependent { fixes_e_and_h: kernel == Kernel::Deflection }
        }
        _ => Note::Open(Some(Remedy::Amplitudes)),
    }
}

fn remedy_of(name: &str) -> Remedy {
    match name {
        "beta_per_s" | "alpha" => Remedy::Rates,
        _ => Remedy::Amplitudes,
    }
}
