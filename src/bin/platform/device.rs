//! On the microcontroller, or its emulator.

#[cfg(feature = "rtt")]
use defmt_rtt as _;
#[cfg(not(feature = "rtt"))]
use defmt_semihosting as _;

/// Ends the program, well.
pub fn end() -> ! {
    exit(true)
}

fn fail() -> ! {
    exit(false)
}

/// On a board the core sleeps for good: there is nowhere to return to.
#[cfg(feature = "rtt")]
fn exit(_well: bool) -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(not(feature = "rtt"))]
fn exit(well: bool) -> ! {
    use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
    loop {
        debug::exit(if well { EXIT_SUCCESS } else { EXIT_FAILURE });
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
