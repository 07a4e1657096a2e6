//! Online saturated cost partitioning \[1\] over projections and Cartesian abstractions, for A\*.
//!
//! The abstractions are computed once, after a search has worked for some time: Cartesian abstractions for goals and
//! landmarks, and projections to systematically selected patterns. Then, from time to time, an order
//! of the abstractions is computed for the state that is being evaluated. A\* expands states by increasing
//! estimates of the plan cost, so this estimate is low. The cost partitioning of the order is kept if it raises
//! the estimate of this state. The heuristic value is the maximum over all kept cost partitionings. The effort
//! for new orders is limited to a part of the effort for evaluations.
//!
//! Each order is used twice \[2\]: first for the distances up to the distance of the state, so that abstractions
//! do not use costs for states that are farther from the goal, and then for the remaining costs.
//!
//! \[1\] J. Seipp: Online saturated cost partitioning for classical planning, ICAPS 2021.
//!
//! \[2\] J. Seipp, M. Helmert: Subset-saturated cost partitioning for optimal classical planning, ICAPS 2019.

use num_integer::Integer;
use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::number::{GROWTH_LIMIT, Int};
use task::task::Task;

use crate::bounds::abstraction::{Abstraction, MAX_ABSTRACTIONS, MAX_DISTANCE, Scratch, UNREACHABLE};
use crate::bounds::cartesian::{RefinementLimits, Subtask, cartesian_abstraction, operators_by_effect};
use crate::bounds::fact_landmarks::fact_landmarks;
use crate::bounds::pattern_database::Projection;
use crate::bounds::systematic_patterns::{SelectionLimits, systematic_projections};

/// Approximate upper limit on the number of abstract states and transitions of all abstractions together.
const MAX_TRANSITIONS: usize = 1_000_000;
/// Upper limit on the number of abstract states and transitions of a projection. Greater projections are omitted.
const MAX_PROJECTION_SIZE: usize = 100_000;
const MIN_STRIDE: usize = 8;
const MAX_PARTITIONINGS: usize = 128;
/// Divisor: the tables of goal distances may take at most 1/8 of the memory limit.
const TABLE_SHARE: usize = 8;
/// Work units to visit a transition or an abstract state in the computation of goal distances.
const WORK_PER_VISIT: u64 = 10;
/// Work units of an evaluation, for each abstraction.
const WORK_PER_ABSTRACTION: u64 = 20;
/// Divisor: an order may take at most about 1/4 of the work for evaluations and expansions until the next order.
const ORDER_SHARE: u64 = 4;
/// Work units of A\* for each evaluated state, approximately.
const WORK_PER_EVALUATION: u64 = 5_000;

/// Heuristic for A\* that improves while it is evaluated.
pub struct OnlineCostPartitioning {
    abstractions: Vec<Abstraction>,
    costs: Vec<u32>,
    /// Greatest common divisor of the operator costs: the unit in which `costs` and distances are counted.
    unit: Int,
    /// For each abstraction: for each abstract state, a row of `stride` goal distances. The first is the distance
    /// under the full costs, the others under the shares of cost partitionings.
    tables: Vec<Vec<u32>>,
    rows: usize,
    /// Number of abstract states and transitions of all abstractions.
    transitions: usize,
    stride: usize,
    partitionings: usize,
    /// For each abstraction: `true` if it detects dead ends, or has a share of a kept cost partitioning. The other
    /// abstractions are evaluated only for new orders.
    is_active: Vec<bool>,
    /// For each abstraction: the operator costs that it takes from other abstractions, see [`stolen_costs`].
    stolen: Vec<u64>,
    limits: Limits,
    scratch: Scratch,
    sums: Vec<u32>,
    work: u64,
    order_work: u64,
    evaluations: u64,
    next_order: u64,
    /// Number of orders since the last one that was kept, at most 10.
    failures: u32,
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "counts of what is in memory, and sums of at most MAX_ABSTRACTIONS distances of at most MAX_DISTANCE"
)]
impl OnlineCostPartitioning {
    /// Computes the abstractions, with at most about `max_work` work units for the Cartesian abstractions, and as
    /// many for the selection of patterns. Returns `None` if no abstraction is useful.
    pub(super) fn new<'p>(
        context: Context<'_>,
        projections: impl Iterator<Item = &'p Projection>,
        max_work: u64,
    ) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let (costs, unit) = scaled_costs(task);
        let mut scratch = Scratch::new(costs.len());
        let mut pulse = limits.pulse();
        let mut abstractions: Vec<Abstraction> = Vec::new();
        let mut work = 0;
        let mut remaining = MAX_TRANSITIONS;
        let by_effect = operators_by_effect(task);
        let subtasks = subtasks(context)?;
        let count = subtasks.len();
        for (subtask, position) in subtasks.iter().zip(0..) {
            let remaining_count = count - position;
            let share = max_work.saturating_sub(work) / remaining_count as u64;
            let refinement = RefinementLimits { transitions: remaining / remaining_count, work: share };
            let (abstraction, used) =
                cartesian_abstraction(context, &costs, &by_effect, subtask, refinement)?;
            remaining = remaining.saturating_sub(abstraction.size());
            work += used;
            abstractions.push(abstraction);
        }
        let selection = SelectionLimits {
            projections: MAX_ABSTRACTIONS - abstractions.len(),
            transitions: remaining,
            work: max_work,
        };
        let (selected, used) = systematic_projections(context, &costs, &by_effect, selection, &mut scratch)?;
        work += used;
        let selected_size: usize = selected.iter().map(Abstraction::size).sum();
        remaining = remaining.saturating_sub(selected_size);
        abstractions.extend(selected);
        let is_selected = |projection: &Projection| {
            abstractions.iter().any(|abstraction| abstraction.is_projection_to(&projection.pattern))
        };
        let small = projections.filter(|projection| projection.transition_count() <= MAX_PROJECTION_SIZE);
        let further: Vec<&Projection> = small.filter(|projection| !is_selected(projection)).collect();
        let free = MAX_ABSTRACTIONS - abstractions.len();
        for projection in further.into_iter().take(free) {
            let abstraction = Abstraction::of_projection(projection);
            if abstraction.size() > remaining {
                break;
            }
            remaining -= abstraction.size();
            abstractions.push(abstraction);
        }
        let mut alone = Vec::new();
        let mut distances = Vec::new();
        for abstraction in &abstractions {
            abstraction.goal_distances(&costs, &mut distances, &mut scratch, &mut pulse)?;
            alone.push(distances.clone());
        }
        // An abstraction in which every distance is 0 is useless.
        let is_useful: Vec<bool> = alone.iter().map(|row| row.iter().any(|cost| *cost > 0)).collect();
        let mut useful = is_useful.iter();
        abstractions.retain(|_| useful.next() == Some(&true));
        let mut useful = is_useful.iter();
        alone.retain(|_| useful.next() == Some(&true));
        if abstractions.is_empty() {
            return Ok(None);
        }
        let is_active = alone.iter().map(|row| row.contains(&UNREACHABLE)).collect();
        let stolen = stolen_costs(&abstractions, &alone, &costs, &mut scratch);
        let transitions: usize = abstractions.iter().map(Abstraction::size).sum();
        let order_work = transitions as u64 * 2 * WORK_PER_VISIT;
        let mut partitioning = Self {
            rows: abstractions.iter().map(Abstraction::len).sum(),
            transitions,
            abstractions,
            costs,
            unit,
            tables: alone,
            stride: 1,
            partitionings: 0,
            is_active,
            stolen,
            limits: limits.clone(),
            scratch,
            sums: Vec::new(),
            work: work + order_work,
            order_work,
            evaluations: 0,
            next_order: 0,
            failures: 0,
        };
        partitioning.estimate(&task.initial.values);
        Ok(Some(partitioning))
    }

    /// Returns a lower bound on the cost from a state to the goal, or `None` if the goal is proved unreachable.
    pub(crate) fn estimate(&mut self, values: &[u32]) -> Option<Int> {
        self.evaluations += 1;
        let mut sums = std::mem::take(&mut self.sums);
        sums.clear();
        sums.resize(self.stride - 1, 0);
        let mut is_reachable = true;
        let tables = self.abstractions.iter().zip(&self.tables);
        for ((abstraction, table), _) in tables.zip(&self.is_active).filter(|(_, is_active)| **is_active) {
            let (state, steps) = abstraction.state(values);
            self.work += WORK_PER_ABSTRACTION + u64::from(steps) + self.stride as u64 / 4;
            let row = &table[state as usize * self.stride..(state as usize + 1) * self.stride];
            is_reachable &= row[0] != UNREACHABLE;
            for (sum, distance) in sums.iter_mut().zip(&row[1..]) {
                *sum += distance;
            }
        }
        let mut result = None;
        if is_reachable {
            let mut best = sums[..self.partitionings].iter().copied().fold(0, u32::max);
            if self.evaluations >= self.next_order {
                best = best.max(self.try_order(values, best));
            }
            result = Some(Int::from(best).saturating_mul(self.unit).min(GROWTH_LIMIT));
        }
        self.sums = sums;
        result
    }

    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    pub(crate) fn bytes(&self) -> usize {
        self.rows * self.stride * size_of::<u32>() + self.transitions * size_of::<(u32, u32)>()
    }

    /// Computes the cost partitioning of an order for a state from which no abstraction proves the goal
    /// unreachable, and keeps it if it raises the estimate. Returns its estimate, or 0 if a limit is reached.
    fn try_order(&mut self, values: &[u32], estimate: u32) -> u32 {
        let is_full = self.partitionings + 1 >= self.stride
            && self.rows.saturating_mul((self.stride * 2).max(MIN_STRIDE)).saturating_mul(size_of::<u32>())
                > self.limits.room() / TABLE_SHARE;
        if self.partitionings >= MAX_PARTITIONINGS || is_full {
            self.next_order = u64::MAX;
            return 0;
        }
        self.work += self.order_work;
        let states = self.abstractions.iter().map(|abstraction| abstraction.state(values).0);
        let states: Vec<u32> = states.collect();
        let Ok((tables, value)) = self.partition(&states) else {
            self.next_order = u64::MAX;
            return 0;
        };
        let is_better = value > estimate;
        self.failures = if is_better { 0 } else { (self.failures + 1).min(10) };
        // The pause doubles after each order in a row that is not kept, at most ten times.
        let pause = (self.order_work * ORDER_SHARE / WORK_PER_EVALUATION).max(1) << self.failures;
        self.next_order = self.evaluations.saturating_add(pause);
        if is_better {
            self.keep(&tables);
        }
        value
    }

    /// Computes the cost partitioning of an order for the given abstract states: the goal distances of each
    /// abstraction, and the sum of those of the given states.
    fn partition(&mut self, states: &[u32]) -> Result<(Vec<Vec<u32>>, u32), Interrupted> {
        let mut pulse = self.limits.pulse();
        let mut remaining = self.costs.clone();
        let mut tables: Vec<Vec<u32>> = vec![Vec::new(); self.abstractions.len()];
        let order = self.order(states);
        let mut distances = Vec::new();
        let mut value = 0;
        for is_perimeter in [true, false] {
            for position in &order {
                let (abstraction, state) = (&self.abstractions[*position], states[*position]);
                abstraction.goal_distances(&remaining, &mut distances, &mut self.scratch, &mut pulse)?;
                if is_perimeter {
                    // Distances of other states are capped at the distance of this state.
                    let distance = distances[state as usize];
                    let finite = distances.iter_mut().filter(|other| **other != UNREACHABLE);
                    finite.for_each(|other| *other = distance.min(*other));
                }
                let use_cost = |operator: usize, used: u32| {
                    remaining[operator] = remaining[operator].saturating_sub(used);
                };
                abstraction.saturate(&distances, &mut self.scratch, use_cost);
                let table = &mut tables[*position];
                table.resize(distances.len(), 0);
                for (sum, distance) in table.iter_mut().zip(&distances) {
                    if *distance != UNREACHABLE {
                        *sum = (*sum + distance).min(MAX_DISTANCE);
                    }
                }
            }
        }
        for (table, state) in tables.iter().zip(states) {
            value += table[*state as usize];
        }
        Ok((tables, value))
    }

    /// Returns the abstractions, sorted by decreasing ratio of the goal distance of a state to the costs that
    /// the abstraction takes from others.
    fn order(&self, states: &[u32]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.abstractions.len()).collect();
        let distance = |position: usize| self.tables[position][states[position] as usize * self.stride];
        order.sort_by_cached_key(|position| {
            // Scaled, so that the quotient is precise enough.
            let yielded = u128::from(distance(*position)) << 64;
            std::cmp::Reverse(yielded / u128::from(self.stolen[*position] + 1))
        });
        order
    }

    fn keep(&mut self, columns: &[Vec<u32>]) {
        let (old, column) = (self.stride, self.partitionings + 1);
        if column >= old {
            self.stride = (old * 2).max(MIN_STRIDE);
            for table in &mut self.tables {
                let mut wider = vec![0; table.len() / old * self.stride];
                for (row, to) in table.chunks(old).zip(wider.chunks_mut(self.stride)) {
                    to[..old].copy_from_slice(row);
                }
                *table = wider;
            }
        }
        for ((table, distances), is_active) in self.tables.iter_mut().zip(columns).zip(&mut self.is_active) {
            *is_active |= distances.iter().any(|distance| *distance > 0);
            for (row, distance) in table.chunks_mut(self.stride).zip(distances) {
                row[column] = *distance;
            }
        }
        self.partitionings = column;
    }
}

/// Returns the operator costs as multiples of the returned unit, at most `MAX_DISTANCE` each.
fn scaled_costs(task: &Task) -> (Vec<u32>, Int) {
    let costs: Vec<Int> = task.operators.iter().map(|operator| operator.cost.minimum().max(0)).collect();
    let unit = costs.iter().fold(0, |divisor: Int, cost| divisor.gcd(cost)).max(1);
    let scaled = costs.iter().map(|cost| {
        let cost = cost.checked_div(unit).unwrap_or(0);
        u32::try_from(cost).unwrap_or(MAX_DISTANCE).min(MAX_DISTANCE)
    });
    (scaled.collect(), unit)
}

/// Returns a subtask for each goal fact and each fact landmark, at most half of `MAX_ABSTRACTIONS`.
fn subtasks(context: Context<'_>) -> Result<Vec<Subtask>, Interrupted> {
    let task = context.task;
    let goals = task.goal.facts.iter().filter(|fact| fact.variable.index() < task.basic);
    let mut subtasks: Vec<Subtask> =
        goals.map(|fact| Subtask { goals: vec![*fact], unreachable: Vec::new() }).collect();
    let landmarks = fact_landmarks(context)?;
    subtasks.extend(
        landmarks
            .into_iter()
            .map(|landmark| Subtask { goals: vec![landmark.fact], unreachable: landmark.later_facts }),
    );
    subtasks.truncate(MAX_ABSTRACTIONS / 2);
    Ok(subtasks)
}

/// Returns, for each abstraction, the sum over all operators of the cost that the abstraction needs and that is then
/// missing for the other abstractions. `distances` are the goal distances under the full costs.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "sums over operators and abstractions in memory, of numbers below MAX_DISTANCE"
)]
fn stolen_costs(
    abstractions: &[Abstraction],
    distances: &[Vec<u32>],
    costs: &[u32],
    scratch: &mut Scratch,
) -> Vec<u64> {
    let mut needed = vec![0_u64; costs.len()];
    for (abstraction, distances) in abstractions.iter().zip(distances) {
        abstraction.saturate(distances, scratch, |operator, used| needed[operator] += u64::from(used));
    }
    let stolen = |(abstraction, distances): (&Abstraction, &Vec<u32>)| {
        let mut sum = 0;
        abstraction.saturate(distances, scratch, |operator, used| {
            let needed_elsewhere = needed[operator] - u64::from(used);
            let missing = needed[operator].saturating_sub(u64::from(costs[operator]));
            sum += u64::from(used).min(needed_elsewhere).min(missing);
        });
        sum
    };
    abstractions.iter().zip(distances).map(stolen).collect()
}

#[cfg(test)]
mod tests {
    use rustc_hash::FxHashMap;
    use task::task::State;
    use testing::adl::Generator;
    use testing::missions::Mission;
    use testing::random::Random;
    use testing::{depot, fleet, ground_text, successors};

    use super::*;
    use crate::bounds::Bounds;

    /// Returns the reachable states of a task, each with the minimum cost to a goal state; `None` if the task has more
    /// than `max_states` reachable states.
    fn exact_costs(task: &Task, max_states: usize) -> Option<Vec<(State, Option<Int>)>> {
        let mut index = FxHashMap::from_iter([(task.initial.clone(), 0)]);
        let mut states = vec![task.initial.clone()];
        let mut steps: Vec<(usize, usize, Int)> = Vec::new();
        let mut position = 0;
        while position < states.len() {
            for (next, cost) in successors(task, &states[position].clone()) {
                let target = *index.entry(next.clone()).or_insert(states.len());
                if target == states.len() {
                    states.push(next);
                }
                steps.push((position, target, cost));
            }
            if states.len() > max_states {
                return None;
            }
            position += 1;
        }
        let mut costs: Vec<Option<Int>> =
            states.iter().map(|state| task.is_goal(state).then_some(0)).collect();
        // Bellman and Ford: repeat until nothing changes.
        loop {
            let mut changed = false;
            for (source, target, cost) in &steps {
                if let Some(through) = costs[*target].map(|rest| rest + cost)
                    && costs[*source].is_none_or(|known| through < known)
                {
                    costs[*source] = Some(through);
                    changed = true;
                }
            }
            if !changed {
                return Some(states.into_iter().zip(costs).collect());
            }
        }
    }

    /// Compares online cost partitioning with the exact cost of every reachable state, several times, so that cost
    /// partitionings are added in between. Returns the number of kept cost partitionings, and of positive estimates.
    fn check_online(text: &(String, String)) -> [usize; 2] {
        let task = ground_text(text.clone());
        if task.unreachable.is_some() {
            return [0; 2];
        }
        let limits = Limits::none();
        let context = Context::new(&task, &limits);
        let bounds = Bounds::new(context).expect("no limit");
        let Some(exact) = exact_costs(&task, 3_000) else { return [0; 2] };
        let [mut kept, mut positive] = [0; 2];
        for max_work in [500, 10_000, 10_000_000] {
            let Some(mut online) = bounds.online_cost_partitioning(context, max_work).expect("no limit")
            else {
                continue;
            };
            for _ in 0..3 {
                for (state, cost) in &exact {
                    let estimate = online.estimate(&state.values);
                    let is_admissible =
                        cost.is_none_or(|cost| estimate.is_some_and(|estimate| estimate <= cost));
                    assert!(is_admissible, "{estimate:?} of {cost:?} in {state:?}: {text:?}");
                    positive += usize::from(estimate.is_some_and(|estimate| estimate > 0));
                }
            }
            kept += online.partitionings;
        }
        [kept, positive]
    }

    fn check_online_all(seeds: std::ops::Range<u64>) -> [[usize; 2]; 4] {
        let mut sums = [[0; 2]; 4];
        for seed in seeds {
            let mut adl = Generator(Random(seed));
            let mission = Mission::random(seed);
            let texts = [
                (adl.domain(), adl.problem()),
                (mission.domain(), mission.problem()),
                fleet(seed),
                depot(seed),
            ];
            for (text, sum) in texts.iter().zip(&mut sums) {
                let [kept, positive] = check_online(text);
                *sum = [sum[0] + kept, sum[1] + positive];
            }
        }
        sums
    }

    #[test]
    fn online_cost_partitionings_are_admissible_in_all_reachable_states() {
        let sums = check_online_all(0..30);
        let [_, _, fleets, depots] = sums;
        let is_reached = fleets[0] > 10 && depots[0] > 10 && sums.iter().all(|[_, positive]| *positive > 10);
        assert!(is_reached, "kept cost partitionings and positive estimates for each kind of task: {sums:?}");
    }

    #[test]
    #[ignore = "takes minutes"]
    fn many_online_cost_partitionings_are_admissible_in_all_reachable_states() {
        check_online_all(30..1_000);
    }
}
