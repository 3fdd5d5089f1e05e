//! Feed-forward of every law with its terms, from a block.

use core::mem::MaybeUninit;

use gmhm::block::{Block, BlockError, CheckedTerms, INVERSE, JointRecord, Prepared, verify_first};
use gmhm::diagnostics::Diagnostics;
use gmhm::feedforward::{Contribution, FeedForward, FeedForwardError, FeedForwardState};
use gmhm::memory::AnyLaw;
use gmhm::terms::feedforward::{CompensatedFeedForwardPast, CompensatedFeedForwardView, Shares, Trial};

use crate::facts::Facts;
use crate::joint::DEPTH;
use crate::terms::{MOST, TermC, Terms};
use crate::types::{ContributionC, DemandC, DiagnosticsC, LimitsC, SampleC, StatusC, flag, need, status_flags, sum};
use crate::{NO_INVERSE, NULL, OK, PERIOD, PLACES, VALUE, answer, bytes, code_of};

/// 64-bit words of `gmhm_feed_forward`.
pub const FEED_FORWARD_WORDS: usize = 64;

const _: () = assert!(
    size_of::<FeedForwardC>() <= 8 * FEED_FORWARD_WORDS && align_of::<FeedForwardC>() <= align_of::<u64>(),
    "a feed-forward does not fit into GMHM_FEED_FORWARD_WORDS of gmhm.h"
);

/// `gmhm_feed_forward`.
pub struct FeedForwardC {
    force: Option<Force>,
    /// Begins with the first sample.
    state: Option<State>,
    terms: Terms,
    diagnostics: Diagnostics,
}

/// What is in force; side and unit of the torque are those of the terms and newton metres.
struct Force {
    feed_forward: FeedForward<f32>,
    period_s: f32,
    facts: Facts,
    ratio: f32,
    deflection_zero_rad: f32,
}

struct State {
    feed_forward: FeedForwardState<f32, DEPTH>,
    shares: Shares<f32>,
}

impl core::fmt::Debug for FeedForwardC {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("FeedForwardC").field("is_loaded", &self.force.is_some()).finish()
    }
}

/// The gear of a good block and its terms, nothing of it in double precision. A frame of its own: firmware has little stack.
#[inline(never)]
fn check(block: &Block<'_>) -> Result<(Prepared<f32, AnyLaw<f32>>, CheckedTerms<MOST>), BlockError> {
    let prepared = Prepared::of_block(block, DEPTH)?;
    let terms = prepared.terms(block)?;
    Ok((prepared, terms))
}

/// Of the last step.
fn flags(state: &FeedForwardState<f32, DEPTH>) -> u32 {
    let last = state.contribution();
    status_flags(last.refused, &state.gear().status()) | sum(&[(last.saturated, flag::SATURATED)])
}

impl FeedForwardC {
    fn empty(terms: Terms) -> Self {
        Self { force: None, state: None, terms, diagnostics: Diagnostics::default() }
    }

    fn load(&mut self, block: &[u8], limits: &LimitsC) -> Result<(), u16> {
        let block = verify_first(block).map_err(|error| error.code())?;
        if block.records().all(|record| record.tag != INVERSE.tag) {
            return Err(NO_INVERSE);
        }
        let checked = check(&block);
        self.diagnostics.see_load(checked.as_ref().map(|(prepared, _)| prepared.self_test));
        let (prepared, terms) = checked.map_err(|error| code_of(&error))?;
        let joint = JointRecord::of_block(&block).map_err(|error| error.code())?;
        let feed_forward = prepared.feed_forward(&limits.limits()).map_err(|error| match error {
            FeedForwardError::Period { .. } => PERIOD,
            _ => VALUE,
        })?;
        if !self.terms.have_room(&terms) {
            return Err(PLACES);
        }
        let (facts, ratio, deflection_zero_rad) = (Facts::of_block(&block), joint.ratio(), joint.deflection_zero_rad());
        let force = Force { feed_forward, period_s: limits.period_s, facts, ratio, deflection_zero_rad };
        self.adopt(force, &terms, &block);
        Ok(())
    }

    /// Takes over what a good block says. A frame of its own, as above.
    #[inline(never)]
    fn adopt(&mut self, force: Force, terms: &CheckedTerms<MOST>, block: &Block<'_>) {
        let before = self.terms.load(terms, block);
        let (stack, terms, trial) = self.terms.all(before);
        if let (Some(State { feed_forward, shares }), Some(earlier)) = (&mut self.state, &self.force) {
            let now = CompensatedFeedForwardView { base: &force.feed_forward, stack };
            let mut past = CompensatedFeedForwardPast { feed_forward, terms, trial: Trial::in_places(trial), shares };
            now.take_over(&earlier.feed_forward, &mut past, before);
        }
        self.force = Some(force);
    }

    fn step(&mut self, demand: &DemandC, sample: &SampleC) -> Option<(ContributionC, u32)> {
        let Force { feed_forward, period_s, .. } = self.force.as_ref()?;
        let sample = sample.after(*period_s);
        let (stack, terms, trial) = self.terms.parts();
        let view = CompensatedFeedForwardView { base: feed_forward, stack };
        let State { feed_forward: state, shares } = match &mut self.state {
            Some(state) => state,
            none => {
                let (feed_forward, shares) = view.start(terms, &sample);
                none.insert(State { feed_forward, shares })
            }
        };
        let gear = feed_forward.inverse().gear();
        let before = gear.merged_pairs(state.gear());
        let trial = Trial::in_places(trial);
        let mut past = CompensatedFeedForwardPast { feed_forward: state, terms, trial, shares };
        let now = view.step(&mut past, &demand.controls(), &demand.demand(), &sample);
        let (output, status) = (gear.output(state.gear()), state.gear().status());
        let contribution = ContributionC {
            offset_rad: now.offset,
            change_rad: now.change,
            gear_terms_nm: now.gear_torque,
            joint_terms_nm: now.joint_torque,
            ..ContributionC::of(&now.base, &output)
        };
        let flags = flags(state);
        self.diagnostics.see_contribution(&Contribution { refused: now.refused, ..now.base }, &status);
        self.diagnostics.see_merged_pairs(before, gear.merged_pairs(state.gear()));
        Some((contribution, flags))
    }

    fn restart(&mut self, deflection_rad: f32) {
        if let (Some(force), Some(State { feed_forward, shares })) = (&self.force, &mut self.state) {
            let view = CompensatedFeedForwardView { base: &force.feed_forward, stack: self.terms.view() };
            view.restart(feed_forward, shares, deflection_rad);
        }
    }

    fn status(&self) -> Option<StatusC> {
        let Force { feed_forward, period_s, facts, ratio, deflection_zero_rad } = self.force.as_ref()?;
        let inverse = feed_forward.inverse();
        let gear = inverse.gear();
        let at_rest = gear.start::<DEPTH>(0.0);
        let state = self.state.as_ref().map_or(&at_rest, |state| state.feed_forward.gear());
        Some(StatusC {
            period_s: *period_s,
            range_rad: inverse.range(),
            needs: need::bits(&self.terms.view()),
            flags: self.state.as_ref().map_or(0, |state| flags(&state.feed_forward)),
            ratio: *ratio,
            deflection_zero_rad: *deflection_zero_rad,
            torque_on_motor_side: u32::from(self.terms.motor_side()),
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
    // SAFETY: the caller's, as above; no terms.
    unsafe { gmhm_feed_forward_init_with_terms(feed, core::ptr::null_mut(), 0, block, length, limits) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says, the terms for as long as the feed-forward is used.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_feed_forward_init_with_terms(
    feed: Option<&mut MaybeUninit<FeedForwardC>>,
    terms: *mut TermC,
    places: u32,
    block: *const u8,
    length: u32,
    limits: Option<&LimitsC>,
) -> u16 {
    let Some(feed) = feed else { return NULL };
    // SAFETY: the caller's, as above.
    unsafe {
        let feed = feed.write(FeedForwardC::empty(Terms::in_memory(terms, places)));
        gmhm_feed_forward_load(Some(feed), block, length, limits)
    }
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
    feed.restart(deflection_rad);
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_feed_forward_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_feed_forward_needs(feed: Option<&FeedForwardC>) -> u32 {
    feed.map_or(0, |feed| need::bits(&feed.terms.view()))
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
