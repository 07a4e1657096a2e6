//! Which actions can have their end put right after their start, so that they take one step of the search.
//!
//! Happenings that do not interfere have no order in time, whatever their order in a sequence. An end that interferes with
//! nothing that can happen while its action is under way can be put before all that, which changes neither the times nor the states before and
//! after. Coles et al. [1] ask for actions that only add at their end; what can lie in between is asked for here, by facts that hold as
//! long as the action is under way, so that more actions qualify and none loses a plan.
//!
//! [1] A. Coles, M. Fox, K. Halsey, D. Long, A. Smith: Managing concurrency in temporal planning using planner-scheduler
//! interaction, Artificial Intelligence 173, 2009.

use rustc_hash::FxHashMap;

use crate::concurrent::clocks::Key;
use crate::concurrent::happening::{Happening, Instance, Role};
use crate::limits::{Interrupted, Limits};
use crate::number::dense;
use crate::task::{Fact, OperatorId, Task};

/// As many pairs of happenings are looked at, at most; actions that are left then keep their ends apart.
const PAIRS: usize = 20_000_000;

/// The operators that touch each kind of access, and those that set each variable.
struct Index<'a> {
    task: &'a Task,
    happenings: &'a [Happening],
    instances: &'a [Instance],
    waiting: FxHashMap<Key, Vec<OperatorId>>,
    marking: FxHashMap<Key, Vec<OperatorId>>,
    setting: Vec<Vec<OperatorId>>,
    /// The atoms and numbers that some condition over all reads jointly, ascending.
    joint: Vec<u32>,
}

/// What holds while an action is under way.
#[derive(Default)]
struct Invariant {
    facts: Vec<Fact>,
    /// Of them, those that its condition over all requires.
    over_all: Vec<Fact>,
}

/// For each instance whether its end can come right after its start.
pub(super) fn compressible(
    task: &Task,
    happenings: &[Happening],
    instances: &[Instance],
    limits: &Limits,
) -> Result<Vec<bool>, Interrupted> {
    let index = Index::new(task, happenings, instances);
    let mut left = PAIRS;
    limits
        .watch(instances)
        .map(|instance| instance.map(|own| index.is_compressible(own, &mut left)))
        .collect()
}

impl<'a> Index<'a> {
    fn new(task: &'a Task, happenings: &'a [Happening], instances: &'a [Instance]) -> Self {
        let (mut waiting, mut marking): (FxHashMap<Key, Vec<_>>, FxHashMap<Key, Vec<_>>) = Default::default();
        let mut setting = vec![Vec::new(); task.variables.len()];
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
        }
        let mut joint: Vec<u32> = instances.iter().flat_map(|own| own.joint.iter().copied()).collect();
        joint.sort_unstable();
        joint.dedup();
        Self { task, happenings, instances, waiting, marking, setting, joint }
    }

    fn is_compressible(&self, own: &Instance, left: &mut usize) -> bool {
        let end = &self.happenings[own.end.index()];
        if !own.joint.is_empty() || end.writes.iter().any(|id| self.joint.binary_search(id).is_ok()) {
            return false;
        }
        let Some(invariant) = self.invariant(own, left) else { return false };
        let waiting = end.accesses.marks.iter().filter_map(|key| self.waiting.get(key));
        let marking = end.accesses.after.iter().filter_map(|(key, _)| self.marking.get(key));
        let interfering = waiting.chain(marking).flatten();
        for other in interfering {
            let Some(rest) = left.checked_sub(1) else { return false };
            *left = rest;
            if ![own.start, own.end].contains(other) && !self.excludes(&invariant, own, *other) {
                return false;
            }
        }
        true
    }

    /// Facts that hold from right after the start to right before the end, whatever happens in between.
    fn invariant(&self, own: &Instance, left: &mut usize) -> Option<Invariant> {
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
                for other in &self.setting[fact.variable.index()] {
                    *left = left.checked_sub(1)?;
                    let is_own = *other == own.start || *other == own.end;
                    if !is_own && self.changes(*other, *fact) && !self.excludes(&invariant, own, *other) {
                        broken = Some(position);
                        break;
                    }
                }
                if broken.is_some() {
                    break;
                }
            }
            let Some(position) = broken else { return Some(invariant) };
            invariant.facts.swap_remove(position);
        }
    }

    /// Whether a happening may make a fact false.
    fn changes(&self, id: OperatorId, fact: Fact) -> bool {
        let operator = &self.task.operators[id.index()];
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let mut effects = operator.effects.iter().chain(conditional);
        effects.any(|effect| effect.variable == fact.variable && effect.value != fact.value)
    }

    /// Whether a happening cannot lie strictly inside an action as long as the facts hold.
    fn excludes(&self, invariant: &Invariant, own: &Instance, id: OperatorId) -> bool {
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
}
