//! Power may fail at any byte of a write and at any stage of an erase: boot then finds the old or the new block whole, and the next write succeeds.

use crate::common::blocks::block;
use gmhm::block::{Identity, verify};
use gmhm::store::{Store, StoreError};
use gmhm_host_tests::flash::{FlashFault, HostileFlash};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Flash<const W: usize, const E: usize> = HostileFlash<W, E>;

/// What lies in flash before the interrupted operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Before {
    Nothing,
    One,
    Two,
    /// One block, and a slot of random bits where the next one goes.
    OneAndNoise,
    /// A block whose rolled-back follower left its slot erased.
    RolledBack,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    Write,
    RollBack,
}

struct Case<const W: usize, const E: usize> {
    flash: Flash<W, E>,
    sectors: usize,
    /// The block in force, and what it is after the operation.
    old: Option<Vec<u8>>,
    new: Vec<u8>,
}

fn open<const W: usize, const E: usize>(flash: Flash<W, E>, sectors: usize) -> Store<Flash<W, E>> {
    let slot = (sectors * E) as u32;
    // A sector before, between and behind that the store must leave alone.
    let e = E as u32;
    Store::new(flash, e..e + slot, 2 * e + slot..2 * e + 2 * slot).expect("two slots")
}

fn newest<const W: usize, const E: usize>(store: &mut Store<Flash<W, E>>) -> Option<Vec<u8>> {
    let entry = store.newest()?;
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(&entry, 0, &mut bytes).expect("the newest block reads");
    Some(bytes)
}

fn write<const W: usize, const E: usize>(
    store: &mut Store<Flash<W, E>>,
    bytes: &[u8],
) -> Result<(), StoreError<FlashFault>> {
    let block = verify(bytes).expect("a sound block");
    match store.write(&block) {
        // The slot of the first block that the drive ever stored: erased on purpose.
        Err(StoreError::Unreadable { .. }) => {
            store.erase_unreadable()?;
            store.write(&block).map(drop)
        }
        written => written.map(drop),
    }
}

fn prepare<const W: usize, const E: usize>(
    sectors: usize,
    length: usize,
    corrects_errors: bool,
    before: Before,
    operation: Operation,
) -> Option<Case<W, E>> {
    let room = 2 * sectors + 3;
    let mut flash = Flash::<W, E>::new(room, corrects_errors, 1);
    for guard in [0, sectors + 1, 2 * sectors + 2] {
        flash.plant(guard * E, &[0xA5; E]);
    }
    let of = |sequence: u32| block(length, sequence, Identity::NONE, sequence as u8);
    let mut store = open(flash, sectors);
    let held: &[u32] = match before {
        Before::Nothing => &[],
        Before::One | Before::OneAndNoise => &[1],
        Before::Two | Before::RolledBack => &[1, 2],
    };
    for sequence in held {
        write(&mut store, &of(*sequence)).expect("room for a block");
    }
    if before == Before::RolledBack {
        store.roll_back().expect("one before");
    }
    let mut flash = store.into_flash();
    if before == Before::OneAndNoise {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let noise: Vec<u8> = (0..sectors * E).map(|_| random.random()).collect();
        flash.plant((sectors + 2) * E, &noise);
    }
    let last = if before == Before::RolledBack { 1 } else { held.len() as u32 };
    let old = (last > 0).then(|| of(last));
    let new = match operation {
        Operation::Write => of(last + 1),
        Operation::RollBack if before == Before::Two => of(1),
        Operation::RollBack => return None,
    };
    Some(Case { flash, sectors, old, new })
}

fn operate<const W: usize, const E: usize>(
    store: &mut Store<Flash<W, E>>,
    operation: Operation,
    new: &[u8],
) -> Result<(), StoreError<FlashFault>> {
    match operation {
        Operation::Write => write(store, new),
        Operation::RollBack => store.roll_back().map(drop),
    }
}

/// How many moments an uninterrupted operation takes.
fn moments<const W: usize, const E: usize>(case: &Case<W, E>, operation: Operation) -> u64 {
    let mut store = open(case.flash.clone(), case.sectors);
    let start = case.flash.moments();
    operate(&mut store, operation, &case.new).expect("power");
    assert_eq!(newest(&mut store).as_ref(), Some(&case.new));
    store.into_flash().moments() - start
}

/// Cuts the operation after `moment` and looks at what boot finds; gives the flash after that boot.
fn cut<const W: usize, const E: usize>(
    case: &Case<W, E>,
    operation: Operation,
    moment: u64,
    seed: u64,
) -> (Flash<W, E>, bool) {
    let mut flash = case.flash.clone();
    flash.cut_after(moment, seed);
    let mut store = open(flash, case.sectors);
    let result = operate(&mut store, operation, &case.new);
    assert!(!matches!(result, Err(StoreError::Flash(FlashFault::Rewritten(_)))), "{result:?}");
    let mut flash = store.into_flash();
    assert!(flash.power_up(), "power did not fail");
    let mut store = open(flash, case.sectors);
    let found = newest(&mut store);
    let is_new = found.as_ref() == Some(&case.new);
    assert!(
        is_new || found == case.old,
        "neither the old nor the new block after a cut at moment {moment}, seed {seed}"
    );
    (store.into_flash(), is_new)
}

/// After a cut, the next write goes through and nothing beside the slots was touched.
fn repair<const W: usize, const E: usize>(flash: Flash<W, E>, case: &Case<W, E>, is_new: bool) {
    let mut store = open(flash, case.sectors);
    let sequence = store.newest().map_or(0, |entry| entry.header.sequence) + 1;
    let next = block(case.new.len(), sequence, Identity::NONE, 77);
    write(&mut store, &next).expect("a write after the cut");
    assert_eq!(newest(&mut store), Some(next));
    if is_new || case.old.is_some() {
        store.roll_back().expect("what was found stayed whole");
        assert_eq!(newest(&mut store), if is_new { Some(case.new.clone()) } else { case.old.clone() });
    }
    let flash = store.into_flash();
    for guard in [0, case.sectors + 1, 2 * case.sectors + 2] {
        assert!(
            flash.bytes()[guard * E..(guard + 1) * E].iter().all(|byte| *byte == 0xA5),
            "a sector beside the slots"
        );
    }
}

/// Every moment of every case, with several fates of the bits that the cut leaves undecided; the number of cuts.
fn every_moment<const W: usize, const E: usize>(sectors: usize, lengths: &[usize], fates: u64) -> u64 {
    let mut cuts = 0;
    for_each_case::<W, E>(sectors, lengths, |case, operation| {
        for moment in 0..moments(case, operation) {
            for fate in 0..fates {
                let (flash, is_new) = cut(case, operation, moment, moment * fates + fate);
                repair(flash, case, is_new);
                cuts += 1;
            }
        }
    });
    cuts
}

/// A second cut at every moment of the retry, after a first at every moment.
fn every_pair<const W: usize, const E: usize>(sectors: usize, length: usize) -> u64 {
    let mut cuts = 0;
    for_each_case::<W, E>(sectors, &[length], |case, operation| {
        for first in 0..moments(case, operation) {
            let (flash, is_new) = cut(case, operation, first, first);
            if is_new {
                continue;
            }
            let retry = Case { flash, sectors, old: case.old.clone(), new: case.new.clone() };
            if operation == Operation::RollBack && open(retry.flash.clone(), sectors).entries()[1].is_none() {
                continue;
            }
            for second in 0..moments(&retry, operation) {
                let (flash, is_new) = cut(&retry, operation, second, second);
                repair(flash, &retry, is_new);
                cuts += 1;
            }
        }
    });
    cuts
}

fn for_each_case<const W: usize, const E: usize>(
    sectors: usize,
    lengths: &[usize],
    mut run: impl FnMut(&Case<W, E>, Operation),
) {
    for length in lengths {
        for corrects_errors in [false, true] {
            for before in [Before::Nothing, Before::One, Before::Two, Before::OneAndNoise, Before::RolledBack] {
                for operation in [Operation::Write, Operation::RollBack] {
                    if let Some(case) = prepare::<W, E>(sectors, *length, corrects_errors, before, operation) {
                        run(&case, operation);
                    }
                }
            }
        }
    }
}

#[test]
fn every_cut_leaves_the_old_or_the_new_block() {
    let cuts = every_moment::<1, 256>(1, &[56, 60, 100, 256], 4)
        + every_moment::<2, 512>(1, &[60, 200], 4)
        + every_moment::<4, 1024>(1, &[56, 348], 3)
        + every_moment::<4, 128>(4, &[348, 512], 2)
        + every_moment::<8, 2048>(1, &[60, 348], 2)
        + every_moment::<32, 256>(2, &[60, 92, 348], 3)
        + every_moment::<64, 256>(1, &[56, 60, 128], 3);
    println!("power cut at {cuts} points, each at a byte of a write or a stage of an erase");
    assert!(cuts > 80_000, "{cuts}");
}

#[test]
fn so_does_a_second_cut_in_the_retry() {
    let cuts = every_pair::<1, 128>(1, 60) + every_pair::<4, 128>(1, 60) + every_pair::<8, 64>(2, 72);
    println!("power cut at {cuts} pairs of points");
    assert!(cuts > 50_000, "{cuts}");
}

/// Flash that another program has filled, or that never was erased: nothing is found, nothing panics, and a first block goes in.
#[test]
fn random_flash_holds_no_block() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for round in 0..2000 {
        let mut flash = Flash::<4, 256>::new(2, false, round);
        let mut noise: Vec<u8> = (0..512).map(|_| random.random()).collect();
        // A header that could be, its fields random where that goes.
        let planted = block(60 + 4 * (round as usize % 40), random.random(), Identity::NONE, 0);
        let kept = random.random_range(0..planted.len());
        noise[..kept].copy_from_slice(&planted[..kept]);
        noise[kept] = !planted[kept];
        flash.plant(0, &noise);
        let mut store = Store::new(flash, 0..256, 256..512).expect("two slots");
        assert_eq!(store.entries(), [None, None]);
        let first = block(60, 1, Identity::NONE, 1);
        write(&mut store, &first).expect("room");
        assert_eq!(newest(&mut store), Some(first));
    }
}

#[test]
fn refusals_touch_nothing() {
    let mut store = Store::new(Flash::<4, 256>::new(2, false, 0), 0..256, 256..512).expect("two slots");
    assert_eq!(store.roll_back(), Err(StoreError::NothingBefore));
    assert_eq!(write(&mut store, &block(60, 0, Identity::NONE, 0)), Err(StoreError::NotNewer { newest: 0 }));
    write(&mut store, &block(60, 5, Identity::NONE, 0)).expect("room");
    assert_eq!(write(&mut store, &block(60, 5, Identity::NONE, 1)), Err(StoreError::NotNewer { newest: 5 }));
    assert_eq!(write(&mut store, &block(260, 6, Identity::NONE, 1)), Err(StoreError::TooLong { room: 256 }));
    assert_eq!(store.roll_back(), Err(StoreError::NothingBefore));
    let entry = store.newest().expect("the first block");
    assert_eq!(store.read(&entry, 250, &mut [0; 8]), Err(StoreError::TooLong { room: 256 }));
    assert_eq!(newest(&mut store), Some(block(60, 5, Identity::NONE, 0)));
    write(&mut store, &block(60, u32::MAX, Identity::NONE, 2)).expect("room");
    assert_eq!(
        write(&mut store, &block(60, u32::MAX, Identity::NONE, 3)),
        Err(StoreError::NotNewer { newest: u32::MAX })
    );
}

#[test]
fn places_are_checked() {
    let store = |a, b| Store::new(Flash::<4, 256>::new(4, false, 0), a, b).err().map(|error| error.to_string());
    assert_eq!(store(0..256, 256..512), None);
    assert!(store(0..100, 256..512).is_some_and(|text| text.contains("whole sectors of 256 bytes")));
    assert!(store(0..0, 256..512).is_some_and(|text| text.contains("whole sectors")));
    assert!(store(0..256, 768..1280).is_some_and(|text| text.contains("1024 bytes")));
    assert!(store(0..512, 256..512).is_some_and(|text| text.contains("overlap")));
}
