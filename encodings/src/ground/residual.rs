//! Conditions of a schema under a binding of its parameters: what is left once everything static is decided.

use crate::error::Error;
use crate::ground::evaluate::{AtomId, Binding, Failure, World};
use crate::ground::join::{guards_of_exists, guards_of_forall};
use crate::lifted::{Bound, Formula, Rational};
use crate::quantity::Linear;
use pddl::ast::Comparison;

/// What is left of a condition once everything static is decided.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Residual {
    True,
    False,
    And(Vec<Residual>),
    Or(Vec<Residual>),
    Literal {
        atom: AtomId,
        positive: bool,
    },
    /// The expression is ≥ 0, or > 0 if strict.
    Compare {
        linear: Linear<Rational>,
        strict: bool,
    },
}

impl Residual {
    /// A conjunction, or a disjunction, of parts, simplified.
    pub(crate) fn junction(parts: impl IntoIterator<Item = Self>, conjunction: bool) -> Self {
        let mut kept = Vec::new();
        for part in parts {
            match (part, conjunction) {
                (Self::True, true) | (Self::False, false) => {}
                (Self::False, true) => return Self::False,
                (Self::True, false) => return Self::True,
                (Self::And(more), true) | (Self::Or(more), false) => kept.extend(more),
                (other, _) => kept.push(other),
            }
        }
        match (kept.len(), conjunction) {
            (0, _) => truth(conjunction),
            (1, _) => kept.swap_remove(0),
            (_, true) => Self::And(kept),
            (_, false) => Self::Or(kept),
        }
    }

    /// The negation. A comparison of what is undefined has been decided before: it does not hold.
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

    /// The condition with other literals and comparisons, simplified.
    pub(crate) fn mapped(self, leaf: &dyn Fn(Self) -> Self) -> Self {
        match self {
            Self::And(parts) => Self::junction(parts.into_iter().map(|part| part.mapped(leaf)), true),
            Self::Or(parts) => Self::junction(parts.into_iter().map(|part| part.mapped(leaf)), false),
            other => leaf(other),
        }
    }
}

impl World<'_> {
    /// Evaluates a condition that mentions no open slot.
    pub(crate) fn residual(&mut self, formula: &Formula, binding: &mut Binding) -> Result<Residual, Failure> {
        match formula {
            Formula::And(parts) => self.junction(parts, binding, true),
            Formula::Or(parts) => self.junction(parts, binding, false),
            Formula::Exists(bound, body) => self.quantified(bound, body, binding, false),
            Formula::ForAll(bound, body) => self.quantified(bound, body, binding, true),
            Formula::Equal { positive, left, right } => {
                let same = Self::arguments(&[*left], binding) == Self::arguments(&[*right], binding);
                Ok(truth(same == *positive))
            }
            Formula::Literal { positive, predicate, terms } => {
                let arguments = Self::arguments(terms, binding);
                if !self.lifted.predicates[predicate.index()].fluent {
                    return Ok(truth(self.holds_initially(*predicate, &arguments) == *positive));
                }
                if !self.is_reached(*predicate, &arguments) {
                    return Ok(truth(!positive));
                }
                Ok(Residual::Literal { atom: self.atom(*predicate, &arguments), positive: *positive })
            }
            Formula::Compare(comparison, left, right, place) => {
                let difference = match (self.ground(left, binding), self.ground(right, binding)) {
                    (Ok(left), Ok(right)) => (left, right),
                    // PDDL 2.1: an action with an undefined value in an effect cannot be executed…
                    (Err(Failure::Undefined), _) | (_, Err(Failure::Undefined)) if self.in_effect => {
                        return Err(Failure::Error(Error::Unsupported {
                            construct: "a comparison in `when` with a value that is not defined".into(),
                            instead: "a value for it in `:init`".into(),
                            place: *place,
                        }));
                    }
                    // … and elsewhere a comparison with one does not hold.
                    (Err(Failure::Undefined), _) | (_, Err(Failure::Undefined)) => {
                        return Ok(Residual::False);
                    }
                    (Err(failure), _) | (_, Err(failure)) => return Err(failure),
                };
                Ok(compare(*comparison, difference.0, difference.1))
            }
        }
    }

    fn junction(
        &mut self,
        parts: &[Formula],
        binding: &mut Binding,
        conjunction: bool,
    ) -> Result<Residual, Failure> {
        let mut kept = Vec::new();
        for part in parts {
            let part = self.residual(part, binding)?;
            if part == truth(!conjunction) {
                return Ok(part);
            }
            kept.push(part);
        }
        Ok(Residual::junction(kept, conjunction))
    }

    fn quantified(
        &mut self,
        bound: &[Bound],
        body: &Formula,
        binding: &mut Binding,
        universal: bool,
    ) -> Result<Residual, Failure> {
        let guards = if universal { guards_of_forall(body) } else { guards_of_exists(body) };
        let mut kept = Vec::new();
        let mut failure = None;
        let complete = self.each_binding(bound, &guards, binding, &mut |world, binding| match world
            .residual(body, binding)
        {
            Ok(part) if part == truth(!universal) => false,
            Ok(part) => {
                kept.push(part);
                true
            }
            Err(error) => {
                failure = Some(error);
                false
            }
        })?;
        match failure {
            Some(failure) => Err(failure),
            None if complete => Ok(Residual::junction(kept, universal)),
            None => Ok(truth(!universal)),
        }
    }
}

/// A comparison of two expressions as `difference ≥ 0` or `difference > 0`; decided if it is constant.
pub(crate) fn compare(comparison: Comparison, left: Linear<Rational>, right: Linear<Rational>) -> Residual {
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

/// The truth of a comparison in which nothing is variable.
pub(crate) fn constant_comparison(linear: &Linear<Rational>, strict: bool) -> Option<Residual> {
    if !linear.coefficients.is_empty() || !linear.quantity.tables.is_empty() {
        return None;
    }
    let (value, zero) = (&linear.quantity.constant, &Rational::from_integer(0));
    Some(truth(if strict { value > zero } else { value >= zero }))
}

fn truth(value: bool) -> Residual {
    if value { Residual::True } else { Residual::False }
}
