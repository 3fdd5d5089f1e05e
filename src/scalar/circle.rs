//! Sine, cosine and arcsine in single precision alone, where `libm` computes them in software doubles on a Cortex-M4F.

/// 2/π.
const TURNS_OF_QUARTER: f32 = 0.636_619_75;
/// π/2 in three pieces: multiples of the first two by a number below 4096 are exact.
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
/// Adding and subtracting it rounds a number below 2²² to the nearest integer.
const ROUNDING: f32 = 12_582_912.0;
/// Quarter turns beyond which an `f32` angle has no digit left after the point.
const MOST_QUARTERS: f32 = 4_194_304.0;

/// x − n·π/2, at most π/4 in size, and n modulo 4. Angles that no longer tell where in the turn they are (NaN, infinite, above 6e6 rad) count as 0.
#[inline]
fn reduce(x: f32) -> (f32, u32) {
    let quarters = x * TURNS_OF_QUARTER;
    // A NaN compares false.
    if !(-MOST_QUARTERS < quarters && quarters < MOST_QUARTERS) {
        return (0.0, 0);
    }
    let n = (quarters + ROUNDING) - ROUNDING;
    let rest = ((x - n * QUARTER[0]) - n * QUARTER[1]) - n * QUARTER[2];
    (rest, (n as i32).cast_unsigned() & 3)
}

/// sin x and cos x within 1e-7 up to a thousand turns (6283 rad); there the rounding of x itself is up to 2.4e-4.
#[inline]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let (r, quarter) = reduce(x);
    let z = r * r;
    let sine = r + r * z * (-0.166_666_55 + z * (0.008_332_18 - z * 0.000_195_17));
    let cosine = 1.0 - 0.5 * z + z * z * (0.041_666_647 + z * (-0.001_388_736_4 + z * 0.000_024_438_066));
    match quarter {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// x less whole turns, within ±3.143 up to a thousand turns.
#[inline]
#[must_use]
pub fn wrap(x: f32) -> f32 {
    const TURN: [f32; 3] = [4.0 * QUARTER[0], 4.0 * QUARTER[1], 4.0 * QUARTER[2]];
    let turns = x * (0.25 * TURNS_OF_QUARTER);
    if !(-MOST_QUARTERS < turns && turns < MOST_QUARTERS) {
        return 0.0;
    }
    let n = (turns + ROUNDING) - ROUNDING;
    ((x - n * TURN[0]) - n * TURN[1]) - n * TURN[2]
}

/// arcsin x within 4e-8 for abs(x) ≤ 1/2; farther out it is no arcsine.
#[inline(never)]
#[must_use]
pub fn arcsine(x: f32) -> f32 {
    let z = x * x;
    let tail = 0.166_667_52 + z * (0.074_952_975 + z * (0.045_470_376 + z * (0.024_179_526 + z * 0.042_166_285)));
    x + x * (z * tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stated_error_is_the_measured_one() {
        let mut worst = 0.0_f64;
        for k in 0..2_000_000_i32 {
            let x = (k - 1_000_000) as f32 * 6.283e-3;
            let (s, c) = sin_cos(x);
            let exact = f64::from(x);
            worst = worst.max(libm::fabs(f64::from(s) - libm::sin(exact)));
            worst = worst.max(libm::fabs(f64::from(c) - libm::cos(exact)));
            assert!(libm::fabs(libm::sin(f64::from(wrap(x))) - libm::sin(exact)) < 2.5e-7);
            assert!(wrap(x).abs() < 3.143, "{x} {}", wrap(x));
        }
        assert!(worst <= 1e-7 && worst > 8e-8, "{worst:e}");
    }

    #[test]
    fn the_stated_error_of_the_arcsine_is_the_measured_one() {
        let points = (-1_000_000..=1_000_000_i32).map(|k| k as f32 * 5e-7);
        let error = |x: f32| libm::fabs(f64::from(arcsine(x)) - libm::asin(f64::from(x)));
        let worst = points.map(error).fold(0.0, f64::max);
        assert!(worst <= 4e-8 && worst > 3e-8, "{worst:e}");
    }

    #[test]
    fn angles_without_digits_count_as_zero() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e9, -3e38] {
            assert_eq!(sin_cos(x), (0.0, 1.0));
            assert_eq!(wrap(1e2 * x), 0.0);
        }
    }
}
