//! Plans without actions that they do not need.
//!
//! Where the metric counts the time of the last end only, an action that fits in costs nothing, and the planner may leave it in. One after the other,
//! from the last to the first, actions are left out if the rest is valid and measures the same (H. Nakhost, M. Müller: Action elimination and
//! plan neighborhood graph search, ICAPS 2010).

use ::mission::Mission;
use pddl::ast::Problem;
use planner::{Limits, Plan};

use crate::mission::confirm::Reading;

/// Each action of a longer plan would be judged in a plan as long: that takes too long.
const LONGEST: usize = 200;

/// The plan without actions that cost nothing and that nothing else in it needs, as far as that is found within the limits.
pub fn lean(
    mission: &Mission,
    problem: &Problem,
    mut plan: Plan,
    reading: &Reading,
    limits: &Limits,
) -> Plan {
    if plan.steps.len() > LONGEST {
        return plan;
    }
    for index in (0..plan.steps.len()).rev() {
        if plan.steps[index].cost.is_zero() {
            let mut less = plan.clone();
            less.steps.remove(index);
            if reading.value(mission, problem, &less, limits) == Some(plan.cost.to_rational()) {
                plan = less;
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

    /// What is left of work on these objects, side by side, where a and b have to be done.
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
        let left: Vec<&str> = plan.steps.iter().map(|step| step.arguments[0].as_str()).collect();
        assert_eq!(left, expected, "{work:?}");
    }

    #[test]
    fn what_nothing_needs_is_left_out() {
        let problem = |rest: &str| {
            format!(
                "(define (problem p) (:domain d) (:objects a b c) (:init) (:goal (and (done a) (done b))) {rest})"
            )
        };
        check(&problem(""), 4, &["c", "a", "b", "c"], &["a", "b"]);
        check(&problem("(:metric minimize (total-time))"), 4, &["a", "b"], &["a", "b"]);
        // Somebody may want a longer plan.
        check(&problem("(:metric maximize (total-time))"), 4, &["a", "c", "b"], &["a", "b"]);
        // What does not measure as it should stays as it is.
        check(&problem(""), 5, &["a", "b", "c"], &["a", "b", "c"]);
    }
}
