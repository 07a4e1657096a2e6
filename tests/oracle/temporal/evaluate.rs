//! Evaluation of conditions and expressions in a state, and the facts and numbers that they read.

use std::collections::HashMap;

use num_traits::Zero as _;

use super::happening::{Atoms, Happening, Obstacle, State, UNDEFINED, World, fit};
use super::model::{Comparison, Condition, Expression, Q};

impl World {
    fn atoms_of(&self, predicate: usize) -> Atoms {
        let count = self.task.objects.len().pow(self.task.predicates[predicate].1 as u32);
        ((1 << count) - 1) << self.atoms[predicate]
    }

    /// Returns for each derived predicate the atoms and numbers that its axioms mention, directly or through
    /// other derived predicates.
    pub(super) fn dependencies(&self) -> HashMap<usize, (Atoms, u64)> {
        let mut depends: HashMap<usize, (Atoms, u64)> =
            self.task.axioms.iter().map(|axiom| (axiom.predicate, (0, 0))).collect();
        for _ in 0..=self.task.axioms.len() {
            for axiom in &self.task.axioms {
                let mut mentions = (0, 0);
                self.mentioned(&axiom.condition, &depends, &mut mentions);
                let entry = depends.get_mut(&axiom.predicate).expect("derived");
                *entry = (entry.0 | mentions.0, entry.1 | mentions.1);
            }
        }
        depends
    }

    fn mentioned(
        &self,
        condition: &Condition,
        depends: &HashMap<usize, (Atoms, u64)>,
        mentions: &mut (Atoms, u64),
    ) {
        match condition {
            Condition::Atom(atom) => match depends.get(&atom.predicate) {
                Some((atoms, values)) => *mentions = (mentions.0 | atoms, mentions.1 | values),
                None => mentions.0 |= self.atoms_of(atom.predicate),
            },
            Condition::Same(..) => {}
            Condition::Compare(_, left, right) => {
                mentions.1 |= self.mentioned_values(left) | self.mentioned_values(right);
            }
            Condition::Not(part) | Condition::Forall(_, part) | Condition::Exists(_, part) => {
                self.mentioned(part, depends, mentions);
            }
            Condition::All(parts) | Condition::Any(parts) => {
                parts.iter().for_each(|part| self.mentioned(part, depends, mentions));
            }
            Condition::Imply(left, right) => {
                self.mentioned(left, depends, mentions);
                self.mentioned(right, depends, mentions);
            }
        }
    }

    fn mentioned_values(&self, expression: &Expression) -> u64 {
        match expression {
            Expression::Number(_) | Expression::Duration(_) => 0,
            Expression::Fluent(fluent) => {
                let count = self.task.objects.len().pow(self.task.functions[fluent.function].1 as u32);
                ((1 << count) - 1) << self.values[fluent.function]
            }
            Expression::Sum(left, right)
            | Expression::Product(left, right)
            | Expression::Quotient(left, right) => self.mentioned_values(left) | self.mentioned_values(right),
        }
    }

    /// Adds the derived atoms: the least fixpoint of the axioms, stratum by stratum.
    pub fn derived(&self, state: &State) -> Result<Atoms, Obstacle> {
        let mut atoms = state.atoms;
        for axiom in &self.task.axioms {
            let arity = self.task.predicates[axiom.predicate].1;
            let objects = self.task.objects.len();
            loop {
                let previous = atoms;
                for number in 0..objects.pow(arity as u32) {
                    // The arguments are the digits of `number` in the base of the number of objects.
                    let digit = |at: usize| number / objects.pow((arity - 1 - at) as u32) % objects;
                    let mut bound: Vec<usize> = (0..arity).map(digit).collect();
                    if self.holds_with(&axiom.condition, atoms, state, &mut bound)? {
                        atoms |= 1 << (self.atoms[axiom.predicate] + number);
                    }
                }
                if atoms == previous {
                    break;
                }
            }
        }
        Ok(atoms)
    }

    /// Evaluates a condition. `bound` contains the objects of the variables.
    pub fn holds(&self, condition: &Condition, state: &State, bound: &[usize]) -> Result<bool, Obstacle> {
        let atoms = self.derived(state)?;
        self.holds_with(condition, atoms, state, &mut bound.to_vec())
    }

    pub(super) fn holds_with(
        &self,
        condition: &Condition,
        atoms: Atoms,
        state: &State,
        bound: &mut Vec<usize>,
    ) -> Result<bool, Obstacle> {
        let mut evaluate_all = |parts: &[Condition]| {
            parts.iter().map(|part| self.holds_with(part, atoms, state, bound)).collect::<Result<Vec<_>, _>>()
        };
        Ok(match condition {
            Condition::Atom(atom) => atoms & (1 << self.atom(atom, bound)) != 0,
            Condition::Same(left, right) => self.index(0, &[*left], bound) == self.index(0, &[*right], bound),
            Condition::Compare(comparison, left, right) => {
                let (left, right) = (self.value(left, state, bound)?, self.value(right, state, bound)?);
                match comparison {
                    Comparison::Less => left < right,
                    Comparison::AtMost => left <= right,
                    Comparison::Equal => left == right,
                    Comparison::AtLeast => left >= right,
                    Comparison::Greater => left > right,
                }
            }
            Condition::Not(part) => !self.holds_with(part, atoms, state, bound)?,
            Condition::All(parts) => evaluate_all(parts)?.into_iter().all(|part| part),
            Condition::Any(parts) => evaluate_all(parts)?.into_iter().any(|part| part),
            Condition::Imply(left, right) => {
                let left = self.holds_with(left, atoms, state, bound)?;
                let right = self.holds_with(right, atoms, state, bound)?;
                !left || right
            }
            Condition::Forall(kind, part) => {
                self.instances_of(*kind, part, (atoms, state), bound)?.into_iter().all(|part| part)
            }
            Condition::Exists(kind, part) => {
                self.instances_of(*kind, part, (atoms, state), bound)?.into_iter().any(|part| part)
            }
        })
    }

    fn instances_of(
        &self,
        kind: usize,
        part: &Condition,
        (atoms, state): (Atoms, &State),
        bound: &mut Vec<usize>,
    ) -> Result<Vec<bool>, Obstacle> {
        let mut results = Vec::new();
        for object in self.of_type(kind) {
            bound.push(object);
            let result = self.holds_with(part, atoms, state, bound);
            bound.pop();
            results.push(result?);
        }
        Ok(results)
    }

    pub fn value(&self, expression: &Expression, state: &State, bound: &[usize]) -> Result<Q, Obstacle> {
        let pair = |left: &Expression, right: &Expression| {
            Ok((self.value(left, state, bound)?, self.value(right, state, bound)?))
        };
        fit(match expression {
            Expression::Number(value) => *value,
            Expression::Fluent(fluent) => state.values[self.value_index(fluent, bound)].ok_or(UNDEFINED)?,
            Expression::Sum(left, right) => pair(left, right).map(|(left, right)| left + right)?,
            Expression::Duration(duration) => self.value(duration, state, bound)?,
            Expression::Product(left, right) => pair(left, right).map(|(left, right)| left * right)?,
            Expression::Quotient(left, right) => {
                let (left, right) = pair(left, right)?;
                if right.is_zero() { Err(UNDEFINED)? } else { left / right }
            }
        })
    }

    /// Adds to `reads` the facts and numbers that a condition mentions, even if they do not influence its
    /// truth value.
    pub(super) fn read(&self, condition: &Condition, bound: &mut Vec<usize>, reads: &mut Happening) {
        match condition {
            Condition::Atom(atom) => match self.depends.get(&atom.predicate) {
                Some((atoms, values)) => {
                    reads.reads |= atoms;
                    reads.reads_values |= values;
                }
                None => reads.reads |= 1 << self.atom(atom, bound),
            },
            Condition::Same(..) => {}
            Condition::Compare(_, left, right) => {
                self.read_values(left, bound, reads);
                self.read_values(right, bound, reads);
            }
            Condition::Not(part) => self.read(part, bound, reads),
            Condition::All(parts) | Condition::Any(parts) => {
                parts.iter().for_each(|part| self.read(part, bound, reads));
            }
            Condition::Imply(left, right) => {
                self.read(left, bound, reads);
                self.read(right, bound, reads);
            }
            Condition::Forall(kind, part) | Condition::Exists(kind, part) => {
                for object in self.of_type(*kind) {
                    bound.push(object);
                    self.read(part, bound, reads);
                    bound.pop();
                }
            }
        }
    }

    pub(super) fn read_values(&self, expression: &Expression, bound: &[usize], reads: &mut Happening) {
        match expression {
            // A duration is fixed at the start and its operands are static.
            Expression::Number(_) | Expression::Duration(_) => {}
            Expression::Fluent(fluent) => reads.reads_values |= 1 << self.value_index(fluent, bound),
            Expression::Sum(left, right)
            | Expression::Product(left, right)
            | Expression::Quotient(left, right) => {
                self.read_values(left, bound, reads);
                self.read_values(right, bound, reads);
            }
        }
    }
}
