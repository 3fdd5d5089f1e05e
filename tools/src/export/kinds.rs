//! The source of each kind of term.

/// Kinds and their sources, from the files that have their names.
macro_rules! sources {
    ($($kind:ident)*) => {
        &[$((
            stringify!($kind),
            include_str!(concat!("../../templates/export/kinds/", stringify!($kind), ".c")),
        ),)*]
    };
}

/// Every kind of the plant. Faults of the measurement are not exported.
const SOURCES: &[(&str, &str)] = sources! {
    backlash coulomb_friction creep gravity_load inertia kinematic_error load_dependent_friction load_dependent_memory nonlocal_memory
    position_dependent_friction presliding_friction ripple_resonance soft_windup stiffness_asymmetry stribeck_friction thermal_friction
    thermal_stiffness torque_ripple viscous_damping viscous_friction wear
};

/// The parts of a kind's file.
#[derive(Debug, Clone, Copy)]
pub(super) struct KindSource {
    /// How it is called.
    pub(super) call: &'static str,
    /// The fields of what it remembers; empty where it remembers nothing.
    pub(super) past: &'static str,
    /// Its functions.
    pub(super) text: &'static str,
}

impl KindSource {
    /// The source of a kind.
    pub(super) fn of(kind: &str) -> Option<Self> {
        let (_, file) = SOURCES.iter().find(|(name, _)| *name == kind)?;
        let (call, rest) = file.strip_prefix("@call ")?.split_once('\n')?;
        let parts = rest.strip_prefix("@past\n").and_then(|rest| rest.split_once("@text\n"));
        let (past, text) = parts.unwrap_or(("", rest));
        Some(Self { call, past, text })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gmhm::terms::{KINDS, Side, kind};

    #[test]
    fn every_kind_of_the_plant_has_a_source_and_no_other() {
        for info in KINDS {
            let exported = info.side == Side::Plant;
            assert_eq!(
                KindSource::of(info.name).is_some(),
                exported,
                "{}: add its source to templates/export/kinds",
                info.name
            );
        }
        for (name, _) in SOURCES {
            assert!(kind(name).is_some() && KindSource::of(name).is_some(), "{name}");
        }
    }
}
