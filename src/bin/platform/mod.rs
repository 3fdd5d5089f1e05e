//! What the images share: output lines and the way out.
//!
//! An image is a list of lines and an end. On a microcontroller the lines are defmt frames over semihosting; on the host the
//! same program prints them, so that the two can be compared.

pub mod gears;

#[cfg(target_os = "none")]
mod device;
#[cfg(not(target_os = "none"))]
mod host;

#[cfg(target_os = "none")]
pub use device::end;
#[cfg(not(target_os = "none"))]
pub use host::end;

/// One line of output.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => {{
        #[cfg(target_os = "none")]
        defmt::println!($($words)*);
        #[cfg(not(target_os = "none"))]
        println!($($words)*);
    }};
}
