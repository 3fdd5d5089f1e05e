//! Terms in memory of the program: what does not fit is refused, and how much is there makes no other numbers.

use std::mem::MaybeUninit;

use crate::common::{A, LIMITS, at, block, block_with, gmhm_invert, gmhm_step};
use gmhm_c::{
    BlockC, ContributionC, DemandC, FeedForwardC, Joint, OK, OutputC, PLACES, SampleC, SolutionC, TERM_WORDS, TermC,
    flag, gmhm_feed_forward_init_with_terms, gmhm_feed_forward_load, gmhm_feed_forward_step, gmhm_init,
    gmhm_init_with_terms, gmhm_load, gmhm_read_block,
};

/// Of the gear and of the joint, with and without a past, and a fault of the measurement.
const TERMS: [&str; 5] =
    ["stiffness_asymmetry", "coulomb_friction", "presliding_friction", "kinematic_error", "sensor_drift"];

/// So many places between words that nothing may touch.
struct Places(Vec<MaybeUninit<u64>>, u32);

const GUARD: u64 = 0x5AA5_5AA5_5AA5_5AA5;

impl Places {
    fn new(count: u32) -> Self {
        let mut words = vec![MaybeUninit::uninit(); count as usize * TERM_WORDS + 2];
        for guard in [0, words.len() - 1] {
            words[guard].write(GUARD);
        }
        Self(words, count)
    }

    fn start(&mut self) -> *mut TermC {
        if self.1 == 0 { std::ptr::null_mut() } else { self.0[1..].as_mut_ptr().cast() }
    }
}

impl Drop for Places {
    fn drop(&mut self) {
        // SAFETY: both were written first.
        let guards = unsafe { [self.0[0].assume_init(), self.0[self.0.len() - 1].assume_init()] };
        assert_eq!(guards, [GUARD; 2], "beyond its memory");
    }
}

fn init(places: &mut Places, block: &[u8]) -> (Box<Joint>, u16) {
    let mut joint = Box::new(MaybeUninit::uninit());
    let (start, count) = (places.start(), places.1);
    // SAFETY: the block outlives the call, the places the joint, which the call writes.
    unsafe {
        let code = gmhm_init_with_terms(Some(&mut joint), start, count, block.as_ptr(), block.len() as u32);
        (joint.assume_init(), code)
    }
}

fn load(joint: &mut Joint, block: &[u8]) -> u16 {
    // SAFETY: the block outlives the call, and the places outlive the joint.
    unsafe { gmhm_load(Some(joint), block.as_ptr(), block.len() as u32) }
}

fn sample(k: u32) -> SampleC {
    let phase = 0.05 * k as f32;
    SampleC {
        velocity_rad_per_s: 0.5 * phase.cos(),
        motor_angle_rad: phase,
        time_s: 1e-3 * k as f32,
        ..at(0.8 * A * phase.sin())
    }
}

fn walk(joint: &mut Joint, periods: u32) -> Vec<(OutputC, SolutionC)> {
    let period = |k| {
        let sample = sample(k);
        let out = gmhm_step(Some(joint), Some(&sample));
        (out, gmhm_invert(Some(joint), 0.5 * out.torque_nm, Some(&sample)))
    };
    (0..periods).map(period).collect()
}

#[test]
fn a_block_with_more_terms_than_places_is_refused() {
    let bytes = block_with(1.0, &TERMS);
    let mut found = MaybeUninit::<BlockC>::uninit();
    // SAFETY: the block outlives the call, which writes what it says.
    let found = unsafe {
        assert_eq!(gmhm_read_block(bytes.as_ptr(), bytes.len() as u32, Some(&mut found)), OK);
        found.assume_init()
    };
    assert_eq!(found.terms, 4, "a fault of the measurement takes no place");
    for count in 0..6 {
        let mut places = Places::new(count);
        let (mut joint, code) = init(&mut places, &bytes);
        assert_eq!(code, if count < found.terms { PLACES } else { OK }, "{count}");
        let flags = gmhm_step(Some(&mut joint), Some(&at(0.1 * A))).flags;
        assert_eq!(flags, if count < found.terms { flag::NOT_LOADED } else { 0 });
        // A refused block leaves the block in force as it was.
        assert_eq!(load(&mut joint, &block()), OK);
        let before = walk(&mut joint, 10);
        if count < found.terms {
            assert_eq!(load(&mut joint, &bytes), PLACES);
            gmhm_c::gmhm_restart(Some(&mut joint));
            assert_eq!(walk(&mut joint, 10), before);
        }
        let mut feed = Box::new(MaybeUninit::<FeedForwardC>::uninit());
        let (start, count) = (places.start(), places.1);
        // SAFETY: the block outlives the call, and nothing uses the joint any more.
        let code = unsafe {
            let (block, length) = (bytes.as_ptr(), bytes.len() as u32);
            gmhm_feed_forward_init_with_terms(Some(&mut feed), start, count, block, length, Some(&LIMITS))
        };
        assert_eq!(code, if count < found.terms { PLACES } else { OK });
    }
    let mut joint = Box::new(MaybeUninit::<Joint>::uninit());
    // SAFETY: the block outlives the call.
    assert_eq!(unsafe { gmhm_init(Some(&mut joint), bytes.as_ptr(), bytes.len() as u32) }, PLACES);
}

#[test]
fn more_places_make_no_other_numbers() {
    let bytes = block_with(1.0, &TERMS);
    let [exact, many] = [4, 20].map(|count| {
        let mut places = Places::new(count);
        let (mut joint, code) = init(&mut places, &bytes);
        assert_eq!(code, OK);
        walk(&mut joint, 400)
    });
    assert!(exact.iter().any(|(out, _)| out.terms_nm != 0.0));
    assert_eq!(exact, many);
}

/// Terms that a block has as well as the one before it go on, whatever place they had.
#[test]
fn terms_go_on_in_places_that_are_all_taken() {
    let (one, two) = (
        block_with(1.0, &["coulomb_friction", "presliding_friction"]),
        block_with(1.0, &["viscous_friction", "presliding_friction"]),
    );
    let mut places = [2, 8].map(Places::new);
    let [mut exact, mut many] = places.each_mut().map(|places| {
        let (joint, code) = init(places, &one);
        assert_eq!(code, OK);
        joint
    });
    for block in [&two, &one, &block(), &two] {
        assert_eq!(walk(&mut exact, 300), walk(&mut many, 300));
        assert_eq!((load(&mut exact, block), load(&mut many, block)), (OK, OK));
    }
    assert_eq!(walk(&mut exact, 300), walk(&mut many, 300));
}

#[test]
fn a_feed_forward_has_its_terms_in_memory_of_the_program() {
    let bytes = [block_with(1.0, &TERMS), block_with(1.1, &["coulomb_friction"]), block()];
    let fed = [4, 20].map(|count| {
        let mut places = Places::new(count);
        let mut feed = Box::new(MaybeUninit::<FeedForwardC>::uninit());
        let start = places.start();
        // SAFETY: the block outlives the call, the places the feed-forward, which the call writes.
        let mut feed = unsafe {
            let (block, length) = (bytes[0].as_ptr(), bytes[0].len() as u32);
            let code = gmhm_feed_forward_init_with_terms(Some(&mut feed), start, count, block, length, Some(&LIMITS));
            assert_eq!(code, OK);
            feed.assume_init()
        };
        let mut all = Vec::new();
        for block in [&bytes[1], &bytes[0], &bytes[2], &bytes[0]] {
            for k in 0..300 {
                let demand = DemandC { torque_nm: 0.1 * k as f32, gain_ratio: 1.0, on: 1, ..DemandC::default() };
                let mut to = MaybeUninit::<ContributionC>::uninit();
                gmhm_feed_forward_step(Some(&mut feed), Some(&demand), Some(&sample(k)), Some(&mut to));
                // SAFETY: the call has written it.
                all.push(unsafe { to.assume_init() });
            }
            // SAFETY: as above.
            let code =
                unsafe { gmhm_feed_forward_load(Some(&mut feed), block.as_ptr(), block.len() as u32, Some(&LIMITS)) };
            assert_eq!(code, OK);
        }
        all
    });
    assert!(fed[0].iter().any(|now| now.gear_terms_nm != 0.0) && fed[0].iter().any(|now| now.joint_terms_nm != 0.0));
    assert_eq!(fed[0], fed[1]);
}
