//! One experiment without noise: the torque it shows, what the base model cannot follow, and what else could explain that.

use std::collections::BTreeMap;

use super::families;
use super::kinds::{Family, Hidden};
use super::linear::{Span, Whitener, weights};
use super::motion::{Motion, Plan};
use super::noise::rms;
use super::physics::{Piece, World};
use crate::model::TorqueSide;
use crate::prove::generator::plant_model::PlantModel;

/// A gear or joint, how it is measured, and the motions that were recorded.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// The gear or the joint.
    pub plant_model: PlantModel,
    /// What the motions have in common.
    pub plan: Plan,
    /// Where the torque is taken.
    pub side: TorqueSide,
    /// Friction (Coulomb, smoothing, viscous) that a bench's base model has.
    pub extra: Option<[f64; 3]>,
    /// The motions, one a recording.
    pub motions: Vec<Motion>,
}

/// One recording without noise.
#[derive(Debug, Clone)]
pub struct Truth {
    /// The world of this recording.
    pub world: World,
    /// The deflection as a faultless encoder pair with the hidden effects would show it, rad.
    pub measured: Vec<f64>,
    /// The torque, N·m.
    pub torque: Vec<f64>,
    /// The torque minus that of the true base model at the measured deflection: what was left out, before any refit.
    pub left_out: Vec<f64>,
}

/// The base model alone, beside the kinds of [`Experiment::unexplained`].
pub const BASE: &str = "base";
/// The truth itself, there.
pub const OWN: &str = "own";

/// A hidden effect and the factor on its weights.
pub type Scaled<'a> = (&'a Hidden, f64);

impl Experiment {
    /// Every recording without noise, with these effects in it.
    pub fn truth(&self, effects: &[Scaled]) -> Vec<Truth> {
        let pieces: Vec<(&Piece, f64)> =
            effects.iter().flat_map(|(hidden, s)| hidden.pieces.iter().map(move |(p, w)| (p, w * s))).collect();
        let play = pieces.iter().filter(|p| *p.0 == Piece::Play).map(|p| p.1).sum();
        self.motions
            .iter()
            .map(|motion| {
                let world = World::new(&self.plant_model, &self.plan, motion, self.side, self.extra, play);
                let mut measured = world.planned.clone();
                let mut torque: Vec<f64> = world.base.iter().zip(&world.friction).map(|(b, f)| b + f).collect();
                let mut left_out = vec![0.0; torque.len()];
                for (piece, weight) in &pieces {
                    if let Some(x) = world.deflection(piece, *weight) {
                        measured.iter_mut().zip(x).for_each(|(m, x)| *m += x);
                    }
                    if let Some(x) = world.torque(piece, *weight) {
                        torque.iter_mut().zip(&x).for_each(|(t, x)| *t += x);
                        left_out.iter_mut().zip(&x).for_each(|(t, x)| *t += x);
                    }
                }
                if let PlantModel::Bench(gear) = &self.plant_model
                    && measured != world.theta
                {
                    let seen = gear.torque(&world.history, &measured);
                    left_out.iter_mut().zip(world.base.iter().zip(seen)).for_each(|(t, (b, s))| *t += b - s);
                }
                Truth { world, measured, torque, left_out }
            })
            .collect()
    }

    /// The base model's columns at the measured deflections, all recordings in a row: its five parameters, friction
    /// where it has some, an offset a recording and, with `zero`, the encoder's zero.
    pub fn base_columns(&self, truths: &[Truth], zero: bool) -> Vec<Vec<f64>> {
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for (index, truth) in truths.iter().enumerate() {
            let world = &truth.world;
            let mut own: Vec<Vec<f64>> = match &self.plant_model {
                PlantModel::Bench(gear) => gear.columns(&world.history, &truth.measured).to_vec(),
                PlantModel::Joint(joint) => joint.columns(&world.output, &world.velocity, &world.acceleration).to_vec(),
            };
            if let Some([_, smoothing, _]) = self.extra {
                own.push(world.velocity.iter().map(|v| world.sigma * (v / smoothing).tanh()).collect());
                own.push(world.velocity.iter().map(|v| world.sigma * v).collect());
            }
            if let (true, PlantModel::Bench(gear)) = (zero, &self.plant_model) {
                let step = 1e-4 * gear.rated;
                let shifted = |x: &[f64]| x.iter().map(|x| x + step).collect::<Vec<f64>>();
                let there = gear.torque(&shifted(&world.history), &shifted(&truth.measured));
                let here = gear.torque(&world.history, &truth.measured);
                own.push(there.iter().zip(here).map(|(a, b)| a - b).collect());
            }
            let rows = truth.torque.len();
            own.extend((0..truths.len()).map(|k| vec![if k == index { 1.0 } else { 0.0 }; rows]));
            if columns.is_empty() {
                columns = own;
            } else {
                columns.iter_mut().zip(own).for_each(|(all, part)| all.extend(part));
            }
        }
        columns
    }

    /// The rms that `effects` leave after the base model is refitted, N·m.
    pub fn size(&self, effects: &[Scaled]) -> f64 {
        let truths = self.truth(effects);
        rms(&Span::new(&self.base_columns(&truths, true)).residual(&joined(&truths)))
    }

    /// The rms that the refitted base model leaves of the whole torque, N·m: `effects`, and a gear of another plant model.
    pub fn leaves(&self, effects: &[Scaled]) -> f64 {
        let truths = self.truth(effects);
        let torque: Vec<f64> = truths.iter().flat_map(|t| t.torque.iter().copied()).collect();
        rms(&Span::new(&self.base_columns(&truths, true)).residual(&torque))
    }

    /// The factor on `hidden`'s weights that makes it leave `size_nm`, with the rms it has before the refit; nothing
    /// where the base model swallows it, or no factor does.
    pub fn scale(&self, hidden: &Hidden, size_nm: f64) -> Option<(f64, f64)> {
        // Pieces come in units from rad to N·m/rad²: a first factor that makes a small response, then secants.
        let unit =
            hidden.pieces.iter().map(|(p, w)| small(p, &self.plan) / w.abs().max(1e-12)).fold(f64::MAX, f64::min);
        let mut scale = unit * size_nm / self.size(&[(hidden, unit)]).max(1e-12);
        for _ in 0..12 {
            let size = self.size(&[(hidden, scale)]);
            if !size.is_finite() || size < 1e-9 {
                return None;
            }
            if (size / size_nm - 1.0).abs() < 0.01 {
                let before = rms(&joined(&self.truth(&[(hidden, scale)])));
                return Some((scale, before));
            }
            scale *= (size_nm / size).clamp(0.2, 5.0);
        }
        None
    }

    /// The base parameters that fit the noise-free torque of `effects` best.
    pub fn refitted(&self, effects: &[Scaled]) -> Vec<f64> {
        let truths = self.truth(effects);
        let torque: Vec<f64> = truths.iter().flat_map(|t| t.torque.iter().copied()).collect();
        weights(&self.base_columns(&truths, false), &torque)
    }

    /// For every kind, how much of `effects[target]` it leaves unexplained, as squared deviations of the `noise`; under
    /// [`BASE`], what the base model alone leaves; under [`OWN`], what first-order columns of the truth itself leave. The other effects are taken as known.
    ///
    /// Families with more than one free parameter beyond the truth's are not tried: a model that can be anything
    /// explains everything. Without `families`, of the base and the truth only.
    pub fn unexplained(
        &self,
        effects: &[Scaled],
        target: usize,
        noise: &[Vec<f64>],
        families: bool,
    ) -> BTreeMap<String, f64> {
        let whiteners: Vec<Whitener> = noise.iter().map(|n| Whitener::fit(n, 12)).collect();
        let whiten = |x: &[f64]| -> Vec<f64> {
            let mut from = 0;
            let mut all = Vec::with_capacity(x.len());
            for (noise, whitener) in noise.iter().zip(&whiteners) {
                all.extend(whitener.apply(&x[from..from + noise.len()]));
                from += noise.len();
            }
            all
        };
        let truths = self.truth(effects);
        let mut span = Span::new(&self.base_columns(&truths, true).iter().map(|c| whiten(c)).collect::<Vec<_>>());
        for (i, other) in effects.iter().enumerate() {
            if i != target {
                span.add(&whiten(&joined(&self.truth(&[*other]))));
            }
        }
        let (hidden, _) = effects[target];
        let y = span.residual(&whiten(&joined(&self.truth(&[effects[target]]))));
        let energy: f64 = y.iter().map(|y| y * y).sum();
        let base_nm = rms(&truths.iter().flat_map(|t| t.torque.iter().copied()).collect::<Vec<f64>>());
        let mut least = BTreeMap::from([(BASE.to_owned(), energy)]);
        let allowed = parameters(&hidden.pieces) + 1;
        let mut tried = if families { families::all(&truths[0].world, &orders(&hidden.pieces)) } else { Vec::new() };
        tried.retain(|f| f.kind == hidden.kind || f.pieces.len() + f.tuned <= allowed);
        // The truth's own pieces: what they leave is only what a first-order column cannot follow.
        let own: Vec<Piece> = hidden.pieces.iter().map(|(p, _)| p.clone()).collect();
        tried.push(Family { kind: OWN, pieces: own, tuned: 0, positive: false });
        for family in tried {
            let (mut raw, mut columns) = (Vec::new(), Vec::new());
            for piece in &family.pieces {
                let column = self.column(piece);
                let seen = whiten(&column);
                let left = span.residual(&seen);
                // A column that the base model holds already has no say, and its weight would be noise.
                if rms(&left) > 1e-6 * rms(&seen) {
                    raw.push(column);
                    columns.push(left);
                }
            }
            if columns.is_empty() {
                continue;
            }
            let fitted = weights(&columns, &y);
            let mixed =
                |columns: &[Vec<f64>], i: usize| columns.iter().zip(&fitted).map(|(c, w)| w * c[i]).sum::<f64>();
            let whole = rms(&(0..raw[0].len()).map(|i| mixed(&raw, i)).collect::<Vec<f64>>());
            // A negative friction, or a term of the order of the base torque itself, is no explanation.
            let absurd = (family.positive && fitted[0] < 0.0) || (whole > 0.4 * base_nm && family.kind != OWN);
            let left = if absurd { energy } else { (0..y.len()).map(|i| (y[i] - mixed(&columns, i)).powi(2)).sum() };
            let entry = least.entry(family.kind.to_owned()).or_insert(energy);
            *entry = entry.min(left);
        }
        least
    }

    /// What a little of `piece` leaves out.
    fn column(&self, piece: &Piece) -> Vec<f64> {
        let hidden = Hidden {
            kind: String::new(),
            shape: String::new(),
            library_shape: true,
            pieces: vec![(piece.clone(), small(piece, &self.plan))],
        };
        joined(&self.truth(&[(&hidden, 1.0)]))
    }
}

/// What was left out, all recordings in a row.
fn joined(truths: &[Truth]) -> Vec<f64> {
    truths.iter().flat_map(|t| t.left_out.iter().copied()).collect()
}

/// A weight small enough for a linear response and large enough for its digits.
fn small(piece: &Piece, plan: &Plan) -> f64 {
    match piece {
        Piece::AngleDeflection { .. } | Piece::Clearance { .. } | Piece::Play => 1e-6,
        Piece::Delay | Piece::Lag | Piece::Skew => plan.period_s,
        Piece::WarmFriction { .. } | Piece::WarmStiffness { .. } => 1e-4,
        _ => 1.0,
    }
}

/// How many free parameters a truth made of `pieces` has: its weights and what was tuned.
fn parameters(pieces: &[(Piece, f64)]) -> usize {
    pieces
        .iter()
        .map(|(piece, _)| match piece {
            Piece::AngleDeflection { sine, .. } | Piece::AngleTorque { sine, .. } => 1 + usize::from(*sine),
            Piece::AngleFriction { sine, .. } => 1 + 2 * usize::from(*sine),
            Piece::Stribeck { .. } => 3,
            Piece::Friction { .. } | Piece::LoadFriction { .. } | Piece::Windup { .. } => 2,
            Piece::Stop { .. } | Piece::Creep { .. } => 2,
            Piece::Wear { .. } => 3,
            Piece::Outside(_) => 3,
            _ => 1,
        })
        .sum()
}

/// The orders of the motor turn that `pieces` hold.
fn orders(pieces: &[(Piece, f64)]) -> Vec<f64> {
    pieces
        .iter()
        .filter_map(|(piece, _)| match *piece {
            Piece::AngleDeflection { order, sine: true, .. } | Piece::AngleTorque { order, sine: true, .. } => {
                Some(order)
            }
            _ => None,
        })
        .collect()
}
