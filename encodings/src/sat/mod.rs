//! A formula to an assignment, or to the answer that there is none: SAT solvers behind one trait.
//!
//! Each solver has a file, and only that file names its crate. A solver is incremental: it takes further clauses after each
//! answer, decides them under assumptions, and says which of these fail together. What it has learnt it keeps.

mod batsat;
#[cfg(feature = "cadical")]
mod cadical;
mod program;
mod solver;
mod totalizer;
mod varisat;

use std::str::FromStr;

use program::Program;
pub use solver::{Answer, Lit, Solver};
use task::limits::Limits;
pub use totalizer::Totalizer;
pub use varisat::refute_with_proof;

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
    /// Solvers that need no other program.
    pub fn built_in() -> impl Iterator<Item = Self> {
        Self::BUILT_IN.iter().filter_map(|name| name.parse().ok())
    }

    /// The names of solvers that need no program.
    pub const BUILT_IN: &[&str] = &[
        "varisat",
        "batsat",
        #[cfg(feature = "cadical")]
        "cadical",
    ];

    /// A solver that gives up at a limit, or after learning `budget` clauses.
    pub fn start(&self, limits: &Limits, budget: u64) -> Box<dyn Solver> {
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
