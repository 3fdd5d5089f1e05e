//! One gear as C sees it: parameters in force and the path so far.

use gmhm::block::{Block, BlockError, CheckedTerms, GEAR, JointRecord, Parameters, Prepared, TorqueUnit, verify_first};
use gmhm::diagnostics::{Diagnostics, SelfTest};
use gmhm::memory::AnyLaw;
use gmhm::terms::Sample;
use gmhm::terms::compensated::{CompensatedPast, CompensatedView, LastSample, Total};
use gmhm::terms::feedforward::{CompensatedInverseView, Trial};
use gmhm::{Gear, Inverse, Output, Solution, State};

use crate::facts::Facts;
use crate::pair::PairC;
use crate::terms::{MOST, Terms};
use crate::types::{Answer, DiagnosticsC, OutputC, SampleC, SolutionC, StatusC, flag, need, status_flags, sum};
use crate::{PLACES, code_of};

/// Turning points that a joint remembers.
pub(crate) const DEPTH: usize = 16;
/// The largest step of a gear that was told none: that of its block, where this counts as none.
pub(crate) const STEP_OF_BLOCK: f32 = -1.0;

/// `gmhm_joint`.
#[derive(Debug)]
pub struct Joint {
    force: Option<Force>,
    path: Option<Path>,
    terms: Terms,
    flags: u32,
    largest_step_rad: f32,
    diagnostics: Diagnostics,
}

/// What is in force.
#[derive(Debug)]
struct Force {
    facts: Facts,
    period_s: f32,
    joint: JointRecord,
    unit: TorqueUnit,
    base: Base,
}

/// The path so far. Without terms the base model goes alone, at its constant period and lowest cost.
struct Path {
    gear: State<f32, DEPTH>,
    /// With terms.
    last: LastSample<f32>,
}

impl core::fmt::Debug for Path {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Path").finish_non_exhaustive()
    }
}

impl Force {
    fn sample(&self, sample: &SampleC) -> Sample<f32> {
        sample.after(self.period_s)
    }
}

/// The parameters of a good block, its terms only checked.
pub(crate) struct Loaded {
    self_test: SelfTest,
    base: Base,
    terms: CheckedTerms<MOST>,
}

/// A gear, with its inverse where it has one.
#[derive(Debug)]
enum Base {
    Gear(Gear<f32>),
    Inverse(Inverse<f32>),
}

impl Base {
    fn gear(&self) -> &Gear<f32> {
        match self {
            Self::Gear(gear) => gear,
            Self::Inverse(inverse) => inverse.gear(),
        }
    }

    fn inverse(&self) -> Option<&Inverse<f32>> {
        match self {
            Self::Gear(_) => None,
            Self::Inverse(inverse) => Some(inverse),
        }
    }
}

/// How a block is set up.
pub(crate) type SetUp = fn(&Block<'_>, TorqueUnit) -> Result<Loaded, BlockError>;

/// By the words that the host has computed, nothing of it in double precision. A frame of its own, gone before the terms are set up: firmware has little stack.
#[inline(never)]
pub(crate) fn prepared(block: &Block<'_>, unit: TorqueUnit) -> Result<Loaded, BlockError> {
    let prepared = Prepared::<f32, AnyLaw<f32>>::of_block_in(block, DEPTH, unit)?;
    let terms = prepared.terms(block)?;
    Ok(Loaded { self_test: prepared.self_test, base: Base::Inverse(prepared.inverse), terms })
}

/// From what the block says of gear and inverse, in double precision. A frame of its own, as above.
#[inline(never)]
pub(crate) fn any(block: &Block<'_>, unit: TorqueUnit) -> Result<Loaded, BlockError> {
    let parameters = Parameters::<f32, AnyLaw<f32>, CheckedTerms<MOST>>::of_any_block(block, DEPTH, unit)?;
    let Parameters { self_test, gear, inverse, terms, .. } = parameters;
    let base = match (inverse, gear) {
        (Some(inverse), _) => Base::Inverse(inverse),
        (None, Some(gear)) => Base::Gear(gear),
        (None, None) => return Err(BlockError::Missing(GEAR.tag)),
    };
    Ok(Loaded { self_test, base, terms })
}

impl Joint {
    /// No parameters in force.
    pub(crate) fn empty(terms: Terms) -> Self {
        Self {
            force: None,
            path: None,
            terms,
            flags: flag::NOT_LOADED,
            largest_step_rad: STEP_OF_BLOCK,
            diagnostics: Diagnostics::default(),
        }
    }

    /// Puts a block in force whose torques are counted in a unit; the code where it is refused.
    pub(crate) fn load(&mut self, block: &[u8], unit: TorqueUnit, set_up: SetUp) -> Result<(), u16> {
        let block = verify_first(block).map_err(|error| error.code())?;
        let loaded = set_up(&block, unit);
        self.diagnostics.see_load(loaded.as_ref().map(|loaded| loaded.self_test));
        let Loaded { base, terms, .. } = loaded.map_err(|error| code_of(&error))?;
        let joint = JointRecord::of_block(&block).map_err(|error| error.code())?;
        if !self.terms.have_room(&terms) {
            return Err(PLACES);
        }
        let (facts, period_s) = (Facts::of_block(&block), block.header().period_s);
        self.adopt(Force { facts, period_s, joint, unit, base }, &terms, &block);
        self.flags = 0;
        Ok(())
    }

    /// Takes over what a good block says. A frame of its own: firmware has little stack.
    #[inline(never)]
    fn adopt(&mut self, force: Force, terms: &CheckedTerms<MOST>, block: &Block<'_>) {
        let before = self.terms.load(terms, block);
        let (stack, states, _) = self.terms.all(before);
        if let (Some(Path { gear, last }), Some(earlier)) = (&mut self.path, &self.force) {
            let now = CompensatedView { base: force.base.gear(), stack };
            now.take_over(earlier.base.gear(), &mut CompensatedPast { gear, terms: states, last }, before);
            if before == 0 {
                *last = now.last_of(gear);
            }
        }
        self.force = Some(force);
    }

    /// The gear with the step that it was told.
    fn gear(&self, force: &Force) -> Gear<f32> {
        force.base.gear().with_largest_step(self.largest_step_rad)
    }

    /// A step from raw counts: the block's ratio and zero are applied, deflection and angles are written into the sample.
    pub(crate) fn step_counts(&mut self, pair: &mut PairC, motor: u32, output: u32, sample: &SampleC) -> OutputC {
        let Some(force) = &self.force else { return OutputC::not_loaded() };
        if self.path.is_none() {
            pair.restart();
        }
        let Some(pair) = pair.of_block(force.facts.crc(), &force.joint, force.base.gear().frame().rated()) else {
            return OutputC { flags: flag::NO_ENCODERS, ..OutputC::default() };
        };
        let sample = pair.sample(motor, output, sample);
        self.step(&sample)
    }

    /// Says whether it is a step.
    pub(crate) fn set_largest_step(&mut self, largest_step_rad: f32) -> bool {
        // A NaN compares false.
        let is_step = largest_step_rad >= 0.0;
        if is_step {
            self.largest_step_rad = largest_step_rad;
        }
        is_step
    }

    pub(crate) fn restart(&mut self) {
        self.path = None;
        self.flags = if self.force.is_some() { 0 } else { flag::NOT_LOADED };
    }

    pub(crate) fn step(&mut self, sample: &SampleC) -> OutputC {
        let Some(force) = &self.force else { return OutputC::not_loaded() };
        let gear = self.gear(force);
        let before = self.path.as_ref().map_or(0, |path| gear.merged_pairs(&path.gear));
        let output = if self.terms.is_empty() {
            match &mut self.path {
                Some(Path { gear: state, .. }) => base_output(gear.step(state, sample.deflection_rad), state),
                none => {
                    let state = gear.start(sample.deflection_rad);
                    let output = base_output(gear.output(&state), &state);
                    // A start that is none leaves the start to the next sample.
                    if !state.status().refused {
                        *none = Some(Path { gear: state, last: LastSample::default() });
                    }
                    output
                }
            }
        } else {
            let sample = force.sample(sample);
            let (stack, terms, _) = self.terms.parts();
            let view = CompensatedView { base: &gear, stack };
            match &mut self.path {
                Some(Path { gear: state, last }) => {
                    let total = view.step(&mut CompensatedPast { gear: state, terms, last }, &sample);
                    total_output(&total, state)
                }
                none => {
                    let (state, last) = view.start(terms, &sample);
                    let output = total_output(last.total(), &state);
                    if !last.total().refused {
                        *none = Some(Path { gear: state, last });
                    }
                    output
                }
            }
        };
        if let Some(Path { gear: state, .. }) = &self.path {
            self.diagnostics.see_sample(&state.status());
            self.diagnostics.see_merged_pairs(before, gear.merged_pairs(state));
        }
        self.flags = output.flags;
        output
    }

    pub(crate) fn diagnostics(&self) -> DiagnosticsC {
        DiagnosticsC::of(&self.diagnostics)
    }

    pub(crate) fn clear_diagnostics(&mut self) {
        self.diagnostics.clear();
    }

    pub(crate) fn invert(&mut self, torque_nm: f32, sample: Option<&SampleC>) -> SolutionC {
        let none = |flags| SolutionC { deflection_rad: 0.0, flags };
        let Some(force) = &self.force else { return none(flag::NOT_LOADED) };
        let Some(inverse) = force.base.inverse() else { return none(flag::NO_INVERSE) };
        let base = match (&self.path, sample) {
            (Some(path), Some(sample)) if !self.terms.is_empty() => {
                let (stack, terms, trial) = self.terms.parts();
                let sample = force.sample(sample);
                let view = CompensatedInverseView { base: inverse, stack };
                let solved = view.solve((&path.gear, terms), Trial::in_places(trial), torque_nm, &sample);
                self.diagnostics.see_solution(&solved.gear);
                let solution = solution(&solved.gear, solved.converged);
                return SolutionC { deflection_rad: solved.measured, ..solution };
            }
            (Some(path), _) => inverse.peek(&path.gear, torque_nm),
            (None, _) => inverse.start::<DEPTH>(torque_nm).1,
        };
        self.diagnostics.see_solution(&base);
        solution(&base, true)
    }

    pub(crate) fn status(&self) -> StatusC {
        let Some(Force { facts, period_s, joint, unit, base }) = &self.force else { return StatusC::not_loaded() };
        let gear = base.gear();
        let at_rest = gear.start::<DEPTH>(0.0);
        let state = self.path.as_ref().map_or(&at_rest, |path| &path.gear);
        StatusC {
            period_s: *period_s,
            range_rad: base.inverse().map_or(0.0, Inverse::range),
            needs: need::bits(&self.terms.view()),
            flags: self.flags,
            ..facts.status(gear, state).in_joint(joint, *unit)
        }
    }
}

pub(crate) fn solution(solution: &Solution<f32>, converged: bool) -> SolutionC {
    let flags = [
        (solution.refused, flag::REFUSED),
        (solution.saturated, flag::SATURATED),
        (!solution.converged || !converged, flag::NOT_CONVERGED),
    ];
    SolutionC { deflection_rad: solution.theta, flags: sum(&flags) }
}

pub(crate) fn base_output(output: Output<f32>, state: &State<f32, DEPTH>) -> OutputC {
    let status = state.status();
    OutputC {
        torque_nm: output.torque,
        elastic_nm: output.elastic,
        hysteresis_nm: output.hysteresis,
        terms_nm: 0.0,
        deflection_rad: state.theta(),
        flags: status_flags(status.refused, &status),
    }
}

fn total_output(total: &Total<f32>, state: &State<f32, DEPTH>) -> OutputC {
    OutputC {
        torque_nm: total.torque,
        elastic_nm: total.base.elastic,
        hysteresis_nm: total.base.hysteresis,
        terms_nm: total.terms,
        deflection_rad: total.deflection,
        flags: status_flags(total.refused, &state.status()),
    }
}
