//! What a drive computes in, and the path that it walks: shared by the image and the host that follows it. All in single precision.

use gmhm::Status;
use gmhm::block::{ScalarKind, Word};
use gmhm::scalar::Scalar;

use crate::test_path::TestPath;

/// Rated deflection and torque scale of a gear.
#[derive(Clone, Copy)]
pub struct Measures {
    /// A, rad.
    pub rated_rad: f32,
    /// T_A, N·m.
    pub torque_nm: f32,
}

/// Words of 1 in fixed point.
const ONE: f32 = (1.0 / gmhm::scalar::Fixed::EPSILON) as f32;

/// The next deflection of the path, in input units; in fixed point what is no number counts as none, and what is beyond saturates.
pub fn next_deflection<S: Word>(path: &mut TestPath, measures: &Measures) -> S {
    let fraction = path.next_deflection();
    match S::KIND {
        // Of a single the compiler leaves no double.
        ScalarKind::F32 => S::from_f64(f64::from(fraction * measures.rated_rad)),
        ScalarKind::Fixed => S::of_word(((fraction * ONE) as i32).cast_unsigned()).unwrap_or_default(),
    }
}

/// A path in fractions of the rated deflection.
pub fn path() -> TestPath {
    TestPath::new(1.0)
}

/// A deflection in rad.
pub fn deflection_rad<S: Word>(theta: S, measures: &Measures) -> f32 {
    in_units(theta, measures.rated_rad)
}

/// A torque in N·m.
pub fn torque_nm<S: Word>(torque: S, measures: &Measures) -> f32 {
    in_units(torque, measures.torque_nm)
}

fn in_units<S: Word>(x: S, unit: f32) -> f32 {
    match S::KIND {
        ScalarKind::F32 => f32::from_bits(x.word()),
        ScalarKind::Fixed => x.word().cast_signed() as f32 * (unit / ONE),
    }
}

/// What a sample was, as the link tells it.
pub fn flags(status: Status) -> (bool, bool) {
    (status.out_of_range, status.refused)
}
