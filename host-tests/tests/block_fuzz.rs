//! Whatever the bytes, a block is refused or computed with: no panic, no endless search. Seeded mutations of the golden blocks, most of them with length, count and
//! CRC-32 corrected so that they come past the checksum.
//!
//! `GMHM_FUZZ=10000000 cargo test --release -p gmhm-host-tests --test all block_fuzz -- --nocapture` runs ten million and says what became of them;
//! `GMHM_FUZZ_SEED` chooses others.

use std::collections::BTreeMap;
use std::fmt::Debug;

use crate::common::fuzz::number;
use gmhm::block::{
    BlockError, CheckedTerms, HEADER_BYTES, Parameters, PreparedLaw, TermStack, Word, crc32, verify_first,
};
use gmhm::inverse::MOST_STEPS;
use gmhm::memory::AnyLaw;
use gmhm::memory::masing::Masing;
use gmhm::memory::time::Time;
use gmhm::scalar::Fixed;
use gmhm::terms::{Sample, Stack};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Executions where none are asked for.
const EXECUTIONS: u64 = 100_000;

/// Words that break things.
const STRANGE: [u32; 14] = [
    0,
    1,
    0x7fff_ffff,
    0x8000_0000,
    u32::MAX,
    0x7fc0_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7f7f_ffff,
    0x0080_0000,
    0x3f80_0000,
    0xbf80_0000,
    0x7ff0_0000,
    0x3ff0_0000,
];

/// Where the records of a block begin and end, as far as they can be followed.
fn records(block: &[u8]) -> Vec<(usize, usize)> {
    let (mut found, mut at) = (Vec::new(), HEADER_BYTES);
    while at + 8 <= block.len() {
        let end = at + 4 + usize::from(u16::from_le_bytes([block[at + 2], block[at + 3]]));
        if end + 4 > block.len() {
            break;
        }
        found.push((at, end));
        at = end;
    }
    found
}

/// Mends length, count of records and CRC-32.
fn seal(block: &mut [u8]) {
    if block.len() < HEADER_BYTES + 4 {
        return;
    }
    let (count, length) = (records(block).len() as u16, block.len() as u32);
    block[8..12].copy_from_slice(&length.to_le_bytes());
    block[40..42].copy_from_slice(&count.to_le_bytes());
    let end = block.len() - 4;
    let crc = crc32(&block[..end]).to_le_bytes();
    block[end..].copy_from_slice(&crc);
}

fn mutate(block: &mut Vec<u8>, others: &[Vec<u8>], dice: &mut ChaCha8Rng) {
    let at = dice.random_range(0..block.len().max(1));
    let word = (at & !3).min(block.len().saturating_sub(4));
    let spans = records(block);
    let any_record = |spans: &[(usize, usize)], dice: &mut ChaCha8Rng| {
        (!spans.is_empty()).then(|| spans[dice.random_range(0..spans.len())])
    };
    match dice.random_range(0..10) {
        0 if !block.is_empty() => block[at] ^= 1 << dice.random_range(0..8),
        1 if !block.is_empty() => block[at] = dice.random(),
        2..=4 if block.len() >= 4 => {
            let strange = STRANGE[dice.random_range(0..STRANGE.len())];
            block[word..word + 4].copy_from_slice(&strange.to_le_bytes());
        }
        5 if block.len() >= 4 => block[word..word + 4].copy_from_slice(&dice.random::<u32>().to_le_bytes()),
        6 => block.truncate(at),
        7 => {
            if let Some((begin, end)) = any_record(&spans, dice) {
                block.drain(begin..end);
            }
        }
        8 => {
            let other = &others[dice.random_range(0..others.len())];
            if let (Some((begin, end)), true) = (any_record(&records(other), dice), block.len() >= HEADER_BYTES + 4) {
                let place = any_record(&spans, dice).map_or(HEADER_BYTES, |(begin, _)| begin);
                block.splice(place..place, other[begin..end].iter().copied());
            }
        }
        _ => {
            if let Some((begin, _)) = any_record(&spans, dice) {
                // A field of a record's head: tag or length.
                let field = begin + 2 * dice.random_range(0..2);
                let value: u16 = if dice.random() { dice.random_range(0..0x120) } else { dice.random() };
                block[field..field + 2].copy_from_slice(&value.to_le_bytes());
            }
        }
    }
}

/// Loads bytes as some firmware would, and computes with what it takes: the code of a refusal, 0 for none.
fn load<S: Word, L: PreparedLaw<S> + PartialEq + Debug, T: TermStack + PartialEq + Debug>(
    bytes: &[u8],
    dice: &mut ChaCha8Rng,
) -> (u16, Option<Parameters<S, L, T>>) {
    let loaded = verify_first(bytes).and_then(|block| {
        let unit = block.header().torque_unit;
        let loaded = Parameters::<S, L, T>::of_any_block(&block, 16, unit);
        let stored = Parameters::<S, L, T>::of_block_in(&block, 16, unit);
        assert!(stored.is_err() || loaded.is_ok() || loaded == Err(BlockError::SelfTest), "{stored:?}, {loaded:?}");
        loaded
    });
    let parameters = match loaded {
        Ok(parameters) => parameters,
        Err(error) => return (error.code(), None),
    };
    if let Some(gear) = &parameters.gear {
        let rated = gear.frame().rated();
        let mut state = gear.start::<16>(S::ZERO);
        for _ in 0..4 {
            let u = S::from_f64(dice.random_range(-1.5..1.5));
            let out = gear.step(&mut state, gear.frame().deflection(u));
            let _ = gear.start_uncertainty(&state);
            if let Some(inverse) = &parameters.inverse {
                assert!(inverse.peek(&state, S::HALF * out.torque).steps <= MOST_STEPS);
            }
        }
        assert!(rated > S::ZERO);
    }
    (0, Some(parameters))
}

/// Every term at a moment of no special kind.
fn use_terms(parameters: &Parameters, dice: &mut ChaCha8Rng) {
    let mut any = || dice.random_range(-2.0..2.0_f32);
    let sample = Sample {
        time: any(),
        period: any().abs(),
        motor_angle: any(),
        output_angle: any(),
        deflection: 1e-3 * any(),
        deflection_rate: any(),
        velocity: any(),
        acceleration: any(),
        temperature: any(),
        base_torque: any(),
        base_torque_rate: any(),
        motor_velocity: any(),
        output_velocity: any(),
        simulated_torque: any(),
    };
    match parameters.compensated() {
        Some(compensated) => {
            let mut state = compensated.start::<16>(&sample);
            compensated.step(&mut state, &sample);
        }
        None => {
            let mut state = parameters.terms.start();
            parameters.terms.torque(&mut state, &sample);
        }
    }
}

#[test]
fn any_bytes_are_refused_or_computed_with() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/golden");
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("the golden blocks").map(|file| file.expect("a file").path()).collect();
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).expect("a golden block")).collect();
    let (executions, seed) = (number("GMHM_FUZZ", EXECUTIONS), number("GMHM_FUZZ_SEED", 1));
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    let mut codes = BTreeMap::new();
    let started = std::time::Instant::now();
    for k in 0..executions {
        let mut block = seeds[dice.random_range(0..seeds.len())].clone();
        for _ in 0..dice.random_range(1..=4) {
            mutate(&mut block, &seeds, &mut dice);
        }
        if dice.random_range(0..16) > 0 {
            seal(&mut block);
        }
        // Firmware of the block's own arithmetic as a rule.
        let fixed = if k % 16 == 0 { dice.random() } else { block.get(32) == Some(&2) };
        let code = match (fixed, k % 2) {
            (true, 0) => load::<Fixed, Masing<Fixed>, ()>(&block, &mut dice).0,
            (true, _) => load::<Fixed, Time<Fixed>, ()>(&block, &mut dice).0,
            _ => {
                let (code, parameters) = load::<f32, AnyLaw<f32>, Stack<f32, 8>>(&block, &mut dice);
                let checked = verify_first(&block).and_then(|block| {
                    Ok((
                        block,
                        Parameters::<f32, AnyLaw<f32>, CheckedTerms<8>>::of_any_block(
                            &block,
                            16,
                            block.header().torque_unit,
                        )?,
                    ))
                });
                assert_eq!(checked.as_ref().map_or_else(BlockError::code, |_| 0), code);
                if let (Ok((block, checked)), Some(parameters)) = (&checked, &parameters) {
                    assert!(checked.terms.plant(block) == parameters.terms.plant());
                }
                if let Some(parameters) = parameters {
                    use_terms(&parameters, &mut dice);
                }
                code
            }
        };
        *codes.entry(code).or_insert(0_u64) += 1;
        if executions >= 1_000_000 && k % (executions / 10) == 0 {
            println!("{k} of {executions} blocks after {:.0} s", started.elapsed().as_secs_f64());
        }
    }
    println!("{executions} blocks from seed {seed}; loaded and computed with: {}", codes.get(&0).unwrap_or(&0));
    for (code, count) in codes.iter().filter(|(code, _)| **code > 0) {
        println!("refused by {code:#06x}: {count}");
    }
    // Every way through was taken: loaded, and every refusal but that of a writer without room.
    if executions >= EXECUTIONS {
        assert!(codes[&0] > executions / 100, "only {} were loaded", codes[&0]);
        for code in (0x0101..=0x010e).chain([0x0110]) {
            assert!(codes.contains_key(&code), "no block was refused by {code:#06x}");
        }
    }
}
