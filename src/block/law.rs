//! The laws as records.

use heapless::Vec;

use super::Word;
use super::error::BlockError;
use super::layout::{MASING, PHASE, RecordInfo, TIME};
use super::record::{Block, double, double_words};
use crate::inverse::Invertible;
use crate::memory::AnyLaw;
use crate::memory::masing::Masing;
use crate::memory::phase::Phase;
use crate::memory::time::{Rates, Time};
use crate::params::{Gate, Kernel, Params};
use crate::scalar::Float;

/// The words of a law: a slice of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawWords(Vec<u32, 14>);

impl core::ops::Deref for LawWords {
    type Target = [u32];

    fn deref(&self) -> &[u32] {
        &self.0
    }
}

/// A law that blocks can hold.
pub trait BlockLaw<S: Word>: Invertible<S> {
    /// The law of a block, each of its words within its range.
    ///
    /// # Errors
    /// [`BlockError`]: none, two, or another than this.
    fn of_block(block: &Block<'_>) -> Result<Self, BlockError>;

    /// Its record and its words; `params` are what it was made of.
    fn record(&self, params: &Params) -> (&'static RecordInfo, LawWords);
}

/// The record of the one law of a block.
fn only_law(block: &Block<'_>) -> Result<&'static RecordInfo, BlockError> {
    let mut found = None;
    for info in [&MASING, &PHASE, &TIME] {
        if block.only(info)?.is_some() && found.replace(info).is_some() {
            return Err(BlockError::Twice(info.tag));
        }
    }
    found.ok_or(BlockError::Missing(MASING.tag))
}

/// Checks each word of the law of a block against its range.
pub(super) fn check_law<S: Word>(block: &Block<'_>) -> Result<(), BlockError> {
    let info = only_law(block)?;
    let record = block.only(info)?.ok_or(BlockError::Missing(info.tag))?;
    record.check::<S>(info)
}

/// Refuses a block of another law than the one that the caller computes.
fn expect(block: &Block<'_>, info: &'static RecordInfo) -> Result<(), BlockError> {
    let found = only_law(block)?;
    if found.tag == info.tag { Ok(()) } else { Err(BlockError::Unknown(found.tag)) }
}

/// A number whose range was checked; 0 for what is none.
pub(super) fn number<S: Word>(word: u32) -> S {
    S::of_word(word).unwrap_or(S::ZERO)
}

pub(super) fn kernel_of(number: u32) -> Kernel {
    if number == Kernel::Rate as u32 { Kernel::Rate } else { Kernel::Deflection }
}

pub(super) fn gate_of(number: u32) -> Gate {
    if number == Gate::None as u32 { Gate::None } else { Gate::Cycle }
}

fn law_words<const N: usize>(words: [u32; N]) -> LawWords {
    // There is room: no law has more words.
    LawWords(words.into_iter().collect())
}

impl<S: Word> BlockLaw<S> for Masing<S> {
    fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        expect(block, &MASING)?;
        let [e, h, half_play] = block.words::<S, 3>(&MASING)?.map(number);
        Ok(Self { e, h, half_play })
    }

    fn record(&self, _params: &Params) -> (&'static RecordInfo, LawWords) {
        (&MASING, law_words([self.e, self.h, self.half_play].map(S::word)))
    }
}

impl<S: Word + Float> BlockLaw<S> for Phase<S> {
    fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        expect(block, &PHASE)?;
        let [gate, quadrature, in_phase, rho] = block.words::<S, 4>(&PHASE)?;
        let [quadrature, in_phase, rho] = [quadrature, in_phase, rho].map(number);
        Ok(Self { quadrature, in_phase, rho, gate: gate_of(gate) })
    }

    fn record(&self, _params: &Params) -> (&'static RecordInfo, LawWords) {
        let [quadrature, in_phase, rho] = [self.quadrature, self.in_phase, self.rho].map(S::word);
        (&PHASE, law_words([self.gate as u32, quadrature, in_phase, rho]))
    }
}

impl<S: Word> BlockLaw<S> for Time<S> {
    fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        expect(block, &TIME)?;
        let [kernel, gate, g0, g1, b0, b1, f0, f1, l0, l1, i0, i1, bound, _] = block.words::<S, 14>(&TIME)?;
        let step = |words| S::gain_of_words(words).map(|(gain, _)| gain).ok_or(BlockError::Malformed(TIME.tag));
        let step = [step([f0, f1])?, step([l0, l1])?, step([i0, i1])?];
        let rates = Rates { kernel: kernel_of(kernel), gain: double([g0, g1]), beta_per_s: double([b0, b1]) };
        let law = Self::of(rates, gate_of(gate), step, number(bound));
        // A NaN compares false.
        Ok(if block.header().period_s > 0.0 { law } else { law.without_period() })
    }

    fn record(&self, params: &Params) -> (&'static RecordInfo, LawWords) {
        let Rates { kernel, gain, beta_per_s } = Rates::new(params);
        let [[g0, g1], [b0, b1]] = [gain, beta_per_s].map(double_words);
        let (step, bound) = self.coefficients();
        let [[f0, f1], [l0, l1], [i0, i1]] = step.map(S::gain_words);
        let [bound, growth] = bound.map(S::word);
        let gate = self.gate() as u32;
        (&TIME, law_words([kernel as u32, gate, g0, g1, b0, b1, f0, f1, l0, l1, i0, i1, bound, growth]))
    }
}

impl<S: Word + Float> BlockLaw<S> for AnyLaw<S> {
    fn of_block(block: &Block<'_>) -> Result<Self, BlockError> {
        Ok(match only_law(block)?.tag {
            tag if tag == PHASE.tag => Self::Phase(Phase::of_block(block)?),
            tag if tag == TIME.tag => Self::Time(Time::of_block(block)?),
            _ => Self::Masing(Masing::of_block(block)?),
        })
    }

    fn record(&self, params: &Params) -> (&'static RecordInfo, LawWords) {
        match self {
            Self::Masing(law) => law.record(params),
            Self::Phase(law) => law.record(params),
            Self::Time(law) => law.record(params),
        }
    }
}
