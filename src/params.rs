//! Parameters in SI units: checked once, immutable afterwards.

/// Elastic torque f(θ) = c1·θ + c2·θ³ + c3·θ⁵.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// c1, N·m/rad.
    pub c1_nm_per_rad: f64,
    /// c2, N·m/rad³.
    pub c2_nm_per_rad3: f64,
    /// c3, N·m/rad⁵.
    pub c3_nm_per_rad5: f64,
}

/// Which law the memory follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Law {
    /// Quasi-static, any deflection path, return-point memory (Masing's rule, Rayleigh's law).
    #[default]
    Masing,
    /// The memory integral in the paper's pseudo-time φ = asin(θ/A): rate-independent, transient included.
    Phase,
    /// The memory integral in real time: rate-dependent.
    Time,
}

/// What the memory integral weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kernel {
    /// ∫ α e^(−β(t−s)) θ ds, with the sign that dissipates: what the paper fitted and published.
    #[default]
    Deflection,
    /// ∫ α e^(−β(t−s)) θ̇ ds: what the paper's integral says.
    Rate,
}

/// The factor between memory and hysteresis torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gate {
    /// z = g(θ)·m, g(θ) = √(1 − θ²/A²): the paper's abs(cos ωt).
    #[default]
    Cycle,
    /// z = m: a plain viscoelastic memory.
    None,
}

/// The hysteresis memory: law, kernel, gate and parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// ω ≥ 0, 1/s; laws `masing` and `phase`.
    pub omega_per_s: f64,
    /// Width ε of the input play before the turning-point tracker, rad; law `masing`.
    pub reversal_play_rad: f64,
}

/// Checked parameters of one gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {}

/// Why parameters were refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamError {}
