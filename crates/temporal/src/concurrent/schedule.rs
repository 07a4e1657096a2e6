//! Computation of the earliest times of a sequence of happenings.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;
use task::task::OperatorId;

use crate::concurrent::happening::Role;
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Constraint between two nodes: index of the first, index of the second, and least time from the
/// first to the second. The happenings are the first nodes, in the order of the sequence. Each other
/// node is the latest access of one kind up to a happening: constraints for all pairs of accesses
/// would be quadratic in number.
type Bound<T> = (usize, usize, T);

/// Computes the earliest times of a sequence by the Bellman-Ford algorithm. `together` marks the
/// happenings that take place at the same time as the previous one. `durations` are as returned by
/// [`durations`].
#[expect(
    clippy::arithmetic_side_effects,
    reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
)]
pub(super) fn schedule<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    sequence: &[OperatorId],
    together: &[bool],
    durations: &[T],
) -> Vec<T> {
    let mut times = vec![T::ZERO; sequence.len()];
    let bounds = bounds(concurrent, sequence, (together, durations), &mut times);
    // No chain of bounds is longer than the number of nodes.
    for _ in 0..=times.len() {
        let mut has_changed = false;
        for (from, to, by) in &bounds {
            let least = times[*from] + *by;
            if times[*to] < least {
                times[*to] = least;
                has_changed = true;
            }
        }
        if !has_changed {
            break;
        }
    }
    times.truncate(sequence.len());
    times
}

/// Durations of the actions that start in a sequence, by position; 0 for happenings other than
/// starts.
pub(super) fn durations<T: TimeNumber>(concurrent: &TemporalTask<T>, sequence: &[OperatorId]) -> Vec<T> {
    let mut state = concurrent.task.initial.clone();
    let mut durations = Vec::with_capacity(sequence.len());
    for id in sequence {
        let after = concurrent.task.successor(&concurrent.task.operators[id.index()], &state, &[]);
        state = after.expect("invariant: the search has been there");
        durations.push(match concurrent.happenings[id.index()].role {
            Role::Start(instance) => {
                let duration = concurrent.duration(&concurrent.instances[instance as usize], &state);
                duration.expect("invariant: the search has started it")
            }
            _ => T::ZERO,
        });
    }
    durations
}

/// Returns the constraints of a sequence. Sets the entry of each happening in `times` to a lower bound:
/// the time of the last timed initial literal up to and including the happening, or 0. Appends an entry
/// for each other node (see [`Bound`]).
#[expect(
    clippy::arithmetic_side_effects,
    reason = "the first happening is together with none; durations have at most `TIME_BITS` bits"
)]
fn bounds<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    sequence: &[OperatorId],
    (together, durations): (&[bool], &[T]),
    times: &mut Vec<T>,
) -> Vec<Bound<T>> {
    let mut bounds = Vec::new();
    // Node of the latest access of each kind up to this happening.
    let mut latest: FxHashMap<Key, usize> = FxHashMap::default();
    // Runs of an instance end in the order of their starts.
    let mut open_starts: FxHashMap<u32, VecDeque<usize>> = FxHashMap::default();
    // Running actions whose over-all condition several simultaneous happenings can maintain
    // together (`Instance::joint`), each with the last happening that wrote an atom or number of
    // this condition (at first, the start of the action).
    let mut joint: Vec<(u32, usize)> = Vec::new();
    let mut floor = T::ZERO;
    for (index, id) in sequence.iter().enumerate() {
        let happening = &concurrent.happenings[id.index()];
        if let Role::Timed(event) = happening.role {
            floor = concurrent.events[event as usize].0;
        }
        times[index] = floor;
        let after = happening.accesses.after.iter();
        bounds.extend(after.filter_map(|(key, by)| Some((*latest.get(key)?, index, *by))));
        if together[index] {
            bounds.extend([(index - 1, index, T::ZERO), (index, index - 1, T::ZERO)]);
        }
        if let Role::End(instance) = happening.role {
            let first = joint.iter().position(|(candidate, _)| *candidate == instance);
            first.map(|first| joint.remove(first));
        }
        for (instance, last) in &mut joint {
            if concurrent.touches(*id, *instance) {
                bounds.push((*last, index, T::ZERO));
                *last = index;
            }
        }
        match happening.role {
            Role::Start(instance) => {
                open_starts.entry(instance).or_default().push_back(index);
                if !concurrent.instances[instance as usize].joint.is_empty() {
                    joint.push((instance, index));
                }
            }
            Role::End(instance) => {
                if let Some(start) = open_starts.get_mut(&instance).and_then(VecDeque::pop_front) {
                    let duration = durations[start];
                    bounds.extend([(start, index, duration), (index, start, -duration)]);
                }
            }
            _ => {}
        }
        for key in &happening.accesses.marks {
            let node = times.len();
            times.push(floor);
            bounds.push((index, node, T::ZERO));
            bounds.extend(latest.insert(*key, node).map(|previous| (previous, node, T::ZERO)));
        }
    }
    bounds
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};
    use task::ground::GroundConfig;
    use task::number::Int;

    use super::*;
    use crate::concurrent::ground_concurrent;

    /// Each step reads and increases one number, so the steps are the separation apart.
    #[test]
    fn the_number_of_constraints_is_linear_in_the_number_of_steps() {
        let domain = "(define (domain d) (:requirements :durative-actions :fluents) (:functions (count))
            (:action step :parameters () :precondition (<= (count) 500) :effect (increase (count) 1)))";
        let problem = "(define (problem p) (:domain d) (:init (= (count) 0)) (:goal (>= (count) 400)))";
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect("a task")
            .narrow();
        let is_step = |id: &OperatorId| task.happenings[id.index()].role == Role::Whole;
        let step = OperatorId::all(task.happenings.len()).find(is_step).expect("an action");
        let (sequence, together, durations) = ([step; 400], [false; 400], [0; 400]);
        let expected: Vec<Int> = (0..400).map(|position: Int| position * task.separation).collect();
        assert_eq!(schedule(&task, &sequence, &together, &durations), expected);
        let count = bounds(&task, &sequence, (&together[..], &durations[..]), &mut vec![0; 400]).len();
        assert!(count < 10 * 400, "{count} constraints");
    }
}
