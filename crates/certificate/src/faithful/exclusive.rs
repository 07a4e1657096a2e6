//! Groups of atoms of which at most one holds, in addition to the variables of the task: the witness lists them, and each is kept
//! by every instance if all variables and groups are exclusive before it.
//!
//! They are needed where the variables of the task share one invariant. Of `{idle, loading, loaded}` the task may keep `{loading,
//! loaded}` as a variable, because another variable has `idle`. That loading begins only in `idle` then says nothing of `loaded`,
//! unless the whole group is known. [`search`] finds it as invariant synthesis does [1]: a group that an instance breaks gets an
//! atom that this instance requires and deletes.
//!
//! [1] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial Intelligence 173, 2009, section 5.

use std::collections::BTreeSet;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::case::Case;
use crate::faithful::formula::Structure;
use crate::faithful::key::Key;
use crate::faithful::world::World;

/// Upper limit on the cases in which an instance is compared with a group.
const SPLIT_LIMIT: usize = 1_024;
/// Upper limit on the checks of a group against what an instance does, while groups are searched for.
const SEARCH_LIMIT: usize = 20_000_000;
/// Upper limit on the groups that are tried for one variable.
const GROUP_LIMIT: usize = 300;

/// Atoms of which at most one holds.
pub(super) type Group = BTreeSet<Key>;

/// Returns `true` if actions change all atoms of a group, and at most one holds at first.
pub(super) fn holds_initially(world: &World<'_>, group: &Group) -> bool {
    let is_basic = |key: &Key| world.changes(key.0) && world.rules(key.0).is_none();
    group.iter().all(is_basic) && group.iter().filter(|key| world.holds_initially(key)).count() <= 1
}

/// Returns `true` if at most one atom of a group holds after a case, given that this is so before.
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
            let own = effects.iter().filter(|(_, own, _)| own == key);
            let active = own.filter(|(guard, ..)| known.decide(structure, guard) == Some(true));
            let last = active.map(|(_, _, holds)| *holds).reduce(|left, right| left || right);
            last.or_else(|| case.truths.get(key).copied())
        };
        let (added, others): (Vec<&Key>, Vec<&Key>) = group.iter().partition(|key| after(key) == Some(true));
        let may_remain =
            |key: &Key| after(key).is_none() && may_hold(key) && known.atom(structure, key) != Some(false);
        if added.len() > 1 || added.len() == 1 && others.into_iter().any(may_remain) {
            return false;
        }
    }
    open.is_empty()
}

/// The effect of a case of an instance on groups.
pub(super) struct Move {
    /// Atoms that hold before.
    holding: Vec<Key>,
    /// Atoms that may be added.
    pub(super) adds: BTreeSet<Key>,
    /// Atoms that do not hold afterwards.
    deletes: Vec<Key>,
}

impl Move {
    /// The effect of a case that may add these atoms.
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

    /// Returns `Ok` if at most one atom of a group holds afterwards, given that this is so before.
    ///
    /// # Errors
    /// The atoms of which each would prove it if it were a member of the group; empty if there is no such atom.
    pub(super) fn keeps(&self, group: &Group, may_hold: &dyn Fn(&Key) -> bool) -> Result<(), Vec<Key>> {
        let mut added = self.adds.iter().filter(|key| group.contains(*key));
        let Some(key) = added.next() else { return Ok(()) };
        if added.next().is_some() {
            return Err(Vec::new());
        }
        if let Some(before) = self.holding.iter().find(|key| group.contains(*key)) {
            return if before == key || self.deletes.contains(before) { Ok(()) } else { Err(Vec::new()) };
        }
        if group.iter().all(|other| other == key || self.deletes.contains(other) || !may_hold(other)) {
            return Ok(());
        }
        Err(self.holding.iter().filter(|key| self.deletes.contains(*key)).cloned().collect())
    }
}

/// The groups that keep those of some variables exclusive that are not so by themselves.
#[expect(clippy::arithmetic_side_effects, reason = "no more than the limit")]
pub(super) fn search(
    world: &World<'_>,
    may_hold: &dyn Fn(&Key) -> bool,
    variables: impl Iterator<Item = Group>,
    moves: &[Move],
    stop: &dyn Fn() -> bool,
) -> Vec<Group> {
    let mut adding: FxHashMap<&Key, Vec<&Move>> = FxHashMap::default();
    for own in moves {
        for key in &own.adds {
            adding.entry(key).or_default().push(own);
        }
    }
    let mut found: Vec<Group> = Vec::new();
    let mut checks = 0;
    'variables: for variable in variables {
        if found.iter().any(|group| variable.is_subset(group)) {
            continue;
        }
        let mut open = vec![variable.clone()];
        let mut seen: FxHashSet<Group> = FxHashSet::default();
        while let Some(group) = open.pop() {
            if seen.len() >= GROUP_LIMIT || stop() {
                continue 'variables;
            }
            if !seen.insert(group.clone()) || !holds_initially(world, &group) {
                continue;
            }
            let mut concerned = group.iter().filter_map(|key| adding.get(key)).flatten();
            let broken = concerned.find_map(|own| {
                checks += 1;
                own.keeps(&group, may_hold).err()
            });
            if checks > SEARCH_LIMIT {
                return found;
            }
            let Some(repairs) = broken else {
                if group != variable {
                    found.push(group);
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
    found
}

/// Groups of a witness by number; the variables of the task come first.
pub(super) fn numbered(variables: usize, groups: &[Group]) -> impl Iterator<Item = (u32, &Group)> {
    (u32::try_from(variables).unwrap_or(u32::MAX)..).zip(groups)
}

/// The groups that a case adds an atom of.
pub(super) fn concerned<'g>(case: &Case, groups: &'g [Group]) -> impl Iterator<Item = &'g Group> {
    let at_end = case.effects.iter().filter(|(_, _, holds)| *holds).map(|(_, key, _)| key);
    let added: FxHashSet<&Key> =
        case.truths.iter().filter(|(_, holds)| **holds).map(|(key, _)| key).chain(at_end).collect();
    groups.iter().filter(move |group| added.iter().any(|key| group.contains(*key)))
}
