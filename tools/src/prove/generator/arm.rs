//! A joint of an arm as its drive records it: how it moves, and what a rigid-body simulation says of that motion.

use std::f64::consts::{PI, TAU};

use super::rng::Rng;

/// How the joint is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A sum of sines.
    Sines,
    /// Moves from pose to pose, of fifth order, with pauses.
    Moves,
    /// Constant speeds forth and back, with rounded ramps.
    Cruise,
}

/// A joint of an arm whose other joints may move too.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Gravity, N·m: T += c·cos q + s·sin q.
    pub gravity: [f64; 2],
    /// J, kg·m².
    pub inertia: f64,
    /// Rms of the torque that the other joints' motion puts on this one, N·m.
    pub coupling_nm: f64,
    /// Reduction ratio.
    pub ratio: f64,
    /// Largest output speed, rad/s.
    pub speed: f64,
    /// Largest excursion about the middle, rad.
    pub range: f64,
    /// The middle of the motion, rad.
    pub middle: f64,
}

/// One motion of the joint, free of noise, with the rigid-body torque along it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Path {
    /// Sample period, s.
    pub period_s: f64,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// q_o, rad.
    pub angle: Vec<f64>,
    /// Its rate, rad/s.
    pub velocity: Vec<f64>,
    /// Its acceleration, rad/s².
    pub acceleration: Vec<f64>,
    /// Torque of the rigid body, N·m.
    pub rigid_nm: Vec<f64>,
}

impl Arm {
    /// A joint of a collaborative or small industrial robot.
    pub fn draw(rng: &mut Rng) -> Self {
        let size = rng.log_uniform(3.0, 60.0);
        let speed = rng.uniform(0.4, 2.0);
        Self {
            gravity: [size * rng.uniform(-1.0, 1.0), size * rng.uniform(-1.0, 1.0)],
            inertia: size * rng.uniform(0.03, 0.15),
            coupling_nm: size * rng.uniform(0.15, 0.4),
            ratio: rng.pick(&[50.0, 80.0, 100.0, 100.0, 120.0, 160.0]),
            range: (speed * rng.uniform(0.7, 1.6)).min(2.4),
            speed,
            middle: rng.uniform(-1.5, 1.5),
        }
    }

    /// One motion in `style`, of `rows` rows.
    pub fn path(&self, rng: &mut Rng, style: Style, rows: usize, period_s: f64) -> Path {
        let time_s: Vec<f64> = (0..rows).map(|i| i as f64 * period_s).collect();
        let end = rows as f64 * period_s;
        let [angle, velocity, acceleration] = match style {
            Style::Sines => self.sines(rng, &time_s),
            Style::Moves => self.moves(rng, &time_s, end),
            Style::Cruise => self.cruise(rng, &time_s, period_s),
        };
        let others: Vec<[f64; 3]> =
            (0..3).map(|_| [TAU * rng.log_uniform(0.08, 0.9), rng.phase(), rng.uniform(0.4, 1.0)]).collect();
        let norm = others.iter().map(|o| 0.5 * o[2] * o[2]).sum::<f64>().sqrt();
        let coupling =
            |t: f64| self.coupling_nm / norm * others.iter().map(|[w, p, a]| a * (w * t + p).sin()).sum::<f64>();
        let rigid_nm = (0..rows)
            .map(|i| {
                let q = angle[i];
                self.gravity[0] * q.cos()
                    + self.gravity[1] * q.sin()
                    + self.inertia * acceleration[i]
                    + coupling(time_s[i])
            })
            .collect();
        Path { period_s, time_s, angle, velocity, acceleration, rigid_nm }
    }

    fn sines(&self, rng: &mut Rng, time_s: &[f64]) -> [Vec<f64>; 3] {
        let count = rng.pick(&[2, 3, 5]);
        let parts: Vec<[f64; 3]> = (0..count)
            .map(|k| {
                let w = TAU * rng.log_uniform(0.08, 0.25) * (1.0 + 0.8 * f64::from(k));
                [w, rng.phase(), rng.uniform(0.4, 1.0) / w]
            })
            .collect();
        let sum = |f: &dyn Fn(&[f64; 3], f64) -> f64, t: f64| parts.iter().map(|p| f(p, t)).sum::<f64>();
        let fastest =
            time_s.iter().map(|&t| sum(&|[w, p, a], t| a * w * (w * t + p).cos(), t).abs()).fold(1e-9_f64, f64::max);
        let k = self.speed / fastest;
        [
            time_s.iter().map(|&t| self.middle + k * sum(&|[w, p, a], t| a * (w * t + p).sin(), t)).collect(),
            time_s.iter().map(|&t| k * sum(&|[w, p, a], t| a * w * (w * t + p).cos(), t)).collect(),
            time_s.iter().map(|&t| -k * sum(&|[w, p, a], t| a * w * w * (w * t + p).sin(), t)).collect(),
        ]
    }

    fn moves(&self, rng: &mut Rng, time_s: &[f64], end: f64) -> [Vec<f64>; 3] {
        let (mut t, mut q) = (rng.uniform(0.2, 0.6), self.middle);
        let mut moves = vec![[0.0, q, q, 1.0]];
        while t < end {
            let mut to: f64 = self.middle + self.range * rng.uniform(-1.0, 1.0);
            if (to - q).abs() < 0.3 * self.range {
                to = self.middle - self.range * (q - self.middle).signum() * rng.uniform(0.3, 1.0);
            }
            // The speed of a fifth-order move peaks at 1.875 times its mean.
            let length = 1.875 * (to - q).abs() / (self.speed * rng.uniform(0.25, 1.0));
            moves.push([t, q, to, length]);
            (q, t) = (to, t + length + rng.uniform(0.05, 0.5));
        }
        let mut path = [Vec::new(), Vec::new(), Vec::new()];
        for &t in time_s {
            let [start, from, to, length] = moves[moves.partition_point(|m| m[0] <= t) - 1];
            let (s, d) = (((t - start) / length).clamp(0.0, 1.0), to - from);
            path[0].push(from + d * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s));
            path[1].push(d / length * 30.0 * (s * (1.0 - s)).powi(2));
            path[2].push(d / length.powi(2) * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s));
        }
        path
    }

    /// Speeds held between reversals, each ramp half a cosine of the speed; turned round before the range is left.
    fn cruise(&self, rng: &mut Rng, time_s: &[f64], period_s: f64) -> [Vec<f64>; 3] {
        let mut path = [Vec::new(), Vec::new(), Vec::new()];
        let (mut q, mut from, mut to, mut start, mut ramp) = (self.middle, 0.0, 0.0, 0.0, 0.2);
        let (mut turn_at, mut before) = (0.0, 0.0);
        for &t in time_s {
            if t >= turn_at {
                let away = if q > self.middle { -1.0 } else { 1.0 };
                let speed = self.speed * rng.log_uniform(0.12, 1.0);
                (from, to, start, ramp) = (to, away * speed, t, rng.uniform(0.15, 0.5));
                let travel = (self.middle + away * self.range * rng.uniform(0.5, 1.0) - q).abs();
                turn_at = t + ramp + (travel / speed).min(4.0);
            }
            let s = ((t - start) / ramp).clamp(0.0, 1.0);
            let velocity = from + (to - from) * 0.5 * (1.0 - (PI * s).cos());
            let inside = s < 1.0;
            // By trapezia: a sum of past speeds would lag half a row behind velocity and acceleration, a delay that no key knows.
            q += 0.5 * (before + velocity) * period_s;
            before = velocity;
            path[0].push(q);
            path[1].push(velocity);
            path[2].push(if inside { (to - from) * 0.5 * PI / ramp * (PI * s).sin() } else { 0.0 });
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_of_a_cruise_lags_neither_its_velocity_nor_its_acceleration() {
        let mut rng = Rng::new(3);
        let arm = Arm::draw(&mut rng);
        let (rows, period_s) = (3000, 0.008);
        let path = arm.path(&mut rng, Style::Cruise, rows, period_s);
        let inner = 1..rows - 1;
        let slope = |row: usize| (path.angle[row + 1] - path.angle[row - 1]) / (2.0 * period_s);
        // What a velocity older or younger by half a row would differ by, as a share of the acceleration.
        let lag = |row: usize| (path.velocity[row] - slope(row), path.acceleration[row]);
        let (along, squares) =
            inner.map(lag).fold((0.0, 0.0), |(along, squares), (off, a)| (along + off * a, squares + a * a));
        assert!((along / squares).abs() < 0.01 * period_s, "{} rows", along / squares / period_s);
    }
}
