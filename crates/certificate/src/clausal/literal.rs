//! Variables of a formula and their negations, numbered as in DIMACS.

use std::ops::Neg;

/// A variable, numbered from 1, or its negation. The least number of 32 bits is none, so that each can be negated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal(i32);

impl Literal {
    /// The first variable.
    pub(crate) const FIRST: Self = Self(1);

    /// None if the number is that of no literal.
    pub(crate) fn new(number: i32) -> Option<Self> {
        (number != 0 && number != i32::MIN).then_some(Self(number))
    }

    /// The variable of a number; none if there are not so many.
    pub(crate) fn of_variable(number: usize) -> Option<Self> {
        i32::try_from(number).ok().and_then(Self::new)
    }

    /// As in DIMACS.
    pub fn number(self) -> i32 {
        self.0
    }

    /// The number of its variable, from 1.
    pub fn variable(self) -> usize {
        self.0.unsigned_abs() as usize
    }

    /// The place of a literal in lists over all of them, whose length is [`Self::places`].
    #[expect(clippy::arithmetic_side_effects, reason = "twice a number below 2^31 in 64 bits")]
    pub fn index(self) -> usize {
        2 * self.variable() + usize::from(self.0 < 0)
    }

    /// How long lists over all literals of so many variables are.
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
