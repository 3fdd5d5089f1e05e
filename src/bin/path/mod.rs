//! What the images of a path have in common: coefficients and a state that the compiler knows nothing of, a loop, and nothing that could run beside them.

/// An image that is measured and never run: `main` starts `$state` by `$gear` and calls the path for ever. `cargo xtask size` reads its symbols.
macro_rules! image {
    ($gear:ident: $coefficients:ty, $state:ident: $joint:ty, start $start:expr, tick $tick:expr) => {
        /// Coefficients that something else has written, as a loader does from a parameter block.
        #[unsafe(link_section = ".uninit")]
        static mut GEAR: core::mem::MaybeUninit<$coefficients> = core::mem::MaybeUninit::uninit();

        /// What the path of one joint remembers.
        #[unsafe(link_section = ".uninit")]
        static mut JOINT: core::mem::MaybeUninit<$joint> = core::mem::MaybeUninit::uninit();

        /// Never linked: an image that holds it is refused.
        #[panic_handler]
        fn panic(_: &core::panic::PanicInfo) -> ! {
            loop {}
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            // SAFETY: this image is measured and never run; nothing else touches the two places.
            let ($gear, joint) =
                unsafe { ((*black_box(&raw const GEAR)).assume_init_ref(), &mut *black_box(&raw mut JOINT)) };
            let $state = joint.write($start);
            loop {
                $tick;
            }
        }
    };
}

pub(crate) use image;
