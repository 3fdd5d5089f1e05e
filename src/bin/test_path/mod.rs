//! A deflection path that leaves nothing out: strokes of all sizes, nested loops, stops, jumps, excursions beyond the rated
//! deflection, samples that are no numbers. Only sums, products and quotients of `f32`, so that it is the same everywhere.

/// The path.
pub struct TestPath {
    rated: f32,
    random: u32,
    theta: f32,
    step: f32,
    left: u32,
    /// Nested loops: the next stroke goes this far, to the other side.
    swing: f32,
}

impl TestPath {
    /// A path within a little more than ±rated.
    pub fn new(rated: f32) -> Self {
        Self { rated, random: 2_463_534_242, theta: 0.0, step: 0.0, left: 0, swing: 0.0 }
    }

    /// The next sample.
    pub fn next_deflection(&mut self) -> f32 {
        if self.left == 0 {
            self.choose();
        }
        self.left -= 1;
        self.theta += self.step;
        match self.below(1000) {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => 1e30,
            _ => self.theta,
        }
    }

    /// A factor between 0 and 4.
    pub fn uneven(&mut self) -> f32 {
        self.below(1000) as f32 * 0.004
    }

    fn choose(&mut self) {
        let target = if self.swing > 0.02 * self.rated || self.swing < -0.02 * self.rated {
            self.swing *= -0.875;
            self.swing
        } else {
            match self.below(8) {
                0 => self.theta,
                1 => {
                    self.swing = self.rated;
                    self.rated
                }
                2 => self.rated * 1.05,
                3 => self.rated * -1.05,
                _ => self.rated * (self.below(2001) as f32 * 0.001 - 1.0),
            }
        };
        let longest = 1 << self.below(8);
        self.left = 1 + self.below(longest);
        self.step = (target - self.theta) / self.left as f32;
    }

    /// A number below `bound`, by Marsaglia's 32-bit xorshift.
    fn below(&mut self, bound: u32) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random % bound.max(1)
    }
}
