//! Admissible heuristics, and upper bounds on the number of steps of a cheaper plan.
//!
//! A projection to a few finite-domain variables is solved exactly. Dijkstra's algorithm from the abstract goal
//! states gives a consistent, admissible heuristic: a pattern database \[1\]. Dynamic programming over steps and
//! abstract states gives the operators that can occur at each step of a plan cheaper than the best known one,
//! and the number of steps beyond which there is no such plan. Cost partitioning adds up several projections.
//!
//! \[1\] S. Edelkamp: Planning with pattern databases, ECP 2001.

mod cost_partitioning;
mod delete_relaxation;
mod lm_cut;
mod pattern_database;
mod resources;

pub use lm_cut::LandmarkCut;
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
/// How many projections to pairs of variables are tried.
const PAIR_LIMIT: usize = 40;
/// Beyond the best few, projections cost more time than they save steps.
const MAX_PROJECTIONS: usize = 12;

/// Projections of a task, the one with the highest estimate of the initial state first.
pub struct Bounds {
    pub projections: Vec<Projection>,
    resources: Vec<Resource>,
    /// Sums of shares, and the projections that only these use.
    partitions: Vec<CostPartitioning>,
    further: Vec<Projection>,
}

/// What is known of plans whose cost stays below some limit.
pub struct ReachableWindow {
    /// No such plan has more steps; none if projections do not tell.
    pub steps: Option<usize>,
    /// For each step, whether each operator can be there.
    pub allowed: Vec<Vec<bool>>,
}

impl Bounds {
    /// Lower bounds of a task, by projections and cost partitioning.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn new(context: Context<'_>) -> Result<Self, Interrupted> {
        let _span = info_span!("bounds").entered();
        let mut bounds = Self::of_projections(context)?;
        bounds.projections.append(&mut bounds.further);
        bounds.partitions = cost_partitioning::saturated_cost_partitionings(context, &bounds.projections)?;
        let kept = bounds.projections.len().min(MAX_PROJECTIONS);
        bounds.further = bounds.projections.split_off(kept);
        if bounds.partitions.is_empty() {
            bounds.further.clear();
        }
        Ok(bounds)
    }

    /// Bounds that each rest on one projection.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn of_projections(context: Context<'_>) -> Result<Self, Interrupted> {
        let task = context.task;
        let basic = |variable: &VariableId| variable.index() < task.basic;
        let goal_variables: Vec<_> = task.goal.facts.iter().map(|fact| fact.variable).filter(basic).collect();
        let mut patterns: Vec<Vec<_>> = goal_variables.iter().map(|variable| vec![*variable]).collect();
        let mut others: Vec<_> = VariableId::all(task.basic).collect();
        others.sort_by_key(|variable| std::cmp::Reverse(task.variables[variable.index()].values.len()));
        for other in &others {
            for goal in &goal_variables {
                let [one, two] = [goal, other].map(|variable| task.variables[variable.index()].values.len());
                let most = goal_variables.len().saturating_add(PAIR_LIMIT);
                if goal != other && one.saturating_mul(two) <= STATE_LIMIT && patterns.len() < most {
                    patterns.push(vec![*goal.min(other), *goal.max(other)]);
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

    /// Bounds that say nothing: the projection to no variable at all.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn trivial(context: Context<'_>) -> Result<Self, Interrupted> {
        let projections = vec![Projection::new(context, Vec::new())?];
        Ok(Self { projections, resources: Vec::new(), partitions: Vec::new(), further: Vec::new() })
    }

    /// A lower bound on the cost from a state to the goal; none if the goal cannot be reached.
    pub fn estimate(&self, state: &State) -> Option<Int> {
        let mut best = 0;
        if self.partitions.is_empty() {
            for projection in &self.projections {
                best = best.max(projection.estimate(state)?);
            }
        } else {
            let mut states: SmallVec<[u32; 16]> = SmallVec::new();
            for projection in self.projections.iter().chain(&self.further) {
                let own = projection.state(state);
                best = best.max(projection.goal_distance(own)?);
                states.push(own);
            }
            best = self.partitions.iter().map(|partition| partition.estimate(&states)).fold(best, Int::max);
        }
        let enough = |resource: &Resource| resource.has_enough_resources(state, &self.projections);
        self.resources.iter().all(enough).then_some(best)
    }

    /// What must be left of resources: the number, the projection, and a value for each of its abstract states.
    pub fn needs(&self) -> impl Iterator<Item = (NumericId, &Projection, &[Option<Int>])> {
        let projection = |position: &usize| &self.projections[*position];
        self.resources.iter().flat_map(move |resource| {
            let needs = resource.needs.iter();
            needs.map(move |(position, values)| (resource.variable, projection(position), &values[..]))
        })
    }

    /// What is known of plans with cost at most `limit` and at most `horizon` steps, where either is given.
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
                    steps = Some(steps.map_or(bound, |known| known.min(bound)));
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
