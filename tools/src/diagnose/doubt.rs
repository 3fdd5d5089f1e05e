//! When the likelihood of a fit against coloured noise, which sees structure without a name, speaks against the names of a selection.

use crate::diagnose::diagnosis::{Naming, UNKNOWN};
use crate::diagnose::naming::DiagnosisVerdict;
use crate::diagnose::selection::{Selected, Selection};
use crate::kinds;

/// Fewer names stand where they leave at most so many times the held-out squares that more names leave.
pub(super) const AS_GOOD: f64 = 1.05;
/// Beside structure to which likelihood gives no name, the names of a selection stand if they predict this part of what is predictable,
const MOST_OF_PREDICTABLE: f64 = 0.75;
/// or leave less than this part of the held-out squares.
const MUCH_BETTER: f64 = 0.5;
/// A kind is only approximate if a free function of its own coordinate still predicts this part of what is predictable beside all that was selected.
const STILL_PREDICTED: f64 = 0.3;
/// A name that likelihood withheld stands if the selection leaves less than this part of the squares that likelihood's finding leaves. The same part counts beside a base that is far from
/// its machine, see `may_doubt`.
const BETTER: f64 = 0.8;
/// Beside such a base kinds of the fidelity of a name that save this part of its held-out squares stand against curves: a curve that predicts better still is found beside them.
const MOST_OF_BASE: f64 = 0.5;

/// Whether likelihood may speak against a selection beside a base that is far from its machine, by the held-out squares that the selection, likelihood's finding and the base leave. Every kind
/// leaves structure there, so a finding that predicts no better than the base says nothing against names that predict clearly better.
pub(super) fn may_doubt(selection: f64, likelihood: f64, base: f64) -> bool {
    likelihood < base || selection >= BETTER * base
}

/// Whether the kinds whose fidelity is at least 0.9 save most of the squares that the base leaves.
pub(super) fn is_mostly_named(selection: &Selection) -> bool {
    let is_true = |s: &&Selected| s.fidelity.is_some() && Naming::of(s.fidelity) == Naming::Named;
    let saved: f64 = selection.selected.iter().filter(is_true).flat_map(|s| &s.gains).sum();
    saved >= MOST_OF_BASE * selection.base_squares
}

/// Whether almost every machine has all kinds of a selection, and they save most of the squares that the base leaves. A curve that predicts better is then found beside them.
pub(super) fn is_clearly_common(selection: &Selection) -> bool {
    is_mostly_named(selection) && selection.selected.iter().all(|s| kinds::is_common(s.kind))
}

/// Whether likelihood, which sees structure without a name, speaks against the names of a selection that leaves so many times its held-out squares: the selection leaves much of
/// what is predictable, or a name of it was withheld, or likelihood has no name at all and either predicts better or a name is only approximate.
pub(super) fn is_doubted(verdict: &DiagnosisVerdict, selection: &Selection, times: f64) -> bool {
    let withheld = |kind: &str| verdict.effects.iter().any(|e| e.closest.as_deref() == Some(kind));
    let still_predicted = |s: &Selected| {
        let of_own = kinds::of(s.kind).map_or(&[][..], |kind| kind.measured_by());
        selection.unexplained.iter().any(|(over, share)| *share > STILL_PREDICTED && of_own.first() == Some(over))
    };
    let is_approximate = |s: &Selected| Naming::of(s.fidelity) != Naming::Named || still_predicted(s);
    let approximate = selection.selected.iter().any(is_approximate);
    let nameless = (times > AS_GOOD || approximate) && is_nameless(verdict);
    let partial = times > MUCH_BETTER && selection.named() < MOST_OF_PREDICTABLE * selection.predictable();
    let refused = times > BETTER && selection.selected.iter().any(|s| withheld(s.kind));
    verdict.effects.iter().any(|e| e.name == UNKNOWN) && (nameless || partial || refused)
}

/// Whether a verdict sees structure and gives it no name at all.
pub(super) fn is_nameless(verdict: &DiagnosisVerdict) -> bool {
    verdict.mismatch && verdict.effects.iter().all(|e| e.name == UNKNOWN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_that_predicts_no_better_than_the_base_says_nothing_against_names_that_do() {
        assert!(!may_doubt(0.7, 1.05, 1.0));
        assert!(may_doubt(0.7, 0.95, 1.0));
        assert!(may_doubt(0.9, 1.05, 1.0));
    }
}
