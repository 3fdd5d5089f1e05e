//! The pictures of the demo.

use gmhm::Gear;

use super::Demo;
use crate::recording::TorqueUnit;
use crate::report::figures;
use crate::report::plot::{Drawing, Role};

impl Demo {
    /// File names and SVG of the loop, of its decomposition into f and z, and of what each model leaves.
    pub fn plots(&self) -> [(&'static str, Drawing); 3] {
        let unit = TorqueUnit::NewtonMetre;
        let recording = &self.built_in.recording;
        let deflection = recording.deflection_rad.as_deref().unwrap_or_default();
        let torque = recording.torque.as_deref().unwrap_or_default();
        let gear = Gear::<f64>::new(&self.params);
        let mut state = gear.start::<16>(deflection.first().copied().unwrap_or(0.0));
        let (elastic, hysteresis): (Vec<f64>, Vec<f64>) =
            deflection.iter().map(|x| gear.step(&mut state, *x)).map(|out| (out.elastic, out.hysteresis)).unzip();
        let baselines =
            [("linear spring", Role::Third, &self.spring_nm[..]), ("two lines", Role::Second, &self.lines_nm[..])];
        let models = [baselines[0], baselines[1], ("GMHM, core in f32", Role::Model, &self.drive_nm[..])];
        [
            (
                "loop.svg",
                figures::hysteresis_loop(
                    "Hysteresis loop (synthetic recording of the published gear)",
                    deflection,
                    torque,
                    &models,
                    unit,
                ),
            ),
            (
                "decomposition.svg",
                figures::decomposition(
                    "Identified gear: elastic and hysteresis torque",
                    deflection,
                    &elastic,
                    &hysteresis,
                    unit,
                ),
            ),
            (
                "residual.svg",
                figures::residual("Torque error left (synthetic recording)", deflection, torque, &models, unit),
            ),
        ]
    }
}
