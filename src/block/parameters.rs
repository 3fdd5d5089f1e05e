//! What a drive computes with: the gear, its inverse and its terms, from a block.

use super::Word;
use super::agreement::check_set_up;
use super::error::BlockError;
use super::header::{Header, TorqueUnit};
use super::joint::{Joint, JointRecord};
use super::law::{BlockLaw, check_law, number};
use super::layout::{GEAR, INVERSE, LARGEST_STEP, MASING, MAY_SKIP, PHASE, RECORDS, SELF_TEST, TERM_TAGS, TIME};
use super::prepared::{PreparedLaw, within};
use super::record::{Block, Record, double, verify};
use super::scales::{Scales, ScalesRecord};
use super::self_test::{IS_COMPARED, SAMPLES, samples};
use super::term::TermRecord;
use crate::diagnostics::SelfTest;
use crate::drive::{Mounting, Setup, SetupError};
use crate::elastic::{Elastic, ElasticTorque, Polynomial};
use crate::feedforward::{FeedForward, FeedForwardError, Limits};
use crate::gear::Gear;
use crate::inverse::{Inverse, Monotony};
use crate::memory::{AnyLaw, Frame};
use crate::params::{Memory, Params};
use crate::scalar::Float;
use crate::terms::{Compensated, Setting, Side, Stack, Term, TermError};

/// Parameters in force: computed once, immutable, for any number of states.
///
/// `S` is the scalar, `L` the law (of another one a block is refused) and `T` takes the terms: a [`Stack`] in `f32`, or `()` for firmware that computes
/// none, which refuses blocks that have some.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters<S: Word = f32, L = AnyLaw<S>, T = Stack<f32, 8>> {
    /// The header of the block.
    pub header: Header,
    /// The CRC-32 of the block.
    pub crc: u32,
    /// The gear; `None` for a joint without motor-side angle.
    pub gear: Option<Gear<S, L>>,
    /// Its inverse, where it has one.
    pub inverse: Option<Inverse<S, L>>,
    /// The joint.
    pub joint: Joint,
    /// The gear's scales.
    pub scales: Option<Scales>,
    /// Whether the golden samples of the block were computed anew; one that differs refuses the block.
    pub self_test: SelfTest,
    /// All terms. Feed forward [`Stack::plant`] only.
    pub terms: T,
}

impl<S: Word, L: PreparedLaw<S>, T: TermStack> Parameters<S, L, T> {
    /// Verifies a block, checks every value and takes the set-up of gear and inverse that the block holds, as `gmhm pack` writes it for every gear with an inverse: nothing is computed in double precision.
    /// `stack_depth` is how many turning points the caller has room for. A block that counts torques in amperes is refused: [`of_block_in`](Self::of_block_in) takes it.
    ///
    /// Whatever the bytes, nothing panics, and an error leaves the caller with what it had.
    ///
    /// # Errors
    /// [`BlockError`]: bytes that are no block, another scalar or law, a gear without its set-up ([`load_any`](Self::load_any) takes it), more turning points or terms than there is room for, a record that
    /// is unknown, missing, twice or malformed, a value out of range.
    pub fn load(bytes: &[u8], stack_depth: usize) -> Result<Self, BlockError> {
        Self::of_block(&verify(bytes)?, stack_depth)
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
        Self::of(block, stack_depth, unit, stored_gear)
    }
}

impl<S: Word, L: BlockLaw<S>, T: TermStack> Parameters<S, L, T> {
    /// [`load`](Self::load) of a block that need not hold the set-up: a gear without an inverse, or a block of before. Gear and inverse are set up here, in double precision.
    ///
    /// # Errors
    /// As there.
    pub fn load_any(bytes: &[u8], stack_depth: usize) -> Result<Self, BlockError> {
        Self::of_any_block(&verify(bytes)?, stack_depth, TorqueUnit::NewtonMetre)
    }

    /// [`load_any`](Self::load_any) from a block that is verified, for code that counts torques in a unit.
    ///
    /// # Errors
    /// As there; [`BlockError::Unit`]: the block counts them in the other one.
    pub fn of_any_block(block: &Block<'_>, stack_depth: usize, unit: TorqueUnit) -> Result<Self, BlockError> {
        Self::of(block, stack_depth, unit, set_up_gear)
    }

    fn of(
        block: &Block<'_>,
        stack_depth: usize,
        unit: TorqueUnit,
        base: impl FnOnce(&Block<'_>) -> Result<Base<S, L>, BlockError>,
    ) -> Result<Self, BlockError> {
        let header = *block.header();
        if header.torque_unit != unit {
            return Err(BlockError::Unit(header.torque_unit));
        }
        if header.scalar != S::KIND {
            return Err(BlockError::Scalar(header.scalar.bytes()));
        }
        let joint = JointRecord::checked(block)?.joint();
        let mut parameters = Self {
            header,
            crc: block.crc(),
            gear: None,
            inverse: None,
            joint,
            scales: None,
            self_test: SelfTest::NotRun,
            terms: T::empty(Setting { sigma: joint.sigma(), c1: 0.0, rated_deflection: 0.0 }, false),
        };
        if block.only(&GEAR)?.is_some() {
            let scales = ScalesRecord::of_block(block)?;
            let (gear, inverse) = base(block)?;
            if usize::from(header.stack_depth) > stack_depth {
                return Err(BlockError::StackDepth(header.stack_depth));
            }
            if let (Some(samples), true) = (block.only(&SELF_TEST)?, IS_COMPARED) {
                test(&samples, &gear, inverse.as_ref())?;
                parameters.self_test = SelfTest::Passed;
            }
            (parameters.gear, parameters.inverse) = (Some(gear), inverse);
            // After the golden samples, which lie further apart.
            if let Some(record) = block.only(&LARGEST_STEP)? {
                let [step] = record.checked::<S, 1>(&LARGEST_STEP)?.map(number);
                parameters.gear = Some(gear.with_largest_step(step));
                parameters.inverse = inverse.map(|inverse| inverse.with_largest_step(step));
            }
            let k1 = S::KIND.number(gear.elastic().polynomial().k1.word());
            let (c1, rated_deflection) = (scales.stiffness_nm_per_rad(k1), scales.rated_deflection_rad());
            parameters.terms = T::empty(Setting { sigma: joint.sigma(), c1, rated_deflection }, true);
            parameters.scales = Some(scales.scales());
        } else {
            for info in [&MASING, &PHASE, &TIME, &INVERSE] {
                if block.only(info)?.is_some() {
                    return Err(BlockError::Missing(GEAR.tag));
                }
            }
        }
        for record in block.records().filter(|record| RECORDS.iter().all(|info| info.tag != record.tag)) {
            if !parameters.terms.take(&record)? && record.tag & MAY_SKIP == 0 {
                return Err(BlockError::Unknown(record.tag));
            }
        }
        if parameters.gear.is_none() && parameters.terms.is_empty() {
            return Err(BlockError::Missing(GEAR.tag));
        }
        Ok(parameters)
    }
}

impl<S: Word, L: BlockLaw<S>, T: TermStack> Parameters<S, L, T> {
    /// The feed-forward of the gear in force, computed in the scalar alone from what the block holds.
    ///
    /// # Errors
    /// [`FeedForwardError`]: limits that cannot be, no inverse, a law `time` for another control period than [`Limits::period_s`].
    pub fn feed_forward(&self, limits: &Limits<S>) -> Result<FeedForward<S, L>, FeedForwardError>
    where
        S: Float,
    {
        let inverse = self.inverse.as_ref().ok_or(FeedForwardError::NoInverse)?;
        let stored_s = self.header.period_s;
        if inverse.gear().law().knows_time() && limits.period_s.word() != stored_s.word() {
            return Err(FeedForwardError::Period { stored_s });
        }
        FeedForward::of_inverse(inverse, &within(limits, inverse.gear(), stored_s))
    }

    /// The encoders of the joint, the block's ratio, zero and rated deflection applied.
    ///
    /// # Errors
    /// [`SetupError`]: no gear, no ratio that is a fraction.
    pub fn encoders(&self, motor: Mounting, output: Mounting) -> Result<Setup, SetupError> {
        let scales = self.scales.ok_or(SetupError::Deflection)?;
        self.joint.encoders(motor, output, scales.rated_deflection_rad)
    }
}

impl<const K: usize> Parameters<f32, AnyLaw<f32>, Stack<f32, K>> {
    /// The parameters of a gear of law `masing`, as an adaptation (module `adapt`) begins from them: e and h with β² + ω² = 1 (rad/s)². `None` without gear, in another law, or where
    /// rounding brought them to the edge of what [`Params::new`] accepts.
    #[must_use]
    pub fn params(&self) -> Option<Params> {
        let (gear, scales) = (self.gear?, self.scales?);
        let AnyLaw::Masing(law) = gear.law() else { return None };
        let a = scales.rated_deflection_rad;
        let unit = scales.torque_scale_nm / a;
        let Polynomial { k1, k3, k5 } = gear.elastic().polynomial().cast::<f64>();
        let elastic = Elastic {
            c1_nm_per_rad: k1 * unit,
            c2_nm_per_rad3: k3 * unit / (a * a),
            c3_nm_per_rad5: k5 * unit / (a * a * a * a),
        };
        let [e, h] = [law.e, law.h].map(|of| f64::from(of) * unit);
        let alpha = libm::sqrt(e * e + h * h);
        let rates = if alpha > 0.0 { [e / alpha, h / alpha] } else { [0.0, 1.0] };
        let memory = Memory {
            alpha,
            beta_per_s: rates[0],
            omega_per_s: rates[1],
            reversal_play_rad: 2.0 * f64::from(law.half_play),
            ..Memory::default()
        };
        Params::new(a, elastic, memory).ok()
    }

    /// Gear and terms together; `None` without gear.
    #[must_use]
    pub fn compensated(&self) -> Option<Compensated<f32, AnyLaw<f32>, K>> {
        Some(Compensated { gear: self.gear?, stack: self.terms.clone() })
    }
}

/// Where the terms of a block go.
pub trait TermStack: Sized + crate::sealed::Sealed {
    /// No terms yet; T_base is that of a gear, or gravity and inertia without one.
    fn empty(setting: Setting<f32>, has_gear: bool) -> Self;

    /// Takes the term of a record, and says whether it is one.
    ///
    /// # Errors
    /// A term that cannot be, no room.
    fn take(&mut self, record: &Record<'_>) -> Result<bool, BlockError>;

    /// Whether there are none.
    fn is_empty(&self) -> bool;
}

impl<const K: usize> TermStack for Stack<f32, K> {
    fn empty(setting: Setting<f32>, has_gear: bool) -> Self {
        if has_gear { Self::of_gear(setting) } else { Self::of_joint(setting) }
    }

    fn take(&mut self, record: &Record<'_>) -> Result<bool, BlockError> {
        let Some(term) = TermRecord::decode(record) else { return Ok(false) };
        let refused = |error| BlockError::Term { tag: record.tag, error };
        let term = term?.term(self.setting()).map_err(refused)?;
        self.push(term).map_err(refused)?;
        Ok(true)
    }

    fn is_empty(&self) -> bool {
        self.terms().is_empty()
    }
}

/// Terms that are checked and counted, not kept: [`Parameters`] with them take a fraction of the stack that those with a [`Stack`] do. Once a block is accepted,
/// [`plant`](Self::plant) fills one in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedTerms<const K: usize> {
    setting: Setting<f32>,
    has_gear: bool,
    count: usize,
    plant_count: usize,
}

impl<const K: usize> CheckedTerms<K> {
    /// How many of them a drive feeds forward.
    #[must_use]
    pub fn plant_count(&self) -> usize {
        self.plant_count
    }

    /// σ of the joint.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        self.setting.sigma
    }

    /// Hands out the terms that a drive feeds forward, of the block that was loaded with these: for a program that has memory of its own for them.
    pub fn for_each_plant(&self, block: &Block<'_>, mut put: impl FnMut(Term<f32>)) {
        for record in block.records().filter(Record::is_plant_term) {
            // All of them were accepted before.
            if let Some(Ok(Ok(term))) =
                TermRecord::decode(&record).map(|record| record.map(|term| term.term(self.setting)))
            {
                put(term);
            }
        }
    }

    /// The terms that a drive feeds forward, of the block that was loaded with these.
    #[must_use]
    pub fn plant(&self, block: &Block<'_>) -> Stack<f32, K> {
        let mut stack = Stack::empty(self.setting, self.has_gear);
        self.plant_into(&mut stack, block);
        stack
    }

    /// [`plant`](Self::plant) in the place of other terms, without a second stack beside them.
    pub fn plant_into(&self, stack: &mut Stack<f32, K>, block: &Block<'_>) {
        stack.renew(self.setting, self.has_gear);
        self.for_each_plant(block, |term| {
            // There was room for all of them before.
            let _ = stack.push(term);
        });
    }
}

impl<const K: usize> TermStack for CheckedTerms<K> {
    fn empty(setting: Setting<f32>, has_gear: bool) -> Self {
        Self { setting, has_gear, count: 0, plant_count: 0 }
    }

    fn take(&mut self, record: &Record<'_>) -> Result<bool, BlockError> {
        let Some(term) = TermRecord::decode(record) else { return Ok(false) };
        let refused = |error| BlockError::Term { tag: record.tag, error };
        let term = term?;
        term.term(self.setting).map_err(refused)?;
        if self.count == K {
            return Err(refused(TermError::StackFull));
        }
        self.count += 1;
        self.plant_count += usize::from(term.info().side == Side::Plant);
        Ok(true)
    }

    fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl TermStack for () {
    fn empty(_: Setting<f32>, _: bool) -> Self {}

    fn take(&mut self, record: &Record<'_>) -> Result<bool, BlockError> {
        if TERM_TAGS.contains(&record.tag) { Err(BlockError::TermsNotComputed(record.tag)) } else { Ok(false) }
    }

    fn is_empty(&self) -> bool {
        true
    }
}

/// Computes the golden samples anew. A frame of its own: firmware has little stack.
#[inline(never)]
fn test<S: Word, L: BlockLaw<S>>(
    record: &Record<'_>,
    gear: &Gear<S, L>,
    inverse: Option<&Inverse<S, L>>,
) -> Result<(), BlockError> {
    let stored = record.checked::<S, SAMPLES>(&SELF_TEST)?;
    if stored == samples(gear, inverse) { Ok(()) } else { Err(BlockError::SelfTest) }
}

/// A gear and its inverse, where it has one.
type Base<S, L> = (Gear<S, L>, Option<Inverse<S, L>>);

/// Gear and inverse as the block holds their set-up, each word that it was computed from within its range.
#[inline(never)]
fn stored_gear<S: Word, L: PreparedLaw<S>>(block: &Block<'_>) -> Result<Base<S, L>, BlockError> {
    block.words::<S, 7>(&GEAR)?;
    check_law::<S>(block)?;
    let inverse = L::of_prepared(block)?;
    block.words::<S, 10>(&INVERSE)?;
    check_set_up(block)?;
    Ok((*inverse.gear(), Some(inverse)))
}

/// Gear and inverse, set up from what the block says of them.
#[inline(never)]
fn set_up_gear<S: Word, L: BlockLaw<S>>(block: &Block<'_>) -> Result<Base<S, L>, BlockError> {
    let [a0, a1, t0, t1, k1, k3, k5] = block.words::<S, 7>(&GEAR)?;
    let [rated_deflection_rad, torque_scale_nm] = [[a0, a1], [t0, t1]].map(double);
    let elastic = ElasticTorque::new(Polynomial { k1: number(k1), k3: number(k3), k5: number(k5) });
    let gear = Gear::of(Frame::of(rated_deflection_rad, torque_scale_nm), elastic, L::of_block(block)?);
    if block.only(&INVERSE)?.is_none() {
        return Ok((gear, None));
    }
    let [r0, r1, s0, s1, b0, b1, b2, b3, b4, b5] = block.words::<S, 10>(&INVERSE)?;
    let monotony = Monotony {
        reach: double([r0, r1]),
        least_slope: double([s0, s1]),
        bounds: [[b0, b1], [b2, b3], [b4, b5]].map(double),
    };
    let period_s = f64::from(block.header().period_s);
    Ok((gear, Some(Inverse::with_monotony(gear, torque_scale_nm, &monotony, period_s))))
}
