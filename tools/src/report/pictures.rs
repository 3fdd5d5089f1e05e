//! Recordings and models as they are: loops, and every channel over time.

use std::path::Path;

use super::page::{Page, Provenance, Section, Verdict};
use super::plot::{Curve, Drawing, Figure, Role, Style};
use super::{capitalised, figures};
use crate::fit::verdict::Grade;
use crate::model::Model;
use crate::physics::{PredictError, predict};
use crate::recording::{Recording, Samples, TorqueUnit};

/// What is drawn: a recording, or the rated loop of a model.
#[derive(Debug, Clone)]
pub struct Shown {
    recording: Recording,
    is_model: bool,
}

/// Points of the loop of a model.
const POINTS: usize = 2000;

impl Shown {
    /// A recording.
    pub fn recording(recording: Recording) -> Self {
        Shown { recording, is_model: false }
    }

    /// The loop of a model at its rated deflection, or at one that is asked for: two sines of 0.1 Hz from rest, without its terms.
    ///
    /// # Errors
    /// A model that has no loop, or no rated deflection.
    pub fn model(path: &Path, model: &Model, asked_rad: Option<f64>) -> Result<Self, PredictError> {
        let base = Model { terms: Vec::new(), ..model.clone() };
        let rated_rad = asked_rad.or(model.gear.rated_deflection_rad).unwrap_or(0.0);
        let time_s: Vec<f64> = (0..=POINTS).map(|k| 20.0 * k as f64 / POINTS as f64).collect();
        let sine = |t: &f64| model.gear.deflection_zero_rad + rated_rad * (std::f64::consts::TAU * 0.1 * t).sin();
        let mut recording = Recording {
            name: path.display().to_string(),
            deflection_rad: Some(time_s.iter().map(sine).collect()),
            time_s: time_s.into(),
            torque_unit: model.torque_unit,
            ..Recording::default()
        };
        recording.torque =
            Some(predict(&base, Some(rated_rad).filter(|rated| *rated > 0.0), &recording)?.torque.into());
        Ok(Shown { recording, is_model: true })
    }
}

const ROLES: [Role; 5] = [Role::Measured, Role::Model, Role::Second, Role::Third, Role::Fourth];

/// The loop of everything that has one; without any, torques over time.
pub fn drawing(shown: &[Shown]) -> Drawing {
    loops(shown).unwrap_or_else(|| {
        let torque = |shown: &Shown| shown.recording.torque.clone();
        let unit = shown.first().map_or(TorqueUnit::NewtonMetre, |shown| shown.recording.torque_unit);
        over_time(shown, unit.quantity(), unit.symbol(), 1.0, torque)
    })
}

fn loops(shown: &[Shown]) -> Option<Drawing> {
    let with_loop: Vec<&Shown> =
        shown.iter().filter(|s| s.recording.deflection_rad.is_some() && s.recording.torque.is_some()).collect();
    let unit = with_loop.first()?.recording.torque_unit;
    let curves = with_loop.iter().enumerate().filter_map(|(at, shown)| {
        let (theta, torque) = (shown.recording.deflection_rad.as_deref()?, shown.recording.torque.as_deref()?);
        let style = if shown.is_model { Style::Line } else { Style::Dots };
        Some(Curve::new(&shown.recording.name, ROLES[at % ROLES.len()], theta, 1e3, torque).styled(style))
    });
    let (title, label) = (format!("{} over deflection", unit.quantity()), figures::Abscissa::DEFLECTION.label);
    let figure = Figure::of(title, label, format!("{} in {}", unit.quantity(), unit.symbol()), curves);
    Some(Figure { by_row: shown.len() == 1, ..figure }.draw())
}

fn over_time(
    shown: &[Shown],
    what: &str,
    unit: &str,
    scale: f64,
    channel: impl Fn(&Shown) -> Option<Samples>,
) -> Drawing {
    let curves = shown.iter().filter(|shown| !shown.is_model).enumerate().filter_map(|(at, shown)| {
        let values: Vec<f64> = channel(shown)?.iter().map(|x| scale * x).collect();
        let role = ROLES[at % ROLES.len()];
        Some(Curve::new(&shown.recording.name, role, &shown.recording.time_s, 1.0, &values).styled(Style::Line))
    });
    let figure = Figure::of(format!("{what} over time"), "time in s", format!("{what} in {unit}"), curves);
    Figure { by_row: shown.len() == 1, ..figure }.draw()
}

/// All figures on one page.
pub fn page(shown: &[Shown], provenance: Provenance) -> Page {
    let names: Vec<&str> = shown.iter().map(|shown| shown.recording.name.as_str()).collect();
    let mut sections = Vec::new();
    if let Some(drawing) = loops(shown) {
        sections.push(
            Section::new("Loop").figure(drawing, "Recordings as dots, models as lines at their rated deflection."),
        );
    }
    type Channel = fn(&Recording) -> &Option<Samples>;
    let torque_unit = shown.first().map_or(TorqueUnit::NewtonMetre, |shown| shown.recording.torque_unit);
    let channels: [(&str, &str, f64, Channel); 7] = [
        ("torque", torque_unit.symbol(), 1.0, |r| &r.torque),
        ("simulated torque", "N·m", 1.0, |r| &r.torque_sim_nm),
        ("deflection", "mrad", 1e3, |r| &r.deflection_rad),
        ("motor-side angle", "rad", 1.0, |r| &r.theta_in_rad),
        ("output-side angle", "rad", 1.0, |r| &r.theta_out_rad),
        ("output velocity", "rad/s", 1.0, |r| &r.velocity_out_rad_per_s),
        ("temperature", "°C", 1.0, |r| &r.temperature_c),
    ];
    for (what, unit, scale, channel) in channels {
        let there = |shown: &&Shown| !shown.is_model && channel(&shown.recording).is_some();
        if shown.iter().any(|shown| there(&shown)) {
            let drawing = over_time(shown, what, unit, scale, |shown| channel(&shown.recording).clone());
            sections.push(Section::new(capitalised(what)).figure(drawing, format!("{} over time.", capitalised(what))));
        }
    }
    let rows: usize = shown.iter().filter(|shown| !shown.is_model).map(|shown| shown.recording.len()).sum();
    let verdict = Verdict { grade: Grade::Good, sentence: format!("{rows} rows recorded."), reasons: Vec::new() };
    Page { title: names.join(", "), verdict, sections, provenance }
}
