//! Evaluates conditions in the initial state, and checks that their values are defined.

use num_rational::BigRational;
use num_traits::Zero;
use rustc_hash::{FxHashMap, FxHashSet};

use pddl::ast::{
    Arithmetic, Atom, Comparison, Condition, Domain, Expression, InitialElement, Name, Problem, Span, Term,
};

use crate::error::{Error, File};

use super::instances::{Binding, Objects, term};
use super::syntax_edits::unsupported;

type Key = (Name, Vec<Name>);

/// Facts and numeric values of the initial state, without derived predicates and timed initial literals.
pub(super) struct Initial<'t> {
    objects: &'t Objects<'t>,
    domain: &'t Domain,
    facts: FxHashSet<Key>,
    values: FxHashMap<Key, BigRational>,
}

fn key(atom: &Atom, binding: &Binding) -> Key {
    let name = |argument: &Term| match term(argument, binding) {
        Term::Variable(identifier) | Term::Constant(identifier) => identifier.name,
    };
    (atom.predicate.name.clone(), atom.arguments.iter().map(name).collect())
}

fn is_bound(atom: &Atom, binding: &Binding) -> bool {
    atom.arguments.iter().all(|argument| matches!(term(argument, binding), Term::Constant(_)))
}

enum Undefined<'c> {
    Function(&'c Name),
    Quotient,
}

impl<'t> Initial<'t> {
    pub(super) fn of(domain: &'t Domain, problem: &Problem, objects: &'t Objects<'t>) -> Self {
        let (mut facts, mut values) = (FxHashSet::default(), FxHashMap::default());
        values.insert((Name::new("total-cost"), Vec::new()), BigRational::zero());
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    facts.insert(key(atom, &Vec::new()));
                }
                InitialElement::Value(atom, value, _) => {
                    values.insert(key(atom, &Vec::new()), value.clone());
                }
                InitialElement::NegatedFact(_) | InitialElement::Timed(..) => {}
            }
        }
        Self { objects, domain, facts, values }
    }

    /// Returns `true` if the condition holds in the initial state. A condition whose truth depends on an
    /// undefined numeric value does not hold.
    pub(super) fn holds(&self, condition: &Condition) -> bool {
        self.truth(condition, &mut Vec::new()) == Some(true)
    }

    /// Returns an error at `place` if a numeric function in the condition has no initial value or a divisor may be 0.
    /// With an undefined value, both the condition and its negation could be false.
    pub(super) fn is_defined(&self, condition: &Condition, place: (File, Span)) -> Result<(), Error> {
        let (construct, instead) = match self.undefined(condition, &mut Vec::new()) {
            None => return Ok(()),
            Some(Undefined::Function(name)) => (
                format!(
                    "a constraint or preference on `{name}`, which has no initial value for some objects"
                ),
                "an initial value for each",
            ),
            Some(Undefined::Quotient) => (
                "a constraint or preference that divides by a number that may be 0".to_owned(),
                "divisors that are never 0",
            ),
        };
        Err(unsupported(construct, instead, place))
    }

    /// Returns a part of the condition that may have no value, or `None` if all values are defined. A function with a
    /// free variable among its arguments must have a value for every tuple of objects of its declared types.
    fn undefined<'c>(&self, condition: &'c Condition, binding: &mut Binding) -> Option<Undefined<'c>> {
        match condition {
            Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
                let mut instances = self.objects.bindings(variables, binding);
                instances.find_map(|mut inner| self.undefined(body, &mut inner))
            }
            Condition::Compare(_, left, right, _) => {
                [left, right].into_iter().find_map(|side| self.undefined_in(side, binding))
            }
            other => other.parts().find_map(|part| self.undefined(part, binding)),
        }
    }

    fn undefined_in<'c>(&self, expression: &'c Expression, binding: &Binding) -> Option<Undefined<'c>> {
        if let Expression::Fluent(atom) = expression {
            return (!self.has_value(atom, binding)).then_some(Undefined::Function(&atom.predicate.name));
        }
        let operands = expression.operands();
        let undefined = operands.iter().find_map(|operand| self.undefined_in(operand, binding));
        let is_quotient = matches!(expression, Expression::Operation(Arithmetic::Divide, ..));
        undefined.or_else(|| {
            let mut divisors = operands.iter().skip(1);
            let is_undefined = is_quotient && divisors.any(|divisor| self.may_be_zero(divisor, binding));
            is_undefined.then_some(Undefined::Quotient)
        })
    }

    /// Returns `false` only if a divisor is certainly not 0. The check of its initial value suffices, because the
    /// planner rejects divisors that change.
    fn may_be_zero(&self, divisor: &Expression, binding: &Binding) -> bool {
        match divisor {
            // A free variable can have any object as its value.
            Expression::Fluent(atom) if !is_bound(atom, binding) => {
                let name = &atom.predicate.name;
                self.values.iter().any(|((function, _), value)| function == name && value.is_zero())
            }
            Expression::Operation(Arithmetic::Multiply, factors, _) => {
                factors.iter().any(|factor| self.may_be_zero(factor, binding))
            }
            other => {
                let mut all_bound = true;
                other.walk_fluents(&mut |atom| all_bound &= is_bound(atom, binding));
                !all_bound || self.value(other, binding).is_none_or(|value| value.is_zero())
            }
        }
    }

    fn has_value(&self, atom: &Atom, binding: &Binding) -> bool {
        if is_bound(atom, binding) {
            return self.values.contains_key(&key(atom, binding));
        }
        let name = &atom.predicate.name;
        let mut declared = self.domain.functions.iter().filter(|function| function.identifier.name == *name);
        let instances = declared.next().map(|function| {
            let members =
                function.parameters.iter().map(|parameter| self.objects.members(&parameter.r#type).count());
            members.fold(1, usize::saturating_mul)
        });
        let with_value = self.values.keys().filter(|(function, _)| function == name).count();
        instances.is_some_and(|instances| with_value >= instances)
    }

    /// Returns the truth value of a condition in Kleene's three-valued logic. `None` means that it depends on
    /// an undefined value.
    fn truth(&self, condition: &Condition, binding: &mut Binding) -> Option<bool> {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                let truths: Vec<_> = parts.iter().map(|part| self.truth(part, binding)).collect();
                kleene(&truths, matches!(condition, Condition::Or(_)))
            }
            Condition::Not(inner) => self.truth(inner, binding).map(|holds| !holds),
            Condition::Imply(premise, conclusion) => {
                let premise = self.truth(premise, binding).map(|holds| !holds);
                kleene(&[premise, self.truth(conclusion, binding)], true)
            }
            Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
                let instances = self.objects.bindings(variables, binding);
                let truths: Vec<_> = instances.map(|mut inner| self.truth(body, &mut inner)).collect();
                kleene(&truths, matches!(condition, Condition::Exists(..)))
            }
            Condition::Atom(atom) => Some(self.facts.contains(&key(atom, binding))),
            Condition::Equal(left, right, _) => {
                let name = |side: &Term| match term(side, binding) {
                    Term::Variable(identifier) | Term::Constant(identifier) => identifier.name,
                };
                Some(name(left) == name(right))
            }
            Condition::Compare(operator, left, right, _) => {
                let (left, right) = (self.value(left, binding)?, self.value(right, binding)?);
                Some(match operator {
                    Comparison::Less => left < right,
                    Comparison::LessOrEqual => left <= right,
                    Comparison::Equal => left == right,
                    Comparison::GreaterOrEqual => left >= right,
                    Comparison::Greater => left > right,
                })
            }
        }
    }

    fn value(&self, expression: &Expression, binding: &Binding) -> Option<BigRational> {
        match expression {
            Expression::Number(number, _) => Some(number.clone()),
            Expression::Fluent(atom) => self.values.get(&key(atom, binding)).cloned(),
            Expression::Duration(_) | Expression::TotalTime(_) => None,
            Expression::Operation(operation, operands, _) => {
                let mut operands = operands.iter().map(|operand| self.value(operand, binding));
                let first = operands.next()??;
                let mut remaining = operands.peekable();
                if *operation == Arithmetic::Subtract && remaining.peek().is_none() {
                    return Some(-first);
                }
                remaining.try_fold(first, |left, right| {
                    let right = right?;
                    Some(match operation {
                        Arithmetic::Add => left + right,
                        Arithmetic::Subtract => left - right,
                        Arithmetic::Multiply => left * right,
                        Arithmetic::Divide if right.is_zero() => return None,
                        Arithmetic::Divide => left / right,
                    })
                })
            }
        }
    }
}

fn kleene(truths: &[Option<bool>], is_disjunction: bool) -> Option<bool> {
    if truths.contains(&Some(is_disjunction)) {
        return Some(is_disjunction);
    }
    if truths.contains(&None) { None } else { Some(!is_disjunction) }
}
