//! What a drive computes in, and the path that it walks: shared by the image and the host that follows it.

use gmhm::Status;
use gmhm::block::{Scales, Word};

use crate::test_path::TestPath;

/// The next deflection of the path, in input units.
pub fn next_deflection<S: Word>(path: &mut TestPath, scales: &Scales) -> S {
    let fraction = path.next_deflection();
    let deflection = if S::SI { fraction * scales.rated_deflection_rad as f32 } else { fraction };
    S::from_f64(f64::from(deflection))
}

/// A path in fractions of the rated deflection.
pub fn path() -> TestPath {
    TestPath::new(1.0)
}

/// A deflection in rad.
pub fn deflection_rad<S: Word>(theta: S, scales: &Scales) -> f32 {
    in_units(theta, scales.rated_deflection_rad)
}

/// A torque in N·m.
pub fn torque_nm<S: Word>(torque: S, scales: &Scales) -> f32 {
    in_units(torque, scales.torque_scale_nm)
}

fn in_units<S: Word>(x: S, unit: f64) -> f32 {
    let unit = if S::SI { 1.0 } else { unit };
    (x.to_f64() * unit) as f32
}

/// What a sample was, as the link tells it.
pub fn flags(status: Status) -> (bool, bool) {
    (status.out_of_range, status.refused)
}
