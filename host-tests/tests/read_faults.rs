//! Reads of the flash may fail for a while: what is in force is never erased for it.

use crate::common::blocks::block;
use gmhm::block::{Identity, verify};
use gmhm::store::{ATTEMPTS, Entry, Store, StoreError, is_newer, next_sequence};
use gmhm_host_tests::flash::{FlashFault, HostileFlash, ReadFault};

type Flash = HostileFlash<4, 256>;

fn of(sequence: u32) -> Vec<u8> {
    block(100, sequence, Identity::NONE, sequence as u8)
}

fn open(flash: Flash) -> Store<Flash> {
    Store::new(flash, 0..256, 256..512).expect("two slots")
}

fn write(store: &mut Store<Flash>, bytes: &[u8]) -> Result<Entry, StoreError<FlashFault>> {
    store.write(&verify(bytes).expect("a block"))
}

/// A flash that holds these blocks, stored one after the other.
fn holding(sequences: &[u32]) -> Flash {
    let mut store = open(Flash::new(2, true, 5));
    for sequence in sequences {
        write(&mut store, &of(*sequence)).expect("room");
    }
    store.into_flash()
}

fn newest(store: &mut Store<Flash>) -> Option<Vec<u8>> {
    let entry = store.newest()?;
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(&entry, 0, &mut bytes).ok()?;
    Some(bytes)
}

const FAULTS: [ReadFault; 3] = [ReadFault::Error, ReadFault::Flip, ReadFault::Erased];

/// The operation with a disturbance at every one of its reads; then the flash is sound again, and a drive boots.
fn at_every_read(
    sequences: &[u32],
    booted: bool,
    count: u64,
    operation: impl Fn(&mut Store<Flash>) -> bool,
    new: u32,
) -> u32 {
    let mut cases = 0;
    for fault in FAULTS {
        for after in 0.. {
            let mut flash = holding(sequences);
            let mut known = None;
            if booted {
                let mut store = open(flash);
                known = store.newest();
                flash = store.into_flash();
            }
            let before = flash.reads();
            flash.disturb_reads(after, count, fault);
            let mut store = open(flash);
            if booted {
                store.keep(known);
            }
            let done = operation(&mut store);
            let mut flash = store.into_flash();
            if flash.reads() - before <= after {
                break;
            }
            flash.disturb_reads(0, 0, fault);
            let found = newest(&mut open(flash.clone()));
            let (old, new) = (sequences.last().map(|last| of(*last)), of(new));
            assert!(found == old || found.as_ref() == Some(&new), "{sequences:?}, {fault:?} after {after}: lost");
            assert!(!done || found == Some(new), "{sequences:?}, {fault:?} after {after}: not what was said");
            cases += 1;
        }
    }
    cases
}

#[test]
fn one_disturbed_read_costs_nothing_that_is_in_force() {
    let mut cases = 0;
    for booted in [false, true] {
        for sequences in [&[1][..], &[1, 2], &[1, 2, 3]] {
            let next = sequences.len() as u32 + 1;
            cases += at_every_read(sequences, booted, 1, |store| write(store, &of(next)).is_ok(), next);
            // One less than what makes a slot count as none.
            cases += at_every_read(
                sequences,
                booted,
                u64::from(ATTEMPTS) - 1,
                |store| write(store, &of(next)).is_ok(),
                next,
            );
        }
        for sequences in [&[1, 2][..], &[1, 2, 3]] {
            let before = sequences.len() as u32 - 1;
            cases += at_every_read(sequences, booted, 1, |store| store.roll_back().is_ok(), before);
        }
    }
    println!("{cases} disturbed operations");
    assert!(cases > 100, "{cases}");
}

#[test]
fn a_slot_in_force_that_is_remembered_survives_any_disturbance() {
    for fault in FAULTS {
        for sequences in [&[1][..], &[1, 2], &[1, 2, 3]] {
            for count in [1, 5, 50, 1_000_000] {
                let mut store = open(holding(sequences));
                let in_force = store.newest().expect("a block");
                // The reads of both slots fail for a while from here on.
                let mut flash = store.into_flash();
                flash.disturb_reads(0, count, fault);
                let mut store = open(flash);
                store.keep(Some(in_force));
                let result = write(&mut store, &of(9));
                let mut flash = store.into_flash();
                flash.disturb_reads(0, 0, fault);
                let mut store = open(flash);
                let entries = store.entries();
                assert!(
                    entries.contains(&Some(in_force)),
                    "{fault:?}, {count}, {sequences:?}: {result:?}, {entries:?}"
                );
            }
        }
    }
}

/// A drive that refuses the newest block runs on the one before: that is the one to keep.
#[test]
fn what_the_drive_runs_on_is_kept_even_where_it_is_the_older() {
    let mut store = open(holding(&[1, 2]));
    let [_, older] = store.entries();
    store.keep(older);
    let entry = write(&mut store, &of(3)).expect("room");
    assert_ne!(Some(entry.slot), older.map(|older| older.slot));
    assert_eq!(store.entries(), [Some(entry), older]);
}

#[test]
fn after_the_last_sequence_number_comes_the_first() {
    assert_eq!([0, 1, u32::MAX - 1, u32::MAX].map(next_sequence), [1, 2, u32::MAX, 1]);
    assert!(is_newer(1, u32::MAX) && !is_newer(u32::MAX, 1) && is_newer(u32::MAX, 5) && !is_newer(2, u32::MAX));
    let mut store = open(holding(&[5, u32::MAX]));
    let mut last = u32::MAX;
    for _ in 0..5 {
        assert_eq!(write(&mut store, &of(last)), Err(StoreError::NotNewer { newest: last }));
        last = next_sequence(last);
        let entry = write(&mut store, &of(last)).expect("room");
        assert_eq!(store.newest(), Some(entry));
        // A drive that boots finds the same.
        store = open(store.into_flash());
        assert_eq!(newest(&mut store), Some(of(last)));
    }
    assert_eq!(last, 5);
}
