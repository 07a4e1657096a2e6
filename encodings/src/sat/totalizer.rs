//! Cardinality constraints by the totalizer \[1\] of `RustSAT`, which is extended incrementally
//! \[2\].
//!
//! \[1\] O. Bailleux, Y. Boufkhad: Efficient CNF encoding of Boolean cardinality constraints, CP 2003.
//! \[2\] R. Martins, S. Joshi, V. Manquinho, I. Lynce: Incremental cardinality constraints for
//! `MaxSAT`, CP 2014.

use rustsat::encodings::card::{BoundUpper as _, BoundUpperIncremental as _, Totalizer as Tree};
use rustsat::instances::{BasicVarManager, Cnf, ManageVars as _};
use rustsat::types::{Lit as TreeLit, Var};

use crate::sat::solver::Lit;

/// Totalizer: defines literals that compare the number of true input literals with constants.
pub struct Totalizer {
    tree: Tree,
    literals: usize,
}

impl Totalizer {
    pub fn new(literals: &[Lit]) -> Self {
        let inputs = literals.iter().map(|l| TreeLit::new(l.variable(), !l.is_positive()));
        Self { tree: inputs.collect(), literals: literals.len() }
    }

    /// Returns a literal that is implied if more than `count` of the input literals are true.
    /// Returns `None` if there are at most `count` input literals, or memory is lacking. New
    /// variables are numbered from `variables` on, which is increased; their defining clauses are
    /// passed to `add`.
    pub fn more_than(
        &mut self,
        count: usize,
        variables: &mut u32,
        mut add: impl FnMut(&[Lit]),
    ) -> Option<Lit> {
        if count >= self.literals {
            return None;
        }
        let mut manager = BasicVarManager::from_next_free(Var::new(*variables));
        let mut clauses = Cnf::new();
        // The only error is that memory for the clauses could not be reserved. It is not expected,
        // because the formula limits the number of clauses.
        self.tree.encode_ub_change(count..=count, &mut clauses, &mut manager).ok()?;
        *variables = manager.n_used();
        let translate = |literal: &TreeLit| Lit::new(literal.vidx32(), literal.is_pos());
        for clause in &clauses {
            let clause: Vec<Lit> = clause.iter().map(translate).collect();
            add(&clause);
        }
        self.tree.enforce_ub(count).ok()?.first().map(|literal| !translate(literal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sat::{Answer, Backend};
    use task::limits::Limits;

    #[test]
    fn more_than_compares_the_number_of_true_literals() {
        for size in 2..6_u32 {
            let literals: Vec<Lit> = (0..size).map(|variable| Lit::new(variable, variable != 1)).collect();
            let mut totalizer = Totalizer::new(&literals);
            let mut solver = Backend::default().start(&Limits::none(), u64::MAX);
            let mut variables = size;
            for count in 1..size as usize {
                let exceeds = totalizer.more_than(count, &mut variables, |clause| solver.add_clause(clause));
                let exceeds = exceeds.expect("the count can be exceeded");
                for bits in 0..1_u32 << size {
                    let assigned = |at: u32| {
                        if bits >> at & 1 == 1 { literals[at as usize] } else { !literals[at as usize] }
                    };
                    let mut assumptions: Vec<Lit> = (0..size).map(assigned).collect();
                    assumptions.push(!exceeds);
                    let satisfiable = solver.solve(&assumptions) == Answer::Satisfiable;
                    assert_eq!(satisfiable, bits.count_ones() as usize <= count, "{bits:b}, {count}");
                }
            }
            assert!(totalizer.more_than(size as usize, &mut variables, |_| {}).is_none());
        }
    }
}
