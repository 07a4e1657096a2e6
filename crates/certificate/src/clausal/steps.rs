//! Bounds the number of steps of a plan that is cheaper than the claim.
//!
//! The first T + 1 steps of a plan lead to some values of the variables of a potential (a table of lower bounds
//! on the remaining cost). They cost at least as much as the cheapest sequence of T + 1 operators that leads to
//! these values. The remaining steps cost at least the potential (or, for [`StepBounds::spent`], at least 0). If
//! the sum is at least the claim for all values, a cheaper plan has at most T steps.

use crate::argument::Argument;
use crate::integer::Integer;
use crate::model::Model;
use crate::table::{Table, check_potential};

/// Numbers T such that no plan of more than T steps is cheaper than the claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepBounds {
    /// The least T that follows from the cost of the first T + 1 steps alone. It does not depend on the values of a
    /// potential (table of lower bounds on the remaining cost). `None` if it exceeds `STEP_LIMIT`.
    pub spent: Option<usize>,
    /// The least T that follows from the cost of the first T + 1 steps plus the potential. At most `spent`.
    pub potential: usize,
}

const STEP_LIMIT: usize = 64;
/// Upper limit on the number of transitions between the rows of a potential. Potentials with more
/// transitions are not used.
const EDGE_LIMIT: usize = 1 << 22;

/// Computes bounds on the number of steps from the potentials, which are not checked. Returns an error if there is no
/// bound up to [`STEP_LIMIT`], or `stop` returns `true`.
pub(super) fn bounds(
    model: &Model,
    argument: &Argument,
    cost: &Integer,
    stop: &dyn Fn() -> bool,
) -> Result<StepBounds, String> {
    let is_enough = |least: Option<Integer>| least.is_none_or(|least| least >= *cost);
    let stopped = || "the computation of the number of steps was stopped".to_owned();
    let (mut spent, mut fewest): (Option<usize>, Option<usize>) = (None, None);
    for potential in &argument.potentials {
        let table = Table::new(model, &potential.pattern, &potential.values);
        let Some(mut layers) = Layers::new(model, &table, stop) else { continue };
        let mut is_found = false;
        // Only a lower number than that of the potentials before matters.
        for steps in 0..spent.unwrap_or(STEP_LIMIT.saturating_add(1)) {
            if stop() {
                return Err(stopped());
            }
            layers.advance();
            if !is_found && is_enough(layers.least()) {
                is_found = true;
                fewest = Some(fewest.map_or(steps, |fewest| fewest.min(steps)));
            }
            if is_enough(layers.spent()) {
                spent = Some(steps);
                break;
            }
        }
    }
    if stop() {
        return Err(stopped());
    }
    let potential = fewest
        .into_iter()
        .chain(spent)
        .min()
        .ok_or_else(|| format!("a cheaper plan may have more than {STEP_LIMIT} steps"))?;
    Ok(StepBounds { spent, potential })
}

/// Checks that no plan of more than `steps` steps costs less than `cost`, as for [`StepBounds::potential`]. Returns the
/// position of a potential that proves it. The potential is checked, too.
pub(super) fn check(
    model: &Model,
    argument: &Argument,
    cost: &Integer,
    steps: usize,
    stop: &dyn Fn() -> bool,
) -> Result<usize, String> {
    if steps > STEP_LIMIT {
        return Err(format!("more than {STEP_LIMIT} steps"));
    }
    let serves = |(position, potential): (usize, &crate::argument::Potential)| {
        let table = Table::new(model, &potential.pattern, &potential.values);
        let mut layers = Layers::new(model, &table, stop)?;
        for _ in 0..=steps {
            if stop() {
                return None;
            }
            layers.advance();
        }
        let is_enough = layers.least().is_none_or(|least| least >= *cost);
        (is_enough && check_potential(model, &table, stop).is_ok()).then_some(position)
    };
    let position = argument.potentials.iter().enumerate().find_map(serves);
    if position.is_none() && stop() {
        return Err("the check of the number of steps was stopped".to_owned());
    }
    position.ok_or_else(|| format!("a cheaper plan may have more than {steps} steps"))
}

/// The minimal cost of reaching each row of a potential in exactly k steps (Bellman-Ford layers),
/// where k is the number of calls of `advance`.
struct Layers<'l> {
    table: &'l Table<'l>,
    /// The transitions between rows: (source row, target row, minimal cost).
    edges: Vec<(usize, usize, Integer)>,
    costs: Vec<Option<Integer>>,
}

impl<'l> Layers<'l> {
    /// Returns `None` if there are too many transitions, or `stop` returns `true`.
    fn new(model: &Model, table: &'l Table<'l>, stop: &dyn Fn() -> bool) -> Option<Self> {
        let mut edges = Vec::new();
        let mut idle: Option<Integer> = None;
        for operator in &model.operators {
            let cost = model.least(&operator.cost);
            // Operators without facts and effects on the pattern's variables are self-loops of every row.
            if !table.touches(operator) {
                idle = Some(idle.map_or(cost.clone(), |cheapest| cheapest.min(cost)));
                continue;
            }
            if stop() {
                return None;
            }
            for values in table.matching(&operator.condition.facts) {
                let targets = table.targets(operator, &values);
                let row = table.row(&values);
                edges.extend(targets.iter().map(|target| (row, table.row(target), cost.clone())));
                if edges.len() > EDGE_LIMIT {
                    return None;
                }
            }
        }
        let rows = table.rows();
        edges.extend((0..rows).filter_map(|row| Some((row, row, idle.clone()?))));
        edges.sort_unstable();
        // The cost is the last sort key, so the first edge between two rows is the cheapest.
        edges.dedup_by_key(|edge| (edge.0, edge.1));
        let mut costs = vec![None; rows];
        costs[table.row_of(&model.initial())] = Some(Integer::ZERO);
        Some(Self { table, edges, costs })
    }

    fn advance(&mut self) {
        let mut next: Vec<Option<Integer>> = vec![None; self.costs.len()];
        for (from, to, cost) in &self.edges {
            if let Some(before) = &self.costs[*from] {
                let after = before + cost;
                if next[*to].as_ref().is_none_or(|best| after < *best) {
                    next[*to] = Some(after);
                }
            }
        }
        self.costs = next;
    }

    /// Returns the minimal cost of exactly k steps in the abstraction, or `None` if no sequence of
    /// k steps exists.
    fn spent(&self) -> Option<Integer> {
        self.costs.iter().flatten().min().cloned()
    }

    /// Returns the minimum over all rows of the cost of k steps plus the potential. Returns `None`
    /// if no row that is reachable in k steps can reach the goal.
    fn least(&self) -> Option<Integer> {
        let rows = self.costs.iter().enumerate();
        rows.filter_map(|(row, cost)| Some(cost.as_ref()? + self.table.at_row(row)?)).min()
    }
}
