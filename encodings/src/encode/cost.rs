//! The accumulated cost, and the limit on it.
//!
//! Costs are *reduced* by a potential: with h the cost to go in a projection, an operator from abstract state α to β counts
//! c + h(β) − h(α) ≥ 0, and the sum over a plan is its cost less h(initial), because h is 0 in goal states. So only
//! the gap between the limit and the lower bound has to be counted, and an operator on a cheapest path counts nothing.
//! Tables of designs count what they add to their cheapest entry.
//!
//! The sum is kept in order encoding, one variable for each amount that can occur, and one direction only: the
//! variables say *at least* how much has been spent. Where too many amounts can occur, binary addition takes over.

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

/// More amounts than this at one step, and the sum is binary.
const AMOUNT_LIMIT: usize = 1_000;

/// The cost limit of an encoding: only plans with cost at most `limit` count, by the estimates of `bounds`.
pub struct CostLimit<'a> {
    pub limit: Int,
    pub bounds: &'a Bounds,
    pub counting: CostEncoding,
}

/// What an encoding makes of the costs of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CostEncoding {
    /// Their sum, which the limit holds down.
    Sum,
    /// Literals with weights, which the solver is to keep false. Only what exceeds the limit by itself is excluded.
    Apart,
}

/// What one source adds to the cost of a step: the amount if the premise (a conjunction) holds.
type Increments = Vec<(Vec<Lit>, Int)>;

/// Where cost comes from at a step: the operator itself, or a table of designs.
struct Source {
    step: u32,
    /// Its position among those of the step.
    stage: u32,
    increments: Increments,
}

/// The spent cost at the end, less its lower bound.
pub(super) struct Cost {
    lower: Int,
    spent: Spent,
}

enum Spent {
    /// `at least amount`, for every positive amount that can occur.
    Order(BTreeMap<Int, Lit>),
    Binary(Bits),
    /// Literals that add their weight if they are true.
    Apart(Vec<(Lit, Int)>),
}

impl Cost {
    /// Adds up the cost of all steps and limits it; operators stand alone at a step if there is no interference. None if a
    /// limit of the run was reached meanwhile.
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

    /// What every plan costs at least, and what it may pay beyond that.
    pub(super) fn payments(&self) -> (Int, &[(Lit, Int)]) {
        match &self.spent {
            Spent::Apart(literals) => (self.lower, literals),
            Spent::Order(_) | Spent::Binary(_) => (self.lower, &[]),
        }
    }

    /// Adds clauses that admit only plans with cost at most `limit`.
    pub(super) fn at_most(&self, formula: &mut Formula, limit: Int) {
        // Below 0 if it is cut off.
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

/// The sum of costs under construction.
struct Sum<'s, 'a> {
    builder: &'s mut Builder<'a>,
    cost: &'s CostLimit<'s>,
    interference: Option<&'s Interference>,
    /// How much more than the lower bound may be spent.
    gap: Int,
}

impl Sum<'_, '_> {
    /// All sources, in the order of steps. None if a limit of the run was reached meanwhile.
    fn sources(&mut self) -> Option<Vec<Source>> {
        let mut sources = Vec::new();
        for step in 0..self.builder.variables.horizon() {
            self.builder.check().ok()?;
            let own = self.increments(step).into_iter().zip(0..);
            sources.extend(own.map(|(increments, stage)| Source { step: dense(step), stage, increments }));
        }
        Some(sources)
    }

    /// What a step can add, by source: the operator itself, and each table of designs.
    fn increments(&mut self, step: usize) -> Vec<Increments> {
        // Of one source at most one amount counts, so operators that can stand together are sources of their own.
        let mut own: BTreeMap<(Option<usize>, Option<OperatorId>), Increments> = BTreeMap::new();
        for index in 0..self.builder.variables.operators[step].len() {
            let (id, literal) = self.builder.variables.operators[step][index];
            let source = match self.interference {
                None => (None, None),
                Some(interference) => {
                    let class = interference.class(id);
                    (class, class.is_none().then_some(id))
                }
            };
            self.reduced(step, id, literal, own.entry(source).or_default());
        }
        let mut all: Vec<Increments> = own.into_values().collect();
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
        all.extend(by_slots.into_values());
        all
    }

    /// The reduced cost of an operator with its cheapest designs, by abstract state where that matters.
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
            let known = |variable| operator.condition.facts.iter().any(|fact| fact.variable == variable);
            let mut here: Vec<_> = potential
                .pattern
                .iter()
                .zip(values)
                .filter(|(variable, _)| !known(**variable))
                .map(|(variable, value)| {
                    self.builder.variables.values[step][variable.index()][value as usize]
                })
                .collect();
            if !operator.conditional.is_empty() {
                // Where the operator leads to is open: the state after it tells.
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
            Some(((_, first), rest)) if rest.iter().all(|(_, amount)| amount == first) => {
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

    /// `spent ≥ v ∧ increment ≥ w → spent' ≥ v + w`; sums above the gap are conflicts.
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

    /// A literal for each positive amount that a source can add, which its premise implies; what is above the gap is a conflict.
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

    /// The amounts of a source, each implying the next smaller one, and what it has more than that.
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
            let more = arithmetic.choose(&possible, active);
            // Neither summand is above the gap, so their sum fits; then the limit cuts it back.
            spent = arithmetic.add(&spent, &more, width);
            arithmetic.at_most(&spent, gap);
        }
        spent
    }
}

/// The tables of an operator in the task's numbering: combinations of (slot, design), and how much more than
/// the cheapest each of them costs.
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

/// The amounts that can be spent after one more source.
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

/// Whether so few amounts can occur that the order encoding is worth its clauses.
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
