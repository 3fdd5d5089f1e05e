//! Memory of the program for the terms of a joint: coefficients, what each term remembers, and as much again for trials of the inverse.

use core::mem::MaybeUninit;
use core::ptr::NonNull;

use gmhm::block::{Block, CheckedTerms};
use gmhm::terms::{StackView, Term, TermState};

/// 64-bit words of `gmhm_term`.
pub const TERM_WORDS: usize = 53;
/// Terms that a block may have.
pub(crate) const MOST: usize = 255;

const _: () = assert!(
    size_of::<TermC>() >= size_of::<Term<f32>>() + 2 * size_of::<TermState<f32>>()
        && align_of::<TermC>() >= align_of::<Term<f32>>()
        && align_of::<TermC>() >= align_of::<TermState<f32>>()
        && size_of::<Term<f32>>().is_multiple_of(align_of::<TermState<f32>>()),
    "a term does not fit into GMHM_TERM_WORDS of gmhm.h"
);

#[cfg(target_pointer_width = "32")]
const _: () = assert!(
    size_of::<Term<f32>>() == 264 && size_of::<TermState<f32>>() == 76,
    "docs/size.md and c/README.md say what a term takes"
);

/// `gmhm_term`.
#[derive(Debug)]
#[repr(C)]
pub struct TermC([MaybeUninit<u64>; TERM_WORDS]);

/// The terms in force, in the program's memory.
// The pointer takes no more alignment than the rest of a joint.
#[derive(Debug)]
#[repr(C, packed(4))]
pub(crate) struct Terms {
    memory: Option<NonNull<TermC>>,
    places: u8,
    count: u8,
    motor_side: bool,
}

/// The terms in force, what they remember, and as many places for trials.
pub(crate) type Parts<'a> = (StackView<'a, f32>, &'a mut [TermState<f32>], &'a mut [TermState<f32>]);

impl Terms {
    /// No place for any.
    pub(crate) const NONE: Self = Self { memory: None, places: 0, count: 0, motor_side: false };

    /// No terms yet, with places for as many as [`MOST`].
    ///
    /// # Safety
    /// `memory` is null or points to `places` terms that nothing else touches while this is in use.
    pub(crate) unsafe fn in_memory(memory: *mut TermC, places: u32) -> Self {
        let places = u8::try_from(places).unwrap_or(u8::MAX);
        NonNull::new(memory).map_or(Self::NONE, |memory| Self { memory: Some(memory), places, ..Self::NONE })
    }

    /// Whether none is in force.
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether the torque of the block in force is taken on the motor side.
    pub(crate) fn motor_side(&self) -> bool {
        self.motor_side
    }

    /// Whether there is room for the terms of a block that a drive computes.
    pub(crate) fn have_room(&self, terms: &CheckedTerms<MOST>) -> bool {
        terms.plant_count() <= usize::from(self.places)
    }

    /// Where terms, states and trials begin.
    fn starts(&self) -> Option<(*mut Term<f32>, *mut TermState<f32>, *mut TermState<f32>)> {
        let places = usize::from(self.places);
        let terms = self.memory?.as_ptr().cast::<Term<f32>>();
        let states = terms.wrapping_add(places).cast::<TermState<f32>>();
        Some((terms, states, states.wrapping_add(places)))
    }

    /// Puts the terms of a good block in force, for which there is room, and says how many there were. What they remembered stays, for [`all`](Self::all).
    pub(crate) fn load(&mut self, terms: &CheckedTerms<MOST>, block: &Block<'_>) -> usize {
        let before = usize::from(self.count);
        let mut count = 0;
        if let Some((to, states, trials)) = self.starts() {
            terms.for_each_plant(block, |term| {
                if count < self.places {
                    let k = usize::from(count);
                    // SAFETY: within the program's memory, by `starts`. Of the states those in force before hold something, here as there.
                    unsafe {
                        if k >= before {
                            states.add(k).write(term.start());
                            trials.add(k).write(term.start());
                        }
                        to.add(k).write(term);
                    }
                    count += 1;
                }
            });
        }
        (self.count, self.motor_side) = (count, terms.sigma() > 0.0);
        before
    }

    /// The terms in force.
    pub(crate) fn view(&self) -> StackView<'_, f32> {
        let terms = match self.starts() {
            // SAFETY: `load` has written so many, and nothing else touches them.
            Some((terms, ..)) => unsafe { core::slice::from_raw_parts(terms, usize::from(self.count)) },
            None => &[],
        };
        StackView::of_gear(terms, if self.motor_side { 1.0 } else { -1.0 })
    }

    /// All of it.
    pub(crate) fn parts(&mut self) -> Parts<'_> {
        self.all(0)
    }

    /// All of it, with what as many terms as `before` remembered.
    pub(crate) fn all(&mut self, before: usize) -> Parts<'_> {
        let count = before.max(usize::from(self.count));
        let Some((_, states, trials)) = self.starts() else { return (self.view(), &mut [], &mut []) };
        // SAFETY: `load` has written so many, apart from each other and from the terms, and nothing else touches them.
        let (states, trials) =
            unsafe { (core::slice::from_raw_parts_mut(states, count), core::slice::from_raw_parts_mut(trials, count)) };
        (self.view(), states, trials)
    }
}
