//! Which column of a file is which quantity.

use super::error::RecordingProblem;
use super::map::{ColumnMap, Linear};
use super::name::{Named, parse_head, split};
use super::needs::{Need, Needs};
use super::quantity::{Quantity, Unit};
use super::samples::Samples;
use super::table::ColumnHead;
use super::unit_text;

/// Where a quantity comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Source {
    pub quantity: Quantity,
    /// The column, counted from 0.
    pub index: usize,
    pub linear: Linear,
    pub unit: Unit,
}

impl Source {
    /// A number of the column in SI.
    pub(super) fn to_si(self, number: f64) -> f64 {
        self.unit.to_si(self.linear.apply(number))
    }

    /// Numbers of the column in SI. What is in SI stays where it is.
    pub(super) fn convert(self, numbers: &mut Samples) {
        if self.linear != Linear::IDENTITY || !self.unit.is_si() {
            numbers.iter_mut().for_each(|number| *number = self.to_si(*number));
        }
    }
}

/// What is wrong with a header, and with which of its columns.
#[derive(Debug)]
pub(super) struct Fault {
    pub index: Option<usize>,
    pub problem: RecordingProblem,
}

/// A column that may be a quantity, and what keeps it from being one.
struct Unclear {
    quantity: Quantity,
    fault: Fault,
}

/// The quantities of a file that a command looks at, time first.
fn looked_at(needs: &Needs) -> impl Iterator<Item = Quantity> {
    let mut quantities = Quantity::ALL;
    quantities.sort();
    quantities.into_iter().filter(|quantity| needs.of(*quantity) != Need::Ignored)
}

/// Finds the columns that a command needs, time first.
pub(super) fn resolve(heads: &[ColumnHead], map: &ColumnMap, needs: &Needs) -> Result<Vec<Source>, Fault> {
    let (candidates, mut unclear) = candidates(heads, map, needs)?;
    let group = group(heads, map, &candidates)?;
    let mut sources: Vec<Source> = Vec::new();
    for quantity in looked_at(needs) {
        let mut of_it = candidates.iter().filter(|s| s.quantity == quantity && heads[s.index].group == group);
        let Some(first) = of_it.next() else {
            // What counts the time of the group needs no name.
            if quantity == Quantity::Time {
                sources.extend(time_of(heads, group));
            }
            continue;
        };
        if let Some(second) = of_it.next() {
            let problem = RecordingProblem::TwoColumnsForOne { other: heads[first.index].name.clone(), quantity };
            return Err(Fault { index: Some(second.index), problem });
        }
        sources.push(*first);
    }
    let has = |quantity| sources.iter().any(|s| s.quantity == quantity);
    // A torque makes a current superfluous, unless the current alone was asked for by name.
    let current_wanted = map.get(Quantity::Current).is_some() && map.get(Quantity::Torque).is_none();
    let superfluous = if current_wanted { Quantity::Torque } else { Quantity::Current };
    let both = has(Quantity::Torque) && has(Quantity::Current);
    let sources: Vec<Source> = sources.into_iter().filter(|s| !(both && s.quantity == superfluous)).collect();

    let has = |quantity| sources.iter().any(|s| s.quantity == quantity);
    unclear.retain(|u| !(has(u.quantity) || u.quantity == Quantity::Current && has(Quantity::Torque)));
    other_rows(heads, &candidates, &sources, needs)?;
    refuse_what_is_missing(heads, &sources, unclear, needs)?;
    Ok(sources)
}

/// What is needed, in words, and the quantities of which any will do.
fn needed(needs: &Needs) -> [(Need, &'static str, &'static [Quantity]); 3] {
    [
        (needs.time, "`time_s`", &[Quantity::Time]),
        (needs.torque, "`torque_nm` (or `current_a`)", &[Quantity::Torque, Quantity::Current]),
        (
            needs.motion,
            "`deflection_rad` (or the angles `theta_in_rad` and `theta_out_rad`)",
            &[Quantity::Deflection, Quantity::ThetaOut],
        ),
    ]
}

/// Refuses what has to be there and is, but not with the rows of the others.
fn other_rows(heads: &[ColumnHead], candidates: &[Source], sources: &[Source], needs: &Needs) -> Result<(), Fault> {
    for (need, wanted, quantities) in needed(needs) {
        let of_it = |source: &&Source| quantities.contains(&source.quantity);
        if need == Need::Required
            && !sources.iter().any(|source| of_it(&source))
            && let (Some(apart), Some(first)) = (candidates.iter().find(of_it), sources.first())
        {
            let problem = RecordingProblem::RowsApart { wanted, other: heads[first.index].name.clone() };
            return Err(Fault { index: Some(apart.index), problem });
        }
    }
    Ok(())
}

/// Every column that is a quantity by its name or by the map, and those that are nearly one.
fn candidates(heads: &[ColumnHead], map: &ColumnMap, needs: &Needs) -> Result<(Vec<Source>, Vec<Unclear>), Fault> {
    let (mut found, mut unclear) = (Vec::new(), Vec::<Unclear>::new());
    let names: Vec<String> = heads.iter().map(|head| head.name.clone()).collect();
    for quantity in looked_at(needs) {
        if let Some(mapping) = map.get(quantity) {
            let (index, linear) = mapping.resolve(&names).ok_or_else(|| Fault {
                index: None,
                problem: RecordingProblem::MapColumnMissing {
                    mapping: format!("{}={}", mapping.target, mapping.expression),
                    found: listed(heads),
                },
            })?;
            no_twin(heads, index)?;
            found.push(Source { quantity, index, linear, unit: mapping.unit });
            continue;
        }
        for (index, head) in heads.iter().enumerate() {
            let problem = match parse_head(&head.name, head.unit.as_deref()) {
                Named::Known(q, unit) if q == quantity => {
                    no_twin(heads, index)?;
                    found.push(Source { quantity, index, linear: Linear::IDENTITY, unit });
                    continue;
                }
                Named::BadUnit(q, suffix) if q == quantity => RecordingProblem::UnknownUnit { quantity, suffix },
                Named::TwoUnits(q, named, beside) if q == quantity => {
                    return Err(Fault { index: Some(index), problem: RecordingProblem::TwoUnits { named, beside } });
                }
                _ => continue,
            };
            if !unclear.iter().any(|u| u.quantity == quantity) {
                unclear.push(Unclear { quantity, fault: Fault { index: Some(index), problem } });
            }
        }
    }
    Ok((found, unclear))
}

/// The group that the recording is read from: that of the mapped columns, else the one with most of what is known.
fn group(heads: &[ColumnHead], map: &ColumnMap, candidates: &[Source]) -> Result<usize, Fault> {
    let mut mapped = candidates.iter().filter(|source| map.get(source.quantity).is_some());
    if let Some(first) = mapped.next() {
        let group = heads[first.index].group;
        return match mapped.find(|other| heads[other.index].group != group) {
            Some(other) => Err(Fault {
                index: Some(other.index),
                problem: RecordingProblem::OtherRows { other: heads[first.index].name.clone() },
            }),
            None => Ok(group),
        };
    }
    let known = |group: usize| {
        let mut known: Vec<Quantity> =
            candidates.iter().filter(|s| heads[s.index].group == group).map(|s| s.quantity).collect();
        known.sort();
        known.dedup();
        known.len()
    };
    let groups = heads.iter().map(|head| head.group).max().unwrap_or(0);
    // The first of the best.
    Ok((0..=groups).rev().max_by_key(|group| known(*group)).unwrap_or(0))
}

fn time_of(heads: &[ColumnHead], group: usize) -> Option<Source> {
    let (index, head) = heads.iter().enumerate().find(|(_, head)| head.group == group && head.is_time)?;
    let said = head.unit.as_deref().and_then(unit_text::suffix).and_then(|unit| Quantity::Time.unit(&unit));
    let unit = said.unwrap_or(Quantity::Time.units()[0]);
    Some(Source { quantity: Quantity::Time, index, linear: Linear::IDENTITY, unit })
}

fn no_twin(heads: &[ColumnHead], index: usize) -> Result<(), Fault> {
    let twin = |(i, head): &(usize, &ColumnHead)| *i != index && head.name == heads[index].name;
    match heads.iter().enumerate().find(twin) {
        Some((other, _)) => {
            let (first, second) = (index.min(other), index.max(other));
            Err(Fault { index: Some(second), problem: RecordingProblem::DuplicateColumn(first + 1) })
        }
        None => Ok(()),
    }
}

/// Refuses everything that is missing at once, with one map for all of it.
fn refuse_what_is_missing(
    heads: &[ColumnHead],
    sources: &[Source],
    mut unclear: Vec<Unclear>,
    needs: &Needs,
) -> Result<(), Fault> {
    let mut taken: Vec<usize> = sources.iter().map(|s| s.index).collect();
    let mut wanted: Vec<String> = Vec::new();
    let mut open: Vec<String> = Vec::new();
    let mut guesses: Vec<String> = unclear
        .iter()
        .filter_map(|u| {
            let index = u.fault.index?;
            taken.push(index);
            Some(format!("{}={}", u.quantity.si_name(), heads[index].name))
        })
        .collect();
    for (need, words, quantities) in needed(needs) {
        let there = sources.iter().any(|s| quantities.contains(&s.quantity))
            || unclear.iter().any(|u| quantities.contains(&u.quantity));
        if need != Need::Required || there {
            continue;
        }
        let guess = quantities.iter().find_map(|quantity| {
            let at = (0..heads.len()).find(|i| !taken.contains(i) && resembles(&heads[*i].name, *quantity))?;
            Some((*quantity, at))
        });
        // Of an unknown name the unit tells, where no other column has one of its kind.
        let by_unit = || {
            quantities.iter().find_map(|quantity| {
                let mut of_unit = (0..heads.len()).filter(|i| !taken.contains(i) && has_unit_of(&heads[*i], *quantity));
                of_unit.next().filter(|_| of_unit.next().is_none()).map(|at| (*quantity, at))
            })
        };
        let guess = guess.or_else(by_unit).map(|(quantity, at)| {
            taken.push(at);
            format!("{}={}", target(quantity, &heads[at]), heads[at].name)
        });
        open.extend(guess.is_none().then(|| format!("{}=COLUMN", quantities[0].si_name())));
        guesses.extend(guess);
        wanted.push(words.to_owned());
    }
    if wanted.is_empty() && unclear.len() < 2 {
        return unclear.pop().map_or(Ok(()), |u| Err(u.fault));
    }
    let unclear = unclear.iter().filter_map(|u| {
        Some(format!("`{}` (`{}`: {})", u.quantity.si_name(), heads[u.fault.index?].name, u.fault.problem))
    });
    let wanted: Vec<String> = unclear.chain(wanted).collect();
    // What nothing resembles is for the reader to fill in.
    let guess = (!guesses.is_empty()).then(|| [guesses, open].concat().join(","));
    let problem = RecordingProblem::MissingColumns { wanted: wanted.join(", "), found: listed(heads), guess };
    Err(Fault { index: None, problem })
}

/// Whether a column states a unit of a quantity.
fn has_unit_of(head: &ColumnHead, quantity: Quantity) -> bool {
    let stated = split(&head.name).1.or(head.unit.as_deref());
    stated.and_then(unit_text::suffix).is_some_and(|suffix| quantity.unit(&suffix).is_some())
}

/// The name of a quantity in the unit that a column states, else in SI.
fn target(quantity: Quantity, head: &ColumnHead) -> String {
    let (bare, bracketed) = split(&head.name);
    let trailing = bare.rsplit_once(['_', ' ', '.']).map(|(_, last)| last);
    let units = [bracketed, head.unit.as_deref(), trailing];
    let known = units.into_iter().flatten().find_map(|unit| quantity.unit(&unit_text::suffix(unit)?));
    match known {
        Some(unit) => format!("{}_{}", quantity.stem(), unit.spellings[0]),
        None => quantity.si_name(),
    }
}

/// True where a name is nearly the contract's, or one of its words is what people call the quantity.
fn resembles(name: &str, quantity: Quantity) -> bool {
    let name = name.to_lowercase();
    let near = strsim::normalized_damerau_levenshtein(&name, &quantity.si_name()) > 0.7;
    near || name.split(|c: char| !c.is_alphanumeric()).any(|word| quantity.synonyms().contains(&word))
}

fn listed(heads: &[ColumnHead]) -> String {
    const SHOWN: usize = 12;
    let mut text = heads.iter().take(SHOWN).map(|head| format!("`{}`", head.name)).collect::<Vec<_>>().join(", ");
    if heads.len() > SHOWN {
        text += &format!(" and {} more", heads.len() - SHOWN);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_rows_of_its_own_is_named() {
        let head = |(name, group): (&str, usize)| ColumnHead { name: name.to_owned(), group, ..ColumnHead::default() };
        let heads = [("time_s", 0), ("deflection_rad", 0), ("torque_nm", 1)].map(head);
        let fault = resolve(&heads, &ColumnMap::default(), &Needs::FIT).unwrap_err();
        assert_eq!(fault.index, Some(2));
        let wanted = "`torque_nm` (or `current_a`)";
        assert_eq!(fault.problem, RecordingProblem::RowsApart { wanted, other: "time_s".to_owned() });
    }
}
