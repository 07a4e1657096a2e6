//! Invariants of running actions: facts that hold while an action runs, and happenings that these
//! facts exclude.

use rustc_hash::FxHashMap;
use task::number::{Int, dense};
use task::task::{Fact, NumericId, OperatorId, Task, VariableId};

use crate::concurrent::happening::{Happening, Instance, Role};
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::time_number::TimeNumber;

/// Work limit of an analysis, in visits of operators. Nothing is concluded about actions that are
/// not analysed before the limit.
pub(super) const MAX_PAIR_CHECKS: usize = 20_000_000;

pub(super) struct Index<'a, T: TimeNumber = Int> {
    pub(super) task: &'a Task,
    pub(super) happenings: &'a [Happening<T>],
    pub(super) instances: &'a [Instance<T>],
    pub(super) waiting: FxHashMap<Key, Vec<OperatorId>>,
    pub(super) marking: FxHashMap<Key, Vec<OperatorId>>,
    setting: Vec<Vec<OperatorId>>,
    changing: FxHashMap<NumericId, Vec<OperatorId>>,
    /// Atoms and numbers read by those over-all conditions that several happenings can maintain jointly
    /// (see [`Instance::joint`]). Numbered as in [`Happening::writes`], in ascending order.
    pub(super) joint: Vec<u32>,
}

/// Facts that hold strictly between the start and the end of a run of an action.
#[derive(Default)]
pub(super) struct Invariant {
    pub(super) facts: Vec<Fact>,
    pub(super) over_all: Vec<Fact>,
}

impl<'a, T: TimeNumber> Index<'a, T> {
    pub(super) fn new(task: &'a Task, happenings: &'a [Happening<T>], instances: &'a [Instance<T>]) -> Self {
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
        let mut joint: Vec<u32> =
            instances.iter().flat_map(|instance| instance.joint.iter().copied()).collect();
        joint.sort_unstable();
        joint.dedup();
        Self { task, happenings, instances, waiting, marking, setting, changing, joint }
    }

    /// Computes facts that hold at every other happening strictly between the start and the end of a run of
    /// `own`. `alone` assumes that no other run of the same action starts or ends in between. `left` is the
    /// remaining work. Returns `None` if it is used up.
    pub(super) fn invariant(&self, own: &Instance<T>, alone: bool, left: &mut usize) -> Option<Invariant> {
        let start = &self.task.operators[own.start.index()];
        let basic = |fact: &&Fact| fact.variable.index() < self.task.basic;
        let over_all = own.over_all.map(|id| &self.task.operators[id.index()].condition.facts);
        let over_all: Vec<Fact> = over_all.into_iter().flatten().filter(basic).copied().collect();
        let conditional = start.conditional.iter().flat_map(|effect| &effect.effects);
        let conditional_variables: Vec<_> = conditional.map(|fact| fact.variable).collect();
        let mut facts = over_all.clone();
        for fact in start.effects.iter().chain(&start.condition.facts).filter(basic) {
            let is_covered = facts.iter().any(|candidate| candidate.variable == fact.variable);
            if !is_covered && !conditional_variables.contains(&fact.variable) {
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

    /// Returns `true` if it is proved that no happening strictly inside a run of `own` makes `fact` false while
    /// `invariant` holds. `alone` ignores starts and ends of other runs of the same action. Returns `None` if the
    /// work limit `left` is used up.
    fn is_kept(
        &self,
        fact: Fact,
        invariant: &Invariant,
        (own, alone): (&Instance<T>, bool),
        left: &mut usize,
    ) -> Option<bool> {
        for id in &self.setting[fact.variable.index()] {
            *left = left.checked_sub(1)?;
            let is_own = [own.start, own.end].contains(id);
            // The fact that the action is running remains true until the last simultaneous run
            // ends.
            let is_nothing = is_own && (alone || own.under_way.is_some_and(|running| running == fact));
            if !is_nothing && self.changes(*id, fact) && !self.excludes(invariant, own, *id) {
                return Some(false);
            }
        }
        Some(true)
    }

    pub(super) fn setting(
        &self,
        own: &Instance<T>,
        variable: VariableId,
    ) -> impl Iterator<Item = OperatorId> {
        let [start, end] = [own.start, own.end];
        let operators = self.setting[variable.index()].iter().copied();
        operators.filter(move |id| ![start, end].contains(id))
    }

    pub(super) fn changing(&self, own: &Instance<T>, number: NumericId) -> impl Iterator<Item = OperatorId> {
        let [start, end] = [own.start, own.end];
        let operators = self.changing.get(&number).into_iter().flatten().copied();
        operators.filter(move |id| ![start, end].contains(id))
    }

    pub(super) fn changes(&self, id: OperatorId, fact: Fact) -> bool {
        let operator = &self.task.operators[id.index()];
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let mut effects = operator.effects.iter().chain(conditional);
        effects.any(|effect| effect.variable == fact.variable && effect.value != fact.value)
    }

    /// Returns `true` if it is proved that the happening `id` cannot take place strictly inside a run of
    /// `own` during which the invariant facts hold.
    pub(super) fn excludes(&self, invariant: &Invariant, own: &Instance<T>, id: OperatorId) -> bool {
        let (operator, happening) = (&self.task.operators[id.index()], &self.happenings[id.index()]);
        let invariant_fact =
            |fact: &Fact| invariant.facts.iter().find(|candidate| candidate.variable == fact.variable);
        let contradicts =
            |fact: &Fact| invariant_fact(fact).is_some_and(|candidate| candidate.value != fact.value);
        if operator.condition.facts.iter().any(contradicts) {
            return true;
        }
        // A simultaneous happening cannot restore a fact that the over-all condition requires: it
        // would interfere with the happening that deletes the fact.
        let breaks = |fact: &Fact| {
            let mut required = invariant.over_all.iter();
            required.any(|candidate| candidate.variable == fact.variable && candidate.value != fact.value)
        };
        let clashes = |(function, design): &(_, _)| {
            own.designs.iter().any(|(candidate, used)| candidate == function && used != design)
        };
        if operator.effects.iter().any(breaks) || happening.designs.iter().any(clashes) {
            return true;
        }
        let Role::Start(instance) = happening.role else { return false };
        let over_all = self.instances[instance as usize].over_all;
        let required = over_all.into_iter().flat_map(|id| &self.task.operators[id.index()].condition.facts);
        let mut required =
            required.filter(|fact| operator.effects.iter().all(|effect| effect.variable != fact.variable));
        operator.conditional.is_empty() && required.any(contradicts)
    }

    /// Like [`Self::excludes`], but also `true` for an end whose over-all condition contradicts the
    /// invariant: right before an end inside the run, both would hold. The end must also be
    /// impossible at the very start of the run. This is certain if the end and the start of `own`
    /// keep a distance, or if the start requires the contradicted fact.
    pub(super) fn is_outside(&self, invariant: &Invariant, own: &Instance<T>, id: OperatorId) -> bool {
        if self.excludes(invariant, own, id) {
            return true;
        }
        let happenings = &self.happenings;
        let Role::End(instance) = happenings[id.index()].role else { return false };
        let before = &self.task.operators[own.start.index()].condition.facts;
        let waits = |later: OperatorId, earlier: OperatorId| {
            let marks = &happenings[earlier.index()].accesses.marks;
            let mut after = happenings[later.index()].accesses.after.iter();
            after.any(|(key, by)| *by > T::ZERO && marks.binary_search(key).is_ok())
        };
        let is_apart = waits(own.start, id) || waits(id, own.start);
        self.over_all(instance).iter().any(|fact| {
            let candidate = invariant.facts.iter().find(|candidate| candidate.variable == fact.variable);
            candidate.is_some_and(|candidate| {
                candidate.value != fact.value && (is_apart || before.contains(candidate))
            })
        })
    }

    pub(super) fn over_all(&self, instance: u32) -> &[Fact] {
        let over_all = self.instances[instance as usize].over_all;
        over_all.map_or(&[], |id| &self.task.operators[id.index()].condition.facts)
    }

    pub(super) fn duration(&self, instance: u32) -> T {
        self.instances[instance as usize].duration
    }

    pub(super) fn holding(&self) -> impl Iterator<Item = (OperatorId, OperatorId)> {
        self.instances.iter().filter_map(|instance| Some((instance.start, instance.over_all?)))
    }
}
