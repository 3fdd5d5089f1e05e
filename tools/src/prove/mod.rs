//! The concealed-physics proof: cases whose missing physics is known only to a key, and the score of a detector on them.

pub mod generator;
pub mod key;
