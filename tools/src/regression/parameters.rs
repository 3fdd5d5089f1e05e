//! The free numbers of a model: those of the gear and those of its terms, in one list that an optimiser can walk.

use gmhm::Law;
use gmhm::terms::{Form, KeyInfo, Role};

use crate::kinds;
use crate::model::{Model, TermValue};
use crate::physics::columns::{get, set};
use crate::regression::assembly::from_cycle;

/// The key of harmonic orders.
const ORDERS: &str = "orders";
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

/// The free numbers of the gear; the zero of the deflection is apart.
pub fn of_gear(model: &Model) -> Vec<FreeParameter> {
    let mut places = Vec::new();
    if model.elastic.is_some() {
        places.extend((0..3).map(FreeParameter::Elastic));
    }
    if model.memory.is_some() {
        places.extend((0..2).map(FreeParameter::Memory));
    }
    places
}

/// The free numbers of a term.
pub fn of_term(model: &Model, term: usize) -> Vec<FreeParameter> {
    let Some(info) = model.terms[term].info() else { return Vec::new() };
    let shape = match model.terms[term].values.get("shape") {
        Some(TermValue::Text(shape)) => Some(shape.as_str()),
        _ => None,
    };
    let kind = kinds::of_term(&model.terms[term]);
    let is_scale = |key: &KeyInfo| kind.is_some_and(|kind| kind.is_scale(key));
    let free = |key: &&'static KeyInfo| {
        let is_number = !matches!(key.form, Form::Choice(_)) && (key.role != Role::Structure || key.name == ORDERS);
        // An optional number that was left out stays 0.
        is_number && !is_scale(key) && key.belongs_to(shape) && model.terms[term].values.contains_key(key.name)
    };
    // A whole order is that of a mechanism, not a number to be fitted.
    let whole = |place: &FreeParameter| match place {
        FreeParameter::Term { key, .. } if key.name == ORDERS => value(model, *place).fract() == 0.0,
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
        .filter(|place| !whole(place))
        .collect()
}

/// The value at a place.
pub fn value(model: &Model, place: FreeParameter) -> f64 {
    match place {
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

/// Sets a place, within what it accepts.
pub fn put(model: &mut Model, place: FreeParameter, value: f64) {
    match place {
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
            let (low, high) = bounds(model, term, key, index);
            model.terms[term] = set(&model.terms[term], key, index, value.clamp(low, high));
        }
    }
}

/// How far a place may be lowered: the difference to its lowest value, not above 0.
pub fn room(model: &Model, place: FreeParameter) -> f64 {
    let value = value(model, place);
    let low = match place {
        FreeParameter::Memory(_) => 0.0,
        FreeParameter::Term { term, key, index } => bounds(model, term, key, index).0,
        _ => f64::NEG_INFINITY,
    };
    (low - value).min(0.0)
}

/// A derivative is taken at least this share of the value away from it, the square root of the resolution: what is less is lost in rounding.
const LEAST_STEP: f64 = 1.5e-8;

/// How far from the value a derivative is taken on both sides.
pub fn step(model: &Model, place: FreeParameter) -> f64 {
    usual_step(model, place).max(LEAST_STEP * value(model, place).abs())
}

/// What would show in the torque of a plausible gear.
fn usual_step(model: &Model, place: FreeParameter) -> f64 {
    let rated = model.gear.rated_deflection_rad.unwrap_or(1.0);
    let stiffness = model.elastic.map_or(1.0, |c| c.c1_nm_per_rad.abs().max(1e-9));
    match place {
        FreeParameter::Elastic(i) => 1e-3 * stiffness / rated.powi(2 * i as i32),
        FreeParameter::Memory(i) if model.memory.is_some_and(|m| m.law == Law::Time) => {
            let value = value(model, place).abs();
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

/// The bounds of a number of a term.
fn bounds(model: &Model, term: usize, key: &KeyInfo, index: Option<usize>) -> (f64, f64) {
    let own = &model.terms[term];
    kinds::of_term(own).map_or((f64::NEG_INFINITY, f64::INFINITY), |kind| kind.bounds(model, own, key, index))
}

/// The two values at which a derivative is taken.
pub fn sides(model: &Model, place: FreeParameter) -> (f64, f64) {
    let (value, step) = (value(model, place), step(model, place));
    let low = match place {
        FreeParameter::Memory(_) => 0.0,
        FreeParameter::Term { term, key, index } => bounds(model, term, key, index).0,
        _ => f64::NEG_INFINITY,
    };
    ((value - step).max(low), value + step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parse;

    #[test]
    fn a_derivative_has_two_sides_however_large_the_number_has_become() {
        let text = r#"format = 1
            [gear]
            rated_deflection_rad = 1e-3
            [elastic]
            c1_nm_per_rad = 2.4e4
            c2_nm_per_rad3 = 2.1e9
            c3_nm_per_rad5 = -6e14
            [memory]
            law = "masing"
            alpha = 2.3e6
            beta_per_s = 416.0
            omega_per_s = 200.0
            [[term]]
            kind = "stribeck_friction"
            coulomb_nm = 0.0
            static_nm = 1.0
            stribeck_velocity_rad_per_s = 0.05
            exponent = 2.0
            damping_nms_per_rad = 0.0
            smoothing_rad_per_s = 0.004"#;
        let model = parse("gear.toml", text).unwrap();
        let places = of_gear(&model).into_iter().chain([FreeParameter::Zero]).chain(of_term(&model, 0));
        for place in places {
            for size in [1.0, 1e16, 1e28] {
                let mut grown = model.clone();
                put(&mut grown, place, size * value(&model, place).max(1.0));
                let (low, high) = sides(&grown, place);
                let at = value(&grown, place);
                assert!(low < high && at < high, "{place:?} {size:e}: {low:e} {at:e} {high:e}");
            }
        }
    }
}
