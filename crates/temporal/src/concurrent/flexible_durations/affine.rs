//! Affine expressions over the columns of a linear program.

use num_traits::{One, Zero};

use task::number::Rational;

/// A variable of a linear program, at least 0.
pub(super) type Column = u32;

/// A constant plus multiples of columns.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Affine {
    pub(super) constant: Rational,
    /// Ascending by column; no factor is 0.
    pub(super) terms: Vec<(Column, Rational)>,
}

impl Affine {
    pub(super) fn constant(constant: Rational) -> Self {
        Self { constant, terms: Vec::new() }
    }

    pub(super) fn column(column: Column) -> Self {
        Self { constant: Rational::zero(), terms: vec![(column, Rational::one())] }
    }

    /// The value, if it is the same whatever the columns are.
    pub(super) fn known(&self) -> Option<&Rational> {
        self.terms.is_empty().then_some(&self.constant)
    }

    pub(super) fn coefficient(&self, column: Column) -> Option<&Rational> {
        let position = self.terms.binary_search_by_key(&column, |(own, _)| *own).ok()?;
        Some(&self.terms[position].1)
    }

    /// This and so many times another one.
    pub(super) fn plus(&self, other: &Self, times: &Rational) -> Self {
        let mut terms = Vec::with_capacity(self.terms.len().saturating_add(other.terms.len()));
        let (mut own, mut others) = (self.terms.iter().peekable(), other.terms.iter().peekable());
        loop {
            match (own.peek(), others.peek()) {
                (Some((column, factor)), Some((other, more))) if column == other => {
                    let sum = more.clone() * times + factor;
                    if !sum.is_zero() {
                        terms.push((*column, sum));
                    }
                    own.next();
                    others.next();
                }
                (Some((column, _)), Some((other, _))) if column < other => terms.extend(own.next().cloned()),
                (_, Some((other, more))) => {
                    terms.push((*other, more.clone() * times));
                    others.next();
                }
                (Some(_), None) => terms.extend(own.next().cloned()),
                (None, None) => break,
            }
        }
        Self { constant: other.constant.clone() * times + &self.constant, terms }
    }

    pub(super) fn minus(&self, other: &Self) -> Self {
        self.plus(other, &Rational::from_integer(-1))
    }

    pub(super) fn shifted(&self, by: &Rational) -> Self {
        Self { constant: self.constant.clone() + by, terms: self.terms.clone() }
    }

    pub(super) fn times(&self, factor: &Rational) -> Self {
        Self::default().plus(self, factor)
    }

    /// With an expression in the place of a column.
    pub(super) fn substitute(&mut self, column: Column, by: &Self) {
        if let Ok(position) = self.terms.binary_search_by_key(&column, |(own, _)| *own) {
            let (_, factor) = self.terms.remove(position);
            *self = self.plus(by, &factor);
        }
    }

    /// About how many bytes it takes.
    pub(super) fn bytes(&self) -> usize {
        self.terms.len().saturating_mul(size_of::<(Column, Rational)>()).saturating_add(size_of::<Self>())
    }
}
