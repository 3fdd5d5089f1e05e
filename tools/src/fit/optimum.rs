//! The optimum of recordings: prepared, a structure chosen, refined.

use gmhm::Law;

use crate::fit::options::{FitOptions, Method};
use crate::fit::prepare::Prepared;
use crate::fit::pso;
use crate::fit::refine;
use crate::fit::refine::Weighted;
use crate::fit::select;
use crate::fit::select::Candidate;
use crate::fit::thresholds::THRESHOLDS;
use crate::fit::zeros;
use crate::fit::zeros::Zeros;
use crate::numerics::autoregression::Noise;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::regression::assembly::Assembly;
use crate::regression::error::EstimateError;
use crate::regression::heldout;
use crate::regression::rows::{Rows, Spread};

/// Where the search for the parameters of recordings ended.
pub struct Optimum<'a> {
    /// The recordings.
    pub prepared: Prepared<'a>,
    /// Structures tried, the chosen one marked.
    pub selection: Vec<Candidate>,
    /// Rows that the selection looked at.
    pub selection_rows: usize,
    /// The chosen structure's parts.
    pub assembly: Assembly,
    /// The fit.
    pub weighted: Weighted,
    /// The ω in which α and β are written.
    pub gauge_omega_per_s: f64,
    /// Evaluations of the selection.
    pub evaluations: usize,
}

impl<'a> Optimum<'a> {
    /// Of these recordings. A rated deflection that is the largest seen is the largest beside the zeros found, so these are taken off and the search begins anew until it stays.
    ///
    /// # Errors
    /// As [`fit`](crate::fit::fit()).
    pub fn of(
        recordings: &'a [Recording],
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Self, EstimateError> {
        let (mut known, mut round) = (None, 0);
        loop {
            let found = Self::search(Prepared::new(recordings, options, known)?, options, progress)?;
            let Prepared { rows, gear, rated_deflection_rad, zeros, .. } = &found.prepared;
            let given = options.rated_deflection_rad.or(gear.rated_deflection_rad);
            let zero_rad = |recording: usize| found.assembly.zero_rad(&found.weighted.polished.nonlinear, recording);
            let largest = zeros::largest(rows, zero_rad);
            let settled = given.is_some() || (largest - rated_deflection_rad).abs() <= zeros::SETTLED * largest;
            if settled || round == zeros::ROUNDS {
                return Ok(found);
            }
            round += 1;
            let rad = zeros.rad.iter().enumerate().map(|(k, zero)| zero + zero_rad(k)).collect();
            known = Some(Zeros { rad, free: found.assembly.split(&found.weighted.polished.nonlinear).0.len() });
        }
    }

    fn search(
        mut prepared: Prepared<'a>,
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Self, EstimateError> {
        let structures = prepared.structures(options);
        let Prepared { rows, rated_deflection_rad, torque_nm, start, zeros, .. } = &mut prepared;
        let rated = *rated_deflection_rad;
        let (selection_rows, (mut selection, evaluations)) = {
            let spread = Spread::over(rows, THRESHOLDS.selection_rows);
            let looked_at = spread.of(rows);
            let table = select::table(&structures, rated, &looked_at, &start.known, options.seed, progress)?;
            (looked_at.iter().map(Rows::len).sum(), table)
        };
        let chosen = selection.iter().position(|c| c.chosen).unwrap_or(0);
        let structure = selection[chosen].structure;
        let from = selection[chosen].nonlinear.clone();
        if structure.law != Law::Masing {
            refine::free_start(rows, start, structure, rated, &from)?;
        }
        let gauge = options.start.as_ref().and_then(|m| m.memory).map_or(1.0, |m| m.omega_per_s.abs());
        let mut gauge_omega_per_s = if gauge > 0.0 { gauge } else { 1.0 };
        let mut assembly = Assembly::new(structure, rated, rows, &start.known)?;
        let weighted = match options.method {
            Method::Auto => {
                let refined = refine::refine(assembly, rows, &start.known, from, zeros.free, progress)?;
                assembly = refined.assembly;
                refined.weighted
            }
            Method::Pso => {
                let allowed = options.evaluations.unwrap_or(pso::EVALUATIONS);
                let found = pso::search(&assembly, rows, *torque_nm, allowed, options.seed, progress)?;
                gauge_omega_per_s = found.omega_per_s.max(f64::MIN_POSITIVE);
                let problem = assembly.problem(rows);
                let noise = refine::noise_of(&problem, &found.polished);
                let heldout_rms = heldout::heldout(&problem, &found.polished.nonlinear, None).rms;
                let prewhitened = noise.iter().all(Noise::is_white);
                Weighted { polished: found.polished, noise, prewhitened, heldout_rms }
            }
        };
        for candidate in &mut selection {
            candidate.chosen = candidate.structure == assembly.structure;
        }
        Ok(Self { prepared, selection, selection_rows, assembly, weighted, gauge_omega_per_s, evaluations })
    }
}
