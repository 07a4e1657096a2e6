//! Goal of a segment of a plan.
//!
//! A segment is a sequence of consecutive steps of a plan. Steps that replace a segment must lead to a state
//! in which the steps after the segment, its *suffix*, are still a plan. The facts that the suffix needs are
//! computed by regression \[1, section 3\]. With disjunctions or numbers, these facts may not suffice. A
//! state is then also tested by executing the suffix. With derived variables or conditional effects, nothing
//! is regressed: the state must have all basic facts of the state in which the replaced segment ended.
//!
//! \[1\] J. Rintanen: Regression for classical and nondeterministic planning, ECAI 2008.

use task::plan::ground::{GroundStep, pass};
use task::task::number::TaskNumber;
use task::task::{Fact, State, Task};

pub(super) struct SegmentGoal {
    /// Facts that a goal state of the segment must have, in ascending order: the regressed facts or, without
    /// regression, all basic facts of the state in which the replaced segment ended.
    pub(super) facts: Vec<Fact>,
    suffix: Vec<GroundStep>,
    /// `true` if the facts suffice: the suffix is a plan from every state that has them.
    is_complete: bool,
}

impl SegmentGoal {
    pub(super) fn new<N: TaskNumber>(task: &Task<N>, end: &State<N>, suffix: &[GroundStep]) -> Self {
        let operators = || suffix.iter().map(|step| &task.operators[step.operator.index()]);
        let conditions = || operators().map(|operator| &operator.condition).chain([&task.goal]);
        let has_facts_only = |condition: &task::task::Condition<N>| {
            condition.clauses.is_empty() && condition.linears().next().is_none()
        };
        let is_regressive =
            task.axioms.is_empty() && operators().all(|operator| operator.conditional.is_empty());
        let is_complete = is_regressive
            && conditions().all(has_facts_only)
            && operators().all(|operator| operator.numeric_effects.is_empty());
        let facts = if is_regressive {
            regress(task, suffix)
        } else {
            // The facts of basic variables determine the facts of derived variables.
            let variables = task::task::VariableId::all(task.basic);
            variables.zip(&end.values).map(|(variable, value)| Fact { variable, value: *value }).collect()
        };
        Self { facts, suffix: suffix.to_vec(), is_complete }
    }

    pub(super) fn holds<N: TaskNumber>(&self, task: &Task<N>, state: &State<N>) -> bool {
        self.facts.iter().all(|fact| fact.holds(&state.values))
            && (self.is_complete || pass(task, state, &self.suffix).is_some())
    }
}

/// Returns the facts that must hold before the steps so that each step is applicable and the goal holds at
/// the end, in ascending order.
fn regress<N: TaskNumber>(task: &Task<N>, steps: &[GroundStep]) -> Vec<Fact> {
    let mut needed: Vec<Option<u32>> = vec![None; task.variables.len()];
    for fact in &task.goal.facts {
        needed[fact.variable.index()] = Some(fact.value);
    }
    for step in steps.iter().rev() {
        let operator = &task.operators[step.operator.index()];
        for effect in &operator.effects {
            needed[effect.variable.index()] = None;
        }
        for fact in &operator.condition.facts {
            needed[fact.variable.index()] = Some(fact.value);
        }
    }
    let facts = needed.into_iter().zip(task::task::VariableId::all(task.variables.len()));
    facts.filter_map(|(value, variable)| Some(Fact { variable, value: value? })).collect()
}

#[cfg(test)]
mod tests {
    use task::limits::Limits;
    use testing::missions::Mission;
    use testing::{depot, fleet, ground_text, successors};

    use super::*;
    use crate::satisfice::{Satisficer, StepResult};

    #[test]
    fn a_segment_goal_holds_only_in_states_in_which_the_suffix_is_a_plan() {
        let limits = Limits::none();
        let missions = (0..10).map(Mission::random).map(|mission| (mission.domain(), mission.problem()));
        let (mut complete, mut tested) = (0, 0);
        for text in (0..10).map(fleet).chain((0..10).map(depot)).chain(missions) {
            let task = ground_text(text.clone());
            let context = task::context::Context::new(&task, &limits);
            let Some(mut satisficer) = Satisficer::new(context).expect("no limit") else { continue };
            let Ok(StepResult::Plan(plan)) = satisficer.run(None, 100_000_000) else { continue };
            let states = pass(&task, &task.initial, &plan.steps).expect("a plan");
            let mut reached = rustc_hash::FxHashSet::from_iter([task.initial.clone()]);
            let mut open = vec![task.initial.clone()];
            while let Some(state) = open.pop() {
                for (next, _) in successors(&task, &state) {
                    if reached.len() < 300 && reached.insert(next.clone()) {
                        open.push(next);
                    }
                }
            }
            for (end, reached_end) in states.iter().enumerate() {
                let goal = SegmentGoal::new(&task, reached_end, &plan.steps[end..]);
                assert!(goal.holds(&task, reached_end), "{text:?}");
                complete += usize::from(goal.is_complete);
                for state in &reached {
                    let is_plan = pass(&task, state, &plan.steps[end..]).is_some();
                    let holds = goal.holds(&task, state);
                    // With derived variables or conditional effects, the goal requires all basic facts of the
                    // end state.
                    let is_regressive = goal.is_complete || task.axioms.is_empty();
                    let is_regressive = is_regressive
                        && plan.steps[end..]
                            .iter()
                            .all(|step| task.operators[step.operator.index()].conditional.is_empty());
                    assert!(!holds || is_plan, "{state:?}: {text:?}");
                    assert!(!is_regressive || holds == is_plan, "{state:?}: {text:?}");
                    tested += usize::from(is_plan);
                }
            }
        }
        assert!(complete > 5 && tested > 50, "{complete} goals without execution, {tested} states");
    }
}
