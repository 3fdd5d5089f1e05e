//! What makes a term of its kind, beyond its equation.

use gmhm::terms::{KeyInfo, Range};

use crate::model::{Term, TermValue};

/// Whether one kind holds another as a special case.
pub fn generalises(kind: &str, special: &str) -> bool {
    matches!((kind, special), ("stribeck_friction", "coulomb_friction" | "viscous_friction"))
}

/// Whether a curve over a coordinate shows no more of a kind than how soft its edge is: a gap is crossed where the torque changes its sign.
pub fn softens(kind: &str, coordinate: &str) -> bool {
    kind == "backlash" && coordinate == "torque"
}

/// The special cases that a term is made of where what makes it its kind is not there; none where it is no more than its kind.
pub fn special_case(own: &Term) -> Option<Vec<Term>> {
    let value = |key: &str| own.values.get(key).cloned();
    let at_rest = |key: &str| matches!(own.values.get(key), None | Some(TermValue::Number(0.0)));
    let smoothing = value("smoothing_rad_per_s").unwrap_or(TermValue::Number(0.0));
    let coulomb = |torque| term("coulomb_friction", &[("torque_nm", torque), ("smoothing_rad_per_s", smoothing)]);
    match own.kind.as_str() {
        "stribeck_friction" if !at_rest("coulomb_nm") => {
            let viscous = value("damping_nms_per_rad").map(|b| term("viscous_friction", &[("damping_nms_per_rad", b)]));
            Some([Some(coulomb(value("coulomb_nm")?)), viscous].into_iter().flatten().collect())
        }
        "position_dependent_friction" => Some(vec![coulomb(TermValue::Number(0.0))]),
        _ => None,
    }
}

/// Whether the numbers of a term that have to be positive to be of its kind are.
pub fn is_of_its_kind(term: &Term) -> bool {
    let of_its_kind = |key: &KeyInfo| match term.values.get(key.name) {
        Some(TermValue::Number(x)) => *x > 0.0,
        Some(TermValue::List(list)) => list.iter().all(|x| *x > 0.0),
        _ => true,
    };
    term.info().is_some_and(|info| info.keys.iter().filter(|key| positive(info.name, key)).all(of_its_kind))
}

/// Whether a kind's number has to be positive to be of its kind: friction brakes, creep and slipping elements resist, windup is soft, wear weakens. Temperature
/// may act either way.
pub fn positive(kind: &str, key: &KeyInfo) -> bool {
    let plausibly = key.plausible.0 >= 0.0 && !kind.starts_with("thermal") && key.name != "coulomb_nm" && !key.optional;
    matches!(key.range, Range::AtLeastZero | Range::Positive) || plausibly
}

/// The smoothing of a friction's sign is at most this share of the largest velocity.
pub const SATURATES: f64 = 0.25;

fn term(kind: &str, values: &[(&str, TermValue)]) -> Term {
    let values = values.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    Term { kind: kind.to_owned(), values }
}
