//! Kinds of effects, one file a kind: what each may look like in recordings, and what has to be seen before it is named.
//!
//! The equation of a kind, its keys and its ranges are the core's ([`gmhm::terms`]). What only the tools need stands here, behind the trait [`Kind`]. To add a
//! kind is to add its file and to list it in [`ALL`]; a test compares that list with the core's.
//!
//! | file | what |
//! |---|---|
//! | [`ranges`] | what recordings span, which the candidate grids follow |
//! | [`free_coordinate`] | the free functions that a kind is measured by |
//! | [`experiment`] | the bench tests that show a kind |
//! | [`measures`], [`draft`] | how `gmhm simulate --hide` draws an effect of a kind |
//! | `elements` | the elements of a term's lists |
//! | `relations` | which kinds can stand for which others |
//! | `smoothing` | the smoothing of the sign of a friction |
//! | `lawful` | what the numbers of a term have to be for it to be of its kind |
//! | `friction_shapes` | frictions whose refitted shape is that of another friction |
//! | `build` | terms, waves and drafts as several kinds make them |

pub(crate) mod build;
pub mod draft;
pub mod experiment;
pub mod free_coordinate;
pub mod measures;
pub mod ranges;

mod backlash;
mod coulomb_friction;
mod creep;
mod elements;
mod encoder_eccentricity;
mod encoder_skew;
mod friction_shapes;
mod gravity_load;
mod inertia;
mod kinematic_error;
mod lawful;
mod load_dependent_friction;
mod load_dependent_memory;
mod nonlocal_memory;
mod position_dependent_friction;
mod presliding_friction;
mod relations;
mod ripple_resonance;
mod sensor_drift;
mod smoothing;
mod soft_windup;
mod stiffness_asymmetry;
mod stribeck_friction;
mod thermal_friction;
mod thermal_stiffness;
mod thermal_zero_drift;
mod time_skew;
mod torque_ripple;
mod torque_scale;
mod unknown;
mod viscous_damping;
mod viscous_friction;
mod wear;

use gmhm::terms::{Coordinate, Domain, KeyInfo, KindInfo, Range, Role};
use rand_chacha::ChaCha8Rng;

use crate::model::{Model, ORDERS, Term};
use crate::physics::columns::{get, set};
pub use build::number_of;
pub use coulomb_friction::coulomb_friction;
use draft::Draft;
pub use elements::{
    elements, elements_are_effects, is_of_slip_elements, most_elements, with_elements, with_slip_elements,
    without_an_element, without_negative_elements,
};
use experiment::Experiment;
use free_coordinate::FreeCoordinate;
pub use friction_shapes::{WithoutCoulomb, has_inner_exponent, is_smoothed_apart, with_dip, without_coulomb};
pub use lawful::{exceeds_refined, is_reversed, is_within_limits, may_be_reversed, positive_where_needed};
use measures::Measures;
use ranges::{Extent, Ranges, Speeds};
pub use relations::{contains, imitates, includes};
pub use smoothing::{
    LARGEST_BASE_SMOOTHING, LARGEST_SMOOTHING, SMOOTHING, WIDER_THAN_SPEEDS, highest_base_smoothing, saturates,
};

/// The name of structure that no kind explains.
pub const UNKNOWN: &str = "unknown";

/// What an engineer asks for first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Stiffness.
    Elastic,
    /// Hysteresis and creep.
    Memory,
    /// Friction and damping.
    Friction,
    /// Gravity and inertia.
    Load,
    /// Meshing errors, ripple, lost motion.
    Transmission,
    /// Faults of the measurement.
    Measurement,
    /// Structure that no kind explains.
    Unknown,
}

impl Family {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Elastic => "elastic",
            Self::Memory => "memory",
            Self::Friction => "friction",
            Self::Load => "load",
            Self::Transmission => "transmission",
            Self::Measurement => "measurement",
            Self::Unknown => UNKNOWN,
        }
    }
}

/// A kind of effect, as the tools use it.
pub trait Kind: Sync {
    /// Its name in the core's registry.
    fn name(&self) -> &'static str;

    /// Its family.
    fn family(&self) -> Family;

    /// Whether it changes the spring of a gear: it is not tried beside a model that has none.
    fn changes_spring(&self) -> bool {
        self.family() == Family::Elastic
    }

    /// The bench tests that show it, the best first. None for structure without a name.
    fn experiments(&self) -> &'static [Experiment];

    /// The shapes in which it is tried, over a grid as wide as the recordings allow. Linear numbers are left out. Empty where the recordings cannot show it.
    fn candidates(&self, ranges: &Ranges, model: &Model) -> Vec<Term>;

    /// The shapes in which the joint selection tries it: those of [`candidates`](Self::candidates) unless it says otherwise.
    fn joint_candidates(&self, ranges: &Ranges, model: &Model) -> Vec<Term> {
        self.candidates(ranges, model)
    }

    /// The largest ratio of its torque to that of the kind that it refines, where more would be another kind.
    fn most_of_refined(&self) -> f64 {
        f64::INFINITY
    }

    /// The shapes that `--hide` accepts for it; empty where it has none.
    fn hidden_shapes(&self) -> &'static [&'static str] {
        &[]
    }

    /// An effect of this kind for `--hide`: everything but its size. `shape` is one of [`hidden_shapes`](Self::hidden_shapes), or empty.
    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft;

    /// Its entry in the core's registry.
    fn info(&self) -> Option<&'static KindInfo> {
        gmhm::terms::KINDS.iter().find(|info| info.name == self.name())
    }

    /// Whether a term of it holds lists that a further finding extends by an element.
    fn extends(&self) -> bool {
        false
    }

    /// Whether it may be found again beside a term of it.
    fn repeatable(&self) -> bool {
        self.extends()
    }

    /// For a term without linear numbers: the number from which its torque grows from 0, and the first step of it.
    fn growth(&self, _term: &Term, _ranges: &Ranges) -> Option<(&'static str, f64)> {
        None
    }

    /// Whether that number may be negative as well: its derivative is then taken from both sides.
    fn grows_both_ways(&self) -> bool {
        false
    }

    /// A term whose growing number is `weight`.
    fn with_more(&self, term: &Term, key: &'static KeyInfo, weight: f64) -> Term {
        set(term, key, None, weight)
    }

    /// The only linear number that is free beside what the model holds already; `None` where all are.
    fn only_free_key(&self, _model: &Model) -> Option<&'static str> {
        None
    }

    /// Whether another term of the model has the same effect as a number of its term. A fit does not change such a number.
    fn repeats_another(&self, _model: &Model, _key: &KeyInfo) -> bool {
        false
    }

    /// Adds the numbers that a found term has to hold to be complete.
    fn complete(&self, _term: &mut Term) {}

    /// Whether a number only sets the scale of others, and is not free.
    fn is_scale(&self, _key: &KeyInfo) -> bool {
        false
    }

    /// Whether a number has to be positive for a term to be of this kind.
    fn has_to_be_positive(&self, key: &KeyInfo) -> bool {
        accepts_positive_only(key) || key.plausible.0 >= 0.0 && !key.optional
    }

    /// The bounds of a number while it is fitted.
    fn bounds(&self, _model: &Model, term: &Term, key: &KeyInfo, index: Option<usize>) -> (f64, f64) {
        usual_bounds(term, key, index)
    }

    /// The range of a number outside which a term is of another kind; the bounds of a fit are wider.
    fn limits(&self, _key: &KeyInfo) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }

    /// Whether a fitted term is of this kind within the recordings. By default friction has to saturate within the speeds recorded: what does not is viscous.
    fn is_of_kind(&self, term: &Term, extent: &Extent) -> bool {
        saturates(term, extent.fastest_rad_per_s)
    }

    /// The term of another kind that a fitted term is within the speeds recorded, where nothing is left of what makes it its kind.
    fn degenerates_to(&self, _term: &Term, _speeds: Speeds) -> Option<Term> {
        None
    }

    /// The kinds that this one contains as special cases.
    fn contains(&self) -> &'static [&'static str] {
        &[]
    }

    /// The kinds that it looks like, without being one, where a motion hardly changes what distinguishes it: friction over an angle that hardly turns looks like Coulomb friction.
    fn imitates(&self) -> &'static [&'static str] {
        &[]
    }

    /// The kinds that are parts of the same effect where they are found beside this one.
    fn takes_in(&self) -> &'static [&'static str] {
        &[]
    }

    /// The kind that the effect of a term is, too, where the input is locked and the output turns by the deflection alone.
    fn at_locked_input(&self, _term: &Term) -> Option<&'static str> {
        None
    }

    /// For a friction that rises with the speed: the friction of this torque, N·m, that recordings of motion at one speed, rad/s, cannot distinguish from it, and that does not rise.
    fn at_one_speed(&self, _torque_nm: f64, _speed_rad_per_s: f64) -> Option<Term> {
        None
    }

    /// Whether what this kind has beyond the kinds that it [contains](Self::contains) is large enough to be named.
    fn exceeds_what_it_contains(&self, _term: &Term) -> bool {
        true
    }

    /// The special cases that a term reduces to where what makes it its kind is missing: alternatives, each a set of terms.
    fn special_cases(&self, _term: &Term) -> Vec<Vec<Term>> {
        Vec::new()
    }

    /// What the kind costs in a joint selection, as a share of what is predictable: the more it can imitate others, the more.
    fn price(&self) -> f64 {
        USUAL_PRICE
    }

    /// What an unusual shape of it costs beyond its [price](Self::price).
    fn shape_price(&self, _term: &Term) -> f64 {
        0.0
    }

    /// Kinds of which one has to stand beside it: a refinement without what it refines is another kind.
    fn refines(&self) -> &'static [&'static str] {
        &[]
    }

    /// A kind that a shape of it needs beside it.
    fn shape_refines(&self, _term: &Term) -> Option<&'static str> {
        None
    }

    /// Whether almost every machine has it: such kinds compete first among themselves.
    fn is_common(&self) -> bool {
        false
    }

    /// Whether the elements of its lists are effects of their own, found one by one: orders of a turn.
    fn elements_are_effects(&self) -> bool {
        false
    }

    /// Whether it is a memory of slip elements: those without a positive torque, and those that hardly slip, are left out.
    fn is_of_slip_elements(&self) -> bool {
        false
    }

    /// The free functions that it is measured by; kinds with the same first one are measured together.
    fn measured_by(&self) -> &'static [FreeCoordinate] {
        self.info().map_or(&[FreeCoordinate::Time], FreeCoordinate::of)
    }

    /// A coordinate over which a free curve shows no more of the kind than how soft its edge is.
    fn soft_edge(&self) -> Option<&'static str> {
        None
    }
}

/// Every kind, in the order of the core's registry.
pub static ALL: [&dyn Kind; 28] = [
    &kinematic_error::KinematicError,
    &torque_ripple::TorqueRipple,
    &encoder_eccentricity::EncoderEccentricity,
    &gravity_load::GravityLoad,
    &coulomb_friction::CoulombFriction,
    &viscous_friction::ViscousFriction,
    &stribeck_friction::StribeckFriction,
    &load_dependent_friction::LoadDependentFriction,
    &position_dependent_friction::PositionDependentFriction,
    &viscous_damping::ViscousDamping,
    &inertia::Inertia,
    &soft_windup::SoftWindup,
    &stiffness_asymmetry::StiffnessAsymmetry,
    &backlash::Backlash,
    &nonlocal_memory::NonlocalMemory,
    &creep::Creep,
    &time_skew::TimeSkew,
    &thermal_stiffness::ThermalStiffness,
    &thermal_zero_drift::ThermalZeroDrift,
    &thermal_friction::ThermalFriction,
    &sensor_drift::SensorDrift,
    &wear::Wear,
    &unknown::Unknown,
    &torque_scale::TorqueScale,
    &load_dependent_memory::LoadDependentMemory,
    &presliding_friction::PreslidingFriction,
    &encoder_skew::EncoderSkew,
    &ripple_resonance::RippleResonance,
];

/// The terms of the base model of a joint log, in the order of its file: gravity, inertia, Coulomb and viscous friction.
pub const JOINT_BASE: [&str; 4] = ["gravity_load", "inertia", "coulomb_friction", "viscous_friction"];

/// Friction that every joint has, and whose sign is known.
pub const JOINT_FRICTION: [&str; 2] = ["coulomb_friction", "viscous_friction"];

/// Whether a kind is friction along the motion.
pub fn is_friction(kind: &dyn Kind) -> bool {
    kind.info().is_some_and(|info| info.domain == Domain::Friction)
}

/// Whether a kind is friction that acts against the motion as it is at that time.
pub fn is_friction_of_motion(kind: &dyn Kind) -> bool {
    is_friction(kind) && kind.info().is_some_and(|info| info.coordinates.iter().all(|c| *c != Coordinate::Reversal))
}

/// The kind of a name.
pub fn of(name: &str) -> Option<&'static dyn Kind> {
    ALL.iter().copied().find(|kind| kind.name() == name)
}

/// The kind of a term.
pub fn of_term(term: &Term) -> Option<&'static dyn Kind> {
    of(&term.kind)
}

/// What a kind costs in a joint selection unless it says otherwise.
pub const USUAL_PRICE: f64 = 0.006;

/// A further order or element of a kind costs this part of the kind's own price.
pub const FURTHER_ELEMENT_PRICE: f64 = 0.3;

/// Whether a kind shifts the torque in time.
pub fn shifts_time(kind: &dyn Kind) -> bool {
    kind.info().is_some_and(|info| info.domain == Domain::Delay)
}

/// Whether almost every machine has a kind, see [`Kind::is_common`].
pub fn is_common(name: &str) -> bool {
    of(name).is_some_and(Kind::is_common)
}

/// Whether the model file accepts positive numbers only.
fn accepts_positive_only(key: &KeyInfo) -> bool {
    matches!(key.range, Range::AtLeastZero | Range::Positive)
}

/// An order moves by at most this part of itself in a refit.
const NEAR_ORDER: f64 = 0.1;

/// The bounds of a number by its entry in the registry. A shape stays near what gears have, and is at most divided or multiplied by three at a time; an order moves by a tenth of itself.
fn usual_bounds(term: &Term, key: &KeyInfo, index: Option<usize>) -> (f64, f64) {
    let value = get(term, key, index);
    if key.name == ORDERS {
        // Further away is another line of the spectrum.
        return ((1.0 - NEAR_ORDER) * value, (1.0 + NEAR_ORDER) * value);
    }
    let low = match key.range {
        // A memory shorter than creep is damping.
        Range::Positive if key.unit == "s" => key.plausible.0,
        Range::Positive => (0.3 * value).max(0.01 * key.plausible.0),
        range => range.lowest(),
    };
    match key.role {
        Role::Nonlinear if key.unit == "1" => (key.plausible.0, key.plausible.1),
        Role::Nonlinear if key.range == Range::Positive => (low, (3.0 * value).max(key.plausible.0)),
        Role::Nonlinear if key.range == Range::AtLeastZero => (low, key.plausible.1.max(value)),
        _ => (low, f64::INFINITY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_the_core_has_its_file_here() {
        let core: Vec<&str> = gmhm::terms::KINDS.iter().map(|info| info.name).collect();
        let here: Vec<&str> = ALL.iter().map(|kind| kind.name()).collect();
        assert_eq!(here, core);
    }

    #[test]
    fn every_named_kind_has_a_bench_test_that_shows_it() {
        for kind in ALL.iter().filter(|kind| kind.name() != UNKNOWN) {
            assert!(!kind.experiments().is_empty(), "{}", kind.name());
            assert_ne!(kind.family(), Family::Unknown, "{}", kind.name());
        }
    }

    #[test]
    fn names_that_kinds_refer_to_are_kinds() {
        for kind in ALL {
            assert!(kind.contains().iter().chain(kind.imitates()).all(|name| of(name).is_some()), "{}", kind.name());
        }
    }
}
