//! Zeros of the deflection encoders: one that all recordings share, or one of each.
//!
//! An incremental encoder counts from where it was switched on, an absolute one from where it was mounted. A torque offset does not make up for a zero: the loop hangs on where its tips are,
//! and two recordings of one gear whose zeros differ by a twentieth of the rated deflection give e a fifth of its value.

use gmhm::{Law, Memory};
use rayon::prelude::*;

use crate::fit::start::leave_out_unsettled;
use crate::fit::thresholds::THRESHOLDS;
use crate::model::Model;
use crate::numerics::bounded;
use crate::numerics::extremes::range;
use crate::recording::Recording;
use crate::regression::assembly::Assembly;
use crate::regression::base::Structure;
use crate::regression::error::EstimateError;
use crate::regression::factors::Shared;
use crate::regression::polish::polish;
use crate::regression::problem::Sweep;
use crate::regression::rows;
use crate::regression::rows::Spread;
use crate::regression::rows::{Past, Rows};
use crate::signal::encoder_zeros::apart;
use crate::signal::plausible::Remark;

/// Zeros of recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Zeros {
    /// Of each, rad.
    pub rad: Vec<f64>,
    /// How many of them a fit has found: none, one that all share, or all.
    pub free: usize,
}

/// Zeros and a rated deflection that is not given are found in turn, at most so often,
pub const ROUNDS: usize = 6;
/// and until that changes by no more than this share: a hundred times as much moves e of the published gear by 4 %.
pub const SETTLED: f64 = 1e-6;

/// The zeros of so many recordings are found together, each beside all others. Those of more are found in pairs with the first, which costs no more a recording.
pub(crate) const MOST_TOGETHER: usize = 12;

/// The structures that zeros are tried with: a gear's own, or one without a rate and one with.
pub fn structures(memory: Option<&Memory>) -> Vec<Structure> {
    memory.map_or_else(|| vec![Structure::MASING, Structure::TIME], |memory| vec![Structure::of(memory)])
}

/// Where the deflection of each recording is zero, roughly, rad.
///
/// Tried are the zeros as recorded, the middle of all deflections, and zeros of each recording, from both on to where they suit best. A gear of the structure that leaves least is
/// fitted to compare them: what it lacks it lacks with any zero. Zeros differ only where the recordings go together no other way, or where `own` says so; then a single recording has one too.
///
/// # Errors
/// [`EstimateError::NoMovement`], and what building the gear refuses.
pub fn settle(
    rows: &[Rows<'_>],
    structures: &[Structure],
    given: Option<f64>,
    own: bool,
) -> Result<Zeros, EstimateError> {
    let (low, high) = rows::deflection_range(rows);
    let half = 0.5 * (high - low);
    if half.is_nan() || half <= 0.0 {
        let recording = rows.first().map(|rows| rows.recording.name.clone()).unwrap_or_default();
        return Err(EstimateError::NoMovement { recording });
    }
    let (count, middle) = (rows.len(), 0.5 * (low + high));
    let centred = middle.abs() <= THRESHOLDS.centred_share * half;
    if centred && count == 1 && !own {
        return Ok(Zeros { rad: vec![0.0], free: 0 });
    }
    let spread = Spread::over(rows, THRESHOLDS.selection_rows);
    let trial = Trial::new(spread.of(rows), structures, given);
    // Far outside the rated deflection a polynomial may still meet the torque.
    let rated = given.unwrap_or_else(|| high.max(-low));
    let outside = low > rated || high < -rated;
    let stays = if outside { f64::INFINITY } else { trial.polished(&vec![0.0; count], 0)?.0 };
    let mut shared = trial.polished(&vec![0.0; count], 1)?;
    if !centred {
        let from_middle = trial.polished(&vec![middle; count], 1)?;
        shared = if outside || from_middle.0 < shared.0 { from_middle } else { shared };
    }
    let (left, zeros) = if own && count == 1 || shared.0 < THRESHOLDS.zeros_squares_share * stays {
        (shared.0, Zeros { rad: shared.1, free: 1 })
    } else {
        (stays.min(shared.0), Zeros { rad: vec![0.0; count], free: 0 })
    };
    if count == 1 || !own && left <= rows::rounding(&trial.rows) {
        return Ok(zeros);
    }
    let middles = rows.iter().map(|rows| {
        let (low, high) = range(&*rows.deflection_rad);
        0.5 * (low + high)
    });
    let middles: Vec<f64> = middles.collect();
    let (of_own, own_zeros) = if count <= MOST_TOGETHER {
        trial.better_of(&zeros.rad, &middles)?
    } else {
        // What gears of their own leave is less than zeros of their own can leave of one gear.
        let alone = |index: usize| Ok(trial.part(&[index]).polished(&zeros.rad[index..=index], 1)?.0);
        let alone = (0..count).into_par_iter().map(alone).collect::<Result<Vec<f64>, EstimateError>>()?;
        if !own && alone.iter().sum::<f64>() >= THRESHOLDS.zeros_squares_share * left {
            return Ok(zeros);
        }
        trial.in_pairs(&zeros.rad, &middles)?
    };
    let separate = own || of_own < THRESHOLDS.zeros_squares_share * left;
    Ok(if separate { Zeros { rad: own_zeros, free: count } } else { zeros })
}

/// How far the zero of each recording is from that of the first, rad, where recordings of a model's gear go together only with zeros of their own.
///
/// # Errors
/// As [`fit`](crate::fit::fit()).
pub fn between(recordings: &[&Recording], model: &Model) -> Result<Option<Vec<f64>>, EstimateError> {
    if recordings.len() < 2 || !model.has_gear() {
        return Ok(None);
    }
    let beginnings: Vec<Recording> =
        recordings.iter().map(|r| r.beginning(THRESHOLDS.selection_rows.div_ceil(recordings.len()))).collect();
    let rows = rows::of_recordings(&beginnings, &model.gear)?;
    let zeros = settle(&rows, &structures(model.memory.as_ref()), model.gear.rated_deflection_rad, false)?;
    Ok(apart(&zeros.rad))
}

/// Recordings that go together better with zeros of their own.
pub fn other_zeros(recordings: &[Recording], model: &Model) -> Vec<Remark> {
    let Ok(Some(apart)) = between(&recordings.iter().collect::<Vec<_>>(), model) else { return Vec::new() };
    let first = &recordings[0].name;
    let remark = |(other, apart_rad): (&Recording, &f64)| Remark::OtherZero {
        first: first.clone(),
        other: other.name.clone(),
        apart_rad: *apart_rad,
    };
    recordings.iter().zip(&apart).filter(|(_, apart)| **apart != 0.0).map(remark).collect()
}

/// The largest deflection of all recordings beside their zeros, rad.
pub fn largest(rows: &[Rows<'_>], zero_rad: impl Fn(usize) -> f64) -> f64 {
    let farthest = |(index, rows): (usize, &Rows<'_>)| {
        let (low, high) = range(&*rows.deflection_rad);
        (high - zero_rad(index)).max(zero_rad(index) - low)
    };
    rows.iter().enumerate().map(farthest).fold(0.0, f64::max)
}

/// Recordings that zeros are tried on.
struct Trial<'a> {
    rows: Vec<Rows<'a>>,
    /// From which row on the past of each does not matter; 0 where too little would be left.
    settled: Vec<usize>,
    structures: &'a [Structure],
    given: Option<f64>,
}

impl<'a> Trial<'a> {
    fn new(mut rows: Vec<Rows<'a>>, structures: &'a [Structure], given: Option<f64>) -> Self {
        // The same rows wherever the zero is: what is told by the extremes of each recording, not by the tips of the rated cycle.
        let settled = leave_out_unsettled(&mut rows, f64::INFINITY);
        Self { rows, settled, structures, given }
    }

    /// The same for some of the recordings.
    fn part(&self, of: &[usize]) -> Self {
        let rows = of.iter().map(|&index| self.rows[index].clone()).collect();
        let settled = of.iter().map(|&index| self.settled[index]).collect();
        Self { rows, settled, structures: self.structures, given: self.given }
    }

    /// The better of two starts, each recording with a zero of its own.
    fn better_of(&self, near_rad: &[f64], far_rad: &[f64]) -> Result<(f64, Vec<f64>), EstimateError> {
        let (near, far) = (self.polished(near_rad, near_rad.len())?, self.polished(far_rad, far_rad.len())?);
        Ok(if near.0 <= far.0 { near } else { far })
    }

    /// Zeros of each recording, found beside the first one.
    fn in_pairs(&self, near_rad: &[f64], far_rad: &[f64]) -> Result<(f64, Vec<f64>), EstimateError> {
        let of_pair = |index: usize| {
            let start = |from: &[f64]| [from[0], from[index]];
            let found = self.part(&[0, index]).better_of(&start(near_rad), &start(far_rad))?.1;
            Ok(found[1] - found[0])
        };
        let apart = (1..self.rows.len()).into_par_iter().map(of_pair).collect::<Result<Vec<f64>, EstimateError>>()?;
        let zeros: Vec<f64> = std::iter::once(0.0).chain(apart).map(|apart| near_rad[0] + apart).collect();
        self.polished(&zeros, 1)
    }

    /// The squares that the best structure leaves and the zeros of each recording, from these on to where they suit best: none moved, all by the same, or each by its own.
    fn polished(&self, from_rad: &[f64], count: usize) -> Result<(f64, Vec<f64>), EstimateError> {
        let mut best = (f64::INFINITY, from_rad.to_vec());
        for structure in self.structures {
            let found = self.polished_with(*structure, from_rad, count)?;
            if found.0 < best.0 {
                best = found;
            }
        }
        Ok(best)
    }

    /// The same for one structure. A rated deflection that is not given is the largest beside the zeros, and follows them.
    fn polished_with(
        &self,
        structure: Structure,
        from_rad: &[f64],
        count: usize,
    ) -> Result<(f64, Vec<f64>), EstimateError> {
        let mut zeros = from_rad.to_vec();
        let mut rated = f64::NAN;
        let mut left = f64::INFINITY;
        for _ in 0..ROUNDS {
            let beside = self.given.unwrap_or_else(|| largest(&self.rows, |recording| zeros[recording]));
            if (beside - rated).abs() <= SETTLED * beside {
                break;
            }
            rated = beside;
            let mut rows = self.rows.clone();
            rows.iter_mut().zip(&zeros).for_each(|(rows, zero)| rows.shift(*zero));
            let fixed = Assembly::new(structure, rated, &rows, &[])?;
            let assembly = if count == 0 { fixed } else { fixed.with_free_zeros(count) };
            if structure.law == Law::Masing {
                self.choose_pasts(&assembly, &mut rows, count);
            }
            let problem = assembly.problem(&rows);
            let start: Vec<f64> = problem.nonlinear().iter().map(|n| 0.5 * (n.low + n.high)).collect();
            let polished = polish(&problem, &start, Sweep::PLAIN, &());
            zeros.iter_mut().enumerate().for_each(|(k, zero)| *zero += assembly.zero_rad(&polished.nonlinear, k));
            left = polished.rss;
        }
        Ok((left, zeros))
    }

    /// The past that explains most, of recordings whose first rows take part.
    fn choose_pasts(&self, assembly: &Assembly, rows: &mut [Rows<'_>], count: usize) {
        let (zeros, bounds) = (vec![0.0; count], assembly.problem(rows).bounds());
        let part = |rows: &[Rows<'_>], index: usize| assembly.problem(rows).shared_of(index, &zeros, Sweep::PLAIN);
        let parts: Vec<Shared> = (0..rows.len()).map(|index| part(rows, index)).collect();
        Shared::each_beside_others(&parts, |index, others| {
            let mut own = parts[index].clone();
            if self.settled[index] == 0 {
                let pasts = [Past::Rest, Past::Rising, Past::Falling].map(|past| {
                    rows[index].past = past;
                    let own = part(rows, index);
                    (past, bounded::solve(&others.with(&own).factor().0, &bounds).rss, own)
                });
                if let Some(best) = pasts.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
                    (rows[index].past, own) = (best.0, best.2);
                }
            }
            own
        });
    }
}
