//! Pareto-optimal combinations of the designs of an operator. A combination contains one design for each slot
//! (design parameter) of the operator.

use std::collections::hash_map::Entry;

use rustc_hash::{FxHashMap, FxHashSet};

use task::limits::{Interrupted, Limits};
use task::number::dense;
use task::task::Operator;
use task::task::number::TaskNumber;
use task::task::quantity::{Quantity, SlotSet};

/// Maximum number of enumerated combinations for one group of slots, i.e. slots that tables or
/// forbidden combinations connect.
const COMBINATION_LIMIT: usize = 2_000_000;
/// Maximum number of non-dominated combinations for one group of slots, and of pairs when the combinations of
/// another group are added.
const CHOICE_LIMIT: usize = 100_000;

struct Partial<N> {
    choice: Vec<u32>,
    cost: N,
    profile: Vec<N>,
}

/// Combinations of designs (an index for each slot), each with the operator's cost for it.
pub type CostedCombinations<N> = Vec<(Vec<u32>, N)>;

/// Returns the combinations of an operator's designs that no other combination dominates, with their costs. A
/// combination dominates another if it costs no more and contributes at least as much to every numeric
/// condition and effect; if `monotone` is `false`, the contributions must be equal. Of combinations with
/// equal cost and contributions, only one is kept unless `all` is `true`. Returns `None` if there are too
/// many combinations.
///
/// Slots contribute independently unless a table (of the cost, a condition or an effect) or a forbidden
/// combination connects them. A combination that is dominated within a group of connected slots is dominated
/// in every extension. For k independent functions with m designs each, this avoids the enumeration of m^k
/// combinations.
///
/// # Errors
/// Fails if the deadline has passed or the interrupt flag is set.
pub fn pareto_optimal_combinations<N: TaskNumber>(
    operator: &Operator<N>,
    monotone: bool,
    all: bool,
    limits: &Limits,
) -> Result<Option<CostedCombinations<N>>, Interrupted> {
    let sizes = operator.sizes();
    let effects = operator.numeric_effects.iter().map(|effect| &effect.value.quantity);
    let conditions = operator.condition.linears().map(|linear| &linear.quantity);
    // The condition and the effect on a resource often contain equal quantities.
    let mut quantities: Vec<&Quantity<N>> = Vec::new();
    for quantity in effects.chain(conditions) {
        if !quantities.contains(&quantity) {
            quantities.push(quantity);
        }
    }
    let profile = quantities.iter().map(|quantity| quantity.constant.clone()).collect();
    let mut front =
        vec![Partial { choice: vec![0; sizes.len()], cost: operator.cost.constant.clone(), profile }];
    for slots in independent(operator, &quantities) {
        let Some(group_front) = own_front(operator, &quantities, &slots, (monotone, all), limits)? else {
            return Ok(None);
        };
        if group_front.len().checked_mul(front.len()).is_none_or(|pairs| pairs > CHOICE_LIMIT) {
            return Ok(None);
        }
        let slots = &slots;
        let pairs =
            front.iter().flat_map(|prefix| group_front.iter().map(move |suffix| prefix.with(suffix, slots)));
        front = best(pairs.collect(), monotone, all, limits)?;
    }
    Ok(Some(front.into_iter().map(|Partial { choice, cost, .. }| (choice, cost)).collect()))
}

/// Returns the non-dominated combinations for the slots of one group, or `None` if there are too many. The other slots
/// have design 0.
fn own_front<N: TaskNumber>(
    operator: &Operator<N>,
    quantities: &[&Quantity<N>],
    slots: &[u32],
    (monotone, all): (bool, bool),
    limits: &Limits,
) -> Result<Option<Vec<Partial<N>>>, Interrupted> {
    let sizes = operator.sizes();
    let mut counts = slots.iter().map(|slot| sizes[*slot as usize]);
    let count = counts.try_fold(1_usize, usize::checked_mul);
    if count.is_none_or(|count| count > COMBINATION_LIMIT) {
        return Ok(None);
    }
    let rules = operator.forbidden.iter().filter(|rule| rule.slots.iter().all(|slot| slots.contains(slot)));
    let rules: Vec<(&SlotSet, FxHashSet<&SlotSet>)> =
        rules.map(|rule| (&rule.slots, rule.combinations.iter().collect())).collect();
    let mut combinations = Vec::new();
    for choice in limits.watch(Combinations::new(slots, &sizes)) {
        let choice = choice?;
        let part = |slots: &SlotSet| slots.iter().map(|slot| choice[*slot as usize]).collect::<SlotSet>();
        if rules.iter().any(|(slots, bad)| bad.contains(&part(slots))) {
            continue;
        }
        let sum = |quantity: &Quantity<N>| quantity.part(slots, &choice, &sizes);
        let cost = sum(&operator.cost);
        let profile = quantities.iter().map(|quantity| sum(quantity)).collect();
        combinations.push(Partial { choice, cost, profile });
        // Removing dominated combinations from time to time bounds the memory.
        if combinations.len() > 2 * CHOICE_LIMIT {
            combinations = best(combinations, monotone, all, limits)?;
            if combinations.len() > CHOICE_LIMIT {
                return Ok(None);
            }
        }
    }
    best(combinations, monotone, all, limits).map(Some)
}

impl<N: TaskNumber> Partial<N> {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
    )]
    fn with(&self, other: &Self, slots: &[u32]) -> Self {
        let mut choice = self.choice.clone();
        for slot in slots {
            choice[*slot as usize] = other.choice[*slot as usize];
        }
        let profile = self.profile.iter().zip(&other.profile).map(|(a, b)| a.clone() + b.clone()).collect();
        Self { choice, cost: self.cost.clone() + other.cost.clone(), profile }
    }
}

/// Returns the candidates that no other candidate dominates, in lexicographic order of their
/// designs.
fn best<N: TaskNumber>(
    mut candidates: Vec<Partial<N>>,
    monotone: bool,
    all: bool,
    limits: &Limits,
) -> Result<Vec<Partial<N>>, Interrupted> {
    limits.check()?;
    // After sorting, every combination comes after the combinations that dominate it.
    candidates.sort_by(|a, b| {
        a.cost.cmp(&b.cost).then_with(|| b.profile.cmp(&a.profile)).then_with(|| a.choice.cmp(&b.choice))
    });
    let mut front: Vec<Partial<N>> = Vec::new();
    // If profiles must be equal, the first combination with a given profile is the cheapest.
    let mut cheapest: FxHashMap<Vec<N>, N> = FxHashMap::default();
    let mut pulse = limits.pulse();
    for new in candidates {
        let is_equal = |cost: &N, profile: &[N]| all && *cost == new.cost && profile == new.profile;
        let is_dominated = if monotone {
            // With at most one numeric quantity, comparing with the last entry of the front suffices: no earlier
            // combination has a higher value.
            let first_candidate = if new.profile.len() > 1 { 0 } else { front.len().saturating_sub(1) };
            let mut is_dominated = false;
            for old in &front[first_candidate..] {
                pulse.beat()?;
                let no_worse = old.profile.iter().zip(&new.profile).all(|(old, new)| old >= new);
                if no_worse && !is_equal(&old.cost, &old.profile) {
                    is_dominated = true;
                    break;
                }
            }
            is_dominated
        } else {
            pulse.beat()?;
            match cheapest.entry(new.profile.clone()) {
                Entry::Occupied(entry) => !is_equal(entry.get(), entry.key()),
                Entry::Vacant(entry) => {
                    entry.insert(new.cost.clone());
                    false
                }
            }
        };
        if !is_dominated {
            front.push(new);
        }
    }
    front.sort_by(|a, b| a.choice.cmp(&b.choice));
    Ok(front)
}

/// Returns groups of slots such that no table and no forbidden combination connects two groups.
fn independent<N>(operator: &Operator<N>, quantities: &[&Quantity<N>]) -> Vec<Vec<u32>> {
    let tables = quantities.iter().copied().chain([&operator.cost]).flat_map(|quantity| &quantity.tables);
    let joined = tables.map(|table| &table.slots).chain(operator.forbidden.iter().map(|rule| &rule.slots));
    let mut groups: Vec<Vec<u32>> = (0..dense(operator.slots.len())).map(|slot| vec![slot]).collect();
    for slots in joined {
        let (mut together, apart): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|group| group.iter().any(|slot| slots.contains(slot)));
        together = if together.is_empty() { together } else { vec![together.concat()] };
        groups = apart.into_iter().chain(together).collect();
    }
    for group in &mut groups {
        group.sort_unstable();
    }
    groups.sort();
    groups
}

/// Iterator over all combinations of designs for some slots, in lexicographic order. The other slots have
/// design 0.
struct Combinations<'a> {
    slots: &'a [u32],
    sizes: &'a [usize],
    next: Option<Vec<u32>>,
}

impl<'a> Combinations<'a> {
    fn new(slots: &'a [u32], sizes: &'a [usize]) -> Self {
        let is_empty = slots.iter().any(|slot| sizes[*slot as usize] == 0);
        Self { slots, sizes, next: (!is_empty).then(|| vec![0; sizes.len()]) }
    }
}

impl Iterator for Combinations<'_> {
    type Item = Vec<u32>;

    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn next(&mut self) -> Option<Vec<u32>> {
        let current = self.next.take()?;
        let grows = |slot: &u32| (current[*slot as usize] as usize) + 1 < self.sizes[*slot as usize];
        if let Some(position) = self.slots.iter().rposition(grows) {
            let mut following = current.clone();
            following[self.slots[position] as usize] += 1;
            for slot in &self.slots[position + 1..] {
                following[*slot as usize] = 0;
            }
            self.next = Some(following);
        }
        Some(current)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use task::number::Int;
    use task::task::quantity::{Linear, NumericId, Table};
    use task::task::{Condition, ForbiddenCombinations, NumericEffect, SlotId, SlotUse};

    const SIZES: [usize; 4] = [2, 3, 2, 2];

    fn quantity(tables: &[Vec<u32>], numbers: &mut impl Iterator<Item = Int>) -> Quantity<Int> {
        let mut quantity = Quantity::constant(numbers.next().unwrap_or(0));
        for slots in tables {
            let size = slots.iter().map(|slot| SIZES[*slot as usize]).product();
            let values = (0..size).map(|_| numbers.next().unwrap_or(0)).collect();
            quantity.add_table(Table { slots: slots.iter().copied().collect(), values });
        }
        quantity
    }

    fn operator(costs: &[Vec<u32>], uses: &[Vec<u32>], excluded: &[(u32, u32)], numbers: &[Int]) -> Operator {
        let mut numbers = numbers.iter().copied().cycle();
        let cost = quantity(costs, &mut numbers);
        let variable = NumericId(0);
        let value = Linear { coefficients: vec![(variable, 1)], quantity: quantity(uses, &mut numbers) };
        let slot = |(size, slot): (&usize, u32)| SlotUse {
            slot: SlotId(slot),
            designs: (0..*size as u32).collect(),
        };
        let combinations = excluded.iter().map(|(a, b)| [*a, *b].into()).collect();
        Operator {
            schema: 0,
            arguments: Vec::new(),
            configuration: Vec::new(),
            slots: SIZES.iter().zip(0..).map(slot).collect(),
            forbidden: [ForbiddenCombinations { slots: [0, 1].into(), combinations }].into(),
            condition: Condition { comparisons: vec![value.clone()], ..Condition::default() },
            effects: Vec::new(),
            conditional: Vec::new(),
            numeric_effects: vec![NumericEffect { variable, value }],
            cost,
            others: Vec::new(),
            duration: Quantity::constant(0),
            wait: None,
            timing: task::task::timing::Timing::free(),
        }
    }

    fn expected(operator: &Operator, monotone: bool, all: bool) -> Vec<(Vec<u32>, Int)> {
        let sizes = operator.sizes();
        let value = |choice: &Vec<u32>| {
            (operator.cost.at(choice, &sizes), operator.numeric_effects[0].value.quantity.at(choice, &sizes))
        };
        let choices: Vec<Vec<u32>> = operator.admitted_combinations().collect();
        let is_dominated = |choice: &Vec<u32>| {
            let (cost, remaining) = value(choice);
            choices.iter().any(|other| {
                let (other_cost, more) = value(other);
                let no_worse =
                    other_cost <= cost && if monotone { more >= remaining } else { more == remaining };
                let equal = other_cost == cost && more == remaining;
                no_worse && if equal { !all && other < choice } else { true }
            })
        };
        let best = choices.iter().filter(|choice| !is_dominated(choice));
        best.map(|choice| (choice.clone(), value(choice).0)).collect()
    }

    proptest! {
        #[test]
        fn grouping_independent_slots_loses_no_combination(
            costs in proptest::sample::subsequence(vec![vec![0], vec![1], vec![2], vec![3], vec![1, 2]], 0..=5),
            uses in proptest::sample::subsequence(vec![vec![0], vec![1], vec![2], vec![3], vec![0, 3]], 0..=5),
            excluded in proptest::collection::vec((0_u32..2, 0_u32..3), 0..4),
            numbers in proptest::collection::vec(-4_i128..5, 1..40),
            monotone: bool,
        ) {
            let operator = operator(&costs, &uses, &excluded, &numbers);
            let limits = Limits::none();
            prop_assert_eq!(pareto_optimal_combinations(&operator, monotone, true, &limits), Ok(Some(expected(&operator, monotone, true))));
            // With `all = false`, any one of several combinations with equal cost and equal numeric effect may be kept.
            // So costs and effects are compared, not designs.
            let values = |choices: Vec<(Vec<u32>, Int)>| {
                let sizes = operator.sizes();
                let remaining = |choice: &[u32]| operator.numeric_effects[0].value.quantity.at(choice, &sizes);
                let mut values: Vec<_> = choices.iter().map(|(choice, cost)| (*cost, remaining(choice))).collect();
                values.sort_unstable();
                values
            };
            let combinations = pareto_optimal_combinations(&operator, monotone, false, &limits).expect("no limit").unwrap_or_default();
            prop_assert!(combinations.iter().all(|(choice, _)| operator.admits(choice)));
            prop_assert_eq!(values(combinations), values(expected(&operator, monotone, false)));
        }
    }
}
