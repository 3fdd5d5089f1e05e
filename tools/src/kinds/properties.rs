//! What makes a term of its kind, beyond its equation.

use gmhm::terms::{KeyInfo, Range};

use crate::model::{Model, Term, TermValue};
use crate::physics::columns::set;

/// A number of a term; 0 where it has none of that key.
pub fn number(term: &Term, key: &str) -> f64 {
    if let Some(TermValue::Number(x)) = term.values.get(key) { *x } else { 0.0 }
}

/// Whether one kind holds another as a special case.
pub fn generalises(kind: &str, special: &str) -> bool {
    matches!((kind, special), ("stribeck_friction", "coulomb_friction" | "viscous_friction"))
}

/// Whether what a kind has beyond its special case is there to see, however sure: friction dips by a seventh of itself or more.
pub fn dips(term: &Term) -> bool {
    number(term, "static_nm") > 1.17 * number(term, "coulomb_nm")
}

/// Whether a curve over a coordinate shows no more of a kind than how soft its edge is: a gap is crossed where the torque changes its sign.
pub fn softens(kind: &str, coordinate: &str) -> bool {
    kind == "backlash" && coordinate == "torque"
}

/// Whether a number of a kind only sets the scale that its others are told in: what a catalogue's stiffnesses take away are differences from K3.
pub fn is_scale(key: &KeyInfo) -> bool {
    key.name == "k3_nm_per_rad"
}

/// Whether a number of a term says again what another term of the model says: Coulomb friction beside Coulomb friction. The two share it, and neither drives.
pub fn repeats(model: &Model, term: &Term, key: &KeyInfo) -> bool {
    term.kind == "stribeck_friction"
        && key.name == "coulomb_nm"
        && model.terms.iter().any(|t| t.kind == "coulomb_friction")
}

/// A term that has grown from nothing by so much, in the number that it grows with. A catalogue's K1 falls below K3, K2 half as far, and the kinks stay.
pub fn grown(term: &Term, key: &'static KeyInfo, weight: f64) -> Term {
    if key.name != "k1_nm_per_rad" {
        return set(term, key, None, weight);
    }
    let (k3, t1, t2) = (number(term, "k3_nm_per_rad"), number(term, "t1_nm"), number(term, "t2_nm"));
    let drop = weight.clamp(-MOST_DROP * k3, MOST_DROP * k3);
    let (k1, k2) = (k3 - drop, k3 - 0.5 * drop);
    let first = t1 / k3 * k1;
    let values =
        [("k1_nm_per_rad", k1), ("k2_nm_per_rad", k2), ("t1_nm", first), ("t2_nm", first + (t2 - t1) / k3 * k2)];
    let mut term = term.clone();
    term.values.extend(values.map(|(key, value)| (key.to_owned(), TermValue::Number(value))));
    term
}

/// A spring about zero keeps at least a tenth of its stiffness.
const MOST_DROP: f64 = 0.9;

/// Whether windup is soft: K1 and K2 below K3.
pub fn is_soft(term: &Term) -> bool {
    number(term, "k1_nm_per_rad").max(number(term, "k2_nm_per_rad")) <= number(term, "k3_nm_per_rad")
}

/// The special cases that a term may be made of where what makes it its kind is not there; none where it is no more than its kind.
pub fn special_cases(own: &Term) -> Vec<Vec<Term>> {
    let value = |key: &str| own.values.get(key).cloned();
    let at_rest = |key: &str| matches!(own.values.get(key), None | Some(TermValue::Number(0.0)));
    let smoothing = value("smoothing_rad_per_s").unwrap_or(TermValue::Number(0.0));
    let coulomb = |torque| term("coulomb_friction", &[("torque_nm", torque), ("smoothing_rad_per_s", smoothing)]);
    match own.kind.as_str() {
        "stribeck_friction" if !at_rest("coulomb_nm") => {
            let dry = value("coulomb_nm").map(coulomb);
            let viscous = value("damping_nms_per_rad").map(|b| term("viscous_friction", &[("damping_nms_per_rad", b)]));
            let both = dry.clone().zip(viscous.clone()).map(|(dry, viscous)| vec![dry, viscous]);
            [both, dry.map(|t| vec![t]), viscous.map(|t| vec![t])].into_iter().flatten().collect()
        }
        "position_dependent_friction" => vec![vec![coulomb(TermValue::Number(0.0))]],
        _ => Vec::new(),
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
