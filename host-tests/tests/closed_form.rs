//! The core against the solutions on paper: the rated cycle of both kernels, the ramp in real time, the numbers of MODEL.md section 2.

use crate::common;
use crate::common::{A, elastic, memory, params};
use gmhm::closed_form::ClosedForm;
use gmhm::{Gate, Gear, Kernel, Law, Memory, Params};
use gmhm_host_tests::{Constants, Weighed, closed_form, masing::Masing};
use std::f64::consts::FRAC_PI_2;

const QUARTER: u32 = 1000;

fn constants(params: &Params) -> Constants {
    Constants { alpha: params.memory().alpha, ..Constants::PUBLISHED }
}

fn kernels() -> [(Kernel, Weighed); 2] {
    [(Kernel::Deflection, Weighed::Deflection), (Kernel::Rate, Weighed::Rate)]
}

/// Prints the largest error, as a share of the rated torque, and holds it to a bound.
fn hold(what: &str, params: &Params, bound: f64, pairs: impl Iterator<Item = (f64, f64)>) {
    let worst =
        pairs.map(|(core, paper)| (core - paper).abs()).fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
            / params.rated_torque_nm();
    println!("{what}: largest error {worst:.1e} of the rated torque, bound {bound:.0e}");
    assert!(worst <= bound, "{what}: error {worst:e} of the rated torque, bound {bound:e}");
}

#[test]
fn law_phase_solves_the_rated_cycle_of_both_kernels_from_its_first_sample() {
    for (kernel, weighed) in kernels() {
        let params = params(Law::Phase, kernel, Gate::Cycle);
        let (gear, paper) = (Gear::<f64>::new(&params), constants(&params));
        let mut state = gear.start::<16>(0.0);
        let pairs = (1..=12 * QUARTER).map(|k| {
            let phase = FRAC_PI_2 * f64::from(k) / f64::from(QUARTER);
            let core = gear.step(&mut state, A * phase.sin()).torque;
            (core, closed_form::cycle_torque(&paper, weighed, phase / paper.omega))
        });
        hold(&format!("law phase, kernel {}", kernel.name()), &params, 1e-9, pairs);
    }
}

#[test]
fn the_closed_form_of_the_core_is_the_closed_form_of_the_paper() {
    for (kernel, weighed) in kernels() {
        let params = params(Law::Phase, kernel, Gate::Cycle);
        let (core, paper) = (ClosedForm::<f64>::new(&params), constants(&params));
        let times = || (0..=12 * QUARTER).map(|k| FRAC_PI_2 * f64::from(k) / f64::from(QUARTER) / 226.31);
        let name = kernel.name();
        let torques = times().map(|t| (core.torque(t), closed_form::cycle_torque(&paper, weighed, t)));
        hold(&format!("closed form, {name}, torque"), &params, 1e-12, torques);
        let memories = times().map(|t| (core.memory(t), closed_form::cycle(&paper, weighed, t)));
        hold(&format!("closed form, {name}, memory"), &params, 1e-12, memories);
        let branches = (0..6).flat_map(|branch| (-99..=99).map(move |k| (branch, f64::from(k) / 100.0)));
        let branches = branches.filter(|&(branch, u)| branch > 0 || u >= 0.0).map(|(branch, u)| {
            // Branch n is entered at the phase (n − 1/2)π, the first at 0.
            let rising = if branch % 2 == 0 { 1.0 } else { -1.0 };
            let phase = f64::from(branch) * std::f64::consts::PI + rising * u.asin();
            let torque = closed_form::cycle_torque(&paper, weighed, phase / paper.omega);
            (core.torque_on_branch(A * u, branch), torque)
        });
        hold(&format!("closed form, {name}, by branch"), &params, 1e-11, branches);
    }
}

#[test]
fn law_masing_follows_the_steady_cycle_once_both_tips_were_reached() {
    let params = common::masing();
    let (gear, paper) = (Gear::<f64>::new(&params), constants(&params));
    let mut state = gear.start::<16>(0.3 * A);
    for theta in [0.1 * A, 0.6 * A, A, -A] {
        gear.step(&mut state, theta);
    }
    let pairs = (1..=8 * QUARTER).map(|k| {
        let phase = -FRAC_PI_2 + FRAC_PI_2 * f64::from(k) / f64::from(QUARTER);
        (gear.step(&mut state, A * phase.sin()).torque, closed_form::steady_torque(&paper, phase))
    });
    hold("law masing", &params, 1e-9, pairs);
}

#[test]
fn the_published_signs_give_the_same_bits() {
    for (law, kernel, gate) in [
        (Law::Masing, Kernel::Deflection, Gate::Cycle),
        (Law::Phase, Kernel::Deflection, Gate::Cycle),
        (Law::Phase, Kernel::Rate, Gate::None),
        (Law::Time, Kernel::Deflection, Gate::Cycle),
    ] {
        let canonical = memory(law, kernel, gate);
        let published = Memory { beta_per_s: -canonical.beta_per_s, omega_per_s: -canonical.omega_per_s, ..canonical };
        let torques = |memory: Memory| -> Vec<u64> {
            let params = Params::new(A, elastic(), memory).expect("the published gear");
            let gear = Gear::<f64>::with_period(&params, 1e-3).expect("a period");
            let mut state = gear.start::<16>(0.0);
            (0..2000).map(|k| gear.step(&mut state, A * (f64::from(k) * 0.01).sin()).torque.to_bits()).collect()
        };
        assert_eq!(torques(published), torques(canonical), "law {}, kernel {}", law.name(), kernel.name());
    }
}

/// MODEL.md sections 2.6 and 8: Table 1 of the paper against the published parameters.
#[test]
fn the_published_numbers_come_out() {
    let params = common::masing();
    let gear = Gear::<f64>::new(&params);
    let mut state = gear.start::<16>(0.0);
    let mut reference = Masing::new(Constants::PUBLISHED, 16, 0.0, 0.0);
    let rows = [
        (1.168e-3, 30.23, 0.005),
        (0.245e-3, 1.99, 0.005),
        (0.143e-3, -0.16, 0.005),
        (0.264e-3, 2.89, 0.005),
        (1.120e-3, 27.3, 0.05),
    ];
    for (theta, published, half_a_digit) in rows {
        for (who, torque) in [("core", gear.step(&mut state, theta).torque), ("reference", reference.step(theta))] {
            println!("{who}: {torque:.4} N·m at {theta} rad, MODEL.md {published}");
            assert!((torque - published).abs() <= half_a_digit, "{who}: {torque} N·m at {theta} rad, not {published}");
        }
    }
    // The loading branch of the closed cycle misses the rows at 0 and 2 N·m by what MODEL.md says.
    for theta in [A, -A] {
        gear.step(&mut state, theta);
    }
    for (theta, published) in [(0.143e-3, 5.9), (0.264e-3, 8.2)] {
        let torque = gear.step(&mut state, theta).torque;
        println!("closed cycle: {torque:.4} N·m at {theta} rad, MODEL.md {published}");
        assert!((torque - published).abs() <= 0.05, "{torque} N·m at {theta} rad, not {published}");
    }
}

#[test]
fn law_time_solves_the_ramp_at_any_sample_period() {
    for (kernel, weighed) in kernels() {
        let params = params(Law::Time, kernel, Gate::None);
        let paper = constants(&params);
        let (theta_0, v) = (-0.9 * A, 1.8 * A / 0.2);
        // βΔ from 4e-6 to 8.
        for period in [1e-8, 1e-6, 1e-4, 1e-3, 0.02] {
            let gear = Gear::<f64>::with_period(&params, period).expect("a period");
            let mut state = gear.start::<16>(theta_0);
            let samples = ((0.2 / period) as u32).min(2000);
            let pairs = (1..=samples).map(|k| {
                let t = f64::from(k) * period;
                let theta = theta_0 + v * t;
                let core = gear.step(&mut state, theta).torque;
                (core, paper.elastic(theta) + closed_form::ramp(&paper, weighed, theta_0, v, t))
            });
            hold(&format!("law time, kernel {}, Δ = {period} s", kernel.name()), &params, 1e-9, pairs);
        }
        // From θ = 0 the first samples of kernel `deflection` are φ2 alone.
        let gear = Gear::<f64>::with_period(&params, 1e-8).expect("a period");
        let mut state = gear.start::<16>(0.0);
        for k in 1..=100 {
            let t = 1e-8 * f64::from(k);
            let core = gear.step(&mut state, v * t).hysteresis;
            let solution = closed_form::ramp(&paper, weighed, 0.0, v, t);
            assert!((core - solution).abs() <= 1e-9 * solution.abs(), "sample {k}: {core:e} N·m, not {solution:e}");
        }
        let gear = Gear::<f64>::new(&params);
        let mut state = gear.start::<16>(theta_0);
        let mut t = 0.0;
        let pairs = (0..400).map(|k| {
            let period = [3e-4, 1e-3, 0.0, 7e-7][k % 4];
            t += period;
            let theta = theta_0 + v * t;
            let core = gear.step_after(&mut state, theta, period).torque;
            (core, paper.elastic(theta) + closed_form::ramp(&paper, weighed, theta_0, v, t))
        });
        hold(&format!("law time, kernel {}, uneven periods", kernel.name()), &params, 1e-9, pairs);
    }
}
