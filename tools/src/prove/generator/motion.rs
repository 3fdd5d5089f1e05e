//! What the bench or the joint did: deflection, angles and temperature against time, free of noise.

use std::f64::consts::{PI, TAU};

use crate::prove::generator::rng::Rng;

/// The experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionKind {
    /// Input locked: load cycles of several amplitudes and rates, minor loops among them.
    LockedCycles,
    /// The motor runs forth and back, the brake load varies slowly.
    Running,
    /// Input locked, band-limited random load.
    BandLimited,
    /// The motor runs, band-limited random load.
    RunningBandLimited,
    /// A joint log: position moves and excitation sums of sines, no motor-side angle.
    Joint,
}

impl MotionKind {
    /// Does the motor turn?
    pub fn turns(self) -> bool {
        matches!(self, Self::Running | Self::RunningBandLimited | Self::Joint)
    }
}

/// How the temperature went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warmth {
    /// Not recorded, and constant.
    Absent,
    /// Warming up by `rise` kelvin with time constant `tau_s`.
    WarmUp { rise: f64, tau_s: f64 },
    /// Swinging by ±`rise` with `period_s`.
    Swing { rise: f64, period_s: f64 },
    /// Following time, nearly a line: a decoy for anything slow.
    Ramp { rise: f64 },
}

/// What is common to all recordings of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The experiment.
    pub kind: MotionKind,
    /// Sample period, s.
    pub period_s: f64,
    /// Rated deflection, rad.
    pub rated: f64,
    /// Reduction ratio N.
    pub ratio: f64,
    /// Amplitudes of the load cycles, as shares of the rated deflection; the first is the largest.
    pub amplitudes: Vec<f64>,
    /// Shortest and longest time of one stroke between turning points, s.
    pub stroke_s: [f64; 2],
    /// Upper end of a random load's band, Hz.
    pub band_hz: f64,
    /// Strokes at constant rate instead of half cosines.
    pub triangular: bool,
    /// Largest output-side speed, rad/s.
    pub speed: f64,
    /// Time between reversals of the motor, s; infinite for one direction only.
    pub reversal_s: f64,
    /// The temperature.
    pub warmth: Warmth,
    /// Recordings start after an unrecorded excursion instead of from a virgin gear.
    pub remanent: bool,
}

/// One noise-free motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Deflection, rad; zeros for a joint log.
    pub deflection: Vec<f64>,
    /// Deflections travelled before the first row.
    pub history: Vec<f64>,
    /// q_m, rad.
    pub motor: Vec<f64>,
    /// Temperature, °C.
    pub temperature: Option<Vec<f64>>,
}

impl Plan {
    /// A plan for `kind`.
    pub fn draw(rng: &mut Rng, kind: MotionKind, rated: f64, slow: bool) -> Self {
        let smallest = rng.uniform(0.25, 0.5);
        let rate = rng.log_uniform(0.15, 0.6);
        let reversal_s = if rng.chance(0.1) { f64::INFINITY } else { rng.uniform(2.5, 7.0) };
        let ratio = rng.pick(&[50.0, 80.0, 100.0, 100.0, 120.0, 160.0]) * if rng.chance(0.15) { -1.0 } else { 1.0 };
        let speed = match kind {
            MotionKind::Joint => rng.uniform(0.15, 0.5),
            _ => rng.log_uniform(5.0, 25.0) / f64::abs(ratio),
        };
        Self {
            kind,
            period_s: if slow || kind == MotionKind::Joint { 0.01 } else { rng.pick(&[0.005, 0.008, 0.01]) },
            rated,
            ratio,
            amplitudes: vec![rng.uniform(0.9, 0.97), rng.uniform(smallest, 0.85), smallest],
            stroke_s: [rate, rate * rng.uniform(2.0, 8.0)],
            band_hz: rng.uniform(1.0, 4.0),
            triangular: rng.chance(0.25),
            speed,
            reversal_s,
            warmth: match (rng.chance(0.35), rng.chance(0.6)) {
                (true, true) => Warmth::Ramp { rise: rng.uniform(2.0, 10.0) },
                (true, false) => Warmth::WarmUp { rise: rng.uniform(3.0, 12.0), tau_s: rng.uniform(8.0, 40.0) },
                _ => Warmth::Absent,
            },
            remanent: rng.chance(0.2),
        }
    }

    /// One motion of `rows` rows. `virgin` overrides an unrecorded history.
    pub fn motion(&self, rng: &mut Rng, rows: usize, virgin: bool) -> Motion {
        let time_s: Vec<f64> = (0..rows).map(|i| i as f64 * self.period_s).collect();
        let end = rows as f64 * self.period_s;
        let mut motion = Motion { temperature: self.temperature(rng, &time_s), ..Motion::default() };
        if self.remanent && !virgin && self.kind != MotionKind::Joint {
            let a = self.rated * rng.uniform(0.2, 0.8) * rng.sign();
            motion.history = vec![a, -0.4 * a, 0.0];
        }
        motion.deflection = match self.kind {
            MotionKind::LockedCycles | MotionKind::Running => self.strokes(rng, &time_s),
            MotionKind::BandLimited | MotionKind::RunningBandLimited => self.band(rng, &time_s),
            MotionKind::Joint => vec![0.0; rows],
        };
        motion.motor = match self.kind {
            MotionKind::LockedCycles | MotionKind::BandLimited => vec![rng.phase(); rows],
            MotionKind::Joint => self.joint(rng, &time_s, end).iter().map(|q| q * self.ratio).collect(),
            _ => self.run(rng, &time_s),
        };
        motion.time_s = time_s;
        motion
    }

    fn temperature(&self, rng: &mut Rng, time_s: &[f64]) -> Option<Vec<f64>> {
        let (start, phase, end) = (rng.uniform(19.0, 26.0), rng.phase(), time_s[time_s.len() - 1]);
        let profile: Box<dyn Fn(f64) -> f64> = match self.warmth {
            Warmth::Absent => return None,
            Warmth::WarmUp { rise, tau_s } => Box::new(move |t| rise * (1.0 - (-t / tau_s).exp())),
            Warmth::Swing { rise, period_s } => Box::new(move |t| rise * (TAU * t / period_s + phase).sin()),
            Warmth::Ramp { rise } => Box::new(move |t| rise * (t / end + 0.01 * (TAU * t / end + phase).sin())),
        };
        Some(time_s.iter().map(|&t| start + profile(t)).collect())
    }

    /// Load strokes between turning points: full cycles of every amplitude, then random ones and minor loops.
    fn strokes(&self, rng: &mut Rng, time_s: &[f64]) -> Vec<f64> {
        let mut queue: Vec<f64> = Vec::new();
        for (i, &a) in self.amplitudes.iter().enumerate() {
            for _ in 0..if i == 0 { 2 } else { 1 } {
                queue.extend([a, -a]);
            }
        }
        queue.reverse();
        let (mut from, mut to, mut start, mut length) = (0.0, queue.pop().unwrap_or(0.9), 0.0, self.stroke_s[1]);
        let mut path = Vec::with_capacity(time_s.len());
        for &t in time_s {
            while t > start + length {
                start += length;
                from = to;
                to = queue.pop().unwrap_or_else(|| {
                    let a = rng.pick(&self.amplitudes);
                    if rng.chance(0.3) { rng.uniform(-a, a) } else { -a * f64::signum(from) }
                });
                let span: f64 = f64::abs(to - from);
                length = rng.log_uniform(self.stroke_s[0], self.stroke_s[1]) * (0.3 + 0.7 * span);
            }
            let s = ((t - start) / length).clamp(0.0, 1.0);
            let s = if self.triangular { s } else { 0.5 - 0.5 * (PI * s).cos() };
            path.push(self.rated * (from + (to - from) * s));
        }
        path
    }

    /// A sum of sines with random phases, faded in, its largest value that of the first amplitude.
    fn band(&self, rng: &mut Rng, time_s: &[f64]) -> Vec<f64> {
        let top = self.band_hz;
        let parts: Vec<[f64; 3]> = (0..24)
            .map(|_| {
                let f = rng.log_uniform(0.06, top);
                [TAU * f, rng.phase(), rng.uniform(0.3, 1.0) / f.sqrt()]
            })
            .collect();
        let mut path: Vec<f64> = time_s
            .iter()
            .map(|&t| (1.0 - (-t / 0.5).exp()) * parts.iter().map(|[w, p, a]| a * (w * t + p).sin()).sum::<f64>())
            .collect();
        let peak = path.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        path.iter_mut().for_each(|x| *x *= self.amplitudes[0] * self.rated / peak);
        path
    }

    /// Motor angle: forth and back with smooth reversals at a speed that changes from run to run.
    fn run(&self, rng: &mut Rng, time_s: &[f64]) -> Vec<f64> {
        let mut angle = rng.phase();
        let (mut velocity, mut target, mut next, mut sign) = (0.0, 0.0, 0.0, rng.sign());
        let settle = (0.12_f64 / self.period_s).recip().min(1.0);
        time_s
            .iter()
            .map(|&t| {
                if t >= next {
                    let pause = if self.reversal_s.is_finite() { self.reversal_s } else { 6.0 };
                    next = t + pause * rng.uniform(0.6, 1.4);
                    if self.reversal_s.is_finite() {
                        sign = -sign;
                    }
                    target = sign * self.speed * self.ratio * rng.uniform(0.25, 1.0);
                }
                velocity += settle * (target - velocity);
                angle += velocity * self.period_s;
                angle
            })
            .collect()
    }

    /// Joint angle: a sum of a few sines, or moves from stop to stop.
    fn joint(&self, rng: &mut Rng, time_s: &[f64], end: f64) -> Vec<f64> {
        let middle = rng.uniform(-1.5, 1.5);
        if rng.chance(0.6) {
            let parts: Vec<[f64; 3]> = (0..rng.pick(&[1, 3, 5]))
                .map(|k| [TAU * rng.uniform(0.05, 0.2) * f64::from(1 + k / 2), rng.phase(), 0.0])
                .collect();
            let share = self.speed * 1.6 / parts.len() as f64;
            return time_s
                .iter()
                .map(|&t| middle + parts.iter().map(|[w, p, _]| share / w * (w * t + p).sin()).sum::<f64>())
                .collect();
        }
        let mut moves = vec![[0.0, 0.0, 0.0, 1.0]];
        let (mut t, mut q) = (rng.uniform(0.3, 1.0), 0.0);
        while t < end {
            let to: f64 = rng.uniform(-1.5, 1.5);
            // A raised-cosine velocity of mean half its peak.
            let length = (2.0 * f64::abs(to - q) / (self.speed * rng.uniform(0.5, 1.0))).max(0.5);
            moves.push([t, q, to, length]);
            q = to;
            t += length + rng.uniform(0.1, 0.6);
        }
        time_s
            .iter()
            .map(|&t| {
                let [start, from, to, length] = moves[moves.partition_point(|m| m[0] <= t) - 1];
                let s = ((t - start) / length).clamp(0.0, 1.0);
                middle + from + (to - from) * (s - (TAU * s).sin() / TAU)
            })
            .collect()
    }
}

/// Central differences of `x` at a sample period of `period_s`.
pub fn derivative(x: &[f64], period_s: f64) -> Vec<f64> {
    let last = x.len() - 1;
    (0..x.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (x[b] - x[a]) / ((b - a) as f64 * period_s)
        })
        .collect()
}

/// Central second differences.
pub fn second_derivative(x: &[f64], period_s: f64) -> Vec<f64> {
    let last = x.len() - 1;
    (0..x.len())
        .map(|i| {
            let i = i.clamp(1, last - 1);
            (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (period_s * period_s)
        })
        .collect()
}
