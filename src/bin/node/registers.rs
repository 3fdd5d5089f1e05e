//! Registers by their addresses.

/// Reads a register.
pub fn read(address: u32) -> u32 {
    // SAFETY: the boards of this image name registers and flash of their own microcontroller only, aligned.
    unsafe { (address as *const u32).read_volatile() }
}

/// Writes a register.
pub fn write(address: u32, value: u32) {
    // SAFETY: as in `read`.
    unsafe { (address as *mut u32).write_volatile(value) }
}
