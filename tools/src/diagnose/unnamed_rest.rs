//! A residual that is too large and too smooth to be noise, and in which neither a kind nor a curve was found.

use crate::diagnose::naming::{DiagnosisVerdict, EffectVerdict};
use crate::regression::dataset::Dataset;

/// A residual is smooth if the mean square of its steps from row to row is less than this part of twice its own: 1 for white noise, 0.018 and more in 200 nulls of coloured noise.
const MOST_OF_SMOOTH: f64 = 0.01;

impl Dataset<'_> {
    /// Says `unknown` over time, without a term, where nothing was found beside a base that is far from its machine and leaves a smooth residual.
    pub(super) fn with_unnamed_rest(&self, verdict: &mut DiagnosisVerdict) {
        let residual = &verdict.base.residual;
        let rough = self.roughness(residual);
        if verdict.mismatch || rough > MOST_OF_SMOOTH || !self.is_far_from(&verdict.base) {
            return;
        }
        let gain = self.counted() as f64 / rough.max(f64::EPSILON);
        let over_time = self.curve("time", gain, residual.clone());
        verdict.effects.push(EffectVerdict { share: 1.0, ..EffectVerdict::unnamed(gain, over_time) });
        verdict.mismatch = true;
        verdict.noise_part = rough.sqrt();
    }

    /// The mean square of the steps of a line from row to row, over twice its mean square.
    fn roughness(&self, line: &[f64]) -> f64 {
        let (mut steps, mut squares) = (0.0, 0.0);
        for span in &self.spans {
            for pair in line[span.clone()].windows(2) {
                steps += (pair[1] - pair[0]).powi(2);
                squares += pair[0].powi(2) + pair[1].powi(2);
            }
        }
        steps / squares.max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::recording::Recording;

    #[test]
    fn white_noise_is_rough_and_a_wave_of_many_rows_is_smooth() {
        let noise = |row: f64| (row * 12.9898).sin() * (row * row * 0.078_233).cos();
        let rows: Vec<f64> = (0..4000).map(f64::from).collect();
        let recordings = [Recording {
            name: "motor".into(),
            torque: Some(rows.clone().into()),
            theta_in_rad: Some(rows.clone().into()),
            time_s: rows.clone().into(),
            ..Recording::default()
        }];
        let model = Model::default();
        let dataset = Dataset::new(&recordings, &model).unwrap();
        let roughness =
            |line: &dyn Fn(f64) -> f64| dataset.roughness(&rows.iter().map(|row| line(*row)).collect::<Vec<f64>>());
        assert!((roughness(&noise) - 1.0).abs() < 0.2, "{}", roughness(&noise));
        // 1 − cos 0.05
        assert!((roughness(&|row| (0.05 * row).sin()) - 0.00125).abs() < 1e-5);
    }
}
