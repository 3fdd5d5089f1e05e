//! Every law in both precisions, and those of fixed point, give the same bits on every host: golden hashes of all torques on seeded paths.
//!
//! `src/bin/bits.rs` promises the same of the microcontrollers. A change of the core that means to change bits puts the hashes that the test
//! prints in place of these.

use crate::common;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::memory::{AnyLaw, MemoryLaw};
use gmhm::scalar::{Fixed, Float, Scalar};
use gmhm::{Gear, Law, Memory, Params};
use gmhm_host_tests::paths::{self, Path};

const PERIOD_S: f64 = 1e-3;

/// Law, kernel, gate; the hash in `f32`, in `f64`, in fixed point.
const GOLDEN: [(&str, [u64; 3]); 9] = [
    ("masing deflection cycle", [0xe57e02c7ea2219df, 0x220a56a2dc6f74ad, 0x28c48ed0dfdf488e]),
    ("phase deflection cycle", [0xc38911e0b3b0bcbc, 0x4f1bc3b5f1aef236, 0]),
    ("phase deflection none", [0x54f01973ac31d3df, 0x8b26c634b93365c9, 0]),
    ("phase rate cycle", [0xfb1b7756e1c77fea, 0x681fb4948703bb9e, 0]),
    ("phase rate none", [0x3d9e5c0e3ff87fc2, 0x9bb1228becb506b1, 0]),
    ("time deflection cycle", [0xd41d3ccd92b05f85, 0x68bc1c2a0f035202, 0x4d124fd552a48860]),
    ("time deflection none", [0x5a2d1c3947efc2f4, 0x2869a2cb2f32ded0, 0xd1e5dd1eb1fcd90f]),
    ("time rate cycle", [0x290281008bf7914f, 0x391819e547d5651a, 0x818c8dd7c93eb51d]),
    ("time rate none", [0x57e4423b9b555d07, 0xf0fa1b52512c6fad, 0x2c3a3393f98ff315]),
];

/// Paths that need no function whose last bit depends on the host's mathematics library.
const PATHS: [&str; 4] = ["nested loops", "stops", "steps", "tips touched"];

/// What a gear takes for a deflection in rad.
fn input<S: Scalar>(theta: f64) -> S {
    S::from_f64(if S::SI { theta } else { theta / common::A })
}

/// Fowler, Noll and Vo's hash (1a, 64 bits), of the torques as the bits of their exact `f64`.
fn hash<S: Scalar, L: MemoryLaw<S>>(params: &Params, law: L, paths: &[Path]) -> u64 {
    let gear = Gear::with_law(params, law);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for path in paths {
        let mut state = gear.start::<16>(input(path.theta[0]));
        for &theta in &path.theta {
            let out = gear.step(&mut state, input(theta));
            for torque in [out.torque, out.elastic, out.hysteresis] {
                for byte in torque.to_f64().to_bits().to_le_bytes() {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
    }
    hash
}

/// The hash in floating point.
fn floating<S: Float>(params: &Params, paths: &[Path]) -> u64 {
    hash(params, AnyLaw::<S>::new(params, PERIOD_S), paths)
}

/// The hash in fixed point, 0 for law `phase`, which needs more than it has.
fn fixed(params: &Params, paths: &[Path]) -> u64 {
    match params.memory().law {
        Law::Masing => hash(params, Masing::<Fixed>::new(params), paths),
        Law::Phase => 0,
        Law::Time => hash(params, Time::<Fixed>::new(params, PERIOD_S), paths),
    }
}

#[test]
fn every_law_gives_the_golden_bits_in_both_precisions() {
    let every = (1..=3).flat_map(|seed| paths::every(seed, common::A));
    let paths: Vec<Path> = every.filter(|path| PATHS.contains(&path.name)).map(Path::rounded).collect();
    assert_eq!(paths.len(), 3 * PATHS.len());
    let found: Vec<(String, [u64; 3])> = common::every_law()
        .iter()
        .map(|params| {
            let Memory { law, kernel, gate, .. } = params.memory();
            let name = format!("{} {} {}", law.name(), kernel.name(), gate.name());
            (name, [floating::<f32>(params, &paths), floating::<f64>(params, &paths), fixed(params, &paths)])
        })
        .collect();
    for (name, [single, double, fixed]) in &found {
        println!("    (\"{name}\", [{single:#018x}, {double:#018x}, {fixed:#018x}]),");
    }
    for ((name, hashes), golden) in found.iter().zip(GOLDEN) {
        assert_eq!((name.as_str(), *hashes), golden);
    }
    assert_eq!(found.len(), GOLDEN.len());
}
