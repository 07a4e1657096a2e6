//! What can be done in a state: operators by what they require, and the designs worth choosing.

use rustc_hash::FxHashMap;

use crate::number::Int;
use crate::quantity::Quantity;
use crate::task::{Operator, OperatorId, State, Task};

/// Operators by that fact of their condition whose variable has the most values.
pub(crate) struct OperatorIndex {
    by_fact: FxHashMap<(u32, u32), Vec<OperatorId>>,
    always: Vec<OperatorId>,
}

impl OperatorIndex {
    pub(crate) fn new(task: &Task) -> Self {
        Self::over(task, (0..task.operators.len() as u32).map(OperatorId))
    }

    /// An index of some operators, ascending.
    pub(crate) fn over(task: &Task, operators: impl Iterator<Item = OperatorId>) -> Self {
        let mut index = Self { by_fact: FxHashMap::default(), always: Vec::new() };
        for id in operators {
            let widest = task.operators[id.index()]
                .condition
                .facts
                .iter()
                .max_by_key(|fact| task.variables[fact.variable.index()].values.len());
            match widest {
                Some(fact) => index.by_fact.entry((fact.variable.0, fact.value)).or_default().push(id),
                None => index.always.push(id),
            }
        }
        index
    }

    /// The operators whose propositional condition holds, ascending.
    pub(crate) fn applicable(&self, task: &Task, state: &State) -> Vec<OperatorId> {
        let mut found = self.always.clone();
        for (variable, value) in state.values.iter().enumerate() {
            found.extend(self.by_fact.get(&(variable as u32, *value)).into_iter().flatten());
        }
        found.retain(|id| task.operators[id.index()].condition.holds_propositionally(&state.values));
        found.sort_unstable();
        found
    }
}

/// As many combinations of designs are compared at most.
const CHOICE_LIMIT: usize = 100_000;

/// Designs for some slots of an operator, with what they add to its cost and to the numbers in its conditions and effects.
struct Partial {
    choice: Vec<u16>,
    cost: Int,
    profile: Vec<Int>,
}

/// The combinations of an operator's designs that no other one dominates, with their costs: none is cheaper or
/// leaves more of the numeric variables. Of equal ones the first stands for all, unless `all` are asked for. None if there
/// are too many.
///
/// Slots that no table and no exclusion joins contribute by themselves, so what is dominated among the combinations of some of
/// them is dominated in all combinations that extend it: k functions of m designs cost no m^k comparisons.
pub(crate) fn undominated(operator: &Operator, monotone: bool, all: bool) -> Option<Vec<(Vec<u16>, Int)>> {
    let sizes = operator.sizes();
    let effects = operator.numeric_effects.iter().map(|effect| &effect.value.quantity);
    let conditions = operator.condition.comparisons.iter().map(|linear| &linear.quantity);
    let quantities: Vec<&Quantity<Int>> = effects.chain(conditions).collect();
    let profile = quantities.iter().map(|quantity| quantity.constant).collect();
    let mut front = vec![Partial { choice: vec![0; sizes.len()], cost: operator.cost.constant, profile }];
    for slots in independent(operator, &quantities) {
        let mut own = Vec::new();
        each_combination(&slots, &sizes, &mut |choice| {
            let excluded = operator.forbidden.iter().any(|rule| {
                let joins = rule.slots.iter().all(|slot| slots.contains(slot));
                joins
                    && rule
                        .combinations
                        .iter()
                        .any(|bad| rule.slots.iter().zip(bad).all(|(s, d)| choice[*s as usize] == *d))
            });
            let sum = |quantity: &Quantity<Int>| quantity.part(&slots, choice, &sizes);
            if !excluded {
                own.push(Partial {
                    choice: choice.to_vec(),
                    cost: sum(&operator.cost),
                    profile: quantities.iter().map(|quantity| sum(quantity)).collect(),
                });
            }
            own.len() <= CHOICE_LIMIT
        });
        let own = best(own, monotone, all);
        if own.len().saturating_mul(front.len()) > CHOICE_LIMIT {
            return None;
        }
        let slots = &slots;
        let pairs = front.iter().flat_map(|known| own.iter().map(move |own| known.with(own, slots)));
        front = best(pairs.collect(), monotone, all);
    }
    Some(front.into_iter().map(|Partial { choice, cost, .. }| (choice, cost)).collect())
}

impl Partial {
    fn with(&self, other: &Self, slots: &[u16]) -> Self {
        let mut choice = self.choice.clone();
        for slot in slots {
            choice[*slot as usize] = other.choice[*slot as usize];
        }
        let profile = self.profile.iter().zip(&other.profile).map(|(a, b)| a + b).collect();
        Self { choice, cost: self.cost + other.cost, profile }
    }
}

/// Those that none dominates, in lexicographic order of the designs.
fn best(mut all_of_them: Vec<Partial>, monotone: bool, all: bool) -> Vec<Partial> {
    // What dominates comes before what it dominates.
    all_of_them.sort_by(|a, b| {
        a.cost.cmp(&b.cost).then_with(|| b.profile.cmp(&a.profile)).then_with(|| a.choice.cmp(&b.choice))
    });
    let mut front: Vec<Partial> = Vec::new();
    for new in all_of_them {
        let dominates = |old: &Partial| {
            let no_worse = if monotone {
                old.profile.iter().zip(&new.profile).all(|(old, new)| old >= new)
            } else {
                old.profile == new.profile
            };
            no_worse && !(all && old.cost == new.cost && old.profile == new.profile)
        };
        if !front.iter().any(dominates) {
            front.push(new);
        }
    }
    front.sort_by(|a, b| a.choice.cmp(&b.choice));
    front
}

/// The slots of an operator in groups that no table and no exclusion joins.
fn independent(operator: &Operator, quantities: &[&Quantity<Int>]) -> Vec<Vec<u16>> {
    let tables = quantities.iter().copied().chain([&operator.cost]).flat_map(|quantity| &quantity.tables);
    let joined = tables.map(|table| &table.slots).chain(operator.forbidden.iter().map(|rule| &rule.slots));
    let mut groups: Vec<Vec<u16>> = (0..operator.slots.len() as u16).map(|slot| vec![slot]).collect();
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

/// Calls `visit` with every combination of designs for some slots until it returns false; the other slots stay at 0.
fn each_combination(slots: &[u16], sizes: &[usize], visit: &mut dyn FnMut(&[u16]) -> bool) {
    if slots.iter().any(|slot| sizes[*slot as usize] == 0) {
        return;
    }
    let mut choice = vec![0; sizes.len()];
    while visit(&choice) {
        let grows = |slot: &&u16| choice[**slot as usize] as usize + 1 < sizes[**slot as usize];
        let Some(position) = slots.iter().rposition(|slot| grows(&slot)) else { return };
        choice[slots[position] as usize] += 1;
        for slot in &slots[position + 1..] {
            choice[*slot as usize] = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::quantity::{Linear, NumericId, Table};
    use crate::task::{Condition, Forbidden, NumericEffect, SlotId, SlotUse};

    const SIZES: [usize; 4] = [2, 3, 2, 2];

    /// A quantity with a table over each list of slots, filled with small numbers.
    fn quantity(tables: &[Vec<u16>], numbers: &mut impl Iterator<Item = Int>) -> Quantity<Int> {
        let mut quantity = Quantity::constant(numbers.next().unwrap_or(0));
        for slots in tables {
            let size = slots.iter().map(|slot| SIZES[*slot as usize]).product();
            let values = (0..size).map(|_| numbers.next().unwrap_or(0)).collect();
            quantity.add_table(Table { slots: slots.iter().copied().collect(), values });
        }
        quantity
    }

    fn operator(costs: &[Vec<u16>], uses: &[Vec<u16>], excluded: &[(u16, u16)], numbers: &[Int]) -> Operator {
        let mut numbers = numbers.iter().copied().cycle();
        let cost = quantity(costs, &mut numbers);
        let variable = NumericId(0);
        let value = Linear { coefficients: vec![(variable, 1)], quantity: quantity(uses, &mut numbers) };
        let slot = |(size, slot): (&usize, u32)| SlotUse {
            slot: SlotId(slot),
            designs: (0..*size as u16).collect(),
        };
        // Slots 0 and 1 exclude each other's designs.
        let combinations = excluded.iter().map(|(a, b)| [*a, *b].into()).collect();
        Operator {
            schema: 0,
            arguments: Vec::new(),
            configuration: Vec::new(),
            slots: SIZES.iter().zip(0..).map(slot).collect(),
            forbidden: [Forbidden { slots: [0, 1].into(), combinations }].into(),
            condition: Condition { comparisons: vec![value.clone()], ..Condition::default() },
            effects: Vec::new(),
            conditional: Vec::new(),
            numeric_effects: vec![NumericEffect { variable, value }],
            cost,
            others: Vec::new(),
            duration: Quantity::constant(0),
            wait: None,
            timing: crate::ground::events::Timing::free(),
        }
    }

    /// By definition: every combination against every other one.
    fn expected(operator: &Operator, monotone: bool, all: bool) -> Vec<(Vec<u16>, Int)> {
        let sizes = operator.sizes();
        let value = |choice: &Vec<u16>| {
            (operator.cost.at(choice, &sizes), operator.numeric_effects[0].value.quantity.at(choice, &sizes))
        };
        let choices: Vec<Vec<u16>> = operator.choices().collect();
        let beaten = |choice: &Vec<u16>| {
            let (cost, left) = value(choice);
            choices.iter().any(|other| {
                let (own, more) = value(other);
                let no_worse = own <= cost && if monotone { more >= left } else { more == left };
                let equal = own == cost && more == left;
                no_worse && if equal { !all && other < choice } else { true }
            })
        };
        let best = choices.iter().filter(|choice| !beaten(choice));
        best.map(|choice| (choice.clone(), value(choice).0)).collect()
    }

    proptest! {
        #[test]
        fn independent_slots_lose_nothing(
            costs in proptest::sample::subsequence(vec![vec![0], vec![1], vec![2], vec![3], vec![1, 2]], 0..=5),
            uses in proptest::sample::subsequence(vec![vec![0], vec![1], vec![2], vec![3], vec![0, 3]], 0..=5),
            excluded in proptest::collection::vec((0_u16..2, 0_u16..3), 0..4),
            numbers in proptest::collection::vec(-4_i128..5, 1..40),
            monotone: bool,
        ) {
            let operator = operator(&costs, &uses, &excluded, &numbers);
            prop_assert_eq!(undominated(&operator, monotone, true), Some(expected(&operator, monotone, true)));
            // Of equal ones one stands for all.
            let values = |choices: Vec<(Vec<u16>, Int)>| {
                let sizes = operator.sizes();
                let left = |choice: &[u16]| operator.numeric_effects[0].value.quantity.at(choice, &sizes);
                let mut values: Vec<_> = choices.iter().map(|(choice, cost)| (*cost, left(choice))).collect();
                values.sort_unstable();
                values
            };
            let found = undominated(&operator, monotone, false).unwrap_or_default();
            prop_assert!(found.iter().all(|(choice, _)| operator.admits(choice)));
            prop_assert_eq!(values(found), values(expected(&operator, monotone, false)));
        }
    }
}
