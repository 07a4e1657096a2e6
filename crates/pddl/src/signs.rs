//! Signs of durations: decides whether an action may have the duration 0. Conditions over all do not apply to this
//! duration (see `validate/definition.md`).

use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::{Signed as _, Zero as _};

use crate::ast::{ActionBody, Arithmetic, Domain, Effect, Expression, InitialElement, Name, Problem};
use crate::visit::Node;

/// Lower bound on the sign of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Sign {
    Any,
    NotNegative,
    Positive,
}

impl Sign {
    fn of(number: &BigRational) -> Self {
        match number {
            number if number.is_positive() => Self::Positive,
            number if number.is_zero() => Self::NotNegative,
            _ => Self::Any,
        }
    }
}

/// Lower bounds on the signs of numeric functions, for all arguments and all reachable states. Values that are undefined
/// do not count.
#[derive(Debug, Clone)]
pub struct Signs(BTreeMap<Name, Sign>);

impl Signs {
    /// Determines the signs from the initial values. A function that an action changes may have any sign.
    pub fn new(domain: &Domain, problem: &Problem) -> Self {
        let mut signs = BTreeMap::new();
        let mut lower = |name: &Name, sign: Sign| {
            let least = signs.entry(name.clone()).or_insert(sign);
            *least = sign.min(*least);
        };
        domain.walk(&mut |node| {
            if let Node::Effect(Effect::Assign(_, target, ..)) = node {
                lower(&target.predicate.name, Sign::Any);
            }
        });
        for element in &problem.init {
            if let InitialElement::Value(atom, value, _) = element {
                lower(&atom.predicate.name, Sign::of(value));
            }
        }
        // Without a value, `total-cost` is 0.
        let cost = Name::new("total-cost");
        problem.initial_values(&cost).iter().for_each(|value| lower(&cost, Sign::of(value)));
        Self(signs)
    }

    /// Returns `false` if the action is instantaneous, or if its duration is certainly above 0. The test is conservative.
    pub fn admit_zero(&self, body: &ActionBody) -> bool {
        let is_positive = |expression: &Expression| self.sign(expression) == Sign::Positive;
        matches!(body, ActionBody::Durative { .. }) && !body.has_positive_duration(is_positive)
    }

    fn sign(&self, expression: &Expression) -> Sign {
        match expression {
            Expression::Number(number, _) => Sign::of(number),
            // A function without a value is undefined, and with it the duration.
            Expression::Fluent(fluent) => {
                self.0.get(&fluent.predicate.name).copied().unwrap_or(Sign::Positive)
            }
            Expression::Operation(operation, operands, _) => {
                let signs = || operands.iter().map(|operand| self.sign(operand));
                let least = signs().min().unwrap_or(Sign::Any);
                match operation {
                    Arithmetic::Add if least >= Sign::NotNegative => signs().max().unwrap_or(Sign::Any),
                    Arithmetic::Add | Arithmetic::Multiply | Arithmetic::Divide => least,
                    Arithmetic::Subtract => Sign::Any,
                }
            }
            Expression::Duration(_) | Expression::TotalTime(_) => Sign::Any,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;

    #[test]
    fn durations_that_are_certainly_positive_do_not_admit_zero() {
        for (duration, admits_zero) in [
            ("(= ?duration 1)", false),
            ("(= ?duration 0)", true),
            ("(= ?duration (long a))", false),
            ("(= ?duration (short a))", true),
            ("(= ?duration (unknown a))", false),
            ("(= ?duration (changed))", true),
            ("(= ?duration (total-cost))", true),
            ("(= ?duration (+ 1 (short a)))", false),
            ("(= ?duration (+ 1 (negative)))", true),
            ("(= ?duration (+ (short a) (short b)))", true),
            ("(= ?duration (* 2 (long a)))", false),
            ("(= ?duration (* 2 (short a)))", true),
            ("(= ?duration (* (negative) (negative)))", true),
            ("(= ?duration (/ (long a) 2))", false),
            ("(= ?duration (- (long a) 2))", true),
            ("(>= ?duration 1)", false),
            ("(<= ?duration 1)", true),
            ("(and (>= ?duration 0) (>= ?duration (long a)) (<= ?duration 9))", false),
            ("()", true),
        ] {
            let domain = format!(
                "(define (domain d) (:requirements :durative-actions :numeric-fluents :duration-inequalities)
                   (:constants a b) (:predicates (done))
                   (:functions (total-cost) (long ?x) (short ?x) (unknown ?x) (changed) (negative))
                   (:durative-action act :parameters () :duration {duration} :condition (and)
                     :effect (at end (increase (changed) 1))))"
            );
            let problem =
                "(define (problem p) (:domain d) (:init (= (long a) 1) (= (long b) 2) (= (short a) 0)
                (= (short b) 3) (= (changed) 1) (= (negative) -1)) (:goal (done)))";
            let domain = crate::parse_domain(&Source::new("d.pddl", domain)).0.expect("a domain");
            let problem = crate::parse_problem(&Source::new("p.pddl", problem)).0.expect("a problem");
            let signs = Signs::new(&domain, &problem);
            assert_eq!(signs.admit_zero(&domain.actions[0].body), admits_zero, "{duration}");
        }
    }
}
