//! An inverse of law `masing` as words: what a prepared block holds.

use super::solve::{Limits, Spring};
use super::{Inverse, Solver};
use crate::elastic::ElasticTorque;
use crate::gear::Gear;
use crate::memory::Frame;
use crate::memory::masing::Masing;
use crate::scalar::Scalar;

/// How many words there are.
pub(crate) const WORDS: usize = 28;

impl<S: Scalar> Inverse<S, Masing<S>> {
    /// Hands out its words, in the order of the record `prepared`.
    pub(crate) fn words(&self, mut put: impl FnMut(S)) {
        let Self { gear, solver, inverse_torque_scale, limit, longest_period } = self;
        let Masing { e, h, half_play } = *gear.law();
        let Limits { tolerance, last_step, last_chord, last_width } = solver.limits;
        gear.frame().words().into_iter().for_each(&mut put);
        gear.elastic().words().into_iter().for_each(&mut put);
        [e, h, half_play].into_iter().for_each(&mut put);
        solver.spring.words().into_iter().for_each(&mut put);
        [tolerance, last_step, last_chord, last_width].into_iter().for_each(&mut put);
        [solver.least_slope, solver.reach, solver.inner_reach, solver.inner_half_tangent]
            .into_iter()
            .for_each(&mut put);
        [*inverse_torque_scale, *limit, *longest_period].into_iter().for_each(&mut put);
    }

    /// The inverse of such words.
    pub(crate) fn of_words(words: &[S; WORDS]) -> Self {
        let [r, ir, t, dl, k1, k3, k5, kn, kt, ks, e, h, half_play, s2, s4, b1, b3, ..] = *words;
        let [
            ..,
            tolerance,
            last_step,
            last_chord,
            last_width,
            least_slope,
            reach,
            inner_reach,
            inner_half_tangent,
            inverse_torque_scale,
            limit,
            longest_period,
        ] = *words;
        let elastic = ElasticTorque::of_words([k1, k3, k5, kn, kt, ks]);
        let spring = Spring::of_words(elastic.polynomial(), [s2, s4, b1, b3]);
        let limits = Limits { tolerance, last_step, last_chord, last_width };
        let solver = Solver { spring, limits, least_slope, reach, inner_reach, inner_half_tangent };
        let gear = Gear::of(Frame::of_words([r, ir, t, dl]), elastic, Masing { e, h, half_play });
        Self { gear, solver, inverse_torque_scale, limit, longest_period }
    }
}
