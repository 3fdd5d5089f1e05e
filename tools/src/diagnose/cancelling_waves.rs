//! Waves over a turn that cancel each other on the way recorded. On another they add up.

use crate::diagnose::explain::Search;
use crate::diagnose::naming::coordinates;
use crate::kinds;
use crate::model::Term;
use crate::numerics::vector::axpy;
use crate::regression::dataset::Dataset;
use crate::regression::error::EstimateError;
use crate::regression::fit::Fitted;
use crate::regression::parameters::{self, FreeParameter};

/// A wave cancels others where it is so many times larger than all waves together, rms.
const CANCELS: f64 = 2.0;

/// Waves are needed where a fit without them leaves so many times the error on blocks held out. Of three synthetic resonances that were met at one speed it left 1.09 to 1.37 times the error; of a steady ripple beside such a resonance
/// 1.06.
const NEEDED: f64 = 1.08;

impl Dataset<'_> {
    /// The term and the element of the largest wave that was found, where it is far larger than all of them together: an eccentricity and a load, or orders close to each other, of one term or of several, cancel each other.
    pub(super) fn cancelling_wave(&self, fit: &Fitted, search: Search<'_>) -> Option<(usize, usize)> {
        let white = self.layout().white();
        let mut together = vec![0.0; self.len()];
        let mut largest: Option<(f64, (usize, usize))> = None;
        let found = fit.model.terms.iter().enumerate().skip(search.base_terms);
        for (at, term) in found.filter(|(_, term)| is_of_waves(term)) {
            for element in 0..kinds::elements(term) {
                let mut torque = vec![0.0; self.len()];
                add_element(fit, at, element, &mut torque);
                // A part of a wave may be as good as constant, and the offset of a recording takes any constant.
                let torque = self.without_offsets(&white, &torque);
                axpy(1.0, &torque, &mut together);
                let rms = self.rms(&torque);
                if largest.is_none_or(|(most, _)| rms > most) {
                    largest = Some((rms, (at, element)));
                }
            }
        }
        largest.filter(|(rms, _)| *rms > CANCELS * self.rms(&together)).map(|(_, element)| element)
    }

    /// A fit without waves that cancel others, the largest left out first, and the kinds that are lost: with their last wave, or because they need waves that cancel each other, as what swells and fades with the speed
    /// does. No series of steady waves follows that on another way.
    ///
    /// # Errors
    /// A model that cannot be evaluated.
    pub(super) fn without_cancelling_waves(
        &self,
        mut fit: Fitted,
        search: Search<'_>,
        steps: usize,
    ) -> Result<(Fitted, Vec<String>), EstimateError> {
        let mut removed: Vec<String> = Vec::new();
        // The change of the torque with an order is that at the amplitude where a fit began, which may be far larger.
        let left = |fit: &Fitted| {
            let fit = self.plain_fit(&fit.model, &fit.parameters, 0)?;
            Ok::<_, EstimateError>(self.rms_of_blocks(&fit))
        };
        let mut before = None;
        while let Some((at, cancelling)) = self.cancelling_wave(&fit, search) {
            before = before.or(Some(left(&fit)?));
            let mut model = fit.model.clone();
            removed.push(model.terms[at].kind.clone());
            match kinds::with_elements(&model.terms[at], |element| element != cancelling) {
                Some(fewer) => model.terms[at] = fewer,
                None => drop(model.terms.remove(at)),
            }
            fit = self.plain_fit(&model, &self.parameters(&model, search), steps)?;
        }
        if let Some(before) = before
            && left(&fit)? > NEEDED * before
        {
            let mut model = fit.model.clone();
            model.remove_terms(search.base_terms, |term| removed.contains(&term.kind));
            fit = self.plain_fit(&model, &self.parameters(&model, search), steps)?;
        }
        removed.sort();
        removed.dedup();
        removed.retain(|kind| fit.model.terms[search.base_terms..].iter().all(|term| term.kind != *kind));
        Ok((fit, removed))
    }
}

/// Whether a term is one wave or several over a turn of the motor or the output.
fn is_of_waves(term: &Term) -> bool {
    coordinates(&term.kind).iter().any(|coordinate| matches!(*coordinate, "motor_angle" | "output_angle"))
}

/// Adds the torque of an element of a term to `line`: its linear numbers times their columns. A term without lists is one element.
pub(super) fn add_element(fit: &Fitted, term: usize, element: usize, line: &mut [f64]) {
    let is_of_element = |parameter: &FreeParameter| {
        let FreeParameter::Term { index, .. } = parameter else { return false };
        parameter.is_linear_of(term) && index.is_none_or(|index| index == element)
    };
    for (parameter, column) in fit.parameters.iter().zip(&fit.columns).filter(|(p, _)| is_of_element(p)) {
        axpy(parameters::value(&fit.model, *parameter), column, line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds::build::term;
    use crate::model::{Model, TermValue};
    use crate::recording::Recording;

    /// A wave of order 3 over 10 s, a base with a wave of order 1, and two found waves of nearly that order, fitted in so many steps from these amplitudes; and the same without waves that cancel each other.
    fn found(
        amplitude: impl Fn(f64) -> f64,
        from_nm: [f64; 2],
        steps: usize,
    ) -> (Option<(usize, usize)>, Model, Vec<String>) {
        let time_s: Vec<f64> = (0..2000).map(|row| 0.005 * f64::from(row)).collect();
        let noise = |row: u32| 0.01 * (f64::from(row * row % 17) - 8.0);
        let ripple = |(t, row): (&f64, u32)| amplitude(*t) * (6.0 * t).cos() + noise(row);
        let recordings = [Recording {
            name: "motor".into(),
            torque: Some(time_s.iter().zip(0..).map(ripple).collect()),
            theta_in_rad: Some(time_s.iter().map(|t| 2.0 * t).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        }];
        let waves = |orders: &[f64], cos_nm: &[f64]| {
            let sin_nm = vec![0.0; orders.len()];
            let lists = [("orders", orders.to_vec()), ("cos_nm", cos_nm.to_vec()), ("sin_nm", sin_nm)];
            term("torque_ripple", &lists.map(|(key, list)| (key, TermValue::List(list))))
        };
        let terms = vec![waves(&[1.0], &[0.0]), waves(&[3.0, 3.001], &from_nm)];
        let both = Model { terms, ..Model::default() };
        let dataset = Dataset::new(&recordings, &both).unwrap();
        let search = Search { removed: &[], only: None, base_terms: 1, held_terms: None, zero: false, seed: 1 };
        let fit = dataset.plain_fit(&both, &dataset.parameters(&both, search), steps).unwrap();
        let cancelling = dataset.cancelling_wave(&fit, search);
        let (without, lost) = dataset.without_cancelling_waves(fit, search, 5).unwrap();
        (cancelling, without.model, lost)
    }

    #[test]
    fn of_two_waves_of_which_one_is_enough_one_stays() {
        let (cancelling, without, lost) = found(|_| 0.1, [5.0, -4.9], 0);
        assert_eq!((cancelling, &lost[..]), (Some((1, 0)), &[][..]));
        let TermValue::List(cos_nm) = &without.terms[1].values["cos_nm"] else { panic!("no list") };
        assert!(cos_nm.len() == 1 && (cos_nm[0] - 0.1).abs() < 0.02, "{cos_nm:?}");
    }

    #[test]
    fn a_swelling_wave_is_no_series_of_steady_ones() {
        let (cancelling, without, lost) = found(|t| 0.1 + 0.05 * t, [0.0, 0.0], 1);
        assert!(cancelling.is_some());
        assert_eq!((without.terms.len(), &lost[..]), (1, &["torque_ripple".to_owned()][..]));
    }
}
