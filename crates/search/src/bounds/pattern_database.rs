//! Pattern database: the projection of a task to a few finite-domain variables, and its goal distances.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::number::{GROWTH_LIMIT, Int, dense};
use task::task::{ConditionalEffect, Literal, OperatorId, State, Task, VariableId};

/// A transition between two abstract states.
#[derive(Debug, Clone, Copy)]
pub struct Transition {
    pub source: u32,
    pub target: u32,
}

/// A projection of a task to a few variables (the pattern), with the goal distance of each abstract state.
/// Clauses and numeric conditions are ignored.
pub struct Projection {
    pub pattern: Vec<VariableId>,
    sizes: Vec<usize>,
    initial: u32,
    goals: Vec<u32>,
    costs: Arc<[Int]>,
    /// Operators with transitions, ascending, each with the end of its transitions in `transitions`. An
    /// operator has none if it neither requires a fact of the pattern nor may change the pattern. In a large
    /// task, this holds for nearly all operators, which thus take no memory.
    operators: Vec<(usize, usize)>,
    transitions: Vec<Transition>,
    idle_cost: Option<Int>,
    to_go: Vec<Option<Int>>,
}

/// Returns the sum of two numbers between 0 and `GROWTH_LIMIT`, capped at `GROWTH_LIMIT`. Capped distances
/// remain consistent lower bounds.
fn sum(a: Int, b: Int) -> Int {
    a.saturating_add(b).min(GROWTH_LIMIT)
}

/// Returns the cost of each operator with its cheapest designs, 0 if it is negative. All projections of
/// a task share the list.
pub(super) fn operator_costs(task: &Task) -> Arc<[Int]> {
    // Dijkstra's algorithm requires non-negative costs. An operator of negative cost is kept with
    // cost 0. The distances are then no lower bounds, but still show from where the goal is
    // reachable.
    task.operators.iter().map(|operator| operator.cost.minimum().max(0)).collect()
}

impl Projection {
    pub(super) fn new(
        context: Context<'_>,
        pattern: Vec<VariableId>,
        costs: &Arc<[Int]>,
    ) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let mut projection = Self::without_operators(task, pattern, costs);
        for index in limits.watch(0..task.operators.len()) {
            projection.add_operator(task, index?, usize::MAX);
        }
        projection.to_go = projection.goal_distances(costs, limits)?;
        Ok(projection)
    }

    /// Returns the projection with the transitions of `operators`, sorted by index, and without goal distances.
    /// Returns `None` if it has more than about `max_size` abstract states and transitions.
    pub(super) fn of_operators(
        task: &Task,
        pattern: Vec<VariableId>,
        costs: &Arc<[Int]>,
        operators: &[u32],
        max_size: usize,
    ) -> Option<Self> {
        let mut projection = Self::without_operators(task, pattern, costs);
        for index in operators {
            projection.add_operator(task, *index as usize, max_size);
            if projection.transition_count() > max_size {
                return None;
            }
        }
        Some(projection)
    }

    fn without_operators(task: &Task, pattern: Vec<VariableId>, costs: &Arc<[Int]>) -> Self {
        let sizes: Vec<_> =
            pattern.iter().map(|variable| task.variables[variable.index()].values.len()).collect();
        let mut projection = Self {
            pattern,
            sizes,
            initial: 0,
            goals: Vec::new(),
            costs: Arc::clone(costs),
            operators: Vec::new(),
            transitions: Vec::new(),
            idle_cost: None,
            to_go: Vec::new(),
        };
        projection.initial = projection.state(&task.initial);
        let goal = projection.required(&task.goal.facts);
        projection.goals = projection.matching(&goal);
        projection
    }

    /// Adds the transitions of an operator. Operators are added in ascending order. Transitions may be missing if there
    /// are more than `max_transitions`.
    fn add_operator(&mut self, task: &Task, index: usize, max_transitions: usize) {
        let operator = &task.operators[index];
        let before = self.required(&operator.condition.facts);
        let after = self.required(&operator.effects);
        let conditional: Vec<_> = operator
            .conditional
            .iter()
            .map(|effect| (effect, self.required(&effect.effects)))
            .filter(|(_, after)| after.iter().any(Option::is_some))
            .collect();
        let touched = !conditional.is_empty() || before.iter().chain(&after).any(Option::is_some);
        if touched {
            for source in self.matching(&before) {
                if self.transitions.len() > max_transitions {
                    break;
                }
                if conditional.is_empty() {
                    self.transitions.push(Transition { source, target: self.target(source, &after) });
                    continue;
                }
                for target in self.targets(source, &after, &conditional) {
                    self.transitions.push(Transition { source, target });
                }
            }
            self.operators.push((index, self.transitions.len()));
        } else {
            let cost = self.costs[index];
            self.idle_cost = Some(self.idle_cost.map_or(cost, |least: Int| least.min(cost)));
        }
    }

    /// Returns the operators with transitions, ascending by index, each with its transitions.
    fn by_operator(&self) -> impl Iterator<Item = (usize, &[Transition])> {
        let starts = std::iter::once(0).chain(self.operators.iter().map(|(_, end)| *end));
        let ranges = self.operators.iter().zip(starts);
        ranges.map(move |((operator, end), start)| (*operator, &self.transitions[start..*end]))
    }

    pub(super) fn all_transitions(&self) -> impl Iterator<Item = (usize, Transition)> {
        self.by_operator().flat_map(|(operator, transitions)| transitions.iter().map(move |t| (operator, *t)))
    }

    pub(super) fn pattern_sizes(&self) -> impl Iterator<Item = (u32, u32)> {
        self.pattern.iter().zip(&self.sizes).map(|(variable, size)| (variable.0, dense(*size)))
    }

    pub(super) fn goals(&self) -> &[u32] {
        &self.goals
    }

    fn place(&self, operator: usize) -> Option<usize> {
        self.operators.binary_search_by_key(&operator, |(candidate, _)| *candidate).ok()
    }

    pub(super) fn size(&self) -> usize {
        self.sizes.iter().product()
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "an abstract state is below the number of them, which are in memory"
    )]
    pub(crate) fn state(&self, state: &State) -> u32 {
        let values = self.pattern.iter().map(|variable| state.values[variable.index()] as usize);
        dense(self.sizes.iter().zip(values).fold(0, |index, (size, value)| index * size + value))
    }

    /// Returns the values of the pattern variables in an abstract state.
    #[expect(clippy::arithmetic_side_effects, reason = "every variable has a value, so that no size is 0")]
    pub fn values(&self, state: u32) -> Vec<u32> {
        let mut index = state as usize;
        let mut values: Vec<_> = self
            .sizes
            .iter()
            .rev()
            .map(|size| {
                let value = index % size;
                index /= size;
                dense(value)
            })
            .collect();
        values.reverse();
        values
    }

    fn required(&self, facts: &[task::task::Fact]) -> Vec<Option<u32>> {
        let value = |variable| facts.iter().find(|fact| fact.variable == variable).map(|fact| fact.value);
        self.pattern.iter().map(|variable| value(*variable)).collect()
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "abstract states are below the number of them, which are in memory"
    )]
    fn matching(&self, required: &[Option<u32>]) -> Vec<u32> {
        let mut states = vec![0_u32];
        for (size, value) in self.sizes.iter().zip(required) {
            let range = value.map_or(0..dense(*size), |value| value..value + 1);
            states = states
                .iter()
                .flat_map(|s| range.clone().map(move |value| s * dense(*size) + value))
                .collect();
        }
        states
    }

    /// Returns the abstract state that the effects produce from the abstract state `source`.
    #[expect(clippy::arithmetic_side_effects, reason = "every variable has a value, so that no size is 0")]
    fn target(&self, source: u32, effects: &[Option<u32>]) -> u32 {
        let (mut index, mut factor, mut target) = (source, 1, 0);
        for (size, effect) in self.sizes.iter().zip(effects).rev() {
            let size = dense(*size);
            target += effect.unwrap_or(index % size) * factor;
            index /= size;
            factor *= size;
        }
        target
    }

    /// Returns the abstract states that the effects may produce from the abstract state `source`. If the
    /// values of the pattern do not determine whether a conditional effect occurs, both outcomes are
    /// included.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "abstract states are below the number of them, which are in memory"
    )]
    fn targets(
        &self,
        source: u32,
        effects: &[Option<u32>],
        conditional: &[(&ConditionalEffect, Vec<Option<u32>>)],
    ) -> Vec<u32> {
        let values = self.values(source);
        let set = |values: &[u32], effects: &[Option<u32>]| -> Vec<u32> {
            values.iter().zip(effects).map(|(old, new)| new.unwrap_or(*old)).collect()
        };
        let truth = |literal: &Literal| {
            let position = self.pattern.iter().position(|variable| *variable == literal.fact.variable)?;
            Some((values[position] == literal.fact.value) == literal.positive)
        };
        let mut reached = vec![set(&values, effects)];
        for (effect, after) in conditional {
            let truths: Vec<_> = effect.condition.iter().map(truth).collect();
            if truths.contains(&Some(false)) {
                continue;
            }
            let fired: Vec<_> = reached.iter().map(|values| set(values, after)).collect();
            if truths.contains(&None) {
                reached.extend(fired);
                reached.sort_unstable();
                reached.dedup();
            } else {
                reached = fired;
            }
        }
        let index = |values: Vec<u32>| {
            self.sizes.iter().zip(values).fold(0, |index, (size, value)| index * dense(*size) + value)
        };
        reached.into_iter().map(index).collect()
    }

    pub(crate) fn goal_distances(
        &self,
        costs: &[Int],
        limits: &Limits,
    ) -> Result<Vec<Option<Int>>, Interrupted> {
        self.distances(|operator| costs[operator], self.goals.iter().map(|goal| (*goal, 0)), limits)
    }

    /// Returns the saturated costs: for each operator with transitions, given by index, the minimum
    /// non-negative cost that preserves the given goal distances. The saturated cost of any other operator
    /// is 0.
    #[expect(clippy::arithmetic_side_effects, reason = "costs to go are between 0 and GROWTH_LIMIT")]
    pub(crate) fn saturated(&self, to_go: &[Option<Int>]) -> impl Iterator<Item = (usize, Int)> {
        self.by_operator().map(|(operator, transitions)| {
            let falls = transitions
                .iter()
                .filter_map(|t| Some(to_go[t.source as usize]? - to_go[t.target as usize]?));
            (operator, falls.fold(0, Int::max))
        })
    }

    /// Returns `true` if the pattern of `other` is a subset of this pattern and both projections yield equal
    /// goal distances for all states.
    pub(crate) fn is_dominated_by(&self, other: &Self) -> bool {
        let places: Option<Vec<usize>> = other
            .pattern
            .iter()
            .map(|variable| self.pattern.iter().position(|candidate| candidate == variable))
            .collect();
        let Some(places) = places else { return false };
        (0..).zip(&self.to_go).all(|(state, cost)| {
            let values = self.values(state);
            let parts = other.sizes.iter().zip(&places);
            let coarse = parts.fold(0, |index: usize, (size, place)| {
                index.saturating_mul(*size).saturating_add(values[*place] as usize)
            });
            other.to_go[coarse] == *cost
        })
    }

    /// Number of abstract states plus the number of transitions: a measure of the work to compute
    /// goal distances.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(crate) fn transition_count(&self) -> usize {
        self.size() + self.transitions.len()
    }

    pub(crate) fn steps_to_go(&self, limits: &Limits) -> Result<Vec<Option<Int>>, Interrupted> {
        self.distances(|_| 1, self.goals.iter().map(|goal| (*goal, 0)), limits)
    }

    /// Returns, for each abstract state, a lower bound on the amount of a resource that is needed
    /// until the resource is replenished or a goal state is reached; `None` if neither is
    /// reachable. `used` is the consumption of each operator, or `None` if the operator may
    /// replenish. `left` is the amount that must remain in a goal state.
    pub(crate) fn needs(
        &self,
        used: &[Option<Int>],
        left: Int,
        limits: &Limits,
    ) -> Result<Vec<Option<Int>>, Interrupted> {
        let replenishing = self.by_operator().filter(|(operator, _)| used[*operator].is_none());
        let free = replenishing.flat_map(|(_, transitions)| transitions).map(|t| (t.source, 0));
        let goals = self.goals.iter().map(|goal| (*goal, left));
        self.distances(|operator| used[operator].unwrap_or(0).max(0), goals.chain(free), limits)
    }

    /// Returns `true` if the operator requires a fact of the pattern or may change the pattern.
    pub(crate) fn affects_pattern(&self, operator: usize) -> bool {
        self.place(operator).is_some()
    }

    /// Backward Dijkstra search. Returns, for each abstract state, the minimum of the path cost to
    /// a target plus the value of the target; `None` if no target is reachable.
    fn distances(
        &self,
        cost: impl Fn(usize) -> Int,
        targets: impl Iterator<Item = (u32, Int)>,
        limits: &Limits,
    ) -> Result<Vec<Option<Int>>, Interrupted> {
        let mut incoming: Vec<Vec<(u32, Int)>> = vec![Vec::new(); self.size()];
        for item in limits.watch(self.by_operator()) {
            let (operator, transitions) = item?;
            for transition in transitions.iter().filter(|t| t.source != t.target) {
                incoming[transition.target as usize].push((transition.source, cost(operator)));
            }
        }
        let mut to_go = vec![None; self.size()];
        let mut heap: BinaryHeap<_> = targets.map(|(target, value)| Reverse((value, target))).collect();
        let mut pulse = limits.pulse();
        while let Some(Reverse((cost, state))) = heap.pop() {
            pulse.beat()?;
            if to_go[state as usize].is_some() {
                continue;
            }
            to_go[state as usize] = Some(cost);
            for (source, step) in &incoming[state as usize] {
                if to_go[*source as usize].is_none() {
                    heap.push(Reverse((sum(cost, *step), *source)));
                }
            }
        }
        Ok(to_go)
    }

    /// Returns the goal distance of a state's abstract state, or `None` if the goal is unreachable.
    pub fn estimate(&self, state: &State) -> Option<Int> {
        self.to_go[self.state(state) as usize]
    }

    /// Returns the goal distances of all abstract states.
    pub fn costs(&self) -> &[Option<Int>] {
        &self.to_go
    }

    /// Returns the goal distance of an abstract state, or `None` if the goal is unreachable.
    pub fn goal_distance(&self, state: u32) -> Option<Int> {
        self.to_go[state as usize]
    }

    /// Returns the transitions of an operator; empty if it neither requires a fact of the pattern
    /// nor changes it.
    pub fn transitions(&self, operator: OperatorId) -> &[Transition] {
        let Some(place) = self.place(operator.index()) else { return &[] };
        let start = place.checked_sub(1).map_or(0, |previous| self.operators[previous].1);
        &self.transitions[start..self.operators[place].1]
    }

    /// Returns the minimum path cost to each abstract state after one more step than for `costs`; `None` if the
    /// state cannot be reached in that number of steps.
    fn advance(&self, costs: &[Option<Int>]) -> Vec<Option<Int>> {
        let improve =
            |slot: &mut Option<Int>, cost: Int| *slot = Some(slot.map_or(cost, |least| least.min(cost)));
        let mut next = vec![None; costs.len()];
        if let Some(idle) = self.idle_cost {
            for (slot, cost) in next.iter_mut().zip(costs) {
                if let Some(cost) = cost {
                    improve(slot, sum(*cost, idle));
                }
            }
        }
        for (operator, transitions) in self.by_operator() {
            for transition in transitions {
                if let Some(cost) = costs[transition.source as usize] {
                    improve(&mut next[transition.target as usize], sum(cost, self.costs[operator]));
                }
            }
        }
        next
    }

    fn start(&self) -> Vec<Option<Int>> {
        let mut costs = vec![None; self.size()];
        costs[self.initial as usize] = Some(0);
        costs
    }

    /// Returns an upper bound on the number of steps of a plan with cost at most `limit`. Returns `None` if
    /// the projection proves no bound below `max_steps`.
    pub(crate) fn step_bound(
        &self,
        limit: Int,
        max_steps: usize,
        limits: &Limits,
    ) -> Result<Option<usize>, Interrupted> {
        let fits = |costs: &[Option<Int>]| {
            costs
                .iter()
                .zip(&self.to_go)
                .any(|(c, h)| matches!((c, h), (Some(c), Some(h)) if sum(*c, *h) <= limit))
        };
        let mut costs = self.start();
        let mut bound = 0;
        for step in limits.watch(0..=max_steps) {
            let step = step?;
            if !fits(&costs) {
                return Ok(Some(bound));
            }
            bound = step;
            let next = self.advance(&costs);
            // At a fixpoint, the projection proves no bound.
            if next == costs {
                return Ok(None);
            }
            costs = next;
        }
        Ok(None)
    }

    /// Sets `allowed[step][operator]` to `false` if the projection proves that no plan with a cost of at most
    /// `limit` (of any cost if `None`) applies the operator at this step.
    pub(crate) fn restrict(
        &self,
        limit: Option<Int>,
        allowed: &mut [Vec<bool>],
        limits: &Limits,
    ) -> Result<(), Interrupted> {
        let within = |cost: Int| limit.is_none_or(|limit| cost <= limit);
        let mut costs = self.start();
        for row in limits.watch(allowed) {
            let row = row?;
            let through = |(c, h): (&Option<Int>, &Option<Int>)| Some(sum((*c)?, (*h)?));
            let cheapest = costs.iter().zip(&self.to_go).filter_map(through).min();
            let mut by_operator = self.by_operator().peekable();
            for ((index, flag), cost) in row.iter_mut().enumerate().zip(&self.costs[..]) {
                let transitions = by_operator.next_if(|(operator, _)| *operator == index);
                *flag = *flag
                    && match transitions {
                        None => cheapest.is_some_and(|least| within(sum(least, *cost))),
                        Some((_, transitions)) => transitions.iter().any(|transition| {
                            let through =
                                (&costs[transition.source as usize], &self.to_go[transition.target as usize]);
                            matches!(through, (Some(c), Some(h)) if within(sum(sum(*c, *cost), *h)))
                        }),
                    };
            }
            costs = self.advance(&costs);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use task::task::Fact;
    use testing::{depot, ground_text};

    use super::*;
    use crate::bounds::Bounds;

    #[test]
    fn only_operators_that_mention_the_pattern_take_memory() {
        let mut omitted = 0;
        for seed in 0..4 {
            let task = ground_text(depot(seed));
            let bounds = Bounds::of_projections(Context::new(&task, &Limits::none())).expect("no limit");
            for projection in &bounds.projections {
                let mut stored = 0;
                for (operator, id) in task.operators.iter().zip(OperatorId::all(task.operators.len())) {
                    let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
                    let facts = operator.condition.facts.iter().chain(operator.effects.iter());
                    let mentions = |fact: &Fact| projection.pattern.contains(&fact.variable);
                    let is_affected = facts.chain(conditional).any(mentions);
                    assert_eq!(projection.affects_pattern(id.index()), is_affected, "seed {seed}");
                    assert_eq!(!projection.transitions(id).is_empty(), is_affected, "seed {seed}");
                    stored += usize::from(is_affected);
                }
                assert_eq!(projection.operators.len(), stored, "seed {seed}");
                omitted += task.operators.len() - stored;
            }
        }
        assert!(omitted > 0);
    }
}
