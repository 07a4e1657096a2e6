//! Built-ins that a program's author adds to those of SWRL.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};

use crate::literal::Literal;

/// A built-in of one's own: a test on literals, or a function of literals. It must be pure, since the engine calls it in
/// any order and takes for granted that what it concluded once it would conclude again.
pub trait Definition: Send + Sync {
    /// Its name in rules, in full; it identifies the built-in.
    fn iri(&self) -> &'static str;

    /// Whether it can take this many arguments; a function's result counts.
    fn accepts(&self, count: usize) -> bool;

    /// Whether the first argument is computed from the others and so may be unbound.
    fn is_function(&self) -> bool {
        false
    }

    /// Whether a test holds of its arguments. Not asked of functions.
    fn holds(&self, arguments: &[&Literal]) -> bool {
        let _ = arguments;
        false
    }

    /// The result of a function on its arguments (without the first); `None` where it is undefined.
    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        let _ = arguments;
        None
    }
}

/// A registered [`Definition`], compared by its IRI.
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
