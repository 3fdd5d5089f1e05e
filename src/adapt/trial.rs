//! Adapted parameters in the shadow of those in force, and the sequential test between them.
//!
//! Each stretch is predicted before it is learnt from. With L(x) the squared error of coefficients x over a stretch, offset and delay of the signal taken out, over the variance of
//! the noise,
//!
//! ```text
//! Λ ← max(0, Λ + clamp((L(in force) − L(shadow))/2, ±4))         take over where Λ ≥ ln(1/α)·2^n, n times given back
//! B ← max(0, B + clamp((L(in force) − L(block))/2, ±4))          give back where B ≥ 6
//! ```
//!
//! (L(in force) − L(shadow))/2 is the logarithm of a likelihood ratio, whose exponential has the mean 1 while the parameters in force are the truth: that Λ passes ln(1/α) within a run
//! that begins at a given stretch has then the probability α at most (Ville's inequality), so takeovers come less often than α a stretch (Lorden 1971).
//!
//! An offset is taken out of L, so coefficients could predict changes better and the level worse. Therefore the plain squared error, offset and all, must not have grown over the run of Λ
//! either, and parameters are given back as soon as their plain error over the last [`RECENT`] stretches is 0.5 % above the block's.

use core::hint::black_box;

use super::Coefficients;
use crate::scalar::Float;

/// No stretch counts for more.
const LARGEST_LEAD: f64 = 4.0;
/// B at which parameters are given back.
const GIVE_BACK: f64 = 6.0;
/// Stretches that the plain squared error is held over.
pub const RECENT: f64 = 60.0;
/// The plain squared error may be this many times the block's: 0.5 % in rms.
const LARGEST_PLAIN_RATIO: f64 = 1.01;
/// n stops here.
const MOST_RETURNS: u8 = 6;

/// Squared errors over a stretch, what no row explains apart: of the rows of coefficients, and of those of offset and delay.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Losses<S> {
    freed: S,
    nuisance: S,
}

impl<S: Float> Losses<S> {
    /// Adds what is left of a row.
    pub(super) fn note(&mut self, left: S, of_coefficients: bool) {
        let of = if of_coefficients { &mut self.freed } else { &mut self.nuisance };
        *of = *of + left * left;
    }
}

/// What a stretch decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Change {
    /// The parameters in force stay.
    #[default]
    None,
    /// Adapted parameters are to be taken over: [`Adaptation::params`](super::Adaptation::params).
    TakenOver,
    /// The block's own parameters are to be put back in force.
    GivenBack,
}

/// The test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trial<S> {
    pub(super) in_force: Coefficients<S>,
    /// Whether a bound holds the shadow.
    pub(super) held: bool,
    /// Whether anything but the block is in force.
    pub(super) adapted: bool,
    returns: u8,
    lead: S,
    plain_lead: S,
    block_lead: S,
    /// Plain squared errors of those in force, and of the block.
    recent: [S; 2],
}

impl<S: Float> Trial<S> {
    pub(super) fn new() -> Self {
        let zero = [S::ZERO; super::COEFFICIENTS];
        Self {
            in_force: zero,
            held: false,
            adapted: false,
            returns: 0,
            lead: S::ZERO,
            plain_lead: S::ZERO,
            block_lead: S::ZERO,
            recent: [S::ZERO; 2],
        }
    }

    /// Decides after a stretch, of which these were the losses: of those in force, of the shadow, of the block. `threshold` is ln(1/α), `candidate` the shadow.
    #[inline(never)]
    pub(super) fn decide(
        &mut self,
        threshold: S,
        variance: S,
        unexplained: S,
        candidate: &Coefficients<S>,
        [in_force, shadow, block]: &[Losses<S>; 3],
    ) -> Change {
        let most = S::from_f64(LARGEST_LEAD);
        let share = S::HALF.over(variance);
        let gain = |than: &Losses<S>| ((in_force.freed - than.freed) * share).clamp(-most, most);
        let plain = |of: &Losses<S>| of.freed + of.nuisance + unexplained;
        let keep = S::from_f64(1.0 - 1.0 / RECENT);
        self.recent = [self.recent[0] * keep + plain(in_force), self.recent[1] * keep + plain(block)];
        self.lead = (self.lead + gain(shadow)).max(S::ZERO);
        self.plain_lead =
            if self.lead > S::ZERO { self.plain_lead + (plain(in_force) - plain(shadow)) } else { S::ZERO };
        self.block_lead = if self.adapted { (self.block_lead + gain(block)).max(S::ZERO) } else { S::ZERO };
        if self.adapted {
            let [now, before] = self.recent;
            if self.block_lead >= S::from_f64(GIVE_BACK) || now > before * S::from_f64(LARGEST_PLAIN_RATIO) {
                self.give_back();
                return Change::GivenBack;
            }
        }
        let mut needed = threshold;
        for _ in 0..black_box(self.returns) {
            needed = needed + needed;
            black_box(());
        }
        if self.lead >= needed && self.plain_lead >= S::ZERO {
            (self.in_force, self.adapted) = (*candidate, true);
            self.begin();
            return Change::TakenOver;
        }
        Change::None
    }

    /// Puts the block back in force.
    pub(super) fn give_back(&mut self) {
        (self.in_force, self.adapted) = ([S::ZERO; super::COEFFICIENTS], false);
        self.returns = (self.returns + 1).min(MOST_RETURNS);
        self.begin();
    }

    /// A test of others begins.
    fn begin(&mut self) {
        (self.lead, self.plain_lead, self.block_lead) = (S::ZERO, S::ZERO, S::ZERO);
        self.recent = [S::ZERO; 2];
    }
}
