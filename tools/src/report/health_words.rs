//! The finding in words.

use crate::health::change::Change;
use crate::health::condition::Condition;
use crate::health::{Against, Health};
use crate::number::{number, plus_minus};

/// Change of a stiffness with temperature as catalogues and literature have it, 1/K (MODEL.md section 7).
const STIFFNESS_PER_K: f64 = -3e-4;

/// What a reader wants to hear of first.
const ORDER: [&str; 7] = ["c1_nm_per_rad", "K1", "K2", "hysteresis_loss_arcmin", "h", "lost_motion_arcmin", "K3"];

/// What a quantity is called in a sentence.
pub fn words(name: &str) -> &str {
    match name {
        "hysteresis_loss_arcmin" => "hysteresis loss",
        "lost_motion_arcmin" => "lost motion",
        _ => name.split("_nm").next().unwrap_or(name),
    }
}

impl Health {
    /// One sentence.
    pub fn sentence(&self) -> String {
        if let [only] = &self.conditions[..] {
            let figure = |name: &str| {
                let quantity = only.quantities.iter().find(|quantity| quantity.name == name)?;
                let value = match quantity.sd {
                    Some(sd) => plus_minus(quantity.value, 2.0 * sd),
                    None => number(quantity.value, 4),
                };
                Some(format!("{} {value} {}", words(name), quantity.unit))
            };
            let figures: Vec<String> = ["K1", "K2", "K3", "hysteresis_loss_arcmin", "lost_motion_arcmin"]
                .into_iter()
                .filter_map(figure)
                .collect();
            return format!("{}: {}.", only.name, figures.join(", "));
        }
        let mut moved: Vec<&Change> = self.changes.iter().filter(|c| c.moved).collect();
        if self.changes.iter().all(|c| c.p_value.is_none()) {
            return "The changes are listed; without standard deviations their significance is unknown: give the recordings, or the JSON of each fit beside its model.".to_owned();
        }
        if moved.is_empty() {
            let seen = self.changes.iter().find(|c| c.name == "K2").and_then(|c| Some(c.detectable? / c.first));
            let seen = seen.map_or_else(String::new, |share| {
                format!(". A change of the stiffness K2 by {} % would have been detected", number(100.0 * share, 2))
            });
            return format!("No change beyond the uncertainty{seen}.");
        }
        moved.sort_by_key(|c| ORDER.iter().position(|name| *name == c.name).unwrap_or(ORDER.len()));
        let clause = |c: &&Change| {
            let verb = if c.change < 0.0 { "fell" } else { "grew" };
            let sd = c.sd.map_or_else(String::new, |sd| format!(" ± {}", number(200.0 * sd / c.first.abs(), 2)));
            format!("{} {verb} by {}{sd} %", words(c.name), number(100.0 * c.relative.abs(), 3))
        };
        let clauses: Vec<String> = moved.iter().take(4).map(clause).collect();
        let more = if moved.len() > 4 { format!(" and {} more changed", moved.len() - 4) } else { String::new() };
        format!("From {} to {}: {}{more}.", self.conditions[0].name, self.last().name, clauses.join(", "))
    }

    fn last(&self) -> &Condition {
        &self.conditions[self.conditions.len() - 1]
    }

    /// What else there is to say, a sentence each.
    pub fn reasons(&self) -> Vec<String> {
        let mut reasons = Vec::new();
        let temperature = self.conditions[0].temperature_c.zip(self.last().temperature_c);
        let step = temperature.map(|(first, last)| last - first);
        if let Some(step) = step.filter(|step| step.abs() >= 1.0 && self.changes.iter().any(|c| c.moved)) {
            reasons.push(format!(
                "The temperature changed by {} K too. A stiffness changes by about −0.03 % per kelvin, here {} %.",
                number(step, 2),
                number(100.0 * STIFFNESS_PER_K * step, 2)
            ));
        }
        if self.widened > 1.0 {
            reasons.push(format!(
                "Halves of one recording differ by {} times their standard deviations: the recordings contain effects that the model lacks. All standard deviations are increased by this factor.",
                number(self.widened, 2)
            ));
        }
        let untested: Vec<&str> = self.changes.iter().filter(|c| c.p_value.is_none()).map(|c| words(c.name)).collect();
        if !untested.is_empty() && untested.len() < self.changes.len() {
            reasons.push(format!(
                "Not tested, because a standard deviation is missing in a state: {}.",
                untested.join(", ")
            ));
        }
        if let Some(Against { property, regressions }) = &self.against {
            let found: Vec<String> = regressions
                .iter()
                .filter(|r| r.significant)
                .map(|r| {
                    let sd =
                        r.sd.map_or_else(String::new, |sd| format!(" ± {}", number(200.0 * sd / r.at_mean.abs(), 2)));
                    format!("{} {}{sd} %", words(r.name), number(100.0 * r.relative_slope, 3))
                })
                .collect();
            reasons.push(if found.is_empty() {
                format!("No quantity depends on {} beyond its uncertainty.", property.property)
            } else {
                format!("Dependence on {}, per {}: {}.", property.property, property.unit(), found.join(", "))
            });
        }
        reasons
    }
}
