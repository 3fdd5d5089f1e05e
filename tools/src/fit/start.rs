//! How recordings begin: what the gear remembers at the first row, and how far the tips of the motion may be beyond its samples.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::fit::thresholds::THRESHOLDS;
use crate::numerics::bounded;
use crate::numerics::extremes::range;
use crate::numerics::mark::Mark;
use crate::regression::assembly::Assembly;
use crate::regression::base::Structure;
use crate::regression::error::EstimateError;
use crate::regression::factors::Shared;
use crate::regression::problem::Sweep;
use crate::regression::rows;
use crate::regression::rows::{Past, Rows};
use crate::signal::counts::Counts;

/// How far the tip of the motion may be beyond the largest deflection seen, as a standard deviation, rad: the most that a parabola through that sample and its neighbours
/// rises above it, and a tenth of a count, which the motion behind counts is unsure by there.
pub(crate) fn tip_sd_rad(rows: &[Rows<'_>]) -> f64 {
    let largest = |r: &Rows<'_>| {
        (0..r.len()).max_by(|&a, &b| r.deflection_rad[a].abs().total_cmp(&r.deflection_rad[b].abs())).unwrap_or(0)
    };
    let tips = rows.iter().map(|r| (r, largest(r)));
    let Some((rows, row)) =
        tips.max_by(|(r, a), (s, b)| r.deflection_rad[*a].abs().total_cmp(&s.deflection_rad[*b].abs()))
    else {
        return 0.0;
    };
    let bend = match rows.deflection_rad.get(row.wrapping_sub(1)..row + 2) {
        Some(&[before, tip, after]) => (2.0 * tip - before - after).abs(),
        _ => 0.0,
    };
    (bend / 8.0).hypot(0.1 * rows.counts.as_ref().map_or(0.0, Counts::step_rad))
}

/// The first row at which law `masing` no longer depends on the unknown past but for a constant torque.
///
/// At a tip of the rated cycle the loop is closed whatever came before. Between the extremes of a smaller recording, once both were reached, every
/// branch starts at a turning point that was seen, so the past shifts the loop and no more, and the offset of the recording takes that up. `None`
/// if that never comes.
pub fn settled_row(deflection_rad: &[f64], rated_deflection_rad: f64) -> Option<usize> {
    let (lowest, highest) = range(deflection_rad);
    // Noise decides which cycle holds the very extreme; the first visit to its neighbourhood counts, at the furthest point of that visit.
    let margin = THRESHOLDS.settled_margin_share * (highest - lowest);
    let furthest = |height: &dyn Fn(f64) -> f64, level: f64| {
        let arrival = deflection_rad.iter().position(|&theta| height(theta) >= level)?;
        let visit = deflection_rad[arrival..].iter().take_while(|&&theta| height(theta) >= level).enumerate();
        visit.max_by(|a, b| height(*a.1).total_cmp(&height(*b.1)).then(b.0.cmp(&a.0))).map(|(row, _)| arrival + row)
    };
    let tip = furthest(&f64::abs, THRESHOLDS.settled_tip_share * rated_deflection_rad);
    let both = furthest(&|theta| -theta, -lowest - margin).zip(furthest(&|theta| theta, highest - margin));
    let both = both.map(|(low, high)| low.max(high));
    match (tip, both) {
        (Some(tip), Some(both)) => Some(tip.min(both)),
        (tip, both) => tip.or(both),
    }
}

/// How each recording starts.
pub(crate) struct Start {
    pub(crate) known: Vec<bool>,
    pub(crate) unsettled: Vec<usize>,
}

/// Leaves out the rows before the loop of each recording has settled, and says how many. From there on every past on the rated cycle is the same.
pub(crate) fn leave_out_unsettled(rows: &mut [Rows<'_>], rated_deflection_rad: f64) -> Vec<usize> {
    let settled: Vec<usize> = rows
        .iter()
        .map(|r| {
            let row = settled_row(&r.deflection_rad, rated_deflection_rad).unwrap_or(0);
            // Where too little would be left, the recording is taken as it is.
            let stays = r.len() - row;
            let enough =
                stays as f64 >= THRESHOLDS.settled_rows_share * r.len() as f64 && stays >= THRESHOLDS.settled_rows;
            if enough { row } else { 0 }
        })
        .collect();
    for (rows, &row) in rows.iter_mut().zip(&settled) {
        rows.marks[..row].fill(Mark::Skipped);
        rows.past = Past::Rising;
    }
    settled
}

/// Leaves out the rows before the loop has settled, unless a start from rest, or from a branch of the rated cycle, explains them.
pub(crate) fn decide_start(rows: &mut [Rows<'_>], rated_deflection_rad: f64) -> Result<Start, EstimateError> {
    let settled = leave_out_unsettled(rows, rated_deflection_rad);
    let assembly = Assembly::new(Structure::MASING, rated_deflection_rad, rows, &[])?;
    let bounds = assembly.problem(rows).bounds();
    let part = |rows: &[Rows<'_>], index: usize| assembly.problem(rows).shared_of(index, &[], Sweep::PLAIN);
    let misfit = |all: &Shared| {
        let freedom = all.rows as f64 - (bounds.len() + all.nuisances) as f64;
        (bounded::solve(&all.factor().0, &bounds).rss, freedom)
    };
    let floor = (1e-8 * rows::torque_size(rows)).powi(2);
    let mut start = Start { known: vec![true; rows.len()], unsettled: vec![0; rows.len()] };
    let parts: Vec<Shared> = (0..rows.len()).map(|index| part(rows, index)).collect();
    Shared::each_beside_others(&parts, |index, others| {
        let row = settled[index];
        let (without, freedom) = misfit(&others.with(&parts[index]));
        let kept: Vec<Mark> = rows[index].marks[..row].to_vec();
        rows[index].marks[..row].fill(Mark::Used);
        let mut under = |past: Past| {
            rows[index].past = past;
            let own = part(rows, index);
            (past, misfit(&others.with(&own)).0, own)
        };
        let (rest, rising, falling) = (under(Past::Rest), under(Past::Rising), under(Past::Falling));
        let other = if rising.1 <= falling.1 { rising } else { falling };
        // Predictions start from rest: another past has to be clearly better.
        let clearly = 1.0 + THRESHOLDS.other_start_variances / freedom.max(1.0);
        let (past, with, mut own) = if other.1 * clearly + floor < rest.1 { other } else { rest };
        rows[index].past = past;
        start.known[index] = past == Past::Rest;
        // Chow's test of further observations (Econometrica 28, 1960): F with (early rows, freedom) degrees.
        let ratio = (with - without) / row as f64 / (without / freedom.max(1.0) + floor);
        let usual = FisherSnedecor::new(row as f64, freedom.max(1.0))
            .map_or(0.0, |f| f.inverse_cdf(1.0 - THRESHOLDS.unsettled_probability));
        if row > 0 && ratio > usual.max(THRESHOLDS.unsettled_ratio) {
            rows[index].marks[..row].copy_from_slice(&kept);
            rows[index].past = Past::Rising;
            start.known[index] = false;
            start.unsettled[index] = row;
            own = parts[index].clone();
        }
        own
    });
    Ok(start)
}
