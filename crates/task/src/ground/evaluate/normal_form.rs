//! Residual conditions to conjunctive normal form.
//!
//! A disjunction of literals is a clause. Small ones of conjunctions are multiplied out; all others, and comparisons of
//! numbers inside disjunctions, get a name: a derived atom that holds where the part does. So no condition grows by more than a
//! constant factor.

use rustc_hash::FxHashMap;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::GroundAxiom;
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::world::World;
use crate::lifted::{ObjectId, PredicateId};
use crate::number::dense;

/// Disjunctions with more clauses than this are named rather than multiplied out.
const CLAUSE_LIMIT: usize = 16;

/// Parts of conditions that have a name, and the rules of all derived atoms.
#[derive(Debug, Default)]
pub struct Definitions {
    named: FxHashMap<Residual, AtomId>,
    pub(crate) axioms: Vec<GroundAxiom>,
}

impl Definitions {
    /// Conjunctive normal form; `Failure::Undefined` if the condition is false.
    pub(crate) fn condition(
        &mut self,
        world: &mut World<'_>,
        parts: &[Residual],
    ) -> Result<GroundCondition, Failure> {
        let mut condition = GroundCondition::default();
        for part in parts {
            self.conjoin(world, part, &mut condition)?;
        }
        if condition.tidy() { Ok(condition) } else { Err(Failure::Undefined) }
    }

    fn conjoin(
        &mut self,
        world: &mut World<'_>,
        residual: &Residual,
        condition: &mut GroundCondition,
    ) -> Result<(), Failure> {
        match residual {
            Residual::True => {}
            Residual::False => return Err(Failure::Undefined),
            Residual::And(parts) => {
                for part in parts {
                    self.conjoin(world, part, condition)?;
                }
            }
            Residual::Literal { atom, positive } => condition.literals.push((*atom, *positive)),
            Residual::Compare { linear, strict } => condition.comparisons.push((linear.clone(), *strict)),
            Residual::Or(parts) => {
                let multiplied = clauses(residual);
                for clause in multiplied.unwrap_or_else(|| vec![self.clause(world, parts)]) {
                    match clause[..] {
                        [] => return Err(Failure::Undefined),
                        [literal] => condition.literals.push(literal),
                        _ => condition.clauses.push(clause),
                    }
                }
            }
        }
        Ok(())
    }

    /// A clause with a literal for each part.
    fn clause(&mut self, world: &mut World<'_>, parts: &[Residual]) -> Vec<GroundLiteral> {
        let mut clause: Vec<_> = parts.iter().map(|part| self.literal(world, part)).collect();
        clause.sort_unstable();
        clause.dedup();
        clause
    }

    /// A literal that holds where the condition does: the condition itself, or a derived atom.
    pub(crate) fn literal(&mut self, world: &mut World<'_>, residual: &Residual) -> GroundLiteral {
        if let Residual::Literal { atom, positive } = residual {
            return (*atom, *positive);
        }
        if let Some(atom) = self.named.get(residual).copied() {
            return (atom, true);
        }
        let atom = self.name(world, residual.clone());
        self.define(world, atom, residual);
        (atom, true)
    }

    /// A fresh atom for a part of a condition.
    fn name(&mut self, world: &mut World<'_>, residual: Residual) -> AtomId {
        let predicate = PredicateId(dense(world.lifted.predicates.len()));
        let number = ObjectId(dense(self.named.len()));
        let atom = world.atom(predicate, &[number]);
        self.named.insert(residual, atom);
        atom
    }

    /// Adds rules by which an atom holds where the condition does.
    pub(crate) fn define(&mut self, world: &mut World<'_>, head: AtomId, residual: &Residual) {
        if let Residual::Or(parts) = residual {
            for part in parts {
                self.define(world, head, part);
            }
            return;
        }
        let parts =
            if let Residual::And(parts) = residual { &parts[..] } else { std::slice::from_ref(residual) };
        let mut body = GroundCondition::default();
        for part in parts {
            match part {
                Residual::True => {}
                Residual::False => return,
                Residual::Compare { linear, strict } => body.comparisons.push((linear.clone(), *strict)),
                _ => body.literals.push(self.literal(world, part)),
            }
        }
        if body.tidy() {
            self.axioms.push(GroundAxiom { head, body });
        }
    }
}

/// The clauses of a condition without numbers, by distribution; tautologies are left out. None if there are many.
fn clauses(residual: &Residual) -> Option<Vec<Vec<GroundLiteral>>> {
    match residual {
        Residual::True => Some(Vec::new()),
        Residual::False => Some(vec![Vec::new()]),
        Residual::Literal { atom, positive } => Some(vec![vec![(*atom, *positive)]]),
        Residual::And(parts) => {
            let mut all = Vec::new();
            for part in parts {
                all.extend(clauses(part)?);
            }
            Some(all)
        }
        Residual::Or(parts) => {
            let mut product: Vec<Vec<GroundLiteral>> = vec![Vec::new()];
            for part in parts {
                let more = clauses(part)?;
                if product.len().saturating_mul(more.len()) > CLAUSE_LIMIT {
                    return None;
                }
                let pairs = product.iter().flat_map(|left| more.iter().map(move |right| (left, right)));
                let mut next = Vec::new();
                for (left, right) in pairs {
                    let mut clause: Vec<_> = left.iter().chain(right).copied().collect();
                    clause.sort_unstable();
                    clause.dedup();
                    if clause.windows(2).all(|pair| pair[0].0 != pair[1].0) {
                        next.push(clause);
                    }
                }
                product = next;
            }
            Some(product)
        }
        Residual::Compare { .. } => None,
    }
}
