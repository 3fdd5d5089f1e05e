//! Whether the words of a set-up go with the records that they were computed from: what is bounded and shown of a block is then what the drive computes with.
//!
//! Scales and coefficients are the same words in both; what the torque and its derivatives take beside them is computed anew, in single precision, and compared within [`TOLERANCE`]. Limits,
//! tolerances and brackets of the search for an inverse are not: golden samples vouch for them.

use super::error::BlockError;
use super::joint::single;
use super::layout::{GEAR, MASING, PREPARED, PREPARED_GEAR, TIME};
use super::prepared::{GEAR_RECORD_WORDS, MOST_WORDS, words};
use super::record::Block;
use super::{ScalarKind, Word};
use crate::elastic::{LARGEST_KNEE, Polynomial};
use crate::inverse::words::GEAR_WORDS;
use crate::scalar::{Fixed, Scalar};

/// What is computed anew may differ by so much: far above the rounding of any scalar, far below what a torque may be off by.
const TOLERANCE: f32 = 1.0 / 1024.0;

/// Holds the set-up of a block, where it has one, against its gear and its law. The link does so with every block that comes over it; firmware with
/// another way in calls it before it runs on [`Prepared`](super::Prepared).
///
/// # Errors
/// [`BlockError::Disagrees`]; a record missing, twice or of another length.
pub fn check_set_up(block: &Block<'_>) -> Result<(), BlockError> {
    let has = |tag| block.records().any(|record| record.tag == tag);
    if has(PREPARED.tag) {
        let [gear @ .., e, h, half_play, s2, s4, b1, b3, _, _, _, _, _, _, _, _, scale, _, _] =
            words::<MOST_WORDS>(block, PREPARED.tag)?;
        let law = words::<3>(block, MASING.tag)?;
        if law != [e, h, half_play] || !is_of_gear(block, &gear, &[s2, s4, b1, b3, scale])? {
            return Err(BlockError::Disagrees(PREPARED.tag));
        }
    }
    if has(PREPARED_GEAR.tag) {
        let [gear @ .., gain, beta, s2, s4, b1, b3, _, _, _, _, _, _, _, _, scale, _, _] =
            words::<GEAR_RECORD_WORDS>(block, PREPARED_GEAR.tag)?;
        let rates = !has(TIME.tag) || is_of_rates(block, [gain, beta])?;
        if !rates || !is_of_gear(block, &gear, &[s2, s4, b1, b3, scale])? {
            return Err(BlockError::Disagrees(PREPARED_GEAR.tag));
        }
    }
    Ok(())
}

/// Whether scales, elastic torque and its derivatives are those of the record `gear`.
#[inline(never)]
fn is_of_gear(block: &Block<'_>, gear: &[u32; GEAR_WORDS], search: &[u32; 5]) -> Result<bool, BlockError> {
    let [a0, a1, t0, t1, coefficients @ ..] = words::<7>(block, GEAR.tag)?;
    let [rated, _, torque_scale, _, k1, k3, k5, ..] = *gear;
    let kind = block.header().scalar;
    let scales = match kind {
        ScalarKind::F32 => [[a0, a1], [t0, t1]].map(|double| single(double).to_bits()),
        ScalarKind::Fixed => [Fixed::ONE.word(); 2],
    };
    if [rated, torque_scale] != scales || [k1, k3, k5] != coefficients {
        return Ok(false);
    }
    let number = |word| kind.number(word);
    let [rated, inverse_rated, torque_scale, _, k1, k3, k5, knee, knee_torque, knee_stiffness] = gear.map(number);
    let [s2, s4, b1, b3, inverse_torque_scale] = search.map(number);
    let polynomial = Polynomial { k1, k3, k5 };
    // What fixed point cannot hold is its largest number.
    let most = if kind == ScalarKind::Fixed { const { Fixed::LARGEST as f32 } } else { f32::MAX };
    let pairs = [
        (rated * inverse_rated, 1.0),
        (torque_scale * inverse_torque_scale, 1.0),
        (knee.clamp(1.0, const { LARGEST_KNEE as f32 }), knee),
        (polynomial.torque(knee), knee_torque),
        (polynomial.stiffness(knee).max(0.0), knee_stiffness),
        (3.0 * k3, s2),
        (5.0 * k5, s4),
        (6.0 * k3, b1),
        (20.0 * k5, b3),
    ];
    // A NaN compares false.
    Ok(pairs.iter().all(|(computed, stored)| (computed.max(-most).min(most) - stored).abs() <= TOLERANCE))
}

/// Whether αA/T_A and β are those of the record `time`.
fn is_of_rates(block: &Block<'_>, rates: [u32; 2]) -> Result<bool, BlockError> {
    let [_, _, g0, g1, b0, b1, ..] = words::<14>(block, TIME.tag)?;
    let stored = [[g0, g1], [b0, b1]].map(|double| single(double).to_bits());
    // Fixed point rounds, and saturates, rates that a steady period does not read.
    Ok(block.header().scalar == ScalarKind::Fixed || rates == stored)
}
