//! Physics beyond the base model (MODEL.md section 7): one file a kind, and the list of them.
//!
//! A kind is its equation, its keys with units and ranges, its state and its test; [`KINDS`] is what model files, parameter blocks, estimators and docs know
//! of it. To add one is to add its file and to name it below. A [`Stack`] holds the terms of one gear, a [`Compensated`] gear is base model and stack together.
//!
//! - Deflection terms say θ_measured − θ. They are taken out of the measured deflection before the base model sees it, so turning points, gate and elastic torque
//!   follow the true path. Backlash comes last, because it depends on where the others leave θ.
//! - Torque terms see the corrected deflection and the base torque there, and add.
//! - `thermal_friction` scales every term of domain friction; `time_skew` shifts the total of a whole recording.
//! - On a drive only [plant](Side::Plant) terms are fed forward: [`Stack::plant`].
//!
//! Everything is evaluated in the scalar's own precision; in `f32` no double is computed.

mod harmonics;
mod physics;
mod read;
mod registry;
mod sample;
mod stack;

pub mod compensated;

mod backlash;
mod coulomb_friction;
mod creep;
mod encoder_eccentricity;
mod gravity_load;
mod inertia;
mod kinematic_error;
mod load_dependent_friction;
mod nonlocal_memory;
mod position_dependent_friction;
mod sensor_drift;
mod soft_windup;
mod stiffness_asymmetry;
mod stribeck_friction;
mod thermal_friction;
mod thermal_stiffness;
mod thermal_zero_drift;
mod time_skew;
mod torque_ripple;
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
pub use stack::{Stack, StackState};
pub use time_skew::Resampled;

use crate::scalar::Float;

/// Makes one type of the kinds, and [`KINDS`] of their entries in the registry.
macro_rules! kinds {
    ($($module:ident::$kind:ident,)*) => {
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

        /// Every kind there is.
        pub const KINDS: &[KindInfo] = &[$(<$module::$kind<f32> as Physics<f32>>::INFO,)*];

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
            pub fn info(&self) -> &'static KindInfo {
                match self {
                    $(Self::$kind(_) => const { &<$module::$kind<S> as Physics<S>>::INFO },)*
                }
            }

            /// What it remembers before the first sample.
            pub fn start(&self) -> TermState<S> {
                match self {
                    $(Self::$kind(_) => TermState::$kind(Default::default()),)*
                }
            }

            /// Signals that its choices ask for, beside those of its kind.
            pub fn needs_besides(&self) -> &'static [Need] {
                match self {
                    $(Self::$kind(term) => term.needs_besides(),)*
                }
            }

            /// θ_measured − θ as far as the sample alone tells it, rad.
            #[inline]
            pub fn deflection_error(&self, sample: &Sample<S>) -> S {
                match self {
                    $(Self::$kind(term) => term.deflection_error(sample),)*
                }
            }

            /// The factor on all friction.
            #[inline]
            pub fn friction_factor(&self, sample: &Sample<S>) -> S {
                match self {
                    $(Self::$kind(term) => term.friction_factor(sample),)*
                }
            }

            /// By how much the recorded torque is late, s.
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

kinds! {
    kinematic_error::KinematicError,
    torque_ripple::TorqueRipple,
    encoder_eccentricity::EncoderEccentricity,
    gravity_load::GravityLoad,
    coulomb_friction::CoulombFriction,
    viscous_friction::ViscousFriction,
    stribeck_friction::StribeckFriction,
    load_dependent_friction::LoadDependentFriction,
    position_dependent_friction::PositionDependentFriction,
    viscous_damping::ViscousDamping,
    inertia::Inertia,
    soft_windup::SoftWindup,
    stiffness_asymmetry::StiffnessAsymmetry,
    backlash::Backlash,
    nonlocal_memory::NonlocalMemory,
    creep::Creep,
    time_skew::TimeSkew,
    thermal_stiffness::ThermalStiffness,
    thermal_zero_drift::ThermalZeroDrift,
    thermal_friction::ThermalFriction,
    sensor_drift::SensorDrift,
    wear::Wear,
    unknown::Unknown,
}

/// The registry's entry of a kind.
pub fn kind(name: &str) -> Option<&'static KindInfo> {
    KINDS.iter().find(|kind| kind.name == name)
}
