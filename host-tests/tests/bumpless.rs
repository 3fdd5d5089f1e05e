//! Changes with the loop running: no step of the command beyond the stated slew.

use crate::common::servos::*;
use crate::common::*;
use gmhm::drive::{Gains, Reference, Servo, ServoSetup, ServoState};
use gmhm::feedforward::{Contribution, Controls, FeedForward, FeedForwardState, Settings, Source};
use gmhm::memory::AnyMemory;
use gmhm::{Elastic, Gate, Gear, Kernel, Law, Memory, Params, State};
use proptest::prelude::*;

type Fed = FeedForward<f64>;

fn settings() -> Settings {
    Settings {
        period_s: PERIOD_S,
        ramp_s: RAMP_S,
        offset_slew_rad_per_s: 20.0 * A,
        torque_slew_nm_per_s: 100.0,
        ..Settings::default()
    }
}

/// A gear whose numbers are all others.
fn other() -> Params {
    let elastic = Elastic { c1_nm_per_rad: 1.3 * 2.4737e4, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 };
    let memory = Memory { alpha: 1.9e6, beta_per_s: 300.0, omega_per_s: 260.0, ..Memory::default() };
    Params::new(1.2 * A, elastic, memory).expect("a gear")
}

struct Run {
    fed: Fed,
    state: FeedForwardState<f64, 16>,
    largest: [f64; 2],
}

impl Run {
    fn step(&mut self, controls: &Controls<f64>, torque: f64, deflection: f64) -> Contribution<f64> {
        let before = *self.state.contribution();
        let now = self.fed.step(&mut self.state, controls, &gmhm::feedforward::Demand { torque, deflection });
        for (largest, change) in
            self.largest.iter_mut().zip([now.offset - before.offset, now.hysteresis - before.hysteresis])
        {
            *largest = largest.max(change.abs());
        }
        now
    }
}

/// At 20 N·m of feed-forward: everything that may be changed is, and neither contribution ever changes by more than its slew limit.
#[test]
fn nothing_that_changes_steps_the_contribution() {
    for source in [Source::Reference, Source::Measurement] {
        let gears = [masing(), other(), params(Law::Phase, Kernel::Deflection, Gate::Cycle), masing()];
        let gears = gears.map(|params| Fed::new(&params, &settings()).expect("an inverse"));
        let mut controls = Controls { on: true, source, ratio: 1.0 };
        let state = gears[0].start(0.0);
        let mut run = Run { fed: gears[0], state, largest: [0.0; 2] };
        let hold = |run: &mut Run, controls: &Controls<f64>, count: u32| {
            for _ in 0..count {
                run.step(controls, 20.0, 0.8e-3);
            }
        };
        hold(&mut run, &controls, 300);
        for next in &gears[1..] {
            next.take_over(&run.fed, &mut run.state);
            run.fed = *next;
            let at_once = run.step(&controls, 20.0, 0.8e-3);
            assert!(at_once.change.abs() <= 20.0 * A * PERIOD_S * (1.0 + 1e-9));
            hold(&mut run, &controls, 300);
            // The blend is over: this is what the parameters say.
            let settled = *run.state.contribution();
            assert!(!settled.slewing);
        }
        run.fed.restart(&mut run.state, 0.8e-3);
        hold(&mut run, &controls, 300);
        for (on, ratio) in [(false, 1.0), (true, 1.0), (true, 0.3), (true, f64::NAN), (true, 1.0)] {
            (controls.on, controls.ratio) = (on, ratio);
            hold(&mut run, &controls, 150);
        }
        assert!(run.largest[0] <= 20.0 * A * PERIOD_S * (1.0 + 1e-9), "{source:?}: {:?}", run.largest);
        assert!(run.largest[1] <= 100.0 * PERIOD_S * (1.0 + 1e-9), "{source:?}: {:?}", run.largest);
        assert!(run.largest[0] > 0.0);
    }
}

/// Without slew limits the blend of the ramp alone bounds the step.
#[test]
fn without_slew_limits_the_ramp_bounds_the_step() {
    let of = |params: &Params| {
        let settings = Settings { period_s: PERIOD_S, ramp_s: RAMP_S, ..Settings::default() };
        Fed::new(params, &settings).expect("an inverse")
    };
    let (first, second) = (of(&masing()), of(&other()));
    let mut run = Run { fed: first, state: first.start(0.0), largest: [0.0; 2] };
    let controls = Controls { on: true, source: Source::Reference, ratio: 1.0 };
    for _ in 0..500 {
        run.step(&controls, 20.0, 0.0);
    }
    let before = run.state.contribution().offset;
    second.take_over(&first, &mut run.state);
    (run.fed, run.largest) = (second, [0.0; 2]);
    for _ in 0..500 {
        run.step(&controls, 20.0, 0.0);
    }
    let gap = (run.state.contribution().offset - before).abs();
    assert!(gap > 0.1 * A && run.largest[0] < 1.05 * gap * PERIOD_S / RAMP_S, "{gap}: {:?}", run.largest);
}

fn points(state: &State<f64, N>) -> Vec<f64> {
    match state.memory() {
        AnyMemory::Masing(path) => path.turning_points().iter().map(|point| point.theta).collect(),
        _ => Vec::new(),
    }
}

proptest! {
    #[test]
    fn reversals_keep_their_angles_and_take_new_torques(p in any_masing(), q in any_masing(), turns in corners(1.0, 2..20), to in -1.0..1.0f64) {
        // As if the new gear had made the turns that are remembered.
        let q = Params::new(1.25 * A, q.elastic(), q.memory()).expect("a gear");
        let (old, new) = (Gear::<f64>::new(&p), Gear::<f64>::new(&q));
        let mut state = after(&old, &turns);
        let kept = points(&state);
        new.take_over(&old, &mut state);
        prop_assert_eq!(points(&state), kept);
        let mut twin = after(&new, &turns);
        let (a, b) = (new.step(&mut state, to * A), new.step(&mut twin, to * A));
        prop_assert!((a.torque - b.torque).abs() < 1e-9 * q.torque_scale_nm(), "{} for {}", a.torque, b.torque);
    }

    #[test]
    fn the_same_parameters_change_nothing(turns in corners(1.2, 2..20), to in -1.0..1.0f64) {
        for p in every_law() {
            let gear = Gear::<f64>::with_period(&p, 1e-3).expect("a period");
            let mut state = after(&gear, &turns);
            let mut twin = state.clone();
            gear.take_over(&gear, &mut state);
            let (a, b) = (gear.step(&mut state, to * A), gear.step(&mut twin, to * A));
            prop_assert!((a.torque - b.torque).abs() < 1e-9 * p.torque_scale_nm());
        }
    }
}

/// The torque of a servo whose gains, gear and start all change at a standing error.
#[test]
fn a_servo_takes_over_without_a_step() {
    let first = servo(&masing());
    let stiff = Gains { position_per_s: 80.0, velocity_nms_per_rad: 0.2, ..gains() };
    let second = Servo::<f32>::new(&other(), &ServoSetup { gains: stiff, ..setup() }).expect("a servo");
    let (motor, output) = counts(0.0, 0.0);
    let mut state: ServoState<f32, 16> = first.start(motor, output, 0);
    let controls = Controls { on: true, source: Source::Reference, ratio: 1.0 };
    let reference = Reference { counts: 0, torque: 20.0, feed_forward: 0.0 };
    let mut torque = 0.0;
    let run = |servo: &Servo<f32>, state: &mut ServoState<f32, 16>, count: u32, torque: &mut f32| {
        (0..count).fold(0.0_f32, |largest, _| {
            let before = std::mem::replace(torque, servo.period(state, &controls, &reference, motor, output));
            largest.max((*torque - before).abs())
        })
    };
    run(&first, &mut state, 300, &mut torque);
    // The limit fades in 100 ms: 2 % of it a millisecond, and what the loop itself moves.
    let most = 0.02 * LIMIT_NM + 0.03;
    second.take_over(&first, &mut state);
    let changed = run(&second, &mut state, 300, &mut torque);
    assert!(changed <= most, "{changed} N·m at other parameters");
    second.restart(&mut state, motor, output, 0);
    let restarted = run(&second, &mut state, 300, &mut torque);
    assert!(restarted <= most, "{restarted} N·m at another start");
}
