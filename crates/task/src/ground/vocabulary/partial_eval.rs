//! Conditions over fluents that remain after partial evaluation.

use crate::ground::vocabulary::atom::AtomId;
use crate::lifted::Rational;
use crate::task::quantity::Linear;
use pddl::ast::Comparison;

/// A condition after partial evaluation: only fluents and slots are still open.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Residual {
    True,
    False,
    And(Vec<Residual>),
    Or(Vec<Residual>),
    Literal {
        atom: AtomId,
        positive: bool,
    },
    /// True if the linear expression is ≥ 0, or > 0 if `strict` is `true`.
    Compare {
        linear: Linear<Rational>,
        strict: bool,
    },
}

impl Residual {
    pub(crate) fn junction(parts: impl IntoIterator<Item = Self>, conjunction: bool) -> Self {
        let mut simplified = Vec::new();
        for part in parts {
            match (part, conjunction) {
                (Self::True, true) | (Self::False, false) => {}
                (Self::False, true) => return Self::False,
                (Self::True, false) => return Self::True,
                (Self::And(more), true) | (Self::Or(more), false) => simplified.extend(more),
                (other, _) => simplified.push(other),
            }
        }
        match (simplified.len(), conjunction) {
            (0, _) => truth(conjunction),
            (1, _) => simplified.swap_remove(0),
            (_, true) => Self::And(simplified),
            (_, false) => Self::Or(simplified),
        }
    }

    /// Returns the negation. Comparisons with undefined values must already have been replaced by `False`.
    pub(crate) fn negated(&self) -> Self {
        match self {
            Self::True => Self::False,
            Self::False => Self::True,
            Self::And(parts) => Self::junction(parts.iter().map(Self::negated), false),
            Self::Or(parts) => Self::junction(parts.iter().map(Self::negated), true),
            Self::Literal { atom, positive } => Self::Literal { atom: *atom, positive: !positive },
            Self::Compare { linear, strict } => {
                Self::Compare { linear: linear.clone().negated(), strict: !strict }
            }
        }
    }

    pub(crate) fn mapped(self, leaf: &dyn Fn(Self) -> Self) -> Self {
        match self {
            Self::And(parts) => Self::junction(parts.into_iter().map(|part| part.mapped(leaf)), true),
            Self::Or(parts) => Self::junction(parts.into_iter().map(|part| part.mapped(leaf)), false),
            other => leaf(other),
        }
    }
}

/// Converts a comparison to a residual of the form `linear ≥ 0` or `linear > 0`, or to a conjunction of two
/// for an equality. If both sides are constant, the result is a truth value.
pub fn compare(comparison: Comparison, left: Linear<Rational>, right: Linear<Rational>) -> Residual {
    match comparison {
        Comparison::Less => at_least_zero(right, left, true),
        Comparison::LessOrEqual => at_least_zero(right, left, false),
        Comparison::Greater => at_least_zero(left, right, true),
        Comparison::GreaterOrEqual => at_least_zero(left, right, false),
        Comparison::Equal => {
            let above = at_least_zero(left.clone(), right.clone(), false);
            Residual::junction([above, at_least_zero(right, left, false)], true)
        }
    }
}

fn at_least_zero(mut linear: Linear<Rational>, subtrahend: Linear<Rational>, strict: bool) -> Residual {
    linear.add(&subtrahend.negated());
    constant_comparison(&linear, strict).unwrap_or(Residual::Compare { linear, strict })
}

/// Returns the truth value of `linear ≥ 0` (or `> 0` if `strict`) if the expression is constant, and `None`
/// otherwise.
pub fn constant_comparison(linear: &Linear<Rational>, strict: bool) -> Option<Residual> {
    if !linear.coefficients.is_empty() || !linear.quantity.tables.is_empty() {
        return None;
    }
    let (value, zero) = (&linear.quantity.constant, &Rational::from_integer(0));
    Some(truth(if strict { value > zero } else { value >= zero }))
}

/// Returns `Residual::True` or `Residual::False`.
pub fn truth(value: bool) -> Residual {
    if value { Residual::True } else { Residual::False }
}
