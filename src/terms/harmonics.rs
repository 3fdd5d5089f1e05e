//! Σ c_k cos(k q) + s_k sin(k q).

use heapless::Vec;

use super::read::{Reader, TermError};
use super::registry::KeyInfo;
use crate::scalar::Float;

/// The most orders of one series.
pub const MOST_ORDERS: usize = 8;

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
            let base = if wave.integer { wrapped } else { angle };
            let (sin, cos) = (wave.order * base).sin_cos();
            sum + wave.cos * cos + wave.sin * sin
        })
    }
}
