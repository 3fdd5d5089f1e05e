//! The gears that the images work on.

use gmhm::{Elastic, Gate, Kernel, Law, Memory, ParamError, Params};

/// Rated deflection of the published gear, rad.
pub const RATED_RAD: f32 = 1.168e-3;

/// Its rated torque, N·m.
pub const RATED_NM: f32 = 30.23;

/// Its block in `f32`, as `gmhm pack src/bin/platform/published.toml --period 0.001` writes it.
#[allow(dead_code, reason = "not every image loads one")]
pub const BLOCK: &[u8] = include_bytes!("published.bin");

/// The same with `--scalar fixed`.
#[allow(dead_code, reason = "not every image loads one")]
pub const FIXED_BLOCK: &[u8] = include_bytes!("published-fixed.bin");

/// The published gear with another memory.
#[allow(dead_code, reason = "not every image sets one up")]
pub fn published(law: Law, kernel: Kernel, gate: Gate, reversal_play_rad: f64) -> Result<Params, ParamError> {
    let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    // α is of another unit in each kernel; this one makes a loop of the same order.
    let alpha = match kernel {
        Kernel::Deflection => 2.6532e6,
        Kernel::Rate => 1.2e4,
    };
    let memory = Memory { law, kernel, gate, alpha, beta_per_s: 422.68, omega_per_s: 226.31, reversal_play_rad };
    Params::new(f64::from(RATED_RAD), elastic, memory)
}
