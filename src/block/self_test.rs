//! Golden samples: what a gear gives along a fixed path, stored by the host and computed anew by the drive at load.
//!
//! A checksum shows that the bytes of a block are those that were written. The samples show that compiler, arithmetic and memory of the drive compute with
//! them what the host computed.

use super::Word;
use super::law::BlockLaw;
use crate::gear::{Gear, State};
use crate::inverse::Inverse;

/// The deflections of the path, over A, one step each from a start at 0.
pub const PATH: [f64; 8] = [0.5, 0.75, 0.0, -0.625, -0.125, 0.5, -0.375, 0.25];

/// Words of the samples: a torque for each deflection, and the deflection of the inverse.
pub const SAMPLES: usize = PATH.len() + 1;

/// The words that a gear gives: T at each deflection of [`PATH`], then the deflection for half of the last torque, 0 without an inverse.
pub fn samples<S: Word, L: BlockLaw<S>>(gear: &Gear<S, L>, inverse: Option<&Inverse<S, L>>) -> [u32; SAMPLES] {
    let mut words = [0; SAMPLES];
    words.iter_mut().zip(Samples::new(gear, inverse)).for_each(|(to, word)| *to = word);
    words
}

/// The same words one by one, for a loop over what is stored: as many turns as there are words, each the same code.
pub(super) struct Samples<'a, S: Word, L: BlockLaw<S>> {
    gear: &'a Gear<S, L>,
    inverse: Option<&'a Inverse<S, L>>,
    // As many turning points as a drive remembers, so that both share their code.
    state: State<S, 16, L>,
    path: [S; PATH.len()],
    at: usize,
    torque: S,
}

impl<'a, S: Word, L: BlockLaw<S>> Samples<'a, S, L> {
    #[inline]
    pub(super) fn new(gear: &'a Gear<S, L>, inverse: Option<&'a Inverse<S, L>>) -> Self {
        // Each is a constant of the scalar, and nothing is computed in double precision.
        let path = PATH.map(S::from_f64);
        Self { gear, inverse, state: gear.start(S::ZERO), path, at: 0, torque: S::ZERO }
    }
}

impl<S: Word, L: BlockLaw<S>> Iterator for Samples<'_, S, L> {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        let sample = match self.path.get(self.at) {
            Some(u) => {
                self.torque = self.gear.step(&mut self.state, self.gear.frame().deflection(*u)).torque;
                self.torque
            }
            None => self.inverse.map_or(S::ZERO, |inverse| inverse.peek(&self.state, S::HALF * self.torque).theta),
        };
        self.at += 1;
        Some(sample.word())
    }
}

/// Whether this arithmetic is the one whose samples are stored: `micromath` computes other functions.
pub(super) const IS_COMPARED: bool = !cfg!(feature = "micromath");
