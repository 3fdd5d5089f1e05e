//! The elements of a term's lists: orders, or slip elements.

use gmhm::terms::Form;

use super::of_term;
use crate::model::{Term, TermValue};

/// Elements of a term's lists; 1 where it has none.
pub fn elements(term: &Term) -> usize {
    let lists = term.values.values().filter_map(|v| if let TermValue::List(l) = v { Some(l.len()) } else { None });
    lists.max().unwrap_or(1)
}

/// The most elements that the lists of a term hold; `None` for a term without lists.
pub fn most_elements(term: &Term) -> Option<usize> {
    let keys = term.info().into_iter().flat_map(|info| info.keys);
    keys.filter_map(|key| if let Form::List { most } = key.form { Some(most) } else { None }).min()
}

/// Whether each element of a term is an effect, as an order of a ripple.
pub fn elements_are_effects(term: &Term) -> bool {
    of_term(term).is_some_and(|kind| kind.elements_are_effects())
}

/// A term without one of several elements that are effects each, in every way.
pub fn without_an_element(term: &Term) -> Vec<Term> {
    let count = elements(term);
    if count < 2 || !elements_are_effects(term) {
        return Vec::new();
    }
    let without = |at: usize| {
        let mut fewer = term.clone();
        for value in fewer.values.values_mut() {
            if let TermValue::List(list) = value {
                list.remove(at);
            }
        }
        fewer
    };
    (0..count).map(without).collect()
}

/// A term without the elements whose numbers have the wrong sign; `None` where it has none of them, or no other.
pub fn without_negative_elements(term: &Term) -> Option<Term> {
    let kind = of_term(term).filter(|_| is_of_slip_elements(term))?;
    let keys = kind.info()?.keys.iter().filter(|key| kind.has_to_be_positive(key));
    let lists = keys.filter_map(|key| match term.values.get(key.name)? {
        TermValue::List(list) => Some(list),
        _ => None,
    });
    let mut kept = vec![true; elements(term)];
    lists.for_each(|list| kept.iter_mut().zip(list).for_each(|(kept, x)| *kept &= *x > 0.0));
    with_elements(term, |element| kept[element])
}

/// Whether a term is a memory of slip elements.
pub fn is_of_slip_elements(term: &Term) -> bool {
    of_term(term).is_some_and(|kind| kind.is_of_slip_elements())
}

/// A term with some of its elements; `None` where those are all or none.
pub fn with_elements(term: &Term, keep: impl FnMut(usize) -> bool) -> Option<Term> {
    let kept: Vec<bool> = (0..elements(term)).map(keep).collect();
    if kept.iter().all(|kept| *kept) || !kept.contains(&true) {
        return None;
    }
    let mut fewer = term.clone();
    for value in fewer.values.values_mut() {
        if let TermValue::List(list) = value {
            let mut kept = kept.iter();
            list.retain(|_| *kept.next().unwrap_or(&true));
        }
    }
    Some(fewer)
}

/// A memory like `term` with slip elements of these radii, rad, and torques, N·m; `None` where it cannot hold them.
pub fn with_slip_elements(term: &Term, elements: &[(f64, f64)]) -> Option<Term> {
    let (radii, torques) = elements.iter().copied().unzip();
    let mut other = term.clone();
    for (key, list) in [("radius_rad", radii), ("torque_nm", torques)] {
        *other.values.get_mut(key)? = TermValue::List(list);
    }
    other.check().is_ok().then_some(other)
}
