//! Affine expressions over the columns of a linear program.

use num_traits::{One, Zero};

use task::number::Rational;

/// Column of a linear program: a variable that must be at least 0.
pub(super) type Column = u32;

#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Affine {
    pub(super) constant: Rational,
    /// Sorted by column.
    pub(super) terms: Vec<(Column, Rational)>,
}

impl Affine {
    pub(super) fn constant(constant: Rational) -> Self {
        Self { constant, terms: Vec::new() }
    }

    pub(super) fn column(column: Column) -> Self {
        Self { constant: Rational::zero(), terms: vec![(column, Rational::one())] }
    }

    pub(super) fn known(&self) -> Option<&Rational> {
        self.terms.is_empty().then_some(&self.constant)
    }

    pub(super) fn coefficient(&self, column: Column) -> Option<&Rational> {
        let position = self.terms.binary_search_by_key(&column, |(candidate, _)| *candidate).ok()?;
        Some(&self.terms[position].1)
    }

    pub(super) fn plus(&self, other: &Self, times: &Rational) -> Self {
        let mut terms = Vec::with_capacity(self.terms.len().saturating_add(other.terms.len()));
        let (mut left_terms, mut right_terms) = (self.terms.iter().peekable(), other.terms.iter().peekable());
        loop {
            match (left_terms.peek(), right_terms.peek()) {
                (Some((column, factor)), Some((other, more))) if column == other => {
                    let sum = more.clone() * times + factor;
                    if !sum.is_zero() {
                        terms.push((*column, sum));
                    }
                    left_terms.next();
                    right_terms.next();
                }
                (Some((column, _)), Some((other, _))) if column < other => {
                    terms.extend(left_terms.next().cloned());
                }
                (_, Some((other, more))) => {
                    terms.push((*other, more.clone() * times));
                    right_terms.next();
                }
                (Some(_), None) => terms.extend(left_terms.next().cloned()),
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

    pub(super) fn substitute(&mut self, column: Column, by: &Self) {
        if let Ok(position) = self.terms.binary_search_by_key(&column, |(candidate, _)| *candidate) {
            let (_, factor) = self.terms.remove(position);
            *self = self.plus(by, &factor);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.terms.len().saturating_mul(size_of::<(Column, Rational)>()).saturating_add(size_of::<Self>())
    }
}
