//! The free numbers of a model: those of the gear and those of its terms, in one list that an optimiser can walk.

use std::borrow::Cow;

use gmhm::Law;
use gmhm::terms::{Domain, Form, KeyInfo, Role};

use crate::kinds;
use crate::model::{Model, ORDERS, Term, TermValue};
use crate::physics::PredictError;
use crate::physics::columns::{Evaluation, get, set};
use crate::regression::assembly::from_cycle;
use crate::regression::base::ELASTIC;
use crate::regression::deflection_zeros::DEFLECTION_ZERO;

/// A derivative by an order is taken this far on both sides.
const ORDER_STEP: f64 = 1e-4;

/// One free number of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FreeParameter {
    /// c1, c2 or c3.
    Elastic(usize),
    /// e, h of laws `masing` and `phase`; α, β of law `time`.
    Memory(usize),
    /// The zero of the deflection.
    Zero,
    /// A number of a term.
    Term {
        /// Which term.
        term: usize,
        /// Its key.
        key: &'static KeyInfo,
        /// Which number of a list.
        index: Option<usize>,
    },
}

impl FreeParameter {
    /// Whether it is a number of the gear, or of one of the first `terms` terms: of a base with so many terms.
    pub fn is_of_base(&self, terms: usize) -> bool {
        !matches!(self, Self::Term { term, .. } if *term >= terms)
    }

    /// Whether it is a linear number of one of the first `terms` terms.
    pub fn is_linear_of_first(&self, terms: usize) -> bool {
        matches!(self, Self::Term { term, key, .. } if *term < terms && key.role == Role::Linear)
    }

    /// Whether it is a linear number of one term.
    pub fn is_linear_of(&self, one: usize) -> bool {
        matches!(self, Self::Term { term, key, .. } if *term == one && key.role == Role::Linear)
    }
}

/// The free numbers of the gear; the zero of the deflection is apart.
pub fn of_gear(model: &Model) -> Vec<FreeParameter> {
    let mut free = Vec::new();
    if model.elastic.is_some() {
        free.extend((0..3).map(FreeParameter::Elastic));
    }
    if model.memory.is_some() {
        free.extend((0..2).map(FreeParameter::Memory));
    }
    free
}

/// The free numbers of a model. `zero` frees the zero of the deflection.
pub fn free(model: &Model, zero: bool) -> Vec<FreeParameter> {
    let terms = (0..model.terms.len()).flat_map(|term| of_term(model, term));
    of_gear(model).into_iter().chain(zero.then_some(FreeParameter::Zero)).chain(terms).collect()
}

/// The free numbers of a term.
pub fn of_term(model: &Model, term: usize) -> Vec<FreeParameter> {
    let Some(info) = model.terms[term].info() else { return Vec::new() };
    let shape = match model.terms[term].values.get("shape") {
        Some(TermValue::Text(shape)) => Some(shape.as_str()),
        _ => None,
    };
    let kind = kinds::of_term(&model.terms[term]);
    let is_fixed = |key: &KeyInfo| kind.is_some_and(|kind| kind.is_scale(key) || kind.repeats_another(model, key));
    let free = |key: &&'static KeyInfo| {
        let is_number = !matches!(key.form, Form::Choice(_)) && (key.role != Role::Structure || key.name == ORDERS);
        // An optional number that was left out stays 0.
        is_number && !is_fixed(key) && key.belongs_to(shape) && model.terms[term].values.contains_key(key.name)
    };
    // A whole order is that of a mechanism, not a number to be fitted.
    let whole = |parameter: &FreeParameter| match parameter {
        FreeParameter::Term { key, .. } if key.name == ORDERS => value(model, *parameter).fract() == 0.0,
        _ => false,
    };
    info.keys
        .iter()
        .filter(free)
        .flat_map(|key| match model.terms[term].values.get(key.name) {
            Some(TermValue::List(list)) => {
                (0..list.len()).map(|i| FreeParameter::Term { term, key, index: Some(i) }).collect()
            }
            _ => vec![FreeParameter::Term { term, key, index: None }],
        })
        .filter(|parameter| !whole(parameter))
        .collect()
}

/// The value at a parameter.
pub fn value(model: &Model, parameter: FreeParameter) -> f64 {
    match parameter {
        FreeParameter::Elastic(i) => {
            model.elastic.map_or(0.0, |c| [c.c1_nm_per_rad, c.c2_nm_per_rad3, c.c3_nm_per_rad5][i])
        }
        FreeParameter::Memory(i) => model.memory.map_or(0.0, |m| match (m.law, i) {
            (Law::Time, 0) => m.alpha,
            (Law::Time, _) => m.beta_per_s,
            (_, 0) => m.e(),
            (_, _) => m.h(),
        }),
        FreeParameter::Zero => model.gear.deflection_zero_rad,
        FreeParameter::Term { term, key, index } => get(&model.terms[term], key, index),
    }
}

/// Sets a parameter, within what it accepts.
pub fn put(model: &mut Model, parameter: FreeParameter, value: f64) {
    let value = match parameter {
        FreeParameter::Term { .. } => {
            let (low, high) = bounds(model, parameter);
            value.clamp(low, high)
        }
        _ => value,
    };
    put_freely(model, parameter, value);
}

/// Sets a parameter to whatever a search that keeps bounds of its own has found.
pub fn put_freely(model: &mut Model, parameter: FreeParameter, value: f64) {
    match parameter {
        FreeParameter::Elastic(i) => {
            if let Some(c) = &mut model.elastic {
                *[&mut c.c1_nm_per_rad, &mut c.c2_nm_per_rad3, &mut c.c3_nm_per_rad5][i] = value;
            }
        }
        FreeParameter::Memory(i) => {
            if let Some(m) = &mut model.memory {
                let value = value.max(0.0);
                match (m.law, i) {
                    (Law::Time, 0) => m.alpha = value,
                    (Law::Time, _) => m.beta_per_s = value,
                    (_, i) => {
                        let gauge = if m.omega_per_s > 0.0 { m.omega_per_s } else { 1.0 };
                        let (e, h) = if i == 0 { (value, m.h()) } else { (m.e(), value) };
                        // A loop of no height has no direction (β, ω) of its own.
                        (m.alpha, m.beta_per_s, m.omega_per_s) = from_cycle(e, h.max(1e-9), gauge);
                    }
                }
            }
        }
        FreeParameter::Zero => model.gear.deflection_zero_rad = value,
        FreeParameter::Term { term, key, index } => {
            model.terms[term] = set(&model.terms[term], key, index, value);
        }
    }
}

/// How far a parameter may be lowered: the difference to its lowest value, not above 0.
pub fn room(model: &Model, parameter: FreeParameter) -> f64 {
    (bounds(model, parameter).0 - value(model, parameter)).min(0.0)
}

/// The bounds of a parameter.
pub fn bounds(model: &Model, parameter: FreeParameter) -> (f64, f64) {
    let open = (f64::NEG_INFINITY, f64::INFINITY);
    match parameter {
        FreeParameter::Memory(_) => (0.0, f64::INFINITY),
        FreeParameter::Term { term, key, index } => {
            let own = &model.terms[term];
            kinds::of_term(own).map_or(open, |kind| kind.bounds(model, own, key, index))
        }
        FreeParameter::Elastic(_) | FreeParameter::Zero => open,
    }
}

/// A derivative is taken at least this share of the value away from it, the square root of the resolution: what is less is lost in rounding.
const LEAST_STEP: f64 = 1.5e-8;

/// How far from the value a derivative is taken on both sides.
pub fn step(model: &Model, parameter: FreeParameter) -> f64 {
    usual_step(model, parameter).max(LEAST_STEP * value(model, parameter).abs())
}

/// What would show in the torque of a plausible gear.
fn usual_step(model: &Model, parameter: FreeParameter) -> f64 {
    let rated = model.gear.rated_deflection_rad.unwrap_or(1.0);
    let stiffness = model.elastic.map_or(1.0, |c| c.c1_nm_per_rad.abs().max(1e-9));
    match parameter {
        FreeParameter::Elastic(i) => 1e-3 * stiffness / rated.powi(2 * i as i32),
        FreeParameter::Memory(i) if model.memory.is_some_and(|m| m.law == Law::Time) => {
            let value = value(model, parameter).abs();
            if i == 0 { 1e-3 * value.max(1e-6 * stiffness) } else { 1e-4 * value.max(1e-6) }
        }
        FreeParameter::Memory(_) => 1e-3 * stiffness,
        FreeParameter::Zero => 1e-4 * rated,
        FreeParameter::Term { term, key, index } => {
            let span = key.plausible.1 - key.plausible.0;
            let value = get(&model.terms[term], key, index).abs();
            match key.role {
                _ if key.name == ORDERS => ORDER_STEP,
                Role::Linear => 1e-3 * span,
                _ => 1e-3 * value.max(0.003 * span),
            }
        }
    }
}

/// The two values at which a derivative is taken.
pub fn sides(model: &Model, parameter: FreeParameter) -> (f64, f64) {
    let (value, step) = (value(model, parameter), step(model, parameter));
    ((value - step).max(bounds(model, parameter).0), value + step)
}

/// Whether the torque is linear in a parameter while the others stay.
pub fn is_linear(model: &Model, parameter: FreeParameter) -> bool {
    match parameter {
        FreeParameter::Elastic(_) => true,
        FreeParameter::Memory(i) => match model.memory.map(|m| m.law) {
            Some(Law::Masing) => true,
            Some(Law::Time) => i == 0,
            _ => false,
        },
        FreeParameter::Zero => false,
        FreeParameter::Term { key, .. } => {
            key.role == Role::Linear && domain(model, parameter) != Some(Domain::Deflection)
        }
    }
}

/// Which of the parameters the torque is linear in, all of them together.
pub fn linear_together(model: &Model, free: &[FreeParameter]) -> Vec<bool> {
    let followed = model.terms.iter().any(Term::follows_base);
    // T_base is the gear's torque, that of a simulation, or the load of a joint with neither.
    let is_of_loads = model.has_terms_alone();
    let of_base = |parameter: FreeParameter| match parameter {
        FreeParameter::Term { .. } => is_of_loads && domain(model, parameter) == Some(Domain::Load),
        _ => true,
    };
    free.iter().map(|&parameter| is_linear(model, parameter) && !(followed && of_base(parameter))).collect()
}

/// Where the term of a parameter acts.
pub fn domain(model: &Model, parameter: FreeParameter) -> Option<Domain> {
    match parameter {
        FreeParameter::Term { term, .. } => model.terms[term].info().map(|info| info.domain),
        _ => None,
    }
}

/// The change of the torque with a parameter of a model that was evaluated on a recording; `total` is the torque of another model there.
///
/// # Errors
/// A model that cannot be evaluated.
pub fn derivative(
    model: &Model,
    parameter: FreeParameter,
    evaluation: &Evaluation<'_>,
    total: impl Fn(&Model) -> Result<Vec<f64>, PredictError>,
) -> Result<Vec<f64>, PredictError> {
    if let FreeParameter::Term { term, key, index } = parameter
        && is_linear(model, parameter)
        && let Some(unit) = evaluation.unit_part(&model.terms[term], key, index)?
    {
        return Ok(unit);
    }
    let now = value(model, parameter);
    let at = |to: f64| {
        let mut moved = model.clone();
        put(&mut moved, parameter, to);
        if let FreeParameter::Term { term, index, .. } = parameter
            && let Some(part) = evaluation.part(&element_alone(&moved.terms[term], index))?
        {
            return Ok(part);
        }
        if value(&moved, parameter) == now { Ok(evaluation.total().to_vec()) } else { total(&moved) }
    };
    let (low, high) = sides(model, parameter);
    let low = if is_linear(model, parameter) { now } else { low };
    let (above, below) = (at(high)?, at(low)?);
    Ok(above.iter().zip(&below).map(|(a, b)| (a - b) / (high - low)).collect())
}

/// A term with one element of its lists alone, a wave or a slip element, since the torques of its elements add up; any other term as it is.
fn element_alone(term: &Term, index: Option<usize>) -> Cow<'_, Term> {
    let index = index.filter(|_| term.kind != kinds::UNKNOWN);
    index.and_then(|index| kinds::with_elements(term, |at| at == index)).map_or(Cow::Borrowed(term), Cow::Owned)
}

/// Whether a parameter of a joint's model resists motion: friction and inertia have a sign.
pub fn resists(model: &Model, parameter: FreeParameter) -> bool {
    matches!(parameter, FreeParameter::Term { key, .. } if !model.has_gear() && key.plausible.0 >= 0.0)
}

/// The name of a free number, as in the model file, and its unit. A term's follows its kind, a second of its kind is numbered, and so are the numbers of lists.
pub fn named(model: &Model, free: FreeParameter) -> (Cow<'static, str>, Cow<'static, str>) {
    let time = model.memory.is_some_and(|memory| memory.law == Law::Time);
    let (name, unit) = match free {
        FreeParameter::Elastic(i) => ELASTIC[i],
        FreeParameter::Memory(0) if time => ("alpha", ""),
        FreeParameter::Memory(_) if time => ("beta_per_s", "1/s"),
        FreeParameter::Memory(0) => ("e", "N·m/rad"),
        FreeParameter::Memory(_) => ("h", "N·m/rad"),
        FreeParameter::Zero => (DEFLECTION_ZERO, "rad"),
        FreeParameter::Term { term, key, index } => {
            let kind = &model.terms[term].kind;
            let before = model.terms[..term].iter().filter(|other| other.kind == *kind).count();
            let number = if before > 0 { format!("_{}", before + 1) } else { String::new() };
            let index = index.map_or_else(String::new, |index| format!("[{index}]"));
            return (format!("{kind}{number}.{}{index}", key.name).into(), key.unit.into());
        }
    };
    (name.into(), unit.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{TEST_GEAR, parse};

    const STRIBECK: &str = r#"
            [[term]]
            kind = "stribeck_friction"
            coulomb_nm = 0.0
            static_nm = 1.0
            stribeck_velocity_rad_per_s = 0.05
            exponent = 2.0
            damping_nms_per_rad = 0.0
            smoothing_rad_per_s = 0.004"#;

    #[test]
    fn a_derivative_has_two_sides_however_large_the_number_has_become() {
        let model = parse("gear.toml", &format!("{TEST_GEAR}{STRIBECK}")).unwrap();
        let free = of_gear(&model).into_iter().chain([FreeParameter::Zero]).chain(of_term(&model, 0));
        for parameter in free {
            for size in [1.0, 1e16, 1e28] {
                let mut scaled = model.clone();
                put(&mut scaled, parameter, size * value(&model, parameter).max(1.0));
                let (low, high) = sides(&scaled, parameter);
                let at = value(&scaled, parameter);
                assert!(low < high && at < high, "{parameter:?} {size:e}: {low:e} {at:e} {high:e}");
            }
        }
    }

    #[test]
    fn what_another_term_does_already_is_not_free() {
        let text = r#"
            [[term]]
            kind = "coulomb_friction"
            torque_nm = 1.0
            smoothing_rad_per_s = 0.004
            [[term]]
            kind = "viscous_friction"
            damping_nms_per_rad = 1.0"#;
        let beside = parse("joint.toml", &format!("format = 1\n{STRIBECK}{text}")).unwrap();
        let mut alone = beside.clone();
        alone.terms.truncate(1);
        let keys = |model: &Model| -> Vec<&str> {
            let key = |parameter| if let FreeParameter::Term { key, .. } = parameter { Some(key.name) } else { None };
            of_term(model, 0).into_iter().filter_map(key).collect()
        };
        let (all, own) = (keys(&alone), keys(&beside));
        assert!(all.contains(&"coulomb_nm") && all.contains(&"damping_nms_per_rad"), "{all:?}");
        assert_eq!(own, ["static_nm", "stribeck_velocity_rad_per_s", "exponent", "smoothing_rad_per_s"]);
    }
}
