//! Everything that is wrong with an input, as one error.
//!
#![doc = include_str!("../README.md")]

mod spelling;

use std::error::Error;
use std::fmt::{self, Debug, Display, Formatter};
use std::ops::Deref;

pub use spelling::nearest;

/// Everything that is wrong with an input: one error or more, in the order in which they are to be read.
///
/// It is a slice of them and can be iterated. Shown by `Display` or `Debug` each begins on a line of its own, so that a `main`
/// that returns it prints what a user is to read. [`Error::source`] is that of the first.
#[derive(Clone, PartialEq, Eq)]
pub struct Errors<E>(Vec<E>);

impl<E> Errors<E> {
    /// An error if there is anything wrong.
    ///
    /// # Errors
    /// All that the iterator yields, if it yields anything.
    pub fn unless_empty(wrong: impl IntoIterator<Item = E>) -> Result<(), Self> {
        let wrong: Vec<E> = wrong.into_iter().collect();
        if wrong.is_empty() { Ok(()) } else { Err(Self(wrong)) }
    }

    /// Each of them as another type.
    pub fn map<T>(self, change: impl FnMut(E) -> T) -> Errors<T> {
        Errors(self.0.into_iter().map(change).collect())
    }

    /// All of them.
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
