//! Σ c_k cos(k q) + s_k sin(k q).

use heapless::Vec;

use super::read::{Reader, TermError};
use super::registry::{KeyInfo, Need, Range};
use super::sample::Sample;
use crate::scalar::Float;

/// The most orders of one series.
pub const MOST_ORDERS: usize = 8;

/// Which angle a series turns with, where that may be chosen.
pub(super) const ANGLE: KeyInfo =
    KeyInfo::choice("angle", &["motor", "output"], "q: which angle it turns with, motor where left out").appended(0.0);

/// The angle that a series turns with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angle {
    /// q_m.
    Motor,
    /// q_o.
    Output,
}

impl Angle {
    /// Reads [`ANGLE`]. Orders of the output turn are above 1: one wave a turn is gravity or eccentricity.
    pub fn read<S: Float>(reader: &Reader<'_, S>, orders: &'static KeyInfo) -> Result<Self, TermError> {
        if reader.choice(&ANGLE)? == 0 {
            return Ok(Self::Motor);
        }
        let all = reader.list::<MOST_ORDERS>(orders)?;
        let range = Range::AboveOne;
        if all.iter().all(|order| range.holds_in(*order)) {
            Ok(Self::Output)
        } else {
            Err(TermError::OutOfRange { key: orders.name, range })
        }
    }

    /// The signal that it needs.
    pub fn needs(self) -> &'static [Need] {
        match self {
            Self::Motor => &[Need::MotorAngle],
            Self::Output => &[Need::OutputAngle],
        }
    }

    /// Its value, rad.
    #[inline]
    pub fn of<S: Float>(self, sample: &Sample<S>) -> S {
        match self {
            Self::Motor => sample.motor_angle,
            Self::Output => sample.output_angle,
        }
    }
}

/// A Fourier series of an angle, orders not necessarily integers.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics<S> {
    waves: Vec<Wave<S>, MOST_ORDERS>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave<S> {
    order: S,
    integer: bool,
    cos: S,
    sin: S,
}

impl<S: Float> Wave<S> {
    /// Sine and cosine of k times an angle, which is also given less whole turns.
    #[inline]
    fn of(&self, angle: S, wrapped: S) -> (S, S) {
        let base = if self.integer { wrapped } else { angle };
        (self.order * base).sin_cos()
    }
}

impl<S: Float> Harmonics<S> {
    /// Reads orders, cosine and sine coefficients, the coefficients times `gain`.
    pub fn read(
        reader: &Reader<'_, S>,
        orders: &'static KeyInfo,
        cos: &'static KeyInfo,
        sin: &'static KeyInfo,
        gain: S,
    ) -> Result<Self, TermError> {
        let order = reader.list::<MOST_ORDERS>(orders)?;
        let cos = reader.list_like(cos, &order, orders)?;
        let sin = reader.list_like(sin, &order, orders)?;
        let mut waves = Vec::new();
        for (&order, (&cos, &sin)) in order.iter().zip(cos.iter().zip(&sin)) {
            if cos == S::ZERO && sin == S::ZERO {
                continue;
            }
            // There is room: the lists are no longer.
            let _ = waves.push(Wave { order, integer: order.round() == order, cos: gain * cos, sin: gain * sin });
        }
        Ok(Self { waves })
    }

    /// One wave of order 1.
    pub fn first(cos: S, sin: S) -> Self {
        let mut waves = Vec::new();
        // There is room for eight.
        let _ = waves.push(Wave { order: S::ONE, integer: true, cos, sin });
        Self { waves }
    }

    /// The sum at an angle in rad. In `f32` within 2e-7 (1 + k) of each amplitude for an angle of one turn; larger angles add k times their own rounding.
    #[inline]
    pub fn at(&self, angle: S) -> S {
        let wrapped = angle.wrap_turn();
        self.waves.iter().fold(S::ZERO, |sum, wave| {
            let (sin, cos) = wave.of(angle, wrapped);
            sum + wave.cos * cos + wave.sin * sin
        })
    }

    /// The sum of what a function makes of each order, its wave c cos(k q) + s sin(k q) and the wave's quadrature c sin(k q) − s cos(k q).
    #[inline]
    pub fn sum(&self, angle: S, filter: impl Fn(S, S, S) -> S) -> S {
        let wrapped = angle.wrap_turn();
        self.waves.iter().fold(S::ZERO, |sum, wave| {
            let (sin, cos) = wave.of(angle, wrapped);
            sum + filter(wave.order, wave.cos * cos + wave.sin * sin, wave.cos * sin - wave.sin * cos)
        })
    }
}
