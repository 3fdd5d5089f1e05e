//! Physics beyond the base model (MODEL.md section 7): one file a kind, and the list of them.
//!
//! A kind is its equation, its keys with units and ranges, its state and its test; [`KINDS`] is what model files, parameter blocks, estimators and docs know
//! of it. To add one is to add its file and to name it below. A [`Stack`] holds the terms of one gear, a [`Compensated`] gear is base model and stack together.
//!
//! - Deflection terms say θ_measured − θ. They are taken out of the measured deflection before the base model sees it, so turning points, gate and elastic torque
//!   follow the true path. Backlash comes last, because it depends on where the others leave θ.
//! - Torque terms see the corrected deflection and the base torque there, and add.
//! - `thermal_friction` scales every term of domain friction; `time_skew` shifts the total of a whole recording.
//! - On a drive only [plant](Side::Plant) terms are fed forward: [`Stack::plant`]; [`feedforward`] takes them into inverse and feed-forward.
//!
//! Everything is evaluated in the scalar's own precision; in `f32` no double is computed.

mod harmonics;
mod physics;
mod read;
mod registry;
mod sample;
mod stack;
mod view;

pub mod compensated;
pub mod feedforward;

mod backlash;
mod coulomb_friction;
mod creep;
mod encoder_eccentricity;
mod encoder_skew;
mod gravity_load;
mod inertia;
mod kinematic_error;
mod load_dependent_friction;
mod load_dependent_memory;
mod nonlocal_memory;
mod position_dependent_friction;
mod presliding_friction;
mod ripple_resonance;
mod sensor_drift;
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

pub use compensated::Compensated;
pub use harmonics::MOST_ORDERS;
pub use physics::Physics;
pub use read::{Reader, Setting, Source, TermError, Value};
pub use registry::{Coordinate, Domain, Form, KeyInfo, KindInfo, Need, Range, Role, Side};
pub use sample::Sample;
pub use stack::{Stack, StackState, StackView};
pub use time_skew::Resampled;
pub use view::View;

use crate::scalar::Float;

/// Makes one type of the kinds, and [`KINDS`] of their entries in the registry.
macro_rules! kinds {
    ($($tag:literal $module:ident::$kind:ident,)*) => {
        /// A term of whichever kind.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Term<S: Float> {
            $(#[doc = concat!("Kind `", stringify!($module), "`.")] $kind($module::$kind<S>),)*
        }

        /// What a term remembers.
        #[derive(Debug, Clone)]
        pub enum TermState<S: Float<Carry = S>> {
            $(#[doc = concat!("Kind `", stringify!($module), "`.")] $kind(<$module::$kind<S> as Physics<S>>::State),)*
        }

        $(impl<S: Float> crate::sealed::Sealed for $module::$kind<S> {})*

        /// Every kind there is.
        pub const KINDS: &[KindInfo] = &[$(<$module::$kind<f32> as Physics<f32>>::INFO,)*];

        /// The number of each kind in parameter blocks, in the order of [`KINDS`].
        pub const TAGS: [u16; KINDS.len()] = [$($tag,)*];

        impl<S: Float<Carry = S>> Term<S> {
            /// Reads and checks the keys of a kind.
            ///
            /// # Errors
            /// [`TermError`], with the key to blame.
            pub fn read(kind: &str, source: &dyn Source<S>, setting: Setting<S>) -> Result<Self, TermError> {
                let reader = Reader::new(source, setting);
                $(if kind == <$module::$kind<S> as Physics<S>>::INFO.name {
                    return $module::$kind::read(&reader).map(Self::$kind);
                })*
                Err(TermError::UnknownKind)
            }

            /// Its kind's entry in the registry.
            #[must_use]
            pub fn info(&self) -> &'static KindInfo {
                match self {
                    $(Self::$kind(_) => const { &<$module::$kind<S> as Physics<S>>::INFO },)*
                }
            }

            /// What it acts on: [`info`](Self::info) without the words, which a drive need not hold.
            #[inline]
            #[must_use]
            pub fn domain(&self) -> Domain {
                match self {
                    $(Self::$kind(_) => const { <$module::$kind<S> as Physics<S>>::INFO.domain },)*
                }
            }

            /// Whether a drive feeds it forward; as [`domain`](Self::domain), without the words.
            #[inline]
            #[must_use]
            pub fn side(&self) -> Side {
                match self {
                    $(Self::$kind(_) => const { <$module::$kind<S> as Physics<S>>::INFO.side },)*
                }
            }

            /// Signals that its kind asks for; as [`domain`](Self::domain), without the words.
            #[must_use]
            pub fn needs(&self) -> &'static [Need] {
                match self {
                    $(Self::$kind(_) => const { <$module::$kind<S> as Physics<S>>::INFO.needs },)*
                }
            }

            /// Whether its torque is one of the gear itself: it follows the deflection or its rate.
            #[inline]
            #[must_use]
            pub fn is_of_gear(&self) -> bool {
                match self {
                    $(Self::$kind(_) => const { <$module::$kind<S> as Physics<S>>::INFO.is_of_gear() },)*
                }
            }

            /// What it remembers before the first sample.
            #[must_use]
            pub fn start(&self) -> TermState<S> {
                match self {
                    $(Self::$kind(_) => TermState::$kind(Default::default()),)*
                }
            }

            /// Signals that its choices ask for, beside those of its kind.
            #[must_use]
            pub fn needs_besides(&self) -> &'static [Need] {
                match self {
                    $(Self::$kind(term) => term.needs_besides(),)*
                }
            }

            /// Whether it depends on the torque that the gear transmits, or on the gear's parameters.
            #[must_use]
            pub fn follows_base(&self) -> bool {
                match self {
                    $(Self::$kind(term) => term.follows_base(),)*
                }
            }

            /// θ_measured − θ as far as the sample alone tells it, rad.
            #[inline]
            #[must_use]
            pub fn deflection_error(&self, sample: &Sample<S>) -> S {
                match self {
                    $(Self::$kind(term) => term.deflection_error(sample),)*
                }
            }

            /// The factor on all friction.
            #[inline]
            #[must_use]
            pub fn friction_factor(&self, sample: &Sample<S>) -> S {
                match self {
                    $(Self::$kind(term) => term.friction_factor(sample),)*
                }
            }

            /// By how much the recorded torque is late, s.
            #[must_use]
            pub fn delay(&self) -> S {
                match self {
                    $(Self::$kind(term) => term.delay(),)*
                }
            }

            /// θ where it depends on the path or on the torque. A state of another kind is left alone.
            #[inline]
            pub(crate) fn correct(&self, state: &mut TermState<S>, theta: S, transmitted: &dyn Fn(S) -> S) -> S {
                match (self, state) {
                    $((Self::$kind(term), TermState::$kind(state)) => term.correct(state, theta, transmitted),)*
                    _ => theta,
                }
            }

            /// What it adds to T, N·m. A state of another kind is left alone, and nothing added.
            #[inline]
            pub(crate) fn torque(&self, state: &mut TermState<S>, sample: &Sample<S>) -> S {
                match (self, state) {
                    $((Self::$kind(term), TermState::$kind(state)) => term.torque(state, sample),)*
                    _ => S::ZERO,
                }
            }
        }
    };
}

// The numbers stand in parameter blocks for ever: a new kind takes the next one, a number is never used again.
kinds! {
    1 kinematic_error::KinematicError,
    2 torque_ripple::TorqueRipple,
    3 encoder_eccentricity::EncoderEccentricity,
    4 gravity_load::GravityLoad,
    5 coulomb_friction::CoulombFriction,
    6 viscous_friction::ViscousFriction,
    7 stribeck_friction::StribeckFriction,
    8 load_dependent_friction::LoadDependentFriction,
    9 position_dependent_friction::PositionDependentFriction,
    10 viscous_damping::ViscousDamping,
    11 inertia::Inertia,
    12 soft_windup::SoftWindup,
    13 stiffness_asymmetry::StiffnessAsymmetry,
    14 backlash::Backlash,
    15 nonlocal_memory::NonlocalMemory,
    16 creep::Creep,
    17 time_skew::TimeSkew,
    18 thermal_stiffness::ThermalStiffness,
    19 thermal_zero_drift::ThermalZeroDrift,
    20 thermal_friction::ThermalFriction,
    21 sensor_drift::SensorDrift,
    22 wear::Wear,
    23 unknown::Unknown,
    24 torque_scale::TorqueScale,
    25 load_dependent_memory::LoadDependentMemory,
    26 presliding_friction::PreslidingFriction,
    27 encoder_skew::EncoderSkew,
    28 ripple_resonance::RippleResonance,
}

/// Bit k stands for the number k in parameter blocks: set where a drive feeds the kind forward. Without the words of the registry, which a drive need not hold.
#[cfg(feature = "block")]
pub(crate) const PLANT_TAGS: u64 = {
    let (mut k, mut bits) = (0, 0);
    while k < KINDS.len() {
        if matches!(KINDS[k].side, Side::Plant) {
            bits |= 1 << TAGS[k];
        }
        k += 1;
    }
    bits
};

/// The registry's entry of a kind.
#[must_use]
pub fn kind(name: &str) -> Option<&'static KindInfo> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// The registry's entry of a kind by its number in parameter blocks.
#[must_use]
pub fn kind_of_tag(tag: u16) -> Option<&'static KindInfo> {
    TAGS.iter().zip(KINDS).find(|(known, _)| **known == tag).map(|(_, kind)| kind)
}

/// The number of a kind in parameter blocks.
#[must_use]
pub fn tag_of_kind(name: &str) -> Option<u16> {
    TAGS.iter().zip(KINDS).find(|(_, kind)| kind.name == name).map(|(tag, _)| *tag)
}
