//! Grounds a mission, and converts plans to the action signatures of the domain's file.

use std::borrow::Cow;

use num_rational::BigRational;
use pddl::ast::{Domain, Name, Problem};
use pddl::{Diagnostic, Severity};
use planner::{ConcurrentTask, ExactTask, GroundConfig, Limits, Plan, Replanner, Task};

use ::mission::{Mission, ParsedObjective};

use crate::message::{Errors, Message};
use crate::narrow::narrowed;

/// Grounding of a mission for the planner.
pub trait Planning {
    /// Returns a domain and a problem with the same plans as the mission's domain and `problem`.
    /// They are smaller if the knowledge base completes the domain. [`Planning::ground`] uses this
    /// form.
    fn narrowed<'m>(&'m self, problem: &'m Problem) -> (Cow<'m, Domain>, Cow<'m, Problem>);

    /// Grounds a problem that [`Mission::filled`] returned. Non-empty `objectives` replace its
    /// metric.
    ///
    /// # Errors
    /// Constructs or numbers that the planner does not support, or a limit that was reached.
    fn ground(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        limits: &Limits,
    ) -> Result<Task, Errors>;

    /// Grounds a problem as [`Planning::ground`] does, but with exact rationals, so that numbers of
    /// any size are accepted.
    ///
    /// # Errors
    /// Errors of [`Planning::ground`].
    fn ground_exact(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        limits: &Limits,
    ) -> Result<ExactTask, Errors>;

    /// Grounds a problem that [`Mission::filled`] returned, for plans with overlapping actions. Interfering happenings
    /// (starts and ends of actions) are at least `separation` apart, in the domain's time unit.
    ///
    /// # Errors
    /// Constructs or numbers that the planner does not support, or a limit that was reached.
    fn ground_concurrent(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        separation: &BigRational,
        limits: &Limits,
    ) -> Result<ConcurrentTask, Errors>;

    /// Returns the plan with the arguments as in the domain's file, i.e. without the designs that
    /// the knowledge base has added to a plain domain. The configuration of each step contains
    /// these designs.
    #[must_use]
    fn written(&self, plan: Plan) -> Plan;
}

impl Planning for Mission {
    fn narrowed<'m>(&'m self, problem: &'m Problem) -> (Cow<'m, Domain>, Cow<'m, Problem>) {
        narrowed(self, self.domain(), problem)
    }

    fn ground(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        limits: &Limits,
    ) -> Result<Task, Errors> {
        ground_with(self, self.domain(), problem, objectives, limits)
    }

    fn ground_exact(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        limits: &Limits,
    ) -> Result<ExactTask, Errors> {
        let (domain, problem) = self.narrowed(problem);
        planner::ground_exact(&domain, &problem, &config(self, objectives, limits))
            .map_err(|errors| messages(self, objectives, &errors))
    }

    fn ground_concurrent(
        &self,
        problem: &Problem,
        objectives: &[ParsedObjective],
        separation: &BigRational,
        limits: &Limits,
    ) -> Result<ConcurrentTask, Errors> {
        let (domain, problem) = self.narrowed(problem);
        planner::ground_concurrent(&domain, &problem, &config(self, objectives, limits), separation)
            .map_err(|errors| messages(self, objectives, &errors))
    }

    fn written(&self, mut plan: Plan) -> Plan {
        for step in &mut plan.steps {
            if let Some(count) = self.written_arguments(&step.action) {
                step.arguments.truncate(count);
            }
        }
        plan
    }
}

pub(crate) fn ground_with(
    mission: &Mission,
    domain: &Domain,
    problem: &Problem,
    objectives: &[ParsedObjective],
    limits: &Limits,
) -> Result<Task, Errors> {
    let (domain, problem) = narrowed(mission, domain, problem);
    planner::ground(&domain, &problem, &config(mission, objectives, limits))
        .map_err(|errors| messages(mission, objectives, &errors))
}

/// Returns a planner for problems that differ from `problem` only in their state and availability
/// of designs. Returns `None` if the mission does not support this.
pub(crate) fn replanner(mission: &Mission, problem: &Problem, limits: &Limits) -> Option<Replanner> {
    // A domain that the knowledge base has completed (PLANTA's form) is narrowed before planning. The narrowed domain
    // depends on the facts of the problem, so it cannot be used for other problems.
    if mission.completed_predicates().is_some() {
        return None;
    }
    let predicates = mission.domain().predicates.iter().map(|declared| &declared.identifier.name);
    let available: Vec<Name> = if mission.knowledge().is_some() {
        predicates.filter(|name| mission.bindings().is_availability(name)).cloned().collect()
    } else {
        Vec::new()
    };
    Replanner::new(mission.domain(), problem, &available, &config(mission, &[], limits))
}

fn config(mission: &Mission, objectives: &[ParsedObjective], limits: &Limits) -> GroundConfig {
    GroundConfig::default()
        .with_solves(mission.solves())
        .with_objectives(objectives.iter().map(|objective| objective.metric.clone()).collect())
        .with_limits(limits.clone())
}

fn messages(mission: &Mission, objectives: &[ParsedObjective], errors: &[planner::Error]) -> Errors {
    let source = |file: planner::File| match file {
        planner::File::Domain => Some(mission.domain_source()),
        planner::File::Problem => Some(mission.problem_source()),
        planner::File::Objective(index) => objectives.get(index).map(|objective| &objective.source),
    };
    let message = |error: &planner::Error| {
        let located = error.place().and_then(|place| Some((source(place.file)?, place.span)));
        match located {
            Some((source, span)) => {
                let diagnostic =
                    Diagnostic::new(source, span, Severity::Error, error.code(), error.to_string());
                Message::from_pddl(&[diagnostic], &[source]).swap_remove(0)
            }
            None => Message::error(error.code(), error.to_string()),
        }
    };
    errors.iter().map(message).collect()
}

#[cfg(test)]
mod tests {
    use ::mission::Bindings;

    use super::{GroundConfig, Name};

    /// The certificate checker does not link the planner. So the default names of the predicate `solves` are defined
    /// both in the crate `mission` and in the planner, and must be equal.
    #[test]
    fn default_names_equal_those_of_the_planner() {
        let sorted = |mut names: Vec<Name>| {
            names.sort();
            names
        };
        assert_eq!(sorted(Bindings::default().solves()), sorted(GroundConfig::default().solves));
    }
}
