//! A model of gear and terms as a contribution: what the torque is linear in as columns, the rest as nonlinear parameters, all by the core's own code.
//!
//! A recording is evaluated whole, for most terms look before and behind a row.

use std::sync::{Arc, Mutex, PoisonError};

use crate::kinds;
use crate::model::Model;
use crate::numerics::bounded::Bound;
use crate::numerics::extremes::largest;
use crate::physics::{Evaluation, PredictError, Signals};
use crate::recording::Recording;
use crate::regression::columns::{Column, Columns, Contribution, Evaluate, Nonlinear, Stretch};
use crate::regression::parameters::{self, FreeParameter, linear_together};
use crate::regression::problem::Linear;
use crate::regression::rows::Rows;
use crate::signal::recorded;

/// A model beside recordings.
pub struct ModelPart<'a> {
    model: Model,
    recordings: Vec<(&'a Recording, Signals<'a>)>,
    linear: Vec<FreeParameter>,
    moving: Vec<FreeParameter>,
    columns: Vec<Column>,
    nonlinear: Vec<Nonlinear>,
    /// The columns of each recording where they were evaluated last.
    last: Vec<Mutex<Option<Evaluated>>>,
}

/// Nonlinear parameters, and the columns there.
type Evaluated = (Vec<f64>, Arc<Vec<Vec<f64>>>);

/// A number without bounds is sought within so many steps that would show in the torque: within ten times what is plausible of gears. Derivatives are taken over a hundred-thousandth of
/// that range, which bridges the corners that a deflection moved by less leaves in a path of turning points.
const REACH: f64 = 1e4;

/// Friction is smoothed over this part of the largest velocity at least.
const SHARPEST: f64 = 1e-3;

impl<'a> ModelPart<'a> {
    /// The free numbers of a model beside recordings, from its values on.
    ///
    /// # Errors
    /// A model that cannot be evaluated on them.
    pub fn new(model: &Model, recordings: &'a [Recording], free: &[FreeParameter]) -> Result<Self, PredictError> {
        let signals = |recording: &'a Recording| (recording, recorded::signals(recording, model));
        Self::along(model, recordings.iter().map(signals).collect(), free)
    }

    /// The same along given signals of each recording.
    ///
    /// # Errors
    /// As there.
    pub fn along(
        model: &Model,
        recordings: Vec<(&'a Recording, Signals<'a>)>,
        free: &[FreeParameter],
    ) -> Result<Self, PredictError> {
        let speeds = recordings.iter().filter_map(|(_, signals)| signals.velocity_rad_per_s.as_deref());
        let fastest = speeds.map(largest).fold(0.0, f64::max);
        let together = linear_together(model, free);
        let of = |linear: bool| {
            free.iter().zip(&together).filter(move |(_, l)| **l == linear).map(|(parameter, _)| *parameter)
        };
        let (linear, moving): (Vec<_>, Vec<_>) = (of(true).collect(), of(false).collect());
        let column = |&parameter: &FreeParameter| {
            let (name, unit) = parameters::named(model, parameter);
            let bounded = parameters::bounds(model, parameter).0 >= 0.0 || parameters::resists(model, parameter);
            let bound = if bounded { Bound::NonNegative } else { Bound::Free };
            Column { name, unit, ..Column::of_gear("", "", bound) }
        };
        let nonlinear = |&parameter: &FreeParameter| {
            let (name, unit) = parameters::named(model, parameter);
            let (mut low, mut high) = parameters::bounds(model, parameter);
            let value = parameters::value(model, parameter);
            if matches!(parameter, FreeParameter::Term { key, .. } if key.name == kinds::SMOOTHING) {
                // Beyond the fastest movement, smoothed friction is viscous.
                (low, high) = (value.min(SHARPEST * fastest), value.max(fastest));
            }
            let reach = REACH * parameters::step(model, parameter);
            Nonlinear { name, unit, low: low.max(value - reach), high: high.min(value + reach), smooth: true }
        };
        let columns = linear.iter().map(column).chain([Column::known()]).collect();
        let nonlinear = moving.iter().map(nonlinear).collect();
        let last = recordings.iter().map(|_| Mutex::new(None)).collect();
        let part = Self { model: model.clone(), recordings, linear, moving, columns, nonlinear, last };
        let start = part.start_values();
        (0..part.recordings.len()).try_for_each(|index| part.evaluated(&start, index).map(|_| ()))?;
        Ok(part)
    }

    /// The nonlinear parameters of the model that it began with.
    pub fn start_values(&self) -> Vec<f64> {
        self.moving.iter().map(|parameter| parameters::value(&self.model, *parameter)).collect()
    }

    /// The model of given parameters.
    pub fn model(&self, nonlinear: &[f64], linear: &Linear) -> Model {
        self.with(nonlinear, &linear.gear)
    }

    fn with(&self, nonlinear: &[f64], linear: &[f64]) -> Model {
        let mut model = self.model.clone();
        let values = self.moving.iter().zip(nonlinear).chain(self.linear.iter().zip(linear));
        values.for_each(|(parameter, value)| parameters::put_freely(&mut model, *parameter, *value));
        model
    }

    fn evaluate(&self, model: &Model, index: usize) -> Result<Evaluation<'a>, PredictError> {
        let (recording, signals) = &self.recordings[index];
        let mut signals = signals.clone();
        let zero = model.gear.deflection_zero_rad - self.model.gear.deflection_zero_rad;
        if zero != 0.0 {
            let acceleration = signals.acceleration_rad_per_s2;
            signals = Signals::new(recording, model);
            signals.acceleration_rad_per_s2 = acceleration;
        }
        Evaluation::along(model, None, recording, signals, None)
    }

    /// The columns of a recording, what is known last.
    fn evaluated(&self, nonlinear: &[f64], index: usize) -> Result<Arc<Vec<Vec<f64>>>, PredictError> {
        let mut last = self.last[index].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((at, columns)) = &*last
            && at == nonlinear
        {
            return Ok(columns.clone());
        }
        let model = self.with(nonlinear, &[]);
        let evaluation = self.evaluate(&model, index)?;
        let total = |model: &Model| self.evaluate(model, index).map(|evaluation| evaluation.total().to_vec());
        let column = |parameter: &FreeParameter| parameters::derivative(&model, *parameter, &evaluation, total);
        let mut columns: Vec<Vec<f64>> = self.linear.iter().map(column).collect::<Result<_, _>>()?;
        let mut known = evaluation.total().to_vec();
        for (parameter, column) in self.linear.iter().zip(&columns) {
            let value = parameters::value(&model, *parameter);
            known.iter_mut().zip(column).for_each(|(known, x)| *known -= value * x);
        }
        columns.push(known);
        let columns = Arc::new(columns);
        *last = Some((nonlinear.to_vec(), columns.clone()));
        Ok(columns)
    }
}

impl Contribution for ModelPart<'_> {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn nonlinear(&self) -> &[Nonlinear] {
        &self.nonlinear
    }

    fn start<'s>(&'s self, nonlinear: &[f64], _: &'s Rows<'s>, index: usize) -> Box<dyn Evaluate + 's> {
        Box::new(Whole(self.evaluated(nonlinear, index).unwrap_or_default()))
    }

    fn start_sum<'s>(
        &'s self,
        nonlinear: &[f64],
        coefficients: &[f64],
        _: &'s Rows<'s>,
        index: usize,
    ) -> Option<Box<dyn Evaluate + 's>> {
        let evaluation = self.evaluate(&self.with(nonlinear, &coefficients[..self.linear.len()]), index).ok()?;
        Some(Box::new(Whole(Arc::new(vec![evaluation.total().to_vec()]))))
    }
}

/// Columns of a whole recording; none where the model was refused.
struct Whole(Arc<Vec<Vec<f64>>>);

impl Evaluate for Whole {
    fn fill(&mut self, stretch: &Stretch<'_>, columns: &mut Columns<'_>) {
        for j in 0..columns.count() {
            let rows = &mut columns.column(j)[..stretch.range.len()];
            match self.0.get(j) {
                Some(values) => rows.copy_from_slice(&values[stretch.range.clone()]),
                None => rows.fill(0.0),
            }
        }
    }
}
