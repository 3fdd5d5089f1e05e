//! After an outlier the hysteresis torque is off by at most the uncertainty that the gear states.

use crate::common::{A, every_law, masing};
use gmhm::memory::MemoryLaw;
use gmhm::memory::frame::DOUBTED_BEYOND;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::{Fixed, Scalar};
use gmhm::{Gear, Law, Memory, Params, State};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PERIOD_S: f64 = 1e-3;

/// What rounding may add, as a share of the torque scale; at a tip, law `phase` keeps more in `f32`.
fn rounding<S: Scalar>() -> f64 {
    if S::EPSILON < 1e-12 { 1e-9 } else { 2e-4 }
}

/// A path of corners within ±A, in steps of at most a share of A; the first stroke reaches both tips.
fn path(dice: &mut ChaCha8Rng, step: f64) -> Vec<f64> {
    let mut way = vec![0.0];
    let reach = if dice.random() { 1.0 } else { 0.6 };
    let corners = [1.0, -1.0].into_iter().chain((0..14).map(|_| reach * dice.random_range(-1.0..=1.0)));
    for corner in corners.collect::<Vec<f64>>() {
        let from = way[way.len() - 1];
        let count = ((corner - from).abs() / step).ceil().max(1.0);
        way.extend((1..=count as u32).map(|k| from + (corner - from) * f64::from(k) / count));
    }
    way
}

/// Half of the widest play, over A.
const HALF_PLAY: f64 = 0.01;

/// Samples that are none: where they begin, and what they say.
fn outliers(dice: &mut ChaCha8Rng, length: usize, largest: f64) -> (usize, Vec<f64>) {
    let width = [1, 1, 2, 3, 5][dice.random_range(0..5)];
    let size = |dice: &mut ChaCha8Rng| {
        let least = DOUBTED_BEYOND + HALF_PLAY;
        let size = least + (largest - least) * dice.random_range(0.1..=1.0_f64).powi(3);
        if dice.random() { size } else { -size }
    };
    let first = size(dice);
    let apart: bool = dice.random();
    let all = (0..width).map(|_| if apart { size(dice) } else { first }).collect();
    (dice.random_range(1..length - width), all)
}

/// The largest share of the stated uncertainty that the hysteresis torque of a struck gear was off its twin's.
fn strike<S: Scalar, L: MemoryLaw<S>>(
    gear: &Gear<S, L>,
    largest: f64,
    step: impl Fn(&Gear<S, L>, &mut State<S, 16, L>, S),
    name: &str,
) -> f64 {
    let mut dice = ChaCha8Rng::seed_from_u64(16);
    let unit = if S::SI { A } else { 1.0 };
    let scale = gear.frame().torque_scale().to_f64();
    let deflection = |u: f64| S::from_f64(u * unit);
    let free = gear.with_largest_step(S::from_f64(S::LARGEST));
    let is_gated = gear.largest_step() < free.largest_step();
    let mut nearest = 0.0_f64;
    for case in 0..1000 {
        let way = path(&mut dice, [0.02, 0.2, 0.5][case % 3]);
        let (at, wrong) = outliers(&mut dice, way.len(), largest);
        let mut struck = gear.start::<16>(deflection(way[0]));
        let mut twin = struck.clone();
        for (k, &u) in way.iter().enumerate().skip(1) {
            let seen = k.checked_sub(at).and_then(|k| wrong.get(k)).copied();
            step(gear, &mut struck, deflection(seen.unwrap_or(u)));
            // What a gate hides of the path is no memory of an outlier.
            if seen.is_none() || !is_gated {
                step(&free, &mut twin, deflection(u));
            }
            if seen.is_some() || struck.status() != gmhm::Status::default() {
                continue;
            }
            let [found, expected] = [&struck, &twin].map(|state| gear.output(state).hysteresis.to_f64());
            let (off, stated) = ((found - expected).abs(), gear.start_uncertainty(&struck).to_f64());
            assert!(
                off <= stated + gear.start_uncertainty(&twin).to_f64() + rounding::<S>() * scale,
                "{name}, case {case}: {wrong:?} at {at}, at sample {k} ({u}) {off} off, {stated} stated"
            );
            if k >= at {
                nearest = nearest.max(off / stated.max(1e-3 * scale));
            }
        }
    }
    nearest
}

/// Every law, and law `masing` with a play.
fn laws() -> Vec<Params> {
    let with_play = Memory { reversal_play_rad: 2.0 * HALF_PLAY * A, ..masing().memory() };
    let with_play = Params::new(A, masing().elastic(), with_play).expect("a gear");
    every_law().into_iter().chain([with_play]).collect()
}

#[test]
fn what_an_outlier_leaves_is_within_the_stated_uncertainty() {
    for params in laws() {
        let name = format!("{:?}", params.memory());
        let double = Gear::<f64>::with_period(&params, PERIOD_S).expect("a period");
        let single = Gear::<f32>::with_period(&params, PERIOD_S).expect("a period");
        for largest in [2.0, 1000.0] {
            let nearest = strike(&double, largest, |gear, state, theta| _ = gear.step(state, theta), &name);
            assert!(nearest > 0.3, "{name}: {nearest} of what is stated");
            strike(&double, largest, |gear, state, theta| _ = gear.step_after(state, theta, PERIOD_S), &name);
            strike(&single, largest, |gear, state, theta| _ = gear.step(state, theta), &name);
        }
        // Outliers that agree with one another start the gear anew.
        let gated = double.with_largest_step(0.55 * A);
        strike(&gated, 10.0, |gear, state, theta| _ = gear.step(state, theta), &name);
    }
}

#[test]
fn in_fixed_point_as_well() {
    for params in laws() {
        let name = format!("fixed, {:?}", params.memory());
        let step_masing = |gear: &Gear<_, _>, state: &mut State<_, 16, _>, theta| _ = gear.step(state, theta);
        let step_time = |gear: &Gear<_, _>, state: &mut State<_, 16, _>, theta| _ = gear.step(state, theta);
        match params.memory().law {
            Law::Masing => {
                strike(&Gear::with_law(&params, Masing::<Fixed>::new(&params)), 2.5, step_masing, &name);
            }
            Law::Time => {
                strike(&Gear::with_law(&params, Time::<Fixed>::new(&params, PERIOD_S)), 2.5, step_time, &name);
            }
            Law::Phase => {}
        }
    }
}
