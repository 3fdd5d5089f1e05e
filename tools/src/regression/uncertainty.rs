//! How well each parameter is known, and which the recordings cannot tell.
//!
//! The columns of what was fitted, filtered by the noise model, have singular directions, of which the recordings say nothing: a parameter with a share in one gets no
//! standard deviation. The parameters of a model file follow by their derivatives; those that a gauge moves have none either.

use std::borrow::Cow;

use gmhm::{Kernel, Law, Memory};
use nalgebra::DVector;

use crate::model::key_per;
use crate::numerics::autoregression::Noise;
use crate::numerics::bounded::Bound;
use crate::recording::TorqueUnit;
use crate::regression::assembly::Assembly;
use crate::regression::base::{ELASTIC, Play};
use crate::regression::changes;
use crate::regression::count_errors;
use crate::regression::deflection_zeros::DEFLECTION_ZERO;
use crate::regression::error::EstimateError;
use crate::regression::note::{Note, Remedy};
use crate::regression::problem::{Linear, Problem};
use crate::regression::rows::Rows;
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

impl Estimated {
    /// A parameter with its standard deviation were it free of bounds; `open` is to be said where it has none, and `remedy` would determine it better.
    pub(crate) fn new(
        (name, unit): (Cow<'static, str>, Cow<'static, str>),
        value: f64,
        sd: Option<f64>,
        at_bound: bool,
        open: Note,
        remedy: Option<Remedy>,
    ) -> Self {
        let note = match sd {
            _ if at_bound && value == 0.0 => Some(Note::NoEffect { upper_limit: sd.map(|sd| 2.0 * sd) }),
            _ if at_bound => Some(Note::AtBound),
            None => Some(open),
            // A zero of the encoders that is not distinguishable from 0 is as good as any.
            Some(sd) if 2.0 * sd >= value.abs() && name != DEFLECTION_ZERO => {
                Some(Note::Vague { relative: sd / value.abs(), remedy })
            }
            Some(_) => None,
        };
        let sd = sd.filter(|_| !at_bound);
        Self { name, value, sd, unit, at_bound, undetermined: !at_bound && note.is_some(), note }
    }
}

/// A base model that was fitted.
pub struct Fitted<'f> {
    /// Its parts.
    pub assembly: &'f Assembly,
    /// Its nonlinear parameters.
    pub nonlinear: &'f [f64],
    /// Its linear parameters.
    pub linear: &'f Linear,
    /// Its memory, in the gauge of the model file.
    pub memory: Memory,
    /// Recordings that start with an empty memory.
    pub known_start: &'f [bool],
    /// Deflection zero as it goes into the file, rad.
    pub stored_zero_rad: f64,
    /// How unsure A is, rad.
    pub rated_sd_rad: f64,
}

/// Standard deviations and notes of a fit against `noise`, or without, and the standard deviations of the deflection zeros that were fitted, rad.
pub fn assess(
    fitted: &Fitted<'_>,
    rows: &[Rows<'_>],
    noise: Option<&[Noise]>,
) -> Result<(Uncertainty, Vec<Option<f64>>), EstimateError> {
    let &Fitted { assembly, nonlinear, linear, memory, .. } = fitted;
    let problem = assembly.problem(rows);
    let (columns, infos) = (problem.gear_columns(), problem.nonlinear());
    // What is at its bound varies with the others, lest these look better known than they are.
    let smooth = (0..infos.len()).filter(|&k| infos[k].smooth).map(|k| columns.len() + k);
    let free: Vec<usize> = (0..columns.len()).chain(smooth).collect();
    let mut spread = Spread::of(&problem, nonlinear, linear, noise, &free);
    // Without a noise model the residual says what the counts do, too.
    if let Some(scores) = noise.and_then(|noise| count_errors::scores(&problem, nonlinear, linear, noise)) {
        spread.widen(&scores.select_rows(&free));
    }
    if fitted.rated_sd_rad > 0.0 {
        let rated = assembly.rated_deflection_rad + fitted.rated_sd_rad;
        let other = assembly.with_rated_deflection(rated, rows, fitted.known_start)?;
        let residuals = |problem: &Problem<'_>| problem.residuals(nonlinear, linear);
        let change = changes::between(&residuals(&problem), residuals(&other.problem(rows)));
        spread.widen(&changes::scores(&problem, nonlinear, linear, noise, &[change]).select_rows(&free));
    }

    let unit_vector = |k: usize| DVector::from_fn(free.len(), |i, _| if i == k { 1.0 } else { 0.0 });
    let line = |name: &'static str, unit: &'static str, value: f64, gradient: Option<DVector<f64>>, at_bound| {
        let direction = gradient.filter(|g| g.norm() > 0.0).and_then(|g| spread.direction(&g));
        let sd = direction.as_ref().map(|d| spread.sd(d));
        let open = left_open(memory.law, memory.kernel, name);
        let remedy = Some(remedy_of(name));
        (Estimated::new((name.into(), unit.into()), value, sd, at_bound, open, remedy), direction)
    };
    let plain = |name: &'static str, value: f64, note: Note| {
        let (name, unit) = (name.into(), "rad".into());
        let line = Estimated { name, value, sd: None, unit, at_bound: false, undetermined: false, note: Some(note) };
        (line, None)
    };
    let elastic = ELASTIC.into_iter().zip(&linear.gear).enumerate();
    let mut lines: Vec<_> =
        elastic.map(|(k, ((name, unit), value))| line(name, unit, *value, Some(unit_vector(k)), false)).collect();
    // Those of the memory are the columns after these, the last of the nonlinear ones after the last of them.
    let of_memory = [ELASTIC.len(), if memory.law == Law::Masing { ELASTIC.len() + 1 } else { free.len() - 1 }];
    lines.extend(numbers(&memory).into_iter().map(|(name, unit, value, gradient)| {
        let gradient = gradient.map(|g| unit_vector(of_memory[0]) * g[0] + unit_vector(of_memory[1]) * g[1]);
        line(name, unit, value, gradient, value == 0.0)
    }));
    if memory.law == Law::Masing && memory.reversal_play_rad > 0.0 {
        let searched = matches!(assembly.structure.play, Play::UpTo(_));
        lines.push(plain(
            "reversal_play_rad",
            memory.reversal_play_rad,
            if searched { Note::Searched } else { Note::Given },
        ));
    }
    let zeros = assembly.split(nonlinear).0.len();
    if zeros > 0 {
        lines.push(line(DEFLECTION_ZERO, "rad", fitted.stored_zero_rad, Some(unit_vector(columns.len())), false));
    } else if fitted.stored_zero_rad != 0.0 {
        lines.push(plain(DEFLECTION_ZERO, fitted.stored_zero_rad, Note::GivenOrMiddle));
    }
    let zero_sd = |k: usize| spread.direction(&unit_vector(columns.len() + k)).map(|direction| spread.sd(&direction));
    Ok((correlated(lines), (0..zeros).map(zero_sd).collect()))
}

/// Standard deviations of a fitted problem whose parameters are those of the model file: the gear's linear ones as named by their columns, then the nonlinear ones.
/// Notes on parameters that the recordings do not determine name `remedy`.
pub fn of_columns(
    problem: &Problem<'_>,
    nonlinear: &[f64],
    linear: &Linear,
    noise: Option<&[Noise]>,
    remedy: Option<Remedy>,
) -> Uncertainty {
    let (columns, infos) = (problem.gear_columns(), problem.nonlinear());
    let named = columns.iter().map(|c| (&c.name, &c.unit)).chain(infos.iter().map(|n| (&n.name, &n.unit)));
    let at_least_0 = columns.iter().map(|c| c.bound == Bound::NonNegative).chain(infos.iter().map(|n| n.low == 0.0));
    let values = linear.gear.iter().chain(nonlinear);
    let all: Vec<usize> = (0..columns.len() + infos.len()).collect();
    let spread = Spread::of(problem, nonlinear, linear, noise, &all);
    let mut lines = Vec::with_capacity(all.len());
    for (k, (((name, unit), at_least_0), value)) in named.zip(at_least_0).zip(values).enumerate() {
        let direction = spread.direction(&DVector::from_fn(all.len(), |i, _| if i == k { 1.0 } else { 0.0 }));
        let sd = direction.as_ref().map(|d| spread.sd(d));
        let (name, at_bound) = ((name.clone(), unit.clone()), at_least_0 && *value == 0.0);
        lines.push((Estimated::new(name, *value, sd, at_bound, Note::Open(remedy), remedy), direction));
    }
    correlated(lines)
}

/// Parameters with the directions of those that have a standard deviation.
pub(crate) fn correlated(lines: Vec<(Estimated, Option<DVector<f64>>)>) -> Uncertainty {
    let known: Vec<(&Cow<'static, str>, &DVector<f64>)> = lines
        .iter()
        .filter_map(|(l, d)| d.as_ref().filter(|d| l.sd.is_some() && d.norm() > 0.0).map(|d| (&l.name, d)))
        .collect();
    let correlation =
        known.iter().map(|(_, a)| known.iter().map(|(_, b)| a.dot(b) / (a.norm() * b.norm())).collect()).collect();
    let correlated = known.iter().map(|(name, _)| (*name).clone()).collect();
    Uncertainty { correlated, correlation, parameters: lines.into_iter().map(|(line, _)| line).collect() }
}

/// A number, its unit, its value, and its derivatives by the two numbers of the memory that are fitted; `None` where a rate-independent loop leaves it open.
type Number = (&'static str, &'static str, f64, Option<[f64; 2]>);

/// What a model file says of a memory, and what a quasi-static loop tells of (α, β, ω). Fitted are e and h (law `masing`), α of the unit direction of (β, ω) and that direction's angle
/// (law `phase`), or α and ln β (law `time`).
fn numbers(memory: &Memory) -> Vec<Number> {
    let Memory { law, kernel, alpha: a, beta_per_s: b, omega_per_s: w, .. } = *memory;
    let alpha_unit = if kernel == Kernel::Rate { "N·m/rad" } else { "N·m/(rad·s)" };
    if law == Law::Time {
        return vec![("alpha", alpha_unit, a, Some([1.0, 0.0])), ("beta_per_s", "1/s", b, Some([0.0, b]))];
    }
    let q = b * b + w * w;
    let (e, h) = (memory.e(), memory.h());
    let (by_e, by_h, by_rho) = if law == Law::Masing {
        ([1.0, 0.0], [0.0, 1.0], (h > 0.0).then(|| [1.0 / h, -e / (h * h)]))
    } else {
        let (sin, cos) = (b / q.sqrt(), w / q.sqrt());
        ([sin, h], [cos, -e], Some([0.0, q / (w * w)]))
    };
    let scaled = |gradient: [f64; 2], factor: f64| gradient.map(|g| factor * g);
    // At 0 a number stays there in every gauge.
    let alpha = (a == 0.0).then(|| scaled(by_h, q / w));
    let alpha = if kernel == Kernel::Rate { Some([1.0, 0.0]) } else { alpha };
    let beta = by_rho.filter(|_| b == 0.0).map(|by_rho| scaled(by_rho, w));
    let omega = (w == 0.0).then(|| scaled(by_h, b / e));
    let mut numbers =
        vec![("alpha", alpha_unit, a, alpha), ("beta_per_s", "1/s", b, beta), ("omega_per_s", "1/s", w, omega)];
    if kernel == Kernel::Deflection {
        numbers.extend([("e", "N·m/rad", e, Some(by_e)), ("h", "N·m/rad", h, Some(by_h))]);
    }
    if w > 0.0 {
        numbers.push(("rho", "1", memory.rho(), by_rho));
    }
    numbers
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
