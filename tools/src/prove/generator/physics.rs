//! The generator's own equations of what can be hidden: one [`Piece`] each, every weight multiplying one response.

use super::motion::{Motion, Plan, derivative, second_derivative};
use crate::model::TorqueSide;
use crate::prove::generator::plant_model::{PlantModel, stop};

/// A smoothed sign of the velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sign {
    /// tanh(v/w).
    Tanh,
    /// (2/π)·atan(πv/2w).
    Atan,
    /// v/√(v² + w²).
    Root,
    /// v/w, clipped to ±1.
    Clip,
    /// Dahl's presliding, as in the LuGre model: dz = dx − z·abs(dx)/x_s, with x_s = w · 0.1 s of travel.
    Dahl,
}

/// The knee of a soft windup, as a function of x = θ/w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knee {
    /// tanh x.
    Tanh,
    /// x/(1 + x²).
    Rational,
    /// x·e^(−x²/2).
    Gaussian,
    /// (2/π)·atan(πx/2).
    Atan,
    /// x clipped to ±1: one kink of a piecewise linear stiffness.
    Clip,
}

/// Which angle something turns with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Angle {
    /// Motor side, q_m.
    Motor,
    /// Output side, q_o.
    Output,
}

/// Physics of no list: what an open world may hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outside {
    /// T += w·sin(k·q_m)·T/T_max: ripple that only a loaded gear shows, with the sign of the load.
    LoadedRipple { order: f64 },
    /// A dead spot: T −= w·(θ/A)·e^(−(1 − cos(q_o − a))/s²).
    DeadSpot { angle: f64, width: f64 },
    /// Hysteresis wider on one side: T += w·d·max(0, θ/A)·(1 − θ/A).
    OneSidedLoop,
    /// T += w·(s³ − 0.6·s), s = 2t/t_end − 1: a drift of third order, its linear part taken out.
    CubicDrift,
    /// A structural resonance met at one speed: T += w·e^(−((abs(v) − v_r)/s)²)·sin(k·q_m).
    Notch { velocity: f64, width: f64, order: f64 },
    /// Interference in one stretch of the recording: T += w·sin(2πft) between two times.
    Burst { frequency: f64, start: f64, end: f64 },
    /// A detent that depends on the twist: T += w·sin(2πθ/p).
    Detent { pitch: f64 },
    /// Friction that differs between speeding up and slowing down: T += w·tanh(v/v_s)·tanh(v̇/a_s).
    Jerky { velocity: f64, acceleration: f64 },
}

/// One response that a weight multiplies. Lengths in SI units, weights in the unit that the kind's main parameter has.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// θ_measured += w·cos(k·q) or w·sin(k·q).
    AngleDeflection { angle: Angle, order: f64, sine: bool },
    /// Clearance: θ_measured += w·sgn(T), the gap crossed within `contact_nm`.
    Clearance { contact_nm: f64 },
    /// Play of half-width w between the measured and the true deflection.
    Play,
    /// T += w·cos(k·q) or w·sin(k·q).
    AngleTorque { angle: Angle, order: f64, sine: bool },
    /// T += σ·w·sgn v.
    Friction { sign: Sign, width: f64 },
    /// T += σ·w·e^(−abs(v/v_s)^δ)·sgn v, or w/(1 + (v/v_s)²)·sgn v where `exponent` is 0.
    Stribeck { sign: Sign, width: f64, velocity: f64, exponent: f64 },
    /// T += σ·w·v.
    Viscous,
    /// T += σ·w·abs(T_base)·sgn v.
    LoadFriction { sign: Sign, width: f64 },
    /// T += σ·w·cos(k·q)·sgn v, or sin.
    AngleFriction { angle: Angle, order: f64, sine: bool, sign: Sign, width: f64 },
    /// T += w·θ̇.
    Rate,
    /// T += σ·w·v̇.
    Acceleration,
    /// T −= w·width·knee(θ/width).
    Windup { knee: Knee, width: f64 },
    /// T += w·θ².
    Square,
    /// T += w·abs(θ).
    Abs,
    /// T += w·stop_r\[θ\].
    Stop { radius: f64 },
    /// T += w·abs(θ/A)·stop_r\[θ\].
    LoadedStop { radius: f64 },
    /// θ_measured += w·q̇_o: the output angle is read later than the motor angle.
    Skew,
    /// T += w·∫ e^(−((t−s)/τ)^p) θ̇ ds.
    Creep { tau: f64, exponent: f64 },
    /// T ← T(t − w).
    Delay,
    /// T ← T through a first-order lag of time constant w.
    Lag,
    /// T −= w·c1·θ·(Θ − Θ_0).
    WarmStiffness { reference: f64 },
    /// T += w·(Θ − Θ_0).
    WarmZero { reference: f64 },
    /// Friction of the base × e^(−w(Θ − Θ_0)).
    WarmFriction { reference: f64 },
    /// T += w·t.
    Time,
    /// T −= w·θ·s(t): s rises from 0 to 1 between `start` and `start + duration`, as a ramp or a sigmoid.
    Wear { start: f64, duration: f64, sigmoid: bool },
    /// Physics of no list.
    Outside(Outside),
}

/// Everything a piece may depend on, free of noise.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Sample period, s.
    pub period_s: f64,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// The deflection that the measurement would show without faults, rad.
    pub planned: Vec<f64>,
    /// The deflection the gear has, rad.
    pub theta: Vec<f64>,
    /// Deflections before the first row.
    pub history: Vec<f64>,
    /// q_m, rad.
    pub motor: Vec<f64>,
    /// q_o, rad.
    pub output: Vec<f64>,
    /// The velocity that friction answers to (MODEL.md section 7's v), rad/s.
    pub velocity: Vec<f64>,
    /// Its derivative, rad/s².
    pub acceleration: Vec<f64>,
    /// θ̇, rad/s.
    pub rate: Vec<f64>,
    /// T_base: f + z, or gravity and inertia of a joint.
    pub base: Vec<f64>,
    /// Friction that the base model has.
    pub friction: Vec<f64>,
    /// Temperature, °C.
    pub temperature: Option<Vec<f64>>,
    /// A, c1 and σ.
    pub rated: f64,
    /// c1, N·m/rad.
    pub c1: f64,
    /// σ = +1 for torque on the motor side.
    pub sigma: f64,
}

impl World {
    /// The world of one motion. `extra` is friction (Coulomb, smoothing, viscous) of a bench's base model; `play` the
    /// half-width of a play between planned and true deflection.
    pub fn new(
        plant_model: &PlantModel,
        plan: &Plan,
        motion: &Motion,
        side: TorqueSide,
        extra: Option<[f64; 3]>,
        play: f64,
    ) -> Self {
        let sigma = if side == TorqueSide::Motor { 1.0 } else { -1.0 };
        let planned = motion.deflection.clone();
        let theta: Vec<f64> = if play > 0.0 {
            let slipped = stop(play, &motion.history, &planned);
            planned.iter().zip(slipped).map(|(x, s)| x - s).collect()
        } else {
            planned.clone()
        };
        let output: Vec<f64> = motion.motor.iter().zip(&planned).map(|(m, x)| m / plan.ratio - x).collect();
        let moving: Vec<f64> = match side {
            TorqueSide::Motor => motion.motor.iter().map(|m| m / plan.ratio).collect(),
            TorqueSide::Output => output.clone(),
        };
        let velocity = derivative(&moving, plan.period_s);
        let acceleration = second_derivative(&moving, plan.period_s);
        let mut world = Self {
            period_s: plan.period_s,
            time_s: motion.time_s.clone(),
            rate: derivative(&theta, plan.period_s),
            history: motion.history.clone(),
            motor: motion.motor.clone(),
            temperature: motion.temperature.clone(),
            rated: plan.rated,
            sigma,
            planned,
            theta,
            output,
            velocity,
            acceleration,
            ..Self::default()
        };
        let rows = world.time_s.len();
        match plant_model {
            PlantModel::Bench(gear) => {
                world.c1 = gear.elastic[0];
                world.base = gear.torque(&world.history, &world.theta);
                world.friction = extra.map_or(vec![0.0; rows], |[coulomb, smoothing, viscous]| {
                    world.velocity.iter().map(|v| sigma * (coulomb * (v / smoothing).tanh() + viscous * v)).collect()
                });
            }
            PlantModel::Joint(joint) => {
                let columns = joint.columns(&world.output, &world.velocity, &world.acceleration);
                let sum = |range: std::ops::Range<usize>| -> Vec<f64> {
                    (0..rows).map(|i| range.clone().map(|k| joint.weights()[k] * columns[k][i]).sum()).collect()
                };
                (world.base, world.friction) = (sum(0..3), sum(3..5));
            }
        }
        world
    }

    fn sign(&self, sign: Sign, width: f64) -> Vec<f64> {
        let smooth = |f: fn(f64) -> f64| self.velocity.iter().map(|v| f(v / width)).collect();
        match sign {
            Sign::Tanh => smooth(f64::tanh),
            Sign::Atan => smooth(|x| (x * std::f64::consts::FRAC_PI_2).atan() / std::f64::consts::FRAC_PI_2),
            Sign::Root => smooth(|x| x / (1.0 + x * x).sqrt()),
            Sign::Clip => smooth(|x| x.clamp(-1.0, 1.0)),
            Sign::Dahl => {
                let mut z = 0.0;
                self.velocity
                    .iter()
                    .map(|v| {
                        let travel = (v * self.period_s / (0.1 * width)).abs();
                        z = v.signum() + (z - v.signum()) * (-travel).exp();
                        z
                    })
                    .collect()
            }
        }
    }

    pub fn wave(&self, angle: Angle, order: f64, sine: bool) -> Vec<f64> {
        let q = if angle == Angle::Motor { &self.motor } else { &self.output };
        q.iter().map(|q| if sine { (order * q).sin() } else { (order * q).cos() }).collect()
    }

    fn warmth(&self, reference: f64) -> Vec<f64> {
        self.temperature.as_ref().map_or(vec![0.0; self.time_s.len()], |t| t.iter().map(|t| t - reference).collect())
    }

    /// What `piece` with weight `w` adds to the torque, N·m; nothing for pieces that act on the deflection.
    pub fn torque(&self, piece: &Piece, w: f64) -> Option<Vec<f64>> {
        let scaled = |x: Vec<f64>, k: f64| x.into_iter().map(|x| k * x).collect::<Vec<f64>>();
        let times = |x: &[f64], y: &[f64], k: f64| x.iter().zip(y).map(|(x, y)| k * x * y).collect::<Vec<f64>>();
        let of_theta = |f: &dyn Fn(f64) -> f64| self.theta.iter().map(|&x| w * f(x)).collect::<Vec<f64>>();
        let s = self.sigma;
        Some(match *piece {
            Piece::AngleDeflection { .. } | Piece::Clearance { .. } | Piece::Play | Piece::Skew => return None,
            Piece::AngleTorque { angle, order, sine } => scaled(self.wave(angle, order, sine), w),
            Piece::Friction { sign, width } => scaled(self.sign(sign, width), s * w),
            Piece::Stribeck { sign, width, velocity, exponent } => {
                let bump = self.velocity.iter().map(|v| {
                    let x = (v / velocity).abs();
                    if exponent > 0.0 { (-x.powf(exponent)).exp() } else { 1.0 / (1.0 + x * x) }
                });
                times(&bump.collect::<Vec<f64>>(), &self.sign(sign, width), s * w)
            }
            Piece::Viscous => scaled(self.velocity.clone(), s * w),
            Piece::LoadFriction { sign, width } => {
                let load: Vec<f64> = self.base.iter().map(|t| t.abs()).collect();
                times(&load, &self.sign(sign, width), s * w)
            }
            Piece::AngleFriction { angle, order, sine, sign, width } => {
                times(&self.wave(angle, order, sine), &self.sign(sign, width), s * w)
            }
            Piece::Rate => scaled(self.rate.clone(), w),
            Piece::Acceleration => scaled(self.acceleration.clone(), s * w),
            Piece::Windup { knee, width } => of_theta(&|x| {
                let x = x / width;
                -width
                    * match knee {
                        Knee::Tanh => x.tanh(),
                        Knee::Rational => x / (1.0 + x * x),
                        Knee::Gaussian => x * (-0.5 * x * x).exp(),
                        Knee::Atan => (x * std::f64::consts::FRAC_PI_2).atan() / std::f64::consts::FRAC_PI_2,
                        Knee::Clip => x.clamp(-1.0, 1.0),
                    }
            }),
            Piece::Square => of_theta(&|x| x * x),
            Piece::Abs => of_theta(&f64::abs),
            Piece::Stop { radius } => scaled(stop(radius, &self.history, &self.theta), w),
            Piece::LoadedStop { radius } => {
                let load: Vec<f64> = self.theta.iter().map(|x| (x / self.rated).abs()).collect();
                times(&load, &stop(radius, &self.history, &self.theta), w)
            }
            Piece::Creep { tau, exponent } => scaled(self.creep(tau, exponent), w),
            Piece::Delay => self.delayed(w),
            Piece::Lag => {
                let keep = if w > 0.0 { (-self.period_s / w).exp() } else { 0.0 };
                let mut slow = self.base[0] + self.friction[0];
                self.base
                    .iter()
                    .zip(&self.friction)
                    .map(|(b, f)| {
                        slow = (b + f) + keep * (slow - (b + f));
                        slow - (b + f)
                    })
                    .collect()
            }
            Piece::WarmStiffness { reference } => times(&self.theta, &self.warmth(reference), -w * self.c1),
            Piece::WarmZero { reference } => scaled(self.warmth(reference), w),
            Piece::WarmFriction { reference } => {
                self.warmth(reference).iter().zip(&self.friction).map(|(t, f)| f * ((-w * t).exp() - 1.0)).collect()
            }
            Piece::Time => scaled(self.time_s.clone(), w),
            Piece::Wear { start, duration, sigmoid } => (self.time_s.iter().zip(&self.theta))
                .map(|(t, x)| {
                    let s = (t - start) / duration;
                    let s = if sigmoid { 1.0 / (1.0 + (-8.0 * (s - 0.5)).exp()) } else { s.clamp(0.0, 1.0) };
                    -w * x * s
                })
                .collect(),
            Piece::Outside(outside) => scaled(self.outside(outside), w),
        })
    }

    /// What `piece` with weight `w` adds to the measured deflection, rad.
    pub fn deflection(&self, piece: &Piece, w: f64) -> Option<Vec<f64>> {
        match *piece {
            Piece::AngleDeflection { angle, order, sine } => {
                Some(self.wave(angle, order, sine).into_iter().map(|x| w * x).collect())
            }
            Piece::Skew => Some(derivative(&self.output, self.period_s).into_iter().map(|v| w * v).collect()),
            Piece::Clearance { contact_nm } => Some(self.base.iter().map(|t| w * (t / contact_nm).tanh()).collect()),
            _ => None,
        }
    }

    /// ∫ e^(−((t−s)/τ)^p) θ̇ ds: a recursion for p = 1, the convolution itself otherwise.
    fn creep(&self, tau: f64, exponent: f64) -> Vec<f64> {
        let steps: Vec<f64> = self.theta.windows(2).map(|w| w[1] - w[0]).collect();
        let mut memory = vec![0.0; self.theta.len()];
        if exponent == 1.0 {
            let keep = (-self.period_s / tau).exp();
            let within = (1.0 - keep) * tau / self.period_s;
            for (i, step) in steps.iter().enumerate() {
                memory[i + 1] = keep * memory[i] + within * step;
            }
            return memory;
        }
        let kernel: Vec<f64> =
            (0..memory.len()).map(|i| (-((i as f64 + 0.5) * self.period_s / tau).powf(exponent)).exp()).collect();
        for (i, m) in memory.iter_mut().enumerate() {
            *m = steps[..i].iter().rev().zip(&kernel).map(|(s, k)| s * k).sum();
        }
        memory
    }

    /// T(t − δ) − T(t) of the base, by linear interpolation.
    fn delayed(&self, delay_s: f64) -> Vec<f64> {
        let total: Vec<f64> = self.base.iter().zip(&self.friction).map(|(b, f)| b + f).collect();
        (0..total.len())
            .map(|i| {
                let x = (i as f64 - delay_s / self.period_s).clamp(0.0, total.len() as f64 - 1.0);
                let (k, part) = (x.floor() as usize, x.fract());
                let next = total[(k + 1).min(total.len() - 1)];
                total[k] + part * (next - total[k]) - total[i]
            })
            .collect()
    }

    fn outside(&self, outside: Outside) -> Vec<f64> {
        let end = self.time_s[self.time_s.len() - 1];
        let largest = self.base.iter().fold(1e-9_f64, |m, t| m.max(t.abs()));
        (0..self.time_s.len())
            .map(|i| {
                let (t, x, v) = (self.time_s[i], self.theta[i] / self.rated.max(1e-12), self.velocity[i]);
                match outside {
                    Outside::LoadedRipple { order } => (order * self.motor[i]).sin() * self.base[i] / largest,
                    Outside::DeadSpot { angle, width } => {
                        -x * (-(1.0 - (self.output[i] - angle).cos()) / (width * width)).exp()
                    }
                    Outside::OneSidedLoop => self.rate[i].signum() * x.max(0.0) * (1.0 - x),
                    Outside::CubicDrift => {
                        let s = 2.0 * t / end - 1.0;
                        s.powi(3) - 0.6 * s
                    }
                    Outside::Notch { velocity, width, order } => {
                        (-((v.abs() - velocity) / width).powi(2)).exp() * (order * self.motor[i]).sin()
                    }
                    Outside::Burst { frequency, start, end } => {
                        if (start..end).contains(&t) {
                            (std::f64::consts::TAU * frequency * t).sin()
                        } else {
                            0.0
                        }
                    }
                    Outside::Detent { pitch } => (std::f64::consts::TAU * x / pitch).sin(),
                    Outside::Jerky { velocity, acceleration } => {
                        (v / velocity).tanh() * (self.acceleration[i] / acceleration).tanh()
                    }
                }
            })
            .collect()
    }
}
