//! Mazurkiewicz traces \[1\]: sequences that differ only in the order of happenings that do not interfere.
//!
//! The sequences of a trace reach the same state and have the same linear program up to the names
//! of columns, so the search expands only one of them. The lexicographically first sequence of a
//! trace identifies the trace. An end is given by its operator and the index of the run that it
//! ends; runs of one instance keep their order.
//!
//! \[1\] A. Mazurkiewicz: Concurrent program schemes and their interpretations, DAIMI PB 78, Aarhus
//! University, 1977.

use rustc_hash::FxHashMap;
use task::task::OperatorId;

use crate::concurrent::flexible_durations::partial_plan_lp::gap;
use crate::concurrent::happening::Role;
use crate::concurrent::temporal_task::TemporalTask;

pub(super) struct Traces<'a> {
    concurrent: &'a TemporalTask,
    known: FxHashMap<(OperatorId, OperatorId), bool>,
}

impl<'a> Traces<'a> {
    pub(super) fn new(concurrent: &'a TemporalTask) -> Self {
        Self { concurrent, known: FxHashMap::default() }
    }

    /// Lexicographically first sequence in the trace of `sequence`. Each element is an operator and
    /// the index of the run that it ends.
    pub(super) fn first(&mut self, sequence: &[(OperatorId, u32)]) -> Vec<(OperatorId, u32)> {
        let mut remaining = sequence.to_vec();
        let mut first = Vec::with_capacity(remaining.len());
        while !remaining.is_empty() {
            let mut best: Option<usize> = None;
            for (position, id) in remaining.iter().enumerate() {
                let is_less = best.is_none_or(|best| *id < remaining[best]);
                if is_less && remaining[..position].iter().all(|before| !self.depend(before.0, id.0)) {
                    best = Some(position);
                }
            }
            first.push(remaining.remove(best.expect("invariant: nothing is before the first one")));
        }
        first
    }

    fn depend(&mut self, first: OperatorId, second: OperatorId) -> bool {
        let pair = (first.min(second), first.max(second));
        let concurrent = self.concurrent;
        *self.known.entry(pair).or_insert_with(|| depend(concurrent, first, second))
    }
}

fn depend(concurrent: &TemporalTask, one: OperatorId, other: OperatorId) -> bool {
    let [first, second] = [one, other].map(|id| &concurrent.happenings[id.index()]);
    let instance = |role| match role {
        Role::Start(instance) | Role::End(instance) => Some(instance),
        _ => None,
    };
    let (first_instance, second_instance) = (instance(first.role), instance(second.role));
    let is_timed = [first, second].iter().any(|happening| matches!(happening.role, Role::Timed(_)));
    let clashes = || {
        let mut used = first.designs.iter().flat_map(|(function, design)| {
            second.designs.iter().filter(move |(candidate, used)| candidate == function && used != design)
        });
        used.next().is_some()
    };
    // An instance with a joint over-all condition (see `Instance::joint`) depends on every happening
    // that writes what the condition reads.
    let touches = |id, instance: Option<u32>| instance.is_some_and(|index| concurrent.touches(id, index));
    let mut joint = 0..u32::try_from(concurrent.instances.len()).unwrap_or(u32::MAX);
    is_timed
        || one == other
        || first_instance.is_some() && first_instance == second_instance
        || gap(&first.accesses.after, &second.accesses.marks).is_some()
        || gap(&second.accesses.after, &first.accesses.marks).is_some()
        || clashes()
        || touches(one, second_instance)
        || touches(other, first_instance)
        || joint.any(|instance| touches(one, Some(instance)) && touches(other, Some(instance)))
}
