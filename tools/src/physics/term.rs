//! Terms of model files as terms of the core.

use gmhm::terms::{Form, KeyInfo, KindInfo, Setting, Source, Stack, TermError, Value, kind};

use crate::model::{Base, GearSection, Model, Term, TermValue, TorqueSide};

/// The most terms of one model on the host.
pub const MOST_TERMS: usize = 32;

/// The terms of a model, as the host evaluates them.
pub type Terms = Stack<f64, MOST_TERMS>;

/// Whether a gear or a simulation gives T_base. Otherwise it is the sum of the load terms: gravity and inertia of a joint.
pub fn has_given_base(terms: &Terms) -> bool {
    terms.has_gear() || terms.has_simulation()
}

impl Source<f64> for Term {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f64>> {
        Some(match (self.values.get(key.name)?, key.form) {
            (TermValue::Number(x), _) => Value::Number(*x),
            (TermValue::List(list), _) => Value::List(list),
            (TermValue::Text(text), Form::Choice(words)) => {
                words.iter().position(|word| word == text).map_or(Value::NoChoice, Value::Choice)
            }
            (TermValue::Text(_), _) => Value::NoChoice,
        })
    }
}

impl Term {
    /// Its kind's entry in the registry.
    pub fn info(&self) -> Option<&'static KindInfo> {
        kind(&self.kind)
    }

    /// The keys that it may have: those of its kind and shape, and what is not among them.
    ///
    /// # Errors
    /// The first key that it has and should not.
    pub fn known_keys(&self) -> (Vec<&'static str>, Option<&str>) {
        let shape = match self.values.get("shape") {
            Some(TermValue::Text(shape)) => Some(shape.as_str()),
            _ => None,
        };
        let keys = self.info().map_or(&[][..], |info| info.keys);
        let known: Vec<&str> = keys.iter().filter(|key| key.belongs_to(shape)).map(|key| key.name).collect();
        let unknown_key = self.values.keys().map(String::as_str).find(|key| !known.contains(key));
        (known, unknown_key)
    }

    /// Checks the values of all keys.
    ///
    /// # Errors
    /// [`TermError`], with the key to blame.
    pub fn check(&self) -> Result<(), TermError> {
        self.as_core().map(|_| ())
    }

    /// Whether it depends on the torque that the gear transmits, or on the gear's parameters: then T is linear in the numbers of the one while the others stay.
    pub fn follows_base(&self) -> bool {
        self.as_core().is_ok_and(|term| term.follows_base())
    }

    fn as_core(&self) -> Result<gmhm::terms::Term<f64>, TermError> {
        gmhm::terms::Term::read(&self.kind, self, Setting { sigma: 1.0, c1: 1.0, rated_deflection: 1.0 })
    }
}

/// σ of MODEL.md section 7.
pub fn sigma(gear: &GearSection) -> f64 {
    match gear.torque_side {
        TorqueSide::Motor => 1.0,
        TorqueSide::Output => -1.0,
    }
}

/// No terms, for the gear, the joint or the simulation of a model, at the rated deflection in use.
pub fn no_terms(model: &Model, rated_deflection_rad: Option<f64>) -> Terms {
    let c1 = model.elastic.map_or(0.0, |elastic| elastic.c1_nm_per_rad);
    let setting = Setting { sigma: sigma(&model.gear), c1, rated_deflection: rated_deflection_rad.unwrap_or(0.0) };
    match (model.gear.base, &model.elastic) {
        (Base::Simulation, _) => Stack::of_simulation(setting),
        (Base::Model, Some(_)) => Stack::of_gear(setting),
        (Base::Model, None) => Stack::of_joint(setting),
    }
}
