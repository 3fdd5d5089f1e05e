//! Parameters that no gear has are refused with their name, and a search may still try them.

use crate::common::*;
use gmhm::{Elastic, Gear, Law, Memory, ParamError, Params};

fn refused(a: f64, elastic: Elastic, memory: Memory) -> String {
    match Params::new(a, elastic, memory) {
        Ok(params) => panic!("{params:?} was accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_is_no_gear_is_refused_by_name() {
    let (elastic, memory) = (elastic(), masing().memory());
    let cases = [
        (1e-7, elastic, memory, "rated_deflection_rad"),
        (2.0, elastic, memory, "rated_deflection_rad"),
        (A, Elastic { c1_nm_per_rad: -1.0, ..elastic }, memory, "c1_nm_per_rad"),
        (A, Elastic { c1_nm_per_rad: 1e9, ..elastic }, memory, "c1_nm_per_rad"),
        (A, Elastic { c2_nm_per_rad3: 1e15, ..elastic }, memory, "c2_nm_per_rad3"),
        (A, Elastic { c3_nm_per_rad5: -1e21, ..elastic }, memory, "c3_nm_per_rad5"),
        (A, Elastic { c3_nm_per_rad5: -2e16, ..elastic }, memory, "c1_nm_per_rad"),
        (A, Elastic { c1_nm_per_rad: 1e-40, ..Elastic::default() }, memory, "alpha"),
        (A, Elastic { c1_nm_per_rad: 1e-5, ..Elastic::default() }, Memory { alpha: 0.0, ..memory }, "c1_nm_per_rad"),
        (A, elastic, Memory { alpha: 1e12, ..memory }, "alpha"),
        (A, elastic, Memory { law: Law::Time, alpha: 1e12, ..memory }, "alpha"),
        (A, elastic, Memory { beta_per_s: 1e10, ..memory }, "beta_per_s"),
        (A, elastic, Memory { omega_per_s: 1e10, ..memory }, "omega_per_s"),
        (A, elastic, Memory { reversal_play_rad: 2.0 * A, ..memory }, "reversal_play_rad"),
    ];
    for (a, elastic, memory, name) in cases {
        let message = refused(a, elastic, memory);
        assert!(message.starts_with(name), "{message}");
        assert!(message.contains("1e12") || !message.contains("inf"), "{message}");
        Params::candidate(a, elastic, memory).expect("a search may try it");
    }
}

#[test]
fn what_cannot_be_computed_is_refused_either_way() {
    for a in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert!(Params::new(a, elastic(), masing().memory()).is_err());
        assert!(Params::candidate(a, elastic(), masing().memory()).is_err());
    }
    let mixed = Memory { beta_per_s: -1.0, ..masing().memory() };
    assert!(matches!(Params::candidate(A, elastic(), mixed), Err(ParamError::MixedSigns { .. })));
}

/// The ends of what is accepted are finite in single precision.
#[test]
fn what_is_accepted_is_computed_with_in_single_precision() {
    for (a, torque_nm) in [(1e-6, 1e-6), (1e-6, 9e4), (1.0, 1e-6), (1.0, 9e4)] {
        let elastic = Elastic { c1_nm_per_rad: torque_nm / a, ..Elastic::default() };
        // e = h = 0.1 c1.
        let alpha = 0.2 * 200.0 * torque_nm / a;
        let memory = Memory { alpha, beta_per_s: 200.0, omega_per_s: 200.0, ..Memory::default() };
        let params = Params::new(a, elastic, memory).expect("a gear");
        let (single, double) = (Gear::<f32>::new(&params), Gear::<f64>::new(&params));
        let (mut s, mut d) = (single.start::<16>(0.0), double.start::<16>(0.0));
        for u in [0.5, -0.75, 0.25, 0.9] {
            let (one, two) = (single.step(&mut s, (u * a) as f32).torque, double.step(&mut d, u * a).torque);
            assert!((f64::from(one) - two).abs() < 1e-5 * torque_nm, "{one} for {two}");
        }
    }
}

/// The compiler computes what the program does.
#[test]
fn parameters_of_a_constant_are_those_of_a_call() {
    const ELASTIC: Elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    const MEMORY: Memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::NONE };
    static PARAMS: Params = match Params::new(A, ELASTIC, MEMORY) {
        Ok(params) => params,
        Err(_) => panic!("these are the parameters of no gear"),
    };
    const NO_GEAR: Result<Params, ParamError> = Params::new(A, Elastic { c1_nm_per_rad: -1.0, ..ELASTIC }, MEMORY);
    let (elastic, memory) = std::hint::black_box((ELASTIC, MEMORY));
    let computed = Params::new(A, elastic, memory).expect("the published gear");
    let numbers = |params: &Params| {
        [params.torque_scale_nm(), params.rated_torque_nm(), params.memory().e(), params.memory().h()].map(f64::to_bits)
    };
    assert_eq!(numbers(&PARAMS), numbers(&computed));
    assert_eq!(PARAMS, computed);
    assert_eq!(NO_GEAR, Err(ParamError::Negative { parameter: "c1_nm_per_rad", value: -1.0 }));
    assert_eq!((Elastic::NONE, Memory::NONE), (Elastic::default(), Memory::default()));
}
