//! An inverse as words: what a prepared block holds beside the words of its law.

use super::solve::{Limits, Spring};
use super::{Inverse, Solver};
use crate::elastic::ElasticTorque;
use crate::gear::Gear;
use crate::inverse::Invertible;
use crate::memory::Frame;
use crate::scalar::Scalar;

/// Words of scales and elastic torque.
pub(crate) const GEAR_WORDS: usize = 10;
/// Words of the search.
pub(crate) const SEARCH_WORDS: usize = 15;

impl<S: Scalar, L: Invertible<S>> Inverse<S, L> {
    /// Scales and elastic torque, in the order of the records `prepared` and `prepared_gear`.
    pub(crate) fn gear_words(&self) -> [S; GEAR_WORDS] {
        let [rated, inverse_rated, torque_scale, limit] = self.gear.frame().words();
        let [k1, k3, k5, knee, knee_torque, knee_stiffness] = self.gear.elastic().words();
        [rated, inverse_rated, torque_scale, limit, k1, k3, k5, knee, knee_torque, knee_stiffness]
    }

    /// What the search goes by, in their order.
    pub(crate) fn search_words(&self) -> [S; SEARCH_WORDS] {
        let Self { solver, inverse_torque_scale, limit, longest_period, .. } = self;
        let Solver { spring, limits, least_slope, reach, inner_reach, inner_half_tangent } = solver;
        let Limits { tolerance, last_step, last_chord, last_width } = *limits;
        let [s2, s4, b1, b3] = spring.words();
        [
            s2,
            s4,
            b1,
            b3,
            tolerance,
            last_step,
            last_chord,
            last_width,
            *least_slope,
            *reach,
            *inner_reach,
            *inner_half_tangent,
            *inverse_torque_scale,
            *limit,
            *longest_period,
        ]
    }

    /// The inverse of such words and a law.
    pub(crate) fn of_words(gear: &[S; GEAR_WORDS], law: L, search: &[S; SEARCH_WORDS]) -> Self {
        let [rated, inverse_rated, torque_scale, deflection_limit, k1, k3, k5, knee, knee_torque, knee_stiffness] =
            *gear;
        let [
            s2,
            s4,
            b1,
            b3,
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
        ] = *search;
        let elastic = ElasticTorque::of_words([k1, k3, k5, knee, knee_torque, knee_stiffness]);
        let spring = Spring::of_words(elastic.polynomial(), [s2, s4, b1, b3]);
        let limits = Limits { tolerance, last_step, last_chord, last_width };
        let solver = Solver { spring, limits, least_slope, reach, inner_reach, inner_half_tangent };
        let frame = Frame::of_words([rated, inverse_rated, torque_scale, deflection_limit]);
        Self { gear: Gear::of(frame, elastic, law), solver, inverse_torque_scale, limit, longest_period }
    }

    /// The same numbers with a law that is made of this one.
    pub(crate) fn map_law<M: Invertible<S>>(&self, law: impl FnOnce(L) -> M) -> Inverse<S, M> {
        let Self { gear, solver, inverse_torque_scale, limit, longest_period } = *self;
        let gear = Gear::of(*gear.frame(), *gear.elastic(), law(*gear.law()));
        Inverse { gear, solver, inverse_torque_scale, limit, longest_period }
    }
}
