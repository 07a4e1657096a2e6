//! Systematic selection of patterns for saturated cost partitioning \[1\].
//!
//! A candidate is a pattern with a goal variable that is connected in the causal graph. Patterns grow by variables
//! that an operator requires to change the pattern, and by goal variables that an operator changes together with
//! the pattern. Candidates are examined by increasing size, and in random order within a size. A candidate is
//! selected if its projection has a positive goal distance under the operator costs that the projections
//! before it have not used. Further random orders follow until two in a row select nothing new.
//!
//! \[1\] J. Seipp: Pattern selection for optimal classical planning with saturated cost partitioning, IJCAI 2019.

use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::FxHashSet;
use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::{Task, VariableId};

use crate::bounds::abstraction::{Abstraction, Scratch, UNREACHABLE};
use crate::bounds::pattern_database::Projection;
use crate::random::Random;

/// Maximum number of variables of a pattern.
const MAX_VARIABLES: usize = 4;
const MAX_CANDIDATES: usize = 4_000;
/// Upper limit on the number of abstract states and transitions of a projection. Greater projections are omitted.
const MAX_SIZE: usize = 5_000;
/// Number of orders in a row without a new pattern after which the selection ends.
const MAX_FAILURES: u32 = 2;
/// Work units to visit a transition, an abstract state or an operator.
const WORK_PER_VISIT: u64 = 10;

#[derive(Clone, Copy)]
pub(super) struct SelectionLimits {
    /// Maximum number of selected projections.
    pub(super) projections: usize,
    /// Approximate upper limit on the number of abstract states and transitions of all selected projections.
    pub(super) transitions: usize,
    pub(super) work: u64,
}

struct Candidate {
    pattern: Vec<VariableId>,
    /// The projection, computed when the candidate is examined first; `None` if it is too large.
    projection: OnceCell<Option<Abstraction>>,
    is_selected: bool,
}

struct Selection<'a> {
    task: &'a Task,
    by_effect: &'a [Vec<u32>],
    /// Costs of operators for [`Projection`], which are not used.
    no_costs: Arc<[Int]>,
    work: u64,
}

/// Returns, for each variable, the variables that some operator requires to change it, and the goal variables
/// that some operator changes together with it.
fn related_variables(context: Context<'_>) -> Result<Vec<BTreeSet<VariableId>>, Interrupted> {
    let Context { task, limits } = context;
    let goals = goal_variables(task);
    let mut related = vec![BTreeSet::new(); task.basic];
    let mut pulse = limits.pulse();
    for operator in &task.operators {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let changed = operator.effects.iter().chain(conditional).map(|fact| fact.variable);
        let changed: BTreeSet<VariableId> = changed.collect();
        let literals = operator.conditional.iter().flat_map(|effect| &effect.condition);
        let required = operator.condition.facts.iter().chain(literals.map(|literal| &literal.fact));
        let required = required.map(|fact| fact.variable).filter(|variable| variable.index() < task.basic);
        let variables: BTreeSet<VariableId> = required.chain(changed.intersection(&goals).copied()).collect();
        for variable in &changed {
            pulse.beat()?;
            let neighbours = variables.iter().filter(|neighbour| *neighbour != variable);
            related[variable.index()].extend(neighbours);
        }
    }
    Ok(related)
}

fn goal_variables(task: &Task) -> BTreeSet<VariableId> {
    let variables = task.goal.facts.iter().map(|fact| fact.variable);
    variables.filter(|variable| variable.index() < task.basic).collect()
}

/// Returns the candidates of each size, at most about `MAX_CANDIDATES` in total.
fn candidates(context: Context<'_>, random: &mut Random) -> Result<Vec<Vec<Candidate>>, Interrupted> {
    let related = related_variables(context)?;
    let mut by_size: Vec<Vec<Vec<VariableId>>> = Vec::new();
    let mut patterns: Vec<Vec<VariableId>> =
        goal_variables(context.task).into_iter().map(|variable| vec![variable]).collect();
    let mut pulse = context.limits.pulse();
    let mut count = patterns.len();
    while !patterns.is_empty() {
        let mut larger: Vec<Vec<VariableId>> = Vec::new();
        let mut seen: FxHashSet<Vec<VariableId>> = FxHashSet::default();
        // At the limit, all goal variables have the same chance of larger patterns.
        shuffle(&mut patterns, random);
        let is_last = by_size.len().saturating_add(1) == MAX_VARIABLES;
        let neighbours = |pattern: &Vec<VariableId>| -> BTreeSet<VariableId> {
            pattern.iter().flat_map(|variable| &related[variable.index()]).copied().collect()
        };
        for pattern in patterns.iter().take_while(|_| !is_last) {
            for variable in neighbours(pattern) {
                pulse.beat()?;
                if count >= MAX_CANDIDATES {
                    break;
                }
                let Err(position) = pattern.binary_search(&variable) else { continue };
                let mut extended = pattern.clone();
                extended.insert(position, variable);
                if seen.insert(extended.clone()) {
                    larger.push(extended);
                    count = count.saturating_add(1);
                }
            }
        }
        by_size.push(std::mem::replace(&mut patterns, larger));
    }
    let candidate = |pattern| Candidate { pattern, projection: OnceCell::new(), is_selected: false };
    Ok(by_size.into_iter().map(|patterns| patterns.into_iter().map(candidate).collect()).collect())
}

#[expect(clippy::arithmetic_side_effects, reason = "positions in a list")]
fn shuffle<T>(list: &mut [T], random: &mut Random) {
    for last in (1..list.len()).rev() {
        list.swap(last, random.below(last + 1));
    }
}

/// Returns the selected projections, and the work units for their selection. `by_effect` is the result of
/// [`operators_by_effect`](super::cartesian::operators_by_effect).
#[expect(clippy::arithmetic_side_effects, reason = "counts of what is in memory")]
pub(super) fn systematic_projections(
    context: Context<'_>,
    costs: &[u32],
    by_effect: &[Vec<u32>],
    limits: SelectionLimits,
    scratch: &mut Scratch,
) -> Result<(Vec<Abstraction>, u64), Interrupted> {
    let task = context.task;
    let mut pulse = context.limits.pulse();
    let no_costs = vec![0; task.operators.len()].into();
    let mut selection = Selection { task, by_effect, no_costs, work: 0 };
    let mut random = Random(1);
    let mut by_size = candidates(context, &mut random)?;
    let [mut count, mut transitions] = [0; 2];
    let mut failures = 0;
    let mut distances = Vec::new();
    'orders: while failures < MAX_FAILURES {
        let mut remaining = costs.to_vec();
        failures += 1;
        for candidates in &mut by_size {
            shuffle(candidates, &mut random);
            for candidate in candidates {
                pulse.beat()?;
                if selection.work >= limits.work
                    || count >= limits.projections
                    || transitions >= limits.transitions
                {
                    break 'orders;
                }
                let projection = candidate.projection.get_or_init(|| selection.project(&candidate.pattern));
                let Some(projection) = projection else { continue };
                selection.work += projection.size() as u64 * WORK_PER_VISIT;
                projection.goal_distances(&remaining, &mut distances, scratch, &mut pulse)?;
                if distances.iter().all(|distance| *distance == 0 || *distance == UNREACHABLE) {
                    continue;
                }
                projection.saturate(&distances, scratch, |operator, used| {
                    remaining[operator] = remaining[operator].saturating_sub(used);
                });
                if !candidate.is_selected {
                    candidate.is_selected = true;
                    count += 1;
                    transitions += projection.size();
                    failures = 0;
                }
            }
        }
    }
    let selected = by_size.into_iter().flatten().filter(|candidate| candidate.is_selected);
    let projections = selected.filter_map(|candidate| candidate.projection.into_inner().flatten());
    Ok((projections.collect(), selection.work))
}

impl Selection<'_> {
    #[expect(clippy::arithmetic_side_effects, reason = "counts of what is in memory")]
    fn project(&mut self, pattern: &[VariableId]) -> Option<Abstraction> {
        let sizes = pattern.iter().map(|variable| self.task.variables[variable.index()].values.len());
        if sizes.fold(1, usize::saturating_mul) > MAX_SIZE {
            self.work += WORK_PER_VISIT;
            return None;
        }
        let by_effect = pattern.iter().flat_map(|variable| &self.by_effect[variable.index()]);
        let mut operators: Vec<u32> = by_effect.copied().collect();
        operators.sort_unstable();
        operators.dedup();
        self.work += 2 * WORK_PER_VISIT * (operators.len() as u64 + 1);
        let projection =
            Projection::of_operators(self.task, pattern.to_vec(), &self.no_costs, &operators, MAX_SIZE);
        let size = projection.as_ref().map_or(MAX_SIZE, Projection::transition_count);
        self.work += 3 * WORK_PER_VISIT * size as u64;
        projection.as_ref().map(Abstraction::of_projection)
    }
}

#[cfg(test)]
mod tests {
    use task::limits::Limits;
    use testing::adl::Generator;
    use testing::{depot, fleet, ground_text};

    use super::*;
    use crate::bounds::cartesian::operators_by_effect;

    fn tasks(seed: u64) -> Vec<Task> {
        let mut adl = Generator(testing::random::Random(seed));
        [(adl.domain(), adl.problem()), fleet(seed), depot(seed)].into_iter().map(ground_text).collect()
    }

    fn costs(task: &Task) -> Vec<u32> {
        let costs = task.operators.iter().map(|operator| operator.cost.minimum());
        costs.map(|cost| u32::try_from(cost).unwrap_or(0)).collect()
    }

    #[test]
    fn projections_of_candidates_have_the_distances_of_pattern_databases() {
        let mut positive = [0; MAX_VARIABLES];
        for task in (0..10).flat_map(tasks) {
            let limits = Limits::none();
            let context = Context::new(&task, &limits);
            let costs = costs(&task);
            let by_effect = operators_by_effect(&task);
            let no_costs = vec![0; costs.len()].into();
            let mut selection = Selection { task: &task, by_effect: &by_effect, no_costs, work: 0 };
            let mut scratch = Scratch::new(costs.len());
            let mut distances = Vec::new();
            let all = candidates(context, &mut Random(1)).expect("no limit");
            for candidate in all.iter().flat_map(|candidates| candidates.iter().take(40)) {
                let Some(projection) = selection.project(&candidate.pattern) else { continue };
                let pulse = &mut limits.pulse();
                projection.goal_distances(&costs, &mut distances, &mut scratch, pulse).expect("no limit");
                let wide: Arc<[Int]> = costs.iter().copied().map(Int::from).collect();
                let database = Projection::new(context, candidate.pattern.clone(), &wide).expect("no limit");
                let expected = database.costs().iter().map(|cost| match cost {
                    Some(cost) => u32::try_from(*cost).expect("small"),
                    None => UNREACHABLE,
                });
                assert!(distances.iter().copied().eq(expected), "{:?}", candidate.pattern);
                positive[candidate.pattern.len() - 1] += usize::from(distances.iter().any(|d| *d > 0));
            }
        }
        assert!(positive.iter().all(|count| *count > 0), "patterns of each size: {positive:?}");
    }

    #[test]
    fn the_selection_is_deterministic_and_limited() {
        let mut sizes = [0; 2];
        for task in (0..10).flat_map(tasks) {
            let limits = Limits::none();
            let context = Context::new(&task, &limits);
            let (costs, by_effect) = (costs(&task), operators_by_effect(&task));
            let select = |projections, work| {
                let selection = SelectionLimits { projections, transitions: 1_000_000, work };
                let mut scratch = Scratch::new(costs.len());
                let selected = systematic_projections(context, &costs, &by_effect, selection, &mut scratch);
                let (selected, _) = selected.expect("no limit");
                selected.iter().map(Abstraction::size).collect::<Vec<_>>()
            };
            let selected = select(100, 10_000_000);
            assert_eq!(selected, select(100, 10_000_000));
            assert_eq!(select(100, 0), [0; 0]);
            assert!(select(2, 10_000_000).len() <= 2);
            sizes = [sizes[0].max(selected.len()), sizes[1] + selected.len()];
        }
        assert!(sizes[0] > 5 && sizes[1] > 50, "largest selection, and all together: {sizes:?}");
    }
}
