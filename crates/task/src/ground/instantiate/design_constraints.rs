//! Forbidden combinations of designs, and the test whether any combination remains allowed.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::limits::{Interrupted, LimitPoll, Limits};
use crate::task::ForbiddenCombinations;
use crate::task::quantity::SlotSet;

/// Adds a forbidden combination. Combinations may then occur repeatedly until [`distinct`] is called.
pub(super) fn forbid(forbidden: &mut Vec<ForbiddenCombinations>, slots: &SlotSet, combination: SlotSet) {
    match forbidden.iter_mut().find(|rule| rule.slots == *slots) {
        Some(rule) => rule.combinations.push(combination),
        None => {
            forbidden.push(ForbiddenCombinations { slots: slots.clone(), combinations: vec![combination] });
        }
    }
}

/// Removes repeated combinations. The others keep their order.
pub(super) fn distinct(mut forbidden: Vec<ForbiddenCombinations>) -> Arc<[ForbiddenCombinations]> {
    for rule in &mut forbidden {
        let mut combinations = FxHashSet::default();
        rule.combinations.retain(|combination| combinations.insert(combination.clone()));
    }
    forbidden.into()
}

/// Returns `true` if there is a combination of designs that no constraint forbids. `sizes` is the number of
/// designs of each slot.
///
/// Uses a backtracking search over the constrained slots only, separately for each connected component of
/// constraints. A partial combination that violates a constraint is not extended.
pub(super) fn admit_some(
    forbidden: &[ForbiddenCombinations],
    sizes: &[usize],
    limits: &Limits,
) -> Result<bool, Interrupted> {
    let is_never = |rule: &ForbiddenCombinations| rule.slots.is_empty() && !rule.combinations.is_empty();
    if sizes.contains(&0) || forbidden.iter().any(is_never) {
        return Ok(false);
    }
    let mut pulse = limits.pulse();
    for group in joined(forbidden) {
        let mut rules: Vec<Vec<Rule<'_>>> = group.iter().map(|_| Vec::new()).collect();
        for rule in forbidden.iter().filter(|rule| rule.slots.iter().any(|slot| group.contains(slot))) {
            let place = |slot: &u32| group.binary_search(slot).unwrap_or_default();
            let places: Vec<usize> = rule.slots.iter().map(place).collect();
            if let Some(last) = places.iter().max() {
                rules[*last].push((places.clone(), rule.combinations.iter().collect()));
            }
        }
        let sizes: Vec<usize> = group.iter().map(|slot| sizes[*slot as usize]).collect();
        if !extends(&mut Vec::new(), &sizes, &rules, &mut pulse)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// A constraint: its slots and the forbidden combinations of their designs. A slot is given by its position
/// in the sorted slots of its connected component (see [`joined`]).
type Rule<'f> = (Vec<usize>, FxHashSet<&'f SlotSet>);

/// Returns `true` if the designs chosen for the first slots of a connected component can be extended to all its slots
/// without a forbidden combination. `sizes` is the number of designs of each slot. `rules` holds, for each slot, the
/// rules whose last slot it is.
fn extends(
    chosen: &mut Vec<u32>,
    sizes: &[usize],
    rules: &[Vec<Rule<'_>>],
    pulse: &mut LimitPoll<'_>,
) -> Result<bool, Interrupted> {
    let at = chosen.len();
    let Some(size) = sizes.get(at) else { return Ok(true) };
    for (_, design) in (0..*size).zip(0..) {
        pulse.beat()?;
        chosen.push(design);
        let is_forbidden = rules[at].iter().any(|(places, combinations)| {
            combinations.contains(&places.iter().map(|place| chosen[*place]).collect::<SlotSet>())
        });
        if !is_forbidden && extends(chosen, sizes, rules, pulse)? {
            return Ok(true);
        }
        chosen.pop();
    }
    Ok(false)
}

fn joined(forbidden: &[ForbiddenCombinations]) -> Vec<Vec<u32>> {
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for rule in forbidden {
        let touches = |group: &Vec<u32>| group.iter().any(|slot| rule.slots.contains(slot));
        let (together, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(touches);
        let mut group: Vec<u32> = together.into_iter().flatten().chain(rule.slots.iter().copied()).collect();
        group.sort_unstable();
        group.dedup();
        groups = apart;
        groups.push(group);
    }
    groups
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn search_agrees_with_enumeration(
            sizes in proptest::collection::vec(1_usize..4, 1..5),
            never in proptest::bool::weighted(0.1),
            rules in proptest::collection::vec((0_u32..4, 0_u32..4, proptest::collection::vec((0_u32..3, 0_u32..3), 0..9)), 0..5),
        ) {
            let fits = |slot: u32| (slot as usize) < sizes.len();
            let rules = rules.into_iter().filter(|(a, b, _)| a < b && fits(*a) && fits(*b));
            let never = never.then(|| ForbiddenCombinations { slots: SlotSet::new(), combinations: vec![SlotSet::new()] });
            let forbidden: Vec<ForbiddenCombinations> = rules
                .map(|(a, b, pairs)| ForbiddenCombinations {
                    slots: [a, b].into(),
                    combinations: pairs.into_iter().map(|(x, y)| [x, y].into()).collect(),
                })
                .chain(never)
                .collect();
            let mut choices: Vec<Vec<u32>> = vec![Vec::new()];
            for size in &sizes {
                let longer = |prefix: &Vec<u32>| {
                    let prefix = prefix.clone();
                    (0..*size).zip(0..).map(move |(_, design)| prefix.iter().copied().chain([design]).collect())
                };
                choices = choices.iter().flat_map(longer).collect();
            }
            let admits = |choice: &Vec<u32>| {
                forbidden.iter().all(|rule| {
                    let part: SlotSet = rule.slots.iter().map(|slot| choice[*slot as usize]).collect();
                    !rule.combinations.contains(&part)
                })
            };
            prop_assert_eq!(admit_some(&forbidden, &sizes, &Limits::none()), Ok(choices.iter().any(admits)));
        }
    }

    #[test]
    fn a_large_product_is_not_enumerated() {
        let pairs = (0..100).flat_map(|a| (0..100).map(move |b| [a, b].into())).collect();
        let forbidden = [ForbiddenCombinations { slots: [0, 1].into(), combinations: pairs }];
        assert_eq!(admit_some(&forbidden, &[100; 5], &Limits::none()), Ok(false));
    }
}
