//! Terms against equations of other kinds: differential equations integrated in small steps, plays for stops, a delayed signal for its first order.

use std::f64::consts::TAU;

use gmhm::terms::{Form, KeyInfo, Sample, Setting, Source, Stack, StackState, Value};

const RATED: f64 = 1.168e-3;
const SETTING: Setting<f64> = Setting { sigma: 1.0, c1: 2.4737e4, rated_deflection: RATED };

/// Keys that hold numbers or lists, and the number of a choice.
struct Keys<'a>(&'a [(&'a str, &'a [f64])], usize);

impl Source<f64> for Keys<'_> {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f64>> {
        if let Form::Choice(_) = key.form {
            return Some(Value::Choice(self.1));
        }
        let (_, numbers) = self.0.iter().find(|(name, _)| *name == key.name)?;
        Some(if let Form::List { .. } = key.form { Value::List(numbers) } else { Value::Number(numbers[0]) })
    }
}

fn stack(kind: &str, keys: &[(&str, &[f64])], choice: usize) -> (Stack<f64>, StackState<f64>) {
    let mut stack = Stack::of_gear(SETTING);
    stack.add(kind, &Keys(keys, choice)).unwrap();
    let state = stack.start();
    (stack, state)
}

/// A swing with small loops within large ones, rad.
fn swing(t: f64) -> f64 {
    0.4 * (1.1 * t).sin() + 0.05 * (9.0 * t).sin() + 0.012 * (31.0 * t).sin()
}

/// dD/dt = (1 − D sgn q̇) q̇/r, in steps of 2 µs by the midpoint rule.
#[test]
fn presliding_friction_solves_its_differential_equation() {
    let (torque, radius) = (0.7, 0.03);
    let (stack, mut state) = stack("presliding_friction", &[("torque_nm", &[torque]), ("radius_rad", &[radius])], 0);
    let at = |t: f64| Sample { output_angle: swing(t), ..Sample::default() };
    let mut strain = 0.0;
    stack.torque(&mut state, &at(0.0));
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for row in 1..8000_u32 {
        const FINE: u32 = 500;
        for k in 0..FINE {
            let t = 1e-3 * (f64::from(row - 1) + f64::from(k) / f64::from(FINE));
            let h = 1e-3 / f64::from(FINE);
            let moved = swing(t + h) - swing(t);
            let middle = strain + 0.5 * moved / radius * (1.0 - strain * moved.signum());
            strain += moved / radius * (1.0 - middle * moved.signum());
        }
        let found = stack.torque(&mut state, &at(1e-3 * f64::from(row)));
        worst = worst.max((found - torque * strain).abs());
        largest = largest.max(found.abs());
    }
    // Within a row that holds a reversal the exact recursion sees its ends only: 1e-6 rad of 0.03.
    assert!(largest > 0.9 * torque && worst < 1e-4 * torque, "{worst:e} of {largest}");
}

/// ÿ + 2ζω_n ẏ + ω_n² y = ω_n² Σ c cos(k q) + s sin(k q) at a constant speed, integrated from rest until it has settled.
#[test]
fn ripple_resonance_is_what_a_driven_mode_settles_to() {
    let (hertz, damping) = (12.0, 0.08);
    let (orders, cos, sin) = ([1.0, 2.0, 3.5], [0.4, -0.3, 0.1], [0.2, 0.5, -0.25]);
    let keys: [(&str, &[f64]); 5] = [
        ("orders", &orders),
        ("cos_nm", &cos),
        ("sin_nm", &sin),
        ("frequency_hz", &[hertz]),
        ("damping_ratio", &[damping]),
    ];
    let natural = TAU * hertz;
    // Below, near and above the mode for each order, and backwards.
    for velocity in [3.0, 21.0, 37.0, 76.0, -38.0, 400.0] {
        let drive = |t: f64| -> f64 {
            let wave = |k: usize| cos[k] * (orders[k] * velocity * t).cos() + sin[k] * (orders[k] * velocity * t).sin();
            (0..3).map(wave).sum()
        };
        let acceleration =
            |t: f64, y: f64, rate: f64| natural * natural * (drive(t) - y) - 2.0 * damping * natural * rate;
        let (stack, mut state) = stack("ripple_resonance", &keys, 0);
        let (mut y, mut rate, h) = (0.0_f64, 0.0_f64, 2e-5);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        let settled = 30.0 / (damping * natural);
        let steps = (settled / h) as u32;
        for k in 0..steps + 20_000 {
            let t = h * f64::from(k);
            if k > steps {
                let sample = Sample { motor_angle: velocity * t, motor_velocity: velocity, ..Sample::default() };
                let found = stack.torque(&mut state, &sample);
                worst = worst.max((found - y).abs());
                largest = largest.max(y.abs());
            }
            // Classical Runge-Kutta.
            let (a1, v1) = (acceleration(t, y, rate), rate);
            let (a2, v2) = (acceleration(t + 0.5 * h, y + 0.5 * h * v1, rate + 0.5 * h * a1), rate + 0.5 * h * a1);
            let (a3, v3) = (acceleration(t + 0.5 * h, y + 0.5 * h * v2, rate + 0.5 * h * a2), rate + 0.5 * h * a2);
            let (a4, v4) = (acceleration(t + h, y + h * v3, rate + h * a3), rate + h * a3);
            y += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            rate += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
        assert!(largest > 1e-3 && worst < 1e-6 * largest.max(0.1), "{velocity}: {worst:e} of {largest}");
    }
}

/// stop_r[θ] = θ − play_r[θ], scaled as the model writes it.
#[test]
fn load_dependent_memory_is_a_scaled_sum_of_plays() {
    let (radii, torques) = ([5e-5, 2e-4, 7e-4], [0.4, 0.7, 0.5]);
    let (linear, quadratic) = (1.4, -0.2);
    let keys: [(&str, &[f64]); 4] =
        [("radius_rad", &radii), ("torque_nm", &torques), ("load_linear", &[linear]), ("load_quadratic", &[quadratic])];
    let (stack, mut state) = stack("load_dependent_memory", &keys, 0);
    let path = |t: f64| 2.6e-3 * swing(t);
    let mut plays = [path(0.0); 3];
    let (mut clamped, mut moved) = (false, false);
    for row in 0..20_000_u32 {
        let theta = path(1e-3 * f64::from(row));
        let u = theta.abs() / RATED;
        let factor = 1.0 - linear - quadratic + linear * u + quadratic * u * u;
        clamped |= factor < 0.0;
        moved |= u > 0.8;
        let mut expected = 0.0;
        for ((play, radius), torque) in plays.iter_mut().zip(radii).zip(torques) {
            *play = play.clamp(theta - radius, theta + radius);
            expected += torque / radius * (theta - *play) * factor.max(0.0);
        }
        let found = stack.torque(&mut state, &Sample { deflection: theta, ..Sample::default() });
        assert!((found - expected).abs() < 1e-11, "row {row}: {found} for {expected}");
    }
    assert!(clamped && moved);
}

#[test]
fn viscous_friction_is_a_power_of_the_velocity() {
    for exponent in [0.6, 1.0, 1.2] {
        let (stack, mut state) =
            stack("viscous_friction", &[("damping_nms_per_rad", &[2.5]), ("exponent", &[exponent])], 0);
        for velocity in [-3.0, -1.0, -1e-4, 0.0, 0.2, 1.0, 40.0_f64] {
            let size = if velocity == 0.0 { 0.0 } else { (exponent * velocity.abs().ln()).exp() };
            let found = stack.torque(&mut state, &Sample { velocity, ..Sample::default() });
            assert!((found - 2.5 * velocity.signum() * size).abs() < 1e-12 * (1.0 + size), "{exponent} {velocity}");
        }
    }
}

/// θ_measured = q_m/N − q_o(t − δ): the term takes out its first order, and leaves at most δ²/2 of the largest acceleration.
#[test]
fn encoder_skew_takes_a_delay_of_the_output_out_of_the_deflection() {
    let delay = 2e-4;
    let (stack, mut state) = stack("encoder_skew", &[("delay_s", &[delay])], 0);
    let velocity = |t: f64| (swing(t + 1e-6) - swing(t - 1e-6)) / 2e-6;
    let acceleration = |t: f64| (swing(t + 1e-4) - 2.0 * swing(t) + swing(t - 1e-4)) / 1e-8;
    let (mut worst, mut before) = (0.0_f64, 0.0_f64);
    for row in 0..5000_u32 {
        let t = 1e-3 * f64::from(row);
        let truth = 1e-3 * (3.0 * t).sin();
        let deflection = truth + swing(t) - swing(t - delay);
        let sample = Sample { deflection, output_velocity: velocity(t), ..Sample::default() };
        let corrected = stack.correct(&mut state, &sample, &|_| 0.0);
        before = before.max((deflection - truth).abs());
        worst = worst.max((corrected - truth).abs() - 0.5 * delay * delay * acceleration(t).abs());
    }
    assert!(before > 1e-4 && worst < 1e-8, "{worst:e} of {before:e}");
}

/// At ratio 100 order 2 of the motor is order 200 of the output, where nothing is wound up.
#[test]
fn an_order_of_the_output_is_the_ratio_times_that_of_the_motor() {
    for kind in ["torque_ripple", "ripple_resonance"] {
        let keys = |order| -> [(&'static str, Vec<f64>); 5] {
            [
                ("orders", vec![order]),
                ("cos_nm", vec![0.4]),
                ("sin_nm", vec![-0.3]),
                ("frequency_hz", vec![30.0]),
                ("damping_ratio", vec![0.1]),
            ]
        };
        let make = |order, choice| {
            let keys = keys(order);
            let slices: Vec<(&str, &[f64])> = keys.iter().map(|(name, list)| (*name, list.as_slice())).collect();
            stack(kind, &slices, choice)
        };
        let ((motor, mut of_motor), (output, mut of_output)) = (make(2.0, 0), make(200.0, 1));
        for row in 0..2000_u32 {
            let t = 1e-3 * f64::from(row);
            let (angle, velocity) = (swing(t), (swing(t + 1e-6) - swing(t - 1e-6)) / 2e-6);
            let sample = Sample {
                output_angle: angle,
                motor_angle: 100.0 * angle,
                output_velocity: velocity,
                motor_velocity: 100.0 * velocity,
                ..Sample::default()
            };
            let (a, b) = (motor.torque(&mut of_motor, &sample), output.torque(&mut of_output, &sample));
            assert!((a - b).abs() < 1e-11, "{kind}: {a} and {b}");
        }
    }
}
