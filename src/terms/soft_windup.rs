//! Soft windup: less stiffness about zero torque, where few teeth carry.
//!
//! T −= ΔK·w·s(θ/w) with s(x) = tanh x, x/(1 + x²) or x e^(−x²/2); or, of shape `piecewise`, what a catalogue's stiffness K1 below T1, K2 to T2
//! and K3 beyond leaves of a spring K3:
//!
//! T −= K3 θ − P(θ), P with slopes K1, K2, K3 and kinks at θ_1 = T1/K1 and θ_2 = θ_1 + (T2 − T1)/K2. K1/K2 is about 0.72.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use super::sample::Sample;
use crate::scalar::Float;

const SHAPES: &[&str] = &["tanh", "rational", "gaussian", "piecewise"];
const SMOOTH: &[&str] = &["tanh", "rational", "gaussian"];
const KINKED: &[&str] = &["piecewise"];
const SHAPE: KeyInfo = KeyInfo::choice("shape", SHAPES, "s(x)");
const DROP: KeyInfo =
    KeyInfo::linear("stiffness_drop_nm_per_rad", "N·m/rad", "ΔK, by which the stiffness is less at θ = 0")
        .of_shapes(SMOOTH)
        .within(0.0, 2e4);
const WIDTH: KeyInfo = KeyInfo::shape("width_rad", "rad", "w").positive().of_shapes(SMOOTH).within(2e-5, 2e-3);
const K1: KeyInfo =
    KeyInfo::shape("k1_nm_per_rad", "N·m/rad", "K1, stiffness below T1").positive().of_shapes(KINKED).within(1e3, 1e6);
const K2: KeyInfo =
    KeyInfo::shape("k2_nm_per_rad", "N·m/rad", "K2, from T1 to T2").positive().of_shapes(KINKED).within(1e3, 1e6);
const K3: KeyInfo =
    KeyInfo::shape("k3_nm_per_rad", "N·m/rad", "K3, beyond T2").positive().of_shapes(KINKED).within(1e3, 1e6);
const T1: KeyInfo = KeyInfo::shape("t1_nm", "N·m", "T1").positive().of_shapes(KINKED).within(1.0, 200.0);
const T2: KeyInfo = KeyInfo::shape("t2_nm", "N·m", "T2, not below T1").positive().of_shapes(KINKED).within(2.0, 600.0);

/// A softer spring about zero.
#[derive(Debug, Clone, PartialEq)]
pub enum SoftWindup<S> {
    /// ΔK·w·s(θ/w).
    Smooth {
        /// s.
        knee: Knee,
        /// ΔK·w, N·m.
        torque: S,
        /// 1/w.
        inverse_width: S,
    },
    /// K3 θ − P(θ).
    Piecewise {
        /// K3 − K1 and K3 − K2, N·m/rad.
        drops: [S; 2],
        /// θ_1 and θ_2 − θ_1, rad.
        lengths: [S; 2],
    },
}

/// s(x).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knee {
    /// tanh x.
    Tanh,
    /// x/(1 + x²).
    Rational,
    /// x e^(−x²/2).
    Gaussian,
}

impl<S: Float> Physics<S> for SoftWindup<S> {
    const INFO: KindInfo = KindInfo {
        name: "soft_windup",
        side: Side::Plant,
        domain: Domain::Torque,
        equation: "T −= ΔK w s(θ/w), or K3 θ − P(θ) with slopes K1, K2, K3 and kinks at T1, T2",
        coordinates: &[Coordinate::Deflection],
        needs: &[Need::Deflection],
        keys: &[SHAPE, DROP, WIDTH, K1, K2, K3, T1, T2],
        hides_behind: "c2, c3 on one amplitude",
        instructions: 208,
    };
    type State = ();

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let knee = match reader.choice(&SHAPE)? {
            0 => Knee::Tanh,
            1 => Knee::Rational,
            2 => Knee::Gaussian,
            _ => return Self::read_piecewise(reader),
        };
        let width = reader.number(&WIDTH)?;
        Ok(Self::Smooth { knee, torque: reader.number(&DROP)? * width, inverse_width: width.recip() })
    }

    #[inline]
    fn torque(&self, (): &mut (), sample: &Sample<S>) -> S {
        let theta = sample.deflection;
        match self {
            Self::Smooth { knee, torque, inverse_width } => {
                let x = theta * *inverse_width;
                let s = match knee {
                    Knee::Tanh => x.tanh(),
                    Knee::Rational => x.over(S::ONE + x * x),
                    Knee::Gaussian => x * (-(S::HALF * x * x)).exp(),
                };
                -(*torque * s)
            }
            Self::Piecewise { drops, lengths } => {
                let first = theta.clamp(-lengths[0], lengths[0]);
                let second = (theta - first).clamp(-lengths[1], lengths[1]);
                -(drops[0] * first + drops[1] * second)
            }
        }
    }
}

impl<S: Float> SoftWindup<S> {
    fn read_piecewise(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        let (k1, k2, k3) = (reader.number(&K1)?, reader.number(&K2)?, reader.number(&K3)?);
        let (t1, t2) = (reader.number(&T1)?, reader.number(&T2)?);
        if t2 < t1 {
            return Err(TermError::NotIncreasing { key: T2.name });
        }
        Ok(Self::Piecewise { drops: [k3 - k1, k3 - k2], lengths: [t1.over(k1), (t2 - t1).over(k2)] })
    }
}
