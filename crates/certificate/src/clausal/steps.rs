//! A bound on the number of steps of a cheaper plan, by arithmetic on a potential.
//!
//! Whatever a plan does, its first T + 1 steps lead to some values of the potential's variables, and cost at least what the
//! cheapest T + 1 operators cost that lead there; the rest costs at least the potential, or at least nothing. If the sum is never
//! below the claim, a cheaper plan has at most T steps.

use crate::argument::Argument;
use crate::integer::Integer;
use crate::model::Model;
use crate::table::Table;

/// By what a cheaper plan has only so many steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepBound {
    /// By what the steps cost: the formula alone then says that no plan is cheaper.
    Spent,
    /// By what they cost and what a potential says is still to be paid: fewer steps, and a smaller formula.
    Potential,
}

/// No formula has more steps.
const STEP_LIMIT: usize = 64;
/// A potential between whose rows operators lead in more ways bounds nothing.
const EDGE_LIMIT: usize = 1 << 22;

/// The least bound that a potential gives.
pub(super) fn bound(
    model: &Model,
    argument: &Argument,
    cost: &Integer,
    by: StepBound,
) -> Result<usize, String> {
    let bounds = argument.potentials.iter().filter_map(|potential| {
        let table = Table::new(model, &potential.pattern, &potential.values);
        let mut layers = Layers::new(model, &table)?;
        (0..=STEP_LIMIT).find(|_| {
            layers.advance();
            let least = if by == StepBound::Spent { layers.spent() } else { layers.least() };
            least.is_none_or(|least| least >= *cost)
        })
    });
    bounds.min().ok_or_else(|| format!("a cheaper plan may have more than {STEP_LIMIT} steps"))
}

/// Whether no plan of more steps is cheaper, by the potential whose position is returned.
pub(super) fn check(
    model: &Model,
    argument: &Argument,
    cost: &Integer,
    steps: usize,
) -> Result<usize, String> {
    if steps > STEP_LIMIT {
        return Err(format!("more than {STEP_LIMIT} steps"));
    }
    let serves = |(position, potential): (usize, &crate::argument::Potential)| {
        let table = Table::new(model, &potential.pattern, &potential.values);
        let mut layers = Layers::new(model, &table)?;
        (0..=steps).for_each(|_| layers.advance());
        layers.least().is_none_or(|least| least >= *cost).then_some(position)
    };
    let found = argument.potentials.iter().enumerate().find_map(serves);
    found.ok_or_else(|| format!("a cheaper plan may have more than {steps} steps"))
}

/// What it costs at least to come to each combination of values in a number of steps.
struct Layers<'l> {
    table: &'l Table<'l>,
    /// From, to, least cost.
    edges: Vec<(usize, usize, Integer)>,
    costs: Vec<Option<Integer>>,
}

impl<'l> Layers<'l> {
    fn new(model: &Model, table: &'l Table<'l>) -> Option<Self> {
        let mut edges = Vec::new();
        let mut idle: Option<Integer> = None;
        for operator in &model.operators {
            let cost = model.least(&operator.cost);
            if !table.touches(operator) {
                idle = Some(idle.map_or(cost.clone(), |known| known.min(cost)));
                continue;
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
        // Sorted by cost last: the first of each pair is the cheapest.
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
                if next[*to].as_ref().is_none_or(|known| after < *known) {
                    next[*to] = Some(after);
                }
            }
        }
        self.costs = next;
    }

    /// The least that was spent.
    fn spent(&self) -> Option<Integer> {
        self.costs.iter().flatten().min().cloned()
    }

    /// The least that a plan costs that is still under way.
    fn least(&self) -> Option<Integer> {
        let rows = self.costs.iter().enumerate();
        rows.filter_map(|(row, cost)| Some(cost.as_ref()? + self.table.at_row(row)?)).min()
    }
}
