//! Model files to TOML: what reads back to the same model bit for bit, with units in words.

use std::fmt::Write;

use gmhm::{Kernel, Law};

use super::unit::{key_per, per_ampere};
use super::{Base, Model, TermValue, TorqueSide};
use crate::recording::TorqueUnit;

impl Model {
    /// The model file's text.
    pub fn to_toml(&self) -> String {
        let mut page = Page { text: String::new(), unit: self.torque_unit };
        page.line("format = 1");
        page.text("name", &self.name, "");
        page.section("[gear]");
        let gear = &self.gear;
        page.optional("ratio", gear.ratio, "motor turns per output turn; negative where the gear reverses");
        match gear.torque_side {
            TorqueSide::Motor => page.text("torque_side", "motor", "torque taken on the motor side"),
            TorqueSide::Output => page.text("torque_side", "output", "torque taken by a sensor on the output side"),
        }
        page.optional("rated_deflection_rad", gear.rated_deflection_rad, "amplitude of the calibrated cycle, rad");
        page.number("deflection_zero_rad", gear.deflection_zero_rad, "subtracted from every deflection, rad");
        if gear.base == Base::Simulation {
            page.text("base", "simulation", "the terms are added to column torque_sim_nm of each recording");
        }
        if self.torque_unit == TorqueUnit::Ampere && !self.shows_unit() {
            page.text("torque_unit", "a", "torques are counted in amperes of motor current");
        }
        if let Some(elastic) = &self.elastic {
            page.section("[elastic]");
            let torque = if self.torque_unit == TorqueUnit::Ampere { "A" } else { "N·m" };
            page.number("c1_nm_per_rad", elastic.c1_nm_per_rad, &format!("{torque}/rad"));
            page.number("c2_nm_per_rad3", elastic.c2_nm_per_rad3, &format!("{torque}/rad³"));
            page.number("c3_nm_per_rad5", elastic.c3_nm_per_rad5, &format!("{torque}/rad⁵"));
        }
        if let Some(memory) = &self.memory {
            page.section("[memory]");
            page.text("law", memory.law.name(), "");
            page.text("kernel", memory.kernel.name(), "");
            page.text("gate", memory.gate.name(), "");
            let alpha = match (self.torque_unit, memory.kernel) {
                (TorqueUnit::NewtonMetre, Kernel::Deflection) => "N·m/(rad·s)",
                (TorqueUnit::NewtonMetre, Kernel::Rate) => "N·m/rad",
                (TorqueUnit::Ampere, Kernel::Deflection) => "A/(rad·s)",
                (TorqueUnit::Ampere, Kernel::Rate) => "A/rad",
            };
            page.number("alpha", memory.alpha, alpha);
            page.number("beta_per_s", memory.beta_per_s, "1/s");
            if memory.law != Law::Time || memory.omega_per_s.to_bits() != 0 {
                page.number("omega_per_s", memory.omega_per_s, "1/s, speed of the pseudo-time");
            }
            page.number("reversal_play_rad", memory.reversal_play_rad, "rad");
        }
        for term in &self.terms {
            page.section("[[term]]");
            page.text("kind", &term.kind, "");
            for (key, value) in &term.values {
                match value {
                    TermValue::Number(x) => page.number(key, *x, ""),
                    TermValue::Text(text) => page.text(key, text, ""),
                    TermValue::List(numbers) => {
                        let list: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
                        page.entry(key, &format!("[{}]", list.join(", ")), "");
                    }
                }
            }
        }
        page.text
    }

    /// Some key of the file says the torque unit by its name.
    fn shows_unit(&self) -> bool {
        let mut keys = self.terms.iter().flat_map(|term| term.values.keys());
        self.elastic.is_some() || keys.any(|key| per_ampere(key).is_some())
    }
}

struct Page {
    text: String,
    unit: TorqueUnit,
}

impl Page {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    fn section(&mut self, heading: &str) {
        self.line("");
        self.line(heading);
    }

    fn entry(&mut self, key: &str, value: &str, comment: &str) {
        let key = key_per(key, self.unit);
        let line = format!("{key} = {value}");
        // Writing to a String cannot fail.
        let _ = match comment {
            "" => writeln!(self.text, "{line}"),
            _ => writeln!(self.text, "{line:<40} # {comment}"),
        };
    }

    fn text(&mut self, key: &str, text: &str, comment: &str) {
        self.entry(key, &toml::Value::from(text).to_string(), comment);
    }

    /// The shortest decimal that reads back as the same number.
    fn number(&mut self, key: &str, number: f64, comment: &str) {
        self.entry(key, &format!("{number:?}"), comment);
    }

    fn optional(&mut self, key: &str, number: Option<f64>, comment: &str) {
        if let Some(number) = number {
            self.number(key, number, comment);
        }
    }
}
