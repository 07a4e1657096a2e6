//! Mazurkiewicz traces \[1\]: sequences that differ only in the order of happenings that do not interfere.
//!
//! The sequences of a trace reach the same state and have the same linear program up to the names of columns.
//! Only the lexicographically first sequence of each trace is searched. An end names the run of its instance
//! that it ends; runs of one instance keep their order.
//!
//! \[1\] A. Mazurkiewicz: Concurrent program schemes and their interpretations, DAIMI PB 78, Aarhus University, 1977.

use rustc_hash::FxHashMap;
use task::task::OperatorId;

use crate::concurrent::flexible_durations::partial_plan_lp::gap;
use crate::concurrent::happening::Role;
use crate::concurrent::temporal_task::TemporalTask;

/// Which happenings interfere, as far as that has been asked.
pub(super) struct Traces<'a> {
    concurrent: &'a TemporalTask,
    known: FxHashMap<(OperatorId, OperatorId), bool>,
}

impl<'a> Traces<'a> {
    pub(super) fn new(concurrent: &'a TemporalTask) -> Self {
        Self { concurrent, known: FxHashMap::default() }
    }

    /// The first sequence of the trace.
    pub(super) fn first(&mut self, sequence: &[(OperatorId, u32)]) -> Vec<(OperatorId, u32)> {
        let mut left = sequence.to_vec();
        let mut first = Vec::with_capacity(left.len());
        while !left.is_empty() {
            let mut best: Option<usize> = None;
            for (position, id) in left.iter().enumerate() {
                let is_less = best.is_none_or(|best| *id < left[best]);
                if is_less && left[..position].iter().all(|before| !self.depend(before.0, id.0)) {
                    best = Some(position);
                }
            }
            first.push(left.remove(best.expect("invariant: nothing is before the first one")));
        }
        first
    }

    /// Whether the order of two happenings may matter.
    fn depend(&mut self, one: OperatorId, other: OperatorId) -> bool {
        let pair = (one.min(other), one.max(other));
        let concurrent = self.concurrent;
        *self.known.entry(pair).or_insert_with(|| depend(concurrent, one, other))
    }
}

fn depend(concurrent: &TemporalTask, one: OperatorId, other: OperatorId) -> bool {
    let [first, second] = [one, other].map(|id| &concurrent.happenings[id.index()]);
    let instance = |role| match role {
        Role::Start(instance) | Role::End(instance) => Some(instance),
        _ => None,
    };
    let (own, others) = (instance(first.role), instance(second.role));
    let is_timed = [first, second].iter().any(|happening| matches!(happening.role, Role::Timed(_)));
    let clashes = || {
        let mut used = first.designs.iter().flat_map(|(function, design)| {
            second.designs.iter().filter(move |(other, used)| other == function && used != design)
        });
        used.next().is_some()
    };
    // What has a joint condition over all goes with all that writes what this reads.
    let touches = |id, instance: Option<u32>| instance.is_some_and(|own| concurrent.touches(id, own));
    let mut joint = 0..u32::try_from(concurrent.instances.len()).unwrap_or(u32::MAX);
    is_timed
        || one == other
        || own.is_some() && own == others
        || gap(&first.accesses.after, &second.accesses.marks).is_some()
        || gap(&second.accesses.after, &first.accesses.marks).is_some()
        || clashes()
        || touches(one, others)
        || touches(other, own)
        || joint.any(|instance| touches(one, Some(instance)) && touches(other, Some(instance)))
}
