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

use crate::block::joint::single;
use crate::block::prepared::words;
use crate::block::{Block, MASING, PHASE, Record, ScalarKind, TIME};
use crate::params::Kernel;

/// No deflection counts beyond so many times the rated one.
const LARGEST_KNEE: f32 = crate::elastic::LARGEST_KNEE as f32;

/// The hysteresis of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hysteresis {
    /// The law, its kernel and its gate.
    form: [u32; 3],
    /// N·m.
    parts_nm: [f32; 3],
    rated_deflection_rad: f32,
    /// ρ of law `phase`, what law `time` forgets a period.
    rate: f32,
    /// Half of it, over A.
    play: f32,
}

impl Hysteresis {
    /// That of the one law of a block; `None` where there is none, more than one, or a record of another length.
    pub(super) fn of(block: &Block<'_>, rated_deflection_rad: f32, torque_scale_nm: f32) -> Option<Self> {
        let kind = block.header().scalar;
        let number = |word| kind.number(word);
        let of_law = |record: &Record<'_>| [MASING.tag, PHASE.tag, TIME.tag].contains(&record.tag);
        let mut laws = block.records().filter(of_law);
        let tag = laws.next()?.tag;
        if laws.next().is_some() {
            return None;
        }
        let mut rate = 0.0;
        let mut play = 0.0;
        let (form, parts) = if tag == MASING.tag {
            let [e, h, half_play] = words::<3>(block, tag).ok()?.map(number);
            play = half_play / if kind == ScalarKind::F32 { rated_deflection_rad } else { 1.0 };
            ([0, 0], [0.5 * e, h, 0.0])
        } else if tag == PHASE.tag {
            let [gate, law @ ..] = words::<4>(block, tag).ok()?;
            let [quadrature, in_phase, rho] = law.map(number);
            rate = rho;
            ([0, gate], [3.0 * quadrature, 2.0 * in_phase, 0.0])
        } else {
            let [kernel, gate, g0, g1, b0, b1, f0, f1, l0, l1, i0, i1, _, _] = words::<14>(block, tag).ok()?;
            let [forgotten, level, increment] = [[f0, f1], [l0, l1], [i0, i1]].map(|words| kind.gain(words));
            let [gain, beta] = [[g0, g1], [b0, b1]].map(single);
            rate = forgotten;
            // What forgets nothing may grow for ever: any difference is too large.
            let steady = |level: f32, forgotten: f32| LARGEST_KNEE * level / forgotten.max(f32::MIN_POSITIVE);
            let both_ways = 2.0 * LARGEST_KNEE;
            let varying = if kernel == Kernel::Rate as u32 { both_ways * gain } else { steady(gain, beta) };
            ([kernel, gate], [steady(level, forgotten), both_ways * increment, varying])
        };
        let [kernel, gate] = form;
        let parts_nm = parts.map(|part| part * torque_scale_nm);
        Some(Self { form: [u32::from(tag), kernel, gate], parts_nm, rated_deflection_rad, rate, play })
    }

    /// A bound of the difference between the hysteresis torques of two gears on the same path, N·m.
    pub(super) fn largest_difference_nm(&self, other: &Self) -> f32 {
        let is_same = self.form == other.form;
        let (mut by_size, mut shared) = (0.0, 0.0);
        for (a, b) in self.parts_nm.into_iter().zip(other.parts_nm) {
            let [size, other_size] = [a, b].map(f32::abs);
            by_size += if is_same { libm::fabsf(a - b) } else { size + other_size };
            shared += size.min(other_size);
        }
        if !is_same {
            return by_size;
        }
        let scale = apart(self.rated_deflection_rad, other.rated_deflection_rad);
        // A branch s·(2 − s) up to s = 2 and its anchor move by 4·dA/A each, the gate near ±A by √(2·dA/A); a play moves both ends of a branch of slope 2.
        let shape = 8.0 * scale
            + 2.0 * libm::sqrtf(2.0 * scale)
            + 2.0 * apart(self.rate, other.rate)
            + 8.0 * libm::fabsf(self.play - other.play);
        by_size + shape.min(2.0) * shared
    }
}

/// How far two sizes are apart, as a share of the larger; NaN where one is.
fn apart(a: f32, b: f32) -> f32 {
    let difference = libm::fabsf(a - b);
    if difference == 0.0 { 0.0 } else { difference / libm::fabsf(a).max(libm::fabsf(b)) }
}
