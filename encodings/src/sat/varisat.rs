//! Varisat \[1\] back end.
//!
//! Varisat has no function for interrupting it. But it streams its proof, and stops if writing the
//! proof fails. The proof therefore goes to a sink that counts learnt clauses and fails at a limit. The
//! proof has Varisat's own format, because DRAT supports neither assumptions nor clauses
//! that are added later.
//!
//! Answers under assumptions are correct. But after the first call that is unsatisfiable because of its
//! assumptions, stale marks inside the solver may put wrong assumptions into a core. Each later core is
//! therefore confirmed by one more call. If this call finds an assignment, a new solver with the same clauses
//! computes the core.
//!
//! \[1\] J. Harder: Varisat, <https://jix.github.io/varisat/>.

use std::cell::Cell;
use std::io;
use std::rc::Rc;

use task::limits::Limits;
use task::number::dense;
use varisat::ExtendFormula as _;

use crate::sat::solver::{Answer, Lit, Solver};

pub(super) struct Varisat {
    solver: varisat::Solver<'static>,
    /// `true` if an earlier call was unsatisfiable because of assumptions; later cores need
    /// confirmation.
    failed: bool,
    /// `true` if the deadline, an interruption or the conflict budget stopped a call. Varisat must not be
    /// called again then, since it would panic.
    interrupted: bool,
    limits: Limits,
    budget: u64,
    conflicts: Rc<Cell<u64>>,
    literals: Vec<varisat::Lit>,
    ends: Vec<usize>,
    assignment: Vec<bool>,
    core: Vec<Lit>,
}

impl Varisat {
    pub(super) fn new(limits: &Limits, budget: u64) -> Self {
        let conflicts = Rc::new(Cell::new(0));
        Self {
            solver: start(limits, budget, &conflicts),
            failed: false,
            interrupted: false,
            limits: limits.clone(),
            budget,
            conflicts,
            literals: Vec::new(),
            ends: Vec::new(),
            assignment: Vec::new(),
            core: Vec::new(),
        }
    }

    /// Decides the clauses under assumptions by a single call of Varisat, without confirming the
    /// core.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn ask(&mut self, assumptions: &[Lit]) -> Answer {
        if self.interrupted {
            return Answer::Interrupted;
        }
        let assumed: Vec<varisat::Lit> = assumptions.iter().copied().map(translate).collect();
        self.solver.assume(&assumed);
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
            Ok(false) => {
                self.core.clear();
                let failed = self.solver.failed_core().unwrap_or_default().iter();
                self.core
                    .extend(failed.map(|literal| Lit::new(dense(literal.index()), literal.is_positive())));
                self.failed |= !self.core.is_empty();
                Answer::Unsatisfiable
            }
            Err(_) => {
                self.interrupted = true;
                Answer::Interrupted
            }
        }
    }

    fn renew(&mut self) {
        self.solver = start(&self.limits, self.budget, &self.conflicts);
        let mut begin = 0;
        for end in &self.ends {
            self.solver.add_clause(&self.literals[begin..*end]);
            begin = *end;
        }
        self.failed = false;
    }
}

fn start(limits: &Limits, budget: u64, conflicts: &Rc<Cell<u64>>) -> varisat::Solver<'static> {
    let mut solver = varisat::Solver::new();
    let (limits, conflicts) = (limits.clone(), Rc::clone(conflicts));
    let sink = BudgetSink { limits, budget, conflicts, steps: Steps::default() };
    solver.write_proof(sink, varisat::ProofFormat::Varisat);
    solver
}

fn translate(literal: Lit) -> varisat::Lit {
    varisat::Lit::from_index(literal.variable() as usize, literal.is_positive())
}

/// Decides DIMACS clauses with Varisat, and writes a DRAT proof to `proof`. The proof is a refutation if the
/// answer is `Unsatisfiable`. Returns `Interrupted` if the deadline has passed, the run is interrupted, the
/// proof adds more than `budget` clauses, or the proof cannot be written.
pub fn refute_with_proof(
    clauses: impl Iterator<Item = impl Iterator<Item = i32>>,
    proof: Box<dyn io::Write>,
    limits: &Limits,
    budget: u64,
) -> Answer {
    let mut solver = varisat::Solver::new();
    let sink = DratSink { limits: limits.clone(), budget, conflicts: 0, at_line_start: true, proof };
    solver.write_proof(sink, varisat::ProofFormat::Drat);
    for clause in clauses {
        let literals: Vec<varisat::Lit> =
            clause.map(|literal| varisat::Lit::from_dimacs(literal as isize)).collect();
        solver.add_clause(&literals);
    }
    let answer = solver.solve();
    match (answer, solver.close_proof()) {
        (Ok(true), Ok(())) => Answer::Satisfiable,
        (Ok(false), Ok(())) => Answer::Unsatisfiable,
        _ => Answer::Interrupted,
    }
}

impl Solver for Varisat {
    fn add_clause(&mut self, clause: &[Lit]) {
        let begin = self.literals.len();
        self.literals.extend(clause.iter().copied().map(translate));
        self.ends.push(self.literals.len());
        self.solver.add_clause(&self.literals[begin..]);
    }

    fn solve(&mut self, assumptions: &[Lit]) -> Answer {
        let doubtful = self.failed;
        let answer = self.ask(assumptions);
        if answer != Answer::Unsatisfiable || self.core.is_empty() || !doubtful {
            return answer;
        }
        let core = std::mem::take(&mut self.core);
        match self.ask(&core) {
            Answer::Unsatisfiable => {
                self.core = core;
                Answer::Unsatisfiable
            }
            Answer::Satisfiable => {
                self.renew();
                self.ask(assumptions)
            }
            Answer::Interrupted => Answer::Interrupted,
        }
    }

    fn core(&self) -> &[Lit] {
        &self.core
    }

    fn value(&self, variable: u32) -> bool {
        self.assignment.get(variable as usize).copied().unwrap_or(false)
    }

    fn conflicts(&self) -> u64 {
        self.conflicts.get()
    }
}

/// Position within a step of Varisat's proof format, in which all data are numbers.
#[derive(Clone, Copy)]
enum Part {
    /// The code of a step is next.
    Code,
    /// The length of a list is next. Each item consists of `each` numbers; `and_list` is `true` if another
    /// list follows.
    Length { each: u64, and_list: bool },
    /// The numbers of a list are next: `left` of them remain. `and_list` is `true` if another list
    /// follows.
    Numbers { left: u64, and_list: bool },
}

/// Streaming parser of Varisat's proof format that recognises learnt clauses.
struct Steps {
    part: Part,
    number: u128,
    bytes: u32,
}

impl Default for Steps {
    fn default() -> Self {
        Self { part: Part::Code, number: 0, bytes: 0 }
    }
}

impl Steps {
    /// Reads one byte of the proof. Returns `true` if the byte completes the code of a learnt
    /// clause.
    fn byte(&mut self, byte: u8) -> bool {
        let place = self.bytes.saturating_mul(8);
        self.number |= u128::from(byte).checked_shl(place).unwrap_or(0);
        self.bytes = self.bytes.saturating_add(1);
        // The lowest n bits of a number of n bytes are n - 1 zeros and, above them, a one.
        let total = self.number.trailing_zeros().saturating_add(1);
        if self.number == 0 || self.bytes < total {
            return false;
        }
        let value = self.number.checked_shr(total).unwrap_or(0);
        (self.number, self.bytes) = (0, 0);
        // An oversized number is not a code of interest.
        self.next(u64::try_from(value).unwrap_or(u64::MAX))
    }

    fn next(&mut self, number: u64) -> bool {
        let list = |each, and_list| Part::Length { each, and_list };
        let numbers = |left| Part::Numbers { left, and_list: false };
        let before = self.part;
        self.part = match before {
            Part::Code => match number {
                0 | 2 => numbers(2),
                1 | 3..=6 | 13 => numbers(1),
                7 | 8 | 17 => list(1, true),
                9 => list(2, false),
                10..=12 | 14..=16 => list(1, false),
                _ => Part::Code,
            },
            Part::Length { each, and_list } => Part::Numbers { left: number.saturating_mul(each), and_list },
            Part::Numbers { left, and_list } => Part::Numbers { left: left.saturating_sub(1), and_list },
        };
        if let Part::Numbers { left: 0, and_list } = self.part {
            self.part = if and_list { list(1, false) } else { Part::Code };
        }
        matches!((before, number), (Part::Code, 7 | 8))
    }
}

/// Proof sink that counts learnt clauses in `conflicts` and discards the proof. A write fails if the deadline
/// has passed, the run is interrupted, or more than `budget` clauses were learnt.
struct BudgetSink {
    limits: Limits,
    budget: u64,
    conflicts: Rc<Cell<u64>>,
    steps: Steps,
}

impl io::Write for BudgetSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.limits.reached() || self.conflicts.get() > self.budget {
            return Err(io::Error::other("limit reached"));
        }
        let learnt = bytes.iter().filter(|byte| self.steps.byte(**byte)).count();
        self.conflicts.set(self.conflicts.get().saturating_add(learnt as u64));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Proof sink that forwards a DRAT proof to `proof` and counts the added clauses in `conflicts`. A write
/// fails if the deadline has passed, the run is interrupted, or more than `budget` clauses were added.
struct DratSink {
    limits: Limits,
    budget: u64,
    conflicts: u64,
    at_line_start: bool,
    proof: Box<dyn io::Write>,
}

impl io::Write for DratSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.limits.reached() || self.conflicts > self.budget {
            return Err(io::Error::other("limit reached"));
        }
        let mut added = 0;
        for byte in bytes {
            added = u64::saturating_add(added, u64::from(self.at_line_start && *byte != b'd'));
            self.at_line_start = *byte == b'\n';
        }
        self.conflicts = self.conflicts.saturating_add(added);
        self.proof.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.proof.flush()
    }
}
