//! What the numbers of a term have to be for it to be of its kind.

use gmhm::terms::Role;

use super::{Family, Kind, of_term};
use crate::model::{Model, Term, TermValue};

/// The numbers of a term that have to be positive, key by key; `None` for what is no kind.
fn needed_positive(term: &Term) -> Option<impl Iterator<Item = &[f64]>> {
    let kind = of_term(term)?;
    let keys = kind.info()?.keys.iter().filter(move |key| kind.has_to_be_positive(key));
    Some(keys.filter_map(|key| match term.values.get(key.name)? {
        TermValue::Number(x) => Some(std::slice::from_ref(x)),
        TermValue::List(list) => Some(list.as_slice()),
        TermValue::Text(_) => None,
    }))
}

/// Whether the numbers of a term that have to be positive are.
pub fn positive_where_needed(term: &Term) -> bool {
    needed_positive(term).is_some_and(|mut numbers| numbers.all(|own| own.iter().all(|x| *x > 0.0)))
}

/// Whether a number of a term has the wrong sign for its kind, or most of a list has.
pub fn is_reversed(term: &Term) -> bool {
    needed_positive(term).is_some_and(|mut numbers| numbers.any(|own| own.iter().sum::<f64>() < 0.0))
}

/// Whether every number of a term is within the limits of its kind.
pub fn is_within_limits(kind: &dyn Kind, term: &Term) -> bool {
    kind.info().into_iter().flat_map(|info| info.keys).all(|key| {
        let (least, most) = kind.limits(key);
        match term.values.get(key.name) {
            Some(TermValue::Number(x)) => (least..=most).contains(x),
            Some(TermValue::List(list)) => list.iter().all(|x| (least..=most).contains(x)),
            _ => true,
        }
    })
}

/// The size of a term's torques: the root of the sum of their squares, N·m.
fn torques(term: &Term) -> f64 {
    let keys = term.info().into_iter().flat_map(|info| info.keys);
    let keys = keys.filter(|key| key.role == Role::Linear && key.unit == "N·m");
    let squares = keys.filter_map(|key| match term.values.get(key.name)? {
        TermValue::Number(x) => Some(x * x),
        TermValue::List(list) => Some(list.iter().map(|x| x * x).sum()),
        TermValue::Text(_) => None,
    });
    squares.sum::<f64>().sqrt()
}

/// A refit may make a term so many times larger than it is selected at most.
const REFITTED: f64 = 3.0;

/// Whether a refitted term is much larger, beside the terms of a model that it refines, than [its kind may be](Kind::most_of_refined).
pub fn exceeds_refined(term: &Term, model: &Model) -> bool {
    let Some(kind) = of_term(term) else { return false };
    let refined = model.terms.iter().filter(|other| kind.refines().contains(&other.kind.as_str()));
    let largest = refined.map(torques).reduce(f64::max);
    largest.is_some_and(|largest| torques(term) > REFITTED * kind.most_of_refined() * largest)
}

/// Whether numbers of a kind that have to be positive may be negative all the same: a simulation may hold too much of a load.
pub fn may_be_reversed(kind: &dyn Kind, simulation: bool) -> bool {
    simulation && kind.family() == Family::Load
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::build::term;
    use crate::kinds::without_an_element;

    fn list_of(numbers: &[f64]) -> TermValue {
        TermValue::List(numbers.to_vec())
    }

    #[test]
    fn friction_of_the_position_outgrows_the_largest_that_it_refines() {
        let of_position = term(
            "position_dependent_friction",
            &[("orders", list_of(&[1.0, 2.0])), ("cos_nm", list_of(&[6.0, 0.0])), ("sin_nm", list_of(&[0.0, 8.0]))],
        );
        let friction = |kind: &str, torque: f64| term(kind, &[("torque_nm", TermValue::Number(torque))]);
        let model = |coulomb: f64, presliding: f64| Model {
            terms: vec![friction("coulomb_friction", coulomb), friction("presliding_friction", presliding)],
            ..Model::default()
        };
        for (coulomb, presliding, expected) in [(1.0, 1.0, true), (1.2, 0.1, false), (0.1, 1.2, false)] {
            assert_eq!(exceeds_refined(&of_position, &model(coulomb, presliding)), expected);
        }
        assert!(!exceeds_refined(&of_position, &Model::default()), "nothing to compare with");
        let fewer = without_an_element(&of_position);
        assert_eq!(fewer.iter().map(torques).collect::<Vec<f64>>(), [8.0, 6.0]);
        assert!(without_an_element(&fewer[0]).is_empty());
    }
}
