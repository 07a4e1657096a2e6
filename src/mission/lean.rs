//! Action elimination: removes superfluous actions from a plan [1].
//!
//! If the metric is the makespan, an action that overlaps with another one may cost nothing, so the
//! planner may keep superfluous actions. Each action of cost 0, from the last to the first, is
//! removed if the plan without it is valid and has the same cost. Unlike in [1], actions are removed
//! one at a time, never together with the actions that depend on them. Plans of more than
//! `MAX_ACTIONS` actions are not examined.
//!
//! [1] H. Nakhost, M. Müller: Action elimination and plan neighborhood graph search, ICAPS 2010.

use ::mission::Mission;
use pddl::ast::Problem;
use planner::{Limits, Plan};

use crate::mission::confirm::Reading;

/// Maximum number of actions in a plan that is examined. Each candidate is validated, so the effort
/// grows with the square of the number of actions.
const MAX_ACTIONS: usize = 200;

/// Removes superfluous actions of cost 0 from a plan. If a limit is reached, returns the plan as reduced until then. A
/// plan of more than 200 actions is returned unchanged.
pub fn lean(
    mission: &Mission,
    problem: &Problem,
    mut plan: Plan,
    reading: &Reading,
    limits: &Limits,
) -> Plan {
    if plan.steps.len() > MAX_ACTIONS {
        return plan;
    }
    for index in (0..plan.steps.len()).rev() {
        if plan.steps[index].cost.is_zero() {
            let mut shorter = plan.clone();
            shorter.steps.remove(index);
            if reading.value(mission, problem, &shorter, limits) == Some(plan.cost.to_rational()) {
                plan = shorter;
            }
        }
    }
    plan.note_reconfigured();
    plan
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::Source;
    use planner::{Exact, Limits, Plan, Step};

    use super::lean;

    use crate::mission::{Bindings, Mission, Reading};

    const DOMAIN: &str = "(define (domain d) (:requirements :durative-actions) (:predicates (done ?x))
        (:durative-action work :parameters (?x) :duration (= ?duration 4) :effect (at end (done ?x))))";

    fn check(problem: &str, cost: i64, work: &[&str], expected: &[&str]) {
        let (domain, problem) = (Ok(Source::new("d", DOMAIN)), Ok(Source::new("p", problem)));
        let mission = Mission::new("", None, Bindings::default(), domain, problem);
        let mission = mission.expect("a mission");
        let number = |value: i64| Exact::from(BigRational::from_integer(value.into()));
        let step = |object: &&str| Step {
            action: "work".to_owned(),
            arguments: vec![(*object).to_owned()],
            configuration: Vec::new(),
            reconfigured: Vec::new(),
            start: number(0),
            duration: number(4),
            cost: number(0),
        };
        let plan = Plan { steps: work.iter().map(step).collect(), cost: number(cost) };
        let reading = Reading::concurrent(&BigRational::new(1.into(), 1000.into()));
        let plan = lean(&mission, mission.problem(), plan, &reading, &Limits::none());
        let remaining: Vec<&str> = plan.steps.iter().map(|step| step.arguments[0].as_str()).collect();
        assert_eq!(remaining, expected, "{work:?}");
    }

    #[test]
    fn superfluous_actions_are_removed() {
        let problem = |rest: &str| {
            format!(
                "(define (problem p) (:domain d) (:objects a b c) (:init) (:goal (and (done a) (done b))) {rest})"
            )
        };
        check(&problem(""), 4, &["c", "a", "b", "c"], &["a", "b"]);
        check(&problem("(:metric minimize (total-time))"), 4, &["a", "b"], &["a", "b"]);
        // All actions overlap, so the removal of `c` does not change a maximised metric either.
        check(&problem("(:metric maximize (total-time))"), 4, &["a", "c", "b"], &["a", "b"]);
        // A plan with a wrong cost is returned unchanged.
        check(&problem(""), 5, &["a", "b", "c"], &["a", "b", "c"]);
    }
}
