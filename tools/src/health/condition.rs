//! One state of the gear: what a recording or a model file tells, with standard deviations.

use std::path::{Path, PathBuf};

use gmhm::{Kernel, Law};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::HealthError;
use super::catalogue::{Catalogue, Rating, catalogue};
use crate::fit::Fit;
use crate::model::{Model, key_per};
use crate::recording::Recording;
use crate::regression::assembly::from_cycle;

/// A number that is followed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Quantity {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; absent where there is none.
    pub sd: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// A state of the gear.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Condition {
    /// The recording or model.
    pub name: String,
    /// Mean temperature, °C.
    pub temperature_c: Option<f64>,
    /// Error left, N·m rms; of a recording.
    pub rms: Option<f64>,
    /// Parameters, then catalogue figures, the same ones in each condition.
    pub quantities: Vec<Quantity>,
}

/// What of a parameter the recordings say.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Known {
    /// A place in the covariance.
    Estimated(usize),
    /// Held at a bound.
    Held,
    /// Nothing.
    Open,
}

/// A gear with what is known of its parameters.
#[derive(Debug, Clone)]
pub struct Gear {
    /// The recording or model.
    pub name: String,
    /// The model.
    pub model: Model,
    temperature_c: Option<f64>,
    rms: Option<f64>,
    /// Name, unit in N·m, value of each parameter that the law lets a recording tell.
    coordinates: Vec<(&'static str, &'static str, f64)>,
    known: Vec<Known>,
    covariance: DMatrix<f64>,
}

/// What a fit says of uncertainty: name, standard deviation, at its bound.
struct Stated {
    parameters: Vec<(String, Option<f64>, bool)>,
    correlated: Vec<String>,
    correlation: Vec<Vec<f64>>,
}

impl Gear {
    /// As a fit of a recording found it.
    pub fn of_fit(recording: &Recording, fit: &Fit) -> Self {
        let stated = Stated {
            parameters: fit.uncertainty.parameters.iter().map(|p| (p.name.to_string(), p.sd, p.at_bound)).collect(),
            correlated: fit.uncertainty.correlated.iter().map(ToString::to_string).collect(),
            correlation: fit.uncertainty.correlation.clone(),
        };
        let mean = |column: &[f64]| column.iter().sum::<f64>() / column.len() as f64;
        let mut gear = Self::new(recording.name.clone(), fit.model.clone(), Some(&stated));
        gear.temperature_c = recording.temperature_c.as_deref().map(mean);
        gear.rms = Some(fit.rms);
        gear
    }

    /// As a model file has it, with what `fit --json` wrote beside it.
    ///
    /// # Errors
    /// A model without a gear; a file of that name that is something else.
    pub fn of_model(path: &Path, model: &Model) -> Result<Self, HealthError> {
        let name = path.display().to_string();
        if model.elastic.is_none() || model.memory.is_none() || model.gear.rated_deflection_rad.is_none() {
            return Err(HealthError::NoGear(name));
        }
        let beside = path.with_extension("json");
        let stated = if beside.is_file() { Some(Stated::read(&beside)?) } else { None };
        Ok(Self::new(name, model.clone(), stated.as_ref()))
    }

    fn new(name: String, model: Model, stated: Option<&Stated>) -> Self {
        let coordinates = coordinates(&model);
        let mut places = Vec::new();
        let known = coordinates
            .iter()
            .map(|(name, ..)| {
                let name = key_per(name, model.torque_unit);
                let parameter = stated.and_then(|s| s.parameters.iter().find(|p| p.0 == name));
                let place = stated.and_then(|s| s.correlated.iter().position(|n| *n == name));
                match (parameter, place) {
                    (Some((_, Some(sd), _)), Some(place)) => {
                        places.push((place, *sd));
                        Known::Estimated(places.len() - 1)
                    }
                    (Some((_, _, true)), _) => Known::Held,
                    _ => Known::Open,
                }
            })
            .collect();
        let correlation = |i: usize, j: usize| stated.map_or(0.0, |s| s.correlation[i][j]);
        let covariance = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            correlation(places[i].0, places[j].0) * places[i].1 * places[j].1
        });
        Self { name, model, temperature_c: None, rms: None, coordinates, known, covariance }
    }

    /// A, rad.
    pub fn rated_deflection_rad(&self) -> f64 {
        self.model.gear.rated_deflection_rad.unwrap_or(f64::NAN)
    }

    /// Law, kernel and gate in words.
    pub fn structure(&self) -> String {
        self.model.memory.map_or_else(String::new, |memory| {
            crate::fit::select::name(&crate::regression::base::Structure::of(&memory))
        })
    }

    /// Multiplies all standard deviations.
    pub fn widen(&mut self, factor: f64) {
        self.covariance *= factor * factor;
    }

    /// Parameters and catalogue figures with standard deviations.
    ///
    /// # Errors
    /// What prediction refuses.
    pub fn condition(&self, rating: &Rating) -> Result<Condition, HealthError> {
        let unit = self.model.torque_unit;
        let mut quantities: Vec<Quantity> = self
            .coordinates
            .iter()
            .zip(&self.known)
            .map(|((name, si, value), known)| {
                let sd = match known {
                    Known::Estimated(place) => Some(self.covariance[(*place, *place)].sqrt()),
                    _ => None,
                };
                Quantity { name, value: *value, sd, unit: unit.of_parameter(si).into_owned() }
            })
            .collect();
        let own = figures(&self.catalogue(&self.model, rating)?);
        let slopes = self.slopes(rating)?;
        for (index, (name, unit_si, value)) in own.into_iter().enumerate() {
            let sd = self.sd_of(&slopes.iter().map(|slope| slope[index]).collect::<Vec<_>>());
            quantities.push(Quantity { name, value, sd, unit: unit.of_parameter(unit_si).into_owned() });
        }
        Ok(Condition { name: self.name.clone(), temperature_c: self.temperature_c, rms: self.rms, quantities })
    }

    /// The figures of a model near that of the gear.
    fn catalogue(&self, model: &Model, rating: &Rating) -> Result<Catalogue, HealthError> {
        let found = catalogue(model, rating)?;
        if found.lost_motion_rad.is_finite() {
            return Ok(found);
        }
        let (torque, unit) = (rating.rated_torque, self.model.torque_unit.symbol());
        Err(HealthError::NoCycle { name: self.name.clone(), torque, unit })
    }

    /// Derivatives of the figures by each parameter.
    fn slopes(&self, rating: &Rating) -> Result<Vec<[f64; 5]>, HealthError> {
        let values: Vec<f64> = self.coordinates.iter().map(|c| c.2).collect();
        let a = self.rated_deflection_rad();
        let stiffness = rating.rated_torque / a;
        let mut slopes = Vec::new();
        for k in 0..values.len() {
            // A step that changes the torque at A by a thousandth, or a parameter of another unit by a thousandth of itself.
            let step = match self.coordinates[k].1 {
                "N·m/rad" => 1e-3 * stiffness,
                "N·m/rad³" => 1e-3 * stiffness / a.powi(2),
                "N·m/rad⁵" => 1e-3 * stiffness / a.powi(4),
                _ => 1e-3 * values[k].abs(),
            };
            let low = if k >= 3 { values[k].min(step) } else { step };
            let at = |value: f64| {
                let mut moved = values.clone();
                moved[k] = value;
                self.catalogue(&rebuilt(&self.model, &moved), rating).map(|c| figures(&c).map(|f| f.2))
            };
            // A figure may stop to exist on one side, at the edge of the calibrated range.
            let (above, below) = (at(values[k] + step)?, at(values[k] - low)?);
            slopes.push(std::array::from_fn(|i| (above[i] - below[i]) / (step + low)));
        }
        Ok(slopes)
    }

    fn sd_of(&self, gradient: &[f64]) -> Option<f64> {
        if self.known.iter().zip(gradient).any(|(known, slope)| *known == Known::Open && *slope != 0.0) {
            return None;
        }
        let mut own = DVector::zeros(self.covariance.nrows());
        for (known, slope) in self.known.iter().zip(gradient) {
            if let Known::Estimated(place) = known {
                own[*place] = *slope;
            }
        }
        Some((own.transpose() * &self.covariance * &own)[(0, 0)].max(0.0).sqrt())
    }

    /// Values of the estimated parameters.
    fn estimates(&self) -> DVector<f64> {
        let estimated =
            self.coordinates.iter().zip(&self.known).filter(|(_, known)| matches!(known, Known::Estimated(_)));
        DVector::from_iterator(self.covariance.nrows(), estimated.map(|(c, _)| c.2))
    }
}

/// The factor by which pairs of fits of halves of a recording differ beyond their standard deviations; 1 where they do not, at the level of 1 %.
pub fn widening(halves: &[(Gear, Gear)]) -> f64 {
    let (mut sum, mut freedom) = (0.0, 0);
    for (a, b) in halves.iter().filter(|(a, b)| a.known == b.known) {
        let difference = a.estimates() - b.estimates();
        let Some(factor) = (&a.covariance + &b.covariance).cholesky() else { continue };
        sum += difference.dot(&factor.solve(&difference));
        freedom += difference.len();
    }
    let usual = ChiSquared::new(freedom.max(1) as f64).map_or(f64::INFINITY, |d| d.inverse_cdf(0.99));
    if freedom > 0 && sum > usual { (sum / freedom as f64).sqrt() } else { 1.0 }
}

/// Whether all gears are of one structure, unit and rated deflection.
pub fn comparable(gears: &[Gear]) -> Result<(), HealthError> {
    let first = &gears[0];
    for gear in gears {
        let same_size = (gear.rated_deflection_rad() / first.rated_deflection_rad() - 1.0).abs() < 1e-9;
        let what = match gear {
            g if g.model.torque_unit != first.model.torque_unit => "the unit of the torque",
            g if g.structure() != first.structure() => "the law, kernel or gate",
            _ if !same_size => "the rated deflection",
            _ => continue,
        };
        return Err(HealthError::Differs { name: gear.name.clone(), first: first.name.clone(), what });
    }
    Ok(())
}

/// The parameters that recordings can tell under a law: name, unit, value.
fn coordinates(model: &Model) -> Vec<(&'static str, &'static str, f64)> {
    let elastic =
        model.elastic.unwrap_or(gmhm::Elastic { c1_nm_per_rad: 0.0, c2_nm_per_rad3: 0.0, c3_nm_per_rad5: 0.0 });
    let memory = model.memory.unwrap_or_default();
    let mut all = vec![
        ("c1_nm_per_rad", "N·m/rad", elastic.c1_nm_per_rad),
        ("c2_nm_per_rad3", "N·m/rad³", elastic.c2_nm_per_rad3),
        ("c3_nm_per_rad5", "N·m/rad⁵", elastic.c3_nm_per_rad5),
    ];
    match (memory.law, memory.kernel) {
        (Law::Time, Kernel::Deflection) => {
            all.extend([("alpha", "N·m/(rad·s)", memory.alpha), ("beta_per_s", "1/s", memory.beta_per_s)]);
        }
        (Law::Time, Kernel::Rate) => {
            all.extend([("alpha", "N·m/rad", memory.alpha), ("beta_per_s", "1/s", memory.beta_per_s)]);
        }
        (Law::Phase, Kernel::Rate) => all.extend([("alpha", "N·m/rad", memory.alpha), ("rho", "1", memory.rho())]),
        _ => all.extend([("e", "N·m/rad", memory.e()), ("h", "N·m/rad", memory.h())]),
    }
    all
}

/// The model with other values of its coordinates.
fn rebuilt(model: &Model, values: &[f64]) -> Model {
    let mut model = model.clone();
    model.elastic =
        Some(gmhm::Elastic { c1_nm_per_rad: values[0], c2_nm_per_rad3: values[1], c3_nm_per_rad5: values[2] });
    if let Some(memory) = &mut model.memory {
        let omega = if memory.omega_per_s == 0.0 { 1.0 } else { memory.omega_per_s };
        match (memory.law, memory.kernel) {
            (Law::Time, _) => (memory.alpha, memory.beta_per_s) = (values[3], values[4]),
            (Law::Phase, Kernel::Rate) => (memory.alpha, memory.beta_per_s) = (values[3], values[4] * omega),
            _ => (memory.alpha, memory.beta_per_s, memory.omega_per_s) = from_cycle(values[3], values[4], omega),
        }
    }
    model
}

const ARCMIN: f64 = 180.0 * 60.0 / std::f64::consts::PI;

fn figures(c: &Catalogue) -> [(&'static str, &'static str, f64); 5] {
    [
        ("K1", "N·m/rad", c.k1),
        ("K2", "N·m/rad", c.k2),
        ("K3", "N·m/rad", c.k3),
        ("hysteresis_loss_arcmin", "arcmin", c.hysteresis_loss_rad * ARCMIN),
        ("lost_motion_arcmin", "arcmin", c.lost_motion_rad * ARCMIN),
    ]
}

impl Stated {
    fn read(path: &Path) -> Result<Self, HealthError> {
        #[derive(serde::Deserialize)]
        struct Parameter {
            name: String,
            sd: Option<f64>,
            at_bound: bool,
        }
        #[derive(serde::Deserialize)]
        struct File {
            parameters: Vec<Parameter>,
            correlated: Vec<String>,
            correlation: Vec<Vec<f64>>,
        }
        let fault = |problem: String| HealthError::Uncertainty { path: PathBuf::from(path), problem };
        let text = std::fs::read_to_string(path).map_err(|e| fault(format!("cannot be read: {e}")))?;
        let file: File =
            serde_json::from_str(&text).map_err(|e| fault(format!("is not what `gmhm fit --json` writes: {e}")))?;
        let count = file.correlated.len();
        if file.correlation.len() != count || file.correlation.iter().any(|row| row.len() != count) {
            return Err(fault(format!("`correlation` has to be {count} rows of {count} numbers")));
        }
        Ok(Self {
            parameters: file.parameters.into_iter().map(|p| (p.name, p.sd, p.at_bound)).collect(),
            correlated: file.correlated,
            correlation: file.correlation,
        })
    }
}
