//! The ground task with all objects available, and its restrictions to sets of available objects.

use search::bounds::Bounds;
use search::search::SearchTask;
use search::search::plan_tiebreak;
use task::context::Context;
use task::lifted::ObjectId;
use task::limits::{Interrupted, Limits};
use task::task::{Argument, Task};

use crate::replan::restrict_designs;
use crate::replan::state_mapping::Layout;

pub(super) struct GroundBase {
    pub(super) task: Task,
    pub(super) layout: Layout,
    /// For each schema: the parameters whose objects must be available, each with the index of an
    /// availability predicate.
    pub(super) requirements: Vec<Vec<(usize, usize)>>,
}

pub(super) struct AvailabilityContext {
    pub(super) task: Task,
    pub(super) bounds: Bounds,
    pub(super) prepared: Option<SearchTask>,
    pub(super) ties: plan_tiebreak::TieBreakContext,
}

impl GroundBase {
    /// Returns the task with only those operators and designs whose required objects are available.
    /// `available` contains the available objects, in ascending order, for each availability
    /// predicate.
    pub(super) fn masked(&self, available: &[Vec<ObjectId>], limits: &Limits) -> Result<Task, Interrupted> {
        let is_allowed = |schema: u32, position: usize, object: ObjectId| {
            let mut predicates_needed =
                self.requirements[schema as usize].iter().filter(|(parameter, _)| *parameter == position);
            predicates_needed.all(|(_, predicate)| available[*predicate].binary_search(&object).is_ok())
        };
        restrict_designs::restrict(&self.task, &is_allowed, limits)
    }

    pub(super) fn restrict(
        &self,
        available: &[Vec<ObjectId>],
        limits: &Limits,
    ) -> Result<AvailabilityContext, Interrupted> {
        let task = self.masked(available, limits)?;
        let context = Context::new(&task, limits);
        let bounds = Bounds::new(context)?;
        let prepared = SearchTask::new(context)?;
        let ties = plan_tiebreak::TieBreakContext::new(context, &bounds)?;
        Ok(AvailabilityContext { task, bounds, prepared, ties })
    }

    /// For each availability predicate: the objects that some operator requires to be available, in
    /// ascending order.
    #[expect(clippy::arithmetic_side_effects, reason = "predicates are held in memory")]
    pub(super) fn possible(&self) -> Vec<Vec<ObjectId>> {
        let count = self.requirements.iter().flatten().map(|(_, predicate)| predicate + 1).max().unwrap_or(0);
        let mut objects_by_predicate = vec![Vec::new(); count];
        for operator in &self.task.operators {
            for (position, predicate) in &self.requirements[operator.schema as usize] {
                match operator.arguments[*position] {
                    Argument::Object(object) => objects_by_predicate[*predicate].push(object),
                    Argument::Slot(slot) => {
                        let slot = &operator.slots[slot as usize];
                        let designs = &self.task.slots[slot.slot.index()].designs;
                        objects_by_predicate[*predicate]
                            .extend(slot.designs.iter().map(|index| designs[*index as usize]));
                    }
                }
            }
        }
        for objects in &mut objects_by_predicate {
            objects.sort_unstable();
            objects.dedup();
        }
        objects_by_predicate
    }
}
