//! Beyond κA the elastic torque goes on along its tangent: forward and inverse, in every scalar, continuous, and never falling (MODEL.md section 4).

use crate::common::*;
use gmhm::memory::masing::Masing;
use gmhm::memory::phase::Phase;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::{Elastic, Gear, Inverse, Memory, Params};
use gmhm_host_tests::Constants;
use proptest::prelude::*;

/// Gears whose spring may soften until it falls.
fn any_spring() -> impl Strategy<Value = Params> {
    (-0.5..0.5, -0.3..0.1).prop_filter_map("an elastic torque at the rated deflection", |(k3, k5)| {
        let c1 = 2.0e4;
        let elastic =
            Elastic { c1_nm_per_rad: c1, c2_nm_per_rad3: k3 * c1 / (A * A), c3_nm_per_rad5: k5 * c1 / A.powi(4) };
        let memory = Memory { alpha: 1e5, beta_per_s: 400.0, omega_per_s: 200.0, ..Memory::default() };
        Params::new(A, elastic, memory).ok()
    })
}

fn reference(params: &Params) -> Constants {
    let (elastic, memory) = (params.elastic(), params.memory());
    Constants {
        a: params.rated_deflection_rad(),
        c1: elastic.c1_nm_per_rad,
        c2: elastic.c2_nm_per_rad3,
        c3: elastic.c3_nm_per_rad5,
        alpha: memory.alpha,
        beta: memory.beta_per_s,
        omega: memory.omega_per_s,
    }
}

#[test]
fn the_published_gear_is_no_spring_of_the_wrong_sign() {
    let gear = Gear::<f32>::new(&masing());
    let mut state = gear.start::<16>(0.0);
    for (u, least, most) in [(5.0, 160.0, 165.0), (1e4, 2.9e5, 4e5), (-9e4, -4e6, -2.5e6)] {
        let torque = gear.step(&mut state, (u * A) as f32).elastic;
        assert!((least..most).contains(&f64::from(torque)), "{torque} N·m at {u} A");
    }
}

proptest! {
    #[test]
    fn every_scalar_follows_the_tangent_of_the_reference(p in any_spring(), u in -2.4..2.4f64) {
        let expected = reference(&p).elastic(u * A);
        let scale = p.torque_scale_nm();
        let double = Gear::<f64>::new(&p).elastic().torque(u) * scale;
        prop_assert!((double - expected).abs() < 1e-11 * scale, "{double} for {expected}");
        let single = f64::from(Gear::<f32>::new(&p).elastic().torque(u as f32)) * scale;
        prop_assert!((single - expected).abs() < 1e-5 * scale, "{single} for {expected}");
        let fixed = Gear::with_law(&p, Masing::<Fixed>::new(&p)).elastic().torque(Fixed::from_f64(u)).to_f64() * scale;
        prop_assert!((fixed - expected).abs() < 1e-6 * scale, "{fixed} for {expected}");
    }

    #[test]
    fn it_is_continuous_and_never_falls_beyond_the_knee(p in any_spring(), more in 0.0..1e4f64, further in 0.0..10.0f64) {
        let gear = Gear::<f64>::new(&p);
        let (elastic, knee) = (gear.elastic(), gear.elastic().knee());
        prop_assert!((1.0..=1.5).contains(&knee));
        prop_assert!((elastic.torque(knee * (1.0 + 1e-12)) - elastic.torque(knee)).abs() < 1e-11);
        prop_assert!(elastic.torque(knee + more + further) >= elastic.torque(knee + more));
        prop_assert_eq!(elastic.torque(-(knee + more)), -elastic.torque(knee + more));
        prop_assert!(elastic.stiffness(knee + more) >= 0.0);
    }

    #[test]
    fn the_inverse_finds_its_way_back_from_anywhere(u in prop_oneof![-3.0..3.0f64, -1e4..1e4f64], torque in -25.0..25.0f64) {
        // The direction is that of the tangent's torque, not of a polynomial's.
        for p in every_law() {
            let Ok(inverse) = Inverse::<f64>::with_period(&p, 1e-3) else { continue };
            let gear = Gear::<f64>::with_period(&p, 1e-3).expect("a period");
            let mut state = gear.start::<16>(0.0);
            gear.step(&mut state, u * A);
            let solution = inverse.peek(&state, torque);
            prop_assert!(solution.converged && !solution.refused);
            if u.abs() > 1.5 && p.memory().law == gmhm::Law::Masing {
                let back = gear.step(&mut state, solution.theta).torque;
                prop_assert!(solution.saturated || (back - torque).abs() < 1e-9, "{back} for {torque} from {u} A");
            }
        }
    }

    #[test]
    fn fixed_point_finds_its_way_back_too(u in -2.4..2.4f64, torque in -0.8..0.8f64) {
        let p = masing();
        let inverse = Inverse::of(&p, Masing::<Fixed>::new(&p), 0.0).expect("a range");
        let mut state = inverse.gear().start::<16>(Fixed::ZERO);
        inverse.gear().step(&mut state, Fixed::from_f64(u));
        let solution = inverse.peek(&state, Fixed::from_f64(torque));
        let back = inverse.gear().step(&mut state, solution.theta).torque.to_f64();
        prop_assert!(solution.converged && (solution.saturated || (back - torque).abs() < 2e-6), "{back} for {torque}");
    }
}

#[test]
fn whatever_the_law_the_tangent_is_the_same() {
    let p = masing();
    let knee = Gear::<f64>::new(&p).elastic().knee();
    assert_eq!(Gear::with_law(&p, Phase::<f64>::new(&p)).elastic().knee(), knee);
    assert_eq!(Gear::with_law(&p, Time::<f64>::new(&p, 1e-3)).elastic().knee(), knee);
}
