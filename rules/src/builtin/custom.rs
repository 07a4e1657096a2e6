//! Custom built-ins, in addition to those of SWRL.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};

use crate::literal::Literal;

/// Definition of a custom built-in: a test on literals, or a function of literals. A definition must be
/// pure: the engine calls it in any order, and assumes that its results never change.
pub trait Definition: Send + Sync {
    /// Returns the IRI that denotes and identifies the built-in in rules.
    fn iri(&self) -> &'static str;

    /// Returns `true` if the built-in accepts this number of arguments, including the result of a function.
    fn accepts(&self, count: usize) -> bool;

    /// Returns `true` if the first argument is computed from the others, so that it may be unbound.
    fn is_function(&self) -> bool {
        false
    }

    /// Returns `true` if a test holds. Never called for functions.
    fn holds(&self, arguments: &[&Literal]) -> bool {
        let _ = arguments;
        false
    }

    /// Returns the result of a function. `arguments` omits the first argument, which is the result.
    /// Returns `None` if the result is undefined.
    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        let _ = arguments;
        None
    }
}

/// A custom built-in, given by its [`Definition`]. Two are equal if their IRIs are equal.
#[derive(Clone, Copy)]
pub struct CustomBuiltIn(pub(super) &'static dyn Definition);

impl CustomBuiltIn {
    pub(super) fn definition(self) -> &'static dyn Definition {
        self.0
    }
}

impl PartialEq for CustomBuiltIn {
    fn eq(&self, other: &Self) -> bool {
        self.0.iri() == other.0.iri()
    }
}

impl Eq for CustomBuiltIn {}

impl PartialOrd for CustomBuiltIn {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for CustomBuiltIn {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.iri().cmp(other.0.iri())
    }
}

impl Hash for CustomBuiltIn {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.iri().hash(state);
    }
}

impl fmt::Debug for CustomBuiltIn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("CustomBuiltIn").field(&self.0.iri()).finish()
    }
}
