//! Notes on parameters in words. In JSON they are these words, too.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::number::{number, percent};
use crate::regression::note::{Note, Remedy};
use crate::regression::uncertainty::Estimated;

/// A number known ten times worse than its value is not determined by more rows of the same kind.
const TOO_VAGUE_FOR_MORE_ROWS: f64 = 10.0;

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rates => "record the same stroke at several rates",
            Self::Amplitudes => "record cycles at several amplitudes up to the rated deflection",
            Self::JointMotion => "move the joint both ways through its range, at several speeds and with accelerations",
        })
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Given => f.write_str("given"),
            Self::GivenOrMiddle => f.write_str("given, or the middle of the recorded deflections"),
            Self::Searched => f.write_str("searched, not differentiable: no standard deviation"),
            Self::AtBound => f.write_str("at its bound"),
            Self::NoEffect { upper_limit } => {
                f.write_str("at its bound 0: no effect in these recordings")?;
                upper_limit.map_or(Ok(()), |limit| write!(f, ", upper limit {}", number(limit, 3)))
            }
            Self::RateIndependent { fixes_e_and_h } => {
                let fixed = if *fixes_e_and_h { "e, h" } else { "alpha" };
                write!(
                    f,
                    "a rate-independent loop determines only {fixed} and rho = beta/omega, not this value, which follows from omega as written"
                )
            }
            Self::Open(remedy) => {
                f.write_str("the recordings do not determine it by itself")?;
                remedy.map_or(Ok(()), |remedy| write!(f, ": {remedy}"))
            }
            Self::Vague { relative, .. } if *relative > TOO_VAGUE_FOR_MORE_ROWS => {
                f.write_str("undetermined: standard deviation more than ten times the value")?;
                self.remedy().map_or(Ok(()), |remedy| write!(f, "; {remedy}"))
            }
            Self::Vague { relative, remedy } => {
                write!(f, "undetermined: standard deviation {} of the value", percent(*relative))?;
                let rows = (3.0 * relative).powi(2);
                remedy.map_or(Ok(()), |remedy| {
                    write!(f, "; {remedy}, or about {rows:.0} times as many rows of this kind")
                })
            }
        }
    }
}

impl Serialize for Note {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

/// The notes on parameters, each once, after the names of all that it is about.
pub fn notes<'p>(parameters: &'p [Estimated], name: impl Fn(&'p Estimated) -> &'p str) -> Vec<String> {
    let mut notes: Vec<(Vec<&str>, Note)> = Vec::new();
    for parameter in parameters {
        let Some(note) = parameter.note else { continue };
        match notes.iter_mut().find(|(_, known)| *known == note) {
            Some((names, _)) => names.push(name(parameter)),
            None => notes.push((vec![name(parameter)], note)),
        }
    }
    notes.into_iter().map(|(names, note)| format!("{}: {note}", enumeration(&names))).collect()
}

/// Names with commas between them; those of three or more consecutive numbers of one list are its first and its last.
pub fn enumeration(names: &[&str]) -> String {
    let place = |name: &str| -> Option<(usize, usize)> {
        let (list, index) = name.strip_suffix(']')?.rsplit_once('[')?;
        Some((list.len(), index.parse().ok()?))
    };
    let follows = |before: &&str, after: &&str| {
        let (Some((list, index)), Some((other, next))) = (place(before), place(after)) else { return false };
        before[..list] == after[..other] && next == index + 1
    };
    let mut told = Vec::new();
    for run in names.chunk_by(follows) {
        match run {
            [first, _, .., last] => {
                let index = last.rsplit_once('[').map_or(*last, |(_, index)| index);
                told.push(format!("{first} to [{index}"));
            }
            few => told.extend(few.iter().map(|name| (*name).to_owned())),
        }
    }
    told.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_numbers_of_a_list_are_told_by_the_first_and_the_last() {
        let names = ["c1", "unknown.values_nm[0]", "unknown.values_nm[1]", "unknown.values_nm[2]", "a.b[3]", "a.b[4]"];
        assert_eq!(enumeration(&names), "c1, unknown.values_nm[0] to [2], a.b[3], a.b[4]");
        assert_eq!(enumeration(&["a.b[0]", "a.c[1]", "a.c[3]"]), "a.b[0], a.c[1], a.c[3]");
        assert_eq!(enumeration(&[]), "");
    }
}
