//! What a column may hold, and the units that its name may end in.

use std::f64::consts::PI;

/// A physical quantity of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Time, s.
    Time,
    /// Transmitted torque, N·m.
    Torque,
    /// Motor current, A: stands in for the torque.
    Current,
    /// Torsional deflection, rad.
    Deflection,
    /// Motor-side angle, rad.
    ThetaIn,
    /// Output-side angle, rad.
    ThetaOut,
    /// Output velocity, rad/s.
    VelocityOut,
    /// Gear temperature, °C.
    Temperature,
    /// Another simulator's torque, N·m.
    TorqueSim,
}

/// A unit suffix; a number becomes SI by `(number − zero)·numerator/denominator`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Every accepted spelling; the first is the one that messages show.
    pub spellings: &'static [&'static str],
    zero: f64,
    numerator: f64,
    denominator: f64,
}

impl Unit {
    /// The number in SI (°C for temperatures). Exact for SI itself, one correctly rounded division for decimal prefixes.
    pub fn to_si(self, number: f64) -> f64 {
        (number - self.zero) * self.numerator / self.denominator
    }

    /// Whether it is the unit of SI itself, or °C: [`to_si`](Self::to_si) leaves numbers as they are.
    pub(super) fn is_si(self) -> bool {
        self.zero == 0.0 && self.numerator == self.denominator
    }
}

const fn unit(spellings: &'static [&'static str], numerator: f64, denominator: f64) -> Unit {
    Unit { spellings, zero: 0.0, numerator, denominator }
}

const TIME: &[Unit] = &[
    unit(&["s"], 1.0, 1.0),
    unit(&["ms"], 1.0, 1e3),
    unit(&["us"], 1.0, 1e6),
    unit(&["ns"], 1.0, 1e9),
    unit(&["min"], 60.0, 1.0),
    unit(&["h"], 3600.0, 1.0),
];
// lbf, ozf and inch by their definitions: 4.4482216152605 N, a sixteenth of it, 0.0254 m.
const TORQUE: &[Unit] = &[
    unit(&["nm", "Nm"], 1.0, 1.0),
    unit(&["mnm", "mNm"], 1.0, 1e3),
    unit(&["knm", "kNm"], 1e3, 1.0),
    unit(&["nmm", "Nmm"], 1.0, 1e3),
    unit(&["ncm", "Ncm"], 1.0, 1e2),
    unit(&["lbin", "inlb"], 4.448_221_615_260_5 * 0.0254, 1.0),
    unit(&["lbft", "ftlb"], 4.448_221_615_260_5 * 0.3048, 1.0),
    unit(&["ozin", "inoz"], 4.448_221_615_260_5 * 0.0254, 16.0),
    unit(&["kgfm"], 9.806_65, 1.0),
    unit(&["kgfcm"], 9.806_65, 1e2),
];
const CURRENT: &[Unit] = &[unit(&["a", "A"], 1.0, 1.0), unit(&["ma", "mA"], 1.0, 1e3)];
const ANGLE: &[Unit] = &[
    unit(&["rad"], 1.0, 1.0),
    unit(&["mrad"], 1.0, 1e3),
    unit(&["urad"], 1.0, 1e6),
    unit(&["deg"], PI, 180.0),
    unit(&["mdeg"], PI, 180e3),
    unit(&["arcmin"], PI, 10_800.0),
    unit(&["arcsec"], PI, 648_000.0),
    unit(&["rev", "turn"], 2.0 * PI, 1.0),
];
const VELOCITY: &[Unit] = &[
    unit(&["rad_per_s"], 1.0, 1.0),
    unit(&["mrad_per_s"], 1.0, 1e3),
    unit(&["deg_per_s"], PI, 180.0),
    unit(&["rpm", "rev_per_min"], PI, 30.0),
    unit(&["rev_per_s"], 2.0 * PI, 1.0),
];
const TEMPERATURE: &[Unit] = &[
    unit(&["c", "C"], 1.0, 1.0),
    Unit { spellings: &["k", "K"], zero: 273.15, numerator: 1.0, denominator: 1.0 },
    Unit { spellings: &["f", "F"], zero: 32.0, numerator: 5.0, denominator: 9.0 },
];

impl Quantity {
    /// Every quantity; a stem that another one starts with comes before it.
    pub const ALL: [Quantity; 9] = [
        Quantity::TorqueSim,
        Quantity::Time,
        Quantity::Torque,
        Quantity::Current,
        Quantity::Deflection,
        Quantity::ThetaIn,
        Quantity::ThetaOut,
        Quantity::VelocityOut,
        Quantity::Temperature,
    ];

    /// The column's name without its unit.
    pub fn stem(self) -> &'static str {
        match self {
            Quantity::Time => "time",
            Quantity::Torque => "torque",
            Quantity::Current => "current",
            Quantity::Deflection => "deflection",
            Quantity::ThetaIn => "theta_in",
            Quantity::ThetaOut => "theta_out",
            Quantity::VelocityOut => "velocity_out",
            Quantity::Temperature => "temperature",
            Quantity::TorqueSim => "torque_sim",
        }
    }

    /// The units accepted, SI first.
    pub fn units(self) -> &'static [Unit] {
        match self {
            Quantity::Time => TIME,
            Quantity::Torque | Quantity::TorqueSim => TORQUE,
            Quantity::Current => CURRENT,
            Quantity::Deflection | Quantity::ThetaIn | Quantity::ThetaOut => ANGLE,
            Quantity::VelocityOut => VELOCITY,
            Quantity::Temperature => TEMPERATURE,
        }
    }

    /// The column's name in SI, such as `torque_nm`.
    pub fn si_name(self) -> String {
        format!("{}_{}", self.stem(), self.units()[0].spellings[0])
    }

    /// The unit of a suffix. Upper and lower case are one, unless they make two units of it: `mNm` and `MNm`.
    pub(super) fn unit(self, suffix: &str) -> Option<Unit> {
        let exact = self.units().iter().find(|unit| unit.spellings.contains(&suffix));
        let loose = || {
            let lower = suffix.to_lowercase();
            let two = self.units() == TORQUE && suffix.starts_with('M');
            self.units().iter().find(|unit| unit.spellings.contains(&lower.as_str()) && !two)
        };
        exact.or_else(loose).copied()
    }

    /// The accepted suffixes as a list for messages: `_rad, _mrad, …`.
    pub fn accepted_suffixes(self) -> String {
        let names: Vec<String> = self.units().iter().map(|u| format!("_{}", u.spellings[0])).collect();
        names.join(", ")
    }

    /// Words by which people call such a column, to guess a fix.
    pub(super) fn synonyms(self) -> &'static [&'static str] {
        match self {
            Quantity::Time => &["time", "t", "timestamp", "sec", "secs", "seconds", "zeit"],
            Quantity::Torque => &["torque", "tau", "trq", "moment", "force", "load", "nm", "effort"],
            Quantity::Current => &["current", "iq", "amps", "amp"],
            Quantity::Deflection => {
                &["deflection", "twist", "torsion", "windup", "disp", "displacement", "angle", "theta", "x"]
            }
            Quantity::ThetaIn => &["motor", "input", "qm"],
            Quantity::ThetaOut => &["output", "link", "joint", "position", "qo", "q"],
            Quantity::VelocityOut => &["velocity", "speed", "qd"],
            Quantity::Temperature => &["temperature", "temp"],
            Quantity::TorqueSim => &["sim", "simulated"],
        }
    }
}
