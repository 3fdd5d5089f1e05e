//! Which quantities moved over a series, at a false-alarm rate for all of them together.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::condition::Condition;

/// A quantity over the series.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Change {
    /// The quantity.
    pub name: &'static str,
    /// Its unit.
    pub unit: String,
    /// Its first value.
    pub first: f64,
    /// Its last value.
    pub last: f64,
    /// Last minus first.
    pub change: f64,
    /// Standard deviation of that.
    pub sd: Option<f64>,
    /// The change beside the first value.
    pub relative: f64,
    /// Probability that scatter alone spreads the values of the series so far apart; absent without standard deviations.
    pub p_value: Option<f64>,
    /// Whether it moved, Holm's correction for the number of quantities applied.
    pub moved: bool,
    /// The smallest change from first to last that would have been seen nine times of ten.
    pub detectable: Option<f64>,
}

/// Tests each quantity for being the same in all conditions: Σ (q − q̄)²/s² with q̄ the weighted mean (Cochran 1954), the smallest of the p-values times their
/// number held against the rate first (Holm, Scand. J. Statist. 6, 1979), so that a gear of which nothing moved raises an alarm at most that often.
pub fn changes(conditions: &[Condition], false_alarm_rate: f64) -> Vec<Change> {
    let count = conditions[0].quantities.len();
    let mut all: Vec<Change> = (0..count).map(|index| change(conditions, index)).collect();
    let p_values: Vec<Option<f64>> = all.iter().map(|c| c.p_value).collect();
    for (change, moved) in all.iter_mut().zip(holm(&p_values, false_alarm_rate)) {
        change.moved = moved;
    }
    let tests = p_values.iter().flatten().count().max(1) as f64;
    for change in &mut all {
        // Two conditions with these standard deviations: z of the first step of Holm, and of nine in ten.
        let threshold = normal_quantile(1.0 - 0.5 * false_alarm_rate / tests) + normal_quantile(0.9);
        change.detectable = change.sd.map(|sd| threshold * sd);
    }
    all
}

fn change(conditions: &[Condition], index: usize) -> Change {
    let at = |k: usize| &conditions[k].quantities[index];
    let (first, last) = (at(0), at(conditions.len() - 1));
    let known: Option<Vec<(f64, f64)>> =
        (0..conditions.len()).map(|k| at(k).sd.filter(|sd| *sd > 0.0).map(|sd| (at(k).value, sd))).collect();
    let p_value = known.map(|points| {
        let weight = |sd: f64| 1.0 / (sd * sd);
        let total: f64 = points.iter().map(|p| weight(p.1)).sum();
        let mean = points.iter().map(|p| p.0 * weight(p.1)).sum::<f64>() / total;
        let spread: f64 = points.iter().map(|p| ((p.0 - mean) / p.1).powi(2)).sum();
        ChiSquared::new((points.len() - 1) as f64).map_or(1.0, |d| d.sf(spread))
    });
    let change = last.value - first.value;
    Change {
        name: first.name,
        unit: first.unit.clone(),
        first: first.value,
        last: last.value,
        change,
        sd: first.sd.zip(last.sd).map(|(a, b)| a.hypot(b)),
        relative: change / first.value.abs(),
        p_value,
        moved: false,
        detectable: None,
    }
}

/// Which hypotheses fall at a rate for all of them together; those without a p-value stand.
pub fn holm(p_values: &[Option<f64>], rate: f64) -> Vec<bool> {
    let mut order: Vec<(usize, f64)> = p_values.iter().enumerate().filter_map(|(k, p)| p.map(|p| (k, p))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let tests = order.len();
    let mut falls = vec![false; p_values.len()];
    for (rank, (index, p)) in order.into_iter().enumerate() {
        if p * (tests - rank) as f64 > rate {
            break;
        }
        falls[index] = true;
    }
    falls
}

fn normal_quantile(p: f64) -> f64 {
    statrs::distribution::Normal::standard().inverse_cdf(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holm_stops_at_the_first_that_stands() {
        let p = [Some(0.004), Some(0.02), None, Some(0.001), Some(0.0034)];
        // Sorted: 0.001·4, 0.0034·3, 0.004·2, 0.02·1 against 0.01: the second stands, so all after it do.
        assert_eq!(holm(&p, 0.01), [false, false, false, true, false]);
        assert_eq!(holm(&p, 0.02), [true, true, false, true, true]);
    }
}
