//! Feed-forward of every law with its terms, from a block.

use core::mem::MaybeUninit;

use gmhm::block::{Block, BlockError, CheckedTerms, INVERSE, Prepared, verify_first};
use gmhm::diagnostics::Diagnostics;
use gmhm::feedforward::{Contribution, FeedForward, FeedForwardError};
use gmhm::memory::AnyLaw;
use gmhm::terms::Stack;
use gmhm::terms::feedforward::{CompensatedFeedForward, CompensatedFeedForwardState};

use crate::facts::Facts;
use crate::joint::{DEPTH, NO_SETTING, TERMS, plant};
use crate::types::{ContributionC, DemandC, DiagnosticsC, LimitsC, SampleC, StatusC, flag, need, status_flags, sum};
use crate::{NO_INVERSE, NULL, OK, PERIOD, VALUE, answer, bytes, code_of};

/// 64-bit words of `gmhm_feed_forward`.
pub const FEED_FORWARD_WORDS: usize = 448;

const _: () = assert!(
    size_of::<FeedForwardC>() <= 8 * FEED_FORWARD_WORDS && align_of::<FeedForwardC>() <= align_of::<u64>(),
    "a feed-forward does not fit into GMHM_FEED_FORWARD_WORDS of gmhm.h"
);

type Feed = CompensatedFeedForward<f32, AnyLaw<f32>, TERMS>;
type State = CompensatedFeedForwardState<f32, DEPTH, AnyLaw<f32>, TERMS>;

/// `gmhm_feed_forward`.
pub struct FeedForwardC {
    force: Option<Force>,
    flags: u32,
    diagnostics: Diagnostics,
    /// Of the path, as counted last.
    merged_pairs: u32,
}

struct Force {
    feed: Feed,
    /// Begins with the first sample.
    state: Option<State>,
    period_s: f32,
    facts: Facts,
}

impl core::fmt::Debug for FeedForwardC {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("FeedForwardC").field("is_loaded", &self.force.is_some()).finish()
    }
}

/// The gear of a good block and its terms, nothing of it in double precision. A frame of its own: firmware has little stack.
#[inline(never)]
fn check(block: &Block<'_>) -> Result<(Prepared<f32, AnyLaw<f32>>, CheckedTerms<TERMS>), BlockError> {
    let prepared = Prepared::of_block(block, DEPTH)?;
    let terms = prepared.terms(block)?;
    Ok((prepared, terms))
}

impl FeedForwardC {
    fn empty() -> Self {
        Self { force: None, flags: flag::NOT_LOADED, diagnostics: Diagnostics::default(), merged_pairs: 0 }
    }

    fn load(&mut self, block: &[u8], limits: &LimitsC) -> Result<(), u16> {
        let block = verify_first(block).map_err(|error| error.code())?;
        if block.records().all(|record| record.tag != INVERSE.tag) {
            return Err(NO_INVERSE);
        }
        let checked = check(&block);
        self.diagnostics.see_load(checked.as_ref().map(|(prepared, _)| prepared.self_test));
        let (prepared, terms) = checked.map_err(|error| code_of(&error))?;
        let facts = Facts::of_block(&block).map_err(|error| error.code())?;
        let feed_forward = prepared.feed_forward(&limits.limits()).map_err(|error| match error {
            FeedForwardError::Period { .. } => PERIOD,
            _ => VALUE,
        })?;
        let force = self.force_of(&feed_forward, facts);
        let before = core::mem::replace(&mut force.feed.feed_forward, feed_forward);
        (force.period_s, force.facts) = (limits.period_s, facts);
        plant(&mut force.feed.stack, &terms, &block);
        if let Some(state) = &mut force.state {
            force.feed.take_over(&before, state);
        }
        self.flags = 0;
        Ok(())
    }

    /// What is in force, or its place. A frame of its own, as above.
    #[inline(never)]
    fn force_of(&mut self, feed_forward: &FeedForward<f32>, facts: Facts) -> &mut Force {
        self.force.get_or_insert_with(|| Force {
            feed: CompensatedFeedForward { feed_forward: *feed_forward, stack: Stack::of_gear(NO_SETTING) },
            state: None,
            period_s: 0.0,
            facts,
        })
    }

    fn step(&mut self, demand: &DemandC, sample: &SampleC) -> Option<(ContributionC, u32)> {
        let Force { feed, state, period_s, .. } = self.force.as_mut()?;
        let sample = sample.after(*period_s);
        let state = state.get_or_insert_with(|| feed.start(&sample));
        let now = feed.step(state, &demand.controls(), &demand.demand(), &sample);
        let gear = feed.feed_forward.inverse().gear();
        let (output, status) = (gear.output(state.gear()), state.gear().status());
        let contribution = ContributionC {
            offset_rad: now.offset,
            change_rad: now.change,
            gear_terms_nm: now.gear_torque,
            joint_terms_nm: now.joint_torque,
            ..ContributionC::of(&now.base, &output)
        };
        let flags = status_flags(now.refused, &status) | sum(&[(now.base.saturated, flag::SATURATED)]);
        self.flags = flags;
        self.diagnostics.see_contribution(&Contribution { refused: now.refused, ..now.base }, &status);
        let merged = gear.merged_pairs(state.gear());
        self.diagnostics.see_merged_pairs(self.merged_pairs, merged);
        self.merged_pairs = merged;
        Some((contribution, flags))
    }

    fn status(&self) -> Option<StatusC> {
        let Force { feed, state, facts, .. } = self.force.as_ref()?;
        let inverse = feed.feed_forward.inverse();
        let gear = inverse.gear();
        let at_rest = gear.start::<DEPTH>(0.0);
        let state = state.as_ref().map_or(&at_rest, State::gear);
        Some(StatusC {
            range_rad: inverse.range(),
            needs: need::bits(&feed.stack),
            flags: self.flags,
            ..facts.status(gear, state)
        })
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_feed_forward_init(
    feed: Option<&mut MaybeUninit<FeedForwardC>>,
    block: *const u8,
    length: u32,
    limits: Option<&LimitsC>,
) -> u16 {
    let Some(feed) = feed else { return NULL };
    let feed = feed.write(FeedForwardC::empty());
    // SAFETY: the caller's, as above.
    unsafe { gmhm_feed_forward_load(Some(feed), block, length, limits) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_feed_forward_load(
    feed: Option<&mut FeedForwardC>,
    block: *const u8,
    length: u32,
    limits: Option<&LimitsC>,
) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(feed), Some(block), Some(limits)) = (feed, unsafe { bytes(block, length) }, limits) else { return NULL };
    feed.load(block, limits).err().unwrap_or(OK)
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_restart(feed: Option<&mut FeedForwardC>, deflection_rad: f32) -> u16 {
    let Some(feed) = feed else { return NULL };
    feed.merged_pairs = 0;
    if let Some(Force { feed, state: Some(state), .. }) = &mut feed.force {
        feed.restart(state, deflection_rad);
    }
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_needs(feed: Option<&FeedForwardC>) -> u32 {
    feed.and_then(|feed| feed.force.as_ref()).map_or(0, |force| need::bits(&force.feed.stack))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_step(
    feed: Option<&mut FeedForwardC>,
    demand: Option<&DemandC>,
    sample: Option<&SampleC>,
    to: Option<&mut MaybeUninit<ContributionC>>,
) -> u32 {
    let Some(to) = to else { return flag::NOT_LOADED };
    let to = to.write(ContributionC::default());
    let (Some(feed), Some(demand), Some(sample)) = (feed, demand, sample) else { return flag::NOT_LOADED };
    let Some((now, flags)) = feed.step(demand, sample) else { return flag::NOT_LOADED };
    *to = now;
    flags
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_get_status(
    feed: Option<&FeedForwardC>,
    to: Option<&mut MaybeUninit<StatusC>>,
) -> u32 {
    answer(to, || feed?.status())
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_get_diagnostics(
    feed: Option<&FeedForwardC>,
    to: Option<&mut MaybeUninit<DiagnosticsC>>,
) -> u16 {
    let (Some(feed), Some(to)) = (feed, to) else { return NULL };
    to.write(DiagnosticsC::of(&feed.diagnostics));
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_clear_diagnostics(feed: Option<&mut FeedForwardC>) {
    if let Some(feed) = feed {
        feed.diagnostics.clear();
    }
}
