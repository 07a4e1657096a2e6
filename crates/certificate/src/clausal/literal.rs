//! Literals of a CNF formula, numbered as in DIMACS.

use std::ops::Neg;

/// A propositional variable or its negation. Variables are numbered from 1; a negative number is a
/// negated variable. `i32::MIN` is excluded, so that every literal can be negated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal(i32);

impl Literal {
    pub(crate) const FIRST: Self = Self(1);

    pub(crate) fn new(number: i32) -> Option<Self> {
        (number != 0 && number != i32::MIN).then_some(Self(number))
    }

    pub(crate) fn of_variable(number: usize) -> Option<Self> {
        i32::try_from(number).ok().and_then(Self::new)
    }

    /// Returns the literal as a DIMACS number, negative for a negated variable.
    pub fn number(self) -> i32 {
        self.0
    }

    /// Returns the number of the variable, from 1.
    pub fn variable(self) -> usize {
        self.0.unsigned_abs() as usize
    }

    /// Returns the index of the literal in an array of [`Self::places`] entries.
    #[expect(clippy::arithmetic_side_effects, reason = "twice a number below 2^31 in 64 bits")]
    pub fn index(self) -> usize {
        2 * self.variable() + usize::from(self.0 < 0)
    }

    /// Returns the length of an array that is indexed by the literals over `variables` variables.
    #[expect(clippy::arithmetic_side_effects, reason = "variables have names that are held in memory")]
    pub fn places(variables: usize) -> usize {
        2 * variables + 2
    }
}

impl Neg for Literal {
    type Output = Self;

    #[expect(clippy::arithmetic_side_effects, reason = "the least number is not a literal")]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
