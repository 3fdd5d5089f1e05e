//! Adaptation on the drive: the coefficients of law `masing` follow the gear, bounded and reversible.
//!
//! Given the path of the deflection, law `masing` is linear in five coefficients (MODEL.md section 3), here normalised by the rated deflection A and the torque scale T_A:
//!
//! ```text
//! τ = x·k        x = [u, u³, u⁵, −u·g(u), η]        k = [c1·A, c2·A³, c3·A⁵, e·A, h·A]/T_A        u = θ/A
//! ```
//!
//! η, the loop shape, follows the path alone. So recursive least squares on k needs the deflection and a torque, measured or estimated, and nothing else. What the coefficients do
//! not change, such as the torque of terms, is taken off the torque before.
//!
//! | part | file | what |
//! |---|---|---|
//! | blocks and stretches | `stretch` | samples become rows; offset and delay of the signal are taken out |
//! | supervision | `supervision` | which stretches are fit to be learnt from |
//! | estimate | `filter` | recursive least squares, square-root form, forgetting by direction |
//! | bounds | `bounds` | what may ever be in force |
//! | trial | `trial` | the shadow beside those in force: sequential test, takeover, return |
//! | health | `health`, `warnings` | drift beyond its uncertainty, latched |
//! | loops | `kernel` | what all of these do to five numbers, once in flash |
//!
//! **Samples.** One beyond 4σ of the mean residual of the block before gets the weight 4σ/abs(r) (Huber), one that is not finite 0. σ is that of the samples about that mean.
//!
//! **Blocks** of [`BLOCK_S`] average the samples. **Stretches** end after [`SHORTEST_S`] as soon as the block's torque has moved over [`LEAST_SPAN`] of T_A; one that has not after
//! [`LONGEST_S`] is dropped. So standing still, tiny amplitudes and slow drifts of the signal teach nothing. A stretch's offset and delay are free, so steady loads teach nothing either, and a
//! loop that a delay explains as well as h does is not taken for h.
//!
//! **Work** is spread: a block is worked in beside the samples of the next, a stretch takes some 60 periods, one piece each, in which no samples are taken. Periods longer than 1 ms do as many pieces as
//! they have milliseconds.
//!
//! **Coloured noise.** The variance v of the rows is learnt from their innovations from stretch to stretch, not only from the residuals within one: what the noise does at the pace of the motion, and
//! what the law misses, counts in full. A row is learnt from only where it tells at least [`LEAST_TOLD`] times what the prior (standard deviation: half the largest change) did.
//!
//! **What cannot be told.** A torque signal of another scale looks exactly as a gear with all coefficients greater: their common factor is bounded, and beyond 3 % reported as
//! [`Warning::ScaleOrGear`]. An offset of the signal looks, under steady load, as another stiffness: so it is not learnt from there.
//!
//! **Bounds, takeover, return, false alarms** are stated in their files and measured in `docs/adaptation.md`. Nothing here writes a memory that lasts.
//!
//! Units: rad, N·m. Fixed point is out of scope: a Cortex-M0 has no adaptation.
//!
//! ```
//! use gmhm::adapt::{Adaptation, Change, Settings};
//! use gmhm::memory::masing::Masing;
//! use gmhm::{Elastic, Gear, Memory, Params};
//!
//! let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
//! let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
//! let block = Params::new(1.168e-3, elastic, memory)?;
//!
//! let gear = Gear::<f32, _>::with_law(&block, Masing::new(&block));
//! let mut path = gear.start::<16>(0.0);
//! let adaptation = Adaptation::<f32>::new(&block, &Settings::default())?;
//! let mut adapted = adaptation.start();
//! let mut in_force = block;
//! for k in 0..100_000 {
//!     let deflection = 1.1e-3 * (k as f32 * 5e-3).sin();
//!     let torque = 1.1 * gear.step(&mut path, deflection).torque; // a gear that is a tenth stiffer than its block
//!     if adaptation.period(&mut adapted, &path, torque) == Change::TakenOver {
//!         in_force = adaptation.params(&adapted, &block)?;
//!     }
//! }
//! assert!((in_force.elastic().c1_nm_per_rad / 2.4737e4 - 1.1).abs() < 0.01);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod bounds;
mod filter;
mod health;
mod kernel;
mod settings;
mod stretch;
mod supervision;
mod trial;
mod warnings;

pub use settings::{AdaptError, Settings};
pub use trial::Change;
pub use warnings::{Warning, Warnings};

use core::hint::black_box;

use crate::elastic::{Elastic, Polynomial};
use crate::gear::State;
use crate::memory::Frame;
use crate::memory::masing::{LoopPath, Masing, Path};
use crate::params::{Law, Memory, ParamError, Params};
use crate::scalar::Float;
use bounds::Bounds;
use filter::Estimate;
use health::{Health, Passed};
use kernel::{add, dot};
use stretch::{ROWS, Stretch, Sums};
use supervision::{Noise, Supervision};
use trial::{Losses, Trial};

/// How many coefficients law `masing` is linear in.
pub const COEFFICIENTS: usize = 5;

/// c1·A, c2·A³, c3·A⁵, e·A, h·A over T_A, or changes of them.
pub type Coefficients<S> = [S; COEFFICIENTS];

/// Seconds of a block.
pub const BLOCK_S: f64 = 0.025;
/// Seconds of a stretch at least, and blocks at least.
pub const SHORTEST_S: f64 = 1.0;
/// Seconds after which a stretch that moved too little is dropped.
pub const LONGEST_S: f64 = 20.0;
/// What the block's torque must move over within a stretch, of T_A.
pub const LEAST_SPAN: f64 = 0.2;
/// How many times what the prior told of its direction a row must tell.
pub const LEAST_TOLD: f64 = 4.0;
/// What is unknown of the loop may shrink by this within a stretch, of T_A.
const KNOWN_LOOP: f64 = 0.005;
/// Blocks of a stretch at least.
const FEWEST_BLOCKS: f64 = 30.0;

/// The adaptation of a gear; what it has learnt is apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptation<S> {
    frame: Frame<S>,
    block: Coefficients<S>,
    /// 1/T_A in output units.
    inverse_torque: S,
    /// Samples of a block.
    samples: u16,
    /// Pieces of work in a period.
    pieces: u16,
    /// A quarter of the samples of a block.
    least_weight: S,
    fewest_blocks: S,
    most_blocks: S,
    /// κ of the [filter].
    drift: S,
    /// Prior variance of each coefficient.
    prior: S,
    /// What multiplies changes of the coefficients in their common factor γ = Σ p·(x·δ)/Σ p² over the rated cycle.
    common: Coefficients<S>,
    bounds: Bounds<S>,
    health: Health<S>,
    supervision: Supervision<S>,
    /// ln(1/α).
    threshold: S,
}

/// What is to be done next: on a block beside the samples, on a stretch instead of them, one piece a period (of 1 ms; more in a longer one).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    None,
    /// The pending block into a row, from an entry on.
    Rotate(u8, u8),
    Begin,
    /// A row.
    Weigh(u8),
    Judge,
    Free(u8),
    Shrink,
    /// A row.
    Compare(u8),
    Decide,
    Look,
    Share,
    /// A row, and a step.
    Forget(u8, u8),
    /// A row, and two columns.
    Learn(u8, u8),
    /// A row.
    Row(u8),
    Spread(u8),
    WatchOffset,
    WatchDelay,
    Check,
    End,
}

impl Work {
    /// Whether samples are taken beside it.
    fn is_beside(self) -> bool {
        matches!(self, Self::None | Self::Rotate(..))
    }
}

/// What the adaptation of one joint has learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptationState<S> {
    sums: Sums<S>,
    samples: u16,
    work: Work,
    stretch: Stretch<S>,
    estimate: Estimate<S>,
    trial: Trial<S>,
    losses: [Losses<S>; 3],
    noise: Noise<S>,
    warnings: Warnings,
    passed: Passed,
    /// The block's torque at the last sample, and its range over the stretch.
    last: S,
    range: [S; 2],
    /// How far the loop's torque may be off over the stretch, for want of its past.
    unknown: S,
    /// Whether the last sample was taken, and whether the path lets it be.
    continues: bool,
    known: bool,
}

impl<S: Float> Adaptation<S> {
    /// The adaptation of the gear of a block's parameters.
    ///
    /// # Errors
    /// [`AdaptError`]: a setting out of range, a law other than `masing`.
    pub fn new(block: &Params, settings: &Settings) -> Result<Self, AdaptError> {
        settings.check()?;
        if block.memory().law != Law::Masing {
            return Err(AdaptError::Law(block.memory().law));
        }
        let frame = Frame::new(block);
        let coefficients = coefficients(block);
        let samples = libm::round(BLOCK_S / settings.period_s).clamp(1.0, 10_000.0);
        let block_s = samples * settings.period_s;
        let blocks = |seconds: f64| libm::ceil(seconds / block_s).clamp(FEWEST_BLOCKS, 60_000.0);
        let deviation = 0.5 * settings.largest_change;
        let drift = settings.drift / deviation;
        let common = common(&frame, &coefficients);
        Ok(Self {
            frame,
            block: coefficients,
            inverse_torque: S::from_f64(1.0 / block.torque_scale_nm()),
            samples: samples as u16,
            pieces: libm::ceil(settings.period_s / 1e-3 - 1e-6).clamp(1.0, 1000.0) as u16,
            least_weight: S::from_f64(0.25 * samples),
            fewest_blocks: S::from_f64(blocks(SHORTEST_S)),
            most_blocks: S::from_f64(blocks(LONGEST_S)),
            drift: S::from_f64(drift * drift),
            prior: S::from_f64(deviation * deviation),
            common,
            bounds: Bounds::new(&coefficients, S::from_f64(settings.largest_change)),
            health: Health::new(&coefficients, &common),
            supervision: Supervision::new(settings),
            threshold: S::from_f64(-libm::log(settings.false_acceptance)),
        })
    }

    /// Nothing learnt yet: the block is in force.
    pub fn start(&self) -> AdaptationState<S> {
        AdaptationState {
            sums: Sums::default(),
            samples: 0,
            work: Work::None,
            stretch: Stretch::new(),
            estimate: Estimate::new(self.prior),
            trial: Trial::new(),
            losses: [Losses::default(); 3],
            noise: Noise::new(),
            warnings: Warnings::default(),
            passed: Passed::default(),
            last: S::ZERO,
            range: [S::ZERO; 2],
            unknown: S::from_f64(S::LARGEST),
            continues: false,
            known: false,
        }
    }

    /// One control period: the gear after its step along the measured deflection, and the torque at the same time, N·m, terms taken off. Says what becomes of the parameters in force; the
    /// caller then changes them by [`take_over`](crate::feedforward::FeedForward::take_over).
    #[inline]
    pub fn period<L: LoopPath<S>, const N: usize>(
        &self,
        state: &mut AdaptationState<S>,
        gear: &State<S, N, L>,
        torque: S,
    ) -> Change {
        if !state.work.is_beside() {
            return self.work(state);
        }
        // The first period of a block looks back instead.
        if let Work::Rotate(number, from) = state.work
            && state.samples > 0
        {
            self.rotate(state, number, from);
        }
        let status = gear.status();
        let Some(path) = L::path(gear.memory()) else { return Change::None };
        if state.samples == 0 {
            self.look_back(state, path);
        }
        let theta = gear.theta();
        let taken = state.known && !(status.out_of_range || status.refused || status.quarantined || status.restarted);
        if taken {
            let u = self.frame.fraction(theta);
            let [a, b, c] = Polynomial::columns(u);
            let [d, e] = Masing::columns(&self.frame, path, theta);
            let x = [a, b, c, d, e];
            let p = dot(&x, &self.block);
            let residual = torque * self.inverse_torque - p;
            let weight = self.supervision.weigh(&mut state.noise, residual, &mut state.warnings);
            if weight > S::ZERO {
                let slope = if state.continues { p - state.last } else { S::ZERO };
                state.sums.add(weight, slope, &x, residual);
                state.range = [state.range[0].min(p), state.range[1].max(p)];
            }
            state.last = p;
        }
        state.continues = taken;
        state.samples += 1;
        if state.samples < self.samples {
            return Change::None;
        }
        self.end_block(state)
    }

    /// Whether the past of the loop lets the next block be learnt from.
    ///
    /// What is unknown of it stays the same while the deflection keeps within the places that it has been to: an offset of η, which a stretch is free of. Beyond them it changes.
    #[inline(never)]
    fn look_back<const N: usize>(&self, state: &mut AdaptationState<S>, path: &Path<S, N>) {
        let unknown = path.start_uncertainty(&self.frame) * self.block[4];
        if state.unknown - unknown > S::from_f64(KNOWN_LOOP) {
            state.unknown = unknown;
            self.begin_stretch(state);
            state.work = Work::None;
        }
        state.known = !path.is_merged();
    }

    /// The block is whole. The one before is worked in by then, unless blocks are shorter than that takes: then all its work is done here.
    #[inline(never)]
    fn end_block(&self, state: &mut AdaptationState<S>) -> Change {
        let sums = core::mem::take(&mut state.sums);
        let mut change = Change::None;
        while state.work != Work::None {
            let now = self.piece(state);
            change = if now == Change::None { change } else { now };
        }
        state.samples = 0;
        // A block without a quarter of its samples says too little.
        if sums.weight >= self.least_weight {
            state.noise.centre = sums.mean();
            state.stretch.push(&sums);
            state.work = Work::Rotate(0, 0);
        }
        change
    }

    /// As many pieces of work as the period has milliseconds.
    #[inline]
    fn work(&self, state: &mut AdaptationState<S>) -> Change {
        let mut change = Change::None;
        for _ in 0..self.pieces {
            if state.work == Work::None {
                break;
            }
            let now = self.piece(state);
            change = if now == Change::None { change } else { now };
        }
        change
    }

    /// A step of the pending block into the triangle; after the last, says whether the stretch is whole.
    #[inline(always)]
    fn rotate(&self, state: &mut AdaptationState<S>, number: u8, from: u8) {
        if state.stretch.rotate(usize::from(number), usize::from(from)) {
            state.work = Work::Rotate(number, from + 2);
        } else if usize::from(number) + 1 < ROWS {
            state.work = Work::Rotate(number + 1, 0);
        } else {
            self.end_rotation(state);
        }
    }

    #[inline(never)]
    fn end_rotation(&self, state: &mut AdaptationState<S>) {
        state.stretch.count();
        let moved = state.range[1] - state.range[0] >= S::from_f64(LEAST_SPAN);
        let blocks = state.stretch.blocks;
        let whole = blocks >= self.fewest_blocks && moved;
        state.work = if whole { Work::Begin } else { Work::None };
        if !whole && blocks >= self.most_blocks {
            self.begin_stretch(state);
        }
    }

    #[inline(never)]
    fn piece(&self, state: &mut AdaptationState<S>) -> Change {
        let AdaptationState { sums, stretch, estimate, trial, losses, noise, warnings, .. } = state;
        match state.work {
            Work::None => {}
            Work::Rotate(number, from) => self.rotate(state, number, from),
            Work::Begin => {
                *sums = Sums::default();
                *losses = [Losses::default(); 3];
                // An offset of the signal is no part of its moments.
                state.work = Work::Weigh(1);
            }
            Work::Weigh(number) => {
                let (_, x, y) = stretch.row(usize::from(number));
                let p = dot(&x, &self.block);
                let [square, product, ..] = &mut sums.x;
                (*square, *product) = (*square + p * p, *product + p * y);
                state.work = if usize::from(number) + 1 < ROWS { Work::Weigh(number + 1) } else { Work::Judge };
            }
            Work::Judge => {
                let fit = self.supervision.judge(noise, stretch, [sums.x[0], sums.x[1]], warnings);
                sums.x = estimate.value;
                if !fit {
                    self.begin_stretch(state);
                }
                state.work = if fit { Work::Free(0) } else { Work::None };
            }
            Work::Free(number) => {
                Bounds::lift(&self.block, estimate, &mut sums.x, usize::from(number));
                state.work = if number == 0 { Work::Free(1) } else { Work::Shrink };
            }
            Work::Shrink => {
                trial.held = self.bounds.shrink(&self.block, &self.common, &mut sums.x);
                state.work = Work::Compare(0);
            }
            Work::Compare(number) => {
                let (_, x, y) = stretch.row(usize::from(number));
                let of_coefficients = usize::from(number) >= stretch::NUISANCE;
                let predicted = [dot(&x, &trial.in_force), dot(&x, &sums.x), S::ZERO];
                for (losses, predicted) in losses.iter_mut().zip(predicted) {
                    losses.note(y - predicted, of_coefficients);
                }
                state.work = if usize::from(number) + 1 < ROWS { Work::Compare(number + 1) } else { Work::Decide };
            }
            Work::Decide => {
                state.work = Work::Look;
                if !noise.holds() {
                    let change = trial.decide(self.threshold, noise.variance, stretch.unexplained, &sums.x, losses);
                    warnings.latch(change == Change::TakenOver && trial.held, Warning::Bound);
                    return change;
                }
            }
            Work::Look => {
                estimate.look();
                state.work = Work::Share;
            }
            Work::Share => {
                estimate.share(self.prior);
                state.work = Work::Forget(stretch::NUISANCE as u8, 0);
            }
            Work::Forget(number, step) => {
                if step == 0 {
                    sums.weight = self.tell(noise.variance, stretch, number);
                    let learns = !noise.holds() && sums.weight >= S::from_f64(LEAST_TOLD);
                    state.work = if learns { Work::Forget(number, 1) } else { Self::after(number) };
                    return Change::None;
                }
                let columns = match step {
                    1 => {
                        let row = stretch.scratch();
                        sums.weight = estimate.begin_forgetting(self.prior, self.drift, row, sums.weight, &mut sums.x);
                        0..0
                    }
                    2 => 2..COEFFICIENTS,
                    _ => 0..2,
                };
                for column in black_box(columns).rev() {
                    estimate.forget(column, &mut sums.weight, &mut sums.x);
                }
                state.work = Work::Forget(number, step + 1);
                if step == 3 {
                    (sums.weight, sums.x) = (S::ONE, [S::ZERO; COEFFICIENTS]);
                    state.work = Work::Learn(number, 0);
                }
            }
            Work::Learn(number, from) => {
                let [.., value] = stretch.pending;
                let row = stretch.scratch();
                for column in black_box(from..from + 2) {
                    estimate.learn(usize::from(column), row, &mut sums.weight, &mut sums.x);
                }
                state.work = Work::Learn(number, from + 2);
                if usize::from(from) + 2 >= COEFFICIENTS {
                    let surprise = estimate.follow(row, value, sums.weight, &sums.x);
                    noise.note(surprise, sums.weight);
                    state.work = Self::after(number);
                }
            }
            Work::Row(number) => {
                (_, sums.x, _) = stretch.row(usize::from(number));
                state.work = Work::Spread(number);
            }
            Work::Spread(number) => {
                sums.weight = estimate.spread(&sums.x);
                state.work = if number == 0 { Work::WatchOffset } else { Work::WatchDelay };
            }
            Work::WatchOffset => {
                self.supervision.watch_offset(noise, stretch, estimate, sums.weight, warnings);
                state.work = Work::Row(1);
            }
            Work::WatchDelay => {
                self.supervision.watch_delay(noise, stretch, estimate, sums.weight, warnings);
                state.work = Work::Check;
            }
            Work::Check => {
                if let Some(warning) = self.health.check(estimate, &mut state.passed) {
                    warnings.latch(true, warning);
                }
                state.work = Work::End;
            }
            Work::End => {
                self.begin_stretch(state);
                state.work = Work::None;
            }
        }
        Change::None
    }

    /// Puts a row of a stretch and its value, over the deviation of the noise, into the place to work in. Returns rᵀP_0r.
    #[inline]
    fn tell(&self, variance: S, stretch: &mut Stretch<S>, number: u8) -> S {
        let (_, row, value) = stretch.row(usize::from(number));
        let scale = variance.sqrt().recip();
        let mut scaled = [S::ZERO; COEFFICIENTS];
        add(&mut scaled, &row, scale);
        *stretch.scratch() = scaled;
        let [.., last] = &mut stretch.pending;
        *last = value * scale;
        self.prior * dot(&scaled, &scaled)
    }

    /// What follows the learning of a row.
    fn after(number: u8) -> Work {
        if usize::from(number) + 1 < ROWS { Work::Forget(number + 1, 0) } else { Work::Row(0) }
    }

    #[inline(never)]
    fn begin_stretch(&self, state: &mut AdaptationState<S>) {
        (state.stretch, state.sums, state.samples) = (Stretch::new(), Sums::default(), 0);
        state.noise.begin_stretch();
        state.continues = false;
        state.range = [state.last; 2];
    }

    /// The parameters in force: the block's with the changes that were taken over. e and h become α, β and ω with the block's β² + ω².
    ///
    /// # Errors
    /// Rounding brought them to the edge of what [`Params::new`] accepts.
    pub fn params(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &state.trial.in_force)
    }

    /// The parameters of the shadow, bounds kept: what a host may commit.
    ///
    /// # Errors
    /// As [`params`](Self::params).
    pub fn shadow(&self, state: &AdaptationState<S>, block: &Params) -> Result<Params, ParamError> {
        changed(block, &self.shadow_change(state))
    }

    /// Changes of the normalised coefficients of the shadow, bounds kept.
    pub fn shadow_change(&self, state: &AdaptationState<S>) -> Coefficients<S> {
        let mut change = state.estimate.value;
        Bounds::lift(&self.block, &state.estimate, &mut change, 0);
        Bounds::lift(&self.block, &state.estimate, &mut change, 1);
        self.bounds.shrink(&self.block, &self.common, &mut change);
        change
    }
}

impl<S: Float> AdaptationState<S> {
    /// Changes of the normalised coefficients in force, zero while the block is.
    pub fn in_force(&self) -> &Coefficients<S> {
        &self.trial.in_force
    }

    /// Whether adapted parameters are in force.
    pub fn is_taken_over(&self) -> bool {
        self.trial.adapted
    }

    /// The estimated changes of the normalised coefficients, bounds not applied.
    pub fn estimate(&self) -> &Coefficients<S> {
        &self.estimate.value
    }

    /// Variances of the [estimate](Self::estimate).
    pub fn variances(&self) -> Coefficients<S> {
        self.estimate.variances()
    }

    /// What is latched.
    pub fn warnings(&self) -> Warnings {
        self.warnings
    }

    /// Whether the next period takes its sample: not while a stretch is worked on.
    pub fn takes_samples(&self) -> bool {
        self.work.is_beside()
    }

    /// Stretches that were fit to be learnt from.
    pub fn stretches(&self) -> u32 {
        self.noise.stretches
    }

    /// Clears the latched warnings.
    pub fn clear_warnings(&mut self) {
        self.warnings = Warnings::default();
    }

    /// Variance of the rows that are learnt from, of T_A².
    pub fn variance(&self) -> S {
        self.noise.variance
    }

    /// The parameters in force could not be taken over: the block stays.
    pub fn give_back(&mut self) {
        self.trial.give_back();
    }
}

/// The normalised coefficients of parameters.
fn coefficients<S: Float>(params: &Params) -> Coefficients<S> {
    let Polynomial { k1, k3, k5 } =
        params.elastic().normalised(params.rated_deflection_rad(), params.torque_scale_nm());
    let Masing { e, h, .. } = Masing::<S>::new(params);
    [S::from_f64(k1), S::from_f64(k3), S::from_f64(k5), e, h]
}

/// A block's parameters with changes of their normalised coefficients. e and h become α, β and ω with the block's β² + ω².
///
/// # Errors
/// What [`Params::new`] does not accept.
pub fn changed<S: Float>(block: &Params, change: &Coefficients<S>) -> Result<Params, ParamError> {
    let [k1, k3, k5, e, h] = change.map(S::to_f64);
    let a = block.rated_deflection_rad();
    let unit = block.torque_scale_nm() / a;
    let (elastic, memory) = (block.elastic(), block.memory());
    let elastic = Elastic {
        c1_nm_per_rad: elastic.c1_nm_per_rad + k1 * unit,
        c2_nm_per_rad3: elastic.c2_nm_per_rad3 + k3 * unit / (a * a),
        c3_nm_per_rad5: elastic.c3_nm_per_rad5 + k5 * unit / (a * a * a * a),
    };
    let (e, h) = ((memory.e() + e * unit).max(0.0), (memory.h() + h * unit).max(0.0));
    let speed = libm::sqrt(memory.beta_per_s * memory.beta_per_s + memory.omega_per_s * memory.omega_per_s);
    let size = libm::sqrt(e * e + h * h);
    let memory = if size > 0.0 {
        let per_unit = speed / size;
        Memory { alpha: size * speed, beta_per_s: e * per_unit, omega_per_s: h * per_unit, ..memory }
    } else {
        Memory { alpha: 0.0, ..memory }
    };
    Params::new(a, elastic, memory)
}

/// γ's row: Σ p·x/Σ p² over both branches of the rated cycle.
fn common<S: Float>(frame: &Frame<S>, block: &Coefficients<S>) -> Coefficients<S> {
    const POINTS: u8 = 16;
    let (mut sums, mut square) = ([S::ZERO; COEFFICIENTS], S::ZERO);
    for point in 0..=POINTS {
        let u = S::from_f64(f64::from(point) / f64::from(POINTS / 2) - 1.0);
        let theta = frame.deflection(u);
        for side in [S::ONE, -S::ONE] {
            let [a, b, c] = Polynomial::columns(u);
            let x = [a, b, c, -(u * frame.gate(theta)), (S::ONE - u * u).signed(side)];
            let p = dot(&x, block);
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum = *sum + p * x;
            }
            square = square + p * p;
        }
    }
    sums.map(|sum| sum.over(square))
}
