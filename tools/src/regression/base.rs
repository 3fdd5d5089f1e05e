//! The base model as columns: elastic torque and memory, by the core's own code.

use gmhm::memory::Frame;
use gmhm::memory::masing::{Path, single_valued_column};
use gmhm::{Elastic, Gate, Gear, Kernel, Law, Memory, ParamError, Params, State};

use crate::numerics::bounded::Bound;
use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Nonlinear, Stretch};
use crate::regression::rows::{Past, Rows};

/// Turning points kept on the host.
pub const TURNING_POINTS: usize = 256;

/// What of the memory is decided before anything is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structure {
    /// The law.
    pub law: Law,
    /// The kernel.
    pub kernel: Kernel,
    /// The gate.
    pub gate: Gate,
    /// The reversal play.
    pub play: Play,
}

/// What is known of the reversal play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Play {
    /// Its width, rad.
    Fixed(f64),
    /// To be found, up to a width, rad.
    UpTo(f64),
}

impl Structure {
    /// Law `masing` without play: the default.
    pub const MASING: Self =
        Self { law: Law::Masing, kernel: Kernel::Deflection, gate: Gate::Cycle, play: Play::Fixed(0.0) };

    /// The plainest with a rate: the memory integral in real time.
    pub const TIME: Self = Self { law: Law::Time, kernel: Kernel::Rate, gate: Gate::None, play: Play::Fixed(0.0) };

    /// The structure of a memory.
    pub fn of(memory: &Memory) -> Self {
        let &Memory { law, kernel, gate, reversal_play_rad, .. } = memory;
        Self { law, kernel, gate, play: Play::Fixed(reversal_play_rad) }
    }
}

/// Names and units of c1, c2, c3.
pub const ELASTIC: [(&str, &str); 3] =
    [("c1_nm_per_rad", "N·m/rad"), ("c2_nm_per_rad3", "N·m/rad³"), ("c3_nm_per_rad5", "N·m/rad⁵")];

/// c1, c2, c3.
#[derive(Debug, Clone, Copy, Default)]
pub struct ElasticPart;

impl Contribution for ElasticPart {
    fn columns(&self) -> &[Column] {
        const fn column((name, unit): (&'static str, &'static str)) -> Column {
            Column::of_gear(name, unit, Bound::Free)
        }
        static COLUMNS: [Column; 3] = [column(ELASTIC[0]), column(ELASTIC[1]), column(ELASTIC[2])];
        &COLUMNS
    }

    fn start<'a>(&'a self, _: &[f64], _: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        Box::new(*self)
    }
}

impl Evaluate for ElasticPart {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for (row, theta) in stretch.deflection_rad.iter().enumerate() {
            columns.set(row, &gmhm::elastic::basis(*theta));
        }
    }
}

/// Law `masing`: e and h, at a play.
#[derive(Debug, Clone)]
pub struct MasingPart {
    frame: Frame<f64>,
    rated_deflection_rad: f64,
    fixed_play_rad: f64,
    searched: Vec<Nonlinear>,
}

impl MasingPart {
    /// The memory of a gear of the rated deflection.
    pub fn new(rated_deflection_rad: f64, play: Play) -> Result<Self, ParamError> {
        let unit = unit_gear(rated_deflection_rad, Structure::MASING, 1.0, 1.0)?;
        let (fixed_play_rad, searched) = match play {
            Play::Fixed(width) => (width, Vec::new()),
            Play::UpTo(width) => {
                let play = Nonlinear {
                    name: "reversal_play_rad".into(),
                    unit: "rad".into(),
                    low: 0.0,
                    high: width,
                    smooth: false,
                };
                (0.0, vec![play])
            }
        };
        Ok(Self { frame: Frame::new(&unit), rated_deflection_rad, fixed_play_rad, searched })
    }
}

struct MasingPath<'a> {
    part: &'a MasingPart,
    half_play_rad: f64,
    past: Past,
    path: Option<Path<f64, TURNING_POINTS>>,
}

impl MasingPath<'_> {
    /// The path up to the first row of a recording.
    fn before(&self, theta_rad: f64) -> Path<f64, TURNING_POINTS> {
        let frame = &self.part.frame;
        let from = match self.past {
            Past::Rest => return Path::start(theta_rad),
            Past::Rising => frame.rated(),
            Past::Falling => -frame.rated(),
        };
        let mut path = Path::start(from);
        path.step(frame, 0.0, -from);
        path
    }
}

impl Contribution for MasingPart {
    fn columns(&self) -> &[Column] {
        static COLUMNS: [Column; 2] = [
            Column::of_gear("e_nm_per_rad", "N·m/rad", Bound::NonNegative),
            Column::of_gear("h_nm_per_rad", "N·m/rad", Bound::NonNegative),
        ];
        &COLUMNS
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.searched
    }

    fn start<'a>(&'a self, nonlinear: &[f64], rows: &'a Rows<'a>, _: usize) -> Box<dyn Evaluate + 'a> {
        let play = nonlinear.first().copied().unwrap_or(self.fixed_play_rad);
        Box::new(MasingPath { part: self, half_play_rad: 0.5 * play, past: rows.past, path: None })
    }
}

impl Evaluate for MasingPath<'_> {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        let frame = &self.part.frame;
        if self.path.is_none() {
            self.path = stretch.deflection_rad.first().map(|&theta| self.before(theta));
        }
        let Some(path) = &mut self.path else { return };
        for (row, &theta) in stretch.deflection_rad.iter().enumerate() {
            let eta = path.step(frame, self.half_play_rad, theta);
            columns.set(row, &[single_valued_column(frame, theta), self.part.rated_deflection_rad * eta]);
        }
    }
}

/// Law `phase` or `time`: α, at ρ or β. The memory at the start of a recording is a nuisance unless it is known to be zero.
#[derive(Debug, Clone)]
pub struct IntegralPart {
    structure: Structure,
    rated_deflection_rad: f64,
    columns: [Column; 2],
    searched: [Nonlinear; 1],
    known_start: Vec<bool>,
}

impl IntegralPart {
    /// The memory of a gear of the rated deflection; β is searched in `rates_per_s`. `known_start` tells, for each recording, that it starts with an empty memory.
    pub fn new(
        rated_deflection_rad: f64,
        structure: Structure,
        rates_per_s: (f64, f64),
        known_start: Vec<bool>,
    ) -> Result<Self, ParamError> {
        // Refuses a rated deflection that is none; every direction and rate in range is accepted afterwards.
        unit_gear(rated_deflection_rad, structure, 1.0, 1.0)?;
        let unit = if structure.kernel == Kernel::Rate { "N·m/rad" } else { "N·m/(rad·s)" };
        let columns = [Column::of_gear("alpha", unit, Bound::NonNegative), Column::of_recording("start", "1")];
        let searched = if structure.law == Law::Phase {
            // Any ρ = tan ψ from 0 to 1000 lies in a short, evenly covered range of ψ.
            Nonlinear {
                name: "atan(beta/omega)".into(),
                unit: "rad".into(),
                low: 0.0,
                high: 1e3_f64.atan(),
                smooth: true,
            }
        } else {
            let (low, high) = (rates_per_s.0.ln(), rates_per_s.1.ln());
            Nonlinear { name: "ln(beta_per_s)".into(), unit: "1".into(), low, high, smooth: true }
        };
        Ok(Self { structure, rated_deflection_rad, columns, searched: [searched], known_start })
    }

    /// (β, ω) at the searched coordinate: on the unit circle in law `phase`, (β, 0) in law `time`.
    pub fn speeds(&self, coordinate: f64) -> (f64, f64) {
        if self.structure.law == Law::Phase { (coordinate.sin(), coordinate.cos()) } else { (coordinate.exp(), 0.0) }
    }
}

/// A gear of unit α beside a unit spring.
fn unit_gear(
    rated_deflection_rad: f64,
    structure: Structure,
    beta_per_s: f64,
    omega_per_s: f64,
) -> Result<Params, ParamError> {
    let elastic = Elastic { c1_nm_per_rad: 1.0, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 };
    let Structure { law, kernel, gate, .. } = structure;
    let memory = Memory { law, kernel, gate, alpha: 1.0, beta_per_s, omega_per_s, reversal_play_rad: 0.0 };
    Params::candidate(rated_deflection_rad, elastic, memory)
}

struct IntegralPath {
    gear: Gear<f64>,
    state: Option<State<f64, 4>>,
    known_start: bool,
}

impl Contribution for IntegralPart {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.searched
    }

    fn start<'a>(&'a self, nonlinear: &[f64], _: &'a Rows<'a>, index: usize) -> Box<dyn Evaluate + 'a> {
        let (beta, omega) = self.speeds(nonlinear[0]);
        let known_start = self.known_start.get(index).copied().unwrap_or(false);
        match unit_gear(self.rated_deflection_rad, self.structure, beta, omega) {
            Ok(unit) => Box::new(IntegralPath { gear: Gear::new(&unit), state: None, known_start }),
            Err(_) => Box::new(Refused),
        }
    }
}

impl Evaluate for IntegralPath {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for (row, &theta) in stretch.deflection_rad.iter().enumerate() {
            let out = match &mut self.state {
                Some(state) => self.gear.step_after(state, theta, stretch.rows.period_s(stretch.range.start + row)),
                empty => self.gear.output(empty.insert(self.gear.start(theta))),
            };
            // A memory left by the past decays as its bound does: the bound is the column of the start.
            let start = match &self.state {
                Some(state) if !self.known_start => self.gear.start_spread(state),
                _ => 0.0,
            };
            columns.set(row, &[out.hysteresis, start]);
        }
    }
}

/// Columns of a refused point: the fit is then as bad as it can be.
struct Refused;

impl Evaluate for Refused {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for row in 0..stretch.deflection_rad.len() {
            columns.set(row, &[0.0, 0.0]);
        }
    }
}
