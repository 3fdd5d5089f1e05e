//! Terms, waves and drafts as several kinds make them.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draft::Draft;
use super::measures::Measures;
use super::ranges::Ranges;
use crate::model::{ORDERS, Term, TermValue};

/// A term of a kind with some of its values.
pub fn term(kind: &str, values: &[(&str, TermValue)]) -> Term {
    let values = values.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Term { kind: kind.to_owned(), values }
}

/// A number as the value of a term.
pub fn number(x: f64) -> TermValue {
    TermValue::Number(x)
}

/// A list of one number.
pub fn list(x: f64) -> TermValue {
    TermValue::List(vec![x])
}

/// A choice.
pub fn text(x: &str) -> TermValue {
    TermValue::Text(x.to_owned())
}

/// A number of a term; 0 where it has none of that key.
pub fn number_of(term: &Term, key: &str) -> f64 {
    if let Some(TermValue::Number(x)) = term.values.get(key) { *x } else { 0.0 }
}

/// One candidate for each order, none twice.
pub fn waves(kind: &str, orders: &[f64]) -> Vec<Term> {
    let mut unique: Vec<f64> = Vec::new();
    for &order in orders {
        if unique.iter().all(|known| (known - order).abs() > 1e-9) {
            unique.push(order);
        }
    }
    unique.into_iter().map(|order| term(kind, &[(ORDERS, list(order))])).collect()
}

/// Whether the orders of a term are those of the output turn.
pub fn is_over_output(term: &Term) -> bool {
    matches!(term.values.get("angle"), Some(TermValue::Text(angle)) if angle == "output")
}

/// One candidate for each order of the motor's and the output's turn that the residual holds.
pub fn waves_of_both(kind: &str, ranges: &Ranges) -> Vec<Term> {
    let output = waves(kind, &ranges.output_orders).into_iter().map(|mut term| {
        term.values.insert("angle".to_owned(), text("output"));
        term
    });
    waves(kind, &ranges.motor_orders).into_iter().chain(output).collect()
}

/// Radii of slip elements from which any rate-independent memory can be built, rad: eight over two decades up to four fifths of the rated deflection, and four of them.
pub fn memory_radii(ranges: &Ranges) -> [Vec<f64>; 2] {
    let radii = [0.01, 0.02, 0.04, 0.08, 0.15, 0.28, 0.5, 0.8].map(|share| share * ranges.rated_rad);
    let every_second = radii.iter().copied().skip(1).step_by(2).collect();
    [radii.to_vec(), every_second]
}

/// Widths over which friction may change its sign, rad/s.
pub fn smoothings(ranges: &Ranges) -> [f64; 4] {
    [0.003, 0.01, 0.03, 0.09].map(|share| share * ranges.velocity_rad_per_s)
}

/// The mean temperature to a tenth of a degree, °C.
pub fn reference_c(ranges: &Ranges) -> Option<TermValue> {
    ranges.temperature_c.map(|t| number((10.0 * t).round() / 10.0))
}

/// Σ c_k cos(k q) + s_k sin(k q), the first order the largest, with random phases.
pub fn harmonics(kind: &'static str, unit: &str, orders: &[f64], per_nm: f64, random: &mut ChaCha8Rng) -> Draft {
    let (mut cos, mut sin) = (Vec::new(), Vec::new());
    for (at, _) in orders.iter().enumerate() {
        let size = per_nm * if at == 0 { 1.0 } else { random.random_range(0.15..0.4) };
        let phase = random.random_range(0.0..TAU);
        cos.push(size * phase.cos());
        sin.push(size * phase.sin());
    }
    let (cos_key, sin_key) = if unit == "rad" { ("cos_rad", "sin_rad") } else { ("cos_nm", "sin_nm") };
    Draft::new(kind).fixed_list(ORDERS, orders.to_vec()).list(cos_key, cos).list(sin_key, sin)
}

/// One period a turn.
pub fn once(kind: &'static str, cos: &'static str, sin: &'static str, per_nm: f64, random: &mut ChaCha8Rng) -> Draft {
    let phase = random.random_range(0.0..TAU);
    Draft::new(kind).number(cos, per_nm * phase.cos()).number(sin, per_nm * phase.sin())
}

/// Three slip elements: one that slips early, one at half the stroke, one late.
pub fn slip_elements(kind: &'static str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
    let bands = [(0.03, 0.12), (0.15, 0.4), (0.5, 0.9)];
    let radius = bands.map(|(low, high)| random.random_range(low..high) * measures.deflection_rad);
    let torque: Vec<f64> = radius.iter().map(|_| random.random_range(0.2..0.5)).collect();
    Draft::new(kind).list("torque_nm", torque).fixed_list("radius_rad", radius.to_vec())
}

/// Friction that changes its sign within a few per cent of the largest velocity.
pub fn smoothed(draft: Draft, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
    draft.fixed("smoothing_rad_per_s", random.random_range(0.01..0.05) * measures.velocity)
}

/// 1 or −1.
pub fn sign(random: &mut ChaCha8Rng) -> f64 {
    if random.random() { 1.0 } else { -1.0 }
}

/// One of several.
pub fn pick<T: Copy>(from: &[T], random: &mut ChaCha8Rng) -> T {
    from[random.random_range(0..from.len())]
}
