//! Converts residual conditions, i.e. partially evaluated conditions, to conjunctive normal form (CNF).
//!
//! A disjunction of literals is a clause. Small disjunctions of conjunctions are distributed. Larger
//! disjunctions, and disjunctions with comparisons, get auxiliary derived atoms for their parts (Tseitin
//! transformation), so that conditions grow by at most a constant factor.

use rustc_hash::FxHashMap;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::GroundAxiom;
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::world::World;
use crate::lifted::{ObjectId, PredicateId};
use crate::number::dense;

/// Limit on the number of clauses that distributing a disjunction may produce. Larger disjunctions get
/// auxiliary atoms.
const CLAUSE_LIMIT: usize = 16;

/// Auxiliary derived atoms that represent subconditions, and the rules of all derived atoms.
#[derive(Debug, Default)]
pub struct Definitions {
    named: FxHashMap<Residual, AtomId>,
    pub(crate) axioms: Vec<GroundAxiom>,
}

impl Definitions {
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

    fn clause(&mut self, world: &mut World<'_>, parts: &[Residual]) -> Vec<GroundLiteral> {
        let mut clause: Vec<_> = parts.iter().map(|part| self.literal(world, part)).collect();
        clause.sort_unstable();
        clause.dedup();
        clause
    }

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

    fn name(&mut self, world: &mut World<'_>, residual: Residual) -> AtomId {
        // Auxiliary atoms use the first predicate id after those of the declared predicates.
        let predicate = PredicateId(dense(world.lifted.predicates.len()));
        let number = ObjectId(dense(self.named.len()));
        let atom = world.atom(predicate, &[number]);
        self.named.insert(residual, atom);
        atom
    }

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

/// Distributes a condition without comparisons to CNF clauses, without tautologies. Returns `None` if there
/// is a comparison, or if distributing a disjunction gives more than `CLAUSE_LIMIT` clauses (before tautologies are
/// dropped).
fn clauses(residual: &Residual) -> Option<Vec<Vec<GroundLiteral>>> {
    match residual {
        Residual::True => Some(Vec::new()),
        Residual::False => Some(vec![Vec::new()]),
        Residual::Literal { atom, positive } => Some(vec![vec![(*atom, *positive)]]),
        Residual::And(parts) => {
            let mut clauses_of_parts = Vec::new();
            for part in parts {
                clauses_of_parts.extend(clauses(part)?);
            }
            Some(clauses_of_parts)
        }
        Residual::Or(parts) => {
            let mut product: Vec<Vec<GroundLiteral>> = vec![Vec::new()];
            for part in parts {
                let clauses_of_part = clauses(part)?;
                if product.len().saturating_mul(clauses_of_part.len()) > CLAUSE_LIMIT {
                    return None;
                }
                let pairs =
                    product.iter().flat_map(|left| clauses_of_part.iter().map(move |right| (left, right)));
                let mut next = Vec::new();
                for (left, right) in pairs {
                    let mut clause: Vec<_> = left.iter().chain(right).copied().collect();
                    clause.sort_unstable();
                    clause.dedup();
                    // A clause that contains an atom and its negation is a tautology.
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
