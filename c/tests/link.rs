//! The link of `gmhm.h` over a flash of C functions: a block goes from the line into a joint and into flash, and is there after the next power-up.

use std::cell::RefCell;
use std::ffi::c_void;
use std::mem::MaybeUninit;

use crate::common::{block, block_of, block_with, gmhm_get_status, joint};
use gmhm::block::{Joint as JointOfGear, TorqueUnit, stamp, verify};
use gmhm::diagnostics::{Fault, SelfTest};
use gmhm::link::lock::Key;
use gmhm::link::message::SAVE;
use gmhm::link::{Answer, Origin, Receiver, Refusal, Request, Tag};
use gmhm_c::{
    DiagnosticsC, DriveC, FLASH, FlashC, Joint, LinkC, LiveC, NO_BLOCK, NO_SPACE, NOT_NEWER, NULL, OK, PLACE,
    READ_BACK, StoreC, UNIT, UNREADABLE, flag, gmhm_link_boot, gmhm_link_elapse, gmhm_link_init, gmhm_link_lock,
    gmhm_link_receive, gmhm_load, gmhm_store_erase_unreadable, gmhm_store_init, gmhm_store_read, gmhm_store_write,
};

const SECTOR: u32 = 1024;

/// What the functions of C know.
struct Bench {
    cells: RefCell<Vec<u8>>,
    broken: RefCell<bool>,
    enabled: RefCell<bool>,
    joint: RefCell<Box<Joint>>,
    sent: RefCell<Vec<u8>>,
    compensation: RefCell<(u32, f32)>,
    live: RefCell<LiveC>,
    diagnostics: RefCell<DiagnosticsC>,
}

/// # Safety
/// `context` is that of [`flash`] and [`drive`].
unsafe fn bench<'a>(context: *mut c_void) -> &'a Bench {
    // SAFETY: the caller's.
    unsafe { &*context.cast::<Bench>() }
}

unsafe extern "C" fn read(context: *mut c_void, address: u32, to: *mut u8, length: u32) -> u32 {
    // SAFETY: the library hands over what it was given, and its own buffer.
    let (bench, to) = unsafe { (bench(context), std::slice::from_raw_parts_mut(to, length as usize)) };
    to.copy_from_slice(&bench.cells.borrow()[address as usize..][..to.len()]);
    0
}

unsafe extern "C" fn write(context: *mut c_void, address: u32, from: *const u8, length: u32) -> u32 {
    // SAFETY: as above.
    let (bench, from) = unsafe { (bench(context), std::slice::from_raw_parts(from, length as usize)) };
    assert!(address.is_multiple_of(64) && length.is_multiple_of(64));
    let cells = &mut bench.cells.borrow_mut()[address as usize..][..from.len()];
    assert!(cells.iter().all(|cell| *cell == 0xFF), "each byte is written once");
    cells.copy_from_slice(from);
    u32::from(*bench.broken.borrow())
}

unsafe extern "C" fn erase(context: *mut c_void, first: u32, end: u32) -> u32 {
    // SAFETY: as above.
    let bench = unsafe { bench(context) };
    bench.cells.borrow_mut()[first as usize..end as usize].fill(0xFF);
    0
}

unsafe extern "C" fn send(context: *mut c_void, bytes: *const u8, length: u32) {
    // SAFETY: as above.
    let (bench, bytes) = unsafe { (bench(context), std::slice::from_raw_parts(bytes, length as usize)) };
    bench.sent.borrow_mut().extend(bytes);
}

unsafe extern "C" fn adopt(context: *mut c_void, block: *const u8, length: u32) -> u16 {
    if block.is_null() {
        return OK;
    }
    // SAFETY: as above.
    unsafe { gmhm_load(Some(&mut bench(context).joint.borrow_mut()), block, length) }
}

unsafe extern "C" fn is_enabled(context: *mut c_void) -> u32 {
    // SAFETY: as above.
    u32::from(*unsafe { bench(context) }.enabled.borrow())
}

unsafe extern "C" fn set_compensation(context: *mut c_void, on: u32, gain_ratio: f32) {
    // SAFETY: as above.
    *unsafe { bench(context) }.compensation.borrow_mut() = (on, gain_ratio);
}

unsafe extern "C" fn get_live(context: *mut c_void, to: *mut LiveC) {
    // SAFETY: as above.
    unsafe { *to = *bench(context).live.borrow() };
}

unsafe extern "C" fn get_diagnostics(context: *mut c_void, to: *mut DiagnosticsC) {
    // SAFETY: as above.
    unsafe { *to = *bench(context).diagnostics.borrow() };
}

unsafe extern "C" fn clear_diagnostics(context: *mut c_void) {
    // SAFETY: as above.
    *unsafe { bench(context) }.diagnostics.borrow_mut() = DiagnosticsC::default();
}

impl Bench {
    fn new() -> Self {
        Self {
            cells: RefCell::new(vec![0xFF; 4 * SECTOR as usize]),
            broken: RefCell::new(false),
            enabled: RefCell::new(false),
            joint: RefCell::new(joint()),
            sent: RefCell::default(),
            compensation: RefCell::default(),
            live: RefCell::default(),
            diagnostics: RefCell::default(),
        }
    }

    fn context(&self) -> *mut c_void {
        std::ptr::from_ref(self).cast_mut().cast()
    }

    fn flash(&self) -> FlashC {
        FlashC {
            context: self.context(),
            capacity: 4 * SECTOR,
            erase_size: SECTOR,
            write_size: 8,
            first_slot: 0,
            second_slot: 2 * SECTOR,
            slot_size: 2 * SECTOR,
            read: Some(read),
            write: Some(write),
            erase: Some(erase),
        }
    }

    fn drive(&self) -> DriveC {
        DriveC {
            context: self.context(),
            send: Some(send),
            adopt: Some(adopt),
            is_enabled: Some(is_enabled),
            set_compensation: Some(set_compensation),
            get_live: Some(get_live),
            get_diagnostics: Some(get_diagnostics),
            clear_diagnostics: Some(clear_diagnostics),
        }
    }

    fn power_up(&self) -> (Box<LinkC>, u16) {
        let mut link = Box::new(MaybeUninit::uninit());
        assert_eq!(gmhm_link_init(Some(&mut link), Some(&self.flash()), 7), OK);
        // SAFETY: gmhm_link_init has written it.
        let mut link = unsafe { link.assume_init() };
        let code = gmhm_link_boot(Some(&mut link), Some(&self.drive()));
        (link, code)
    }

    /// The body of the answer.
    fn ask(&self, link: &mut LinkC, request: Request<'_>, tag: Tag) -> Vec<u8> {
        self.send(link, &request.encode(tag))
    }

    fn send(&self, link: &mut LinkC, frame: &[u8]) -> Vec<u8> {
        self.sent.borrow_mut().clear();
        // SAFETY: the frame outlives the call.
        let code = unsafe { gmhm_link_receive(Some(link), Some(&self.drive()), frame.as_ptr(), frame.len() as u32) };
        assert_eq!(code, OK);
        let mut receiver = Receiver::new();
        let sent = self.sent.borrow();
        sent.iter().filter_map(|byte| receiver.feed(*byte).map(<[u8]>::to_vec)).last().expect("an answer")
    }

    /// Stages a block and puts it on trial: the session and its next turn.
    fn try_out(&self, link: &mut LinkC, block: &[u8]) -> Tag {
        let body = self.ask(link, Request::Identify, Tag::default());
        let Some((_, _, Answer::Identified(it))) = Answer::decode(&body) else { panic!("{body:?}") };
        let mut tag = Tag { session: it.session, turn: 0 };
        let crc = verify(block).expect("a block").crc();
        let data = block.chunks(96).enumerate().map(|(k, bytes)| Request::Data { offset: 96 * k as u32, bytes });
        let stage = Request::Stage { length: block.len() as u32, crc };
        for request in [stage].into_iter().chain(data).chain([Request::Try]) {
            let body = self.ask(link, request, tag);
            assert!(matches!(Answer::decode(&body), Some((_, _, Answer::Done))), "{request:?}");
            tag.turn += 1;
        }
        tag
    }
}

fn stamped(mut bytes: Vec<u8>, sequence: u32) -> Vec<u8> {
    stamp(&mut bytes, sequence).expect("a block");
    bytes
}

#[test]
fn a_block_goes_over_the_line_into_the_joint_and_into_flash() {
    let bench = Bench::new();
    let (mut link, code) = bench.power_up();
    assert_eq!(code, NO_BLOCK);
    let stiffer = stamped(block_with(1.1, &["coulomb_friction"]), 1);
    let crc = verify(&stiffer).expect("a block").crc();
    let tag = bench.try_out(&mut link, &stiffer);
    assert_eq!(gmhm_get_status(Some(&bench.joint.borrow())).crc32, crc, "on trial");
    // An enabled drive stores nothing.
    *bench.enabled.borrow_mut() = true;
    let commit = Request::Commit { signature: SAVE, crc };
    let body = bench.ask(&mut link, commit, tag);
    let Some((_, _, Answer::Refused(refused))) = Answer::decode(&body) else { panic!("{body:?}") };
    assert_eq!(refused.refusal, Refusal::Enabled);
    *bench.enabled.borrow_mut() = false;
    let body = bench.ask(&mut link, commit, Tag { turn: tag.turn + 1, ..tag });
    assert!(matches!(Answer::decode(&body), Some((_, _, Answer::Stored { sequence: 1, .. }))), "{body:?}");
    let on = bench.ask(&mut link, Request::Compensate { on: true }, Tag { turn: tag.turn + 2, ..tag });
    assert!(matches!(Answer::decode(&on), Some((_, _, Answer::Done))));
    assert_eq!(*bench.compensation.borrow(), (1, 1.0));
    let body = bench.ask(&mut link, Request::Status, Tag::default());
    assert!(matches!(Answer::decode(&body), Some((_, _, Answer::Status(status))) if status.compensating), "{body:?}");

    *bench.joint.borrow_mut() = joint();
    let (mut link, code) = bench.power_up();
    assert_eq!(code, OK);
    assert_eq!(gmhm_get_status(Some(&bench.joint.borrow())).crc32, crc, "boot finds it");
    let body = bench.ask(&mut link, Request::Status, Tag::default());
    let Some((_, _, Answer::Status(status))) = Answer::decode(&body) else { panic!("{body:?}") };
    assert_eq!((status.origin, status.sequence), (Origin::Stored, 1));
}

#[test]
fn a_locked_link_changes_nothing_without_a_proof() {
    let bench = Bench::new();
    let (mut link, _) = bench.power_up();
    let (key, entropy) = ([0x5A; 32], [3; 16]);
    let identified = |link: &mut LinkC| {
        let body = bench.ask(link, Request::Identify, Tag::default());
        let Some((_, _, Answer::Identified(it))) = Answer::decode(&body) else { panic!("{body:?}") };
        it
    };
    assert_eq!(gmhm_link_lock(None, Some(&key), Some(&entropy)), NULL);
    for (key, entropy) in [(None, Some(&entropy)), (Some(&key), None)] {
        assert_eq!(gmhm_link_lock(Some(&mut link), key, entropy), NULL);
        assert_eq!(identified(&mut link).challenge, None, "an open drive says so");
    }
    assert_eq!(gmhm_link_lock(Some(&mut link), Some(&key), Some(&entropy)), OK);
    let it = identified(&mut link);
    let challenge = it.challenge.expect("a locked drive says so");
    let (gain, tag) = (Request::Gain { ratio: 0.25 }, Tag { session: it.session, turn: 0 });
    for frame in [gain.encode(tag), gain.encode_proven(tag, &Key([0x5B; 32]), &challenge)] {
        let body = bench.send(&mut link, &frame);
        let Some((_, _, Answer::Refused(refused))) = Answer::decode(&body) else { panic!("{body:?}") };
        assert_eq!(refused.refusal, Refusal::Locked);
    }
    let proven = gain.encode_proven(tag, &Key(key), &challenge);
    assert!(matches!(Answer::decode(&bench.send(&mut link, &proven)), Some((_, _, Answer::Done))));
    assert_eq!(*bench.compensation.borrow(), (0, 0.25));
    // Played back after a power-up that begins with the same session.
    let (mut link, _) = bench.power_up();
    assert_eq!(gmhm_link_lock(Some(&mut link), Some(&key), Some(&[4; 16])), OK);
    let again = core::array::from_fn::<_, 3, _>(|_| identified(&mut link).session);
    assert_eq!(again[2], it.session);
    let body = bench.send(&mut link, &proven);
    let Some((_, _, Answer::Refused(refused))) = Answer::decode(&body) else { panic!("{body:?}") };
    assert_eq!(refused.refusal, Refusal::Locked);
}

#[test]
fn a_trial_whose_host_is_gone_ends() {
    let bench = Bench::new();
    let (mut link, _) = bench.power_up();
    let first = stamped(block(), 1);
    let tag = bench.try_out(&mut link, &first);
    let crc = verify(&first).expect("a block").crc();
    bench.ask(&mut link, Request::Commit { signature: SAVE, crc }, tag);
    bench.try_out(&mut link, &stamped(block_with(1.1, &[]), 2));
    for _ in 0..1000 {
        assert_eq!(gmhm_link_elapse(Some(&mut link), Some(&bench.drive()), 100), OK);
    }
    assert_eq!(gmhm_get_status(Some(&bench.joint.borrow())).crc32, crc, "the stored block is in force again");
}

#[test]
fn a_flash_that_fails_or_cannot_be_is_refused() {
    let bench = Bench::new();
    for change in [
        |flash: &mut FlashC| flash.erase_size = 0,
        |flash: &mut FlashC| flash.write_size = 48,
        |flash: &mut FlashC| flash.second_slot = SECTOR,
        |flash: &mut FlashC| flash.slot_size = 4 * SECTOR,
        |flash: &mut FlashC| flash.slot_size = u32::MAX - SECTOR + 1,
        |flash: &mut FlashC| flash.write = None,
    ] {
        let mut flash = bench.flash();
        change(&mut flash);
        assert_eq!(gmhm_link_init(Some(&mut MaybeUninit::uninit()), Some(&flash), 1), PLACE);
    }
    *bench.broken.borrow_mut() = true;
    let mut store = MaybeUninit::uninit();
    assert_eq!(gmhm_store_init(Some(&mut store), Some(&bench.flash())), OK);
    let block = stamped(block(), 1);
    // SAFETY: gmhm_store_init has written the store, and the block outlives the call.
    let code = unsafe { gmhm_store_write(Some(store.assume_init_mut()), block.as_ptr(), block.len() as u32) };
    assert_eq!(code, FLASH);
}

#[test]
fn what_the_drive_measures_goes_to_the_host() {
    let bench = Bench::new();
    let (mut link, _) = bench.power_up();
    let body = bench.ask(&mut link, Request::Identify, Tag::default());
    let Some((_, _, Answer::Identified(it))) = Answer::decode(&body) else { panic!("{body:?}") };
    let tag = Tag { session: it.session, turn: 0 };
    for (flags, expected) in [
        (0, (false, false)),
        (flag::OUT_OF_RANGE, (true, false)),
        (flag::REFUSED, (false, true)),
        (flag::QUARANTINED, (false, true)),
    ] {
        let live = LiveC {
            deflection_rad: 1e-3,
            torque_nm: 20.0,
            hysteresis_nm: -2.0,
            contribution_nm: 0.5,
            flags,
            ticks: 7,
            loop_cost: 900,
        };
        *bench.live.borrow_mut() = live;
        let body = bench.ask(&mut link, Request::Live, Tag::default());
        let Some((_, _, Answer::Live(it))) = Answer::decode(&body) else { panic!("{body:?}") };
        assert_eq!((it.out_of_range, it.refused), expected);
        assert_eq!((it.deflection_rad, it.torque_nm, it.hysteresis_nm), (1e-3, 20.0, -2.0));
        assert_eq!((it.contribution_nm, it.ticks, it.loop_cost), (0.5, 7, 900));
    }
    let (last_fault, self_test) = (u32::from(Fault::Restarted.number()), u32::from(SelfTest::Passed.number()));
    *bench.diagnostics.borrow_mut() = DiagnosticsC {
        refused: 1,
        out_of_range: 2,
        quarantined: 3,
        restarted: 4,
        saturated: 6,
        merged_pairs: 5,
        last_fault,
        self_test,
    };
    let mut counted = || {
        let body = bench.ask(&mut link, Request::Diagnostics, Tag::default());
        let Some((_, _, Answer::Diagnostics(it))) = Answer::decode(&body) else { panic!("{body:?}") };
        it.joint
    };
    let found = counted();
    let counts = [found.refused, found.out_of_range, found.quarantined, found.restarted, found.merged_pairs];
    assert_eq!(found.saturated, 6);
    assert_eq!((counts, found.last, found.self_test), ([1, 2, 3, 4, 5], Fault::Restarted, SelfTest::Passed));
    let body = bench.ask(&mut link, Request::ClearDiagnostics, tag);
    assert!(matches!(Answer::decode(&body), Some((_, _, Answer::Done))), "{body:?}");
    assert_eq!(bench.diagnostics.borrow().refused, 0);
}

#[test]
fn a_stored_block_that_the_joint_refuses_is_told_at_boot() {
    let bench = Bench::new();
    let mut store = MaybeUninit::uninit();
    assert_eq!(gmhm_store_init(Some(&mut store), Some(&bench.flash())), OK);
    let amperes = stamped(block_of(&JointOfGear::default(), TorqueUnit::Ampere), 1);
    // SAFETY: gmhm_store_init has written the store, and the block outlives the call.
    let code = unsafe { gmhm_store_write(Some(store.assume_init_mut()), amperes.as_ptr(), amperes.len() as u32) };
    assert_eq!(code, OK);
    assert_eq!(bench.power_up().1, UNIT);
}

/// A write that ends with a wrong byte.
unsafe extern "C" fn write_wrong(context: *mut c_void, address: u32, from: *const u8, length: u32) -> u32 {
    // SAFETY: as above.
    let (answer, bench) = unsafe { (write(context, address, from, length), bench(context)) };
    bench.cells.borrow_mut()[(address + length - 1) as usize] ^= 1;
    answer
}

unsafe extern "C" fn read_nothing(_: *mut c_void, _: u32, _: *mut u8, _: u32) -> u32 {
    1
}

#[test]
fn a_store_answers_by_its_codes() {
    let bench = Bench::new();
    let block = stamped(block(), 1);
    let length = block.len() as u32;
    let store_of = |flash: &FlashC| {
        let mut store = MaybeUninit::uninit();
        assert_eq!(gmhm_store_init(Some(&mut store), Some(flash)), OK);
        // SAFETY: gmhm_store_init has written it.
        unsafe { store.assume_init() }
    };
    // SAFETY: the block outlives the call.
    let write_to = |store: &mut StoreC| unsafe { gmhm_store_write(Some(store), block.as_ptr(), length) };
    let mut store = store_of(&bench.flash());
    assert_eq!((write_to(&mut store), write_to(&mut store)), (OK, NOT_NEWER));
    let mut read_with = |room: u32| {
        let (mut to, mut found) = (vec![0; room as usize], MaybeUninit::uninit());
        // SAFETY: the buffer has so much room, and gmhm_store_read writes the length.
        unsafe {
            let code = gmhm_store_read(Some(&mut store), to.as_mut_ptr(), room, Some(&mut found));
            (code, found.assume_init(), to)
        }
    };
    assert_eq!(read_with(length - 1), (NO_SPACE, 0, vec![0; length as usize - 1]));
    assert_eq!(read_with(length), (OK, length, block.clone()));
    let small = FlashC { erase_size: 64, second_slot: 64, slot_size: 64, ..bench.flash() };
    assert_eq!(write_to(&mut store_of(&small)), NO_SPACE);
    let bench = Bench::new();
    let wrong = FlashC { write: Some(write_wrong), ..bench.flash() };
    assert_eq!(write_to(&mut store_of(&wrong)), READ_BACK);
    // A flash that does not read may hold the block in force; erased on purpose, it still does not read.
    let blind = FlashC { read: Some(read_nothing), ..bench.flash() };
    let mut store = store_of(&blind);
    let before = bench.cells.borrow().clone();
    assert_eq!(write_to(&mut store), UNREADABLE);
    assert_eq!(*bench.cells.borrow(), before);
    assert_eq!(gmhm_store_erase_unreadable(Some(&mut store)), READ_BACK);
    assert_eq!(gmhm_store_erase_unreadable(Some(&mut store_of(&bench.flash()))), OK);
    assert_eq!(gmhm_store_erase_unreadable(None), NULL);
    assert_eq!(write_to(&mut store_of(&bench.flash())), OK);
}
