//! Where the torque can be inverted, computed once from the parameters.

use core::fmt;

use crate::elastic::Polynomial;
use crate::gear::{LONGEST_PERIOD_S, PeriodError};
use crate::memory::phase::Phase;
use crate::memory::time::Time;
use crate::params::{Gate, Kernel, Law, Params};
use crate::scalar::{Float, Scalar};

/// Why there is no inverse.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum InverseError {
    /// The torque need not increase with the deflection even about θ = 0: the memory is too strong for the spring.
    NoRange {
        /// The law.
        law: Law,
        /// The least slope dT/dθ about θ = 0, N·m/rad.
        slope_nm_per_rad: f64,
    },
    /// The longest sample period is no time, 0 in law `time`, or beyond [`LONGEST_PERIOD_S`].
    Period {
        /// What it was, s.
        period_s: f64,
    },
    /// The search would meet numbers that fixed point does not hold: the torque bends too sharply within the range.
    Format {
        /// The largest of them, over A and T_A.
        number: f64,
        /// What the format holds.
        largest: f64,
    },
}

impl fmt::Display for InverseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRange { law, slope_nm_per_rad } => write!(
                f,
                "law {} with these parameters has no inverse: the torque can fall while the deflection rises through zero (least slope {slope_nm_per_rad:.3e} N·m/rad)",
                law.name()
            ),
            Self::Period { period_s } => PeriodError { period_s: *period_s }.fmt(f),
            Self::Format { number, largest } => write!(
                f,
                "these parameters have no inverse in fixed point: their torque bends by {number} rated torques over the rated deflection, and numbers end at {largest}; invert them in floating point"
            ),
        }
    }
}

impl core::error::Error for InverseError {}

impl From<PeriodError> for InverseError {
    fn from(PeriodError { period_s }: PeriodError) -> Self {
        Self::Period { period_s }
    }
}

/// The largest r up to which the torque increases with the deflection for all abs(θ) ≤ rA, whatever the past (MODEL.md section 4): in both
/// directions and at every memory that a past within ±A can leave. In law `time` at every sample period up to the longest.
///
/// | law, gate | the least dT/du over T_A |
/// |---|---|
/// | `masing` | p′ − e(1 − 2u²)/g − 2h |
/// | `phase`, `cycle` | p′ + k − abs(u + ρg)·M/g, k = dm/du of the source alone |
/// | `phase`, `none` | p′ + (k·g − ρM)/g |
/// | `time`, `cycle` | p′ + i·g − abs(u)·M/g, i = dm/du within a sample |
/// | `time`, `none` | p′ + i |
///
/// # Errors
/// [`InverseError::NoRange`] where there is no such r above 0, [`InverseError::Period`].
pub fn invertible_range(params: &Params, longest_period_s: f64) -> Result<f64, InverseError> {
    if !(0.0..=LONGEST_PERIOD_S).contains(&longest_period_s) {
        return Err(InverseError::Period { period_s: longest_period_s });
    }
    let law = Slopes::new(params, longest_period_s);
    let increasing = |phi: f64| {
        let (u, g) = libm::sincos(phi);
        // A NaN compares false.
        law.least(u, g) > 0.0 && law.least(-u, g) > 0.0
    };
    let Some(failing) = (0..GRID).find(|&k| !increasing(grid(k))) else { return Ok(1.0) };
    if failing == 0 {
        let slope_nm_per_rad = law.least(0.0, 1.0) * params.torque_scale_nm() / params.rated_deflection_rad();
        return Err(InverseError::NoRange { law: params.memory().law, slope_nm_per_rad });
    }
    let (mut inside, mut outside) = (grid(failing - 1), grid(failing));
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if increasing(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Ok(libm::sin(inside))
}

/// The least slope dT/dθ with which a rising deflection passes `deflection_rad`, strictly within ±A, whatever the past, N·m/rad; on a falling path it is that at
/// the opposite deflection. [`invertible_range`] is where both are above zero. Linear in (c1, c2, c3, α) where β and ω stay.
///
/// ```
/// use gmhm::inverse::least_rising_slope;
/// use gmhm::{Elastic, Memory, Params};
///
/// let elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
/// let memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::default() };
/// let slope = least_rising_slope(&Params::new(1.168e-3, elastic, memory)?, 1e-3, 0.0);
/// assert!((slope - (elastic.c1_nm_per_rad - memory.e() - 2.0 * memory.h())).abs() < 1e-6);
/// # Ok::<(), gmhm::ParamError>(())
/// ```
#[must_use]
pub fn least_rising_slope(params: &Params, longest_period_s: f64, deflection_rad: f64) -> f64 {
    let u = deflection_rad / params.rated_deflection_rad();
    let g = libm::sqrt((1.0 - u) * (1.0 + u));
    let scale = params.torque_scale_nm() / params.rated_deflection_rad();
    Slopes::new(params, longest_period_s).least(u, g) / g * scale
}

/// Steps of φ from 0 to the tip.
const GRID: u32 = 1000;

fn grid(k: u32) -> f64 {
    core::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(GRID)
}

/// What the inverse has to know of a torque that increases with the deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Monotony {
    /// r of [`invertible_range`].
    pub(crate) reach: f64,
    /// A bound from below of d(T/T_A)/du there.
    pub(crate) least_slope: f64,
    /// Bounds of the first three derivatives of T/T_A by t = tan(φ/2).
    pub(crate) bounds: [f64; 3],
}

impl Monotony {
    /// That of parameters, in law `time` at every period up to the longest; the search has to be within what the scalar holds.
    pub(crate) fn of<S: Scalar>(params: &Params, longest_period_s: f64) -> Result<Self, InverseError> {
        let reach = invertible_range(params, longest_period_s)?;
        let number = largest_number(params, longest_period_s, reach);
        if number >= S::LARGEST {
            return Err(InverseError::Format { number, largest: S::LARGEST });
        }
        let least_slope = least_slope(params, longest_period_s, reach);
        let bounds = derivative_bounds(params, longest_period_s).map(|bound| bound.min(f64::MAX));
        Ok(Self { reach, least_slope, bounds })
    }
}

/// A bound from below of d(T/T_A)/du within ±`reach`, less a part for what lies between the points of the grid; may be 0.
fn least_slope(params: &Params, longest_period_s: f64, reach: f64) -> f64 {
    let law = Slopes::new(params, longest_period_s);
    let slopes = (0..GRID).map(|k| libm::sincos(grid(k))).take_while(|&(u, _)| u <= reach);
    let least = slopes.map(|(u, g)| law.least(u, g).min(law.least(-u, g)) / g).fold(f64::INFINITY, f64::min);
    (0.9 * least).max(0.0)
}

/// What the slope of the torque depends on, all over T_A and A.
struct Slopes {
    elastic: Polynomial<f64>,
    memory: MemorySlopes,
}

enum MemorySlopes {
    Masing { e: f64, h: f64 },
    Phase { law: Phase<f64>, bound: Bound },
    Time { increment: f64, gate: Gate, bound: Bound },
}

/// The largest abs(m) and the largest ρ·abs(m).
struct Bound {
    kernel: Kernel,
    memory: f64,
    decay: f64,
}

impl Bound {
    fn new(params: &Params) -> Self {
        let memory = params.memory();
        let gain = memory.alpha * params.rated_deflection_rad() / params.torque_scale_nm();
        match memory.kernel {
            Kernel::Deflection => {
                Self { kernel: memory.kernel, memory: gain / memory.beta_per_s, decay: gain / memory.omega_per_s }
            }
            Kernel::Rate => Self { kernel: memory.kernel, memory: gain, decay: gain * memory.rho() },
        }
    }

    /// M and ρM at u.
    fn at(&self, u: f64) -> (f64, f64) {
        match self.kernel {
            Kernel::Deflection => (self.memory, self.decay),
            Kernel::Rate => ((1.0 + libm::fabs(u)) * self.memory, (1.0 + libm::fabs(u)) * self.decay),
        }
    }
}

impl Slopes {
    fn new(params: &Params, longest_period_s: f64) -> Self {
        let (a, scale, memory) = (params.rated_deflection_rad(), params.torque_scale_nm(), params.memory());
        let slopes = match memory.law {
            Law::Masing => MemorySlopes::Masing { e: memory.e() * a / scale, h: memory.h() * a / scale },
            Law::Phase => MemorySlopes::Phase { law: Phase::new(params), bound: Bound::new(params) },
            Law::Time => MemorySlopes::Time {
                increment: Time::<f64>::new(params, longest_period_s).growth(),
                gate: memory.gate,
                bound: Bound::new(params),
            },
        };
        Self { elastic: params.elastic().normalised(a, scale), memory: slopes }
    }

    /// The least dT/dφ at u = sin φ, g = cos φ > 0 on a rising path; of a falling one by symmetry.
    fn least(&self, u: f64, g: f64) -> f64 {
        let elastic = self.elastic.stiffness(u) * g;
        match &self.memory {
            MemorySlopes::Masing { e, h } => masing_slope(elastic, *e, *h, u, g),
            MemorySlopes::Phase { law, bound } => {
                let (m, decay) = bound.at(u);
                let steady = law.quadrature * g + law.in_phase * u;
                let source = law.in_phase * g - law.quadrature * u + law.rho * steady;
                match law.gate {
                    Gate::Cycle => elastic + g * source - libm::fabs(u * m + g * decay),
                    Gate::None => elastic + source - decay,
                }
            }
            MemorySlopes::Time { increment, gate, bound } => match gate {
                Gate::Cycle => elastic + increment * g * g - libm::fabs(u) * bound.at(u).0,
                Gate::None => elastic + increment * g,
            },
        }
    }
}

/// Points of the grid of [`MasingRange`].
#[cfg(feature = "adapt")]
const COARSE_GRID: u16 = 128;

/// [`Monotony`] of law `masing`, computed in the scalar alone, on a coarser grid.
#[cfg(feature = "adapt")]
pub(super) struct MasingRange<S> {
    pub(super) reach: S,
    pub(super) least_slope: S,
    pub(super) bounds: [S; 3],
}

#[cfg(feature = "adapt")]
impl<S: Float> MasingRange<S> {
    /// The range in which the torque rises by more than [`LEAST_SLOPE`]; `None` where there is none.
    pub(super) fn of(elastic: &Polynomial<S>, e: S, h: S) -> Option<Self> {
        /// Of T_A/A: the slope bends by no more between two points of the grid.
        const LEAST_SLOPE: f64 = 2e-3;
        let step = S::from_f64(core::f64::consts::FRAC_PI_2 / f64::from(COARSE_GRID));
        let grid = |k: u16| (step * S::from_f64(f64::from(k))).sin_cos();
        let excess = |u: S, g: S| {
            let slope = masing_slope(elastic.stiffness(u) * g, e, h, u, g);
            slope - S::from_f64(LEAST_SLOPE) * g
        };
        let (mut reach, mut least_slope) = (S::ONE, S::from_f64(S::LARGEST));
        let mut bounds = [S::ZERO; 3];
        let mut inside = None;
        for k in 0..=COARSE_GRID {
            let (u, g) = grid(k);
            for (bound, derivative) in bounds.iter_mut().zip(single_valued(elastic, e, u, g)) {
                *bound = bound.max(S::from_f64(BETWEEN) * derivative.abs());
            }
            // The last point is a tip.
            if k == COARSE_GRID || reach < S::ONE {
                continue;
            }
            let excess_here = excess(u, g);
            // A NaN compares false.
            if excess_here > S::ZERO {
                least_slope = least_slope.min(excess_here.over(g));
                inside = Some(u);
            } else {
                reach = Self::edge(inside?, u, excess);
            }
        }
        let bounds = [0, 1, 2].map(|k| bounds[k] + S::from_f64(LOOPS[k]) * h);
        Some(Self { reach, least_slope: S::from_f64(0.9) * least_slope, bounds })
    }

    /// Where a function falls to zero.
    fn edge(mut inside: S, mut outside: S, of: impl Fn(S, S) -> S) -> S {
        for _ in 0..24 {
            let middle = S::HALF * (inside + outside);
            if of(middle, middle.cosine(middle * middle)) > S::ZERO {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    }
}

/// The least dT/dφ of law `masing`, of that of the elastic torque.
#[inline]
fn masing_slope<S: Float>(elastic: S, e: S, h: S, u: S, g: S) -> S {
    elastic - e * (g - u) * (g + u) - S::TWO * h * g
}

/// By how much the loop raises the bounds of the derivatives by t, times h: η′ ≤ 2 and −η″ ≤ 4 by u; du/dt ≤ 2, d²u/dt² ≤ 3, their product ≤ 4.2, d³u/dt³ ≤ 12.
const LOOPS: [f64; 3] = [4.0, 22.0, 75.0];

/// For points of the grid that are passed over.
const BETWEEN: f64 = 1.05;

/// Bounds of the first three derivatives of T/T_A by t = tan(φ/2), by the largest coefficients: what the last step of the search leaves is at
/// most a sixth of the third times the step cubed. Merged branches tilt by more than this counts, and their slope changes as little.
fn derivative_bounds(params: &Params, longest_period_s: f64) -> [f64; 3] {
    let (a, scale, memory) = (params.rated_deflection_rad(), params.torque_scale_nm(), params.memory());
    let elastic = params.elastic().normalised(a, scale);
    let masing = memory.law == Law::Masing;
    let e = if masing { memory.e() * a / scale } else { 0.0 };
    // What has no memory is known; by oddness half the range tells all.
    let mut bounds = [0.0_f64; 3];
    for k in 0..=GRID {
        let (u, g) = libm::sincos(grid(k));
        for (bound, derivative) in bounds.iter_mut().zip(single_valued(&elastic, e, u, g)) {
            *bound = bound.max(BETWEEN * libm::fabs(derivative));
        }
    }
    let hysteresis = match memory.law {
        Law::Masing => {
            let h = memory.h() * a / scale;
            return [0, 1, 2].map(|k| bounds[k] + LOOPS[k] * h);
        }
        Law::Phase | Law::Time => memory_bounds(params, longest_period_s),
    };
    let [d1, d2, d3] = hysteresis;
    // dφ/dt ≤ 2, abs(d²φ/dt²) ≤ 1.3, abs(d³φ/dt³) ≤ 4.
    let hysteresis = [2.0 * d1, 4.0 * d2 + 1.3 * d1, 8.0 * d3 + 7.8 * d2 + 4.0 * d1];
    [0, 1, 2].map(|k| bounds[k] + hysteresis[k])
}

/// Bounds of the first three derivatives of the hysteresis torque over T_A by φ.
fn memory_bounds(params: &Params, longest_period_s: f64) -> [f64; 3] {
    let (a, scale, memory) = (params.rated_deflection_rad(), params.torque_scale_nm(), params.memory());
    let gated = |m: [f64; 4]| match memory.gate {
        Gate::Cycle => [m[1] + m[0], m[2] + 2.0 * m[1] + m[0], m[3] + 3.0 * (m[2] + m[1]) + m[0]],
        Gate::None => [m[1], m[2], m[3]],
    };
    match memory.law {
        // η′ ≤ 2 and −η″ ≤ 4 by u; a merged branch tilts by as much.
        Law::Masing => [4.0, 8.0, 16.0].map(|bound| bound * memory.h() * a / scale),
        Law::Phase => {
            let law = Phase::<f64>::new(params);
            let steady = libm::fabs(law.quadrature) + libm::fabs(law.in_phase);
            let transient = Bound::new(params).at(1.0).0 + steady;
            let part = |power: i32| steady + transient * libm::pow(law.rho, f64::from(power));
            gated([part(0), part(1), part(2), part(3)])
        }
        Law::Time => {
            let growth = libm::fabs(Time::<f64>::new(params, longest_period_s).growth());
            // Shorter periods let kernel rate grow faster, up to αA/T_A.
            let growth = if memory.kernel == Kernel::Rate { memory.alpha * a / scale } else { growth };
            gated([Bound::new(params).at(1.0).0, growth, growth, growth])
        }
    }
}

/// The largest number that the search meets within ±`reach`, what is over A and T_A and their derivatives.
fn largest_number(params: &Params, longest_period_s: f64, reach: f64) -> f64 {
    let (a, scale, memory) = (params.rated_deflection_rad(), params.torque_scale_nm(), params.memory());
    let elastic = params.elastic().normalised(a, scale);
    let e = if memory.law == Law::Masing { memory.e() * a / scale } else { 0.0 };
    let [growth, curl, _] = memory_bounds(params, longest_period_s);
    let numbers = (0..GRID).map(|k| libm::sincos(grid(k))).take_while(|&(u, _)| u <= reach).flat_map(|(u, g)| {
        let [slope, bend, _] = by_phase(&elastic, e, u, g);
        let (slope, bend) = (libm::fabs(slope) + growth, libm::fabs(bend) + curl);
        let spring = 6.0 * elastic.k3 + 20.0 * elastic.k5 * u * u;
        // t = u/(1 + g); 2q = 1 + g.
        [libm::fabs(spring), bend + u / (1.0 + g) * slope, (1.0 + g) * slope]
    });
    numbers.chain([20.0 * libm::fabs(elastic.k5)]).fold(0.0, f64::max)
}

/// The first three derivatives of f − e·u·g by φ, at u = sin φ, g = cos φ.
fn by_phase<S: Float>(elastic: &Polynomial<S>, e: S, u: S, g: S) -> [S; 3] {
    let Polynomial { k3, k5, .. } = *elastic;
    let [three, four, six, twenty, sixty] = [3.0, 4.0, 6.0, 20.0, 60.0].map(S::from_f64);
    let by_u = [elastic.stiffness(u), u * (six * k3 + twenty * k5 * u * u), six * k3 + sixty * k5 * u * u];
    [
        by_u[0] * g - e * (g * g - u * u),
        by_u[1] * g * g - by_u[0] * u + four * e * u * g,
        by_u[2] * g * g * g - three * by_u[1] * u * g - by_u[0] * g + four * e * (g * g - u * u),
    ]
}

/// The same by t = tan(φ/2).
fn single_valued<S: Float>(elastic: &Polynomial<S>, e: S, u: S, g: S) -> [S; 3] {
    let by_phi = by_phase(elastic, e, u, g);
    let [three, four, sixteen] = [3.0, 4.0, 16.0].map(S::from_f64);
    let (t, q) = (u.over(S::ONE + g), S::HALF * (S::ONE + g));
    let phi = [S::TWO * q, -four * t * q * q, (sixteen * t * t * q - four) * q * q];
    [
        by_phi[0] * phi[0],
        by_phi[1] * phi[0] * phi[0] + by_phi[0] * phi[1],
        by_phi[2] * phi[0] * phi[0] * phi[0] + three * by_phi[1] * phi[0] * phi[1] + by_phi[0] * phi[2],
    ]
}
