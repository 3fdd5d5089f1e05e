//! Every kind of term and every shape, at plausible values, lists of two.

use gmhm::terms::{Coordinate, Form, KINDS, KeyInfo, KindInfo, Source, Value};

use crate::platform::gears::RATED_RAD;

/// A kind in one of its shapes.
pub struct Typical {
    /// The kind.
    pub kind: &'static KindInfo,
    /// The key that tells the shape, and its word; empty where the kind has one shape only.
    pub shape: (&'static str, &'static str),
    choice: usize,
    /// Whether keys are stated that the first format of blocks had not.
    appended: bool,
}

/// All of them, in the order of the registry: every shape with later keys left out, and once more with the later key stated.
pub fn every() -> impl Iterator<Item = Typical> {
    KINDS.iter().flat_map(|kind| {
        let shapes = kind.keys.iter().find_map(|key| match key.form {
            Form::Choice(words) if !is_coordinate(key) && !key.appended => Some((key.name, words)),
            _ => None,
        });
        let (key, words) = shapes.unwrap_or(("", &[""]));
        let plain = move |(choice, word): (usize, &&'static str)| Typical {
            kind,
            shape: (key, *word),
            choice,
            appended: false,
        };
        let later = kind.keys.iter().filter(|key| key.appended).map(move |key| match key.form {
            Form::Choice(words) => (key.name, words.last().copied().unwrap_or_default(), words.len() - 1),
            _ => (key.name, "stated", 0),
        });
        let stated = later.map(move |(key, word, choice)| Typical { kind, shape: (key, word), choice, appended: true });
        words.iter().enumerate().map(plain).chain(stated)
    })
}

fn is_coordinate(key: &KeyInfo) -> bool {
    key.name == "coordinate"
}

impl Source<f32> for Typical {
    fn get(&self, key: &'static KeyInfo) -> Option<Value<'_, f32>> {
        if key.appended && !self.appended {
            return None;
        }
        let (low, high) = key.plausible;
        // Never the middle, which is often nought, and not the same share for any two keys.
        let place = self.kind.keys.iter().position(|known| known.name == key.name)?;
        let share = 0.55 + 0.05 * place as f64;
        Some(match (key.form, key.name) {
            (Form::Choice(_), _) if is_coordinate(key) => Value::Choice(Coordinate::Deflection as usize),
            (Form::Choice(_), _) => Value::Choice(self.choice),
            (Form::List { .. }, "orders") => Value::List(&[2.0, 4.0]),
            (Form::List { .. }, "knots") => Value::List(&[-RATED_RAD, RATED_RAD]),
            (Form::List { .. }, _) => Value::List(match key.unit {
                "rad" => &[0.2 * RATED_RAD, 0.5 * RATED_RAD],
                "s" => &[1.0, 10.0],
                _ => &[1.0, 0.5],
            }),
            // Usual gaps would swallow the rated deflection, and usual starts come after the end.
            (Form::Number, "half_gap_rad") => Value::Number(0.05 * RATED_RAD),
            (Form::Number, "start_s") => Value::Number(0.01),
            (Form::Number, _) => Value::Number((low + share * (high - low)) as f32),
        })
    }
}
