//! Configuration of grounding: the roles of the domain's symbols, and the generality of the ground task.

use crate::limits::Limits;
use crate::number::Int;
use pddl::ast::{Metric, Name};

/// How the domain's symbols are to be read. Each `with_` changes one thing.
#[derive(Debug, Clone)]
pub struct GroundConfig {
    /// Predicates `(p DESIGN FUNCTION)` that say which design solves which function.
    pub solves: Vec<Name>,
    /// What plans are measured by, the most important first, in place of the metric of the problem; none for that metric.
    pub objectives: Vec<Metric>,
    /// When to give up.
    pub limits: Limits,
}

impl Default for GroundConfig {
    /// The names of the Metaplan paper and of the files of kas-lab.
    fn default() -> Self {
        Self {
            solves: ["fd_solve_f", "fd_solves_f", "inferred-SolvesF", "solvesF"].map(Name::new).to_vec(),
            objectives: Vec::new(),
            limits: Limits::none(),
        }
    }
}

impl GroundConfig {
    /// Predicates `(p DESIGN FUNCTION)` that say which design solves which function.
    #[must_use]
    pub fn with_solves(self, solves: Vec<Name>) -> Self {
        Self { solves, ..self }
    }

    /// What plans are measured by in place of the metric of the problem, the most important first.
    #[must_use]
    pub fn with_objectives(self, objectives: Vec<Metric>) -> Self {
        Self { objectives, ..self }
    }

    /// When to give up.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }
}

/// What a ground task is to be good for beside the problem that it is made of.
#[derive(Debug, Clone, Copy, Default)]
pub struct Generality {
    /// If given, numbers of the initial state may be others, too, that are integers when multiplied by this: nothing is
    /// concluded from those of the problem.
    pub numbers: Option<Int>,
    /// If given, all numbers are integers when multiplied by this.
    pub precision: Option<Int>,
    /// Whether a metric may count fluents whose changes depend on the state: plans have that metric, and none is the best.
    pub measures_ends: bool,
    /// Whether fluents by which actions improve the metric are counted in the same way.
    pub measures_rewards: bool,
}
