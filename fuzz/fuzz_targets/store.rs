//! Two slots of arbitrary flash, a write that loses its power, a write that does not.
#![no_main]

use gmhm::block::{Block, HEADER_BYTES, Header, Identity, ScalarKind, verify, verify_first, crc32};
use gmhm::store::{Entry, Store, is_newer};
use gmhm_host_tests::flash::HostileFlash;
use libfuzzer_sys::fuzz_target;

const SLOT: usize = 128;

type Flash = HostileFlash<4, 64>;

fn open(flash: Flash) -> Store<Flash> {
    let slot = SLOT as u32;
    Store::new(flash, 0..slot, slot..2 * slot).expect("two slots")
}

/// The shortest block of a sequence number.
fn block(sequence: u32) -> [u8; HEADER_BYTES + 4] {
    let length = HEADER_BYTES as u32 + 4;
    let header = Header { length, sequence, ..Header::new(Identity::NONE, ScalarKind::F32) };
    let mut bytes = [0; HEADER_BYTES + 4];
    bytes[..HEADER_BYTES].copy_from_slice(&header.encode());
    let crc = crc32(&bytes[..HEADER_BYTES]);
    bytes[HEADER_BYTES..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Gives bytes that claim to be a block the CRC-32 of one.
fn repair(slot: &mut [u8]) {
    let length = u32::from_le_bytes([slot[8], slot[9], slot[10], slot[11]]) as usize;
    if (4..=slot.len()).contains(&length) {
        let crc = crc32(&slot[..length - 4]);
        slot[length - 4..length].copy_from_slice(&crc.to_le_bytes());
    }
}

fn bytes(store: &mut Store<Flash>, entry: &Entry) -> Vec<u8> {
    let mut bytes = vec![0; entry.header.length as usize];
    store.read(entry, 0, &mut bytes).expect("an entry reads");
    bytes
}

fuzz_target!(|data: &[u8]| {
    let Some(([choice, moment], content)) = data.split_first_chunk().map(|([a, b], rest)| ([*a, *b], rest)) else { return };
    let mut memory = [0xFF; 2 * SLOT];
    memory.iter_mut().zip(content).for_each(|(to, from)| *to = *from);
    let (a, b) = memory.split_at_mut(SLOT);
    for (slot, bit) in [(a, 1), (b, 2)] {
        // A header to begin with, where asked for: the fuzzer then need not find the magic.
        if choice & (4 * bit) != 0 {
            slot[..8].copy_from_slice(&block(0)[..8]);
        }
        if choice & bit != 0 {
            repair(slot);
        }
    }
    let mut flash = Flash::new(2 * SLOT / 64, choice & 64 != 0, u64::from(moment));
    flash.plant(0, &memory);
    let mut store = open(flash);

    let entries = store.entries();
    for entry in entries.iter().flatten() {
        let bytes = bytes(&mut store, entry);
        let checked = bytes.len() - 4;
        assert_eq!(crc32(&bytes[..checked]).to_le_bytes(), bytes[checked..]);
        assert_eq!(entry.crc.to_le_bytes(), bytes[checked..]);
        // Its records may be none, but its header is one.
        assert_eq!(Header::decode(&bytes).ok(), Some(entry.header));
        let _ = verify_first(&bytes).map(|block: Block<'_>| block.name().len());
    }
    if let [Some(newest), Some(before)] = &entries {
        assert!(!is_newer(before.header.sequence, newest.header.sequence));
    }
    let [newest, _] = entries;
    let old = newest.map(|entry| bytes(&mut store, &entry));
    let Some(sequence) = newest.map_or(0, |entry| entry.header.sequence).checked_add(1) else { return };

    // A write that loses its power somewhere, or comes to its end.
    let new = block(sequence);
    let mut flash = store.into_flash();
    flash.cut_after(u64::from(moment), u64::from(choice));
    let mut store = open(flash);
    let written = store.write(&verify(&new).expect("a block")).is_ok();
    let mut flash = store.into_flash();
    let was_cut = flash.power_up();
    assert!(written || was_cut);
    let mut store = open(flash);
    let found = store.newest().map(|entry| bytes(&mut store, &entry));
    let is_new = found.as_deref() == Some(&new);
    assert!(is_new || (found == old && was_cut));

    // The next one goes through, and back again.
    let Some(next) = store.newest().map_or(0, |entry| entry.header.sequence).checked_add(1) else { return };
    let next = block(next);
    // With error correction, the slot of a first block that lost its power may not read.
    store.erase_unreadable().expect("power");
    store.write(&verify(&next).expect("a block")).expect("power");
    let entry = store.newest().expect("the block just written");
    assert_eq!(bytes(&mut store, &entry), next);
    if found.is_some() {
        store.roll_back().expect("the block before");
        let entry = store.newest().expect("the block before");
        assert_eq!(Some(bytes(&mut store, &entry)), found);
    }
});
