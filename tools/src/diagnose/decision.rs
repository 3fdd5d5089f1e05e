//! Which of two searches is believed: held-out error alone where structure is loud, likelihood against coloured noise where it is weak; and what an extended model
//! may leave beyond the recorded range.

use std::collections::BTreeSet;

use crate::diagnose::DiagnoseError;
use crate::diagnose::diagnosis::UNKNOWN;
use crate::diagnose::doubt::{AS_GOOD, is_clearly_common, is_doubted, is_mostly_named, is_nameless, may_doubt};
use crate::diagnose::explain::Search;
use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict};
use crate::diagnose::nonparametric::Explained;
use crate::diagnose::selection::Selection;
use crate::kinds::{self, Kind};
use crate::model::{Model, Term, TermValue};
use crate::regression::dataset::Dataset;
use crate::regression::fit::Fitted;
use crate::regression::parameters::FreeParameter;

/// Squares that a selection takes, over those that it leaves: from here on structure is loud, and held-out error decides.
const LOUD: f64 = 4.0;
/// Above this ratio likelihood only refines a name: the residual is then the error of approximate shapes, and not noise.
const VERY_LOUD: f64 = 15.0;
/// Above this ratio it refines no name either: every shape of a machine is some percent off, and the richer kind follows that.
pub(super) const TOO_LOUD_TO_REFINE: f64 = 50.0;
/// Below this ratio likelihood can refute the names of a selection. An effect of three times the noise has a ratio near ten; noise does not hide its shape.
const REFUTABLE: f64 = 20.0;
/// Likelihood refutes a selection of at most so many effects: where there are more, it often finds no name for any of them.
const MOST_REFUTABLE: usize = 2;
/// Likelihood refutes names only where its own model is as good: the held-out squares that the selection leaves are more than this part of those that its model leaves.
const NO_WORSE: f64 = 0.99;
/// The same of slip elements alone, which follow almost any curve: what they predict better than one by chance.
const NO_WORSE_OF_ELEMENTS: f64 = 0.9;
/// Or where it sees structure over a coordinate beside all that the selection found: a curve gains so much, net,
const STRUCTURE_LEFT: f64 = 100.0;
/// and takes this part of the squares. Of 120 synthetic cases that were named right, one is beyond both; of 22 named wrong beside a likelihood without a name, 11.
const PART_LEFT: f64 = 0.12;
/// Such a selection has at most so many effects. Only one of a gear on a bench is refuted by it: textbook friction leaves structure in every joint log.
const MOST_REFUTABLE_OF_GEAR: usize = 3;
/// Or where one of several effects saves less than this share of what is predictable. Such an effect usually corrects the shape of a similar kind that was named in place of the true one.
const LEAST_SHARE: f64 = 0.05;
/// A base that leaves more than this part of the torque, rms, is far from its machine: there every kind leaves structure, and fidelity alone decides.
const FAR_FROM_MACHINE: f64 = 0.05;
/// Where likelihood sees nothing, free functions that predict this part are a mismatch; in slow noise they predict up to .45 by chance.
const OVERRULES: f64 = 0.5;
/// Structure without a name that is all there is, and no tone, is this part of the squared residual: of 6 such false alarms in 400 nulls of coloured noise 5 were .06 to .11; of 54
/// effects of no list that were all there is one was less than .28.
const LEAST_PART_ALONE: f64 = 0.15;
/// Structure of this part of the base's squared error, held out, is a mismatch whatever the likelihood says.
pub(super) const LARGE: f64 = 0.2;
/// A selection that leaves less than this part of the held-out squares that likelihood's finding leaves stands.
const CLEARLY_BETTER: f64 = 0.95;
/// A curve explains at most so many times the squares that the base leaves.
const MOST_OF_RESIDUAL: f64 = 100.0;
/// A curve adds at most so many times the squares that the kinds leave without curves.
const MOST_OF_LEFT: f64 = 4.0;
/// With the past of the gear at rest, an extended model leaves at most so many times the squares that the base leaves: where the past was not recorded, gear and past can trade torque.
const MOST_WITHOUT_PAST: f64 = 4.0;
/// Steps of the fit beside the base as it is.
const STEPS: usize = 5;
/// Steps of the fit against coloured noise from one by plain least squares.
pub(super) const STEPS_OF_LIKELIHOOD: usize = 2;

/// Makes a curve add nothing.
fn flatten(curve: &mut Term) {
    if let Some(TermValue::List(values)) = curve.values.get_mut("values_nm") {
        values.fill(0.0);
    }
}

/// Whether a curve is over the deflection.
fn is_over_deflection(curve: &Term) -> bool {
    matches!(curve.values.get("coordinate"), Some(TermValue::Text(over)) if over == "deflection")
}

/// Whether a kind has others that refine it.
fn is_refined(name: &str) -> bool {
    kinds::ALL.iter().any(|kind| kind.refines().contains(&name))
}

/// Some kinds and those that refine or contain one of them.
fn with_finer(names: &BTreeSet<&str>) -> Vec<&'static str> {
    let is_finer = |kind: &dyn Kind| kind.refines().iter().chain(kind.contains()).any(|plain| names.contains(plain));
    kinds::ALL.iter().filter(|kind| names.contains(kind.name()) || is_finer(**kind)).map(|kind| kind.name()).collect()
}

/// Whether all that a verdict sees is structure without a name in so small a part of the squared residual that slow noise often imitates it over time or frequency.
fn is_slight(verdict: &DiagnosisVerdict) -> bool {
    let [only] = &verdict.effects[..] else { return false };
    let is_small = |curve: &Explained| !curve.coherent && curve.part < LEAST_PART_ALONE;
    only.name == UNKNOWN && only.closest.is_none() && only.curves.first().is_some_and(is_small)
}

/// The slip elements that a verdict names.
fn slip_elements(verdict: &DiagnosisVerdict) -> impl Iterator<Item = &EffectVerdict> {
    verdict.effects.iter().filter(|e| kinds::of(&e.name).is_some_and(|kind| kind.is_of_slip_elements()))
}

fn names(verdict: &DiagnosisVerdict) -> BTreeSet<&str> {
    verdict.effects.iter().map(|e| e.name.as_str()).collect()
}

/// Whether a verdict names another's effects, some of them by kinds that contain them.
fn refines(finer: &DiagnosisVerdict, plainer: &DiagnosisVerdict) -> bool {
    let contained = |name: &str| kinds::of(name).map_or(&[][..], |kind| kind.contains());
    let covers = |finer: &str, plain: &str| finer == plain || contained(finer).contains(&plain);
    let (finer, plainer) = (names(finer), names(plainer));
    finer != plainer
        && plainer.iter().all(|plain| finer.iter().any(|f| covers(f, plain)))
        && finer.iter().all(|f| plainer.iter().any(|plain| covers(f, plain)))
}

impl Dataset<'_> {
    /// The verdict: by held-out error where structure is loud, unless likelihood explains as much with fewer names; else by likelihood against coloured noise,
    /// unless the joint selection predicts clearly better.
    pub(super) fn decided<'r>(
        &self,
        model: &Model,
        base: Fitted,
        selection: &Selection,
        search: Search<'r>,
    ) -> Result<(DiagnosisVerdict, Search<'r>), DiagnoseError> {
        let taken =
            (selection.base_squares - selection.selected_squares) / selection.selected_squares.max(f64::MIN_POSITIVE);
        if taken > LOUD {
            return self.decided_loud(model, &base, selection, taken, search);
        }
        let (verdict, by_likelihood) = self.found_in_means(model, search)?;
        let selection = self.confirmed(&base, selection.clone(), &verdict.base, search)?;
        let (ours, theirs) =
            (self.mean_square_of_blocks(&selection.fit), self.mean_square_of_blocks(&verdict.extended));
        let better = ours < CLEARLY_BETTER * theirs;
        let bare = self.mean_square_of_blocks(&base);
        let loud = selection.named() >= LARGE;
        // Where likelihood sees nothing, a little that is saved on held-out blocks may be chance.
        let helps = ours < bare && (verdict.mismatch || loud);
        let nameless = verdict.effects.iter().all(|e| e.name == UNKNOWN) && ours <= theirs;
        let far = self.is_far_from(&base);
        let stands = is_clearly_common(&selection) || far && is_mostly_named(&selection);
        let counts = !stands && (!far || may_doubt(ours, theirs, bare));
        let doubted = counts && is_doubted(&verdict, &selection, ours / theirs.max(f64::MIN_POSITIVE));
        // A curve predicts, but names nothing.
        let names_more = || -> Result<bool, DiagnoseError> { Ok(ours <= self.left_by_kinds(&verdict, search)?) };
        if helps && !selection.selected.is_empty() && !doubted && (better || (loud && (nameless || names_more()?))) {
            let joint = self.joint_verdict(&base, &selection, search)?;
            let refuted = is_nameless(&verdict) && self.are_similar_kinds(model, &joint, &selection, search)?;
            if !refuted && joint.mismatch && (better || joint.effects.iter().any(|e| e.name != UNKNOWN)) {
                return Ok((joint, search));
            }
        }
        let sees_nothing = !verdict.mismatch || is_slight(&verdict);
        let overruled = selection.predictable() >= OVERRULES;
        if sees_nothing && overruled {
            let joint = self.joint_verdict(&base, &selection, search)?;
            if joint.mismatch {
                return Ok((joint, search));
            }
        }
        let is_nothing = if overruled { !verdict.mismatch } else { sees_nothing };
        Ok((if is_nothing { verdict.without_effects() } else { verdict }, by_likelihood))
    }

    /// Whether the few effects that were found of a gear are similar kinds in place of the true one: one of several is very small, or structure over a coordinate is left beside them.
    fn are_similar_kinds(
        &self,
        model: &Model,
        found: &DiagnosisVerdict,
        selection: &Selection,
        search: Search<'_>,
    ) -> Result<bool, DiagnoseError> {
        if !model.has_gear() || self.is_far_from(&found.base) || found.effects.len() > MOST_REFUTABLE_OF_GEAR {
            return Ok(false);
        }
        let mut effects = found.effects.iter().filter_map(|e| selection.selected.iter().find(|s| s.kind == e.name));
        if found.effects.len() > 1 && effects.any(|selected| selected.share < LEAST_SHARE) {
            return Ok(true);
        }
        let extended = &found.extended.model;
        let fit = self.fit(extended, &self.parameters(extended, search), None, STEPS_OF_LIKELIHOOD)?;
        let left = self.curves_beside(&fit, PART_LEFT)?;
        Ok(left.iter().any(|curve| !curve.coherent && curve.net() > STRUCTURE_LEFT && curve.part > PART_LEFT))
    }

    /// Whether a base is far from the machine.
    pub(super) fn is_far_from(&self, base: &Fitted) -> bool {
        self.scatter(&base.residual) > FAR_FROM_MACHINE.powi(2) * self.scatter(&self.target)
    }

    /// What likelihood finds. Without a gear to follow, terms are evaluated on means of the signals.
    fn found_in_means<'r>(
        &self,
        model: &Model,
        search: Search<'r>,
    ) -> Result<(DiagnosisVerdict, Search<'r>), DiagnoseError> {
        if self.stride > 1 && !model.has_gear() {
            self.with_mean_signals().found(model, search)
        } else {
            self.found(model, search)
        }
    }

    /// The verdict where structure is loud: the joint selection's, unless likelihood predicts clearly better, or as well with fewer names or with kinds that contain those selected.
    fn decided_loud<'r>(
        &self,
        model: &Model,
        base: &Fitted,
        selection: &Selection,
        taken: f64,
        search: Search<'r>,
    ) -> Result<(DiagnosisVerdict, Search<'r>), DiagnoseError> {
        let selection = self.with_remainder(base, selection.clone(), search)?;
        let joint = self.joint_verdict(base, &selection, search)?;
        if !joint.mismatch {
            return self.found_in_means(model, search);
        }
        let theirs = self.mean_square_of_blocks(&joint.extended);
        let is_plain = joint.effects.len() < 2 && theirs < LARGE * self.mean_square_of_blocks(&joint.base);
        let is_clear = taken > VERY_LOUD || is_plain;
        let may_be_refined =
            !self.is_far_from(base) && taken < TOO_LOUD_TO_REFINE && joint.effects.iter().any(|e| is_refined(&e.name));
        let most = if model.has_gear() { MOST_REFUTABLE_OF_GEAR } else { MOST_REFUTABLE };
        let may_be_refuted = taken < REFUTABLE && joint.effects.len() <= most;
        if is_clear && !may_be_refined && !may_be_refuted {
            return Ok((joint, search));
        }
        let all_named = |v: &DiagnosisVerdict| !v.effects.is_empty() && v.effects.iter().all(|e| e.name != UNKNOWN);
        let is_finer = |v: &DiagnosisVerdict, left: f64| {
            may_be_refined && all_named(v) && left <= AS_GOOD * theirs && refines(v, &joint)
        };
        // A kind similar to the true one can predict almost as well; the difference then shows as structure in its residual.
        let mut are_similar_kinds = None;
        let mut is_refuted = |v: &DiagnosisVerdict, left: f64| -> Result<bool, DiagnoseError> {
            if !may_be_refuted || !is_nameless(v) {
                return Ok(false);
            }
            let are_elements = slip_elements(&joint).count() == joint.effects.len();
            let share = if are_elements { NO_WORSE_OF_ELEMENTS } else { NO_WORSE };
            if joint.effects.len() <= MOST_REFUTABLE && theirs > share * left {
                return Ok(true);
            }
            if are_similar_kinds.is_none() {
                are_similar_kinds = Some(self.are_similar_kinds(model, &joint, &selection, search)?);
            }
            Ok(are_similar_kinds == Some(true))
        };
        if is_clear {
            // Whether a finer kind stands in the place of a plainer one, and whether likelihood believes in either, takes no search among all kinds.
            let only = with_finer(&names(&joint));
            let (verdict, _) = self.found_in_means(model, Search { only: Some(&only), ..search })?;
            let left = self.mean_square_of_blocks(&verdict.extended);
            if !is_finer(&verdict, left) && !is_refuted(&verdict, left)? {
                return Ok((joint, search));
            }
        }
        let (verdict, by_likelihood) = self.found_in_means(model, search)?;
        let ours = self.mean_square_of_blocks(&verdict.extended);
        if is_refuted(&verdict, ours)? {
            return Ok((verdict, by_likelihood));
        }
        let finer = is_finer(&verdict, ours);
        let simpler = all_named(&verdict) && ours <= AS_GOOD * theirs && verdict.effects.len() < joint.effects.len();
        // Beside a base that is far from its machine a curve that predicts better is found beside the names, too.
        let stands = is_nameless(&verdict) && self.is_far_from(base) && is_mostly_named(&selection);
        let replaced = finer || !is_clear && !stands && (simpler || ours < CLEARLY_BETTER * theirs);
        Ok(if replaced { (verdict, by_likelihood) } else { (joint, search) })
    }

    /// An extended fit, or one beside the base as it is (as `model` gives it, where its refit leaves much more) where a curve only trades torque with the base, or the gear with a
    /// past that was not recorded: such a model fails on other motions.
    pub(super) fn steady(
        &self,
        model: &Model,
        base: &Fitted,
        extended: Fitted,
        search: Search<'_>,
    ) -> Result<Fitted, DiagnoseError> {
        let (given, found) = (search.base_terms, extended.model.terms.len());
        if found == given {
            return Ok(extended);
        }
        let without_past = |total: &[f64]| self.scatter(&self.centred(total));
        let total = self.total(&extended.model)?;
        let (as_given, refitted) = (without_past(&self.total(model)?), without_past(&self.total(&base.model)?));
        let of_blocks = self.mean_square_of_blocks(base) * self.counted() as f64;
        let fails = refitted > MOST_WITHOUT_PAST * as_given || of_blocks > as_given;
        let (steady, least) = if fails { (model, as_given) } else { (&base.model, refitted) };
        let mut trades = without_past(&total) > MOST_WITHOUT_PAST * least;
        for curve in (given..found).filter(|t| extended.model.terms[*t].kind == UNKNOWN) {
            // The elastic law is such a curve, too.
            trades |= is_over_deflection(&extended.model.terms[curve]);
            let added = self.added_by(&extended.model, &total, curve)?;
            trades |= self.scatter(&added) > MOST_OF_RESIDUAL * self.scatter(&base.residual);
        }
        if !trades {
            return Ok(extended);
        }
        let mut model = steady.clone();
        model.terms.extend(extended.model.terms[given..].iter().cloned());
        model.terms[given..].iter_mut().filter(|t| t.kind == UNKNOWN).for_each(flatten);
        let own = |parameter: &FreeParameter| !parameter.is_of_base(given);
        let free: Vec<FreeParameter> = self.parameters(&model, search).into_iter().filter(own).collect();
        Ok(self.plain_fit(&model, &free, STEPS)?)
    }

    /// An extended fit whose curves trade no torque with the kinds: where a curve adds far more than the kinds alone leave, the kinds stay as they are without curves, and
    /// the curves describe the rest. A curve holds its last value beyond the range recorded, and a friction against it grows there.
    pub(super) fn with_curves_apart(&self, extended: Fitted, search: Search<'_>) -> Result<Fitted, DiagnoseError> {
        let Some(without) = self.without_curves(&extended, search)? else { return Ok(extended) };
        let is_curve = |model: &Model, at: &usize| *at >= search.base_terms && model.terms[*at].kind == UNKNOWN;
        let left = self.scatter(&without.residual);
        let total = self.total(&extended.model)?;
        let mut trades = false;
        for curve in (0..extended.model.terms.len()).filter(|at| is_curve(&extended.model, at)) {
            trades |= self.scatter(&self.added_by(&extended.model, &total, curve)?) > MOST_OF_LEFT * left;
        }
        if !trades {
            return Ok(extended);
        }
        let mut model = extended.model.clone();
        let mut kinds = without.model.terms.iter();
        for at in 0..model.terms.len() {
            if is_curve(&model, &at) {
                flatten(&mut model.terms[at]);
            } else if let Some(term) = kinds.next() {
                model.terms[at].clone_from(term);
            }
        }
        (model.elastic, model.memory, model.gear) = (without.model.elastic, without.model.memory, without.model.gear);
        let of_curve = |p: &FreeParameter| matches!(p, FreeParameter::Term { term, .. } if is_curve(&model, term));
        let free = self.parameters(&model, search);
        let of_curves: Vec<FreeParameter> = free.iter().copied().filter(of_curve).collect();
        let curves = self.plain_fit(&model, &of_curves, STEPS)?;
        // The columns of all numbers, for their standard deviations.
        Ok(self.plain_fit(&curves.model, &free, 0)?)
    }

    /// The squares of a line about its mean, of rows that count.
    fn scatter(&self, x: &[f64]) -> f64 {
        let own = self.layout().masked(x);
        let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
        own.iter().map(|x| (x - mean).powi(2)).sum::<f64>()
    }

    /// An extended fit without its curves; `None` where it has none.
    fn without_curves(&self, extended: &Fitted, search: Search<'_>) -> Result<Option<Fitted>, DiagnoseError> {
        let mut model = extended.model.clone();
        let mut found = model.terms.split_off(search.base_terms);
        if found.iter().all(|t| t.kind != UNKNOWN) {
            return Ok(None);
        }
        found.retain(|t| t.kind != UNKNOWN);
        model.terms.append(&mut found);
        Ok(Some(self.plain_fit(&model, &self.parameters(&model, search), 2)?))
    }

    /// Takes out the curves of a verdict that do not predict these rows.
    pub(super) fn drop_curves(&self, verdict: &mut DiagnosisVerdict, search: Search<'_>) -> Result<(), DiagnoseError> {
        let without = self.without_curves(&verdict.extended, search)?;
        let Some(without) = without.filter(|w| self.rms_of_blocks(w) < self.rms_of_blocks(&verdict.extended)) else {
            return Ok(());
        };
        let before = std::mem::replace(&mut verdict.extended, without).model.terms;
        for effect in &mut verdict.effects {
            match effect.term {
                Some(at) if before[at].kind == UNKNOWN => (effect.term, effect.closest) = (None, None),
                Some(at) => {
                    let gone = before[search.base_terms..at].iter().filter(|t| t.kind == UNKNOWN).count();
                    effect.term = Some(at - gone);
                }
                None => {}
            }
        }
        Ok(())
    }

    /// The held-out mean square that an extended model leaves without its curves.
    pub(super) fn left_by_kinds(&self, verdict: &DiagnosisVerdict, search: Search<'_>) -> Result<f64, DiagnoseError> {
        let without = self.without_curves(&verdict.extended, search)?;
        Ok(self.mean_square_of_blocks(without.as_ref().unwrap_or(&verdict.extended)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parse;
    use crate::recording::Recording;

    #[test]
    fn a_curve_that_trades_torque_with_a_friction_gives_it_back() {
        let time_s: Vec<f64> = (0..4000).map(|row| 0.005 * f64::from(row)).collect();
        let ripple = |t: f64| 0.1 * (37.0 * t).sin();
        let recording = Recording {
            name: "joint".into(),
            torque: Some(time_s.iter().map(|t| 20.0 * 0.5 * t.cos() + ripple(*t)).collect()),
            theta_out_rad: Some(time_s.iter().map(|t| 0.5 * t.sin()).collect()),
            velocity_out_rad_per_s: Some(time_s.iter().map(|t| 0.5 * t.cos()).collect()),
            time_s: time_s.into(),
            ..Recording::default()
        };
        // 200 N·m·s/rad of damping, of which a curve takes 180 back within the speeds recorded.
        let text = "format = 1\n[gear]\ntorque_side = \"motor\"\n[[term]]\nkind = \"viscous_friction\"\ndamping_nms_per_rad = 200.0\n\
                    [[term]]\nkind = \"unknown\"\ncoordinate = \"output_velocity\"\nknots = [-0.5, 0.0, 0.5]\nvalues_nm = [90.0, 0.0, -90.0]\n";
        let model = parse("joint.toml", text).unwrap();
        let recordings = [recording];
        let dataset = Dataset::new(&recordings, &model).unwrap();
        let search = Search { removed: &[], only: None, base_terms: 0, held_terms: None, zero: false, seed: 1 };
        let traded = dataset.plain_fit(&model, &dataset.parameters(&model, search), 0).unwrap();
        let apart = dataset.with_curves_apart(traded, search).unwrap();
        let damping = kinds::number_of(&apart.model.terms[0], "damping_nms_per_rad");
        assert!((damping - 20.0).abs() < 0.5, "{damping} N·m·s/rad");
        assert!(apart.parameters.len() > 1, "the damping has no column");
    }
}
