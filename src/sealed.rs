//! Traits that are for this crate alone to implement: what they promise may grow.

/// Only this crate can name it.
pub trait Sealed {}

impl Sealed for f32 {}
impl Sealed for f64 {}
#[cfg(feature = "fixed")]
impl Sealed for crate::scalar::Fixed {}
impl<S: crate::scalar::Scalar> Sealed for crate::memory::AnyLaw<S> {}
impl<S> Sealed for crate::memory::masing::Masing<S> {}
impl<S> Sealed for crate::memory::phase::Phase<S> {}
impl<S: crate::scalar::Scalar> Sealed for crate::memory::time::Time<S> {}
#[cfg(feature = "block")]
impl Sealed for () {}
#[cfg(feature = "block")]
impl<S: crate::scalar::Float, const K: usize> Sealed for crate::terms::Stack<S, K> {}
#[cfg(feature = "block")]
impl<const K: usize> Sealed for crate::block::CheckedTerms<K> {}
