//! Computation of the earliest times of a sequence of happenings.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;
use task::task::OperatorId;

use crate::concurrent::happening::Role;
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Constraint between two happenings: position of the first, position of the second, and least time
/// from the first to the second.
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
    // No chain of bounds is longer than the sequence.
    for _ in 0..=sequence.len() {
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

#[expect(
    clippy::arithmetic_side_effects,
    reason = "the first happening is together with none; durations have at most `TIME_BITS` bits"
)]
fn bounds<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    sequence: &[OperatorId],
    (together, durations): (&[bool], &[T]),
    times: &mut [T],
) -> Vec<Bound<T>> {
    let mut bounds = Vec::new();
    let mut marked: FxHashMap<Key, Vec<usize>> = FxHashMap::default();
    // Runs of an instance end in the order of their starts.
    let mut open_starts: FxHashMap<u32, VecDeque<usize>> = FxHashMap::default();
    // Running actions with a joint over-all condition, each with the last happening that wrote an
    // atom or number in this condition.
    let mut joint: Vec<(u32, usize)> = Vec::new();
    let mut floor = T::ZERO;
    for (index, id) in sequence.iter().enumerate() {
        let happening = &concurrent.happenings[id.index()];
        if let Role::Timed(event) = happening.role {
            floor = concurrent.events[event as usize].0;
        }
        times[index] = floor;
        for (key, by) in &happening.accesses.after {
            bounds.extend(marked.get(key).into_iter().flatten().map(|earlier| (*earlier, index, *by)));
        }
        for key in &happening.accesses.marks {
            marked.entry(*key).or_default().push(index);
        }
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
    }
    bounds
}
