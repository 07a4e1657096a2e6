//! Converts the result of a search to a solution, with the plan in PDDL names.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;
use task::lifted::Rational;
use task::plan::solution::{Proof, Solution, Status};
use task::plan::{Exact, Plan, Step, measured};
use task::task::OperatorId;

use crate::concurrent::happening::Role;
use crate::concurrent::schedule;
use crate::concurrent::search::Sequence;
use crate::concurrent::search_log::Record;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

pub(super) fn ended<T: TimeNumber>(status: Status, proof: Option<Proof>, record: Record<'_, T>) -> Solution {
    Solution {
        status,
        plan: None,
        ground: None,
        lower_bound: None,
        horizon: 0,
        proof,
        unbounded: None,
        statistics: record.end(),
    }
}

/// Converts a sequence of happenings to a plan with PDDL names. The steps are sorted by start time.
pub(super) fn in_names<T: TimeNumber>(concurrent: &TemporalTask<T>, sequence: &Sequence<T>) -> Plan {
    let durations = schedule::durations(concurrent, &sequence.happenings);
    let times = schedule::schedule(concurrent, &sequence.happenings, &sequence.together, &durations);
    let unit = concurrent.unit.to_rational();
    let mut steps: Vec<((T, OperatorId), Step)> = Vec::new();
    let last = concurrent.last_state(&sequence.happenings, &sequence.together);
    let violated: Vec<OperatorId> = last.iter().flat_map(|last| concurrent.violated(last)).collect();
    let happenings = sequence.happenings.iter().chain(&violated).map(|id| (*id, &[][..]));
    let (measured, unassigned_cost) = measured(&concurrent.task, happenings);
    // Runs of an instance end in the order of their starts.
    let mut ends: FxHashMap<OperatorId, VecDeque<_>> = FxHashMap::default();
    for (id, added) in sequence.happenings.iter().zip(&measured) {
        if let Role::End(_) = concurrent.happenings[id.index()].role {
            ends.entry(*id).or_default().push_back(added);
        }
    }
    for (position, ((id, time), duration)) in sequence.happenings.iter().zip(times).zip(durations).enumerate()
    {
        let mut measured_cost = measured[position].clone();
        let end = match concurrent.happenings[id.index()].role {
            Role::Start(instance) => {
                let instance = &concurrent.instances[instance as usize];
                let added = ends.get_mut(&instance.end).and_then(VecDeque::pop_front);
                measured_cost += added.cloned().unwrap_or_default();
                concurrent.task.operators[instance.end.index()].cost.constant
            }
            Role::Whole => 0,
            _ => continue,
        };
        let operator = &concurrent.task.operators[id.index()];
        let cost =
            Rational::from_integer(operator.cost.constant) + &Rational::from_integer(end) + &measured_cost;
        let cost = if concurrent.task.objective.maximize { -cost } else { cost };
        let [start, duration] = [time, duration].map(|time| time.to_rational() / unit.clone());
        steps.push(((time, *id), Step::new(&concurrent.task, operator, &[], (start, duration, cost))));
    }
    steps.sort_by_key(|(place, _)| *place);
    let steps = steps.into_iter().map(|(_, step)| step).collect();
    let objective = &concurrent.task.objective;
    let unassigned_cost =
        Exact::scaled(&if objective.maximize { -unassigned_cost } else { unassigned_cost }, objective.scale);
    let cost = concurrent.measure.metric(&sequence.value.0.to_rational());
    let mut plan = Plan { steps, cost: cost.plus(&unassigned_cost) };
    plan.note_reconfigured();
    plan
}
