//! `--map`: columns under other names, scaled, flipped and shifted.

use super::name::{Named, parse_name};
use super::quantity::{Quantity, Unit};

/// One entry of `--map`: `TARGET=COLUMN`, `TARGET=COLUMN*2`, `TARGET=-COLUMN/1000+0.5`, `TARGET=0.001*COLUMN`.
///
/// The value is the file's number, scaled and shifted as written, in the unit that TARGET names.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    /// The quantity that the column stands for.
    pub quantity: Quantity,
    /// The unit of the result.
    pub unit: Unit,
    /// The target as written, such as `torque_nm`.
    pub target: String,
    /// The expression as written.
    pub expression: String,
}

/// Why a `--map` entry was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MapError {
    /// No `=`.
    #[error("`{0}` is no mapping; write TARGET=COLUMN, such as torque_nm=tau*0.001")]
    NoEquals(String),
    /// Nothing after the `=`.
    #[error("`{0}=` names no column; write {0}=COLUMN")]
    NoColumn(String),
    /// The target is no column of a recording.
    #[error("`{target}` is no column of a recording; the targets are {accepted}", accepted = target_names())]
    UnknownTarget {
        /// The target as written.
        target: String,
    },
    /// The target's unit is unknown.
    #[error("`{target}` has no unit that is known; accepted: {}", quantity.accepted_suffixes())]
    UnknownUnit {
        /// The target as written.
        target: String,
        /// What it stands for.
        quantity: Quantity,
    },
    /// Two entries for one quantity.
    #[error("`{first}` and `{second}` both give the {}; keep one", quantity.stem())]
    Twice {
        /// The earlier target.
        first: String,
        /// The later target.
        second: String,
        /// What both stand for.
        quantity: Quantity,
    },
}

fn target_names() -> String {
    let mut quantities = Quantity::ALL;
    quantities.sort();
    quantities.map(Quantity::si_name).join(", ")
}

impl std::str::FromStr for Mapping {
    type Err = MapError;

    fn from_str(text: &str) -> Result<Self, MapError> {
        let (target, expression) = text.split_once('=').ok_or_else(|| MapError::NoEquals(text.to_owned()))?;
        let (target, expression) = (target.trim().to_owned(), expression.trim().to_owned());
        let (quantity, unit) = match parse_name(&target) {
            Named::Known(quantity, unit) => (quantity, unit),
            Named::BadUnit(quantity, _) => return Err(MapError::UnknownUnit { target, quantity }),
            Named::Other | Named::TwoUnits(..) => return Err(MapError::UnknownTarget { target }),
        };
        if expression.is_empty() {
            return Err(MapError::NoColumn(target));
        }
        Ok(Mapping { quantity, unit, target, expression })
    }
}

/// The whole of `--map`: at most one entry a quantity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColumnMap {
    entries: Vec<Mapping>,
}

impl ColumnMap {
    /// Joins entries; two for one quantity are refused.
    pub fn new(entries: Vec<Mapping>) -> Result<Self, MapError> {
        for (i, later) in entries.iter().enumerate() {
            if let Some(earlier) = entries[..i].iter().find(|e| e.quantity == later.quantity) {
                return Err(MapError::Twice {
                    first: earlier.target.clone(),
                    second: later.target.clone(),
                    quantity: later.quantity,
                });
            }
        }
        Ok(ColumnMap { entries })
    }

    /// The entry for a quantity.
    pub fn get(&self, quantity: Quantity) -> Option<&Mapping> {
        self.entries.iter().find(|e| e.quantity == quantity)
    }
}

impl std::str::FromStr for ColumnMap {
    type Err = MapError;

    /// Entries separated by commas.
    fn from_str(text: &str) -> Result<Self, MapError> {
        ColumnMap::new(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
    }
}

/// Number of the file → `number·scale/divisor + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Linear {
    scale: f64,
    divisor: f64,
    offset: f64,
}

impl Linear {
    pub(super) const IDENTITY: Linear = Linear { scale: 1.0, divisor: 1.0, offset: 0.0 };

    pub(super) fn apply(self, number: f64) -> f64 {
        // Adding an absent offset would turn -0 into 0.
        let scaled = number * self.scale / self.divisor;
        if self.offset == 0.0 { scaled } else { scaled + self.offset }
    }
}

impl Mapping {
    /// Finds the column among the file's names. Names may themselves hold `-`, `/` or `*`: the longest reading that names a
    /// column wins, then an offset and factors are taken off the ends until one does.
    pub(super) fn resolve(&self, names: &[String]) -> Option<(usize, Linear)> {
        let text = self.expression.as_str();
        factors(text, names, Linear::IDENTITY).or_else(|| {
            splits(text, &['+', '-']).find_map(|(rest, sign, number)| {
                let offset = if sign == '-' { -number } else { number };
                factors(rest, names, Linear { offset, ..Linear::IDENTITY })
            })
        })
    }
}

fn factors(text: &str, names: &[String], so_far: Linear) -> Option<(usize, Linear)> {
    let text = text.trim();
    if let Some(index) = names.iter().position(|name| name == text) {
        return Some((index, so_far));
    }
    let behind = splits(text, &['*', '/']).find_map(|(rest, operator, number)| {
        let next = match operator {
            '*' => Linear { scale: so_far.scale * number, ..so_far },
            _ => Linear { divisor: so_far.divisor * number, ..so_far },
        };
        factors(rest, names, next)
    });
    behind.or_else(|| {
        if let Some(rest) = text.strip_prefix('-')
            && let Some(found) = factors(rest, names, Linear { scale: -so_far.scale, ..so_far })
        {
            return Some(found);
        }
        let (number, rest) = text.split_once('*')?;
        let scale = so_far.scale * finite(number)?;
        factors(rest, names, Linear { scale, ..so_far })
    })
}

/// Every way to read `text` as something, one of `operators`, and a number, the last operator first.
fn splits<'a>(text: &'a str, operators: &'a [char]) -> impl Iterator<Item = (&'a str, char, f64)> {
    text.rmatch_indices(operators).filter_map(|(at, operator)| {
        let rest = text[..at].trim();
        let number = finite(&text[at + operator.len()..])?;
        (!rest.is_empty()).then_some((rest, operator.chars().next()?, number))
    })
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(expression: &str, names: &[&str], number: f64) -> Option<f64> {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        let mapping: Mapping = format!("torque_nm={expression}").parse().unwrap();
        mapping.resolve(&names).map(|(_, linear)| linear.apply(number))
    }

    #[test]
    fn scales_flips_and_shifts() {
        assert_eq!(at("x", &["x"], 3.0), Some(3.0));
        assert_eq!(at("-x", &["x"], 3.0), Some(-3.0));
        assert_eq!(at("x*1e-3", &["x"], 3.0), Some(0.003));
        assert_eq!(at("x/1000", &["x"], 7.0), Some(0.007));
        assert_eq!(at("-2*x", &["x"], 3.0), Some(-6.0));
        assert_eq!(at("-x*2+0.5", &["x"], 3.0), Some(-5.5));
        assert_eq!(at("x - 1e-1", &["x"], 3.0), Some(2.9));
        assert_eq!(at("x*-2", &["x"], 3.0), Some(-6.0));
        assert_eq!(at("x+0.5*2", &["x"], 3.0), None);
        assert_eq!(at("x*inf", &["x"], 3.0), None);
    }

    #[test]
    fn a_name_with_operators_wins_over_arithmetic() {
        assert_eq!(at("force-2", &["force", "force-2"], 3.0), Some(3.0));
        assert_eq!(at("force-2", &["force"], 3.0), Some(1.0));
        assert_eq!(at("Torque (N*m)*2", &["Torque (N*m)"], 3.0), Some(6.0));
    }

    #[test]
    fn bad_entries_are_refused() {
        let refused = |text: &str| text.parse::<ColumnMap>().unwrap_err();
        assert!(matches!(refused("torque_nm"), MapError::NoEquals(_)));
        assert!(matches!(refused("torque_nm="), MapError::NoColumn(_)));
        assert!(matches!(refused("torque=t"), MapError::UnknownUnit { .. }));
        assert!(matches!(refused("tau=t"), MapError::UnknownTarget { .. }));
        assert!(matches!(refused("torque_nm=a,torque_knm=b"), MapError::Twice { .. }));
    }
}
