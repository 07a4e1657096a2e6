//! Saturated cost partitioning \[1\] over projections of a task.
//!
//! The projections take shares of the operator costs one after another. Each projection takes only the costs
//! that its goal distances need, and the next projection gets the remaining costs. The sum of all goal
//! distances is a consistent heuristic, because each projection uses its own share. The result depends on the
//! order of the projections, so several orders are tried. The sum includes costs that no single projection
//! contains, for example of goals of another robot or of design changes.
//!
//! \[1\] J. Seipp, T. Keller, M. Helmert: Saturated cost partitioning for optimal classical
//! planning, JAIR 67, 2020.

use std::cmp::Reverse;

use num_bigint::BigInt;
use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::number::{GROWTH_LIMIT, Int};

use crate::bounds::pattern_database::Projection;

const MAX_PARTITIONINGS: usize = 4;
const MAX_ORDERS: usize = 60;
/// Limit on the work for all tried orders together, as the number of visited abstract states and transitions.
/// If a single order would exceed it, no cost partitioning is computed.
const MAX_TRANSITIONS: usize = 6_000_000;

/// For some projections, given by index: the goal distances under their shares of the costs. A
/// projection whose distances are all 0 is omitted.
pub(super) struct CostPartitioning {
    parts: Vec<(usize, Vec<Option<Int>>)>,
}

impl CostPartitioning {
    /// Returns the sum of the goal distances. `states` contains the abstract state of each
    /// projection.
    pub(super) fn estimate(&self, states: &[u32]) -> Int {
        let shares = self.parts.iter().map(|(position, to_go)| to_go[states[*position] as usize]);
        // Dead ends are detected by the projections, so a missing distance counts as 0. The capped sum
        // remains a consistent lower bound.
        let sum = shares.fold(0, |sum: Int, share| sum.saturating_add(share.unwrap_or(0)));
        sum.min(GROWTH_LIMIT)
    }

    fn new(
        projections: &[Projection],
        costs: &[Int],
        order: &[usize],
        limits: &Limits,
    ) -> Result<Self, Interrupted> {
        let mut remaining = costs.to_vec();
        let mut parts = Vec::new();
        for position in order {
            let to_go = projections[*position].goal_distances(&remaining, limits)?;
            if to_go.iter().any(|cost| cost.is_some_and(|cost| cost > 0)) {
                for (operator, used) in projections[*position].saturated(&to_go) {
                    remaining[operator] = remaining[operator].saturating_sub(used);
                }
                parts.push((*position, to_go));
            }
        }
        Ok(Self { parts })
    }
}

/// Returns at most `MAX_PARTITIONINGS` saturated cost partitionings, sorted by decreasing heuristic
/// value of the initial state. The list is empty if fewer than two projections are useful, if they have too
/// many transitions, or if no cost partitioning is better for the initial state than the best projection.
pub(super) fn saturated_cost_partitionings(
    context: Context<'_>,
    projections: &[Projection],
) -> Result<Vec<CostPartitioning>, Interrupted> {
    let Context { task, limits } = context;
    let costs: Vec<Int> = task.operators.iter().map(|operator| operator.cost.minimum().max(0)).collect();
    let initial: Vec<u32> = projections.iter().map(|projection| projection.state(&task.initial)).collect();
    let alone = |position: usize| projections[position].goal_distance(initial[position]).unwrap_or(0);
    let mut useful: Vec<usize> = Vec::new();
    let mut positions: Vec<usize> = (0..projections.len()).filter(|position| alone(*position) > 0).collect();
    positions.sort_by_key(|position| projections[*position].pattern.len());
    for position in positions {
        // A projection to fewer variables with equal goal distances makes the finer projection useless.
        let is_coarser = |coarser: &usize| projections[position].is_dominated_by(&projections[*coarser]);
        if !useful.iter().any(is_coarser) {
            useful.push(position);
        }
    }
    useful.sort_unstable();
    let transitions: usize = useful.iter().map(|position| projections[*position].transition_count()).sum();
    if useful.len() < 2 || transitions > MAX_TRANSITIONS {
        return Ok(Vec::new());
    }
    let mut budget = MAX_TRANSITIONS.checked_div(transitions).unwrap_or(MAX_TRANSITIONS).clamp(1, MAX_ORDERS);
    let mut tried: Vec<(Int, Vec<usize>, CostPartitioning)> = Vec::new();
    let mut attempt = |order: Vec<usize>, tried: &mut Vec<(Int, Vec<usize>, CostPartitioning)>| {
        if budget == 0 || tried.iter().any(|(_, previous, _)| *previous == order) {
            return Ok(());
        }
        budget = budget.saturating_sub(1);
        let partition = CostPartitioning::new(projections, &costs, &order, limits)?;
        tried.push((partition.estimate(&initial), order, partition));
        // The sort is stable: among orders with equal value, the earlier order stays first.
        tried.sort_by_key(|(estimate, ..)| Reverse(*estimate));
        Ok(())
    };
    let greedy = by_yield(projections, &useful, alone);
    attempt(greedy.clone(), &mut tried)?;
    for first in &useful {
        let successors = greedy.iter().filter(|position| *position != first);
        attempt(std::iter::once(first).chain(successors).copied().collect(), &mut tried)?;
    }
    // Local search from the best order: exchange two neighbouring projections.
    for (before, place) in (1..useful.len()).enumerate() {
        let mut order = tried[0].1.clone();
        order.swap(before, place);
        attempt(order, &mut tried)?;
    }
    let best = useful.iter().map(|position| alone(*position)).max().unwrap_or(0);
    if tried[0].0 <= best {
        return Ok(Vec::new());
    }
    tried.truncate(MAX_PARTITIONINGS);
    Ok(tried.into_iter().map(|(.., partition)| partition).collect())
}

/// Returns the projections `useful` (indices), sorted by decreasing ratio of the initial goal
/// distance `alone` to the sum of the used operator costs.
fn by_yield(projections: &[Projection], useful: &[usize], alone: impl Fn(usize) -> Int) -> Vec<usize> {
    let used_cost = |position: usize| {
        let projection = &projections[position];
        // The sum may saturate, because it affects only the order.
        let costs = projection.saturated(projection.costs()).map(|(_, cost)| cost);
        costs.fold(0, Int::saturating_add).max(1)
    };
    let mut order: Vec<(usize, Int, Int)> =
        useful.iter().map(|position| (*position, alone(*position), used_cost(*position))).collect();
    let product = |a: &Int, b: &Int| BigInt::from(*a) * b;
    order.sort_by(|(_, a, s), (_, b, t)| product(b, s).cmp(&product(a, t)));
    order.into_iter().map(|(position, ..)| position).collect()
}
