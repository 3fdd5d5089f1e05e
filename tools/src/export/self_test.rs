//! Golden samples, and the core beside an export.

use std::fmt::Write;

use gmhm::inverse::Inverse;
use gmhm::memory::AnyLaw;
use gmhm::scalar::Float;
use gmhm::terms::compensated::{CompensatedState, Total};
use gmhm::terms::{Compensated, Sample, Setting, Side, Source, Stack};
use gmhm::{Gear, Law};

use super::numbers::literal;
use super::plan::{Plan, Precision};
use super::{ExportError, ExportOptions};
use crate::block::Rounded;
use crate::model::{Model, Term};
use crate::physics::term::MOST_TERMS;

const TEMPLATE: &str = include_str!("../../templates/export/self_test.c");

/// Turning points that the core remembers beside an export.
const DEPTH: usize = 256;

/// Rows of the golden path.
const ROWS: u32 = 240;

/// A model in the core, beside its export.
#[derive(Clone)]
pub struct Reference<S: Float<Carry = S>, const N: usize> {
    compensated: Compensated<S, AnyLaw<S>, MOST_TERMS>,
    inverse: Option<Inverse<S>>,
    state: Option<CompensatedState<S, N, AnyLaw<S>, MOST_TERMS>>,
}

/// A scalar in which terms of model files can be read.
pub trait Readable: Float<Carry = Self> {
    /// Adds a term to a stack.
    ///
    /// # Errors
    /// What the core refuses.
    fn add(stack: &mut Stack<Self, MOST_TERMS>, term: &Term) -> Result<(), gmhm::terms::TermError>;
}

impl Readable for f64 {
    fn add(stack: &mut Stack<f64, MOST_TERMS>, term: &Term) -> Result<(), gmhm::terms::TermError> {
        stack.add(&term.kind, term as &dyn Source<f64>)
    }
}

impl Readable for f32 {
    fn add(stack: &mut Stack<f32, MOST_TERMS>, term: &Term) -> Result<(), gmhm::terms::TermError> {
        stack.add(&term.kind, &Rounded::new(term))
    }
}

impl<S: Readable, const N: usize> Reference<S, N> {
    /// The core's own gear and terms of a model that can be exported.
    ///
    /// # Errors
    /// [`ExportError`], as of the export.
    pub fn new(model: &Model, options: &ExportOptions) -> Result<Self, ExportError> {
        Self::of(&Plan::new(model, options)?)
    }

    fn of(plan: &Plan) -> Result<Self, ExportError> {
        let law = AnyLaw::<S>::new(&plan.params, plan.period_s);
        let setting = Setting {
            sigma: S::from_f64(plan.sigma),
            c1: S::from_f64(plan.params.elastic().c1_nm_per_rad),
            rated_deflection: S::from_f64(plan.params.rated_deflection_rad()),
        };
        let mut stack = Stack::of_gear(setting);
        for term in plan.model.terms.iter().filter(|term| term.info().is_some_and(|info| info.side == Side::Plant)) {
            <S as Readable>::add(&mut stack, term)
                .map_err(|error| ExportError::Term { kind: term.kind.clone(), error })?;
        }
        let compensated = Compensated { gear: Gear::with_law(&plan.params, law), stack };
        Ok(Self { compensated, inverse: Inverse::of(&plan.params, law, plan.period_s).ok(), state: None })
    }

    /// The torques at the next sample; the first one is the start.
    pub fn step(&mut self, sample: &Sample<S>) -> Total<S> {
        match &mut self.state {
            None => {
                let state = self.compensated.start::<N>(sample);
                let total = *state.last();
                self.state = Some(state);
                total
            }
            Some(state) => self.compensated.step(state, sample),
        }
    }

    /// The deflection of the base model for a torque at the next sample, and whether it is an edge. None before the first sample and without an inverse.
    pub fn invert(&self, torque: S, period: S) -> Option<(S, bool)> {
        let solution = self.inverse.as_ref()?.peek_after(self.state.as_ref()?.gear(), torque, period);
        Some((solution.theta, solution.saturated))
    }

    /// The past of the gear.
    pub fn gear(&self) -> Option<&gmhm::State<S, N>> {
        self.state.as_ref().map(CompensatedState::gear)
    }
}

/// A field of a sample by its name in C.
pub fn set_field<S: Float>(sample: &mut Sample<S>, name: &str, value: S) {
    let field = match name {
        "deflection_rad" => &mut sample.deflection,
        "motor_angle_rad" => &mut sample.motor_angle,
        "output_angle_rad" => &mut sample.output_angle,
        "deflection_rate_rad_per_s" => &mut sample.deflection_rate,
        "velocity_rad_per_s" => &mut sample.velocity,
        "acceleration_rad_per_s2" => &mut sample.acceleration,
        "temperature_c" => &mut sample.temperature,
        "time_s" => &mut sample.time,
        "motor_velocity_rad_per_s" => &mut sample.motor_velocity,
        "output_velocity_rad_per_s" => &mut sample.output_velocity,
        "period_s" => &mut sample.period,
        _ => return,
    };
    *field = value;
}

/// A field of row `k` of the golden path: load to 0.95 A and back, minor loops on the way, the joint moving as it does so.
fn golden_field(plan: &Plan, name: &str, k: u32) -> f64 {
    let period = if plan.period_s > 0.0 { plan.period_s } else { 1e-3 };
    let t = f64::from(k) / f64::from(ROWS);
    let (slow, fast) = ((6.0 * t).sin(), (41.0 * t).sin());
    match name {
        "deflection_rad" => plan.params.rated_deflection_rad() * (0.75 * slow + 0.2 * fast),
        "motor_angle_rad" => 60.0 * t + 3.0 * slow,
        "output_angle_rad" => 0.6 * t + 0.03 * slow,
        "deflection_rate_rad_per_s" => {
            plan.params.rated_deflection_rad() * (4.5 * (6.0 * t).cos() + 8.2 * (41.0 * t).cos())
        }
        "velocity_rad_per_s" | "output_velocity_rad_per_s" => 0.3 + 1.5 * slow,
        "motor_velocity_rad_per_s" => 30.0 + 150.0 * slow,
        "acceleration_rad_per_s2" => 9.0 * (6.0 * t).cos(),
        "temperature_c" => 22.0 + 10.0 * t,
        "time_s" => f64::from(k) * period,
        _ => {
            if k == 0 {
                0.0
            } else {
                period
            }
        }
    }
}

/// The self-test of a plan: golden samples of the core, and a `main` that compares.
pub(super) fn text(plan: &Plan, sample: &[&'static str]) -> Result<String, ExportError> {
    match plan.precision {
        Precision::F32 => of::<f32>(plan, sample),
        Precision::F64 => of::<f64>(plan, sample),
    }
}

fn of<S: Readable>(plan: &Plan, fields: &[&'static str]) -> Result<String, ExportError> {
    let mut reference = Reference::<S, DEPTH>::of(plan)?;
    let number = |x: S| literal(x.to_f64(), plan.precision);
    // The other laws know no time.
    let period = S::from_f64(if plan.law == Law::Time { plan.period_s } else { 0.0 });
    let scale = plan.params.torque_scale_nm();
    let (mut rows, mut largest) = (String::new(), scale);
    for k in 0..ROWS {
        let mut sample = Sample::default();
        let values: Vec<String> = fields
            .iter()
            .map(|name| {
                let value = S::from_f64(golden_field(plan, name, k));
                set_field(&mut sample, name, value);
                number(value)
            })
            .collect();
        let total = reference.step(&sample);
        largest = largest.max(total.terms.abs().to_f64());
        let aim = S::from_f64(0.8 * scale * (0.3 * f64::from(k)).sin());
        let theta = reference.invert(aim, period).map_or(S::ZERO, |(theta, _)| theta);
        let _ = writeln!(
            rows,
            "    {{ {{ {} }}, {}, {}, {} }},",
            values.join(", "),
            number(total.torque),
            number(aim),
            number(theta)
        );
    }
    // What the functions of one C library differ by from another's; law masing without terms calls none but the square root.
    let exact = plan.law == Law::Masing && plan.terms.is_empty();
    let share = match (exact, plan.precision) {
        (true, Precision::F32) => 0.0,
        (_, Precision::F32) => 1e-5,
        (_, Precision::F64) => 1e-10,
    };
    let period_text = if plan.law == Law::Time { format!(", {}", number(period)) } else { String::new() };
    let inverted = if plan.without_inverse.is_some() {
        "GOLDEN[k].deflection_rad".to_owned()
    } else {
        format!("gear_invert(&gear_gear, &joint, GOLDEN[k].aim_nm{period_text}).deflection_rad")
    };
    Ok(super::template::fill(
        TEMPLATE,
        &[
            ("rows", &rows),
            ("count", &ROWS.to_string()),
            ("torque_tolerance", &literal(share * largest, plan.precision)),
            ("deflection_tolerance", &literal(share * plan.params.rated_deflection_rad(), plan.precision)),
            ("inverted", &inverted),
        ],
    ))
}
