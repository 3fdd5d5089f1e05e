//! The shapes in which a kind is tried, over a grid as wide as the recordings allow.

use std::collections::BTreeMap;

use crate::kinds::ranges::{FEWEST_MOTOR_TURNS, FEWEST_OUTPUT_TURNS, Ranges};
use crate::model::{Model, Term, TermValue};

/// The shapes in which a kind is tried.
pub fn candidate_grid(kind: &str, ranges: &Ranges, model: &Model) -> Vec<Term> {
    let a = ranges.rated_rad;
    let fastest = ranges.velocity_rad_per_s;
    let turning = ranges.motor_turns > FEWEST_MOTOR_TURNS;
    let swinging = ranges.output_turns > FEWEST_OUTPUT_TURNS;
    let smoothings = [0.003, 0.01, 0.03, 0.09].map(|x| x * fastest);
    let duration = ranges.end_s - ranges.start_s;
    let has = |kind: &str| model.terms.iter().any(|t| t.kind == kind);
    let waves = |orders: &[f64]| -> Vec<Term> {
        let mut unique: Vec<f64> = Vec::new();
        for &order in orders {
            if unique.iter().all(|o: &f64| (o - order).abs() > 1e-9) {
                unique.push(order);
            }
        }
        unique.into_iter().map(|order| term(kind, &[("orders", list(order))])).collect()
    };
    match kind {
        "kinematic_error" if turning => waves(&[&ranges.motor_orders[..], &[1.0, 2.0, 4.0]].concat()),
        "torque_ripple" if turning => waves(&[&ranges.motor_orders[..], &[1.0, 2.0, 3.0, 4.0, 6.0]].concat()),
        "encoder_eccentricity" | "gravity_load" if swinging => vec![term(kind, &[])],
        "coulomb_friction" | "load_dependent_friction" if fastest > 0.0 => {
            smoothings.iter().map(|&s| term(kind, &[("smoothing_rad_per_s", number(s))])).collect()
        }
        "viscous_friction" | "inertia" if fastest > 0.0 => vec![term(kind, &[])],
        "viscous_damping" => vec![term(kind, &[])],
        "stribeck_friction" if fastest > 0.0 => {
            let mut terms = Vec::new();
            for smoothing in [0.01, 0.03].map(|x| x * fastest) {
                for velocity in [0.05, 0.12, 0.28].map(|x| x * fastest) {
                    for exponent in [0.7, 1.0, 2.0] {
                        terms.push(term(
                            kind,
                            &[
                                ("stribeck_velocity_rad_per_s", number(velocity)),
                                ("exponent", number(exponent)),
                                ("smoothing_rad_per_s", number(smoothing)),
                            ],
                        ));
                    }
                }
            }
            terms
        }
        "position_dependent_friction" if fastest > 0.0 => {
            let mut terms = Vec::new();
            for &smoothing in &smoothings[..3] {
                let mut add = |angle: &str, order: f64| {
                    terms.push(term(
                        kind,
                        &[("angle", text(angle)), ("orders", list(order)), ("smoothing_rad_per_s", number(smoothing))],
                    ));
                };
                if turning {
                    let mut orders = vec![1.0, 2.0];
                    orders.extend(ranges.friction_orders.iter().filter(|o| **o != 1.0 && **o != 2.0));
                    orders.into_iter().for_each(|order| add("motor", order));
                }
                if swinging {
                    add("output", 1.0);
                    add("output", 2.0);
                }
            }
            terms
        }
        "soft_windup" if a > 0.0 => {
            let shapes = ["tanh", "rational", "gaussian"];
            let widths = [0.05, 0.08, 0.13, 0.2, 0.32, 0.5].map(|x| x * a);
            let both = |shape: &'static str| {
                widths.map(|w| term(kind, &[("shape", text(shape)), ("width_rad", number(w))])).to_vec()
            };
            let kinks = [(0.05, 0.13), (0.08, 0.3), (0.13, 0.5), (0.2, 0.4), (0.2, 0.7), (0.35, 0.75)];
            let catalogue = kinks.map(|(first, second)| kinked(first * a, second * a, ranges));
            shapes.into_iter().flat_map(both).chain(catalogue).collect()
        }
        "stiffness_asymmetry" => ["square", "abs"].map(|s| term(kind, &[("shape", text(s))])).to_vec(),
        "backlash" if a > 0.0 => {
            ["clearance", "play"].map(|s| term(kind, &[("shape", text(s)), ("half_gap_rad", number(0.0))])).to_vec()
        }
        "nonlocal_memory" if a > 0.0 => {
            [0.03, 0.05, 0.08, 0.13, 0.2, 0.32, 0.5, 0.8].map(|r| term(kind, &[("radius_rad", list(r * a))])).to_vec()
        }
        "creep" => {
            let mut taus = Vec::new();
            let mut tau = (30.0 * ranges.period_s).max(0.3);
            while tau < 0.7 * duration {
                taus.push(term(kind, &[("tau_s", list(tau))]));
                tau *= 1.8;
            }
            taus
        }
        "time_skew" => vec![term(kind, &[("delay_s", number(0.0))])],
        "thermal_stiffness" | "thermal_zero_drift" => {
            let reference = ranges.temperature_c.map(|t| (10.0 * t).round() / 10.0);
            reference.map(|r| vec![term(kind, &[("reference_c", number(r))])]).unwrap_or_default()
        }
        "thermal_friction" if has("coulomb_friction") || has("stribeck_friction") || has("viscous_friction") => {
            let reference = ranges.temperature_c.map(|t| (10.0 * t).round() / 10.0);
            reference
                .map(|r| vec![term(kind, &[("per_k", number(0.0)), ("reference_c", number(r))])])
                .unwrap_or_default()
        }
        "sensor_drift" => vec![term(kind, &[])],
        "wear" => {
            let mut terms = Vec::new();
            for start in [0.0, 0.12, 0.25, 0.35, 0.45, 0.55, 0.65, 0.8].map(|x| ranges.start_s + x * duration) {
                terms.push(term(kind, &[("shape", text("step")), ("start_s", number(start))]));
                for length in [0.15, 0.3].map(|x| x * duration) {
                    terms.push(term(
                        kind,
                        &[("shape", text("ramp")), ("start_s", number(start)), ("duration_s", number(length))],
                    ));
                }
            }
            let whole =
                [("shape", text("ramp")), ("start_s", number(ranges.start_s)), ("duration_s", number(duration))];
            terms.push(term(kind, &whole));
            terms
        }
        _ => Vec::new(),
    }
}

/// Soft windup of a catalogue, K1 to T1, K2 to T2, K3 beyond, as yet without softness: its kinks lie where they are told. Only differences from K3 count, so that is
/// chosen higher than any of them.
fn kinked(first_rad: f64, second_rad: f64, ranges: &Ranges) -> Term {
    let k3 = 3.0 * ranges.torque_nm / ranges.rated_rad;
    let slopes = ["k1_nm_per_rad", "k2_nm_per_rad", "k3_nm_per_rad"].map(|key| (key, number(k3)));
    let kinks = [("shape", text("piecewise")), ("t1_nm", number(k3 * first_rad)), ("t2_nm", number(k3 * second_rad))];
    term("soft_windup", &[&slopes[..], &kinks[..]].concat())
}

fn term(kind: &str, values: &[(&str, TermValue)]) -> Term {
    let values: BTreeMap<String, TermValue> = values.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    Term { kind: kind.to_owned(), values }
}

fn number(x: f64) -> TermValue {
    TermValue::Number(x)
}

fn list(x: f64) -> TermValue {
    TermValue::List(vec![x])
}

fn text(x: &str) -> TermValue {
    TermValue::Text(x.to_owned())
}
