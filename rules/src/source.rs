//! Operands of the steps of a plan.

use crate::rule::{Term, Variable};
use crate::symbol::Symbol;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Source {
    Variable(u16),
    Constant(Symbol),
}

impl From<Term> for Source {
    fn from(term: Term) -> Self {
        match term {
            Term::Variable(Variable(number)) => Self::Variable(number),
            Term::Constant(symbol) => Self::Constant(symbol),
        }
    }
}
