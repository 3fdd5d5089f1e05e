//! What a drive computes with, word by word as the host has computed it: loaded without arithmetic in double precision and without the registry of fields.
//!
//! [`Parameters::load_any`](super::Parameters::load_any) sets a gear up from few numbers, in `f64`; the record `prepared` beside them (law `masing`) or `prepared_gear` (laws `phase` and `time`)
//! holds what comes of that. [`Parameters::load`](super::Parameters::load) and [`Prepared::load`] take the words over: the same coefficients to the bit. The former checks each number of the block
//! against its range and the words against the numbers; the latter does neither, in a fraction of the flash, of the stack and of the time: CRC-32 and golden samples vouch for the words.
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
use super::header::{Header, TorqueUnit};
use super::joint::JointRecord;
use super::law::{BlockLaw, gate_of, kernel_of, number};
use super::layout::{
    LARGEST_STEP, MASING, MAY_SKIP, PHASE, PREPARED, PREPARED_GEAR, RECORDS, RecordInfo, SELF_TEST, TIME,
};
use super::parameters::{CheckedTerms, TermStack};
use super::record::{Block, Record, verify_first};
use super::scales::ScalesRecord;
use super::self_test::{IS_COMPARED, SAMPLES, Samples};
use crate::diagnostics::SelfTest;
use crate::drive::{Mounting, Setup, SetupError};
use crate::feedforward::{FeedForward, FeedForwardError, Limits};
use crate::gear::Gear;
use crate::inverse::words::{GEAR_WORDS, SEARCH_WORDS};
use crate::inverse::{Inverse, Invertible};
use crate::memory::AnyLaw;
use crate::memory::masing::Masing;
use crate::memory::phase::Phase;
use crate::memory::time::{Rates, Time};
use crate::scalar::Float;
use crate::terms::Setting;

/// The most words that a set-up takes.
pub(super) const MOST_WORDS: usize = GEAR_WORDS + 3 + SEARCH_WORDS;
/// The words of the record of laws `phase` and `time`.
pub(super) const GEAR_RECORD_WORDS: usize = GEAR_WORDS + 2 + SEARCH_WORDS;

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

/// The one record of a tag, of so many words. Not of a [`RecordInfo`]: its words for people would be linked.
fn only<'a>(block: &Block<'a>, tag: u16, words: usize) -> Result<Record<'a>, BlockError> {
    let mut found = None;
    for record in block.records() {
        if record.tag == tag && found.replace(record).is_some() {
            return Err(BlockError::Twice(tag));
        }
    }
    let record = found.ok_or(BlockError::Missing(tag))?;
    if record.payload.len() == 4 * words { Ok(record) } else { Err(BlockError::Malformed(tag)) }
}

/// The words of a record, whatever they say.
pub(crate) fn words<const N: usize>(block: &Block<'_>, tag: u16) -> Result<[u32; N], BlockError> {
    let mut words = [0; N];
    fill(block, tag, &mut words)?;
    Ok(words)
}

/// A call of its own, however many words.
#[inline(never)]
fn fill(block: &Block<'_>, tag: u16, words: &mut [u32]) -> Result<(), BlockError> {
    let record = only(block, tag, words.len())?;
    words.iter_mut().zip(record.words()).for_each(|(to, word)| *to = word);
    Ok(())
}

/// The words of a record as numbers.
fn numbers<S: Word, const N: usize>(block: &Block<'_>, tag: u16) -> Result<[S; N], BlockError> {
    let mut numbers = [S::ZERO; N];
    for (to, word) in numbers.iter_mut().zip(only(block, tag, N)?.words()) {
        *to = S::of_word(word).ok_or(BlockError::Malformed(tag))?;
    }
    Ok(numbers)
}

/// These limits, the top speed at most that of a block, whose largest step is that of its own period.
pub(super) fn within<S: Word + Float, L: Invertible<S>>(
    limits: &Limits<S>,
    gear: &Gear<S, L>,
    stored_s: f32,
) -> Limits<S> {
    let largest_rate_rad_per_s = gear.largest_step().over(number(stored_s.to_bits()));
    Limits { largest_rate_rad_per_s: limits.largest_rate_rad_per_s.min(largest_rate_rad_per_s), ..*limits }
}

/// What lies between the words of the gear and those of the search: `N` words.
fn between<S, const N: usize>(words: &[S]) -> Option<(&[S; GEAR_WORDS], &[S; N], &[S; SEARCH_WORDS])> {
    let (gear, rest) = words.split_first_chunk()?;
    let (law, search) = rest.split_first_chunk()?;
    Some((gear, law, search.first_chunk()?))
}

fn put_words<S: Word, L: BlockLaw<S>, const N: usize>(inverse: &Inverse<S, L>, law: [S; N], put: impl FnMut(S)) {
    inverse.gear_words().into_iter().chain(law).chain(inverse.search_words()).for_each(put);
}

impl<S: Word> PreparedLaw<S> for Masing<S> {
    #[inline(always)]
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let words = numbers::<S, MOST_WORDS>(block, PREPARED.tag)?;
        let (gear, &[e, h, half_play], search) = between(&words).ok_or(BlockError::Malformed(PREPARED.tag))?;
        Ok(Inverse::of_words(gear, Self { e, h, half_play }, search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        let Self { e, h, half_play } = *inverse.gear().law();
        put_words(inverse, [e, h, half_play], put);
        &PREPARED
    }
}

impl<S: Word + Float> PreparedLaw<S> for Phase<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let [gate, law @ ..] = words::<4>(block, PHASE.tag)?;
        let [quadrature, in_phase, rho] = law.map(number);
        let words = numbers::<S, GEAR_RECORD_WORDS>(block, PREPARED_GEAR.tag)?;
        let (gear, [_, _], search) = between(&words).ok_or(BlockError::Malformed(PREPARED_GEAR.tag))?;
        Ok(Inverse::of_words(gear, Self { quadrature, in_phase, rho, gate: gate_of(gate) }, search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        put_words(inverse, [S::ZERO; 2], put);
        &PREPARED_GEAR
    }
}

impl<S: Word> PreparedLaw<S> for Time<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let [kernel, gate, _, _, _, _, f0, f1, l0, l1, i0, i1, bound, _] = words::<14>(block, TIME.tag)?;
        let step = |words| S::gain_of_words(words).map(|(gain, _)| gain).ok_or(BlockError::Malformed(TIME.tag));
        let step = [step([f0, f1])?, step([l0, l1])?, step([i0, i1])?];
        let words = numbers::<S, GEAR_RECORD_WORDS>(block, PREPARED_GEAR.tag)?;
        let (gear, &[gain, beta_per_s], search) = between(&words).ok_or(BlockError::Malformed(PREPARED_GEAR.tag))?;
        let rates = Rates { kernel: kernel_of(kernel), gain, beta_per_s };
        let law = Self::of_rates(rates, gate_of(gate), step, number(bound));
        // A NaN compares false.
        let law = if block.header().period_s > 0.0 { law } else { law.without_period() };
        Ok(Inverse::of_words(gear, law, search))
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        let law = inverse.gear().law();
        put_words(inverse, [law.gain(), law.beta_per_s()], put);
        &PREPARED_GEAR
    }
}

impl<S: Word + Float> PreparedLaw<S> for AnyLaw<S> {
    fn of_prepared(block: &Block<'_>) -> Result<Inverse<S, Self>, BlockError> {
        let has = |tag| block.records().any(|record| record.tag == tag);
        if has(MASING.tag) {
            Masing::of_prepared(block).map(|inverse| inverse.map_law(Self::Masing))
        } else if has(PHASE.tag) {
            Phase::of_prepared(block).map(|inverse| inverse.map_law(Self::Phase))
        } else {
            Time::of_prepared(block).map(|inverse| inverse.map_law(Self::Time))
        }
    }

    fn prepared_words(inverse: &Inverse<S, Self>, put: impl FnMut(S)) -> &'static RecordInfo {
        match *inverse.gear().law() {
            Self::Masing(law) => Masing::prepared_words(&inverse.map_law(|_| law), put),
            Self::Phase(law) => Phase::prepared_words(&inverse.map_law(|_| law), put),
            Self::Time(law) => Time::prepared_words(&inverse.map_law(|_| law), put),
        }
    }
}

/// Whether golden samples come out as they are stored.
fn is_met<S: Word, L: BlockLaw<S>>(expected: &Record<'_>, inverse: &Inverse<S, L>) -> bool {
    expected.words().zip(Samples::new(inverse.gear(), Some(inverse))).all(|(stored, computed)| stored == computed)
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
    /// [`BlockError`]: bytes that are no block, torques in amperes ([`of_block_in`](Self::of_block_in) takes them), another scalar, another law, no record `prepared` or `prepared_gear`, a word that is no number, golden samples that come out
    /// otherwise.
    pub fn load(bytes: &[u8], stack_depth: usize) -> Result<Self, BlockError> {
        Self::of_block(&verify_first(bytes)?, stack_depth)
    }

    /// [`load`](Self::load) from a block that is verified.
    ///
    /// # Errors
    /// As there.
    pub fn of_block(block: &Block<'_>, stack_depth: usize) -> Result<Self, BlockError> {
        Self::of_block_in(block, stack_depth, TorqueUnit::NewtonMetre)
    }

    /// [`of_block`](Self::of_block) for code that counts torques in a unit.
    ///
    /// # Errors
    /// As there; [`BlockError::Unit`]: the block counts them in the other one.
    pub fn of_block_in(block: &Block<'_>, stack_depth: usize, unit: TorqueUnit) -> Result<Self, BlockError> {
        let header = *block.header();
        if header.torque_unit != unit {
            return Err(BlockError::Unit(header.torque_unit));
        }
        if header.scalar != S::KIND {
            return Err(BlockError::Scalar(header.scalar.bytes()));
        }
        if usize::from(header.stack_depth) > stack_depth {
            return Err(BlockError::StackDepth(header.stack_depth));
        }
        let mut inverse = L::of_prepared(block)?;
        let self_test = match only(block, SELF_TEST.tag, SAMPLES) {
            _ if !IS_COMPARED => SelfTest::NotRun,
            Err(BlockError::Missing(_)) => SelfTest::NotRun,
            Ok(expected) if is_met(&expected, &inverse) => SelfTest::Passed,
            _ => return Err(BlockError::SelfTest),
        };
        // After the golden samples, which lie further apart.
        match only(block, LARGEST_STEP.tag, 1) {
            Err(BlockError::Missing(_)) => {}
            found => {
                let step = found?.words().next().and_then(S::of_word).filter(|step| *step > S::ZERO);
                inverse = inverse.with_largest_step(step.ok_or(BlockError::Malformed(LARGEST_STEP.tag))?);
            }
        }
        Ok(Self { header, crc: block.crc(), inverse, self_test })
    }

    /// The feed-forward of the gear.
    ///
    /// # Errors
    /// [`FeedForwardError`]: limits that cannot be, a law `time` for another control period than [`Limits::period_s`].
    pub fn feed_forward(&self, limits: &Limits<S>) -> Result<FeedForward<S, L>, FeedForwardError>
    where
        S: Float,
    {
        let stored_s = self.header.period_s;
        if self.gear().law().knows_time() && limits.period_s.word() != stored_s.word() {
            return Err(FeedForwardError::Period { stored_s });
        }
        FeedForward::of_inverse(&self.inverse, &within(limits, self.gear(), stored_s))
    }

    /// The encoders of the joint, with ratio, zero and rated deflection of the block that this was loaded from.
    ///
    /// # Errors
    /// [`SetupError`]: no ratio that is a fraction, another block than the one that this was loaded from.
    pub fn encoders(&self, block: &Block<'_>, motor: Mounting, output: Mounting) -> Result<Setup, SetupError> {
        let (Ok(joint), Ok(scales), true) =
            (JointRecord::of_block(block), ScalesRecord::of_block(block), block.crc() == self.crc)
        else {
            return Err(SetupError::Block);
        };
        joint.joint().encoders(motor, output, scales.scales().rated_deflection_rad)
    }

    /// The gear.
    #[must_use]
    pub fn gear(&self) -> &Gear<S, L> {
        self.inverse.gear()
    }
}

impl<L: PreparedLaw<f32>> Prepared<f32, L> {
    /// The terms of the block that this was loaded from, checked and counted in single precision. The c1 that `thermal_stiffness` scales is that of
    /// [`Parameters`](super::Parameters) within 2 units in the last place.
    ///
    /// # Errors
    /// [`BlockError`]: a term that cannot be, more than `K`, a record that this firmware does not know and may not skip.
    pub fn terms<const K: usize>(&self, block: &Block<'_>) -> Result<CheckedTerms<K>, BlockError> {
        let joint = JointRecord::of_block(block)?;
        let frame = self.gear().frame();
        let c1 = self.gear().elastic().polynomial().k1 * frame.torque_scale() * frame.inverse_rated();
        let sigma = if joint.motor_side() { 1.0 } else { -1.0 };
        let mut terms = CheckedTerms::empty(Setting { sigma, c1, rated_deflection: frame.rated() }, true);
        for record in block.records() {
            let is_fixed = RECORDS.iter().any(|info| info.tag == record.tag);
            if !is_fixed && !terms.take(&record)? && record.tag & MAY_SKIP == 0 {
                return Err(BlockError::Unknown(record.tag));
            }
        }
        Ok(terms)
    }
}
