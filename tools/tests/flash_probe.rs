//! Blocks through a debug probe: a chip that is played here, the places of blocks, and the words of the command.

use std::cell::RefCell;

use crate::common::{PUBLISHED, WorkDir};
use gmhm::block::verify_first;
use gmhm_tools::device::DeviceError;
use gmhm_tools::device::probe::{Chip, Elf, ProbeError, Sectors, flash};

const FLASH: u64 = 0x800_0000;
const SECTOR: u64 = 0x800;
const PLACES: [u64; 2] = [FLASH + SECTOR, FLASH + 2 * SECTOR];

/// Four sectors of flash.
struct Played {
    memory: Vec<u8>,
    restarts: usize,
    /// Programs this bit of the first word wrong.
    worn: u32,
}

impl Played {
    fn new() -> Self {
        Self { memory: vec![0xFF; 4 * SECTOR as usize], restarts: 0, worn: 0 }
    }

    fn sequence(&self, place: u64) -> Option<u32> {
        let block = verify_first(&self.memory[(place - FLASH) as usize..]).ok()?;
        Some(block.header().sequence)
    }
}

impl Chip for Played {
    fn sectors(&self, address: u64) -> Option<Sectors> {
        let flash = FLASH..FLASH + 4 * SECTOR;
        flash.contains(&address).then(|| Sectors { flash, sizes: vec![(0, SECTOR)] })
    }

    fn read(&mut self, address: u64, bytes: &mut [u8]) -> Result<(), ProbeError> {
        let from = (address - FLASH) as usize;
        bytes.copy_from_slice(&self.memory[from..from + bytes.len()]);
        Ok(())
    }

    fn program(&mut self, address: u64, bytes: &[u8], progress: &mut dyn FnMut(usize)) -> Result<(), ProbeError> {
        let from = (address - FLASH) as usize;
        let end = (from + bytes.len()).next_multiple_of(SECTOR as usize);
        self.memory[from / SECTOR as usize * SECTOR as usize..end].fill(0xFF);
        self.memory[from..from + bytes.len()].copy_from_slice(bytes);
        self.memory[from + 40] ^= self.worn as u8;
        progress(bytes.len());
        Ok(())
    }

    fn restart(&mut self) -> Result<(), ProbeError> {
        self.restarts += 1;
        Ok(())
    }
}

fn packed(options: &str) -> Vec<u8> {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed(&format!("pack gear.toml {options} -o params.bin"));
    std::fs::read(dir.path("params.bin")).expect("a block")
}

fn put(chip: &mut Played, block: &[u8], places: &[u64]) -> Result<u32, DeviceError> {
    let heard = RefCell::new(Vec::new());
    let flashed = flash(block, places, None, chip, |done, total| heard.borrow_mut().push((done, total)))?;
    let whole = 2 * block.len();
    assert_eq!(heard.into_inner(), [(block.len(), whole), (whole, whole)]);
    assert!(chip.memory.windows(block.len()).any(|bytes| bytes == flashed.bytes));
    Ok(flashed.sequence)
}

#[test]
fn the_place_without_the_newest_block_is_written() {
    let block = packed("");
    let mut chip = Played::new();
    assert_eq!(put(&mut chip, &block, &PLACES).ok(), Some(1));
    assert_eq!(PLACES.map(|place| chip.sequence(place)), [Some(1), None]);
    assert_eq!(put(&mut chip, &block, &PLACES).ok(), Some(2));
    assert_eq!(PLACES.map(|place| chip.sequence(place)), [Some(1), Some(2)]);
    assert_eq!(put(&mut chip, &block, &PLACES).ok(), Some(3));
    assert_eq!(PLACES.map(|place| chip.sequence(place)), [Some(3), Some(2)]);
    // What is damaged counts as none.
    chip.memory[SECTOR as usize + 60] ^= 1;
    assert_eq!(put(&mut chip, &block, &PLACES).ok(), Some(3));
    assert_eq!(PLACES.map(|place| chip.sequence(place)), [Some(3), Some(2)]);
    assert_eq!(chip.restarts, 4);
    // A sector before and one behind were left alone.
    assert!([0, 3].iter().all(|k| chip.memory[k * SECTOR as usize..][..SECTOR as usize].iter().all(|x| *x == 0xFF)));
}

#[test]
fn one_place_is_written_over() {
    let block = packed("");
    let mut chip = Played::new();
    for sequence in 1..4 {
        assert_eq!(put(&mut chip, &block, &PLACES[..1]).ok(), Some(sequence));
    }
    assert_eq!(PLACES.map(|place| chip.sequence(place)), [Some(3), None]);
}

#[test]
fn refusals_touch_nothing() {
    let mut chip = Played::new();
    put(&mut chip, &packed(""), &PLACES).expect("the first block");
    let before = chip.memory.clone();
    let mut told = |block: &[u8], places: &[u64]| put(&mut chip, block, places).expect_err("refused").to_string();
    assert!(told(&packed("--gear other"), &PLACES).contains("the drive has gear \"published\""));
    assert!(told(&packed("--scalar fixed"), &PLACES).contains("the block is for fixed"));
    assert!(told(&packed("")[1..], &PLACES).contains("no parameter block"));
    assert!(told(&packed(""), &[PLACES[0], PLACES[0] + 0x100]).contains("is not the start of an erase sector"));
    assert!(told(&packed(""), &[PLACES[0], PLACES[0]]).contains("share erase sectors"));
    assert!(told(&packed(""), &[0x2000_0000]).contains("no flash"));
    assert!(told(&packed(""), &[]).contains("0 addresses"));
    assert_eq!((chip.restarts, chip.memory == before), (1, true));
}

#[test]
fn what_reads_back_otherwise_is_told() {
    let mut chip = Played { worn: 4, ..Played::new() };
    let error = put(&mut chip, &packed(""), &PLACES).expect_err("a worn flash");
    assert!(matches!(error, DeviceError::ReadBack { offset: 40, .. }), "{error}");
    assert_eq!(chip.restarts, 0, "firmware is not started on it");
}

/// This test itself is an ELF file, with a symbol `main` and sections at addresses.
#[cfg(target_os = "linux")]
#[test]
fn the_firmware_says_where() {
    let exe = std::env::current_exe().expect("this test has a path");
    let elf = Elf::load(&exe).expect("an ELF file");
    let main = elf.address("main").expect("a symbol");
    let error = elf.address("gmhm_slot_a").expect_err("no such symbol");
    assert!(error.to_string().contains("no symbol `gmhm_slot_a`"), "{error}");
    let leaves = |sector| elf.leaves(std::slice::from_ref(&sector));
    // A sector in the middle of the code would take it along; one that holds a section whole may be that of the block.
    let error = leaves(main & !0xF..(main & !0xF) + 16).expect_err("code is there");
    assert!(matches!(&error, ProbeError::InUse { section, .. } if section == ".text"), "{error}");
    leaves(0x4000_0000_0000..0x4000_0000_1000).expect("nothing is there");
    leaves(0..u64::from(u32::MAX)).expect("all of it is there");
}

#[test]
fn the_command_needs_a_place_and_a_probe() {
    let dir = WorkDir::new();
    dir.write("gear.toml", PUBLISHED);
    dir.succeed("pack gear.toml -o params.bin");
    let wrong = |words: &str| assert_eq!(dir.gmhm(words).status, Some(2), "{words}");
    wrong("flash params.bin --to probe:nRF51822_xxAA");
    wrong("flash params.bin --to probe:nRF51822_xxAA --address 0x3F800 --elf firmware.elf");
    wrong("flash params.bin --to probe:nRF51822_xxAA --address here");
    wrong("flash params.bin --to tcp:localhost:1 --address 0x3F800");
    let refused = |words: &str, told: &str| dir.refuse(words, &[told, "help: "]);
    refused("flash params.bin --to probe --elf firmware.elf", "firmware.elf: cannot be read");
    refused("flash params.bin --to probe --elf gear.toml", "gear.toml: is not an ELF file");
    refused("flash params.bin --to probe --address 0x3F800,0x3FC00,0x40000", "3 addresses");
    // No test machine has a probe attached.
    let told = if cfg!(feature = "probe") { "no debug probe is attached" } else { "built without debug probes" };
    refused("flash params.bin --to probe:nRF51822_xxAA --address 0x3F800,0x3FC00", told);
}
