//! A write or an erase may fail once with nothing, a part or all of it done, and power may fail after it: boot still finds the block in force.

use crate::common::blocks::block;
use gmhm::block::{Identity, verify};
use gmhm::store::{Entry, Slot, Store, StoreError};
use gmhm_host_tests::flash::{ChangeFault, FlashFault, HostileFlash, ReadFault};

type Flash = HostileFlash<4, 256>;

fn of(sequence: u32) -> Vec<u8> {
    block(60, sequence, Identity::NONE, sequence as u8)
}

fn open(flash: Flash) -> Store<Flash> {
    Store::new(flash, 0..256, 256..512).expect("two slots")
}

fn write(store: &mut Store<Flash>, sequence: u32) -> Result<Entry, StoreError<FlashFault>> {
    store.write(&verify(&of(sequence)).expect("a block"))
}

/// A flash that holds these blocks, stored one after the other.
fn holding(sequences: &[u32], corrects_errors: bool) -> Flash {
    let mut store = open(Flash::new(2, corrects_errors, 5));
    for sequence in sequences {
        write(&mut store, *sequence).expect("room");
    }
    store.into_flash()
}

/// The sequence number of the newest block, read whole.
fn newest(flash: Flash) -> Option<u32> {
    let mut store = open(flash);
    let entry = store.newest()?;
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(&entry, 0, &mut bytes).expect("the newest block reads");
    assert_eq!(bytes, of(entry.header.sequence));
    Some(entry.header.sequence)
}

#[derive(Debug, Clone, Copy)]
enum Fault {
    Change(u64, ChangeFault),
    Read(u64, ReadFault),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operation {
    Write(u32),
    RollBack,
}

impl Operation {
    fn run(self, store: &mut Store<Flash>) -> Result<Entry, StoreError<FlashFault>> {
        match self {
            Self::Write(sequence) => write(store, sequence),
            Self::RollBack => store.roll_back(),
        }
    }

    /// What firmware does: the same again where it failed, after it has erased what could not be read.
    fn run_until_done(self, store: &mut Store<Flash>) {
        for _ in 0..3 {
            match self.run(store) {
                Ok(_) => return,
                Err(StoreError::Unreadable { .. }) => drop(store.erase_unreadable()),
                Err(_) => {}
            }
        }
    }
}

/// The operation with one fault and with a power cut at every moment from its beginning to the end of its retries.
fn with_every_cut(flash: &Flash, operation: Operation, fault: Fault, old: Option<u32>, new: Option<u32>) -> u64 {
    for moment in 0.. {
        let mut flash = flash.clone();
        match fault {
            Fault::Change(after, fault) => flash.disturb_change(after, fault),
            Fault::Read(after, fault) => flash.disturb_reads(after, 1, fault),
        }
        flash.cut_after(moment, moment);
        let mut store = open(flash);
        store.newest();
        operation.run_until_done(&mut store);
        let mut flash = store.into_flash();
        let was_cut = flash.power_up();
        flash.disturb_reads(0, 0, ReadFault::Error);
        let found = newest(flash);
        assert!(found == new || (found == old && was_cut), "{operation:?}, {fault:?}, cut at {moment}: {found:?}");
        if !was_cut {
            return moment;
        }
    }
    0
}

#[test]
fn one_fault_and_a_power_cut_lose_nothing() {
    let mut cuts = 0;
    for corrects_errors in [false, true] {
        for sequences in [&[][..], &[1], &[1, 2], &[1, 2, 3]] {
            let flash = holding(sequences, corrects_errors);
            let old = sequences.last().copied();
            let next = old.unwrap_or(0) + 1;
            let mut operations = vec![(Operation::Write(next), Some(next))];
            if sequences.len() > 1 {
                operations.push((Operation::RollBack, old.map(|old| old - 1)));
            }
            for (operation, new) in operations {
                let (mut store, before) = (open(flash.clone()), (flash.changes(), flash.reads()));
                store.newest();
                operation.run(&mut store).expect("a sound flash");
                let after = store.into_flash();
                let (changes, reads) = (after.changes() - before.0, after.reads() - before.1);
                for fault in [ChangeFault::Nothing, ChangeFault::Part, ChangeFault::All] {
                    for change in 0..changes {
                        cuts += with_every_cut(&flash, operation, Fault::Change(change, fault), old, new);
                    }
                }
                for fault in [ReadFault::Error, ReadFault::Flip, ReadFault::Erased] {
                    for read in 0..reads {
                        cuts += with_every_cut(&flash, operation, Fault::Read(read, fault), old, new);
                    }
                }
            }
        }
    }
    println!("one fault and a power cut at {cuts} points");
    assert!(cuts > 25_000, "{cuts}");
}

/// The reads of one or both slots fail at boot and for long: nothing is known to be in force.
#[test]
fn a_write_is_refused_while_the_block_in_force_is_unknown() {
    for (hidden, slot) in [(0..512, Slot::A), (0..256, Slot::A), (256..512, Slot::B)] {
        for sequences in [&[1][..], &[1, 2], &[1, 2, 3]] {
            let mut flash = holding(sequences, true);
            let before = flash.bytes().to_vec();
            flash.hide(hidden.clone());
            let mut store = open(flash);
            assert_eq!(write(&mut store, 9), Err(StoreError::Unreadable { slot }), "{hidden:?}, {sequences:?}");
            let mut flash = store.into_flash();
            assert_eq!(flash.bytes(), before, "{hidden:?}, {sequences:?}: touched");
            flash.hide(0..0);
            assert_eq!(newest(flash.clone()), sequences.last().copied());
            // A drive that has found it before never erases it.
            let mut store = open(flash);
            let in_force = store.newest();
            let mut flash = store.into_flash();
            flash.hide(hidden.clone());
            let mut store = open(flash);
            store.keep(in_force);
            let _ = write(&mut store, 9);
            let mut flash = store.into_flash();
            flash.hide(0..0);
            assert!(open(flash).entries().contains(&in_force), "{hidden:?}, {sequences:?}");
        }
    }
}

/// The first block that a drive ever stores loses its power: with error correction its slot may not read until it is erased, deliberately.
#[test]
fn what_cannot_be_read_is_erased_on_purpose_only() {
    let mut ways_out = 0;
    for moment in 0..66 {
        let mut flash = holding(&[], true);
        flash.cut_after(moment, moment);
        let mut store = open(flash);
        assert!(write(&mut store, 1).is_err());
        let mut flash = store.into_flash();
        flash.power_up();
        let mut store = open(flash);
        assert_eq!(store.newest().map(|entry| entry.slot), None);
        if let Err(error) = write(&mut store, 1) {
            assert_eq!(error, StoreError::Unreadable { slot: Slot::A });
            store.erase_unreadable().expect("a sound flash");
            write(&mut store, 1).expect("both slots read");
            ways_out += 1;
        }
        assert_eq!(newest(store.into_flash()), Some(1));
    }
    assert!(ways_out > 30, "{ways_out}");
}

#[test]
fn only_slots_that_do_not_read_are_erased() {
    let mut store = open(holding(&[1, 2], true));
    let before = store.entries();
    store.erase_unreadable().expect("nothing to do");
    assert_eq!(store.entries(), before);
    // The one that holds the block in force, or what was found in it, stays whatever its reads give.
    let in_force = store.newest();
    for hidden in [0..256, 256..512, 0..512] {
        let mut flash = holding(&[1, 2], true);
        flash.hide(hidden.clone());
        let mut store = open(flash);
        store.keep(in_force);
        // Erased or not, the flash still does not read.
        let _ = store.erase_unreadable();
        let mut flash = store.into_flash();
        flash.hide(0..0);
        assert!(open(flash).entries().contains(&in_force), "{hidden:?}");
    }
    // A slot that stays unreadable is said to.
    let mut flash = holding(&[], true);
    flash.hide(256..512);
    assert_eq!(open(flash).erase_unreadable(), Err(StoreError::ReadBack));
}
