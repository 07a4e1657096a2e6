//! Admissible heuristics, and upper bounds on the number of steps of a cheaper plan.
//!
//! A projection to a few finite-domain variables is solved exactly. Dijkstra's algorithm from the
//! abstract goal states gives a consistent, admissible heuristic: a pattern database \[1\]. Dynamic
//! programming over steps and abstract states gives the operators that can occur at each step of a
//! plan cheaper than the best known one, and the number of steps beyond which there is no such
//! plan. Cost partitioning adds up several projections.
//!
//! \[1\] S. Edelkamp: Planning with pattern databases, ECP 2001.

mod cost_partitioning;
mod delete_relaxation;
mod lm_cut;
mod pattern_database;
mod resources;

pub use lm_cut::{LandmarkCut, landmark_cut_bound};
pub use pattern_database::Projection;

use cost_partitioning::CostPartitioning;
use resources::Resource;

use smallvec::SmallVec;
use tracing::info_span;

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::quantity::NumericId;
use task::task::{State, VariableId};

/// Longest plan that step bounds are computed for.
const STEP_LIMIT: usize = 4_000;
/// Largest number of states of a projection.
const STATE_LIMIT: usize = 20_000;
/// Number of projections to pairs of variables that are tried.
const PAIR_LIMIT: usize = 40;
/// Number of projections that are used on their own. More of them cost more time than they save
/// expansions.
const MAX_PROJECTIONS: usize = 12;

/// Projections of a task, sorted by decreasing heuristic value of the initial state, and bounds
/// derived from them.
pub struct Bounds {
    pub projections: Vec<Projection>,
    resources: Vec<Resource>,
    /// Cost partitionings, and the projections that only these use.
    partitions: Vec<CostPartitioning>,
    further: Vec<Projection>,
}

/// Facts about the plans whose cost and length stay within given limits.
pub struct ReachableWindow {
    /// Upper bound on the number of steps of such a plan. `None` if no projection yields one.
    pub steps: Option<usize>,
    /// For each step: whether each operator can occur at it.
    pub allowed: Vec<Vec<bool>>,
}

impl Bounds {
    /// Computes projections and saturated cost partitionings.
    ///
    /// # Errors
    /// Fails when a limit is reached.
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

    /// Computes projections only, without cost partitioning.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn of_projections(context: Context<'_>) -> Result<Self, Interrupted> {
        let task = context.task;
        let basic = |variable: &VariableId| variable.index() < task.basic;
        let goal_variables: Vec<_> = task.goal.facts.iter().map(|fact| fact.variable).filter(basic).collect();
        let mut patterns: Vec<Vec<_>> = goal_variables.iter().map(|variable| vec![*variable]).collect();
        let mut variables: Vec<_> = VariableId::all(task.basic).collect();
        variables.sort_by_key(|variable| std::cmp::Reverse(task.variables[variable.index()].values.len()));
        for variable in &variables {
            for goal in &goal_variables {
                let [goal_size, size] = [goal, variable].map(|id| task.variables[id.index()].values.len());
                let max_patterns = goal_variables.len().saturating_add(PAIR_LIMIT);
                if goal != variable
                    && goal_size.saturating_mul(size) <= STATE_LIMIT
                    && patterns.len() < max_patterns
                {
                    patterns.push(vec![*goal.min(variable), *goal.max(variable)]);
                }
            }
        }
        patterns.sort();
        patterns.dedup();
        if patterns.is_empty() {
            patterns.push(Vec::new());
        }
        let mut projections: Vec<Projection> = Vec::new();
        for pattern in patterns {
            projections.push(Projection::new(context, pattern)?);
        }
        projections.sort_by_key(|projection| std::cmp::Reverse(projection.estimate(&task.initial)));
        let further = projections.split_off(projections.len().min(MAX_PROJECTIONS));
        let resources = resources::resources(context, &projections)?;
        Ok(Self { projections, resources, partitions: Vec::new(), further })
    }

    /// Heuristic that is 0 everywhere: the projection to no variable.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn trivial(context: Context<'_>) -> Result<Self, Interrupted> {
        let projections = vec![Projection::new(context, Vec::new())?];
        Ok(Self { projections, resources: Vec::new(), partitions: Vec::new(), further: Vec::new() })
    }

    /// Lower bound on the cost from a state to the goal. Returns `None` if the goal is unreachable.
    pub fn estimate(&self, state: &State) -> Option<Int> {
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
        let enough = |resource: &Resource| resource.has_enough_resources(state, &self.projections);
        self.resources.iter().all(enough).then_some(best)
    }

    /// Lower bounds on the resources that must remain: the number, the projection, and a value for
    /// each of its abstract states.
    pub fn needs(&self) -> impl Iterator<Item = (NumericId, &Projection, &[Option<Int>])> {
        let projection = |position: &usize| &self.projections[*position];
        self.resources.iter().flat_map(move |resource| {
            let needs = resource.needs.iter();
            needs.map(move |(position, values)| (resource.variable, projection(position), &values[..]))
        })
    }

    /// Facts about plans with cost at most `limit` and at most `horizon` steps, where these are
    /// given.
    ///
    /// # Errors
    /// Fails when a limit is reached.
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
        let mut allowed = vec![vec![true; context.task.operators.len()]; length];
        for projection in &self.projections {
            projection.restrict(limit, &mut allowed, context.limits)?;
        }
        Ok(ReachableWindow { steps, allowed })
    }
}
