//! Which column of a file is which quantity.

use super::error::RecordingProblem;
use super::map::{ColumnMap, Linear};
use super::quantity::{Named, Quantity, Unit, parse_name};
use super::read::{Need, Needs};

/// Where a quantity comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Source {
    pub quantity: Quantity,
    /// The column, counted from 0.
    pub index: usize,
    pub linear: Linear,
    pub unit: Unit,
}

/// What is wrong with a header, and with which of its columns.
pub(super) struct Fault {
    pub index: Option<usize>,
    pub problem: RecordingProblem,
}

/// Finds the columns that a command needs, time first.
pub(super) fn resolve(names: &[String], map: &ColumnMap, needs: &Needs) -> Result<Vec<Source>, Fault> {
    let mut quantities = Quantity::ALL;
    quantities.sort();
    let mut sources: Vec<Source> = Vec::new();
    for quantity in quantities {
        if needs.of(quantity) == Need::Ignored {
            continue;
        }
        if let Some(source) = find(names, map, quantity)? {
            sources.push(source);
        }
    }
    let has = |quantity| sources.iter().any(|s| s.quantity == quantity);
    // A torque makes a current superfluous, unless the current alone was asked for by name.
    let current_wanted = map.get(Quantity::Current).is_some() && map.get(Quantity::Torque).is_none();
    let superfluous = if current_wanted { Quantity::Torque } else { Quantity::Current };
    let both = has(Quantity::Torque) && has(Quantity::Current);
    let sources: Vec<Source> = sources.into_iter().filter(|s| !(both && s.quantity == superfluous)).collect();

    require(names, &sources, needs.time, "`time_s`", &[Quantity::Time])?;
    require(names, &sources, needs.torque, "`torque_nm` (or `current_a`)", &[Quantity::Torque, Quantity::Current])?;
    let motion = [Quantity::Deflection, Quantity::ThetaOut];
    let wanted = "`deflection_rad` (or the angles `theta_in_rad` and `theta_out_rad`)";
    require(names, &sources, needs.motion, wanted, &motion)?;
    Ok(sources)
}

/// The one column that holds a quantity.
fn find(names: &[String], map: &ColumnMap, quantity: Quantity) -> Result<Option<Source>, Fault> {
    if let Some(mapping) = map.get(quantity) {
        let (index, linear) = mapping.resolve(names).ok_or_else(|| Fault {
            index: None,
            problem: RecordingProblem::MapColumnMissing {
                mapping: format!("{}={}", mapping.target, mapping.expression),
                found: listed(names),
            },
        })?;
        no_twin(names, index)?;
        return Ok(Some(Source { quantity, index, linear, unit: mapping.unit }));
    }
    let mut found: Option<Source> = None;
    let mut bad: Option<Fault> = None;
    for (index, name) in names.iter().enumerate() {
        match parse_name(name) {
            Named::Known(q, unit) if q == quantity => {
                no_twin(names, index)?;
                if let Some(first) = found {
                    let problem = RecordingProblem::TwoColumnsForOne { other: names[first.index].clone(), quantity };
                    return Err(Fault { index: Some(index), problem });
                }
                found = Some(Source { quantity, index, linear: Linear::IDENTITY, unit });
            }
            Named::BadUnit(q, suffix) if q == quantity && bad.is_none() => {
                let problem = RecordingProblem::UnknownUnit { quantity, suffix: suffix.to_owned() };
                bad = Some(Fault { index: Some(index), problem });
            }
            _ => {}
        }
    }
    // A current in a strange unit is no matter where a torque was measured.
    let torque_known = map.get(Quantity::Torque).is_some()
        || names.iter().any(|n| matches!(parse_name(n), Named::Known(Quantity::Torque, _)));
    match (found, bad) {
        (None, Some(fault)) if !(torque_known && quantity == Quantity::Current) => Err(fault),
        (found, _) => Ok(found),
    }
}

fn no_twin(names: &[String], index: usize) -> Result<(), Fault> {
    match names.iter().enumerate().find(|(i, name)| *i != index && **name == names[index]) {
        Some((other, _)) => {
            let (first, second) = (index.min(other), index.max(other));
            Err(Fault { index: Some(second), problem: RecordingProblem::DuplicateColumn(first + 1) })
        }
        None => Ok(()),
    }
}

fn require(names: &[String], sources: &[Source], need: Need, wanted: &str, any_of: &[Quantity]) -> Result<(), Fault> {
    if need != Need::Required || sources.iter().any(|s| any_of.contains(&s.quantity)) {
        return Ok(());
    }
    let taken = |name: &String| sources.iter().any(|s| names[s.index] == *name);
    let guess = any_of.iter().find_map(|quantity| {
        let name = names.iter().find(|name| !taken(name) && resembles(name, *quantity))?;
        Some(format!("{}={name}", quantity.si_name()))
    });
    let problem = RecordingProblem::MissingColumn { wanted: wanted.to_owned(), found: listed(names), guess };
    Err(Fault { index: None, problem })
}

/// True where a name is nearly the contract's, or one of its words is what people call the quantity.
fn resembles(name: &str, quantity: Quantity) -> bool {
    let name = name.to_lowercase();
    let near = strsim::normalized_damerau_levenshtein(&name, &quantity.si_name()) > 0.7;
    near || name.split(|c: char| !c.is_alphanumeric()).any(|word| quantity.synonyms().contains(&word))
}

fn listed(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut text = names.iter().take(SHOWN).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}
