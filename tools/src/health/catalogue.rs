//! Stiffness, hysteresis loss and lost motion as catalogues quote them, of a model.
//!
//! The input is locked and the gear is cycled between ± the rated torque T_R until the loop is closed. θ₊(T) and θ₋(T) are the deflections at a torque on the
//! rising and the falling branch, θ(T) their mean, halved between T and −T.
//!
//! - **K1** = T1/θ(T1), **K2** = (T2 − T1)/(θ(T2) − θ(T1)), **K3** = (T_R − T2)/(θ(T_R) − θ(T2)): secants between the catalogue's breakpoints.
//! - **Hysteresis loss** = θ₋(0) − θ₊(0): the deflections that remain at no torque, from one side to the other.
//! - **Lost motion** = the whole deflection of a closed cycle between ± 4 % of T_R.
//!
//! Deflections are interpolated to 2e-7 of themselves. Catalogues state one value for a size; these are of one gear. Terms of the model that depend on the deflection alone take part; others do not act on a gear
//! that is loaded slowly with its input locked, and are left out.

use super::HealthError;
use super::condition::Gear;
use crate::model::Model;
use crate::physics::{PredictError, predict};
use crate::recording::Recording;

/// What of the rating was asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Asked {
    /// T_R.
    pub rated_torque: Option<f64>,
    /// T1.
    pub t1: Option<f64>,
    /// T2.
    pub t2: Option<f64>,
}

/// The torques between which stiffness is taken, N·m or A.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Rating {
    /// T_R; by default the smallest torque at the rated deflection of the series.
    pub rated_torque: f64,
    /// T1; by default 0.2 T_R.
    pub t1: f64,
    /// T2; by default 0.7 T_R.
    pub t2: f64,
}

/// T1 and T2 beside the rated torque, about as catalogues have them.
const BREAKPOINTS: (f64, f64) = (0.2, 0.7);
/// Torque of the cycle that lost motion is taken from, beside the rated one.
const LOST_MOTION: f64 = 0.04;

impl Rating {
    /// The rating of a series.
    ///
    /// # Errors
    /// Torques out of order, or beyond a gear's rated deflection.
    pub fn settle(asked: &Asked, gears: &[Gear]) -> Result<Self, HealthError> {
        let mut smallest = f64::INFINITY;
        for gear in gears {
            let reached = Bench::new(&gear.model)?.tip(gear.rated_deflection_rad())?;
            if let Some(rated_torque) = asked.rated_torque.filter(|t| *t > reached * (1.0 + 1e-9)) {
                let unit = gear.model.torque_unit.symbol();
                return Err(HealthError::BeyondRated { name: gear.name.clone(), rated_torque, reached, unit });
            }
            if reached.is_nan() || reached <= 0.0 {
                let unit = gear.model.torque_unit.symbol();
                return Err(HealthError::NoSpring { name: gear.name.clone(), torque: reached, unit });
            }
            smallest = smallest.min(reached);
        }
        let rated = asked.rated_torque.unwrap_or(smallest);
        let (t1, t2) = (asked.t1.unwrap_or(BREAKPOINTS.0 * rated), asked.t2.unwrap_or(BREAKPOINTS.1 * rated));
        if !(0.0 < t1 && t1 < t2 && t2 < rated) {
            return Err(HealthError::Breakpoints { t1, t2, rated });
        }
        Ok(Self { rated_torque: rated, t1, t2 })
    }
}

/// The figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Catalogue {
    /// K1, N·m/rad.
    pub k1: f64,
    /// K2, N·m/rad.
    pub k2: f64,
    /// K3, N·m/rad.
    pub k3: f64,
    /// Hysteresis loss, rad.
    pub hysteresis_loss_rad: f64,
    /// Lost motion, rad.
    pub lost_motion_rad: f64,
}

/// The figures of a model with a gear; not finite where no closed cycle reaches the torques.
///
/// # Errors
/// What prediction refuses.
pub fn catalogue(model: &Model, rating: &Rating) -> Result<Catalogue, PredictError> {
    let bench = Bench::new(model)?;
    let [amplitude, lost] = [1.0, LOST_MOTION].map(|share| bench.amplitude(share * rating.rated_torque));
    let (amplitude, lost) = (amplitude?, lost?);
    if !(amplitude + lost).is_finite() {
        let none = f64::NAN;
        return Ok(Catalogue { k1: none, k2: none, k3: none, hysteresis_loss_rad: none, lost_motion_rad: none });
    }
    let whole = bench.cycle(amplitude)?;
    let deflection = |torque: f64| {
        let mean = |t: f64| 0.5 * (whole.rising(t) + whole.falling(t));
        0.5 * (mean(torque) - mean(-torque))
    };
    let (first, second) = (deflection(rating.t1), deflection(rating.t2));
    let end = whole.half_width();
    Ok(Catalogue {
        k1: rating.t1 / first,
        k2: (rating.t2 - rating.t1) / (second - first),
        k3: (rating.rated_torque - rating.t2) / (end - second),
        hysteresis_loss_rad: whole.falling(0.0) - whole.rising(0.0),
        lost_motion_rad: 2.0 * lost,
    })
}

/// A model on a bench that twists it slowly, its input locked.
struct Bench {
    model: Model,
    rated_deflection_rad: f64,
}

/// Samples of a stroke from tip to tip.
const STROKE: usize = 240;
/// Cycles until the loop is closed.
const CYCLES: usize = 4;
/// Duration of a cycle, s: slow, as catalogues measure. Matters to law `time` only.
const CYCLE_S: f64 = 60.0;

impl Bench {
    fn new(model: &Model) -> Result<Self, PredictError> {
        let mut model = model.clone();
        model.gear.deflection_zero_rad = 0.0;
        let terms = std::mem::take(&mut model.terms);
        let bench = Self { rated_deflection_rad: model.gear.rated_deflection_rad.unwrap_or(f64::NAN), model };
        let probe = bench.motion(bench.rated_deflection_rad);
        let mut model = bench.model;
        for term in terms {
            model.terms.push(term);
            if let Err(PredictError::MissingSignal { .. }) = predict(&model, None, &probe) {
                model.terms.pop();
            }
        }
        Ok(Self { model, ..bench })
    }

    /// Triangles between ± an amplitude from rest.
    fn motion(&self, amplitude_rad: f64) -> Recording {
        let quarter = STROKE as i64 / 2;
        let place = |k: i64| {
            let phase = (k + quarter).rem_euclid(4 * quarter);
            let up = if phase <= 2 * quarter { phase } else { 4 * quarter - phase };
            (up - quarter) as f64 / quarter as f64
        };
        let rows = CYCLES as i64 * 4 * quarter + quarter + 1;
        let step_s = CYCLE_S / (4 * quarter) as f64;
        Recording {
            name: "a slow cycle with the input locked".to_owned(),
            time_s: (0..rows).map(|k| k as f64 * step_s).collect(),
            deflection_rad: Some((0..rows).map(|k| amplitude_rad * place(k)).collect()),
            ..Recording::default()
        }
    }

    /// The last cycle: falling from the upper tip, then rising to it.
    fn cycle(&self, amplitude_rad: f64) -> Result<Cycle, PredictError> {
        let motion = self.motion(amplitude_rad);
        let torque = predict(&self.model, None, &motion)?.torque;
        let theta = motion.deflection_rad.unwrap_or_default();
        let last = theta.len() - 1;
        let branch = |from: usize, to: usize| (from..=to).map(|row| (torque[row], theta[row])).collect();
        Ok(Cycle { falling: branch(last - 2 * STROKE, last - STROKE), rising: branch(last - STROKE, last) })
    }

    /// Half the torque from tip to tip of a closed cycle.
    fn tip(&self, amplitude_rad: f64) -> Result<f64, PredictError> {
        let cycle = self.cycle(amplitude_rad)?;
        let ends = |branch: &[(f64, f64)]| branch.last().zip(branch.first()).map_or(0.0, |(a, b)| a.0 - b.0);
        Ok(0.5 * ends(&cycle.rising))
    }

    /// The amplitude of the closed cycle between ± a torque, by the Illinois method.
    fn amplitude(&self, torque: f64) -> Result<f64, PredictError> {
        let (mut low, mut high) = ((0.0, -torque), (self.rated_deflection_rad, 0.0));
        high.1 = self.tip(high.0)? - torque;
        let mut side = 0;
        for _ in 0..100 {
            let middle = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            if !middle.is_finite() || (high.0 - low.0).abs() < 1e-13 * self.rated_deflection_rad {
                break;
            }
            let miss = self.tip(middle)? - torque;
            if miss.abs() <= 1e-13 * torque {
                return Ok(middle);
            }
            if miss > 0.0 {
                high = (middle, miss);
                low.1 *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                low = (middle, miss);
                high.1 *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        Ok((low.0 * high.1 - high.0 * low.1) / (high.1 - low.1))
    }
}

/// A closed cycle: torque and deflection.
struct Cycle {
    falling: Vec<(f64, f64)>,
    rising: Vec<(f64, f64)>,
}

impl Cycle {
    fn rising(&self, torque: f64) -> f64 {
        crossing(&self.rising, torque, 1.0)
    }

    fn falling(&self, torque: f64) -> f64 {
        crossing(&self.falling, torque, -1.0)
    }

    /// Half the deflection from tip to tip.
    fn half_width(&self) -> f64 {
        self.rising.last().zip(self.rising.first()).map_or(0.0, |(a, b)| 0.5 * (a.1 - b.1))
    }
}

/// Where a branch first crosses a torque: a parabola through the nearest three samples.
fn crossing(branch: &[(f64, f64)], torque: f64, direction: f64) -> f64 {
    let beyond = branch.iter().position(|p| (p.0 - torque) * direction >= 0.0).unwrap_or(branch.len() - 1);
    let middle = beyond.clamp(1, branch.len() - 2);
    let at = |k: usize| branch[middle - 1 + k];
    (0..3)
        .map(|i| {
            let others = (0..3).filter(|j| *j != i);
            at(i).1 * others.map(|j| (torque - at(j).0) / (at(i).0 - at(j).0)).product::<f64>()
        })
        .sum()
}
