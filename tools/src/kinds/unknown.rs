//! Structure that no kind explains: an empirical curve over a coordinate.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draft::Draft;
use super::experiment::Experiment;
use super::measures::Measures;
use super::ranges::Ranges;
use super::{Family, Kind, UNKNOWN};
use crate::model::{Model, Term};

/// The coordinates that a hidden curve may have.
const COORDINATES: &[&str] = &[
    "deflection",
    "motor_angle",
    "output_angle",
    "output_velocity",
    "torque",
    "deflection_rate",
    "acceleration",
    "temperature",
    "time",
];

/// Knots of a hidden curve.
const KNOTS: usize = 9;

/// Kind `unknown`.
pub struct Unknown;

impl Kind for Unknown {
    fn name(&self) -> &'static str {
        UNKNOWN
    }

    fn family(&self) -> Family {
        Family::Unknown
    }

    fn experiments(&self) -> &'static [Experiment] {
        &[]
    }

    /// It is no candidate: curves of its own describe what no candidate explains.
    fn candidates(&self, _ranges: &Ranges, _model: &Model) -> Vec<Term> {
        Vec::new()
    }

    fn hidden_shapes(&self) -> &'static [&'static str] {
        COORDINATES
    }

    /// A smooth random curve over the range of a coordinate.
    fn draft(&self, shape: &str, measures: &Measures, random: &mut ChaCha8Rng) -> Draft {
        let about_zero = |largest: f64| (-largest, largest);
        let (low, high) = match shape {
            "motor_angle" => measures.motor_angle,
            "output_angle" => measures.output_angle,
            "output_velocity" => about_zero(measures.velocity),
            "torque" => about_zero(measures.torque_nm),
            "deflection_rate" => about_zero(measures.deflection_rate),
            "acceleration" => about_zero(measures.acceleration),
            "temperature" => measures.temperature_c,
            "time" => (0.0, measures.duration_s),
            _ => about_zero(measures.deflection_rad),
        };
        let knots = (0..KNOTS).map(|k| low + (high - low) * k as f64 / (KNOTS - 1) as f64).collect();
        let values = (0..KNOTS).map(|_| random.random_range(-1.0..1.0)).collect();
        Draft::new(self.name()).text("coordinate", shape).fixed_list("knots", knots).list("values_nm", values)
    }
}
