//! Memory of slip elements that grows with the load: loops wider at their tips.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::build::{memory_radii, number, number_of, slip_elements, term};
use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::nonlocal_memory::NonlocalMemory;
use super::ranges::{Ranges, Speeds};
use super::{Family, Kind};
use crate::model::{Model, Term, TermValue};

/// Elements that grow by less than this part of their torque up to the rated deflection do not show a growth.
const LEAST_GROWTH: f64 = 0.1;

/// The largest growth λ1 x + λ2 x² of a term up to the rated deflection, x = 1, in either direction, as a part of the torque of its elements.
fn growth(own: &Term) -> f64 {
    let (linear, quadratic) = (number_of(own, "load_linear"), number_of(own, "load_quadratic"));
    let turn = -0.5 * linear / quadratic;
    let at = |x: f64| (linear * x + quadratic * x * x).abs();
    let inside = if (0.0..1.0).contains(&turn) { at(turn) } else { 0.0 };
    inside.max(at(1.0))
}

/// Kind `load_dependent_memory`.
pub struct LoadDependentMemory;

impl Kind for LoadDependentMemory {
    fn name(&self) -> &'static str {
        "load_dependent_memory"
    }

    fn family(&self) -> Family {
        Family::Memory
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[Experiment::Amplitudes]
    }

    /// Not searched for yet.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn extends(&self) -> bool {
        true
    }

    fn joint_candidates(&self, ranges: &Ranges, _model: &Model) -> Vec<Term> {
        if ranges.rated_rad <= 0.0 {
            return Vec::new();
        }
        let term = |radii: &Vec<f64>, growth: (f64, f64)| {
            let values = [
                ("radius_rad", TermValue::List(radii.clone())),
                ("load_linear", number(growth.0)),
                ("load_quadratic", number(growth.1)),
            ];
            term(self.name(), &values)
        };
        memory_radii(ranges)
            .iter()
            .flat_map(|radii| [(0.0, 1.0), (1.0, 0.0)].map(|growth| term(radii, growth)))
            .collect()
    }

    fn is_of_slip_elements(&self) -> bool {
        true
    }

    fn degenerates_to(&self, own: &Term, _speeds: Speeds) -> Option<Term> {
        let elements = ["radius_rad", "torque_nm"].map(|key| Some((key, own.values.get(key)?.clone())));
        let [Some(radii), Some(torques)] = elements else { return None };
        (growth(own) < LEAST_GROWTH).then(|| term(NonlocalMemory.name(), &[radii, torques]))
    }

    /// Elements that grow with the load and elements that do not are one memory.
    fn takes_in(&self) -> &'static [&'static str] {
        &["nonlocal_memory"]
    }

    fn draft(&self, _shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        slip_elements(self.name(), measures, random)
            .fixed("load_linear", random.random_range(0.2..0.6))
            .fixed("load_quadratic", random.random_range(0.1..0.4))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::build::list;

    #[test]
    fn elements_that_do_not_grow_are_a_memory_without_load() {
        for (linear, quadratic, grows) in [(0.05, -0.11, false), (0.3, 0.0, true), (0.0, -0.2, true), (0.5, -0.5, true)]
        {
            let values = [
                ("radius_rad", list(1e-4)),
                ("torque_nm", list(0.3)),
                ("load_linear", number(linear)),
                ("load_quadratic", number(quadratic)),
            ];
            let other = LoadDependentMemory.degenerates_to(&term("load_dependent_memory", &values), Speeds::default());
            assert_eq!(other.is_none(), grows, "{linear} {quadratic}");
            assert!(other.is_none_or(|other| other == term("nonlocal_memory", &values[..2])));
        }
    }
}
