//! What a law can add to the elastic torque, whatever the path, and how far two laws can be apart.
//!
//! | law | parts of the largest abs(z)/T_A |
//! |---|---|
//! | `masing` | e/2 (abs(u·g) ≤ 1/2), h (abs(η) ≤ 1) |
//! | `phase` | 3·abs(q), 2·abs(s): the steady state, and a transient that each reversal feeds by 2·q·g |
//! | `time` | 1.5·abs(level)/forgotten and 3·abs(increment) of the steps, the same of periods that vary (abs(u) ≤ 1.5) |
//!
//! Each part is proportional to a coefficient. Two laws of one form that differ in their coefficients alone are apart by the differences of the parts. Where they differ in
//! A, in what they forget or in their play, too, their paths have other shapes: then the smaller of each part counts as well, at most twice.

use crate::block::record::double;
use crate::block::{Block, MASING, PHASE, TIME, Word};
use crate::elastic::LARGEST_KNEE;
use crate::params::Kernel;

/// The hysteresis of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hysteresis {
    /// The law, its kernel and its gate.
    form: [u32; 3],
    /// N·m.
    parts_nm: [f64; 3],
    rated_deflection_rad: f64,
    /// ρ of law `phase`, what law `time` forgets a period.
    rate: f64,
    /// Half of it, over A.
    play: f64,
}

impl Hysteresis {
    /// That of the one law of a block; `None` where there is none, more than one, or a word out of its range.
    pub(super) fn of<S: Word>(block: &Block<'_>, rated_deflection_rad: f64, torque_scale_nm: f64) -> Option<Self> {
        let number = |word| S::of_word(word).unwrap_or(S::ZERO).to_f64();
        let mut laws = [&MASING, &PHASE, &TIME].into_iter().filter(|info| !matches!(block.only(info), Ok(None)));
        let tag = laws.next()?.tag;
        if laws.next().is_some() {
            return None;
        }
        let mut rate = 0.0;
        let mut play = 0.0;
        let (form, parts) = if tag == MASING.tag {
            let [e, h, half_play] = block.words::<S, 3>(&MASING).ok()?.map(number);
            play = half_play / if S::SI { rated_deflection_rad } else { 1.0 };
            ([0, 0], [0.5 * e, h, 0.0])
        } else if tag == PHASE.tag {
            let [gate, law @ ..] = block.words::<S, 4>(&PHASE).ok()?;
            let [quadrature, in_phase, rho] = law.map(number);
            rate = rho;
            ([0, gate], [3.0 * quadrature, 2.0 * in_phase, 0.0])
        } else {
            let [kernel, gate, g0, g1, b0, b1, step @ ..] = block.words::<S, 14>(&TIME).ok()?;
            let [f0, f1, l0, l1, i0, i1, _, _] = step;
            let value = |words| S::gain_of_words(words).map(|(_, value)| value);
            let (forgotten, level, increment) = (value([f0, f1])?, value([l0, l1])?, value([i0, i1])?);
            let [gain, beta] = [[g0, g1], [b0, b1]].map(double);
            rate = forgotten;
            // What forgets nothing may grow for ever: any difference is too large.
            let steady = |level: f64, forgotten: f64| LARGEST_KNEE * level / forgotten.max(f64::MIN_POSITIVE);
            let both_ways = 2.0 * LARGEST_KNEE;
            let varying = if kernel == Kernel::Rate as u32 { both_ways * gain } else { steady(gain, beta) };
            ([kernel, gate], [steady(level, forgotten), both_ways * increment, varying])
        };
        let [kernel, gate] = form;
        let parts_nm = parts.map(|part| part * torque_scale_nm);
        Some(Self { form: [u32::from(tag), kernel, gate], parts_nm, rated_deflection_rad, rate, play })
    }

    /// A bound of the difference between the hysteresis torques of two gears on the same path, N·m.
    pub(super) fn largest_difference_nm(&self, other: &Self) -> f64 {
        let pairs = || self.parts_nm.into_iter().zip(other.parts_nm);
        if self.form != other.form {
            return pairs().map(|(a, b)| libm::fabs(a) + libm::fabs(b)).sum();
        }
        let by_size: f64 = pairs().map(|(a, b)| libm::fabs(a - b)).sum();
        let shared: f64 = pairs().map(|(a, b)| libm::fabs(a).min(libm::fabs(b))).sum();
        let scale = apart(self.rated_deflection_rad, other.rated_deflection_rad);
        // A branch s·(2 − s) up to s = 2 and its anchor move by 4·dA/A each, the gate near ±A by √(2·dA/A); a play moves both ends of a branch of slope 2.
        let shape = 8.0 * scale
            + 2.0 * libm::sqrt(2.0 * scale)
            + 2.0 * apart(self.rate, other.rate)
            + 8.0 * libm::fabs(self.play - other.play);
        by_size + shape.min(2.0) * shared
    }
}

/// How far two sizes are apart, as a share of the larger.
fn apart(a: f64, b: f64) -> f64 {
    let larger = a.max(b);
    if larger > 0.0 { 1.0 - a.min(b) / larger } else { 0.0 }
}
