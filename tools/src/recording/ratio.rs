//! The ratio that two encoders of a gear show, beside the one that is given.

use super::Recording;
use super::error::{Mistake, RecordingError, RecordingProblem};

/// The angles go together so well (squared correlation) where both turn with the gear.
const TOGETHER: f64 = 0.99;
/// A ratio is a known mistake where it is this near to one, relative: at least; at most, where the twist blurs the slope of the angles.
const NEAR: [f64; 2] = [1e-3, 4e-3];
/// And where it leaves less than this share of the deflection that the ratio given makes.
const EXPLAINS: f64 = 0.5;

/// The slope of the motor-side angle over the output-side one, where they turn together, and how exactly they show it, relative.
fn shown(recording: &Recording) -> Option<(f64, f64)> {
    let (input, output) = (recording.theta_in_rad.as_deref()?, recording.theta_out_rad.as_deref()?);
    let (a, b) = (mean(input), mean(output));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (q_m, q_o) in input.iter().zip(output) {
        let (y, x) = (q_m - a, q_o - b);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    // What does not turn with the output, over what does.
    let apart = || (xx * yy / (xy * xy) - 1.0).max(0.0).sqrt();
    (xy * xy > TOGETHER * xx * yy && xx > 0.0).then(|| (xy / xx, (2.0 * apart()).clamp(NEAR[0], NEAR[1])))
}

/// The ratio that the angles show, as the whole number next to it where it is near to one.
pub fn shown_rounded(recording: &Recording) -> Option<f64> {
    shown(recording).map(|(ratio, near)| rounded(ratio, near))
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// Refuses two angles without a ratio, and with one that another, which is a known mistake beside it, explains away.
///
/// # Errors
/// [`RecordingProblem::NoRatio`], [`RecordingProblem::OtherRatio`].
pub fn check(recording: &Recording, given: Option<f64>) -> Result<(), RecordingError> {
    let (None, Some(input), Some(output)) =
        (&recording.deflection_rad, &recording.theta_in_rad, &recording.theta_out_rad)
    else {
        return Ok(());
    };
    let refuse = |problem| Err(RecordingError::of_file(&recording.name, problem));
    let found = shown(recording).map(|(ratio, near)| (rounded(ratio, near), near));
    let Some(given) = given else {
        return refuse(RecordingProblem::NoRatio { shown: found.map(|(ratio, _)| ratio) });
    };
    let Some((shown, near)) = found else { return Ok(()) };
    let sd = |ratio: f64| {
        let theta: Vec<f64> = input.iter().zip(output).map(|(q_m, q_o)| q_m / ratio - q_o).collect();
        let middle = mean(&theta);
        mean(&theta.iter().map(|x| (x - middle).powi(2)).collect::<Vec<_>>()).sqrt()
    };
    match mistake(given, shown, near) {
        Some(mistake) if sd(shown) < EXPLAINS * sd(given) => {
            refuse(RecordingProblem::OtherRatio { given, shown, mistake })
        }
        _ => Ok(()),
    }
}

/// The whole number next to a ratio, where it is one.
fn rounded(ratio: f64, near: f64) -> f64 {
    let whole = ratio.round();
    if whole != 0.0 && (ratio / whole - 1.0).abs() < near { whole } else { ratio }
}

fn mistake(given: f64, shown: f64, near: f64) -> Option<Mistake> {
    let factor = shown / given;
    let near = |value: f64| (factor / value - 1.0).abs() < near;
    let units = [180.0 / std::f64::consts::PI, std::f64::consts::TAU, 360.0];
    if near(1.0) {
        None
    } else if near(-1.0) {
        Some(Mistake::Sign)
    } else if units.iter().any(|unit| [*unit, -unit, 1.0 / unit, -1.0 / unit].into_iter().any(near)) {
        Some(Mistake::Unit)
    } else if (shown.abs() - given.abs()).abs() < 1.5 {
        Some(Mistake::OneOff)
    } else {
        (shown == shown.round()).then_some(Mistake::Other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gear of ratio 100 that turns through a revolution under a load.
    fn turning(scale_in: f64, scale_out: f64) -> Recording {
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let output: Vec<f64> = time_s.iter().map(|t| 3.0 * (0.4 * t).sin()).collect();
        let twist = output.iter().map(|q| 1e-3 * q.sin());
        let input = output.iter().zip(twist).map(|(q, twist)| scale_in * 100.0 * (q + twist)).collect();
        let output = output.iter().map(|q| scale_out * q).collect();
        Recording {
            time_s: time_s.into(),
            theta_in_rad: Some(input),
            theta_out_rad: Some(output),
            ..Recording::default()
        }
    }

    fn problem(recording: &Recording, ratio: Option<f64>) -> Option<RecordingProblem> {
        check(recording, ratio).err().map(|error| *error.problem)
    }

    #[test]
    fn mistakes_are_named() {
        let right = turning(1.0, 1.0);
        assert_eq!(problem(&right, Some(100.0)), None);
        assert_eq!(problem(&right, None), Some(RecordingProblem::NoRatio { shown: Some(100.0) }));
        let cases = [
            (right.clone(), 101.0, 100.0, Mistake::OneOff),
            (right.clone(), 50.0, 100.0, Mistake::Other),
            (turning(-1.0, 1.0), 100.0, -100.0, Mistake::Sign),
        ];
        for (recording, given, shown, mistake) in cases {
            assert_eq!(problem(&recording, Some(given)), Some(RecordingProblem::OtherRatio { given, shown, mistake }));
        }
        let degrees = problem(&turning(180.0 / std::f64::consts::PI, 1.0), Some(100.0));
        assert!(matches!(degrees, Some(RecordingProblem::OtherRatio { mistake: Mistake::Unit, .. })), "{degrees:?}");
    }

    #[test]
    fn a_locked_output_shows_no_ratio() {
        let mut locked = turning(1.0, 1.0);
        locked.theta_out_rad = Some((0..2000).map(|k| 1e-6 * f64::from(k % 7)).collect());
        assert_eq!(problem(&locked, Some(100.0)), None);
        assert_eq!(problem(&locked, None), Some(RecordingProblem::NoRatio { shown: None }));
    }
}
