//! Goal counting, an admissible heuristic for A\*.
//!
//! Each operator makes at most `facts_per_step` goal facts true and costs at least `cheapest`. A state in which u goal
//! facts are false is therefore at least ⌈u / `facts_per_step`⌉ · `cheapest` away from the goal.

use search::search::Heuristic;
use task::number::Int;
use task::task::{Fact, Operator, State, Task};

/// Lower bound on the cost to the goal. It is computed from the number of false goal facts.
#[derive(Debug)]
pub struct GoalCount {
    /// Goal facts of basic variables. Goal facts of derived variables are not counted, because a single step can change
    /// any number of derived variables.
    goal_facts: Vec<Fact>,
    /// Upper bound on the number of goal facts that one operator makes true; at least 1.
    facts_per_step: usize,
    /// Cost of the cheapest operator with its cheapest designs.
    cheapest: Int,
}

impl GoalCount {
    /// Prepares the heuristic for a task whose operators have non-negative costs.
    pub fn new(task: &Task) -> Self {
        let is_basic = |fact: &Fact| (fact.variable.0 as usize) < task.basic;
        let goal_facts: Vec<Fact> = task.goal.facts.iter().copied().filter(is_basic).collect();
        let facts_made_true = |operator: &Operator| {
            let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
            operator.effects.iter().chain(conditional).filter(|fact| goal_facts.contains(fact)).count()
        };
        let facts_per_step = task.operators.iter().map(facts_made_true).max().unwrap_or(0).max(1);
        let costs = task
            .operators
            .iter()
            .flat_map(|operator| operator.admitted_combinations().map(|designs| operator.cost_of(&designs)));
        Self { cheapest: costs.min().unwrap_or(0), goal_facts, facts_per_step }
    }
}

impl Heuristic<Int> for GoalCount {
    fn estimate(&self, state: &State) -> Option<Int> {
        let is_false = |fact: &&Fact| state.values[fact.variable.0 as usize] != fact.value;
        let false_facts = self.goal_facts.iter().filter(is_false).count();
        let steps = Int::try_from(false_facts.div_ceil(self.facts_per_step)).ok()?;
        Some(steps.saturating_mul(self.cheapest))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use search::bounds::Bounds;
    use search::search::{Heuristic as _, SearchOutcome, search_states};
    use task::context::Context;
    use task::limits::Limits;
    use task::number::Int;
    use task::task::Task;
    use testing::{depot, fleet, ground_text, successors};

    use super::GoalCount;

    fn tasks() -> impl Iterator<Item = Task> {
        let tasks = (0..40).flat_map(|seed| [ground_text(fleet(seed)), ground_text(depot(seed))]);
        tasks.filter(|task| task.unreachable.is_none())
    }

    fn optimal_cost(outcome: SearchOutcome) -> Option<Int> {
        match outcome {
            SearchOutcome::Optimal(plan) => Some(plan.cost),
            SearchOutcome::None => None,
            SearchOutcome::Unknown(_) => panic!("the search has no limit"),
        }
    }

    #[test]
    fn no_step_costs_less_than_the_heuristic_value_decreases() {
        let mut positive_values = 0;
        for task in tasks() {
            let heuristic = GoalCount::new(&task);
            let mut visited = HashSet::from([task.initial.clone()]);
            let mut open = vec![task.initial.clone()];
            while let Some(state) = open.pop() {
                let value = heuristic.estimate(&state).expect("no dead end is detected");
                assert!(!task.is_goal(&state) || value == 0, "{value} at a goal");
                positive_values += u32::from(value > 0);
                for (next, cost) in successors(&task, &state) {
                    let next_value = heuristic.estimate(&next).expect("no dead end is detected");
                    assert!(value <= cost + next_value, "{value} > {cost} + {next_value}");
                    if visited.len() < 500 && visited.insert(next.clone()) {
                        open.push(next);
                    }
                }
            }
        }
        assert!(positive_values > 1_000, "only {positive_values} positive values");
    }

    #[test]
    fn the_search_with_the_heuristic_finds_the_same_costs() {
        let mut solved = 0;
        for task in tasks() {
            let limits = Limits::none();
            let context = Context::new(&task, &limits);
            let bounds = Bounds::new(context).expect("no limit");
            let cost = optimal_cost(search_states(context, &GoalCount::new(&task), usize::MAX));
            assert_eq!(cost, optimal_cost(search_states(context, &bounds, usize::MAX)));
            solved += u32::from(cost.is_some());
        }
        assert!(solved > 20, "only {solved} tasks have plans");
    }
}
