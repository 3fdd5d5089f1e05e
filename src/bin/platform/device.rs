//! On the microcontroller, or its emulator.

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use defmt_semihosting as _;

/// Ends the program, well.
pub fn end() -> ! {
    loop {
        debug::exit(EXIT_SUCCESS);
    }
}

fn fail() -> ! {
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

/// Cargo unites features over a workspace, and a host package may so bring `alloc` into a dependency. Nothing here allocates.
struct NoMemory;

// SAFETY: a null pointer is a lawful answer to every request, and nothing is ever handed out to be freed.
unsafe impl core::alloc::GlobalAlloc for NoMemory {
    unsafe fn alloc(&self, _: core::alloc::Layout) -> *mut u8 {
        core::ptr::null_mut()
    }
    unsafe fn dealloc(&self, _: *mut u8, _: core::alloc::Layout) {}
}

#[global_allocator]
static NO_MEMORY: NoMemory = NoMemory;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    let line = info.location().map_or(0, core::panic::Location::line);
    defmt::println!("panic at line {=u32}", line);
    fail()
}

#[cortex_m_rt::exception]
unsafe fn HardFault(frame: &cortex_m_rt::ExceptionFrame) -> ! {
    defmt::println!("hard fault at {=u32:08x}", frame.pc());
    fail()
}
