//! Compression-safe actions: the end can directly follow the start in a sequence, so that the
//! search applies both in one step.
//!
//! A sequence orders only happenings that interfere. If an end interferes with no happening that can take place
//! while its action runs, it can be moved directly behind its start in the sequence, and times and states
//! remain the same. Coles et al. \[1\] require actions that only add facts at their end. The condition here
//! uses the facts that hold while the action runs, so more actions qualify and no plan is lost.
//!
//! \[1\] A. Coles, M. Fox, K. Halsey, D. Long, A. Smith: Managing concurrency in temporal planning using
//! planner-scheduler interaction, Artificial Intelligence 173, 2009.

use task::limits::{Interrupted, Limits};
use task::task::Task;

use crate::concurrent::action_invariants::{Index, MAX_PAIR_CHECKS};
use crate::concurrent::happening::{Happening, Instance};
use crate::concurrent::time_number::TimeNumber;

/// Returns for each instance whether its end can directly follow its start without loss of
/// completeness. `false` also if the work limit is used up.
pub(super) fn compression_safe_actions<T: TimeNumber>(
    task: &Task,
    happenings: &[Happening<T>],
    instances: &[Instance<T>],
    limits: &Limits,
) -> Result<Vec<bool>, Interrupted> {
    let index = Index::new(task, happenings, instances);
    let mut work_left = MAX_PAIR_CHECKS;
    limits
        .watch(instances)
        .map(|instance| instance.map(|instance_data| index.is_compressible(instance_data, &mut work_left)))
        .collect()
}

impl<T: TimeNumber> Index<'_, T> {
    fn is_compressible(&self, own: &Instance<T>, left: &mut usize) -> bool {
        let end = &self.happenings[own.end.index()];
        if !own.joint.is_empty() || end.writes.iter().any(|id| self.joint.binary_search(id).is_ok()) {
            return false;
        }
        // If runs of this instance can overlap, another run may start or end between the start and the end of
        // this one.
        let alone = own.under_way.is_none();
        let Some(invariant) = self.invariant(own, alone, left) else { return false };
        let waiting = end.accesses.marks.iter().filter_map(|key| self.waiting.get(key));
        let marking = end.accesses.after.iter().filter_map(|(key, _)| self.marking.get(key));
        let interfering = waiting.chain(marking).flatten();
        for other in interfering {
            let Some(work_left) = left.checked_sub(1) else { return false };
            *left = work_left;
            let is_own = alone && [own.start, own.end].contains(other);
            if !is_own && !self.excludes(&invariant, own, *other) {
                return false;
            }
        }
        true
    }
}
