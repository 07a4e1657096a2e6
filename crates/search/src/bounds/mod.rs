//! Admissible heuristics, and upper bounds on the number of steps of plans within a cost limit.
//!
//! A projection to a few finite-domain variables is solved exactly. Dijkstra's algorithm from the abstract
//! goal states yields an admissible and consistent heuristic: a pattern database \[1\]. Dynamic programming
//! over steps and abstract states yields two more results: the operators that can occur at each step of a
//! plan within a cost limit, and the number of steps above which no such plan exists. Cost partitioning adds
//! the values of several projections. LM-cut is slower, but usually more accurate. Lower bounds on the
//! consumption of resources detect dead ends.
//!
//! \[1\] S. Edelkamp: Planning with pattern databases, ECP 2001.

mod abstraction;
mod cartesian;
mod cost_partitioning;
mod delete_relaxation;
mod fact_landmarks;
mod lm_cut;
mod online_cost_partitioning;
mod pattern_database;
mod resources;
mod systematic_patterns;

pub use lm_cut::{LandmarkCut, landmark_cut_bound};
pub use online_cost_partitioning::OnlineCostPartitioning;
pub use pattern_database::Projection;

use cost_partitioning::CostPartitioning;
use pattern_database::operator_costs;
use resources::Resource;

use smallvec::SmallVec;
use tracing::info_span;

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::quantity::NumericId;
use task::task::{State, Task, VariableId};

/// Upper bounds on the number of steps are used only if they are below this number.
const STEP_LIMIT: usize = 4_000;
/// Maximum number of abstract states of a projection to two variables.
const STATE_LIMIT: usize = 20_000;
const PAIR_LIMIT: usize = 40;
/// Maximum number of projections that are evaluated for each state if there is no cost partitioning. More
/// projections cost more time than the avoided expansions save.
const MAX_PROJECTIONS: usize = 12;

/// Projections of a task, sorted by decreasing heuristic value of the initial state, and lower bounds
/// computed from them.
pub struct Bounds {
    pub projections: Vec<Projection>,
    resources: Vec<Resource>,
    /// Cost partitionings; empty if they were not computed or do not improve the heuristic.
    partitions: Vec<CostPartitioning>,
    /// Further projections, which are evaluated only if there are cost partitionings.
    further: Vec<Projection>,
}

/// Plans within a limit on cost and steps: an upper bound on their length, and the operators of each step.
pub struct ReachableWindow {
    /// Upper bound on the number of steps of plans within the cost limit. `None` if there is no cost limit,
    /// or no projection proves a bound below `STEP_LIMIT`.
    pub steps: Option<usize>,
    /// For each step and each operator: `false` if it is proved that the operator cannot occur at the step. The
    /// length of the list is the lesser of `steps` and the horizon given to [`Bounds::window`], or 0 without both.
    pub allowed: Vec<Vec<bool>>,
}

impl Bounds {
    /// Computes projections, lower bounds on resources, and saturated cost partitionings of a task.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn new(context: Context<'_>) -> Result<Self, Interrupted> {
        let _span = info_span!("bounds").entered();
        let mut bounds = Self::of_projections(context)?;
        bounds.projections.append(&mut bounds.further);
        bounds.partitions = cost_partitioning::saturated_cost_partitionings(context, &bounds.projections)?;
        let count = bounds.projections.len().min(MAX_PROJECTIONS);
        bounds.further = bounds.projections.split_off(count);
        if bounds.partitions.is_empty() {
            bounds.further.clear();
        }
        Ok(bounds)
    }

    /// Computes projections and lower bounds on resources, without cost partitioning.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn of_projections(context: Context<'_>) -> Result<Self, Interrupted> {
        let task = context.task;
        let basic = |variable: &VariableId| variable.index() < task.basic;
        let goal_variables: Vec<_> = task.goal.facts.iter().map(|fact| fact.variable).filter(basic).collect();
        let mut patterns: Vec<Vec<_>> = goal_variables.iter().map(|variable| vec![*variable]).collect();
        let mut variables: Vec<_> = VariableId::all(task.basic).collect();
        variables.sort_by_key(|variable| std::cmp::Reverse(task.variables[variable.index()].values.len()));
        let max_patterns = goal_variables.len().saturating_add(PAIR_LIMIT);
        'pairs: for variable in context.limits.watch(&variables) {
            let variable = variable?;
            for goal in &goal_variables {
                if patterns.len() >= max_patterns {
                    break 'pairs;
                }
                let [goal_size, size] = [goal, variable].map(|id| task.variables[id.index()].values.len());
                if goal != variable && goal_size.saturating_mul(size) <= STATE_LIMIT {
                    patterns.push(vec![*goal.min(variable), *goal.max(variable)]);
                }
            }
        }
        patterns.sort();
        patterns.dedup();
        if patterns.is_empty() {
            patterns.push(Vec::new());
        }
        let costs = operator_costs(task);
        let mut projections: Vec<Projection> = Vec::new();
        for pattern in patterns {
            projections.push(Projection::new(context, pattern, &costs)?);
        }
        // A projection that proves the goal unreachable comes first, so that it is never omitted.
        let estimate = |projection: &Projection| projection.estimate(&task.initial).unwrap_or(Int::MAX);
        projections.sort_by_key(|projection| std::cmp::Reverse(estimate(projection)));
        let further = projections.split_off(projections.len().min(MAX_PROJECTIONS));
        let resources = resources::resources(context, &projections)?;
        Ok(Self { projections, resources, partitions: Vec::new(), further })
    }

    /// Returns the heuristic that is 0 in every state. It consists of the projection to the empty pattern,
    /// whose only abstract state is a goal state. Used for formulas that must not depend on a heuristic.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn trivial(context: Context<'_>) -> Result<Self, Interrupted> {
        let projections = vec![Projection::new(context, Vec::new(), &operator_costs(context.task))?];
        Ok(Self { projections, resources: Vec::new(), partitions: Vec::new(), further: Vec::new() })
    }

    /// Returns a lower bound on the cost from a state to the goal (with negative costs of operators counted as 0), or
    /// `None` if the goal is proved unreachable from the state.
    pub fn estimate(&self, state: &State) -> Option<Int> {
        let cost = self.cost_estimate(state)?;
        self.missing_resource(state).is_none().then_some(cost)
    }

    fn missing_resource(&self, state: &State) -> Option<&Resource> {
        self.resources.iter().find(|resource| !resource.has_enough_resources(state, &self.projections))
    }

    /// Returns the reason why the goal is unreachable from a state for which [`Bounds::estimate`] is `None`.
    pub fn dead_end_reason(&self, task: &Task, state: &State) -> String {
        let missing = self.missing_resource(state).filter(|_| self.cost_estimate(state).is_some());
        let name = missing.and_then(|resource| task.number_names.get(resource.variable.index()));
        let projection = "in a projection of the task to one or two of its variables";
        match name {
            None => format!("no path leads to the goal {projection}"),
            // A path to an action that may increase the resource would suffice, but needs too much of it as well.
            Some(name) => format!("each path to the goal {projection} needs more of {name} than there is"),
        }
    }

    /// Like [`Bounds::estimate`], but ignores resources. Depends only on the finite-domain
    /// variables.
    pub(crate) fn cost_estimate(&self, state: &State) -> Option<Int> {
        let mut best = 0;
        if self.partitions.is_empty() {
            for projection in &self.projections {
                best = best.max(projection.estimate(state)?);
            }
        } else {
            let mut states: SmallVec<[u32; 16]> = SmallVec::new();
            for projection in self.projections.iter().chain(&self.further) {
                let abstract_state = projection.state(state);
                best = best.max(projection.goal_distance(abstract_state)?);
                states.push(abstract_state);
            }
            best = self.partitions.iter().map(|partition| partition.estimate(&states)).fold(best, Int::max);
        }
        Some(best)
    }

    /// Computes a heuristic for A\* that improves during the search: online saturated cost partitioning over
    /// projections and Cartesian abstractions. `max_work` limits the effort to compute the abstractions.
    /// Returns `None` if every abstraction yields 0 for all states.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn online_cost_partitioning(
        &self,
        context: Context<'_>,
        max_work: u64,
    ) -> Result<Option<OnlineCostPartitioning>, Interrupted> {
        let _span = info_span!("abstractions").entered();
        OnlineCostPartitioning::new(context, self.projections.iter().chain(&self.further), max_work)
    }

    /// Returns lower bounds on the resources that a state must have to reach the goal or an operator that may
    /// replenish the resource. Each item is a numeric variable, a projection, and the required amount for
    /// each abstract state of the projection; `None` means that no amount suffices.
    pub fn needs(&self) -> impl Iterator<Item = (NumericId, &Projection, &[Option<Int>])> {
        let projection = |position: &usize| &self.projections[*position];
        self.resources.iter().flat_map(move |resource| {
            let needs = resource.needs.iter();
            needs.map(move |(position, values)| (resource.variable, projection(position), &values[..]))
        })
    }

    /// Returns an upper bound on the number of steps of plans that cost at most `limit`, and the operators that
    /// may occur at each step of such plans. The steps are considered up to the bound and to `horizon`. `limit`
    /// and `horizon` are `None` if cost or steps are not limited.
    ///
    /// # Errors
    /// Fails if the deadline has passed, the interrupt flag is set, or the table of operators and steps would exceed the
    /// memory limit.
    pub fn window(
        &self,
        context: Context<'_>,
        limit: Option<Int>,
        horizon: Option<usize>,
    ) -> Result<ReachableWindow, Interrupted> {
        let mut steps: Option<usize> = None;
        if let Some(limit) = limit {
            for projection in &self.projections {
                if let Some(bound) = projection.step_bound(limit, STEP_LIMIT, context.limits)? {
                    steps = Some(steps.map_or(bound, |least| least.min(bound)));
                }
            }
        }
        let length = match (steps, horizon) {
            (Some(a), Some(b)) => a.min(b),
            (a, b) => a.or(b).unwrap_or(0),
        };
        let operators = context.task.operators.len();
        if length.saturating_mul(operators) > context.limits.room() {
            return Err(Interrupted);
        }
        let mut allowed = vec![vec![true; operators]; length];
        for projection in &self.projections {
            projection.restrict(limit, &mut allowed, context.limits)?;
        }
        Ok(ReachableWindow { steps, allowed })
    }
}
