//! A curve over a coordinate as a term `unknown` of a model: its coordinate, its knots where rows are.

use std::f64::consts::TAU;

use gmhm::terms::Coordinate;

use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::nonparametric;
use crate::diagnose::nonparametric::Coordinates;
use crate::model::{Term, TermValue};
use crate::numerics::extremes::width;

/// A term `unknown` over a coordinate, if such a term can be over it.
pub(super) fn curve_term(see: &Coordinates, coordinate: &str) -> Option<Term> {
    if !Coordinate::NAMES.contains(&coordinate) || matches!(coordinate, "reversal" | "frequency") {
        return None;
    }
    let along = match coordinate {
        "motor_angle" => see.motor.as_deref()?,
        "output_angle" => see.output.as_deref()?,
        "output_velocity" => see.velocity.as_deref()?,
        "acceleration" => see.acceleration.as_deref()?,
        "deflection" => see.deflection.as_deref()?,
        "deflection_rate" => see.rate.as_deref()?,
        "torque" => &see.torque,
        "torque_rate" => &see.torque_rate,
        "temperature" => see.temperature.as_deref()?,
        _ => &see.time,
    };
    let turning = coordinate.ends_with("angle");
    let knots = if turning {
        knots_of_turn(along, if coordinate == "motor_angle" { 24 } else { 16 })
    } else {
        nonparametric::knots(along, if coordinate == "deflection" { 24 } else { 12 })
    };
    if knots.len() < 3 || knots.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let values = vec![0.0; knots.len()];
    let values = [
        ("coordinate", TermValue::Text(coordinate.to_owned())),
        ("knots", TermValue::List(knots)),
        ("values_nm", TermValue::List(values)),
    ];
    Some(Term { kind: UNKNOWN.to_owned(), values: values.into_iter().map(|(k, v)| (k.to_owned(), v)).collect() })
}

/// Knots over a turn, or over the part of it that was recorded: where no row is, nothing holds a knot. None within one interval, where a curve is a line.
fn knots_of_turn(angle: &[f64], count: u32) -> Vec<f64> {
    let low = angle.iter().copied().fold(f64::INFINITY, f64::min);
    let (part, spacing) = (width(angle), TAU / f64::from(count));
    if part < spacing {
        return Vec::new();
    }
    if part > TAU - spacing {
        return (0..count).map(|i| low + spacing * f64::from(i)).collect();
    }
    let intervals = (part / spacing).ceil().max(2.0);
    (0..=intervals as u32).map(|i| low + part * f64::from(i) / intervals).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_over_a_part_of_a_turn_lie_where_rows_are() {
        let part: Vec<f64> = (0..1000).map(|row| 0.5 * (0.03 * f64::from(row)).sin() + 1.0).collect();
        let knots = knots_of_turn(&part, 16);
        assert!(knots.len() == 4 && knots.iter().all(|knot| (0.499..=1.501).contains(knot)), "{knots:?}");
        let turns: Vec<f64> = (0..1000).map(|row| 0.03 * f64::from(row)).collect();
        assert_eq!(knots_of_turn(&turns, 16).len(), 16);
        assert!(knots_of_turn(&[0.0, 0.1, 0.2], 16).is_empty());
    }
}
