//! Invariants of running actions: facts that hold while an action runs, and happenings that they exclude.

use rustc_hash::FxHashMap;
use task::number::{Int, dense};
use task::task::{Fact, NumericId, OperatorId, Task, VariableId};

use crate::concurrent::happening::{Happening, Instance, Role};
use crate::concurrent::simple_temporal_network::Key;

/// As many pairs of happenings are looked at, at most; nothing is said of actions that are left then.
pub(super) const MAX_PAIR_CHECKS: usize = 20_000_000;

/// The operators that touch each kind of access, and those that change each variable and each number.
pub(super) struct Index<'a> {
    pub(super) task: &'a Task,
    pub(super) happenings: &'a [Happening],
    pub(super) instances: &'a [Instance],
    pub(super) waiting: FxHashMap<Key, Vec<OperatorId>>,
    pub(super) marking: FxHashMap<Key, Vec<OperatorId>>,
    setting: Vec<Vec<OperatorId>>,
    changing: FxHashMap<NumericId, Vec<OperatorId>>,
    /// The atoms and numbers that some condition over all reads jointly, ascending.
    pub(super) joint: Vec<u32>,
}

/// What holds while an action is under way.
#[derive(Default)]
pub(super) struct Invariant {
    pub(super) facts: Vec<Fact>,
    /// Of them, those that its condition over all requires.
    pub(super) over_all: Vec<Fact>,
}

impl<'a> Index<'a> {
    pub(super) fn new(task: &'a Task, happenings: &'a [Happening], instances: &'a [Instance]) -> Self {
        let (mut waiting, mut marking): (FxHashMap<Key, Vec<_>>, FxHashMap<Key, Vec<_>>) = Default::default();
        let mut setting = vec![Vec::new(); task.variables.len()];
        let mut changing: FxHashMap<NumericId, Vec<_>> = FxHashMap::default();
        for (id, happening) in (0..dense(happenings.len())).map(OperatorId).zip(happenings) {
            if happening.role == Role::Never {
                continue;
            }
            for (key, _) in &happening.accesses.after {
                waiting.entry(*key).or_default().push(id);
            }
            for key in &happening.accesses.marks {
                marking.entry(*key).or_default().push(id);
            }
            let operator = &task.operators[id.index()];
            let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
            for fact in operator.effects.iter().chain(conditional) {
                setting[fact.variable.index()].push(id);
            }
            for effect in &operator.numeric_effects {
                changing.entry(effect.variable).or_default().push(id);
            }
        }
        let mut joint: Vec<u32> = instances.iter().flat_map(|own| own.joint.iter().copied()).collect();
        joint.sort_unstable();
        joint.dedup();
        Self { task, happenings, instances, waiting, marking, setting, changing, joint }
    }

    /// Facts that hold from right after the start to right before the end, whatever happens in between; if `alone`, but for the
    /// start and the end of other runs of the same instance. None if that takes too long.
    pub(super) fn invariant(&self, own: &Instance, alone: bool, left: &mut usize) -> Option<Invariant> {
        let start = &self.task.operators[own.start.index()];
        let basic = |fact: &&Fact| fact.variable.index() < self.task.basic;
        let over_all = own.over_all.map(|id| &self.task.operators[id.index()].condition.facts);
        let over_all: Vec<Fact> = over_all.into_iter().flatten().filter(basic).copied().collect();
        let conditional = start.conditional.iter().flat_map(|effect| &effect.effects);
        let changed: Vec<_> = conditional.map(|fact| fact.variable).collect();
        let mut facts = over_all.clone();
        for fact in start.effects.iter().chain(&start.condition.facts).filter(basic) {
            let is_known = facts.iter().any(|known| known.variable == fact.variable);
            if !is_known && !changed.contains(&fact.variable) {
                facts.push(*fact);
            }
        }
        let mut invariant = Invariant { facts, over_all };
        loop {
            let mut broken = None;
            for (position, fact) in invariant.facts.iter().enumerate() {
                if !self.is_kept(*fact, &invariant, (own, alone), left)? {
                    broken = Some(position);
                    break;
                }
            }
            let Some(position) = broken else { return Some(invariant) };
            invariant.facts.swap_remove(position);
        }
    }

    /// Whether nothing that can lie strictly inside an action makes a fact false; if `alone`, but for the start and the end of other runs of
    /// the same instance. None if that takes too long.
    fn is_kept(
        &self,
        fact: Fact,
        invariant: &Invariant,
        (own, alone): (&Instance, bool),
        left: &mut usize,
    ) -> Option<bool> {
        for other in &self.setting[fact.variable.index()] {
            *left = left.checked_sub(1)?;
            let is_own = [own.start, own.end].contains(other);
            // As long as another run is under way, so is the instance.
            let is_nothing = is_own && (alone || own.under_way.is_some_and(|own| own == fact));
            if !is_nothing && self.changes(*other, fact) && !self.excludes(invariant, own, *other) {
                return Some(false);
            }
        }
        Some(true)
    }

    /// The happenings of others that change a variable.
    pub(super) fn setting(&self, own: &Instance, variable: VariableId) -> impl Iterator<Item = OperatorId> {
        let [start, end] = [own.start, own.end];
        let all = self.setting[variable.index()].iter().copied();
        all.filter(move |id| ![start, end].contains(id))
    }

    /// The happenings of others that change a number.
    pub(super) fn changing(&self, own: &Instance, number: NumericId) -> impl Iterator<Item = OperatorId> {
        let [start, end] = [own.start, own.end];
        let all = self.changing.get(&number).into_iter().flatten().copied();
        all.filter(move |id| ![start, end].contains(id))
    }

    /// Whether a happening may make a fact false.
    pub(super) fn changes(&self, id: OperatorId, fact: Fact) -> bool {
        let operator = &self.task.operators[id.index()];
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let mut effects = operator.effects.iter().chain(conditional);
        effects.any(|effect| effect.variable == fact.variable && effect.value != fact.value)
    }

    /// Whether a happening cannot lie strictly inside an action as long as the facts hold.
    pub(super) fn excludes(&self, invariant: &Invariant, own: &Instance, id: OperatorId) -> bool {
        let (operator, happening) = (&self.task.operators[id.index()], &self.happenings[id.index()]);
        let known = |fact: &Fact| invariant.facts.iter().find(|known| known.variable == fact.variable);
        let contradicts = |fact: &Fact| known(fact).is_some_and(|known| known.value != fact.value);
        if operator.condition.facts.iter().any(contradicts) {
            return true;
        }
        // Of what a condition over all requires nothing else can make up at the same time: the two would interfere.
        let breaks = |fact: &Fact| {
            let mut required = invariant.over_all.iter();
            required.any(|known| known.variable == fact.variable && known.value != fact.value)
        };
        let clashes = |(function, design): &(_, _)| {
            own.designs.iter().any(|(other, used)| other == function && used != design)
        };
        if operator.effects.iter().any(breaks) || happening.designs.iter().any(clashes) {
            return true;
        }
        let Role::Start(other) = happening.role else { return false };
        let over_all = self.instances[other as usize].over_all;
        let required = over_all.into_iter().flat_map(|id| &self.task.operators[id.index()].condition.facts);
        let mut required =
            required.filter(|fact| operator.effects.iter().all(|effect| effect.variable != fact.variable));
        operator.conditional.is_empty() && required.any(contradicts)
    }

    /// The same in time: also the end of an action that needs something else all along. Both what that needs and the facts would hold right before it, unless it
    /// comes at the time of the start.
    pub(super) fn is_outside(&self, invariant: &Invariant, own: &Instance, id: OperatorId) -> bool {
        if self.excludes(invariant, own, id) {
            return true;
        }
        let happenings = &self.happenings;
        let Role::End(other) = happenings[id.index()].role else { return false };
        let before = &self.task.operators[own.start.index()].condition.facts;
        let waits = |one: OperatorId, other: OperatorId| {
            let marks = &happenings[other.index()].accesses.marks;
            let mut after = happenings[one.index()].accesses.after.iter();
            after.any(|(key, by)| *by > 0 && marks.binary_search(key).is_ok())
        };
        let is_apart = waits(own.start, id) || waits(id, own.start);
        self.over_all(other).iter().any(|fact| {
            let known = invariant.facts.iter().find(|known| known.variable == fact.variable);
            known.is_some_and(|known| known.value != fact.value && (is_apart || before.contains(known)))
        })
    }

    /// What must hold over all of an instance, as far as it is single facts.
    pub(super) fn over_all(&self, instance: u32) -> &[Fact] {
        let over_all = self.instances[instance as usize].over_all;
        over_all.map_or(&[], |id| &self.task.operators[id.index()].condition.facts)
    }

    /// How long an instance takes, at least.
    pub(super) fn duration(&self, instance: u32) -> Int {
        self.instances[instance as usize].duration
    }

    /// The starts of actions with what must hold over all of them.
    pub(super) fn holding(&self) -> impl Iterator<Item = (OperatorId, OperatorId)> {
        self.instances.iter().filter_map(|own| Some((own.start, own.over_all?)))
    }
}
