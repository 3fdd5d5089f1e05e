//! Parameters of one gear in SI units: checked once, immutable afterwards.

use core::fmt;

use crate::elastic::Elastic;

/// What is in a result, or its error to the caller: `?`, which constants do not have yet.
macro_rules! ok {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(error) => return Err(error),
        }
    };
}

/// Which law the memory follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Law {
    /// Quasi-static, any deflection path, return-point memory: Masing's rule on Rayleigh's loop.
    #[default]
    Masing,
    /// The memory integral in the paper's pseudo-time φ = asin(θ/A): rate-independent, transient included.
    Phase,
    /// The memory integral in real time: rate-dependent.
    Time,
}

/// What the memory integral weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Kernel {
    /// −∫ α e^(−β(t−s)) θ ds, the sign that dissipates: what the paper fitted and published.
    #[default]
    Deflection,
    /// ∫ α e^(−β(t−s)) θ̇ ds: what the paper's integral says.
    Rate,
}

/// The factor between the memory and the hysteresis torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Gate {
    /// z = g(θ)·m with g(θ) = √(1 − θ²/A²), the paper's abs(cos ωt).
    #[default]
    Cycle,
    /// z = m: a plain viscoelastic memory.
    None,
}

/// The hysteresis memory: its law and its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    /// Which law.
    pub law: Law,
    /// Which kernel; laws `phase` and `time`.
    pub kernel: Kernel,
    /// Which gate; laws `phase` and `time`.
    pub gate: Gate,
    /// α ≥ 0; N·m/(rad·s) for kernel `deflection`, N·m/rad for kernel `rate`.
    pub alpha: f64,
    /// β ≥ 0, 1/s.
    pub beta_per_s: f64,
    /// ω ≥ 0, 1/s: speed of the pseudo-time; laws `masing` and `phase`.
    pub omega_per_s: f64,
    /// Width ε ≥ 0 of the input play before the turning-point tracker, rad; law `masing`.
    pub reversal_play_rad: f64,
}

impl Memory {
    /// No hysteresis, law `masing`: for `..Memory::NONE` in constants.
    pub const NONE: Self = Self {
        law: Law::Masing,
        kernel: Kernel::Deflection,
        gate: Gate::Cycle,
        alpha: 0.0,
        beta_per_s: 0.0,
        omega_per_s: 0.0,
        reversal_play_rad: 0.0,
    };

    /// e = αβ/(β² + ω²): with h, all that a quasi-static cycle can tell of (α, β, ω). N·m/rad for kernel `deflection`.
    #[must_use]
    pub const fn e(&self) -> f64 {
        self.alpha * self.beta_per_s / self.speed_squared()
    }

    /// h = αω/(β² + ω²). N·m/rad for kernel `deflection`: hA is the half-width of the rated cycle at θ = 0.
    #[must_use]
    pub const fn h(&self) -> f64 {
        self.alpha * self.omega_per_s / self.speed_squared()
    }

    /// ρ = β/ω = e/h, the decay per radian of pseudo-time.
    #[must_use]
    pub const fn rho(&self) -> f64 {
        self.beta_per_s / self.omega_per_s
    }

    const fn speed_squared(&self) -> f64 {
        self.beta_per_s * self.beta_per_s + self.omega_per_s * self.omega_per_s
    }

    /// The same memory with β, ω ≥ 0. The published parameters have both negative, which runs time backwards along a branch.
    const fn canonical(mut self) -> Result<Self, ParamError> {
        if self.beta_per_s <= 0.0 && self.omega_per_s <= 0.0 {
            // Adding zero turns −0 into 0.
            self.beta_per_s = -self.beta_per_s + 0.0;
            self.omega_per_s = -self.omega_per_s + 0.0;
        }
        if matches!(self.law, Law::Time) {
            ok!(at_least_zero("beta_per_s", self.beta_per_s));
        } else if self.beta_per_s < 0.0 || self.omega_per_s < 0.0 {
            return Err(ParamError::MixedSigns { beta_per_s: self.beta_per_s, omega_per_s: self.omega_per_s });
        }
        Ok(self)
    }
}

/// Why parameters were refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum ParamError {
    /// A value is NaN or infinite.
    NotFinite {
        /// Its name in model files.
        parameter: &'static str,
    },
    /// A value must be greater than zero.
    NotPositive {
        /// Its name in model files.
        parameter: &'static str,
        /// What it was.
        value: f64,
    },
    /// A value must not be less than zero.
    Negative {
        /// Its name in model files.
        parameter: &'static str,
        /// What it was.
        value: f64,
    },
    /// β and ω must share their sign.
    MixedSigns {
        /// β, 1/s.
        beta_per_s: f64,
        /// ω, 1/s.
        omega_per_s: f64,
    },
    /// β and ω are both zero, so that a quasi-static loop has no shape.
    NoSpeed,
    /// A setting that the chosen law does not have.
    NotInLaw {
        /// Its name in model files.
        parameter: &'static str,
        /// The law.
        law: Law,
    },
    /// A value or a torque that no strain wave gear has: mostly another unit.
    OutOfRange {
        /// Its name in model files, or what torque it is.
        parameter: &'static str,
        /// What it was.
        value: f64,
        /// The least that is accepted.
        least: f64,
        /// The most that is accepted.
        most: f64,
    },
    /// Elastic and memory parameters give no torque at all, or more than numbers can hold.
    NoTorque {
        /// The largest torque within the rated deflection, N·m.
        torque_nm: f64,
    },
}

impl fmt::Display for ParamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { parameter } => write!(f, "{parameter} must be a finite number"),
            Self::NotPositive { parameter, value } => write!(f, "{parameter} = {value} must be greater than zero"),
            Self::Negative { parameter, value } => write!(f, "{parameter} = {value} must not be negative"),
            Self::MixedSigns { beta_per_s, omega_per_s } => {
                write!(f, "beta_per_s = {beta_per_s} and omega_per_s = {omega_per_s} must have the same sign")
            }
            Self::NoSpeed => write!(f, "beta_per_s and omega_per_s must not both be zero in laws masing and phase"),
            Self::NotInLaw { parameter, law } => write!(f, "{parameter} has no meaning in law {}", law.name()),
            Self::OutOfRange { parameter, value, least, most } => write!(
                f,
                "{parameter} = {value} is that of no gear: between {least} and {most} is accepted; check the units"
            ),
            Self::NoTorque { torque_nm } => write!(
                f,
                "the parameters give a torque of {torque_nm} N·m within the rated deflection: it must be finite and not zero"
            ),
        }
    }
}

impl core::error::Error for ParamError {}

impl Law {
    /// Its name in model files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Masing => "masing",
            Self::Phase => "phase",
            Self::Time => "time",
        }
    }
}

impl Kernel {
    /// Its name in model files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::Rate => "rate",
        }
    }
}

impl Gate {
    /// Its name in model files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cycle => "cycle",
            Self::None => "none",
        }
    }
}

/// Checked parameters of one gear, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(all(feature = "defmt", target_os = "none"), derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Params {
    rated_deflection_rad: f64,
    elastic: Elastic,
    memory: Memory,
    torque_scale_nm: f64,
}

impl Params {
    /// Checks the parameters and brings β and ω to their canonical signs.
    ///
    /// | value | accepted | why |
    /// |---|---|---|
    /// | A | 1e-6 to 1 rad | from an encoder's resolution to far beyond any gear |
    /// | c1 | 0 and more | a spring resists |
    /// | f(A) | 0 and more, 1e-6 to 1e5 N·m where it is the [torque scale](Self::torque_scale_nm) | the largest strain wave gears bear 1e4 N·m |
    /// | each of c1A, c2A³, c3A⁵, hysteresis torque | to 1e5 N·m either way, and a hysteresis torque to 1000 times f(A) where f(A) > 0 | the same; with kernel `rate` the paper's α holds 100 times f(A) |
    /// | play | 0 to A | it hides noise |
    /// | β, ω | 0 to 1e9 /s | what `f32` can sample |
    ///
    /// In a constant the compiler checks them, and a `static` holds them:
    ///
    /// ```
    /// use gmhm::{Elastic, Memory, Params};
    ///
    /// const ELASTIC: Elastic = Elastic { c1_nm_per_rad: 2.4737e4, c2_nm_per_rad3: 1.0e9, c3_nm_per_rad5: -1.1774e14 };
    /// const MEMORY: Memory = Memory { alpha: 2.6532e6, beta_per_s: 422.68, omega_per_s: 226.31, ..Memory::NONE };
    /// static PARAMS: Params = match Params::new(1.168e-3, ELASTIC, MEMORY) {
    ///     Ok(params) => params,
    ///     Err(_) => panic!("these are the parameters of no gear"),
    /// };
    /// ```
    ///
    /// # Errors
    /// Names the first parameter that cannot be: what [`candidate`](Self::candidate) refuses, then what lies outside this table.
    pub const fn new(rated_deflection_rad: f64, elastic: Elastic, memory: Memory) -> Result<Self, ParamError> {
        let params = ok!(Self::candidate(rated_deflection_rad, elastic, memory));
        ok!(params.check_ranges());
        Ok(params)
    }

    /// Parameters that can be computed with, whether or not a gear can have them: what a search tries on its way. Drives take those of [`new`](Self::new).
    ///
    /// # Errors
    /// Names the first parameter that cannot be: not finite, rated deflection not above zero, α, play (or β in law `time`) below
    /// zero, β and ω of different signs or both zero, a kernel, gate or play that the law does not have, no torque at all.
    pub const fn candidate(rated_deflection_rad: f64, elastic: Elastic, memory: Memory) -> Result<Self, ParamError> {
        let mut numbers: &[(&'static str, f64)] = &[
            ("rated_deflection_rad", rated_deflection_rad),
            ("c1_nm_per_rad", elastic.c1_nm_per_rad),
            ("c2_nm_per_rad3", elastic.c2_nm_per_rad3),
            ("c3_nm_per_rad5", elastic.c3_nm_per_rad5),
            ("alpha", memory.alpha),
            ("beta_per_s", memory.beta_per_s),
            ("omega_per_s", memory.omega_per_s),
            ("reversal_play_rad", memory.reversal_play_rad),
        ];
        // A `for` cannot run at compile time.
        while let [(parameter, value), rest @ ..] = numbers {
            if !value.is_finite() {
                return Err(ParamError::NotFinite { parameter });
            }
            numbers = rest;
        }
        if rated_deflection_rad <= 0.0 {
            return Err(ParamError::NotPositive { parameter: "rated_deflection_rad", value: rated_deflection_rad });
        }
        let memory = ok!(memory.canonical());
        ok!(at_least_zero("alpha", memory.alpha));
        ok!(at_least_zero("reversal_play_rad", memory.reversal_play_rad));
        let law = memory.law;
        if matches!(law, Law::Masing) {
            if !matches!(memory.kernel, Kernel::Deflection) {
                return Err(ParamError::NotInLaw { parameter: "kernel = \"rate\"", law });
            }
            if !matches!(memory.gate, Gate::Cycle) {
                return Err(ParamError::NotInLaw { parameter: "gate = \"none\"", law });
            }
        } else if memory.reversal_play_rad != 0.0 {
            return Err(ParamError::NotInLaw { parameter: "reversal_play_rad", law });
        }
        if !matches!(law, Law::Time) && memory.beta_per_s == 0.0 && memory.omega_per_s == 0.0 {
            return Err(ParamError::NoSpeed);
        }
        let mut params = Self { rated_deflection_rad, elastic, memory, torque_scale_nm: 1.0 };
        params.torque_scale_nm = ok!(params.choose_torque_scale_nm());
        Ok(params)
    }

    /// What [`new`](Self::new) accepts of parameters that can be computed with.
    const fn check_ranges(&self) -> Result<(), ParamError> {
        const DEFLECTIONS_RAD: [f64; 2] = [1e-6, 1.0];
        const TORQUES_NM: [f64; 2] = [1e-6, 1e5];
        const LARGEST_SPEED_PER_S: f64 = 1e9;
        const LARGEST_LOOP: f64 = 1000.0;
        let a = self.rated_deflection_rad;
        ok!(within("rated_deflection_rad", a, DEFLECTIONS_RAD));
        ok!(at_least_zero("c1_nm_per_rad", self.elastic.c1_nm_per_rad));
        let [_, largest] = TORQUES_NM;
        let raw = self.elastic.normalised(a, 1.0);
        ok!(within("c1_nm_per_rad (times rated_deflection_rad, N·m)", raw.k1, [0.0, largest]));
        ok!(within("c2_nm_per_rad3 (times rated_deflection_rad³, N·m)", raw.k3, [-largest, largest]));
        ok!(within("c3_nm_per_rad5 (times rated_deflection_rad⁵, N·m)", raw.k5, [-largest, largest]));
        let rated = self.rated_torque_nm();
        ok!(within("c1_nm_per_rad (as elastic torque at the rated deflection, N·m)", rated, [0.0, largest]));
        let most = if rated > 0.0 { (LARGEST_LOOP * rated).min(largest) } else { largest };
        ok!(within("alpha (as hysteresis torque, N·m)", self.largest_memory_nm(), [0.0, most]));
        ok!(within("c1_nm_per_rad (as torque at the rated deflection, N·m)", self.torque_scale_nm, TORQUES_NM));
        ok!(within("beta_per_s", self.memory.beta_per_s, [0.0, LARGEST_SPEED_PER_S]));
        ok!(within("omega_per_s", self.memory.omega_per_s.abs(), [0.0, LARGEST_SPEED_PER_S]));
        within("reversal_play_rad", self.memory.reversal_play_rad, [0.0, a])
    }

    /// The largest hysteresis torque within ±A, N·m; in law `time`, kernel `deflection`, what a deflection held for 1/β, at most a second, leaves.
    const fn largest_memory_nm(&self) -> f64 {
        let Memory { law, kernel, alpha, beta_per_s, .. } = self.memory;
        if matches!((law, kernel), (Law::Time, Kernel::Deflection)) {
            return alpha * self.rated_deflection_rad / beta_per_s.max(1.0);
        }
        self.memory_bound_nm()
    }

    /// The rated torque T_A = f(A) where the spring carries most of the torque, else the largest single contribution, so that normalised
    /// coefficients stay of order one even for a gear without stiffness.
    const fn choose_torque_scale_nm(&self) -> Result<f64, ParamError> {
        let raw = self.elastic.normalised(self.rated_deflection_rad, 1.0);
        let largest = 0.0_f64.max(raw.k1.abs()).max(raw.k3.abs()).max(raw.k5.abs()).max(self.memory_bound_nm().abs());
        let rated_torque_nm = self.rated_torque_nm();
        let scale = if rated_torque_nm >= 0.125 * largest { rated_torque_nm } else { largest };
        if scale > 0.0 && scale.is_finite() { Ok(scale) } else { Err(ParamError::NoTorque { torque_nm: scale }) }
    }

    /// The size of the hysteresis torque on the rated cycle, N·m (its order of magnitude in law `time`, where it depends on the rate).
    const fn memory_bound_nm(&self) -> f64 {
        let a = self.rated_deflection_rad;
        match (self.memory.law, self.memory.kernel) {
            (Law::Time, Kernel::Deflection) => 0.0,
            (Law::Time, Kernel::Rate) => self.memory.alpha * a,
            (_, Kernel::Deflection) => a * self.memory.e().max(self.memory.h()),
            (_, Kernel::Rate) => a * self.memory.omega_per_s * self.memory.e().max(self.memory.h()),
        }
    }

    /// A, the amplitude of the calibrated cycle, rad.
    #[must_use]
    pub const fn rated_deflection_rad(&self) -> f64 {
        self.rated_deflection_rad
    }

    /// T_A = f(A), N·m.
    #[must_use]
    pub const fn rated_torque_nm(&self) -> f64 {
        self.elastic.torque_nm(self.rated_deflection_rad)
    }

    /// What torques are divided by inside: T_A, unless the spring is too soft to be the measure of the gear. N·m.
    #[must_use]
    pub const fn torque_scale_nm(&self) -> f64 {
        self.torque_scale_nm
    }

    /// The elastic coefficients.
    #[must_use]
    pub const fn elastic(&self) -> Elastic {
        self.elastic
    }

    /// The memory, β and ω not negative.
    #[must_use]
    pub const fn memory(&self) -> Memory {
        self.memory
    }
}

const fn within(parameter: &'static str, value: f64, [least, most]: [f64; 2]) -> Result<(), ParamError> {
    // A NaN compares false.
    if value >= least && value <= most { Ok(()) } else { Err(ParamError::OutOfRange { parameter, value, least, most }) }
}

const fn at_least_zero(parameter: &'static str, value: f64) -> Result<(), ParamError> {
    if value < 0.0 { Err(ParamError::Negative { parameter, value }) } else { Ok(()) }
}
