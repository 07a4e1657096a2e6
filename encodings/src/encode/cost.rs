//! Clauses for the accumulated cost, and for the limit on the cost.
//!
//! Costs are *reduced* by a potential: with the goal distance h in a projection, an operator of
//! cost c from abstract state α to β has the reduced cost c + h(β) − h(α) ≥ 0. The sum over a plan
//! is its cost minus h(initial), because h is 0 in goal states. So only the gap between the limit
//! and the lower bound has to be counted, and an operator on a cheapest path has the reduced cost
//! 0. The entries of design tables count as differences from the cheapest entry.
//!
//! The sum has an order encoding: one variable for each possible amount, which is implied if *at least* this
//! amount has been spent. The converse is not encoded. If too many amounts are possible, binary addition is
//! used instead. For core-guided search, the amounts are not summed but returned as weighted literals.

use std::collections::{BTreeMap, BTreeSet};

use search::bounds::Bounds;
use task::number::{Int, dense};
use task::task::{Operator, OperatorId};

use crate::encode::arithmetic::{Arithmetic, Bits, width};
use crate::encode::builder::Builder;
use crate::encode::designs::combinations;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::encode::interference::Interference;
use crate::sat::Lit;

/// Maximum number of different accumulated amounts in the order encoding. With more amounts, or if one source
/// of cost requires more than 50,000 additions (50 times this number), the sum is encoded by binary addition.
const AMOUNT_LIMIT: usize = 1_000;

/// Cost limit of an encoding. With `CostEncoding::Sum`, only plans with a cost of at most `limit` are
/// admitted. With `CostEncoding::Apart`, clauses exclude only single amounts above the gap between
/// `limit` and the lower bound. Operator costs are reduced by the goal distances in the first
/// projection of `bounds` (see the head of this file). Without a projection, neither costs nor the
/// limit are encoded.
pub struct CostLimit<'a> {
    pub limit: Int,
    pub bounds: &'a Bounds,
    pub counting: CostEncoding,
}

/// Encoding of the costs of all steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CostEncoding {
    /// The sum of the costs, bounded by the limit.
    Sum,
    /// Weighted literals for core-guided search, without a bound on their sum. Clauses exclude only single amounts that
    /// exceed the gap between the limit and the lower bound.
    Apart,
}

/// Possible contributions of a source to the cost of a step: each amount is added if its premise, a
/// conjunction, holds.
type Increments = Vec<(Vec<Lit>, Int)>;

/// Source of cost at a step, which contributes at most one amount: an operator, several operators that exclude each
/// other, or the design tables of one set of slots.
struct Source {
    step: u32,
    stage: u32,
    increments: Increments,
}

pub(super) struct Cost {
    lower: Int,
    spent: Spent,
}

enum Spent {
    /// Literal that is implied by "at least this amount is spent", for every positive amount up to the gap that
    /// can occur.
    Order(BTreeMap<Int, Lit>),
    Binary(Bits),
    /// Weighted literals; the cost beyond the lower bound is the sum of the weights of true
    /// literals.
    Apart(Vec<(Lit, Int)>),
}

impl Cost {
    /// Encodes the costs of all steps. Excludes sums above the cost limit; with `CostEncoding::Apart`, excludes only
    /// amounts that alone exceed the gap between the limit and the lower bound. Without `interference` there is at most
    /// one operator per step. Returns `None` if a limit is reached or there are too many clauses.
    pub(super) fn new(
        builder: &mut Builder<'_>,
        cost: &CostLimit<'_>,
        interference: Option<&Interference>,
    ) -> Option<Self> {
        let initial = &builder.task.initial;
        let lower = cost.bounds.estimate(initial);
        let Some(potential) = cost.bounds.projections.first() else {
            return Some(Self { lower: 0, spent: Spent::Order(BTreeMap::new()) });
        };
        let (Some(_), Some(lower)) = (lower, potential.estimate(initial)) else {
            builder.formula.add(Family::Bound, []);
            return Some(Self { lower: Int::MAX, spent: Spent::Order(BTreeMap::new()) });
        };
        let gap = cost.limit.saturating_sub(lower);
        if gap < 0 {
            builder.formula.add(Family::Bound, []);
            return Some(Self { lower, spent: Spent::Order(BTreeMap::new()) });
        }
        let mut sum = Sum { builder, cost, interference, gap };
        let sources = sum.sources()?;
        let spent = if cost.counting == CostEncoding::Apart {
            Spent::Apart(sources.iter().flat_map(|source| sum.apart(source)).collect())
        } else if amounts_fit(&sources, gap) {
            Spent::Order(sum.in_order(&sources)?)
        } else {
            Spent::Binary(sum.in_binary(&sources))
        };
        Some(Self { lower, spent })
    }

    /// Returns a lower bound on the cost of every plan, and weighted literals for the cost beyond it. There are no
    /// weighted literals unless the encoding is `CostEncoding::Apart`.
    pub(super) fn payments(&self) -> (Int, &[(Lit, Int)]) {
        match &self.spent {
            Spent::Apart(literals) => (self.lower, literals),
            Spent::Order(_) | Spent::Binary(_) => (self.lower, &[]),
        }
    }

    /// Adds clauses that admit only plans with a cost of at most `limit`, if costs are encoded. A limit above
    /// that of the encoding has no effect. With weighted literals, only a limit below the lower bound has an
    /// effect.
    pub(super) fn at_most(&self, formula: &mut Formula, limit: Int) {
        // The gap is negative if no plan can have this cost.
        let gap = limit.saturating_sub(self.lower);
        if gap < 0 {
            formula.add(Family::Bound, []);
            return;
        }
        match &self.spent {
            Spent::Order(amounts) => {
                if let Some((_, literal)) = amounts.range(gap.saturating_add(1)..).next() {
                    formula.add(Family::Bound, [!*literal]);
                }
            }
            Spent::Binary(bits) => Arithmetic { formula, family: Family::Bound }.at_most(bits, gap),
            Spent::Apart(_) => {}
        }
    }
}

struct Sum<'s, 'a> {
    builder: &'s mut Builder<'a>,
    cost: &'s CostLimit<'s>,
    interference: Option<&'s Interference>,
    /// Cost that a plan may have beyond the lower bound.
    gap: Int,
}

impl Sum<'_, '_> {
    /// Returns all sources of cost in the order of steps, or `None` if [`Builder::check`] fails.
    fn sources(&mut self) -> Option<Vec<Source>> {
        let mut sources = Vec::new();
        for step in 0..self.builder.variables.horizon() {
            self.builder.check().ok()?;
            let increments_by_stage = self.increments(step).into_iter().zip(0..);
            sources.extend(increments_by_stage.map(|(increments, stage)| Source {
                step: dense(step),
                stage,
                increments,
            }));
        }
        Some(sources)
    }

    fn increments(&mut self, step: usize) -> Vec<Increments> {
        // Each source contributes at most one amount. Operators that can be executed at the same step are therefore
        // separate sources.
        let mut by_source: BTreeMap<(Option<usize>, Option<OperatorId>), Increments> = BTreeMap::new();
        for index in 0..self.builder.variables.operators[step].len() {
            let (id, literal) = self.builder.variables.operators[step][index];
            let source = match self.interference {
                None => (None, None),
                Some(interference) => {
                    let class = interference.class(id);
                    (class, class.is_none().then_some(id))
                }
            };
            self.reduced(step, id, literal, by_source.entry(source).or_default());
        }
        let mut increments_by_source: Vec<Increments> = by_source.into_values().collect();
        let mut by_slots: BTreeMap<Vec<usize>, Increments> = BTreeMap::new();
        for ((entries, values), members) in self.builder.partition(step, residual_tables) {
            let group = self.builder.group(step, &members, Family::Cost);
            for (combination, value) in entries.iter().zip(values) {
                let designs = combination
                    .iter()
                    .map(|(slot, design)| self.builder.variables.designs[step][*slot][*design]);
                let premise: Vec<_> = designs.chain([group]).collect();
                let slots = combination.iter().map(|(slot, _)| *slot).collect();
                by_slots.entry(slots).or_default().push((premise, value));
            }
        }
        increments_by_source.extend(by_slots.into_values());
        increments_by_source
    }

    /// Appends to `out` the reduced cost of an operator with its cheapest designs. This is a single
    /// amount, or an amount for each abstract transition if the amounts differ. Also forbids the
    /// operator in transitions from or to a dead end of the abstraction.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "costs to go and the cost of an operator are at most GROWTH_LIMIT; steps are in memory"
    )]
    fn reduced(&mut self, step: usize, id: OperatorId, literal: Lit, out: &mut Increments) {
        let potential = &self.cost.bounds.projections[0];
        let operator = &self.builder.task.operators[id.index()];
        let least = operator.cost.minimum();
        let transitions = potential.transitions(id);
        if transitions.is_empty() {
            out.push((vec![literal], least));
            return;
        }
        let mut alive = Vec::new();
        for transition in transitions {
            let values = potential.values(transition.source);
            let is_required =
                |variable| operator.condition.facts.iter().any(|fact| fact.variable == variable);
            let mut here: Vec<_> = potential
                .pattern
                .iter()
                .zip(values)
                .filter(|(variable, _)| !is_required(**variable))
                .map(|(variable, value)| {
                    self.builder.variables.values[step][variable.index()][value as usize]
                })
                .collect();
            if !operator.conditional.is_empty() {
                // With conditional effects the operator does not determine the target, so the
                // premise includes the next state.
                let after = potential.pattern.iter().zip(potential.values(transition.target));
                here.extend(after.map(|(variable, value)| {
                    self.builder.variables.values[step + 1][variable.index()][value as usize]
                }));
            }
            let to_go =
                (potential.goal_distance(transition.source), potential.goal_distance(transition.target));
            if let (Some(before), Some(after)) = to_go {
                alive.push((here, least + after - before));
            } else {
                let elsewhere = here.iter().map(|state| !*state);
                self.builder.formula.add(Family::Cost, elsewhere.chain([!literal]));
            }
        }
        match alive.split_first() {
            Some(((_, first), others)) if others.iter().all(|(_, amount)| amount == first) => {
                out.push((vec![literal], *first));
            }
            _ => out.extend(alive.into_iter().map(|(mut here, amount)| {
                here.push(literal);
                (here, amount)
            })),
        }
    }

    fn in_order(&mut self, sources: &[Source]) -> Option<BTreeMap<Int, Lit>> {
        let mut spent: BTreeMap<Int, Lit> = BTreeMap::new();
        for source in sources {
            self.builder.check().ok()?;
            spent = self.add_amounts(source, &spent);
        }
        Some(spent)
    }

    /// Adds the amounts of a source to the order encoding: `spent ≥ v` and `increment ≥ w` imply `spent' ≥ v + w`,
    /// where `spent'` is the sum including this source. Sums above the gap are excluded.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "amounts are at most the gap, which is at most GROWTH_LIMIT; steps are in memory"
    )]
    fn add_amounts(&mut self, source: &Source, spent: &BTreeMap<Int, Lit>) -> BTreeMap<Int, Lit> {
        let increments = self.amounts(source);
        if increments.is_empty() {
            return spent.clone();
        }
        let amounts: BTreeSet<Int> =
            next_amounts(&spent.keys().copied().collect(), increments.keys().copied(), self.gap);
        let mut after: BTreeMap<Int, Lit> = BTreeMap::new();
        for amount in amounts {
            let literal = self.builder.formula.fresh(VariableMeaning::CostAtLeast {
                amount,
                step: source.step + 1,
                stage: source.stage,
            });
            if let Some((_, smaller)) = after.last_key_value() {
                self.builder.formula.add(Family::Cost, [!literal, *smaller]);
            }
            after.insert(amount, literal);
        }
        for (amount, literal) in spent.iter().chain(&increments) {
            self.builder.formula.add(Family::Cost, [!*literal, after[amount]]);
        }
        for (before, spent) in spent {
            for (amount, increment) in &increments {
                let sum = after.get(&(before + amount)).copied().unwrap_or(!Formula::truth());
                self.builder.formula.add(Family::Cost, [!*spent, !*increment, sum]);
            }
        }
        after
    }

    /// Returns a literal for each positive amount of a source, implied by the premises of this amount. Clauses exclude
    /// the premises of amounts above the gap.
    fn amounts(&mut self, source: &Source) -> BTreeMap<Int, Lit> {
        let mut increments: BTreeMap<Int, Lit> = BTreeMap::new();
        for (premise, amount) in source.increments.iter().filter(|(_, amount)| *amount > 0) {
            let conclusion = if *amount > self.gap {
                !Formula::truth()
            } else {
                let formula = &mut self.builder.formula;
                let meaning =
                    VariableMeaning::Increment { amount: *amount, step: source.step, stage: source.stage };
                *increments.entry(*amount).or_insert_with(|| formula.fresh(meaning))
            };
            self.builder
                .formula
                .add(Family::Cost, premise.iter().map(|literal| !*literal).chain([conclusion]));
        }
        increments
    }

    /// Returns the amounts of a source as weighted literals. Each literal implies the literal of
    /// the next smaller amount, and its weight is the difference from this amount.
    #[expect(clippy::arithmetic_side_effects, reason = "amounts come in ascending order")]
    fn apart(&mut self, source: &Source) -> Vec<(Lit, Int)> {
        let mut weighted: Vec<(Lit, Int)> = Vec::new();
        let mut before = 0;
        for (amount, literal) in self.amounts(source) {
            if let Some((smaller, _)) = weighted.last() {
                self.builder.formula.add(Family::Cost, [!literal, *smaller]);
            }
            weighted.push((literal, amount - before));
            before = amount;
        }
        weighted
    }

    #[expect(clippy::arithmetic_side_effects, reason = "widths of numbers of 128 bits")]
    fn in_binary(&mut self, sources: &[Source]) -> Bits {
        let gap = self.gap;
        let width = width(0, gap) + 2;
        let mut spent = Arithmetic::constant(0, 1);
        for Source { step, increments, .. } in sources {
            let possible: Vec<_> = increments.iter().filter(|(_, amount)| *amount <= gap).cloned().collect();
            for (premise, _) in increments.iter().filter(|(_, amount)| *amount > gap) {
                self.builder.formula.add(Family::Cost, premise.iter().map(|literal| !*literal));
            }
            let active = self.builder.variables.busy[*step as usize];
            let mut arithmetic = Arithmetic { formula: &mut self.builder.formula, family: Family::Cost };
            let increment = arithmetic.choose(&possible, active);
            // Neither summand has more bits than the gap, so the sum fits into the width. Then the sum is
            // bounded by the gap again.
            spent = arithmetic.add(&spent, &increment, width);
            arithmetic.at_most(&spent, gap);
        }
        spent
    }
}

/// Returns the cost tables of an operator: combinations of (slot, design) in the numbering of the
/// task, and the difference of each entry from the cheapest entry.
#[allow(clippy::type_complexity)]
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the numbers of a quantity fit together, whatever their signs"
)]
fn residual_tables(operator: &Operator) -> Vec<(Vec<Vec<(usize, usize)>>, Vec<Int>)> {
    let tables = operator.cost.tables.iter();
    tables
        .map(|table| {
            let least = table.values.iter().min().copied().unwrap_or(0);
            let residual = table.values.iter().map(|value| value - least).collect();
            (combinations(operator, &table.slots), residual)
        })
        .collect()
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "amounts are at most the gap, which is at most GROWTH_LIMIT"
)]
fn next_amounts(spent: &BTreeSet<Int>, increments: impl Iterator<Item = Int>, gap: Int) -> BTreeSet<Int> {
    let mut amounts = spent.clone();
    for increment in increments {
        amounts.insert(increment);
        amounts.extend(spent.iter().map(|amount| amount + increment).filter(|sum| *sum <= gap));
    }
    amounts
}

fn amounts_fit(sources: &[Source], gap: Int) -> bool {
    let mut spent = BTreeSet::new();
    for source in sources {
        let increments: BTreeSet<Int> = source
            .increments
            .iter()
            .map(|(_, amount)| *amount)
            .filter(|amount| (1..=gap).contains(amount))
            .collect();
        if spent.len().saturating_mul(increments.len()) > AMOUNT_LIMIT * 50 {
            return false;
        }
        spent = next_amounts(&spent, increments.into_iter(), gap);
        if spent.len() > AMOUNT_LIMIT {
            return false;
        }
    }
    true
}
