//! The gear itself, without hidden effects: elastic torque, hysteresis, or the inertia, gravity and friction of a joint.
//!
//! The hysteresis is a Preisach memory kept as the profile of a continuum of play operators, exact for any path: another
//! route to the same loop than turning points, and no code in common with them.

use super::rng::Rng;
use crate::model::{GearSection, Model, Term, TermValue, TorqueSide};

/// Which gear a case is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlantKind {
    /// A plant of the base model's structure.
    Gmhm,
    /// A gear of Maxwell-slip sliders.
    Maxwell,
    /// A gear of sliders whose torque grows with the load: its loop is a butterfly.
    Butterfly,
    /// A joint log.
    Joint,
    /// A joint log beside a rigid-body simulation.
    Arm,
    /// A joint log whose base has gravity and inertia only.
    ArmTerms,
}

/// The profile r ↦ play_r\[θ\] for 0 ≤ r ≤ `radius_max`, piecewise linear between its corners.
#[derive(Debug, Clone)]
pub struct PlayProfile {
    radius_max: f64,
    /// Corners (r, play), r increasing from 0 to `radius_max`.
    corners: Vec<[f64; 2]>,
}

impl PlayProfile {
    /// The virgin memory at deflection 0.
    pub fn new(radius_max: f64) -> Self {
        Self { radius_max, corners: vec![[0.0, 0.0], [radius_max, 0.0]] }
    }

    /// Moves the input to `x`: play_r ← clamp(play_r, x − r, x + r) for every r.
    pub fn advance(&mut self, x: f64) {
        // Up to the radius r* where the old profile lies within x ± r, the new one is the cone x ± r itself: the profile
        // is 1-Lipschitz, so that region is an interval from 0.
        let up = x >= self.corners[0][1];
        let edge = |r: f64| if up { x - r } else { x + r };
        let outside = |c: &[f64; 2]| if up { c[1] < edge(c[0]) } else { c[1] > edge(c[0]) };
        let Some(inside) = self.corners.iter().position(|c| !outside(c)) else {
            self.corners = vec![[0.0, x], [self.radius_max, edge(self.radius_max)]];
            return;
        };
        if inside == 0 {
            return;
        }
        let ([r0, p0], [r1, p1]) = (self.corners[inside - 1], self.corners[inside]);
        let (gap0, gap1) = (edge(r0) - p0, edge(r1) - p1);
        let r = r0 + (r1 - r0) * gap0 / (gap0 - gap1);
        self.corners.splice(..inside, [[0.0, x], [r, edge(r)]]);
    }

    /// ∫ stop_r\[θ\] dr over the profile, stop_r = θ − play_r.
    pub fn stop_integral(&self) -> f64 {
        let x = self.corners[0][1];
        self.corners.windows(2).map(|w| (w[1][0] - w[0][0]) * (x - 0.5 * (w[0][1] + w[1][1]))).sum()
    }
}

/// What a gear's memory is made of.
#[derive(Debug, Clone, PartialEq)]
pub enum Hysteresis {
    /// The loop of the genetic-memory model, ±hA(1 − θ²/A²), continued to any path by a uniform Preisach density; and its
    /// single-valued part −e·θ·√(1 − θ²/A²).
    Uniform {
        /// h, N·m/rad.
        h: f64,
        /// e, N·m/rad.
        e: f64,
    },
    /// Maxwell slip: springs `stiffness` in series with sliders that give way at `radius`. No single-valued part.
    MaxwellSlip {
        /// Slip radii, rad.
        radius: Vec<f64>,
        /// Stiffnesses at θ = ±A, N·m/rad.
        stiffness: Vec<f64>,
        /// λ1 and λ2 of the factor 1 − λ1 − λ2 + λ1·abs(θ/A) + λ2·(θ/A)²; zeros where the load does nothing.
        load: [f64; 2],
    },
}

/// A gear on a bench.
#[derive(Debug, Clone, PartialEq)]
pub struct Gear {
    /// Rated deflection A, rad.
    pub rated: f64,
    /// c1, c2, c3.
    pub elastic: [f64; 3],
    /// Its memory.
    pub hysteresis: Hysteresis,
}

impl Gear {
    /// A gear near those of catalogues: 15–60 N·m at 0.6–2 mrad, loop width and waist as drawn.
    pub fn draw(rng: &mut Rng, kind: PlantKind, loud: bool) -> Self {
        let rated = rng.uniform(0.6e-3, 2.0e-3);
        let torque = rng.log_uniform(15.0, 60.0);
        let (cubic, quintic) = (rng.uniform(0.02, 0.15), rng.uniform(-0.03, 0.03));
        let linear = 1.0 - cubic - quintic;
        let k = torque / rated;
        let elastic = [k * linear, k * cubic / rated.powi(2), k * quintic / rated.powi(4)];
        let width = rng.uniform(0.03, 0.12);
        let hysteresis = if matches!(kind, PlantKind::Maxwell | PlantKind::Butterfly) {
            let count = if loud { 24 } else { rng.pick(&[5_usize, 9, 24, 24]) };
            let many = count == 24;
            let radius: Vec<f64> = (0..count)
                .map(|i| {
                    let place = (i as f64 + rng.uniform(0.6, 1.0)) / count as f64;
                    // Slip from the first hundredth of the deflection on makes corners that no uniform density has.
                    rated * if many { 0.4 * 0.01_f64.powf(1.0 - place) } else { 0.9 * place.powf(1.6) }
                })
                .collect();
            let weight: Vec<f64> = (0..count).map(|_| rng.uniform(0.3, 1.0)).collect();
            let spread: f64 = radius.iter().zip(&weight).map(|(r, w)| r * w).sum();
            let width = if many { rng.uniform(0.2, 0.45) } else { width };
            let load = match kind {
                PlantKind::Butterfly => [rng.uniform(0.0, 0.4), rng.uniform(0.3, 0.6)],
                _ => [0.0; 2],
            };
            let stiffness = weight.iter().map(|w| w * width * torque / spread).collect();
            Hysteresis::MaxwellSlip { stiffness, radius, load }
        } else {
            Hysteresis::Uniform { h: width * k, e: rng.uniform(0.0, 0.2) * k }
        };
        Self { rated, elastic, hysteresis }
    }

    /// The columns that the torque along `path` is linear in: θ, θ³, θ⁵, the loop per h, the waist per e. `history` is
    /// travelled before the first row.
    pub fn columns(&self, history: &[f64], path: &[f64]) -> [Vec<f64>; 5] {
        let a = self.rated;
        let mut profile = PlayProfile::new(a);
        history.iter().for_each(|&x| profile.advance(x));
        let loop_shape = path
            .iter()
            .map(|&x| {
                profile.advance(x);
                4.0 / a * profile.stop_integral() - 2.0 * x
            })
            .collect();
        let waist = path.iter().map(|&x| -x * (1.0 - (x / a).powi(2)).max(0.0).sqrt()).collect();
        let power = |n| path.iter().map(|x: &f64| x.powi(n)).collect();
        [power(1), power(3), power(5), loop_shape, waist]
    }

    /// The torque along `path` after `history`.
    pub fn torque(&self, history: &[f64], path: &[f64]) -> Vec<f64> {
        let columns = self.columns(history, path);
        let mut weights = [self.elastic[0], self.elastic[1], self.elastic[2], 0.0, 0.0];
        if let Hysteresis::Uniform { h, e } = self.hysteresis {
            weights[3..].copy_from_slice(&[h, e]);
        }
        let mut torque: Vec<f64> =
            (0..path.len()).map(|i| columns.iter().zip(weights).map(|(c, w)| w * c[i]).sum()).collect();
        if let Hysteresis::MaxwellSlip { radius, stiffness, load: [linear, square] } = &self.hysteresis {
            for (&r, &k) in radius.iter().zip(stiffness) {
                let slip = stop(r, history, path);
                torque.iter_mut().zip(path.iter().zip(&slip)).for_each(|(t, (x, s))| {
                    let u = (x / self.rated).abs();
                    *t += k * (1.0 - linear - square + linear * u + square * u * u) * s;
                });
            }
        }
        torque
    }
}

/// The stop operator of radius `r` along `path`, after `history` from rest.
pub fn stop(r: f64, history: &[f64], path: &[f64]) -> Vec<f64> {
    let mut play = 0.0_f64;
    history.iter().for_each(|&x| play = play.clamp(x - r, x + r));
    path.iter()
        .map(|&x| {
            play = play.clamp(x - r, x + r);
            x - play
        })
        .collect()
}

/// A joint seen from its motor: gravity, inertia and friction.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Gravity torque cos and sin parts, N·m: T += c·cos q + s·sin q.
    pub gravity: [f64; 2],
    /// J, kg·m².
    pub inertia: f64,
    /// F_c, N·m.
    pub coulomb: f64,
    /// Smoothing velocity of the Coulomb friction, rad/s.
    pub smoothing: f64,
    /// B, N·m·s/rad.
    pub viscous: f64,
}

impl Joint {
    /// A joint of a small robot arm.
    pub fn draw(rng: &mut Rng) -> Self {
        Self {
            gravity: [rng.uniform(-15.0, 15.0), rng.uniform(-15.0, 15.0)],
            inertia: rng.uniform(0.5, 4.0),
            coulomb: rng.uniform(2.0, 8.0),
            smoothing: rng.log_uniform(2e-3, 8e-3),
            viscous: rng.uniform(2.0, 12.0),
        }
    }

    /// The columns of gravity cos, gravity sin, inertia, Coulomb and viscous friction.
    pub fn columns(&self, angle: &[f64], velocity: &[f64], acceleration: &[f64]) -> [Vec<f64>; 5] {
        [
            angle.iter().map(|q| q.cos()).collect(),
            angle.iter().map(|q| q.sin()).collect(),
            acceleration.to_vec(),
            velocity.iter().map(|v| (v / self.smoothing).tanh()).collect(),
            velocity.to_vec(),
        ]
    }

    /// The weights of those columns.
    pub fn weights(&self) -> [f64; 5] {
        [self.gravity[0], self.gravity[1], self.inertia, self.coulomb, self.viscous]
    }
}

/// What a case is about: a gear on a bench, or a joint log.
#[derive(Debug, Clone, PartialEq)]
pub enum PlantModel {
    /// Torque against twist.
    Bench(Gear),
    /// No motor-side angle: only the joint's own terms.
    Joint(Joint),
}

impl PlantModel {
    /// The model file for base coefficients `weights` (c1, c2, c3, h, e; or the joint's five), and `extra` friction
    /// (Coulomb, smoothing, viscous) on a bench.
    ///
    /// The file holds α, β, ω; only h = αω/(β²+ω²) and e = αβ/(β²+ω²) matter, so ω is free and set to 200 1/s.
    pub fn model(&self, weights: &[f64], extra: Option<[f64; 3]>, ratio: f64, side: TorqueSide, play: f64) -> Model {
        let term = |kind: &str, values: &[(&str, f64)]| Term {
            kind: kind.to_owned(),
            values: values.iter().map(|(k, v)| ((*k).to_owned(), TermValue::Number(*v))).collect(),
        };
        let mut model = Model {
            name: "concealed case".to_owned(),
            gear: GearSection {
                ratio: Some(ratio),
                torque_side: side,
                rated_deflection_rad: None,
                ..GearSection::default()
            },
            ..Model::default()
        };
        match self {
            Self::Bench(gear) => {
                let (h, e) = (weights[3].max(1e-3 * weights[0].abs()), weights[4].max(0.0));
                let omega = 200.0;
                let beta = e / h * omega;
                model.gear.rated_deflection_rad = Some(gear.rated);
                model.elastic = Some(gmhm::Elastic {
                    c1_nm_per_rad: weights[0],
                    c2_nm_per_rad3: weights[1],
                    c3_nm_per_rad5: weights[2],
                });
                model.memory = Some(gmhm::Memory {
                    law: gmhm::Law::Masing,
                    kernel: gmhm::Kernel::Deflection,
                    gate: gmhm::Gate::Cycle,
                    alpha: h * (beta * beta + omega * omega) / omega,
                    beta_per_s: beta,
                    omega_per_s: omega,
                    reversal_play_rad: play,
                });
                if let Some([coulomb, smoothing, viscous]) = extra {
                    model
                        .terms
                        .push(term("coulomb_friction", &[("torque_nm", coulomb), ("smoothing_rad_per_s", smoothing)]));
                    model.terms.push(term("viscous_friction", &[("damping_nms_per_rad", viscous)]));
                }
            }
            Self::Joint(joint) => {
                // G sin(q + φ) = G sin φ · cos q + G cos φ · sin q: the file's cos and sin parts are these two.
                model.terms = vec![
                    term("gravity_load", &[("cos_nm", weights[0]), ("sin_nm", weights[1])]),
                    term("inertia", &[("inertia_kgm2", weights[2])]),
                    term("coulomb_friction", &[("torque_nm", weights[3]), ("smoothing_rad_per_s", joint.smoothing)]),
                    term("viscous_friction", &[("damping_nms_per_rad", weights[4])]),
                ];
            }
        }
        model
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_agrees_with_many_single_plays() {
        let mut rng = Rng::new(7);
        let (a, count) = (1.0, 4000);
        let mut profile = PlayProfile::new(a);
        let mut plays = vec![0.0_f64; count];
        for _ in 0..300 {
            let x = rng.uniform(-1.0, 1.0);
            profile.advance(x);
            let mut sum = 0.0;
            for (i, p) in plays.iter_mut().enumerate() {
                let r = a * (i as f64 + 0.5) / count as f64;
                *p = p.clamp(x - r, x + r);
                sum += (x - *p) * a / count as f64;
            }
            assert!((profile.stop_integral() - sum).abs() < 1e-6, "{} {sum}", profile.stop_integral());
        }
    }

    #[test]
    fn the_rated_cycle_is_the_published_loop() {
        let gear = Gear { rated: 2.0, elastic: [0.0; 3], hysteresis: Hysteresis::Uniform { h: 3.0, e: 0.0 } };
        let path: Vec<f64> = (0..=40).map(|i| -2.0 + 0.1 * f64::from(i)).collect();
        for (theta, torque) in path.iter().zip(gear.torque(&[0.0, 2.0], &path)) {
            assert!((torque - 3.0 * 2.0 * (1.0 - theta * theta / 4.0)).abs() < 1e-12);
        }
    }
}
