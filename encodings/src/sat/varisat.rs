//! Varisat [1] as a back end.
//!
//! Varisat has no way to be interrupted. It streams its proof, though, and stops at once when the stream reports an
//! error; so the proof goes to a sink that counts learnt clauses and fails when a limit is reached.
//!
//! \[1\] J. Harder: Varisat, <https://jix.github.io/varisat/>.

use std::cell::Cell;
use std::io;
use std::rc::Rc;

use varisat::ExtendFormula as _;

use crate::limits::Limits;
use crate::sat::{Answer, Lit, Solver};

/// A Varisat solver.
pub(super) struct Varisat {
    solver: varisat::Solver<'static>,
    conflicts: Rc<Cell<u64>>,
    assignment: Vec<bool>,
    buffer: Vec<varisat::Lit>,
}

impl Varisat {
    /// A solver that gives up at a limit, or after learning `budget` clauses.
    pub(super) fn new(limits: &Limits, budget: u64) -> Self {
        Self::with_proof(limits, budget, Box::new(io::sink()))
    }

    /// As [`Varisat::new`], with the DRAT proof written somewhere.
    pub(super) fn with_proof(limits: &Limits, budget: u64, proof: Box<dyn io::Write>) -> Self {
        let conflicts = Rc::new(Cell::new(0));
        let sink = CountingSink {
            limits: limits.clone(),
            budget,
            conflicts: Rc::clone(&conflicts),
            at_line_start: true,
            proof,
        };
        let mut solver = varisat::Solver::new();
        solver.write_proof(sink, varisat::ProofFormat::Drat);
        Self { solver, conflicts, assignment: Vec::new(), buffer: Vec::new() }
    }
}

/// Refutes clauses over variables numbered from 1, or finds that they have a model; the proof is in DRAT.
pub(crate) fn refute_with_proof<'c>(
    clauses: impl Iterator<Item = &'c [i32]>,
    proof: Box<dyn io::Write>,
    limits: &Limits,
    budget: u64,
) -> Answer {
    let mut solver = Varisat::with_proof(limits, budget, proof);
    for clause in clauses {
        let literals: Vec<varisat::Lit> =
            clause.iter().map(|literal| varisat::Lit::from_dimacs(*literal as isize)).collect();
        solver.solver.add_clause(&literals);
    }
    let answer = solver.solve();
    match solver.solver.close_proof() {
        Ok(()) => answer,
        Err(_) => Answer::Interrupted,
    }
}

impl Solver for Varisat {
    fn add_clause(&mut self, clause: &[Lit]) {
        self.buffer.clear();
        self.buffer
            .extend(clause.iter().map(|l| varisat::Lit::from_index(l.variable() as usize, l.is_positive())));
        self.solver.add_clause(&self.buffer);
    }

    fn solve(&mut self) -> Answer {
        match self.solver.solve() {
            Ok(true) => {
                self.assignment.clear();
                for literal in self.solver.model().unwrap_or_default() {
                    let variable = literal.index();
                    if self.assignment.len() <= variable {
                        self.assignment.resize(variable + 1, false);
                    }
                    self.assignment[variable] = literal.is_positive();
                }
                Answer::Satisfiable
            }
            Ok(false) => Answer::Unsatisfiable,
            Err(_) => Answer::Interrupted,
        }
    }

    fn value(&self, variable: u32) -> bool {
        self.assignment.get(variable as usize).copied().unwrap_or(false)
    }

    fn conflicts(&self) -> u64 {
        self.conflicts.get()
    }
}

/// Passes a DRAT proof on, counts the clauses that it adds, and fails when a limit or the budget is reached.
struct CountingSink {
    limits: Limits,
    budget: u64,
    conflicts: Rc<Cell<u64>>,
    at_line_start: bool,
    proof: Box<dyn io::Write>,
}

impl io::Write for CountingSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.limits.reached() || self.conflicts.get() > self.budget {
            return Err(io::Error::other("limit reached"));
        }
        let mut added = 0;
        for byte in bytes {
            added += u64::from(self.at_line_start && *byte != b'd');
            self.at_line_start = *byte == b'\n';
        }
        self.conflicts.set(self.conflicts.get() + added);
        self.proof.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.proof.flush()
    }
}
