//! The base model put together: its parts as a problem, and its coefficients as a model.

use gmhm::{Elastic, Kernel, Law, Memory};

use crate::regression::base::{ElasticPart, IntegralPart, MasingPart, Play, Structure};
use crate::regression::columns::{Contribution, Correction, Offset};
use crate::regression::deflection_zeros::DeflectionZeros;
use crate::regression::error::EstimateError;
use crate::regression::problem::{Linear, Problem};
use crate::regression::rows;
use crate::regression::rows::Rows;

/// The parts of a base model of a structure.
pub struct Assembly {
    /// What was decided beforehand.
    pub structure: Structure,
    /// A, rad.
    pub rated_deflection_rad: f64,
    memory: MemoryPart,
    zeros: Option<DeflectionZeros>,
}

enum MemoryPart {
    Masing(MasingPart),
    Integral(IntegralPart),
}

static OFFSET: Offset = Offset;
static ELASTIC: ElasticPart = ElasticPart;

impl Assembly {
    /// The parts for these rows.
    pub fn new(
        structure: Structure,
        rated_deflection_rad: f64,
        rows: &[Rows<'_>],
        known_start: &[bool],
    ) -> Result<Self, EstimateError> {
        let memory = if structure.law == Law::Masing {
            MemoryPart::Masing(MasingPart::new(rated_deflection_rad, structure.play)?)
        } else {
            let rates = rows::rates_per_s(rows);
            MemoryPart::Integral(IntegralPart::new(rated_deflection_rad, structure, rates, known_start.to_vec())?)
        };
        Ok(Self { structure, rated_deflection_rad, memory, zeros: None })
    }

    /// The same parts for another rated deflection.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_rated_deflection(
        &self,
        rated_deflection_rad: f64,
        rows: &[Rows<'_>],
        known_start: &[bool],
    ) -> Result<Self, EstimateError> {
        let zeros = self.zeros.clone();
        Ok(Self { zeros, ..Self::new(self.structure, rated_deflection_rad, rows, known_start)? })
    }

    /// With zeros of the deflection to be found, as many as there are recordings or a single one.
    #[must_use]
    pub fn with_free_zeros(mut self, count: usize) -> Self {
        self.zeros = Some(DeflectionZeros::new(count, self.rated_deflection_rad));
        self
    }

    /// The zeros of the deflection that are to be found.
    pub fn free_zeros(&self) -> Option<&DeflectionZeros> {
        self.zeros.as_ref()
    }

    /// The problem of these rows. Gear columns: c1, c2, c3, then e and h (law `masing`) or α.
    pub fn problem<'a>(&'a self, rows: &'a [Rows<'a>]) -> Problem<'a> {
        let memory: &dyn Contribution = match &self.memory {
            MemoryPart::Masing(part) => part,
            MemoryPart::Integral(part) => part,
        };
        let corrections = self.zeros.iter().map(|z| z as &dyn Correction).collect();
        Problem { rows, corrections, contributions: vec![&OFFSET, &ELASTIC, memory] }
    }

    /// The zeros of the deflection among the nonlinear parameters, rad, and what is left of these.
    pub fn split<'n>(&self, nonlinear: &'n [f64]) -> (&'n [f64], &'n [f64]) {
        nonlinear.split_at(self.zeros.as_ref().map_or(0, |zeros| zeros.nonlinear().len()))
    }

    /// The zero of the deflection of a recording among the nonlinear parameters, rad; 0 where none is to be found.
    pub fn zero_rad(&self, nonlinear: &[f64], recording: usize) -> f64 {
        self.zeros.as_ref().map_or(0.0, |zeros| nonlinear[zeros.place(recording)])
    }

    /// The base model's coefficients in the gauge of the given ω: of (α, β, ω) a quasi-static loop fixes only e, h and β/ω.
    pub fn coefficients(&self, nonlinear: &[f64], linear: &Linear, gauge_omega_per_s: f64) -> (Elastic, Memory) {
        let gear = &linear.gear;
        let elastic = Elastic { c1_nm_per_rad: gear[0], c2_nm_per_rad3: gear[1], c3_nm_per_rad5: gear[2] };
        let (_, own) = self.split(nonlinear);
        let Structure { law, kernel, gate, play } = self.structure;
        let (alpha, beta_per_s, omega_per_s) = match &self.memory {
            MemoryPart::Masing(_) => from_cycle(gear[3], gear[4], gauge_omega_per_s),
            MemoryPart::Integral(part) => {
                let (beta, omega) = part.speeds(own[0]);
                if law == Law::Time {
                    (gear[3], beta, 0.0)
                } else {
                    let gauge = gauge_omega_per_s / omega;
                    let alpha = if kernel == Kernel::Deflection { gauge * gear[3] } else { gear[3] };
                    (alpha, gauge * beta, gauge_omega_per_s)
                }
            }
        };
        let reversal_play_rad = match (law, play) {
            (Law::Masing, Play::Fixed(width)) => width,
            (Law::Masing, Play::UpTo(_)) => own[0],
            _ => 0.0,
        };
        (elastic, Memory { law, kernel, gate, alpha, beta_per_s, omega_per_s, reversal_play_rad })
    }
}

/// (α, β, ω) of a cycle's e and h.
pub fn from_cycle(e: f64, h: f64, gauge_omega_per_s: f64) -> (f64, f64, f64) {
    let omega = gauge_omega_per_s;
    if h > 0.0 {
        let rho = e / h;
        (h * omega * (1.0 + rho * rho), rho * omega, omega)
    } else if e > 0.0 {
        // Without a loop the direction (β, ω) is that of β alone.
        (e * omega, omega, 0.0)
    } else {
        (0.0, 0.0, omega)
    }
}
