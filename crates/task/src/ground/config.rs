//! Configuration of grounding: the predicates that state which design solves which function, the objectives and
//! the limits. Also requirements on the ground task beyond the given problem, for example that it stays valid
//! for other initial values.

use crate::limits::Limits;
use crate::number::Int;
use pddl::ast::{Metric, Name};

/// Configuration of grounding: the predicates that state which design solves which function, the objectives and
/// the limits.
#[derive(Debug, Clone)]
pub struct GroundConfig {
    /// Predicates `(p DESIGN FUNCTION)` that state which design solves which function.
    pub solves: Vec<Name>,
    /// Objectives in lexicographic order, which replace the metric of the problem. If empty, the metric is
    /// used.
    pub objectives: Vec<Metric>,
    /// Limits of grounding: deadline and interrupt flag.
    pub limits: Limits,
}

impl Default for GroundConfig {
    /// Returns the predicate names of the Metaplan paper and of the PDDL files of kas-lab, without objectives and
    /// without limits.
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

/// Requirements on a ground task beyond the given problem, for example that it stays valid for changed initial
/// values.
#[derive(Debug, Clone, Copy, Default)]
pub struct Generality {
    /// If set to n, each initial number may be replaced by any multiple of 1/n. Grounding then infers nothing
    /// from the initial numbers of the problem.
    pub numbers: Option<Int>,
    /// If set to n, numeric fluents are scaled such that all multiples of 1/n become integers, in addition to the
    /// numbers of the problem.
    pub precision: Option<Int>,
    /// If set, the metric may contain fluents that effects change by state-dependent amounts. The operator costs alone
    /// then do not determine the metric.
    pub measures_ends: bool,
    /// If set, fluents with changes that improve the metric are treated like fluents with state-dependent changes:
    /// their final values are added to the cost at the end of the plan.
    pub measures_rewards: bool,
    /// If set, the durations of all operators are 0 in the ground task, because the caller evaluates
    /// them. Their common denominator then does not matter.
    pub omits_durations: bool,
}
