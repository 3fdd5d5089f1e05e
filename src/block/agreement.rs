//! Whether the words of a set-up go with the records that they were computed from: what is bounded and shown of a block is then what the drive computes with.
//!
//! Scales and coefficients are the same words in both; what the torque and its derivatives take beside them is computed anew and compared within [`TOLERANCE`]. Limits,
//! tolerances and brackets of the search for an inverse are not: golden samples vouch for them.

use super::error::BlockError;
use super::joint::single;
use super::layout::{GEAR, MASING, PREPARED, PREPARED_GEAR, TIME};
use super::prepared::{GEAR_RECORD_WORDS, MOST_WORDS, between, numbers, words};
use super::record::Block;
use super::{ScalarKind, Word};
use crate::elastic::{LARGEST_KNEE, Polynomial};
use crate::inverse::words::{GEAR_WORDS, SEARCH_WORDS};
use crate::scalar::Fixed;

/// What is computed anew may differ by so much: far above the rounding of any scalar, far below what a torque may be off by.
const TOLERANCE: f64 = 1.0 / 1024.0;

/// Holds the set-up of a block, where it has one, against its gear and its law. [`Server`](crate::link::Server) does so with every block that comes over the link; firmware with
/// another way in calls it before it runs on [`Prepared`](super::Prepared).
///
/// # Errors
/// [`BlockError::Disagrees`]; a record missing, twice or of another length, a word that is no number.
pub fn check_set_up(block: &Block<'_>) -> Result<(), BlockError> {
    match block.header().scalar {
        ScalarKind::F32 => check::<f32>(block),
        ScalarKind::Fixed => check::<Fixed>(block),
    }
}

fn check<S: Word>(block: &Block<'_>) -> Result<(), BlockError> {
    let has = |tag| block.records().any(|record| record.tag == tag);
    if has(PREPARED.tag) {
        let numbers = numbers::<S, MOST_WORDS>(block, PREPARED.tag)?;
        let (gear, law, search) = between::<S, 3>(&numbers).ok_or(BlockError::Malformed(PREPARED.tag))?;
        if !is_of_gear(block, gear, search)? || words::<3>(block, MASING.tag)? != law.map(S::word) {
            return Err(BlockError::Disagrees(PREPARED.tag));
        }
    }
    if has(PREPARED_GEAR.tag) {
        let numbers = numbers::<S, GEAR_RECORD_WORDS>(block, PREPARED_GEAR.tag)?;
        let (gear, rates, search) = between::<S, 2>(&numbers).ok_or(BlockError::Malformed(PREPARED_GEAR.tag))?;
        if !is_of_gear(block, gear, search)? || has(TIME.tag) && !is_of_rates(block, rates)? {
            return Err(BlockError::Disagrees(PREPARED_GEAR.tag));
        }
    }
    Ok(())
}

/// Whether scales and elastic torque are those of the record `gear`.
fn is_of_gear<S: Word>(
    block: &Block<'_>,
    gear: &[S; GEAR_WORDS],
    search: &[S; SEARCH_WORDS],
) -> Result<bool, BlockError> {
    let [a0, a1, t0, t1, coefficients @ ..] = words::<7>(block, GEAR.tag)?;
    let [rated, inverse_rated, torque_scale, _, k1, k3, k5, knee, knee_torque, knee_stiffness] = *gear;
    let [s2, s4, b1, b3, .., inverse_torque_scale, _, _] = *search;
    let scale = |double| if S::SI { single(double).to_bits() } else { S::ONE.word() };
    if [rated, torque_scale].map(S::word) != [scale([a0, a1]), scale([t0, t1])]
        || [k1, k3, k5].map(S::word) != coefficients
    {
        return Ok(false);
    }
    let two = |x: S| x + x;
    let square = knee * knee;
    let stiffness = k1 + square * (s2 + square * s4);
    let pairs = [
        (rated * inverse_rated, S::ONE),
        (torque_scale * inverse_torque_scale, S::ONE),
        (knee.clamp(S::ONE, S::from_f64(LARGEST_KNEE)), knee),
        (Polynomial { k1, k3, k5 }.torque(knee), knee_torque),
        (stiffness.max(S::ZERO), knee_stiffness),
        (two(k3) + k3, s2),
        (two(two(k5)) + k5, s4),
        (two(two(k3) + k3), b1),
        (two(two(two(two(k5)) + k5)), b3),
    ];
    // A NaN compares false.
    Ok(pairs.iter().all(|(computed, stored)| (*computed - *stored).abs() <= S::from_f64(TOLERANCE)))
}

/// Whether αA/T_A and β are those of the record `time`.
fn is_of_rates<S: Word>(block: &Block<'_>, [gain, beta]: &[S; 2]) -> Result<bool, BlockError> {
    let [_, _, g0, g1, b0, b1, ..] = words::<14>(block, TIME.tag)?;
    let stored = [[g0, g1], [b0, b1]].map(single);
    // Fixed point rounds, and saturates, rates that a steady period does not read.
    Ok(!S::SI || [*gain, *beta].map(S::word) == stored.map(f32::to_bits))
}
