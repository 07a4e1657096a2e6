//! `CaDiCaL` \[1\] back end. Callbacks count learnt clauses and stop the solver at a limit.
//!
//! \[1\] A. Biere, T. Faller, K. Fazekas, M. Fleury, N. Froleyks, F. Pollitt: `CaDiCaL` 2.0, CAV 2024.

use task::limits::Limits;

use crate::sat::solver::{Answer, Lit, Solver};

pub(super) struct Cadical {
    solver: cadical::Solver<Watch>,
    assignment: Vec<bool>,
    variables: u32,
    conflicts: u64,
    core: Vec<Lit>,
}

struct Watch {
    limits: Limits,
    budget: u64,
    conflicts: u64,
}

impl cadical::Callbacks for Watch {
    fn terminate(&mut self) -> bool {
        self.conflicts > self.budget || self.limits.reached()
    }

    fn max_length(&self) -> i32 {
        i32::MAX
    }

    fn learn(&mut self, _: &[i32]) {
        self.conflicts += 1;
    }
}

impl Cadical {
    pub(super) fn new(limits: &Limits, budget: u64) -> Self {
        let mut solver = cadical::Solver::new();
        solver.set_callbacks(Some(Watch { limits: limits.clone(), budget, conflicts: 0 }));
        Self { solver, assignment: Vec::new(), variables: 0, conflicts: 0, core: Vec::new() }
    }
}

impl Solver for Cadical {
    fn add_clause(&mut self, clause: &[Lit]) {
        for literal in clause {
            self.variables = self.variables.max(literal.variable() + 1);
        }
        self.solver.add_clause(clause.iter().map(|literal| literal.dimacs()));
    }

    fn solve(&mut self, assumptions: &[Lit]) -> Answer {
        self.core.clear();
        for literal in assumptions {
            self.variables = self.variables.max(literal.variable() + 1);
        }
        let answer = self.solver.solve_with(assumptions.iter().map(|literal| literal.dimacs()));
        self.conflicts = self.solver.get_callbacks().map_or(0, |watch| watch.conflicts);
        match answer {
            Some(true) => {
                let value = |variable| self.solver.value(Lit::positive(variable).dimacs()) == Some(true);
                self.assignment = (0..self.variables).map(value).collect();
                Answer::Satisfiable
            }
            Some(false) => {
                let failed = assumptions.iter().filter(|literal| self.solver.failed(literal.dimacs()));
                self.core.extend(failed);
                Answer::Unsatisfiable
            }
            None => Answer::Interrupted,
        }
    }

    fn core(&self) -> &[Lit] {
        &self.core
    }

    fn value(&self, variable: u32) -> bool {
        self.assignment.get(variable as usize).copied().unwrap_or(false)
    }

    fn conflicts(&self) -> u64 {
        self.conflicts
    }
}
