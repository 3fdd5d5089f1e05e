//! What seeded tests of bad input share.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A number of the environment: how much is fuzzed, or the seed.
pub fn number(name: &str, otherwise: u64) -> u64 {
    match std::env::var(name) {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("{name} must be a number")),
        Err(_) => otherwise,
    }
}

/// A number that is none, is absurd, or any bits.
pub fn strange(dice: &mut ChaCha8Rng) -> f32 {
    match dice.random_range(0..7) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => 1e30,
        4 => -3e38,
        5 => 1e9,
        _ => f32::from_bits(dice.random()),
    }
}
