//! `f32` and `f64` by the `libm` crate.
//!
//! Feature `micromath` replaces the `f32` exponential, arcsine, arctangent, sine and cosine by those of the `micromath` crate, for the
//! sake of code size. Largest absolute errors, asserted by `cargo test -p gmhm --features micromath`:
//!
//! | function | argument | error |
//! |---|---|---|
//! | exp, expm1 | −6 to 0 | 1.2e-3 |
//! | arcsine | −1 to 1 | 1.8e-2 |
//! | sine, cosine | −3.2 to 3.2 | 1.1e-3 |
//!
//! It buys no speed on a Cortex-M4F. Square roots stay exact, so law `masing` does not change by a bit.

use super::{Extended, Float, Scalar, circle};

macro_rules! scalar {
    ($f:ty, $sqrt:path, $fabs:path) => {
        impl Scalar for $f {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const EPSILON: f64 = <$f>::EPSILON as f64;
            const TOLERANCE: f64 = 4.0 * <Self as Scalar>::EPSILON;
            const LARGEST: f64 = <$f>::MAX as f64;
            const SI: bool = true;
            const REFUSED_BEYOND: f64 = 1e5;

            type Gain = Self;
            type Carry = Self;

            fn from_f64(x: f64) -> Self {
                x as $f
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn abs(self) -> Self {
                $fabs(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn recip(self) -> Self {
                1.0 / self
            }
            #[inline]
            fn over(self, divisor: Self) -> Self {
                self / divisor
            }
            fn gain_from_f64(x: f64) -> Self {
                x as $f
            }
            #[inline]
            fn fade(self, forgotten: Self) -> Self {
                self - forgotten * self
            }
            #[inline]
            fn leak(memory: &mut Self, carry: &mut Self, forgotten: Self, inputs: [(Self, Self); 2]) {
                let [(a, x), (b, y)] = inputs;
                // Kahan's compensated sum.
                let change = (a * x + b * y - forgotten * *memory) + *carry;
                let sum = *memory + change;
                *carry = change - (sum - *memory);
                *memory = sum;
            }
            #[inline]
            fn normalise(self, inverse_scale: Self) -> Self {
                self * inverse_scale
            }
            #[inline]
            fn denormalise(self, scale: Self) -> Self {
                self * scale
            }
        }
    };
}

scalar!(f32, sqrtf, libm::fabsf);
scalar!(f64, sqrt, libm::fabs);

macro_rules! float {
    ($f:ty, $nearest:path, $exp_m1:path, $exp:path, $ln:path, $asin:path, $asin_of_small:path, $atan2:path, $sin:path, $cos:path, $sin_cos:path, $wrap:path,
     $tanh:path, $pow:path, $round:path) => {
        impl Float for $f {
            fn of_extended(x: Extended) -> Self {
                $nearest(x)
            }
            #[inline]
            fn is_finite(self) -> bool {
                <$f>::is_finite(self)
            }
            #[inline]
            fn exp_m1(self) -> Self {
                $exp_m1(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn ln(self) -> Self {
                $ln(self)
            }
            #[inline]
            fn asin(self) -> Self {
                $asin(self)
            }
            #[inline]
            fn asin_of_small(self) -> Self {
                $asin_of_small(self)
            }
            #[inline]
            fn atan2(self, x: Self) -> Self {
                $atan2(self, x)
            }
            #[inline]
            fn sin(self) -> Self {
                $sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                $cos(self)
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                $sin_cos(self)
            }
            #[inline]
            fn wrap_turn(self) -> Self {
                $wrap(self)
            }
            #[inline]
            fn tanh(self) -> Self {
                $tanh(self)
            }
            #[inline]
            fn powf(self, y: Self) -> Self {
                $pow(self, y)
            }
            #[inline]
            fn round(self) -> Self {
                $round(self)
            }
        }
    };
}

#[cfg(not(feature = "micromath"))]
float!(
    f32,
    Extended::single,
    libm::expm1f,
    libm::expf,
    libm::logf,
    libm::asinf,
    circle::arcsine,
    libm::atan2f,
    libm::sinf,
    libm::cosf,
    circle::sin_cos,
    circle::wrap,
    libm::tanhf,
    libm::powf,
    libm::roundf
);
#[cfg(feature = "micromath")]
float!(
    f32,
    Extended::single,
    micro::exp_m1,
    micro::exp,
    libm::logf,
    micro::asin,
    circle::arcsine,
    micro::atan2,
    micro::sin,
    micro::cos,
    circle::sin_cos,
    circle::wrap,
    libm::tanhf,
    libm::powf,
    libm::roundf
);
float!(
    f64,
    Extended::double,
    libm::expm1,
    libm::exp,
    libm::log,
    libm::asin,
    libm::asin,
    libm::atan2,
    libm::sin,
    libm::cos,
    libm::sincos,
    core::convert::identity,
    libm::tanh,
    power,
    libm::round
);

#[inline]
fn sqrt(x: f64) -> f64 {
    if x > 0.0 { libm::sqrt(x) } else { 0.0 }
}

/// x^y for x ≥ 0 and y > 0, by the exponential of the logarithm: four times as fast as `libm::pow`. Relative error below 3e-16 (1 + abs(y ln x)).
#[inline]
fn power(x: f64, y: f64) -> f64 {
    libm::exp(y * libm::log(x))
}

#[cfg(not(any(all(target_arch = "arm", target_abi = "eabihf"), riscv_float_unit)))]
#[inline]
fn sqrtf(x: f32) -> f32 {
    if x > 0.0 { libm::sqrtf(x) } else { 0.0 }
}

/// With its twin below the one unsafe place of this crate: `libm` computes square roots in software where the core has an instruction for it.
/// VSQRT.F32 is correctly rounded, as `libm` is, so the bits are the same.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline]
#[allow(unsafe_code, reason = "an instruction that only assembly reaches")]
fn sqrtf(x: f32) -> f32 {
    let bits = x.to_bits();
    // The sign spread over the word clears what is negative.
    let bits = bits & !(bits.cast_signed() >> 31).cast_unsigned();
    let root: u32;
    // SAFETY: reads and writes registers only; the hard-float ABI guarantees the unit.
    unsafe {
        core::arch::asm!(
            "vmov s15, {x}",
            "vsqrt.f32 s15, s15",
            "vmov {x}, s15",
            x = inout(reg) bits => root,
            out("s15") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(root)
}

/// The same on RISC-V: FSQRT.S is correctly rounded, too.
#[cfg(riscv_float_unit)]
#[inline]
#[allow(unsafe_code, reason = "an instruction that only assembly reaches")]
fn sqrtf(x: f32) -> f32 {
    if !(x > 0.0) {
        return 0.0;
    }
    let root: f32;
    // SAFETY: reads and writes registers only; the target has the unit.
    unsafe {
        core::arch::asm!("fsqrt.s {root}, {x}", x = in(freg) x, root = lateout(freg) root, options(pure, nomem, nostack));
    }
    root
}

#[cfg(feature = "micromath")]
mod micro {
    use micromath::F32Ext;

    pub fn exp(x: f32) -> f32 {
        F32Ext::exp(x)
    }
    // The difference loses everything for small x, so the series takes over there.
    pub fn exp_m1(x: f32) -> f32 {
        if libm::fabsf(x) < 0.25 {
            x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x / 120.0))))
        } else {
            F32Ext::exp(x) - 1.0
        }
    }
    pub fn asin(x: f32) -> f32 {
        F32Ext::asin(x)
    }
    pub fn atan2(y: f32, x: f32) -> f32 {
        F32Ext::atan2(y, x)
    }
    pub fn sin(x: f32) -> f32 {
        F32Ext::sin(x)
    }
    pub fn cos(x: f32) -> f32 {
        F32Ext::cos(x)
    }
}

#[cfg(all(test, feature = "micromath"))]
mod tests {
    use super::Float;

    /// The largest error of the `f32` function against its `f64` twin over [low, high].
    fn largest_error(low: f64, high: f64, ours: fn(f32) -> f32, exact: fn(f64) -> f64) -> f64 {
        (0..=100_000u32)
            .map(|k| {
                let x = (low + (high - low) * f64::from(k) / 1e5) as f32;
                libm::fabs(f64::from(ours(x)) - exact(f64::from(x)))
            })
            .fold(0.0, f64::max)
    }

    fn assert_measured(error: f64, measured: f64) {
        assert!(error <= measured && error > 0.9 * measured, "measured {error:e}, stated {measured:e}");
    }

    #[test]
    fn errors_of_micromath_are_those_stated() {
        assert_measured(largest_error(-6.0, 0.0, Float::exp, libm::exp), 1.2e-3);
        assert_measured(largest_error(-6.0, 0.0, Float::exp_m1, libm::expm1), 1.2e-3);
        assert_measured(largest_error(-1.0, 1.0, Float::asin, libm::asin), 1.8e-2);
        assert_measured(largest_error(-3.2, 3.2, Float::sin, libm::sin), 1.1e-3);
        assert_measured(largest_error(-3.2, 3.2, Float::cos, libm::cos), 1.1e-3);
    }
}
