//! Found terms whose refitted numbers make them no term of their kind.

use super::STEPS;
use crate::diagnose::DiagnoseError;
use crate::diagnose::explain::{Search, is_delay};
use crate::kinds;
use crate::kinds::ranges::Speeds;
use crate::model::{Model, Term};
use crate::numerics::basis::Basis;
use crate::numerics::extremes;
use crate::numerics::vector::dot;
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// A kind that a term was of, and the kind that it became a term of its own of.
pub(super) type Renamed = (&'static str, Option<&'static str>);

/// An element hardly slips if a spring, an offset and a past of the recordings describe its torque up to this part of it, rms.
const LEAST_SLIP: f64 = 0.1;

impl Dataset<'_> {
    /// The largest speeds of output and motor; of a gear without a ratio both are the same.
    pub(in crate::diagnose) fn speeds(&self, model: &Model) -> Speeds {
        let output_rad_per_s = self.fastest_rad_per_s;
        Speeds { output_rad_per_s, motor_rad_per_s: output_rad_per_s * model.gear.ratio.map_or(1.0, f64::abs) }
    }

    /// A fit in which the found terms that are of another kind within the recordings are of that kind, or part of a term of it that is there; with the kind that
    /// each was and, where it became a term of its own, the kind that it is. One of a kind that is not in the library is left out: it has no name.
    pub(super) fn without_degenerate(
        &self,
        fit: Fitted,
        search: Search<'_>,
    ) -> Result<(Fitted, Vec<Renamed>), DiagnoseError> {
        let mut model = fit.model.clone();
        let mut renamed = Vec::new();
        for at in (search.base_terms..model.terms.len()).rev() {
            let term = &model.terms[at];
            let Some(kind) = kinds::of_term(term) else { continue };
            let Some(other) = kind.degenerates_to(term, self.speeds(&model)) else { continue };
            let Some(is) = kinds::of_term(&other) else { continue };
            let is_known = search.removed.iter().all(|removed| removed != is.name());
            let is_there = model.has_term(&other.kind);
            if is_there && is.is_of_slip_elements() {
                // The elements of the other term do not stand for these.
                continue;
            }
            let becomes = is_known && !is_there;
            renamed.push((kind.name(), becomes.then(|| is.name())));
            if becomes {
                model.terms[at] = other;
            } else {
                model.terms.remove(at);
            }
        }
        if renamed.is_empty() {
            return Ok((fit, renamed));
        }
        Ok((self.plain_fit(&model, &self.parameters(&model, search), STEPS)?, renamed))
    }

    /// Whether a linear number of a term makes it larger than any may be, as no set of kinds that is selected does.
    pub(in crate::diagnose) fn exceeds_torque(&self, fit: &Fitted, at: usize) -> bool {
        let numbers = fit.parameters.iter().zip(&fit.columns);
        let own = numbers.filter(|(parameter, _)| parameter.is_linear_of(at));
        let largest =
            own.map(|(parameter, column)| parameters::value(&fit.model, *parameter).abs() * extremes::largest(column));
        largest.fold(0.0, f64::max) > self.most_of_a_term()
    }

    /// A fit whose found memories have only elements of positive torque. A negative one trades with the spring: over all that was recorded the two add up, but
    /// on another path it slips elsewhere.
    pub(in crate::diagnose::selection) fn with_positive_elements(
        &self,
        mut fit: Fitted,
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        while let Some(fewer) = self.without_negative_elements(&fit, search)? {
            fit = fewer;
        }
        Ok(fit)
    }

    /// A fit whose found memories have lost their elements of negative torque; `None` where none has any.
    fn without_negative_elements(&self, fit: &Fitted, search: Search<'_>) -> Result<Option<Fitted>, DiagnoseError> {
        self.with_fewer_elements(fit, search, |at| kinds::without_negative_elements(&fit.model.terms[at]))
    }

    /// A fit with fewer elements of those found terms for which `fewer` gives a term; `None` where it gives none.
    fn with_fewer_elements(
        &self,
        fit: &Fitted,
        search: Search<'_>,
        fewer: impl Fn(usize) -> Option<Term>,
    ) -> Result<Option<Fitted>, DiagnoseError> {
        let mut model = fit.model.clone();
        let mut is_changed = false;
        for at in search.base_terms..model.terms.len() {
            if let Some(fewer) = fewer(at) {
                model.terms[at] = fewer;
                is_changed = true;
            }
        }
        let refitted = is_changed.then(|| self.plain_fit(&model, &self.parameters(&model, search), STEPS));
        Ok(refitted.transpose()?)
    }

    /// Which elements of a memory slip over much of the recordings; empty for a term of another kind. One that hardly slips is a spring there, and trades any torque with the elastic ones and with a past
    /// of the recordings: on another path it slips elsewhere.
    fn slips(&self, fit: &Fitted, at: usize) -> Vec<bool> {
        if !kinds::is_of_slip_elements(&fit.model.terms[at]) {
            return Vec::new();
        }
        let mut spring = Basis::default();
        let (of_model, of_recordings) = fit.columns.split_at(fit.parameters.len());
        let elastic = fit.parameters.iter().zip(of_model).filter(|(p, _)| matches!(p, FreeParameter::Elastic(_)));
        for column in of_recordings.iter().chain(elastic.map(|(_, column)| column)) {
            spring.add(column);
        }
        let of_element = |(p, column): (&FreeParameter, &Vec<f64>)| {
            if !p.is_linear_of(at) {
                return None;
            }
            let mut rest = column.clone();
            spring.reduce(&mut rest);
            let mean = column.iter().sum::<f64>() / column.len() as f64;
            let whole = dot(column, column) - column.len() as f64 * mean * mean;
            Some(dot(&rest, &rest) > LEAST_SLIP.powi(2) * whole)
        };
        fit.parameters.iter().zip(of_model).filter_map(of_element).collect()
    }

    /// A fit whose found memories have only elements that slip over much of the recordings; `None` where none has another.
    fn without_springs(&self, fit: &Fitted, search: Search<'_>) -> Result<Option<Fitted>, DiagnoseError> {
        self.with_fewer_elements(fit, search, |at| {
            let slips = self.slips(fit, at);
            kinds::with_elements(&fit.model.terms[at], |element| slips.get(element) != Some(&false))
        })
    }

    /// A fit whose found memories have only elements of positive torque that slip over much of the recordings.
    pub(in crate::diagnose) fn with_slipping_elements(
        &self,
        fit: Fitted,
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        let mut fit = self.with_positive_elements(fit, search)?;
        while let Some(fewer) = self.without_springs(&fit, search)? {
            fit = fewer;
        }
        Ok(fit)
    }

    /// A fit without the found terms whose refitted numbers are not of their kind or that are larger than any may be, without memories that are springs, without waves that cancel each other, and without found friction beside which friction of the `base`
    /// turns round and drives: at one speed the two can trade any torque. With it those kinds. What refines such a term goes before the term itself.
    pub(in crate::diagnose) fn without_unlawful(
        &self,
        base: &Model,
        mut fit: Fitted,
        search: Search<'_>,
    ) -> Result<(Fitted, Vec<String>), DiagnoseError> {
        let mut lost = Vec::new();
        loop {
            if let Some(fewer) = self.without_springs(&fit, search)? {
                fit = fewer;
                continue;
            }
            let (fewer, cancelled) = self.without_cancelling_waves(fit, search, STEPS)?;
            fit = fewer;
            lost.extend(cancelled);
            let found = &fit.model.terms[search.base_terms..];
            let may_be_reversed = |term: &Term| {
                kinds::of_term(term).is_some_and(|k| kinds::may_be_reversed(k, fit.model.is_simulation()))
            };
            let smooths = self.only_smooths(&fit, search)?;
            let is_friction = |term: &Term| kinds::of_term(term).is_some_and(kinds::is_friction_of_motion);
            let mut of_base = base.terms.iter().zip(&fit.model.terms).take(search.base_terms);
            let drives = of_base.any(|(was, is)| is_friction(is) && kinds::is_reversed(is) && !kinds::is_reversed(was));
            let unlawful = (search.base_terms..).zip(found).find(|(at, t)| {
                (!may_be_reversed(t) && kinds::is_reversed(t))
                    || kinds::of_term(t).is_some_and(|kind| !kinds::is_within_limits(kind, t))
                    || (smooths && is_delay(t))
                    || (drives && is_friction(t))
                    || self.exceeds_torque(&fit, *at)
                    || (kinds::is_of_slip_elements(t) && !self.slips(&fit, *at).contains(&true))
                    || kinds::exceeds_refined(t, &fit.model)
            });
            let Some((at, unlawful)) = unlawful else { return Ok((fit, lost)) };
            if kinds::exceeds_refined(unlawful, &fit.model) {
                // Within a small part of a turn two orders trade any torque with each other and with what they refine.
                let fewer = kinds::without_an_element(unlawful).into_iter().map(|fewer| {
                    let mut model = fit.model.clone();
                    model.terms[at] = fewer;
                    self.plain_fit(&model, &self.parameters(&model, search), STEPS)
                });
                let fewer = fewer.collect::<Result<Vec<Fitted>, EstimateError>>()?;
                let left = |fit: &Fitted| self.rms_of_blocks(fit);
                if let Some(best) = fewer.into_iter().min_by(|a, b| left(a).total_cmp(&left(b))) {
                    fit = best;
                    continue;
                }
            }
            if let Some(fewer) = kinds::without_negative_elements(unlawful) {
                let mut model = fit.model.clone();
                model.terms[at] = fewer;
                fit = self.plain_fit(&model, &self.parameters(&model, search), STEPS)?;
                continue;
            }
            let refines = |t: &Term| kinds::of_term(t).is_some_and(|k| k.refines().contains(&unlawful.kind.as_str()));
            let refined = found.iter().any(refines);
            let gone = |t: &Term| if refined { refines(t) } else { t.kind == unlawful.kind };
            let mut model = fit.model.clone();
            model.remove_terms(search.base_terms, gone);
            lost.extend(found.iter().filter(|t| gone(t)).map(|t| t.kind.clone()));
            fit = self.plain_fit(&model, &self.parameters(&model, search), STEPS)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::build::{number, term};
    use crate::model::{TEST_GEAR, parse};
    use crate::recording::Recording;

    /// A base of one term with a further term fitted, the same without what is unlawful, and the kinds lost.
    fn judged(dataset: &Dataset<'_>, base: &Model, further: Term) -> (Fitted, Fitted, Vec<String>) {
        let mut extended = base.clone();
        extended.terms.push(further);
        let search = Search { removed: &[], only: None, base_terms: 1, held_terms: None, zero: false, seed: 1 };
        let fit = dataset.plain_fit(&extended, &dataset.parameters(&extended, search), STEPS).unwrap();
        let (lawful, lost) = dataset.without_unlawful(base, fit.clone(), search).unwrap();
        (fit, lawful, lost)
    }

    #[test]
    fn viscous_friction_that_turns_the_bases_coulomb_friction_round_is_no_finding() {
        // There and back at nearly one speed: −0.2 N·m of Coulomb friction beside 0.7 N·m·s/rad fit best.
        let velocity = |t: f64| if t % 4.0 < 2.0 { 1.0 + 0.1 * (9.0 * t).sin() } else { -1.0 - 0.1 * (9.0 * t).sin() };
        let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
        let velocities: Vec<f64> = time_s.iter().map(|t| velocity(*t)).collect();
        let angle = |at: &mut f64, v: &f64| {
            *at += 0.005 * v;
            Some(*at)
        };
        let recording = Recording {
            name: "joint".into(),
            torque: Some(velocities.iter().map(|v| 0.7 * v - 0.2 * v.signum()).collect()),
            theta_out_rad: Some(velocities.iter().scan(0.0, angle).collect()),
            velocity_out_rad_per_s: Some(velocities.into()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        let text = "format = 1\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"coulomb_friction\"\ntorque_nm = 0.5\nsmoothing_rad_per_s = 0.01\n";
        let base = parse("joint.toml", text).unwrap();
        let found = term("viscous_friction", &[("damping_nms_per_rad", number(0.1))]);
        let recordings = [recording];
        let dataset = Dataset::new(&recordings, &base).unwrap();
        let (fit, lawful, lost) = judged(&dataset, &base, found);
        assert!(kinds::is_reversed(&fit.model.terms[0]));
        assert_eq!(lost, ["viscous_friction"]);
        let torque = kinds::number_of(&lawful.model.terms[0], "torque_nm");
        assert!((torque - 0.5).abs() < 0.02, "{torque} N·m");
    }

    #[test]
    fn gravity_that_a_refit_makes_larger_than_the_torque_is_no_finding() {
        // A fortieth of a turn: what bends with the square of the position looks like a gravity of 400 N·m.
        let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
        let angle: Vec<f64> = time_s.iter().map(|t| 0.08 * (1.3 * t).sin()).collect();
        let recording = Recording {
            name: "axis".into(),
            torque: Some(angle.iter().map(|q| 200.0 * q * q + 20.0 * q).collect()),
            theta_out_rad: Some(angle.into()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        let text = "format = 1\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.1\n";
        let base = parse("axis.toml", text).unwrap();
        let found = term("gravity_load", &[("cos_nm", number(-1.0)), ("sin_nm", number(0.0))]);
        let recordings = [recording];
        let dataset = Dataset::new(&recordings, &base).unwrap();
        let (fit, lawful, lost) = judged(&dataset, &base, found);
        let gravity = kinds::number_of(&fit.model.terms[1], "cos_nm");
        assert!(gravity < -300.0 && dataset.most_of_a_term() < 10.0, "{gravity} N·m");
        assert!(lost == ["gravity_load"] && !lawful.model.has_term("gravity_load"));
    }

    #[test]
    fn a_payload_that_holds_the_torque_on_one_side_may_be_larger_than_what_it_spans() {
        let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
        let angle: Vec<f64> = time_s.iter().map(|t| 0.3 + 0.4 * (1.3 * t).sin()).collect();
        let recording = Recording {
            name: "arm".into(),
            torque: Some(angle.iter().map(|q| 1.0 + 15.0 * q.cos()).collect()),
            theta_out_rad: Some(angle.into()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        let text = "format = 1\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"inertia\"\ninertia_kgm2 = 0.1\n";
        let base = parse("arm.toml", text).unwrap();
        let found = term("gravity_load", &[("cos_nm", number(1.0)), ("sin_nm", number(0.0))]);
        let recordings = [recording];
        let dataset = Dataset::new(&recordings, &base).unwrap();
        let (_, lawful, lost) = judged(&dataset, &base, found);
        assert!(lost.is_empty() && dataset.torque_span() < 7.0);
        assert!((kinds::number_of(&lawful.model.terms[1], "cos_nm") - 15.0).abs() < 0.01);
    }

    #[test]
    fn a_found_memory_keeps_its_elements_of_positive_torque() {
        let base = parse("gear.toml", TEST_GEAR).unwrap();
        let time_s: Vec<f64> = (0..3000).map(|row| 0.01 * f64::from(row)).collect();
        let deflection = time_s.iter().map(|t| 8e-4 * (0.7 * t).sin() * (0.11 * t).cos());
        let mut recording = Recording {
            name: "gear".into(),
            deflection_rad: Some(deflection.collect()),
            time_s: time_s.clone().into(),
            ..Recording::default()
        };
        let of = |torques: &str| {
            let found = "[[term]]\nkind = \"nonlocal_memory\"\nradius_rad = [1e-4, 4e-4]\ntorque_nm = ";
            parse("gear.toml", &format!("{TEST_GEAR}\n{found}{torques}\n")).unwrap()
        };
        let truth = of("[0.9, -0.6]");
        recording.torque = Some(crate::physics::predict(&truth, None, &recording).unwrap().torque.into());
        let recordings = [recording];
        let dataset = Dataset::new(&recordings, &base).unwrap();
        let search = Search { removed: &[], only: None, base_terms: 0, held_terms: None, zero: false, seed: 1 };
        let fitted = |model: &Model| dataset.plain_fit(model, &dataset.parameters(model, search), 0).unwrap();
        let fewer = dataset.without_negative_elements(&fitted(&truth), search).unwrap().unwrap();
        assert_eq!(kinds::elements(fewer.model.terms.last().unwrap()), 1);
        assert!(dataset.without_negative_elements(&fewer, search).unwrap().is_none());
        assert!(dataset.without_negative_elements(&fitted(&base), search).unwrap().is_none());
    }
}
