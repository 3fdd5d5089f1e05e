//! A term whose size is still open.

use crate::model::{Term, TermValue};

/// A kind with its keys: those that a factor multiplies, and those that it leaves alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    kind: &'static str,
    keys: Vec<(&'static str, TermValue, Grows)>,
}

/// What a key does when the factor grows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grows {
    /// It is multiplied.
    Along,
    /// It shrinks from its value, by this much a unit of the factor.
    Down(f64),
    /// It stays.
    Never,
}

impl Draft {
    /// A term of a kind without keys.
    pub fn new(kind: &'static str) -> Self {
        Self { kind, keys: Vec::new() }
    }

    fn with(mut self, key: &'static str, value: TermValue, grows: Grows) -> Self {
        self.keys.push((key, value, grows));
        self
    }

    /// A number that is `per_nm` times the factor.
    pub fn number(self, key: &'static str, per_nm: f64) -> Self {
        self.with(key, TermValue::Number(per_nm), Grows::Along)
    }

    /// A list that is `per_nm` times the factor.
    pub fn list(self, key: &'static str, per_nm: Vec<f64>) -> Self {
        self.with(key, TermValue::List(per_nm), Grows::Along)
    }

    /// A number that falls from `from` as the factor grows.
    pub fn falling(self, key: &'static str, from: f64, per_nm: f64) -> Self {
        self.with(key, TermValue::Number(from), Grows::Down(per_nm))
    }

    /// A number of its own.
    pub fn fixed(self, key: &'static str, value: f64) -> Self {
        self.with(key, TermValue::Number(value), Grows::Never)
    }

    /// A list of its own.
    pub fn fixed_list(self, key: &'static str, values: Vec<f64>) -> Self {
        self.with(key, TermValue::List(values), Grows::Never)
    }

    /// A choice.
    pub fn text(self, key: &'static str, text: &str) -> Self {
        self.with(key, TermValue::Text(text.to_owned()), Grows::Never)
    }

    /// The term of a size: the factor is about the N·m that it adds at most.
    pub fn term(&self, factor: f64) -> Term {
        let grown = |value: &TermValue, grows| match (value, grows) {
            (TermValue::Number(x), Grows::Along) => TermValue::Number(factor * x),
            (TermValue::List(list), Grows::Along) => TermValue::List(list.iter().map(|x| factor * x).collect()),
            (TermValue::Number(x), Grows::Down(per_nm)) => TermValue::Number(x - factor * per_nm),
            (value, _) => value.clone(),
        };
        let keys = self.keys.iter().map(|(key, value, grows)| ((*key).to_owned(), grown(value, *grows)));
        Term { kind: self.kind.to_owned(), values: keys.collect() }
    }
}
