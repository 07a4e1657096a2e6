//! Configuration of grounding: the roles of the domain's symbols, and the generality of the ground task.

use crate::limits::Limits;
use crate::number::Int;
use pddl::ast::{Metric, Name};

/// Interpretation of the domain's symbols. Each `with_` method changes a single setting.
#[derive(Debug, Clone)]
pub struct GroundConfig {
    /// Predicates `(p DESIGN FUNCTION)` that state which design solves which function.
    pub solves: Vec<Name>,
    /// Objectives in lexicographic order that replace the metric of the problem; empty for that
    /// metric.
    pub objectives: Vec<Metric>,
    /// Limits of grounding.
    pub limits: Limits,
}

impl Default for GroundConfig {
    /// Returns the names of the Metaplan paper and of the files of kas-lab.
    fn default() -> Self {
        Self {
            solves: ["fd_solve_f", "fd_solves_f", "inferred-SolvesF", "solvesF"].map(Name::new).to_vec(),
            objectives: Vec::new(),
            limits: Limits::none(),
        }
    }
}

impl GroundConfig {
    /// Sets the predicates `(p DESIGN FUNCTION)` that state which design solves which function.
    #[must_use]
    pub fn with_solves(self, solves: Vec<Name>) -> Self {
        Self { solves, ..self }
    }

    /// Sets objectives in lexicographic order that replace the metric of the problem.
    #[must_use]
    pub fn with_objectives(self, objectives: Vec<Metric>) -> Self {
        Self { objectives, ..self }
    }

    /// Sets the limits of grounding.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }
}

/// Requirements on a ground task beyond the given problem.
#[derive(Debug, Clone, Copy, Default)]
pub struct Generality {
    /// If set, the initial numbers may be replaced by other multiples of the reciprocal of this
    /// factor. Nothing is then inferred from the initial numbers of the problem.
    pub numbers: Option<Int>,
    /// If set, multiplying by this factor makes all numbers integers.
    pub precision: Option<Int>,
    /// If set, a metric may contain fluents whose changes depend on the state. Optimality is then
    /// not provable.
    pub measures_ends: bool,
    /// If set, fluents by which actions improve the metric are treated like state-dependent
    /// fluents.
    pub measures_rewards: bool,
}
