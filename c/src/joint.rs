//! One gear as C sees it: parameters in force and the path so far.

use gmhm::block::{Block, BlockError, CheckedTerms, GEAR, JointRecord, Parameters, Prepared, TorqueUnit, verify_first};
use gmhm::diagnostics::{Diagnostics, SelfTest};
use gmhm::memory::AnyLaw;
use gmhm::terms::compensated::{Compensated, CompensatedState, Total};
use gmhm::terms::{Sample, Setting, Stack};
use gmhm::{Gear, Inverse, Output, Solution, State};

use crate::facts::Facts;
use crate::pair::Pair;
use crate::types::{
    Answer, DiagnosticsC, EncodersC, OutputC, SampleC, SolutionC, StatusC, flag, need, status_flags, sum,
};

/// Turning points that a joint remembers.
pub(crate) const DEPTH: usize = 16;
/// The largest step of a gear that was told none: that of its block, where this counts as none.
pub(crate) const STEP_OF_BLOCK: f32 = -1.0;
/// Terms that it has room for.
pub(crate) const TERMS: usize = 8;

#[cfg(target_pointer_width = "32")]
const _: () = assert!(
    size_of::<gmhm::terms::Term<f32>>() == 264 && size_of::<gmhm::terms::TermState<f32>>() == 76,
    "docs/size.md and c/README.md say what a term takes"
);

/// Base model and terms.
type Model = Compensated<f32, AnyLaw<f32>, TERMS>;

/// `gmhm_joint`.
#[derive(Debug)]
pub struct Joint {
    force: Option<Force>,
    path: Path,
    flags: u32,
    largest_step_rad: f32,
    encoders: Option<Encoders>,
    /// The block's ratio and zero over these encoders.
    pair: Option<Pair>,
    diagnostics: Diagnostics,
    /// Of the path, as counted last.
    merged_pairs: u32,
}

/// What is in force.
#[derive(Debug)]
struct Force {
    facts: Facts,
    inverse: Option<Inverse<f32>>,
    /// The base model and the terms that a drive feeds forward.
    compensated: Model,
}

/// The path so far. Without terms the base model goes alone, at its constant period and lowest cost.
#[expect(clippy::large_enum_variant, reason = "nothing is allocated, and every joint has room for terms")]
enum Path {
    New,
    Base(State<f32, DEPTH>),
    WithTerms(CompensatedState<f32, DEPTH, AnyLaw<f32>, TERMS>),
}

impl core::fmt::Debug for Path {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::New => "New",
            Self::Base(_) => "Base",
            Self::WithTerms(_) => "WithTerms",
        })
    }
}

impl Path {
    /// Goes on with other parameters: reversals keep their deflections, their torques are computed anew.
    #[inline(never)]
    fn take_over(&mut self, before: &Gear<f32>, now: &Model) {
        match self {
            Self::New => {}
            Self::WithTerms(state) => now.take_over(before, state),
            Self::Base(state) => {
                now.gear.take_over(before, state);
                if !now.stack.terms().is_empty() {
                    self.take_terms(now);
                }
            }
        }
    }

    /// Goes on from a base model with terms at rest. A frame of its own, as above.
    #[inline(never)]
    fn take_terms(&mut self, now: &Model) {
        if let Self::Base(state) = self {
            *self = Self::WithTerms(now.resume(state.clone()));
        }
    }

    fn base(&self) -> Option<&State<f32, DEPTH>> {
        match self {
            Self::New => None,
            Self::Base(state) => Some(state),
            Self::WithTerms(state) => Some(state.gear()),
        }
    }
}

impl Force {
    fn sample(&self, sample: &SampleC) -> Sample<f32> {
        sample.after(self.facts.period_s())
    }
}

/// A gear, its encoders and their common measure: a program that tells no encoders links nothing of it.
type PairOf = fn(&JointRecord, f32, &EncodersC) -> Option<Pair>;

/// The encoders of a joint.
#[derive(Debug)]
struct Encoders {
    counts: EncodersC,
    pair_of: PairOf,
}

/// The parameters of a good block, its terms only checked.
pub(crate) struct Loaded {
    self_test: SelfTest,
    base: Base,
    terms: CheckedTerms<TERMS>,
}

/// A gear, with its inverse where it has one.
enum Base {
    Gear(Gear<f32>),
    Inverse(Inverse<f32>),
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
    let parameters = Parameters::<f32, AnyLaw<f32>, CheckedTerms<TERMS>>::of_any_block(block, DEPTH, unit)?;
    let Parameters { self_test, gear, inverse, terms, .. } = parameters;
    let base = match (inverse, gear) {
        (Some(inverse), _) => Base::Inverse(inverse),
        (None, Some(gear)) => Base::Gear(gear),
        (None, None) => return Err(BlockError::Missing(GEAR.tag)),
    };
    Ok(Loaded { self_test, base, terms })
}

/// The terms of a good block, in their place. A frame of its own, as above.
#[inline(never)]
pub(crate) fn plant(stack: &mut Stack<f32, TERMS>, terms: &CheckedTerms<TERMS>, block: &Block<'_>) {
    terms.plant_into(stack, block);
}

/// Of a stack that terms are planted into.
pub(crate) const NO_SETTING: Setting<f32> = Setting { sigma: 0.0, c1: 0.0, rated_deflection: 0.0 };

impl Joint {
    /// No parameters in force.
    pub(crate) fn empty() -> Self {
        Self {
            force: None,
            path: Path::New,
            flags: flag::NOT_LOADED,
            largest_step_rad: STEP_OF_BLOCK,
            encoders: None,
            pair: None,
            diagnostics: Diagnostics::default(),
            merged_pairs: 0,
        }
    }

    /// Puts a block in force whose torques are counted in a unit.
    pub(crate) fn load(&mut self, block: &[u8], unit: TorqueUnit, set_up: SetUp) -> Result<(), BlockError> {
        let block = verify_first(block)?;
        let loaded = set_up(&block, unit);
        self.diagnostics.see_load(loaded.as_ref().map(|loaded| loaded.self_test));
        let Loaded { base, terms, .. } = loaded?;
        let facts = Facts::of_block(&block)?;
        let before = self.force.as_ref().map(|force| force.compensated.gear);
        self.adopt(facts, &base);
        if let Some(force) = &mut self.force {
            plant(&mut force.compensated.stack, &terms, &block);
            if let Some(before) = &before {
                self.path.take_over(before, &force.compensated);
            }
        }
        self.flags = 0;
        self.pair = self.encoders.as_ref().and_then(|encoders| self.pair_of(encoders));
        Ok(())
    }

    /// Takes over what a good block says, but for its terms. A frame of its own, as above.
    #[inline(never)]
    fn adopt(&mut self, facts: Facts, base: &Base) {
        let (gear, inverse) = match base {
            Base::Gear(gear) => (gear, None),
            Base::Inverse(inverse) => (inverse.gear(), Some(*inverse)),
        };
        let gear = gear.with_largest_step(self.largest_step_rad);
        let force = self.force.get_or_insert_with(|| Force {
            facts,
            inverse: None,
            compensated: Compensated { gear, stack: Stack::of_gear(NO_SETTING) },
        });
        (force.facts, force.inverse, force.compensated.gear) = (facts, inverse, gear);
    }

    /// Says whether encoders and the block in force go together.
    pub(crate) fn set_encoders(&mut self, encoders: &EncodersC) -> bool {
        let encoders = Encoders { counts: *encoders, pair_of: Pair::new };
        let pair = self.pair_of(&encoders);
        if pair.is_some() {
            (self.encoders, self.pair) = (Some(encoders), pair);
        }
        pair.is_some()
    }

    fn pair_of(&self, encoders: &Encoders) -> Option<Pair> {
        let force = self.force.as_ref()?;
        (encoders.pair_of)(force.facts.joint(), force.compensated.gear.frame().rated(), &encoders.counts)
    }

    /// A step from raw counts: the block's ratio and zero are applied, deflection and angles are written into the sample.
    pub(crate) fn step_counts(&mut self, motor: u32, output: u32, sample: &SampleC) -> OutputC {
        let Some(pair) = &mut self.pair else { return OutputC { flags: flag::NO_ENCODERS, ..OutputC::default() } };
        let sample = pair.sample(motor, output, sample);
        self.step(&sample)
    }

    /// Says whether it is a step.
    pub(crate) fn set_largest_step(&mut self, largest_step_rad: f32) -> bool {
        // A NaN compares false.
        let is_step = largest_step_rad >= 0.0;
        if is_step {
            self.largest_step_rad = largest_step_rad;
            if let Some(force) = &mut self.force {
                force.compensated.gear = force.compensated.gear.with_largest_step(largest_step_rad);
            }
        }
        is_step
    }

    pub(crate) fn restart(&mut self) {
        self.path = Path::New;
        self.merged_pairs = 0;
        if let Some(pair) = &mut self.pair {
            pair.restart();
        }
        self.flags = if self.force.is_some() { 0 } else { flag::NOT_LOADED };
    }

    pub(crate) fn step(&mut self, sample: &SampleC) -> OutputC {
        let Some(force) = &self.force else { return OutputC::not_loaded() };
        let Compensated { gear, stack } = &force.compensated;
        let output = match &mut self.path {
            Path::New if stack.terms().is_empty() => {
                let state = gear.start(sample.deflection_rad);
                let output = base_output(gear.output(&state), &state);
                // A start that is none leaves the start to the next sample.
                if !state.status().refused {
                    self.path = Path::Base(state);
                }
                output
            }
            Path::New => {
                let state = force.compensated.start(&force.sample(sample));
                let output = total_output(state.last(), state.gear());
                if !state.last().refused {
                    self.path = Path::WithTerms(state);
                }
                output
            }
            Path::Base(state) => base_output(gear.step(state, sample.deflection_rad), state),
            Path::WithTerms(state) => {
                let total = force.compensated.step(state, &force.sample(sample));
                total_output(&total, state.gear())
            }
        };
        if let Some(state) = self.path.base() {
            self.diagnostics.see_sample(&state.status());
            let merged = gear.merged_pairs(state);
            self.diagnostics.see_merged_pairs(self.merged_pairs, merged);
            self.merged_pairs = merged;
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
        let Some(inverse) = &force.inverse else { return none(flag::NO_INVERSE) };
        let base = match (&self.path, sample) {
            (Path::WithTerms(state), Some(sample)) => {
                let solved = state.solve(inverse, &force.compensated.stack, torque_nm, &force.sample(sample));
                self.diagnostics.see_solution(&solved.gear);
                let solution = solution(&solved.gear, solved.converged);
                return SolutionC { deflection_rad: solved.measured, ..solution };
            }
            (Path::New, _) => inverse.start::<DEPTH>(torque_nm).1,
            (Path::Base(state), _) => inverse.peek(state, torque_nm),
            (Path::WithTerms(state), None) => inverse.peek(state.gear(), torque_nm),
        };
        self.diagnostics.see_solution(&base);
        solution(&base, true)
    }

    pub(crate) fn status(&self) -> StatusC {
        let Some(force) = &self.force else { return StatusC::not_loaded() };
        let Compensated { gear, stack } = &force.compensated;
        let at_rest = gear.start::<DEPTH>(0.0);
        let state = self.path.base().unwrap_or(&at_rest);
        StatusC {
            range_rad: force.inverse.as_ref().map_or(0.0, Inverse::range),
            needs: need::bits(stack),
            flags: self.flags,
            ..force.facts.status(gear, state)
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
