//! The worst call of the inverse along the test path.

use gmhm::inverse::Invertible;
use gmhm::memory::MemoryLaw;
use gmhm::scalar::Scalar;
use gmhm::{Gear, Inverse, State};

use crate::counter;
use crate::test_path::TestPath;

/// Turning points of a joint.
pub const POINTS: usize = 16;

/// Calls of a torque that may be the worst: enough that a tick of the counter is less than an instruction of each.
const REPETITIONS: u32 = 100;

/// By how much the reading of a single call may be short, ticks.
const BLUR: u32 = 2;

/// One call as a control loop makes it: the torque alone is wanted.
#[inline(never)]
pub fn step<S: Scalar, L: MemoryLaw<S>>(gear: &Gear<S, L>, state: &mut State<S, POINTS, L>, theta: S) -> S {
    gear.step(state, theta).torque
}

/// One call of the inverse: the deflection alone is wanted.
#[inline(never)]
pub fn peek<S: Scalar, L: Invertible<S>>(inverse: &Inverse<S, L>, state: &State<S, POINTS, L>, torque: S) -> S {
    inverse.peek(state, torque).theta
}

/// The state and the torque of worst of so many calls from a state on: torques of all sizes, nested loops, jumps across a full stack, the range exceeded.
/// `load` gives the torque for a share of the rated one.
#[inline(never)]
pub fn worst_case<S: Scalar, L: Invertible<S>>(
    inverse: &Inverse<S, L>,
    mut state: State<S, POINTS, L>,
    calls: u32,
    load: impl Fn(f64) -> S,
) -> (State<S, POINTS, L>, S) {
    let mut worst = (0, state.clone(), S::ZERO);
    let mut path = TestPath::new(1.0);
    for _ in 0..calls {
        let share = path.next_deflection();
        let torque = if share.abs() < 2.0 { load(f64::from(share)) } else { S::ZERO };
        let taken = |calls| counter::ticks(calls, &[torque], |torque| peek(inverse, &state, torque));
        if REPETITIONS * (taken(1) + BLUR) > worst.0 {
            let taken = taken(REPETITIONS);
            if taken > worst.0 {
                worst = (taken, state.clone(), torque);
            }
        }
        let theta = peek(inverse, &state, torque);
        step(inverse.gear(), &mut state, theta);
    }
    (worst.1, worst.2)
}
