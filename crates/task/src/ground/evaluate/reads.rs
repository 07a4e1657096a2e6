//! Computes the fluents and atoms that the start or end of an action reads. The rule of no moving targets in
//! PDDL 2.1 \[1\] forbids that a simultaneous happening changes them.
//!
//! Every atom and fluent in a condition, in the condition of an effect or in an assigned value counts as read,
//! even if its value does not matter in a state. This includes all instances of an atom below a quantifier, and
//! everything that the axioms of a derived predicate read.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 8.4.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::ground::vocabulary::atom::Binding;
use crate::lifted::{
    Bound, Change, Effect, Expression, Formula, FunctionId, Lifted, ObjectId, PredicateId, Term,
};

/// Pattern of atoms or numeric fluents: a predicate or function with its arguments, in which quantified variables are
/// placeholders. `None` as arguments matches all arguments.
pub type Pattern<S> = (S, Option<Vec<Slot>>);

/// An argument of a pattern.
#[derive(Debug, Clone)]
pub enum Slot {
    /// Exactly this object.
    Object(ObjectId),
    /// A quantified variable and its candidate objects. All occurrences of the variable match the same
    /// object.
    Each(u32, Arc<[ObjectId]>),
    /// Any object, for an unbound parameter.
    Any,
}

/// Returns `true` if the arguments match the slots of a pattern.
pub fn fits(pattern: &[Slot], arguments: &[ObjectId]) -> bool {
    let is_consistent = |variable: u32, object: ObjectId| {
        let mut pairs = pattern.iter().zip(arguments);
        pairs.all(|(slot, other)| !matches!(slot, Slot::Each(own, _) if *own == variable) || *other == object)
    };
    let slot_fits = |(slot, object): (&Slot, &ObjectId)| match slot {
        Slot::Object(own) => own == object,
        Slot::Each(variable, objects) => objects.contains(object) && is_consistent(*variable, *object),
        Slot::Any => true,
    };
    pattern.len() == arguments.len() && pattern.iter().zip(arguments).all(slot_fits)
}

/// Patterns of the atoms and numeric fluents that a condition, expression or effect reads.
#[derive(Debug, Default)]
pub struct Reads {
    pub atoms: Vec<Pattern<PredicateId>>,
    pub numbers: Vec<Pattern<FunctionId>>,
    /// Variables of the enclosing quantifiers; the innermost quantifier comes last.
    scope: Vec<Bound>,
}

/// Returns `true` if the pattern matches the symbol with these arguments.
pub fn matches<S: PartialEq>(pattern: &Pattern<S>, symbol: &S, arguments: &[ObjectId]) -> bool {
    pattern.0 == *symbol && pattern.1.as_ref().is_none_or(|wanted| fits(wanted, arguments))
}

impl Reads {
    /// Adds all atoms and fluents that a condition reads under a binding of the parameters.
    pub fn condition(&mut self, lifted: &Lifted, formula: &Formula, binding: &Binding) {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => {
                for part in parts {
                    self.condition(lifted, part, binding);
                }
            }
            Formula::Exists(bound, body) | Formula::ForAll(bound, body) => {
                let outer = self.scope.len();
                self.scope.extend(bound.iter().cloned());
                self.condition(lifted, body, binding);
                self.scope.truncate(outer);
            }
            Formula::Literal { predicate, terms, .. } => {
                if lifted.predicates[predicate.index()].derived {
                    self.through_axioms(lifted, *predicate);
                }
                let arguments = self.arguments(terms, binding);
                self.atoms.push((*predicate, Some(arguments)));
            }
            Formula::Equal { .. } => {}
            Formula::Compare(_, left, right, _) => {
                self.expression(left, binding);
                self.expression(right, binding);
            }
        }
    }

    /// Adds all atoms and fluents that the conditions and assigned values of effects read. The changed atoms
    /// and fluents themselves are not added.
    pub fn effects(&mut self, lifted: &Lifted, effects: &[Effect], binding: &Binding) {
        for effect in effects {
            let outer = self.scope.len();
            self.scope.extend(effect.bound.iter().cloned());
            self.condition(lifted, &effect.condition, binding);
            if let Change::Assign { expression, .. } = &effect.change {
                self.expression(expression, binding);
            }
            self.scope.truncate(outer);
        }
    }

    /// Adds the fluents that an expression reads.
    pub fn expression(&mut self, expression: &Expression, binding: &Binding) {
        match expression {
            Expression::Number(_) | Expression::TotalTime => {}
            Expression::Function(function, terms, _) => {
                let arguments = self.arguments(terms, binding);
                self.numbers.push((*function, Some(arguments)));
            }
            Expression::Negate(inner) => self.expression(inner, binding),
            Expression::Sum(parts) | Expression::Product(parts, _) => {
                for part in parts {
                    self.expression(part, binding);
                }
            }
            Expression::Quotient(left, right, _) => {
                self.expression(left, binding);
                self.expression(right, binding);
            }
        }
    }

    fn through_axioms(&mut self, lifted: &Lifted, predicate: PredicateId) {
        let (mut open, mut seen) = (vec![predicate], FxHashSet::default());
        while let Some(predicate) = open.pop() {
            for axiom in lifted.axioms.iter().filter(|axiom| axiom.predicate == predicate) {
                let mut below = Self::default();
                // The analysis does not relate the arguments of the body to those of the head, so any arguments count
                // as read.
                below.literals(&axiom.condition);
                for (predicate, _) in below.atoms {
                    if seen.insert(predicate) {
                        self.atoms.push((predicate, None));
                        open.push(predicate);
                    }
                }
                self.numbers.extend(below.numbers.into_iter().map(|(function, _)| (function, None)));
            }
        }
    }

    fn literals(&mut self, formula: &Formula) {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => parts.iter().for_each(|part| self.literals(part)),
            Formula::Exists(_, body) | Formula::ForAll(_, body) => self.literals(body),
            Formula::Literal { predicate, .. } => self.atoms.push((*predicate, None)),
            Formula::Equal { .. } => {}
            Formula::Compare(_, left, right, _) => {
                let nothing = Binding::new();
                self.expression(left, &nothing);
                self.expression(right, &nothing);
            }
        }
    }

    fn arguments(&self, terms: &[Term], binding: &Binding) -> Vec<Slot> {
        let slot = |term: &Term| match term {
            Term::Object(object) => Slot::Object(*object),
            Term::Parameter(parameter) => match binding.get(*parameter as usize).copied().flatten() {
                Some(object) => Slot::Object(object),
                None => match self.scope.iter().rfind(|bound| bound.variable == *parameter) {
                    Some(bound) => Slot::Each(*parameter, bound.candidates.clone()),
                    None => Slot::Any,
                },
            },
        };
        terms.iter().map(slot).collect()
    }
}
