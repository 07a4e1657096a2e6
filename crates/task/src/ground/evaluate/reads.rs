//! What happenings read, by the rule of PDDL 2.1 that there are no moving targets \[1\].
//!
//! Everything that a condition or an effect mentions counts as read, whether or not it matters in a state: below a quantifier all
//! instances of an atom, below a derived predicate all that its axioms depend on.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 8.4.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::ground::vocabulary::atom::Binding;
use crate::lifted::{
    Bound, Change, Effect, Expression, Formula, FunctionId, Lifted, ObjectId, PredicateId, Term,
};

/// Atoms or functions with gaps where a quantifier runs through its objects; none for any arguments at all.
pub type Pattern<S> = (S, Option<Vec<Slot>>);

/// An argument of a pattern.
#[derive(Debug, Clone)]
pub enum Slot {
    Object(ObjectId),
    /// Each object that a quantifier runs through: the same wherever its variable stands.
    Each(u32, Arc<[ObjectId]>),
    /// Any object: a parameter that has none yet.
    Any,
}

/// Whether objects fit into the slots of a pattern.
pub fn fits(pattern: &[Slot], arguments: &[ObjectId]) -> bool {
    let same = |variable: u32, object: ObjectId| {
        let mut all = pattern.iter().zip(arguments);
        all.all(|(slot, other)| !matches!(slot, Slot::Each(own, _) if *own == variable) || *other == object)
    };
    let slot_fits = |(slot, object): (&Slot, &ObjectId)| match slot {
        Slot::Object(own) => own == object,
        Slot::Each(variable, objects) => objects.contains(object) && same(*variable, *object),
        Slot::Any => true,
    };
    pattern.len() == arguments.len() && pattern.iter().zip(arguments).all(slot_fits)
}

/// What is read, before it is looked up.
#[derive(Debug, Default)]
pub struct Reads {
    pub atoms: Vec<Pattern<PredicateId>>,
    pub numbers: Vec<Pattern<FunctionId>>,
    /// The variables of the quantifiers around, innermost last.
    scope: Vec<Bound>,
}

/// Whether a pattern stands for a symbol with arguments.
pub fn matches<S: PartialEq>(pattern: &Pattern<S>, symbol: &S, arguments: &[ObjectId]) -> bool {
    pattern.0 == *symbol && pattern.1.as_ref().is_none_or(|wanted| fits(wanted, arguments))
}

impl Reads {
    /// Adds what a condition mentions under a binding of the parameters.
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

    /// Adds what effects mention besides their targets.
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

    /// Adds what an expression mentions.
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

    /// What a condition mentions, whatever the arguments are.
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
