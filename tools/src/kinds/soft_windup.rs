//! Soft windup: a stiffness that is lower at small deflections.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{number, number_of, term, text};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::{Extent, Ranges};
use super::{Family, Kind, saturates, usual_bounds};
use crate::model::{Model, Term, TermValue};
use crate::physics::columns::set;
use gmhm::terms::KeyInfo;

const K1: &str = "k1_nm_per_rad";
const K2: &str = "k2_nm_per_rad";
const K3: &str = "k3_nm_per_rad";
const T1: &str = "t1_nm";
const T2: &str = "t2_nm";

/// The part of its stiffness at zero that a spring may lose, at most.
const LARGEST_DROP: f64 = 0.9;

/// Kind `soft_windup`.
pub struct SoftWindup;

impl Kind for SoftWindup {
    fn name(&self) -> &'static str {
        "soft_windup"
    }

    fn family(&self) -> Family {
        Family::Elastic
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    fn candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        let a = ranges.rated_rad;
        if a <= 0.0 {
            return Vec::new();
        }
        let widths = [0.05, 0.08, 0.13, 0.2, 0.32, 0.5].map(|share| share * a);
        let of_shape = |shape: &'static str| {
            widths.map(|width| term(self.name(), &[("shape", text(shape)), ("width_rad", number(width))])).to_vec()
        };
        let kinks = [(0.05, 0.13), (0.08, 0.3), (0.13, 0.5), (0.2, 0.4), (0.2, 0.7), (0.35, 0.75)];
        let piecewise = kinks.map(|(first, second)| kinked(first * a, second * a, ranges));
        ["tanh", "rational", "gaussian"].into_iter().flat_map(of_shape).chain(piecewise).collect()
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        &["tanh", "rational", "gaussian", "piecewise"]
    }

    fn price(&self) -> f64 {
        0.0075
    }

    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        if shape == "piecewise" {
            // A stiffness that falls below the catalogue's K3 by d up to T1 and by 0.4 d up to T2.
            let (k3, t1) = (measures.stiffness(), random.random_range(0.1..0.25) * measures.torque_nm);
            let drop = 1.0 / (0.4 * measures.deflection_rad);
            return Draft::new(self.name())
                .text("shape", shape)
                .falling(K1, k3, drop)
                .falling(K2, k3, 0.4 * drop)
                .fixed(K3, k3)
                .fixed(T1, t1)
                .fixed(T2, t1 + random.random_range(0.2..0.45) * measures.torque_nm);
        }
        let width = random.random_range(0.1..0.3) * measures.deflection_rad;
        Draft::new(self.name())
            .text("shape", shape)
            .number("stiffness_drop_nm_per_rad", 1.0 / width)
            .fixed("width_rad", width)
    }

    fn repeatable(&self) -> bool {
        true
    }

    fn growth(&self, term: &Term, ranges: &Ranges) -> Option<(&'static str, f64)> {
        term.values.contains_key(K1).then_some((K1, 1e-2 * ranges.torque_nm / ranges.rated_rad))
    }

    /// A catalogue's K1 falls below K3 by `weight`, K2 half as far, and the kinks stay at their deflections.
    fn with_more(&self, term: &Term, key: &'static KeyInfo, weight: f64) -> Term {
        if key.name != K1 {
            return set(term, key, None, weight);
        }
        let (k3, t1, t2) = (number_of(term, K3), number_of(term, T1), number_of(term, T2));
        let drop = weight.clamp(-LARGEST_DROP * k3, LARGEST_DROP * k3);
        let (k1, k2) = (k3 - drop, k3 - 0.5 * drop);
        let first = t1 / k3 * k1;
        let values = [(K1, k1), (K2, k2), (T1, first), (T2, first + (t2 - t1) / k3 * k2)];
        let mut term = term.clone();
        term.values.extend(values.map(|(key, value)| (key.to_owned(), number(value))));
        term
    }

    /// Only differences from K3 count.
    fn is_scale(&self, key: &KeyInfo) -> bool {
        key.name == K3
    }

    /// The kinks of a catalogue stay in their order.
    fn bounds(&self, _model: &Model, term: &Term, key: &KeyInfo, index: Option<usize>) -> (f64, f64) {
        let (low, high) = usual_bounds(term, key, index);
        match (key.name, term.values.get(T1), term.values.get(T2)) {
            (T1, _, Some(TermValue::Number(t2))) => (low.min(*t2), high.min(*t2)),
            (T2, Some(TermValue::Number(t1)), _) => (low.max(*t1), high.max(*t1)),
            _ => (low, high),
        }
    }

    /// K1 and K2 lie below K3.
    fn is_of_kind(&self, term: &Term, extent: &Extent) -> bool {
        saturates(term, extent.fastest_rad_per_s) && number_of(term, K1).max(number_of(term, K2)) <= number_of(term, K3)
    }
}

/// Soft windup of a catalogue, K1 to T1, K2 to T2, K3 beyond, as yet without softness. Only differences from K3 count, so that K3 is chosen higher than any of them.
fn kinked(first_rad: f64, second_rad: f64, ranges: &Ranges) -> Term {
    let k3 = 3.0 * ranges.torque_nm / ranges.rated_rad;
    let values = [
        (K1, number(k3)),
        (K2, number(k3)),
        (K3, number(k3)),
        ("shape", text("piecewise")),
        (T1, number(k3 * first_rad)),
        (T2, number(k3 * second_rad)),
    ];
    term(SoftWindup.name(), &values)
}
