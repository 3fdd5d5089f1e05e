//! Straight lines by least squares.

use crate::baselines::{Baseline, Direction};
use crate::numerics::bounded::Bound::Free;

/// T = k·θ.
pub fn spring() -> Baseline {
    Baseline::new("linear spring", &[("k", Free)], |_| Box::new(|theta, out| out[0] = theta))
}

/// One line a direction.
pub fn two() -> Baseline {
    Baseline::new(crate::baselines::TWO_LINES, &[("k up", Free), ("k down", Free), ("gap", Free)], |_| {
        let mut direction = Direction::default();
        Box::new(move |theta, out| {
            direction.step(theta);
            out[0] = if direction.sign > 0.0 { theta } else { 0.0 };
            out[1] = if direction.sign > 0.0 { 0.0 } else { theta };
            out[2] = direction.sign;
        })
    })
}

/// One line a direction and sign of the deflection, not joined.
pub fn four() -> Baseline {
    let columns = ["k up +", "k up −", "k down +", "k down −", "level up +", "level up −", "level down +"];
    Baseline::new("four lines", &columns.map(|name| (name, Free)), |_| {
        let mut direction = Direction::default();
        Box::new(move |theta, out| {
            direction.step(theta);
            out.fill(0.0);
            let which = 2 * usize::from(direction.sign <= 0.0) + usize::from(theta < 0.0);
            out[which] = theta;
            // The offset of the recording is the level of the fourth line.
            if which < 3 {
                out[4 + which] = 1.0;
            }
        })
    })
}
