//! SAT solvers behind one trait.
//!
//! Each solver has its own file, and no other file names the solver's crate. Solvers are incremental: they
//! accept further clauses after each answer, solve under assumptions, and report a core, i.e. assumptions
//! that together are inconsistent with the clauses. Built-in solvers usually keep learnt clauses; an external
//! program starts from the beginning in each call.

mod batsat;
#[cfg(feature = "cadical")]
mod cadical;
mod program;
mod solver;
mod totalizer;
mod varisat;

use std::str::FromStr;
use std::time::Duration;

use program::Program;
pub use solver::{Answer, Lit, Solver};
use task::limits::Limits;
pub use totalizer::Totalizer;
pub use varisat::refute_with_proof;

/// Time limit of an external program for each formula of [`Backend::check`]. It detects programs
/// that never answer; a program in a container or on a network file system may start slowly.
const CHECK_TIME: Duration = Duration::from_secs(60);

/// The SAT solver that decides the formulas.
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
    /// An external program with its arguments. It receives the formula in DIMACS on standard input,
    /// and answers on standard output in the format of the SAT competitions or of `MiniSat`.
    Program {
        /// Path of the program, or a name that is searched in `PATH`.
        command: String,
        /// Arguments of the program, passed unchanged.
        arguments: Vec<String>,
    },
}

/// Reason why the solver that the user has named cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// The given name of the solver is blank.
    #[error("a solver needs a name; built in are: {}", Backend::BUILT_IN.join(", "))]
    Empty,
    /// The program does not behave like a SAT solver.
    #[error("`{command}` cannot be used as a SAT solver: {reason}; built in are: {}", Backend::BUILT_IN.join(", "))]
    Unusable {
        /// The program as named by the user.
        command: String,
        /// Description of the fault.
        reason: String,
    },
}

impl Backend {
    /// Returns the solvers that need no external program.
    pub fn built_in() -> impl Iterator<Item = Self> {
        Self::BUILT_IN.iter().filter_map(|name| name.parse().ok())
    }

    /// Names of the solvers that need no external program.
    pub const BUILT_IN: &[&str] = &[
        "varisat",
        "batsat",
        #[cfg(feature = "cadical")]
        "cadical",
    ];

    /// Starts a solver that stops at the deadline, at an interruption, or after more than `budget` conflicts in
    /// all calls together. An external program with a conflict budget gets a time limit for each call instead.
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

    /// Checks that the solver is available and answers correctly for two formulas with one
    /// variable. Built-in solvers are not checked.
    ///
    /// # Errors
    ///
    /// The program cannot be started, fails, does not end in time or answers wrongly.
    pub fn check(&self) -> Result<(), BackendError> {
        let Self::Program { command, .. } = self else { return Ok(()) };
        let variable = Lit::TRUE;
        for (clauses, expected) in
            [(&[variable][..], Answer::Satisfiable), (&[variable, !variable][..], Answer::Unsatisfiable)]
        {
            let mut solver = self.start(&Limits::none().with_time(CHECK_TIME), u64::MAX);
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

/// Parses the name of a built-in solver, or an external program followed by arguments that are
/// separated by blanks.
impl FromStr for Backend {
    type Err = BackendError;

    fn from_str(text: &str) -> Result<Self, BackendError> {
        match text.trim() {
            "varisat" => Ok(Self::Varisat),
            "batsat" => Ok(Self::Batsat),
            #[cfg(feature = "cadical")]
            "cadical" => Ok(Self::Cadical),
            program => {
                let mut words = program.split_whitespace().map(str::to_owned);
                let command = words.next().ok_or(BackendError::Empty)?;
                Ok(Self::Program { command, arguments: words.collect() })
            }
        }
    }
}
