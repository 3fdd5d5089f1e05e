//! Law `masing` by its definition (MODEL.md section 3): initial curve, branches, a list of turning points.

use crate::Constants;

/// The tracker of turning points.
#[derive(Debug, Clone)]
pub struct Masing {
    gear: Constants,
    capacity: usize,
    play: f64,
    start: f64,
    /// θ_f behind the input play, and y there.
    last: (f64, f64),
    direction: f64,
    turning: Vec<(f64, f64)>,
    /// Where the branch was entered; what merging left over fades from here on.
    entry: (f64, f64),
    /// Pairs were merged and the stack has not been empty since.
    healing: bool,
    /// Pairs given up so far.
    pub merged_pairs: u32,
}

impl Masing {
    /// A gear at θ_0 with y = 0 and room for `capacity` turning points (even, 4 or more).
    pub fn new(gear: Constants, capacity: usize, play: f64, theta_0: f64) -> Self {
        let last = (theta_0, 0.0);
        let (direction, turning, healing, merged_pairs) = (0.0, Vec::new(), false, 0);
        Self { gear, capacity, play, start: theta_0, last, direction, turning, entry: last, healing, merged_pairs }
    }

    /// T = f(θ) − e·θ·g(θ) + y after a move to θ, N·m.
    pub fn step(&mut self, theta: f64) -> f64 {
        let followed = self.last.0.max(theta - self.play / 2.0).min(theta + self.play / 2.0);
        if followed != self.last.0 {
            self.advance(followed);
        }
        self.gear.elastic(theta) - self.gear.e() * theta * self.gear.gate(theta) + self.last.1
    }

    /// Turning points on the stack.
    pub fn depth(&self) -> usize {
        self.turning.len()
    }

    fn advance(&mut self, theta: f64) {
        let direction = (theta - self.last.0).signum();
        if self.direction != 0.0 && direction != self.direction {
            self.reverse();
        }
        self.direction = direction;
        while let [.., target, _] = self.turning[..] {
            if direction * (theta - target.0) < 0.0 {
                break;
            }
            self.turning.truncate(self.turning.len() - 2);
            self.entry = target;
        }
        if self.turning.len() < 2 {
            self.turning.clear();
            self.healing = false;
        }
        self.last = (theta, self.loop_torque(theta));
    }

    fn reverse(&mut self) {
        let (theta, y) = self.last;
        if self.turning.is_empty() {
            self.turning.push((2.0 * self.start - theta, -y));
        } else if self.turning.len() == self.capacity {
            self.turning.truncate(self.capacity - 2);
            self.healing = true;
            self.merged_pairs += 1;
        }
        self.turning.push(self.last);
        self.entry = self.last;
    }

    fn loop_torque(&self, theta: f64) -> f64 {
        let [.., target, newest] = self.turning[..] else {
            return self.direction * self.initial((theta - self.start).abs());
        };
        let curve = |at: f64| newest.1 + self.direction * self.branch((at - newest.0).abs());
        if !self.healing {
            return curve(theta);
        }
        let part = (theta - self.entry.0).abs() / (target.0 - self.entry.0).abs();
        curve(theta) + (self.entry.1 - curve(self.entry.0)) * (1.0 - part) + (target.1 - curve(target.0)) * part
    }

    /// I(δ), the initial curve.
    fn initial(&self, delta: f64) -> f64 {
        let Constants { a, .. } = self.gear;
        if delta > a { 0.0 } else { 2.0 * self.gear.h() * delta * (1.0 - delta / a) }
    }

    /// F(δ), a branch.
    fn branch(&self, delta: f64) -> f64 {
        let Constants { a, .. } = self.gear;
        if delta > 2.0 * a { 0.0 } else { self.gear.h() * delta * (2.0 - delta / a) }
    }
}
