//! Golden samples: what a gear gives along a fixed path, stored by the host and computed anew by the drive at load.
//!
//! A checksum shows that the bytes of a block are those that were written. The samples show that compiler, arithmetic and memory of the drive compute with
//! them what the host computed.

use super::Word;
use super::law::BlockLaw;
use crate::gear::Gear;
use crate::inverse::Inverse;

/// The deflections of the path, over A, one step each from a start at 0.
pub const PATH: [f64; 8] = [0.5, 0.75, 0.0, -0.625, -0.125, 0.5, -0.375, 0.25];

/// Words of the samples: a torque for each deflection, and the deflection of the inverse.
pub const SAMPLES: usize = PATH.len() + 1;

/// The words that a gear gives: T at each deflection of [`PATH`], then the deflection for half of the last torque, 0 without an inverse.
pub fn samples<S: Word, L: BlockLaw<S>>(gear: &Gear<S, L>, inverse: Option<&Inverse<S, L>>) -> [u32; SAMPLES] {
    // As many turning points as a drive remembers, so that both share their code.
    let mut state = gear.start::<16>(S::ZERO);
    let mut words = [0; SAMPLES];
    let mut torque = S::ZERO;
    let [a, b, c, d, e, f, g, h] = PATH;
    // One by one, each is a constant of the scalar, and nothing is computed in double precision.
    let path = [
        S::from_f64(a),
        S::from_f64(b),
        S::from_f64(c),
        S::from_f64(d),
        S::from_f64(e),
        S::from_f64(f),
        S::from_f64(g),
        S::from_f64(h),
    ];
    for (word, u) in words.iter_mut().zip(path) {
        torque = gear.step(&mut state, gear.frame().deflection(u)).torque;
        *word = torque.word();
    }
    let solution = inverse.map_or(S::ZERO, |inverse| inverse.peek(&state, S::HALF * torque).theta);
    if let Some(last) = words.last_mut() {
        *last = solution.word();
    }
    words
}

/// Whether this arithmetic is the one whose samples are stored: `micromath` computes other functions.
pub(super) const IS_COMPARED: bool = !cfg!(feature = "micromath");
