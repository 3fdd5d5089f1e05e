//! Backlash: the output may move without the input, such as in an Oldham coupling (6 to 17 arc seconds).
//!
//! Shape `clearance`: θ_measured = θ + b sgn(T). Where neither sign agrees with the torque it leads to, the parts are in the gap: T = 0, and θ rests where the torque
//! crosses zero. T is the torque T_base that the gear transmits at θ.
//!
//! Shape `play`: θ = play_b(θ_measured), that is θ ← clamp(θ, θ_measured − b, θ_measured + b), from θ = θ_measured at the start.

use super::physics::Physics;
use super::read::{Reader, TermError};
use super::registry::{Coordinate, Domain, KeyInfo, KindInfo, Need, Side};
use crate::scalar::Float;

const SHAPE: KeyInfo = KeyInfo::choice("shape", &["clearance", "play"], "how θ follows θ_measured");
const HALF_GAP: KeyInfo =
    KeyInfo::shape("half_gap_rad", "rad", "b, half the lost motion").at_least_zero().within(1e-6, 1e-3);

/// The most evaluations of the gear for one sample in the gap.
const MOST_TRIALS: usize = 64;

/// A gap between measured and true deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct Backlash<S> {
    clearance: bool,
    half_gap: S,
}

/// Where the parts were last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BacklashState<S> {
    theta: Option<S>,
    pushed_down: bool,
}

impl<S: Float> Physics<S> for Backlash<S> {
    const INFO: KindInfo = KindInfo {
        name: "backlash",
        side: Side::Plant,
        domain: Domain::Deflection,
        equation: "θ_measured = θ + b sgn(T), or θ = play_b(θ_measured)",
        coordinates: &[Coordinate::Deflection, Coordinate::Reversal],
        needs: &[Need::Deflection],
        keys: &[SHAPE, HALF_GAP],
        hides_behind: "soft_windup, coulomb_friction",
        instructions: 319,
    };
    type State = BacklashState<S>;

    fn read(reader: &Reader<'_, S>) -> Result<Self, TermError> {
        Ok(Self { clearance: reader.choice(&SHAPE)? == 0, half_gap: reader.number(&HALF_GAP)? })
    }

    fn needs_besides(&self) -> &'static [Need] {
        if self.clearance { &[Need::Gear] } else { &[] }
    }

    fn follows_base(&self) -> bool {
        self.clearance
    }

    fn correct(&self, state: &mut BacklashState<S>, measured: S, transmitted: &dyn Fn(S) -> S) -> S {
        if !measured.is_finite() || self.half_gap <= S::ZERO {
            return measured;
        }
        let theta = if self.clearance {
            self.clearance(state, measured, transmitted)
        } else {
            state.theta.unwrap_or(measured).clamp(measured - self.half_gap, measured + self.half_gap)
        };
        state.theta = Some(theta);
        theta
    }
}

impl<S: Float> Backlash<S> {
    fn clearance(&self, state: &mut BacklashState<S>, measured: S, transmitted: &dyn Fn(S) -> S) -> S {
        let (low, high) = (measured - self.half_gap, measured + self.half_gap);
        // The side of the last contact first: mostly it still holds, and one evaluation does.
        let mut ends = [S::ZERO; 2];
        for falling in [state.pushed_down, !state.pushed_down] {
            let end = if falling { high } else { low };
            let torque = transmitted(end);
            if (falling && torque < S::ZERO) || (!falling && torque > S::ZERO) {
                state.pushed_down = falling;
                return end;
            }
            ends[usize::from(falling)] = torque;
        }
        rest(state.theta, [(low, ends[0]), (high, ends[1])], transmitted)
    }
}

/// The zero crossing of the torque between two deflections, by false position (Illinois); where the parts are if it is zero there already.
fn rest<S: Float>(last: Option<S>, [mut below, mut above]: [(S, S); 2], transmitted: &dyn Fn(S) -> S) -> S {
    let tolerance = S::from_f64(1e-13) * (above.1 - below.1);
    let mut guess = last.filter(|theta| below.0 <= *theta && *theta <= above.0);
    let mut kept = S::ZERO;
    let mut theta = below.0;
    for _ in 0..MOST_TRIALS {
        let slope = above.1 - below.1;
        let secant = if slope > S::ZERO { below.0 - below.1 * (above.0 - below.0).over(slope) } else { below.0 };
        let first = guess.take();
        theta = first.unwrap_or(secant).clamp(below.0, above.0);
        let torque = transmitted(theta);
        if torque.abs() <= tolerance {
            break;
        }
        let (end, sense) = if torque < S::ZERO { (&mut below, -S::ONE) } else { (&mut above, S::ONE) };
        if end.0 == theta && first.is_none() {
            break;
        }
        *end = (theta, torque);
        // The same end twice: the other one counts half.
        if kept == sense {
            let other = if sense > S::ZERO { &mut below } else { &mut above };
            other.1 = S::HALF * other.1;
        }
        kept = sense;
    }
    theta
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clearance_crosses_the_gap_at_zero_torque() {
        // A spring of 1 that crosses zero at 0.3.
        let spring = |theta: f64| theta - 0.3;
        let backlash = Backlash { clearance: true, half_gap: 0.5 };
        let mut state = BacklashState::default();
        let path = [2.0, 1.0, 0.79, 0.5, 0.3, -0.19, -0.21, -1.0, 0.0, 0.81];
        let theta = path.map(|measured| backlash.correct(&mut state, measured, &spring));
        let expected = [1.5, 0.5, 0.3, 0.3, 0.3, 0.3, 0.29, -0.5, 0.3, 0.31];
        for (x, y) in theta.into_iter().zip(expected) {
            assert!(libm::fabs(x - y) < 1e-12, "{theta:?}");
        }
    }

    #[test]
    fn a_play_follows_by_its_half_width() {
        let backlash = Backlash { clearance: false, half_gap: 0.5 };
        let mut state = BacklashState::default();
        let theta = [0.0, 1.0, 0.6, 0.0, -0.5, f64::NAN, 0.25].map(|m| backlash.correct(&mut state, m, &|_| 0.0));
        assert_eq!(theta[..5], [0.0, 0.5, 0.5, 0.5, 0.0]);
        assert!(theta[5].is_nan());
        assert_eq!(theta[6], 0.0);
    }

    #[test]
    fn torques_that_are_none_end_too() {
        let backlash = Backlash { clearance: true, half_gap: 0.5_f32 };
        for torque in [f32::NAN, f32::INFINITY, 0.0] {
            let theta = backlash.correct(&mut BacklashState::default(), 1.0, &|_| torque);
            assert!((0.5..=1.5).contains(&theta));
        }
    }
}
