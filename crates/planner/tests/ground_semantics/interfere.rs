//! Interference of happenings: one happening writes an atom or number that the other reads, or both write it
//! in ways that do not commute.

use std::collections::BTreeSet;

use crate::ground_semantics::interpret::{Change, Changes, objects, with};
use crate::ground_semantics::model::{Atom, DERIVED, Effect, Expression, Formula, PREDICATES, Task, UPPER};

#[derive(Debug, Default)]
pub struct Touch {
    facts: BTreeSet<Atom>,
    /// All atoms of these predicates count as read.
    predicates: BTreeSet<usize>,
    values: BTreeSet<Atom>,
    /// All values of these functions count as read.
    functions: BTreeSet<usize>,
    pub added: BTreeSet<Atom>,
    pub deleted: BTreeSet<Atom>,
    /// Each number with the kind of change: assignment, addition or scaling.
    changed: BTreeSet<(Atom, u8)>,
}

impl Touch {
    pub fn reads_of_formula(&mut self, task: &Task, formula: &Formula, scope: &[usize]) {
        match formula {
            Formula::Fact(predicate, terms) => {
                if DERIVED.contains(predicate) || *predicate == UPPER {
                    self.below(task, *predicate);
                }
                self.facts.insert((*predicate, objects(terms, scope)));
            }
            Formula::Equal(..) => {}
            Formula::Compare(_, left, right) => {
                self.reads_of_expression(left, scope);
                self.reads_of_expression(right, scope);
            }
            Formula::Not(inner) => self.reads_of_formula(task, inner, scope),
            Formula::And(parts) | Formula::Or(parts) => {
                for part in parts {
                    self.reads_of_formula(task, part, scope);
                }
            }
            Formula::Imply(left, right) => {
                self.reads_of_formula(task, left, scope);
                self.reads_of_formula(task, right, scope);
            }
            Formula::Exists(range, body) | Formula::ForAll(range, body) => {
                for object in range.objects() {
                    self.reads_of_formula(task, body, &with(scope, *object));
                }
            }
        }
    }

    pub fn reads_of_effect(&mut self, task: &Task, effect: &Effect, scope: &[usize]) {
        match effect {
            Effect::And(parts) => {
                for part in parts {
                    self.reads_of_effect(task, part, scope);
                }
            }
            Effect::Add(..) | Effect::Delete(..) => {}
            Effect::Change(.., value) => self.reads_of_expression(value, scope),
            Effect::When(condition, body) => {
                self.reads_of_formula(task, condition, scope);
                self.reads_of_effect(task, body, scope);
            }
            Effect::ForAll(range, body) => {
                for object in range.objects() {
                    self.reads_of_effect(task, body, &with(scope, *object));
                }
            }
        }
    }

    pub fn reads_of_expression(&mut self, expression: &Expression, scope: &[usize]) {
        match expression {
            Expression::Number(_) | Expression::Duration | Expression::TotalTime => {}
            Expression::Function(function, terms) => {
                self.values.insert((*function, objects(terms, scope)));
            }
            Expression::Sum(parts) => {
                for part in parts {
                    self.reads_of_expression(part, scope);
                }
            }
            Expression::Negative(inner) => self.reads_of_expression(inner, scope),
            Expression::Difference(left, right)
            | Expression::Product(left, right)
            | Expression::Quotient(left, right) => {
                self.reads_of_expression(left, scope);
                self.reads_of_expression(right, scope);
            }
        }
    }

    fn below(&mut self, task: &Task, predicate: usize) {
        if !self.predicates.insert(predicate) {
            return;
        }
        for (_, body) in task.axioms.iter().filter(|(head, _)| *head == predicate) {
            let mut inner = Self { predicates: self.predicates.clone(), ..Self::default() };
            // Variables may denote any object, so only the predicates and functions are recorded.
            inner.reads_of_formula(task, body, &vec![0; PREDICATES[predicate].1]);
            self.functions.extend(inner.values.iter().map(|(function, _)| *function));
            self.functions.extend(inner.functions);
            for (read, _) in &inner.facts {
                self.below(task, *read);
            }
            self.predicates.extend(inner.predicates);
        }
    }

    pub fn writes(&mut self, changes: &Changes) {
        self.added.extend(changes.added.iter().cloned());
        self.deleted.extend(changes.deleted.iter().cloned());
        self.changed.extend(changes.values.iter().map(|(target, change)| {
            let way = match change {
                Change::Assign(_) => 0,
                Change::Add(_) => 1,
                Change::Scale(_) => 2,
            };
            (target.clone(), way)
        }));
    }

    pub fn disturbs(&self, other: &Self) -> bool {
        let is_read = |atom: &Atom| other.facts.contains(atom) || other.predicates.contains(&atom.0);
        let is_read_number = |atom: &Atom| other.values.contains(atom) || other.functions.contains(&atom.0);
        let clashes = |(target, way): &(Atom, u8)| {
            let mut others = other.changed.iter().filter(|(other, _)| other == target);
            others.any(|(_, other)| way != other || *way == 0)
        };
        self.added.iter().chain(&self.deleted).any(is_read)
            || self.added.iter().any(|atom| other.deleted.contains(atom))
            || self.changed.iter().any(|(atom, _)| is_read_number(atom))
            || self.changed.iter().any(clashes)
    }
}
