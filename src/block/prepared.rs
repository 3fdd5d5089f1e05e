//! What a drive computes with, word by word as the host has computed it: loaded without arithmetic in double precision and without the registry of fields.
//!
//! [`Parameters::load`](super::Parameters::load) sets a gear up from few numbers, in `f64`, and checks each against its range; the record `prepared` beside them
//! holds what comes of that, for law `masing`. [`Prepared::load`] takes the words over: the same coefficients to the bit, in a fraction of the flash and of the stack.
//! CRC-32 and golden samples vouch for them.
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
use super::layout::{PREPARED, SELF_TEST};
use super::record::verify_first;
use super::self_test::{IS_COMPARED, samples};
use crate::diagnostics::SelfTest;
use crate::gear::Gear;
use crate::inverse::Inverse;
use crate::inverse::words::WORDS;
use crate::memory::masing::Masing;

/// Gear and inverse of law `masing`, as the host has computed them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prepared<S: Word = f32> {
    /// The header of the block.
    pub header: Header,
    /// The CRC-32 of the block.
    pub crc: u32,
    /// The gear and its inverse.
    pub inverse: Inverse<S, Masing<S>>,
    /// Whether the golden samples of the block were computed anew; one that differs refuses the block.
    pub self_test: SelfTest,
}

impl<S: Word> Prepared<S> {
    /// Loads the block that these bytes begin with. `stack_depth` is how many turning points the caller has room for.
    ///
    /// # Errors
    /// [`BlockError`]: bytes that are no block, another scalar, no record `prepared`, a word that is no number, golden samples that come out otherwise.
    pub fn load(bytes: &[u8], stack_depth: usize) -> Result<Self, BlockError> {
        let block = verify_first(bytes)?;
        let header = *block.header();
        if header.scalar != S::KIND {
            return Err(BlockError::Scalar(header.scalar.bytes()));
        }
        if usize::from(header.stack_depth) > stack_depth {
            return Err(BlockError::StackDepth(header.stack_depth));
        }
        let (mut found, mut expected) = (None, None);
        for record in block.records() {
            if record.tag == PREPARED.tag && found.replace(record).is_some() {
                return Err(BlockError::Twice(PREPARED.tag));
            }
            if record.tag == SELF_TEST.tag {
                expected = Some(record);
            }
        }
        let record = found.ok_or(BlockError::Missing(PREPARED.tag))?;
        let malformed = BlockError::Malformed(PREPARED.tag);
        if record.payload.len() != 4 * WORDS {
            return Err(malformed);
        }
        let mut words = [S::ZERO; WORDS];
        for (to, word) in words.iter_mut().zip(record.words()) {
            *to = S::of_word(word).ok_or(malformed)?;
        }
        let inverse = Inverse::of_words(&words);
        let mut self_test = SelfTest::NotRun;
        if let (Some(expected), true) = (expected, IS_COMPARED) {
            let found = samples(inverse.gear(), Some(&inverse));
            let mut differs = expected.payload.len() != 4 * found.len();
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
    pub fn gear(&self) -> &Gear<S, Masing<S>> {
        self.inverse.gear()
    }
}
