//! Arithmetic of 28 fractional bits on 32-bit words, for cores without a wide multiplication, a division or a count of leading zeros.

/// Bits after the point.
pub const FRACTION: u32 = 28;

/// a·b with all its 64 bits.
#[cfg(not(all(target_arch = "arm", target_os = "none", not(target_has_atomic = "32"))))]
#[inline]
pub fn product(a: i32, b: i32) -> i64 {
    i64::from(a) * i64::from(b)
}

/// a·b with all its 64 bits. The Cortex-M0, known by its lack of atomic exchanges, multiplies 32 by 32 bits to 32 only.
#[cfg(all(target_arch = "arm", target_os = "none", not(target_has_atomic = "32")))]
#[inline]
pub fn product(a: i32, b: i32) -> i64 {
    product_of_halves(a, b)
}

/// a·b from the four products of their halves.
#[allow(dead_code, reason = "the Cortex-M0 alone calls it; the tests of the host hold it to the wide product")]
#[inline]
fn product_of_halves(a: i32, b: i32) -> i64 {
    let (a_high, a_low) = (a >> 16, a & 0xffff);
    let (b_high, b_low) = (b >> 16, b & 0xffff);
    let low = a_low.wrapping_mul(b_low).cast_unsigned();
    // At most 32767·65535 + 65534: no carry is lost.
    let first = a_high * b_low + (low >> 16).cast_signed();
    let second = a_low * b_high + (first & 0xffff);
    let high = a_high * b_high + (first >> 16) + (second >> 16);
    (i64::from(high) << 32) | i64::from(second.cast_unsigned() << 16 | low & 0xffff)
}

/// The nearest word; the ends where there is none.
#[inline]
pub fn saturate(wide: i64) -> i32 {
    let word = wide as i32;
    if i64::from(word) == wide {
        word
    } else if wide < 0 {
        i32::MIN
    } else {
        i32::MAX
    }
}

/// The nearest a·b; saturates.
#[cfg(not(all(target_arch = "arm", target_os = "none", not(target_has_atomic = "32"))))]
#[inline]
pub fn multiply(a: i32, b: i32) -> i32 {
    saturate((product(a, b) + (1 << (FRACTION - 1))) >> FRACTION)
}

/// The nearest a·b; saturates.
#[cfg(all(target_arch = "arm", target_os = "none", not(target_has_atomic = "32")))]
#[inline]
pub fn multiply(a: i32, b: i32) -> i32 {
    multiply_by_halves(a, b)
}

/// The nearest a·b from the products of their halves; saturates.
#[allow(dead_code, reason = "the Cortex-M0 alone calls it; the tests of the host hold it to the wide product")]
#[inline]
fn multiply_by_halves(a: i32, b: i32) -> i32 {
    let [high, low] = halves(a, b);
    let rest = ((low >> 11) + 1) >> 1;
    // Below 4 in size nothing can overflow.
    if matches!(high >> 26, -1 | 0) { (high << 4) + rest } else { far(high, rest) }
}

/// high·2⁴ + rest where a word may not hold it.
#[cold]
#[inline(never)]
fn far(high: i32, rest: i32) -> i32 {
    saturate((i64::from(high) << 4) + i64::from(rest))
}

/// [h, l] of a·b = h·2³² + l·2¹⁶ + what is below.
#[inline]
fn halves(a: i32, b: i32) -> [i32; 2] {
    let (a_high, a_low) = (a >> 16, a & 0xffff);
    let (b_high, b_low) = (b >> 16, b & 0xffff);
    let low = a_low.wrapping_mul(b_low).cast_unsigned();
    // At most 32767·65535 + 65534: no carry is lost.
    let first = a_high * b_low + (low >> 16).cast_signed();
    let second = a_low * b_high + (first & 0xffff);
    [a_high * b_high + (first >> 16), second]
}

/// wide·2^−shift, rounded down; left shifts saturate.
#[inline]
pub fn scale(wide: i64, shift: i32) -> i64 {
    if shift >= 0 {
        wide >> shift.min(63)
    } else {
        let left = (-shift).min(62);
        let most = i64::MAX >> left;
        wide.clamp(-most, most) << left
    }
}

/// 2⁸/√m − 256 at the middle of the interval [i, i + 1)/256 of m in [1/4, 1).
const ROOT_SEEDS: [u8; 256] = {
    let mut seeds = [0; 256];
    let mut i = 64;
    while i < 256 {
        seeds[i] = (((1_u32 << 27) / (2 * i as u32 + 1)).isqrt().div_ceil(2) - 256) as u8;
        i += 1;
    }
    seeds
};

/// √x within a unit and 2^−27 of itself, 0 for x ≤ 0.
///
/// With x = m·4^−k, m in [1/4, 1): 1/√m from a table and one of Newton's steps to 14 bits, s = m/√m to as many, and the rest is
/// (m − s²)/(2s) because s² is exact in a word.
#[inline]
pub fn root(x: i32) -> i32 {
    if x <= 0 {
        return 0;
    }
    let (mut m, mut halvings) = (x.cast_unsigned(), 0);
    if m >> 14 == 0 {
        m <<= 16;
        halvings = 8;
    }
    // Eight times at most.
    while m >> 30 == 0 {
        m <<= 2;
        halvings += 1;
    }
    let seed = u32::from(ROOT_SEEDS[(m >> 24) as usize]) + 256;
    // 1 − m·seed² in units of 2^−32: the table is good to 2^−7, so the whole wraps away.
    let missing = (m >> 16).wrapping_mul(seed * seed).wrapping_neg().cast_signed();
    // 1/√m in units of 2^−15, never above it, so that √m in units of 2^−16 fits 16 bits.
    let inverse = (seed.cast_signed() << 7) + ((seed.cast_signed() * (missing >> 8)) >> 18);
    let s = ((m >> 16) * inverse.cast_unsigned()) >> 15;
    let rest = m.wrapping_sub(s * s).cast_signed();
    let correction = (((rest >> 8) * inverse) >> 8) + (((rest & 0xff) * inverse) >> 16);
    // √m in units of 2^−31.
    let s = (s << 15).cast_signed() + (correction >> 1);
    ((s >> halvings) + 1) >> 1
}

/// 2⁸/m − 256 at the middle of the interval [i, i + 1)/256 of m in [1/2, 1).
const RECIPROCAL_SEEDS: [u8; 256] = {
    let mut seeds = [0; 256];
    let mut i = 128;
    while i < 256 {
        seeds[i] = (((1_u32 << 18) / (2 * i as u32 + 1)).div_ceil(2) - 256) as u8;
        i += 1;
    }
    seeds
};

/// 2^61/m for m = x·2^zeros in [2³¹, 2³²), within 2^−27 of itself, and the zeros. For x > 0.
///
/// A table and two of Newton's steps.
#[inline]
fn inverse(x: u32) -> (i32, u32) {
    let (mut m, mut zeros) = (x, 0);
    if m >> 16 == 0 {
        m <<= 16;
        zeros = 16;
    }
    if m >> 24 == 0 {
        m <<= 8;
        zeros += 8;
    }
    // Seven times at most.
    while m >> 31 == 0 {
        m <<= 1;
        zeros += 1;
    }
    let seed = u32::from(RECIPROCAL_SEEDS[(m >> 24) as usize]) + 256;
    let one = (m >> 16) * seed;
    let inverse = (seed * (((2 << 24) - one) >> 8)) >> 9;
    let one = (m >> 16) * inverse + (((m & 0xffff) * inverse) >> 16);
    let missing = (1_u32 << 31).wrapping_sub(one).cast_signed();
    let correction = (((missing + 4) >> 3) * inverse.cast_signed()) >> 14;
    ((inverse << 14).cast_signed() + correction, zeros)
}

/// 1/4 in units of 2^−28: from here on reciprocals are at most 4.
const QUARTER: u32 = 1 << (FRACTION - 2);

/// 1/x for x ≥ 1/4 in units of 2^−28, within a unit and 2^−27 of itself.
#[inline]
fn reciprocal(x: u32) -> i32 {
    let (inverse, zeros) = inverse(x);
    let shift = 5 - zeros.min(5);
    (inverse + ((1 << shift) >> 1)) >> shift
}

/// 1/x, as [`divide`] has it.
#[inline]
pub fn invert(x: i32) -> i32 {
    if x >= QUARTER.cast_signed() { reciprocal(x.cast_unsigned()) } else { divide(1 << FRACTION, x) }
}

/// a/b within a unit, half a unit for every unit of a, and 2^−27 of itself; saturates, also for b = 0.
#[inline]
pub fn divide(a: i32, b: i32) -> i32 {
    let size = b.unsigned_abs();
    if size < QUARTER {
        return divide_by_little(a, b);
    }
    let quotient = multiply(a, reciprocal(size));
    if b < 0 { quotient.saturating_neg() } else { quotient }
}

/// The same for any divisor.
#[cold]
#[inline(never)]
fn divide_by_little(a: i32, b: i32) -> i32 {
    if b == 0 {
        return saturate(i64::from(a) << 32);
    }
    let (inverse, zeros) = inverse(b.unsigned_abs());
    let quotient = product(a, inverse);
    // Half of the quotient's last unit rounds it.
    let shift = 33 - zeros.cast_signed();
    let quotient = saturate((scale(quotient, shift - 1) + 1) >> 1);
    if b < 0 { quotient.saturating_neg() } else { quotient }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words of every size, the ends and their neighbours among them.
    fn words() -> impl Iterator<Item = i32> + Clone {
        let edges = (0..32).flat_map(|k| (-2..=2).map(move |d| (1_u32 << k).cast_signed().wrapping_add(d)));
        let mut state = 1_u32;
        let random = (0..3000).map(move |k| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state.cast_signed() >> (k % 31)
        });
        edges.chain(random)
    }

    #[test]
    fn products_of_halves_are_products() {
        for a in words() {
            for b in words() {
                let exact = i64::from(a) * i64::from(b);
                assert_eq!(product_of_halves(a, b), exact, "{a} {b}");
                assert_eq!(multiply_by_halves(a, b), saturate((exact + (1 << 27)) >> 28), "{a} {b}");
            }
        }
    }

    #[test]
    fn roots_are_within_their_error() {
        let mut worst = 0.0_f64;
        let dense = (0..200_000).chain((0..4_000_000).map(|k| k * 536)).chain(words());
        for x in dense {
            let exact = libm::sqrt(f64::from(x.max(0)) * 268_435_456.0);
            let error = libm::fabs(f64::from(root(x)) - exact) / (1.0 + exact / 134_217_728.0);
            assert!(error <= 1.0, "{x}: {} for {exact}", root(x));
            worst = worst.max(error);
        }
        assert!(worst > 0.4, "{worst}");
    }

    #[test]
    fn quotients_are_within_their_error() {
        let mut worst = 0.0_f64;
        for a in words() {
            for b in words().filter(|&b| b != 0) {
                let exact = libm::ldexp(f64::from(a) / f64::from(b), 28);
                let exact = exact.clamp(f64::from(i32::MIN), f64::from(i32::MAX));
                let allowed = 1.0 + libm::ldexp(libm::fabs(f64::from(a)), -29) + libm::ldexp(libm::fabs(exact), -27);
                let error = libm::fabs(f64::from(divide(a, b)) - exact) / allowed;
                assert!(error <= 1.0, "{a}/{b}: {} for {exact}", divide(a, b));
                worst = worst.max(error);
            }
        }
        assert!(worst > 0.4, "{worst}");
    }
}
