//! A formula to an assignment, or to the answer that there is none: SAT solvers behind one trait.
//!
//! Each solver has a file, and only that file names its crate. A solver is incremental: it takes further clauses after each
//! answer, decides them under assumptions, and says which of these fail together. What it has learnt it keeps.

mod batsat;
#[cfg(feature = "cadical")]
mod cadical;
mod program;
#[cfg(test)]
pub(crate) mod tests;
mod totalizer;
mod varisat;

use std::str::FromStr;

use crate::limits::Limits;
use program::Program;
pub(crate) use totalizer::Totalizer;
pub(crate) use varisat::refute_with_proof;

/// A literal: a variable, counted from 0, or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Lit(u32);

impl Lit {
    /// The first variable, which formulas fix to true.
    pub(crate) const TRUE: Self = Self(0);

    pub(crate) fn positive(variable: u32) -> Self {
        Self(variable << 1)
    }

    pub(crate) fn new(variable: u32, positive: bool) -> Self {
        if positive { Self::positive(variable) } else { !Self::positive(variable) }
    }

    pub(crate) fn variable(self) -> u32 {
        self.0 >> 1
    }

    /// A number for the literal, counted from 0.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }

    pub(crate) fn is_positive(self) -> bool {
        self.0 & 1 == 0
    }

    /// As in DIMACS files: variables count from 1, negation is the sign.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "fewer than 2^31 - 1 variables are held in memory with their clauses"
    )]
    pub(crate) fn dimacs(self) -> i32 {
        let number = i32::try_from(self.variable()).expect("invariant: fewer than 2^31 variables") + 1;
        if self.is_positive() { number } else { -number }
    }
}

impl std::ops::Not for Lit {
    type Output = Self;

    fn not(self) -> Self {
        Self(self.0 ^ 1)
    }
}

/// What a solver says of its clauses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    Satisfiable,
    Unsatisfiable,
    /// A limit was reached; the solver is of no further use.
    Interrupted,
}

/// A SAT solver for a formula that grows.
pub(crate) trait Solver {
    /// Adds a clause; its variables need no declaration.
    fn add_clause(&mut self, clause: &[Lit]);
    /// Decides the clauses added so far together with the assumptions, which hold for this call only.
    fn solve(&mut self, assumptions: &[Lit]) -> Answer;
    /// Assumptions of the last call that cannot hold together, if its answer was `Unsatisfiable`; in no particular order, and
    /// not always as few as possible. None of them if the clauses alone are unsatisfiable.
    fn core(&self) -> &[Lit];
    /// The value of a variable in the assignment found last.
    fn value(&self, variable: u32) -> bool;
    /// Clauses learnt so far, one for each conflict; 0 if the solver does not tell.
    fn conflicts(&self) -> u64;
    /// Why the solver was interrupted, if not by a limit.
    fn failure(&self) -> Option<&str> {
        None
    }
}

/// Which SAT solver decides the formulas.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Varisat, in pure Rust.
    #[default]
    Varisat,
    /// `BatSat`, in pure Rust.
    Batsat,
    /// `CaDiCaL`, in C++; with the feature `cadical` only.
    #[cfg(feature = "cadical")]
    Cadical,
    /// A program and its arguments. It gets the formula in DIMACS on its standard input, and answers on its standard
    /// output as the SAT competitions ask for, or as `MiniSat` does.
    Program {
        /// A path, or a name that is looked up as a shell does.
        command: String,
        /// Passed as they are.
        arguments: Vec<String>,
    },
}

/// What is wrong with a solver that a user names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// Nothing but blanks.
    #[error("a solver needs a name; built in are: {}", Backend::BUILT_IN.join(", "))]
    Empty,
    /// It does not answer as it should.
    #[error("`{command}` does not serve as a SAT solver: {reason}; built in are: {}", Backend::BUILT_IN.join(", "))]
    Unusable {
        /// The program as the user has named it.
        command: String,
        /// What happened.
        reason: String,
    },
}

impl Backend {
    /// The names of solvers that need no program.
    pub const BUILT_IN: &[&str] = &[
        "varisat",
        "batsat",
        #[cfg(feature = "cadical")]
        "cadical",
    ];

    /// A solver that gives up at a limit, or after learning `budget` clauses.
    pub(crate) fn start(&self, limits: &Limits, budget: u64) -> Box<dyn Solver> {
        match self {
            Self::Varisat => Box::new(varisat::Varisat::new(limits, budget)),
            Self::Batsat => Box::new(batsat::Batsat::new(limits, budget)),
            #[cfg(feature = "cadical")]
            Self::Cadical => Box::new(cadical::Cadical::new(limits, budget)),
            Self::Program { command, arguments } => {
                Box::new(Program::new(command, arguments, limits, budget))
            }
        }
    }

    /// Whether the solver is there and answers: asked of two formulas with one variable.
    ///
    /// # Errors
    ///
    /// The program cannot be started, or does not answer right.
    pub fn check(&self) -> Result<(), BackendError> {
        let Self::Program { command, .. } = self else { return Ok(()) };
        let one = Lit::TRUE;
        for (clauses, expected) in
            [(&[one][..], Answer::Satisfiable), (&[one, !one][..], Answer::Unsatisfiable)]
        {
            // A program that has to be killed here would never end.
            let mut solver = self.start(&Limits::none(), 0);
            for literal in clauses {
                solver.add_clause(&[*literal]);
            }
            let answer = solver.solve(&[]);
            if answer != expected {
                let reason = match (answer, solver.failure()) {
                    (Answer::Interrupted, Some(reason)) => reason.to_owned(),
                    (Answer::Interrupted, None) => "it does not end".to_owned(),
                    _ => "it answers wrongly".to_owned(),
                };
                return Err(BackendError::Unusable { command: command.clone(), reason });
            }
        }
        Ok(())
    }
}

/// A name that is built in; or a program, with arguments after blanks.
impl FromStr for Backend {
    type Err = BackendError;

    fn from_str(text: &str) -> Result<Self, BackendError> {
        match text.trim() {
            "varisat" => Ok(Self::Varisat),
            "batsat" => Ok(Self::Batsat),
            #[cfg(feature = "cadical")]
            "cadical" => Ok(Self::Cadical),
            other => {
                let mut words = other.split_whitespace().map(str::to_owned);
                let command = words.next().ok_or(BackendError::Empty)?;
                Ok(Self::Program { command, arguments: words.collect() })
            }
        }
    }
}
