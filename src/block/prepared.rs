//! What a drive computes with, word by word as the host has computed it: loaded without arithmetic in double precision and without the registry of fields.
//!
//! [`Parameters::load`](super::Parameters::load) sets a gear up from few numbers, in `f64`, and checks each against its range; the record `prepared` beside them
//! (law `masing`) or `prepared_gear` (laws `phase` and `time`) holds what comes of that. [`Prepared::load`] takes the words over: the same coefficients to the bit,
//! in a fraction of the flash, of the stack and of the time. CRC-32 and golden samples vouch for them.
//!
//! ```
//! use gmhm::block::{Header, Identity, Joint, Prepared, ScalarKind, Writer};
//! use gmhm::feedforward::{FeedForward, Limits};
//! use gmhm::memory::masing::Masing;
//! use gmhm::{Elastic, Inverse, Memory, Params};
//!
//! # let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! # let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! # let params = Params::new(1.168e-3, elastic, memory)?;
//! // On the host, as `gmhm pack` does:
//! let inverse = Inverse::<f32, _>::of(&params, Masing::new(&params), 0.0)?;
//! let mut buffer = [0; 512];
//! let mut writer = Writer::new(&mut buffer, Header::new(Identity::of_name("joint 3"), ScalarKind::F32));
//! writer.gear(inverse.gear(), &params)?;
//! writer.inverse::<f32>(&params, 0.0)?;
//! writer.self_test(inverse.gear(), Some(&inverse))?;
//! writer.prepared(&inverse)?;
//! writer.joint(&Joint::default())?;
//! let length = writer.finish()?;
//!
//! // On the drive:
//! let prepared = Prepared::<f32>::load(&buffer[..length], 16)?;
//! assert_eq!(prepared.inverse, inverse);
//! let limits = Limits { period_s: 1e-3, ramp_s: 0.5, ..Limits::default() };
//! let feed_forward = FeedForward::of_inverse(&prepared.inverse, &limits)?;
//! # let _ = feed_forward;
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

use super::Word;
use super::error::BlockError;
use super::header::Header;
use super::law::{BlockLaw, gate_of, kernel_of};
use super::layout::{MASING, PHASE, PREPARED, PREPARED_GEAR, RecordInfo, SELF_TEST, TIME};
use super::record::{Block, verify_first};
use super::self_test::{IS_COMPARED, SAMPLES, samples};
use crate::diagnostics::SelfTest;
use crate::gear::Gear;
use crate::inverse::Inverse;
use crate::inverse::words::{GEAR_WORDS, SEARCH_WORDS};
use crate::memory::AnyLaw;
use crate::memory::masing::Masing;
use crate::memory::phase::Phase;
use crate::memory::time::{Rates, Time};
use crate::scalar::Float;

/// The most words that a set-up takes.
pub(super) const MOST_WORDS: usize = GEAR_WORDS + 3 + SEARCH_WORDS;

/// A law whose set-up blocks can hold.
pub trait PreparedLaw<S: Word>: BlockLaw<S> {
    /// Gear and inverse of a block whose CRC-32 is in order.
    ///
    /// # Errors
    /// [`BlockError`]: another law, a record missing, twice or of another length, a word that is no number.
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError>;

    /// Hands out the words of such an inverse in the order of their record, and says which one it is.
    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo;
}

/// The words of a record, whatever they say.
fn words<const N: usize>(block: &Block<'_>, info: &RecordInfo) -> Result<[u32; N], BlockError> {
    let mut found = None;
    for record in block.records() {
        if record.tag == info.tag && found.replace(record).is_some() {
            return Err(BlockError::Twice(info.tag));
        }
    }
    let record = found.ok_or(BlockError::Missing(info.tag))?;
    if record.payload.len() != 4 * N {
        return Err(BlockError::Malformed(info.tag));
    }
    let mut words = [0; N];
    words.iter_mut().zip(record.words()).for_each(|(to, word)| *to = word);
    Ok(words)
}

/// Words as numbers.
fn numbers<S: Word, const N: usize>(words: &[u32], info: &RecordInfo) -> Result<[S; N], BlockError> {
    let mut numbers = [S::ZERO; N];
    for (to, word) in numbers.iter_mut().zip(words) {
        *to = S::of_word(*word).ok_or(BlockError::Malformed(info.tag))?;
    }
    Ok(numbers)
}

/// The words of laws `phase` and `time`: those of the gear, those of the search, gain and β.
type GearWords<S> = ([S; GEAR_WORDS], [S; SEARCH_WORDS], [S; 2]);

fn gear_words<S: Word>(block: &Block<'_>) -> Result<GearWords<S>, BlockError> {
    let words = words::<{ GEAR_WORDS + SEARCH_WORDS + 2 }>(block, &PREPARED_GEAR)?;
    let (gear, rest) = words.split_at(GEAR_WORDS);
    let (search, rates) = rest.split_at(SEARCH_WORDS);
    Ok((numbers(gear, &PREPARED_GEAR)?, numbers(search, &PREPARED_GEAR)?, numbers(rates, &PREPARED_GEAR)?))
}

fn put_gear_words<S: Word, L: BlockLaw<S>>(
    inverse: &Inverse<S, L>,
    rates: [S; 2],
    put: impl FnMut(S),
) -> &'static RecordInfo {
    inverse.gear_words().into_iter().chain(inverse.search_words()).chain(rates).for_each(put);
    &PREPARED_GEAR
}

impl<S: Word> PreparedLaw<S> for Masing<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let words = words::<MOST_WORDS>(block, &PREPARED)?;
        let (gear, rest) = words.split_at(GEAR_WORDS);
        let (law, search) = rest.split_at(3);
        let [e, h, half_play] = numbers(law, &PREPARED)?;
        let (gear, search) = (numbers(gear, &PREPARED)?, numbers(search, &PREPARED)?);
        Ok(Inverse::of_words(&gear, Self { e, h, half_play }, &search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        let Self { e, h, half_play } = *inverse.gear().law();
        inverse.gear_words().into_iter().chain([e, h, half_play]).chain(inverse.search_words()).for_each(put);
        &PREPARED
    }
}

impl<S: Word + Float> PreparedLaw<S> for Phase<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let [gate, law @ ..] = words::<4>(block, &PHASE)?;
        let [quadrature, in_phase, rho] = numbers(&law, &PHASE)?;
        let (gear, search, _) = gear_words(block)?;
        Ok(Inverse::of_words(&gear, Self { quadrature, in_phase, rho, gate: gate_of(gate) }, &search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        put_gear_words(inverse, [S::ZERO; 2], put)
    }
}

impl<S: Word> PreparedLaw<S> for Time<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let [kernel, gate, _, _, _, _, f0, f1, l0, l1, i0, i1, bound @ ..] = words::<14>(block, &TIME)?;
        let step = |words| S::gain_of_words(words).map(|(gain, _)| gain).ok_or(BlockError::Malformed(TIME.tag));
        let step = [step([f0, f1])?, step([l0, l1])?, step([i0, i1])?];
        let bound = numbers(&bound, &TIME)?;
        let (gear, search, [gain, beta_per_s]) = gear_words(block)?;
        let rates = Rates { kernel: kernel_of(kernel), gain, beta_per_s };
        Ok(Inverse::of_words(&gear, Self::of_rates(rates, gate_of(gate), step, bound), &search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        let law = inverse.gear().law();
        put_gear_words(inverse, [law.gain(), law.beta_per_s()], put)
    }
}

impl<S: Word + Float> PreparedLaw<S> for AnyLaw<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let has = |info: &RecordInfo| block.records().any(|record| record.tag == info.tag);
        if has(&MASING) {
            Masing::of_prepared(block).map(|inverse| inverse.with_law(Self::Masing(*inverse.gear().law())))
        } else if has(&PHASE) {
            Phase::of_prepared(block).map(|inverse| inverse.with_law(Self::Phase(*inverse.gear().law())))
        } else {
            Time::of_prepared(block).map(|inverse| inverse.with_law(Self::Time(*inverse.gear().law())))
        }
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        match *inverse.gear().law() {
            Self::Masing(law) => Masing::prepared_words(&inverse.with_law(law), put),
            Self::Phase(law) => Phase::prepared_words(&inverse.with_law(law), put),
            Self::Time(law) => Time::prepared_words(&inverse.with_law(law), put),
        }
    }
}

/// Gear and inverse, as the host has computed them; without another name those of law `masing`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prepared<S: Word = f32, L = Masing<S>> {
    /// The header of the block.
    pub header: Header,
    /// The CRC-32 of the block.
    pub crc: u32,
    /// The gear and its inverse.
    pub inverse: Inverse<S, L>,
    /// Whether the golden samples of the block were computed anew; one that differs refuses the block.
    pub self_test: SelfTest,
}

impl<S: Word, L: PreparedLaw<S>> Prepared<S, L> {
    /// Loads the block that these bytes begin with. `stack_depth` is how many turning points the caller has room for.
    ///
    /// # Errors
    /// [`BlockError`]: bytes that are no block, another scalar, another law, no record `prepared` or `prepared_gear`, a word that is no number, golden samples that come out
    /// otherwise.
    pub fn load(bytes: &[u8], stack_depth: usize) -> Result<Self, BlockError> {
        Self::of_block(&verify_first(bytes)?, stack_depth)
    }

    /// [`load`](Self::load) from a block that is verified.
    ///
    /// # Errors
    /// As there.
    pub fn of_block(block: &Block<'_>, stack_depth: usize) -> Result<Self, BlockError> {
        let header = *block.header();
        if header.scalar != S::KIND {
            return Err(BlockError::Scalar(header.scalar.bytes()));
        }
        if usize::from(header.stack_depth) > stack_depth {
            return Err(BlockError::StackDepth(header.stack_depth));
        }
        let inverse = L::of_prepared(block)?;
        let mut self_test = SelfTest::NotRun;
        let expected = block.records().find(|record| record.tag == SELF_TEST.tag);
        if let (Some(expected), true) = (expected, IS_COMPARED) {
            let found = samples(inverse.gear(), Some(&inverse));
            let mut differs = expected.payload.len() != 4 * SAMPLES;
            for (expected, found) in expected.words().zip(found) {
                differs |= expected != found;
            }
            if differs {
                return Err(BlockError::SelfTest);
            }
            self_test = SelfTest::Passed;
        }
        Ok(Self { header, crc: block.crc(), inverse, self_test })
    }

    /// The gear.
    pub fn gear(&self) -> &Gear<S, L> {
        self.inverse.gear()
    }
}
