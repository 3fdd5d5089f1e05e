//! Law `masing` with its feed-forward alone, from a prepared block: small enough for any drive.

use core::mem::MaybeUninit;

use gmhm::block::{Prepared, TorqueUnit, verify_first};
use gmhm::diagnostics::Diagnostics;
use gmhm::feedforward::{FeedForward, FeedForwardState};
use gmhm::memory::masing::Masing;

use crate::types::{ContributionC, DemandC, DiagnosticsC, LimitsC, flag, status_flags, sum};
use crate::{NULL, OK, UNIT, VALUE, bytes};

/// Turning points that it remembers.
const DEPTH: usize = 16;

/// 64-bit words of `gmhm_law`.
pub const LAW_WORDS: usize = 64;

const _: () = assert!(
    size_of::<Law>() <= 8 * LAW_WORDS && align_of::<Law>() <= align_of::<u64>(),
    "a law does not fit into GMHM_LAW_WORDS of gmhm.h"
);

type Feed = FeedForward<f32, Masing<f32>>;

/// `gmhm_law`.
pub struct Law {
    force: Option<(Feed, FeedForwardState<f32, DEPTH, Masing<f32>>)>,
    diagnostics: Diagnostics,
    /// Of the path, as counted last.
    merged_pairs: u32,
}

impl core::fmt::Debug for Law {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Law").field("is_loaded", &self.force.is_some()).finish()
    }
}

/// The feed-forward of a block, its torques in newton metres.
fn prepare(block: &[u8], limits: &LimitsC, diagnostics: &mut Diagnostics) -> Result<Feed, u16> {
    let block = verify_first(block).map_err(|error| error.code())?;
    // Before the block is loaded, which refuses it as well: two ways to a code are less code than one with a choice.
    if block.header().torque_unit != TorqueUnit::NewtonMetre {
        return Err(UNIT);
    }
    let prepared = Prepared::<f32>::of_block(&block, DEPTH);
    diagnostics.see_load(prepared.as_ref().map(|prepared| prepared.self_test));
    let prepared = prepared.map_err(|error| error.code())?;
    // Law `masing` asks for no period: what is refused is a limit.
    prepared.feed_forward(&limits.limits()).map_err(|_| VALUE)
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_law_init(
    law: Option<&mut MaybeUninit<Law>>,
    block: *const u8,
    length: u32,
    limits: Option<&LimitsC>,
) -> u16 {
    let Some(law) = law else { return NULL };
    let law = law.write(Law { force: None, diagnostics: Diagnostics::default(), merged_pairs: 0 });
    // SAFETY: the caller's, as above.
    unsafe { gmhm_law_load(Some(law), block, length, limits) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_law_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_law_load(
    law: Option<&mut Law>,
    block: *const u8,
    length: u32,
    limits: Option<&LimitsC>,
) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(law), Some(block), Some(limits)) = (law, unsafe { bytes(block, length) }, limits) else { return NULL };
    let feed = match prepare(block, limits, &mut law.diagnostics) {
        Ok(feed) => feed,
        Err(code) => return code,
    };
    match &mut law.force {
        Some((before, state)) => {
            feed.take_over(before, state);
            *before = feed;
        }
        none => {
            let state = feed.start(0.0);
            *none = Some((feed, state));
        }
    }
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_law_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_law_restart(law: Option<&mut Law>, deflection_rad: f32) -> u16 {
    match law {
        None => NULL,
        Some(law) => {
            law.merged_pairs = 0;
            if let Some((feed, state)) = &mut law.force {
                feed.restart(state, deflection_rad);
            }
            OK
        }
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_law_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_law_step(
    law: Option<&mut Law>,
    demand: Option<&DemandC>,
    to: Option<&mut MaybeUninit<ContributionC>>,
) -> u32 {
    let Some(to) = to else { return flag::NOT_LOADED };
    let to = to.write(ContributionC::default());
    let (Some(law), Some(demand)) = (law, demand) else { return flag::NOT_LOADED };
    let Some((feed, state)) = &mut law.force else { return flag::NOT_LOADED };
    let now = feed.step(state, &demand.controls(), &demand.demand());
    let output = feed.inverse().gear().output(state.gear());
    let status = state.gear().status();
    *to = ContributionC::of(&now, &output);
    law.diagnostics.see_contribution(&now, &status);
    let merged = feed.inverse().gear().merged_pairs(state.gear());
    law.diagnostics.see_merged_pairs(law.merged_pairs, merged);
    law.merged_pairs = merged;
    status_flags(now.refused, &status) | sum(&[(now.saturated, flag::SATURATED)])
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_law_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_law_get_diagnostics(law: Option<&Law>, to: Option<&mut MaybeUninit<DiagnosticsC>>) -> u16 {
    let (Some(law), Some(to)) = (law, to) else { return NULL };
    to.write(DiagnosticsC::of(&law.diagnostics));
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_law_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_law_clear_diagnostics(law: Option<&mut Law>) {
    if let Some(law) = law {
        law.diagnostics.clear();
    }
}
