//! A model and its terms, wherever they lie.

use super::StackView;
use crate::scalar::Float;

/// A model `B` (a gear, an inverse, a feed-forward) and its terms, for a program that has memory of its own for terms.
#[derive(Debug)]
pub struct View<'a, B, S: Float> {
    /// The base model.
    pub base: &'a B,
    /// The terms.
    pub stack: StackView<'a, S>,
}

impl<B, S: Float> Clone for View<'_, B, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<B, S: Float> Copy for View<'_, B, S> {}
