//! Names of parameters per newton-metre and per ampere.

use std::borrow::Cow;

use crate::recording::TorqueUnit;

/// How a unit may stand in a name, per newton-metre and per ampere.
const SPELLINGS: [(&str, &str); 4] = [("_nm", "_a"), ("_nms", "_as"), ("nm", "a"), ("nms", "as")];

/// A key as it reads per ampere: `c1_nm_per_rad` → `c1_a_per_rad`, `nm_per_s` → `a_per_s`. `None` where no torque is in it.
pub(crate) fn per_ampere(key: &str) -> Option<String> {
    swap(key, |(nm, a)| (nm, a))
}

/// A key, given per newton-metre, as a file with this torque spells it.
pub fn key_per(key: &str, unit: TorqueUnit) -> Cow<'_, str> {
    match unit {
        TorqueUnit::NewtonMetre => key.into(),
        TorqueUnit::Ampere => per_ampere(key).map_or(key.into(), Cow::Owned),
    }
}

/// The key per newton-metre that a key per ampere stands for; itself where it is none.
pub(super) fn per_newton_metre(key: &str) -> (Cow<'_, str>, bool) {
    match swap(key, |(nm, a)| (a, nm)) {
        Some(canonical) => (canonical.into(), true),
        None => (key.into(), false),
    }
}

/// Swaps the unit of the first spelling that stands in the key as a whole word.
fn swap(key: &str, direction: impl Fn((&'static str, &'static str)) -> (&'static str, &'static str)) -> Option<String> {
    SPELLINGS.into_iter().map(direction).find_map(|(from, to)| {
        let at = if from.starts_with('_') { key.find(from)? } else { key.starts_with(from).then_some(0)? };
        let rest = &key[at + from.len()..];
        (rest.is_empty() || rest.starts_with("_per")).then(|| format!("{}{to}{rest}", &key[..at]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_swap_their_torque_unit() {
        for (nm, a) in [
            ("c2_nm_per_rad3", "c2_a_per_rad3"),
            ("torque_nm", "torque_a"),
            ("cos_nm", "cos_a"),
            ("nm_per_s", "a_per_s"),
            ("damping_nms_per_rad", "damping_as_per_rad"),
            ("stiffness_drop_nm_per_rad", "stiffness_drop_a_per_rad"),
        ] {
            assert_eq!(per_ampere(nm).as_deref(), Some(a));
            assert_eq!(per_newton_metre(a), (Cow::Borrowed(nm), true));
            assert_eq!(per_newton_metre(nm), (Cow::Borrowed(nm), false));
        }
        for key in ["alpha", "cos_rad", "half_gap_rad", "inertia_kgm2", "mu", "angle", "smoothing_rad_per_s"] {
            assert_eq!(per_ampere(key), None);
            assert_eq!(per_newton_metre(key), (Cow::Borrowed(key), false));
        }
    }
}
