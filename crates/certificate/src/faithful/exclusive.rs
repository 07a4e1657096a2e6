//! Mutex groups (atoms of which at most one holds) in addition to the variables of the task. The
//! witness (the over-approximation of the reachable states) lists these groups. Every action
//! instance must preserve each group, given that all variables and groups are exclusive before the
//! instance.
//!
//! The groups are required where several variables of the task come from the same invariant. Of
//! `{idle, loading, loaded}`, the task may keep `{loading, loaded}` as a variable because another
//! variable contains `idle`. Loading starts only in `idle`, but without the whole group this
//! implies nothing about `loaded`. [`search`] finds the group by invariant synthesis [1]: if an
//! instance violates a group, the group is extended by an atom that the instance requires and
//! deletes.
//!
//! [1] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial
//! Intelligence 173, 2009, section 5.

use std::collections::BTreeSet;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::case::Case;
use crate::faithful::formula::Structure;
use crate::faithful::key::Key;
use crate::faithful::world::World;

const SPLIT_LIMIT: usize = 1_024;
/// Upper limit on the number of checks whether a case preserves a group, during the whole search.
const SEARCH_LIMIT: usize = 20_000_000;
const GROUP_LIMIT: usize = 300;

/// A mutex group: atoms of which at most one holds.
pub(super) type Group = BTreeSet<Key>;

pub(super) fn holds_initially(world: &World<'_>, group: &Group) -> bool {
    let is_basic = |key: &Key| world.changes(key.0) && world.rules(key.0).is_none();
    group.iter().all(is_basic) && group.iter().filter(|key| world.holds_initially(key)).count() <= 1
}

/// Returns `true` if at most one atom of a group holds after a case, given that at most one holds before it. `false`
/// means violated or not proved.
pub(super) fn keeps(
    structure: &Structure,
    may_hold: &dyn Fn(&Key) -> bool,
    case: &Case,
    group: &Group,
) -> bool {
    let effects: Vec<_> = case.effects.iter().filter(|(_, key, _)| group.contains(key)).collect();
    let mut open = vec![case.known.clone()];
    for _ in 0..SPLIT_LIMIT {
        let Some(known) = open.pop() else { return true };
        let leaf = effects.iter().find_map(|(guard, ..)| known.open(structure, guard, &|_| true));
        if let Some(leaf) = leaf {
            let Ok(cases) = known.split(structure, std::iter::once(leaf)) else { return false };
            open.extend(cases);
            continue;
        }
        // An atom that is both added and deleted holds.
        let after = |key: &Key| {
            let atom_effects = effects.iter().filter(|(_, atom, _)| atom == key);
            let active = atom_effects.filter(|(guard, ..)| known.decide(structure, guard) == Some(true));
            let last = active.map(|(_, _, holds)| *holds).reduce(|left, right| left || right);
            last.or_else(|| case.truths.get(key).copied())
        };
        let (added, unadded): (Vec<&Key>, Vec<&Key>) = group.iter().partition(|key| after(key) == Some(true));
        let may_remain =
            |key: &Key| after(key).is_none() && may_hold(key) && known.atom(structure, key) != Some(false);
        if added.len() > 1 || added.len() == 1 && unadded.into_iter().any(may_remain) {
            return false;
        }
    }
    open.is_empty()
}

pub(super) struct Move {
    /// Atoms that certainly hold before the case.
    holding: Vec<Key>,
    pub(super) adds: BTreeSet<Key>,
    /// Atoms that certainly do not hold after the case.
    deletes: Vec<Key>,
}

impl Move {
    pub(super) fn new(structure: &Structure, case: &Case, adds: BTreeSet<Key>) -> Self {
        let at_end = case
            .effects
            .iter()
            .filter(|(guard, _, holds)| !holds && case.known.decide(structure, guard) == Some(true));
        let at_start = case.truths.iter().filter(|(_, holds)| !**holds).map(|(key, _)| key);
        let deletes = at_end.map(|(_, key, _)| key).chain(at_start);
        let deletes = deletes.filter(|key| !adds.contains(*key)).cloned().collect();
        Self { holding: case.known.holding_atoms().cloned().collect(), adds, deletes }
    }

    pub(super) fn adds_any(&self) -> bool {
        !self.adds.is_empty()
    }

    /// Checks that at most one atom of a mutex group holds after the case, given that at most one
    /// holds before it.
    ///
    /// # Errors
    /// The atoms that the case requires and deletes: if one of them is added to the group, the
    /// check may succeed. Empty if no larger group passes the check.
    pub(super) fn keeps(&self, group: &Group, may_hold: &dyn Fn(&Key) -> bool) -> Result<(), Vec<Key>> {
        let mut added = self.adds.iter().filter(|key| group.contains(*key));
        let Some(key) = added.next() else { return Ok(()) };
        if added.next().is_some() {
            return Err(Vec::new());
        }
        if let Some(before) = self.holding.iter().find(|key| group.contains(*key)) {
            return if before == key || self.deletes.contains(before) { Ok(()) } else { Err(Vec::new()) };
        }
        if group.iter().all(|atom| atom == key || self.deletes.contains(atom) || !may_hold(atom)) {
            return Ok(());
        }
        Err(self.holding.iter().filter(|key| self.deletes.contains(*key)).cloned().collect())
    }
}

/// Searches for mutex groups which prove that the values of each variable in `variables` exclude each other.
/// The atoms of these variables alone are not an inductive invariant. A variable gets no group if none is found
/// within the limits or before `stop` returns `true`.
#[expect(clippy::arithmetic_side_effects, reason = "no more than the limit")]
pub(super) fn search(
    world: &World<'_>,
    may_hold: &dyn Fn(&Key) -> bool,
    variables: impl Iterator<Item = Group>,
    moves: &[Move],
    stop: &dyn Fn() -> bool,
) -> Vec<Group> {
    let mut adding: FxHashMap<&Key, Vec<&Move>> = FxHashMap::default();
    for candidate in moves {
        for key in &candidate.adds {
            adding.entry(key).or_default().push(candidate);
        }
    }
    let mut groups: Vec<Group> = Vec::new();
    let mut checks = 0;
    'variables: for variable in variables {
        if groups.iter().any(|group| variable.is_subset(group)) {
            continue;
        }
        let mut open = vec![variable.clone()];
        let mut visited: FxHashSet<Group> = FxHashSet::default();
        while let Some(group) = open.pop() {
            if visited.len() >= GROUP_LIMIT || stop() {
                continue 'variables;
            }
            if !visited.insert(group.clone()) || !holds_initially(world, &group) {
                continue;
            }
            let mut concerned = group.iter().filter_map(|key| adding.get(key)).flatten();
            let broken = concerned.find_map(|candidate| {
                checks += 1;
                candidate.keeps(&group, may_hold).err()
            });
            if checks > SEARCH_LIMIT {
                return groups;
            }
            let Some(repairs) = broken else {
                if group != variable {
                    groups.push(group);
                }
                continue 'variables;
            };
            open.extend(repairs.into_iter().rev().map(|key| {
                let mut larger = group.clone();
                larger.insert(key);
                larger
            }));
        }
    }
    groups
}

/// Numbers the mutex groups of a witness. The numbers follow those of the task's variables.
pub(super) fn numbered(variables: usize, groups: &[Group]) -> impl Iterator<Item = (u32, &Group)> {
    (u32::try_from(variables).unwrap_or(u32::MAX)..).zip(groups)
}

pub(super) fn concerned<'g>(case: &Case, groups: &'g [Group]) -> impl Iterator<Item = &'g Group> {
    let at_end = case.effects.iter().filter(|(_, _, holds)| *holds).map(|(_, key, _)| key);
    let added: FxHashSet<&Key> =
        case.truths.iter().filter(|(_, holds)| **holds).map(|(key, _)| key).chain(at_end).collect();
    groups.iter().filter(move |group| added.iter().any(|key| group.contains(*key)))
}
