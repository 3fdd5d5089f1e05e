//! Which kinds can stand for which others.

use super::of;

/// Whether one kind contains another as a special case.
pub fn contains(kind: &str, special: &str) -> bool {
    of(kind).is_some_and(|kind| kind.contains().contains(&special))
}

/// Whether one kind imitates another, see [`Kind::imitates`](super::Kind::imitates).
pub fn imitates(kind: &str, other: &str) -> bool {
    of(kind).is_some_and(|kind| kind.imitates().contains(&other))
}

/// Whether what one kind describes can be another alone: a special case of it, or a kind that it imitates.
pub fn includes(kind: &str, simpler: &str) -> bool {
    contains(kind, simpler) || imitates(kind, simpler)
}
