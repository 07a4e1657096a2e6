//! An error type that contains all errors of an input.
//!
#![doc = include_str!("../README.md")]

mod spelling;

use std::error::Error;
use std::fmt::{self, Debug, Display, Formatter};
use std::ops::Deref;

pub use spelling::nearest;

/// All errors of an input. There is at least one, unless the value is constructed from an empty
/// vector or iterator.
///
/// Dereferences to a slice of the errors. `Display` and `Debug` begin each error on a separate
/// line, so a `main` that returns this type prints a readable list. [`Error::source`] is the source
/// of the first error.
#[derive(Clone, PartialEq, Eq)]
pub struct Errors<E>(Vec<E>);

impl<E> Errors<E> {
    /// Returns `Ok` if the iterator is empty, otherwise all its items as an error.
    ///
    /// # Errors
    /// Returns all items of a non-empty iterator.
    pub fn unless_empty(wrong: impl IntoIterator<Item = E>) -> Result<(), Self> {
        let wrong: Vec<E> = wrong.into_iter().collect();
        if wrong.is_empty() { Ok(()) } else { Err(Self(wrong)) }
    }

    /// Converts each error with `change`.
    pub fn map<T>(self, change: impl FnMut(E) -> T) -> Errors<T> {
        Errors(self.0.into_iter().map(change).collect())
    }

    /// Returns all errors as a vector.
    pub fn into_vec(self) -> Vec<E> {
        self.0
    }
}

impl<E> From<E> for Errors<E> {
    fn from(error: E) -> Self {
        Self(vec![error])
    }
}

impl<E> From<Vec<E>> for Errors<E> {
    fn from(errors: Vec<E>) -> Self {
        Self(errors)
    }
}

impl<E> FromIterator<E> for Errors<E> {
    fn from_iter<I: IntoIterator<Item = E>>(errors: I) -> Self {
        Self(errors.into_iter().collect())
    }
}

impl<E> From<Errors<E>> for Vec<E> {
    fn from(errors: Errors<E>) -> Self {
        errors.0
    }
}

impl<E> Deref for Errors<E> {
    type Target = [E];

    fn deref(&self) -> &[E] {
        &self.0
    }
}

impl<E> IntoIterator for Errors<E> {
    type Item = E;
    type IntoIter = std::vec::IntoIter<E>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a, E> IntoIterator for &'a Errors<E> {
    type Item = &'a E;
    type IntoIter = std::slice::Iter<'a, E>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<E: Display> Display for Errors<E> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            let line_break = if index == 0 { "" } else { "\n" };
            write!(f, "{line_break}{error}")?;
        }
        Ok(())
    }
}

impl<E: Display> Debug for Errors<E> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        Display::fmt(self, f)
    }
}

impl<E: Error> Error for Errors<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.first().and_then(Error::source)
    }
}
