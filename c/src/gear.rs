//! A gear of any law without terms, from a prepared block: from deflection to torque and back, small enough for many joints.

use core::mem::MaybeUninit;

use gmhm::block::{Block, BlockError, JointRecord, Prepared, TorqueUnit, verify_first};
use gmhm::diagnostics::Diagnostics;
use gmhm::memory::AnyLaw;
use gmhm::{Gear, Inverse, State};

use crate::facts::Facts;
use crate::joint::{DEPTH, STEP_OF_BLOCK, base_output, solution};
use crate::types::{DiagnosticsC, OutputC, SolutionC, StatusC, flag};
use crate::{NULL, OK, VALUE, answer, bytes, code_of};

/// 64-bit words of `gmhm_gear`.
pub const GEAR_WORDS: usize = 64;

const _: () = assert!(
    size_of::<GearC>() <= 8 * GEAR_WORDS && align_of::<GearC>() <= align_of::<u64>(),
    "a gear does not fit into GMHM_GEAR_WORDS of gmhm.h"
);

/// `gmhm_gear`.
#[derive(Debug)]
pub struct GearC {
    force: Option<Force>,
    path: Option<State<f32, DEPTH>>,
    flags: u32,
    largest_step_rad: f32,
    diagnostics: Diagnostics,
    /// Of the path, as counted last.
    merged_pairs: u32,
}

/// What is in force. Steps are taken by the gear of the inverse, whose gate is that of the gear.
#[derive(Debug)]
struct Force {
    facts: Facts,
    period_s: f32,
    joint: JointRecord,
    unit: TorqueUnit,
    inverse: Inverse<f32>,
}

/// The gear of a good block. A frame of its own: firmware has little stack.
#[inline(never)]
fn prepare(block: &Block<'_>, unit: TorqueUnit) -> Result<Prepared<f32, AnyLaw<f32>>, BlockError> {
    Prepared::of_block_in(block, DEPTH, unit)
}

impl GearC {
    fn empty() -> Self {
        Self {
            force: None,
            path: None,
            flags: flag::NOT_LOADED,
            largest_step_rad: STEP_OF_BLOCK,
            diagnostics: Diagnostics::default(),
            merged_pairs: 0,
        }
    }

    fn load(&mut self, block: &[u8], unit: TorqueUnit) -> Result<(), u16> {
        let block = verify_first(block).map_err(|error| error.code())?;
        let prepared = prepare(&block, unit);
        self.diagnostics.see_load(prepared.as_ref().map(|prepared| prepared.self_test));
        let prepared = prepared.map_err(|error| code_of(&error))?;
        let joint = JointRecord::of_block(&block).map_err(|error| error.code())?;
        let inverse = prepared.inverse;
        if let (Some(before), Some(state)) = (&self.force, &mut self.path) {
            inverse.gear().take_over(before.inverse.gear(), state);
        }
        let (facts, period_s) = (Facts::of_block(&block), block.header().period_s);
        self.force = Some(Force { facts, period_s, joint, unit, inverse });
        self.flags = 0;
        Ok(())
    }

    fn gear(&self, force: &Force) -> Gear<f32> {
        force.inverse.gear().with_largest_step(self.largest_step_rad)
    }

    fn restart(&mut self) {
        self.path = None;
        self.merged_pairs = 0;
        self.flags = if self.force.is_some() { 0 } else { flag::NOT_LOADED };
    }

    fn step(&mut self, deflection_rad: f32) -> Option<OutputC> {
        let gear = self.gear(self.force.as_ref()?);
        let (output, state) = match &mut self.path {
            Some(state) => (gear.step(state, deflection_rad), &*state),
            none => {
                let state = gear.start(deflection_rad);
                // A start that is none leaves the start to the next sample.
                if state.status().refused {
                    let output = base_output(gear.output(&state), &state);
                    self.diagnostics.see_sample(&state.status());
                    self.flags = output.flags;
                    return Some(output);
                }
                (gear.output(&state), &*none.insert(state))
            }
        };
        self.diagnostics.see_sample(&state.status());
        let merged = gear.merged_pairs(state);
        self.diagnostics.see_merged_pairs(self.merged_pairs, merged);
        self.merged_pairs = merged;
        let output = base_output(output, state);
        self.flags = output.flags;
        Some(output)
    }

    fn invert(&mut self, torque_nm: f32) -> Option<SolutionC> {
        let inverse = &self.force.as_ref()?.inverse;
        let found = match &self.path {
            Some(state) => inverse.peek(state, torque_nm),
            None => inverse.start::<DEPTH>(torque_nm).1,
        };
        self.diagnostics.see_solution(&found);
        Some(solution(&found, true))
    }

    fn status(&self) -> Option<StatusC> {
        let Force { facts, period_s, joint, unit, inverse } = self.force.as_ref()?;
        let gear = inverse.gear();
        let at_rest = gear.start::<DEPTH>(0.0);
        let state = self.path.as_ref().unwrap_or(&at_rest);
        let status = facts.status(gear, state).in_joint(joint, *unit);
        Some(StatusC { period_s: *period_s, range_rad: inverse.range(), flags: self.flags, ..status })
    }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: no other symbol of the program has this name; gmhm.h reserves the prefix.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_gear_init(gear: Option<&mut MaybeUninit<GearC>>, block: *const u8, length: u32) -> u16 {
    let Some(gear) = gear else { return NULL };
    let gear = gear.write(GearC::empty());
    // SAFETY: the caller's, as above.
    unsafe { gmhm_gear_load(Some(gear), block, length) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_gear_load(gear: Option<&mut GearC>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above.
    unsafe { load(gear, block, length, TorqueUnit::NewtonMetre) }
}

/// See `gmhm.h`.
///
/// # Safety
/// The pointers are null or point to as much as `gmhm.h` says.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gmhm_gear_load_amperes(gear: Option<&mut GearC>, block: *const u8, length: u32) -> u16 {
    // SAFETY: the caller's, as above.
    unsafe { load(gear, block, length, TorqueUnit::Ampere) }
}

/// # Safety
/// As [`bytes`].
unsafe fn load(gear: Option<&mut GearC>, block: *const u8, length: u32, unit: TorqueUnit) -> u16 {
    // SAFETY: the caller's, as above.
    let (Some(gear), Some(block)) = (gear, unsafe { bytes(block, length) }) else { return NULL };
    gear.load(block, unit).err().unwrap_or(OK)
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_set_largest_step(gear: Option<&mut GearC>, largest_step_rad: f32) -> u16 {
    let Some(gear) = gear else { return NULL };
    // A NaN compares false.
    if largest_step_rad >= 0.0 {
        gear.largest_step_rad = largest_step_rad;
        OK
    } else {
        VALUE
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_restart(gear: Option<&mut GearC>) {
    if let Some(gear) = gear {
        gear.restart();
    }
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_step(
    gear: Option<&mut GearC>,
    deflection_rad: f32,
    to: Option<&mut MaybeUninit<OutputC>>,
) -> u32 {
    answer(to, || gear?.step(deflection_rad))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_invert(
    gear: Option<&mut GearC>,
    torque_nm: f32,
    to: Option<&mut MaybeUninit<SolutionC>>,
) -> u32 {
    answer(to, || gear?.invert(torque_nm))
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_get_status(gear: Option<&GearC>, to: Option<&mut MaybeUninit<StatusC>>) -> u32 {
    answer(to, || gear?.status())
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_get_diagnostics(gear: Option<&GearC>, to: Option<&mut MaybeUninit<DiagnosticsC>>) -> u16 {
    let (Some(gear), Some(to)) = (gear, to) else { return NULL };
    to.write(DiagnosticsC::of(&gear.diagnostics));
    OK
}

/// See `gmhm.h`.
// SAFETY: as for `gmhm_gear_init`.
#[unsafe(no_mangle)]
pub extern "C" fn gmhm_gear_clear_diagnostics(gear: Option<&mut GearC>) {
    if let Some(gear) = gear {
        gear.diagnostics.clear();
    }
}
