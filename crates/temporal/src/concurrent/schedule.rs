//! Computation of the earliest times of a sequence of happenings.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;
use task::number::Int;
use task::task::OperatorId;

use crate::concurrent::happening::Role;
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::temporal_task::TemporalTask;

/// Constraint between two happenings: position of the first, position of the second, and least time
/// from the first to the second.
type Bound = (usize, usize, Int);

/// Computes the earliest times of a sequence by the Bellman-Ford algorithm. `together` marks the
/// happenings that take place at the same time as the previous one. `durations` are as returned by
/// [`durations`].
#[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
pub(super) fn schedule(
    concurrent: &TemporalTask,
    sequence: &[OperatorId],
    together: &[bool],
    durations: &[Int],
) -> Vec<Int> {
    let mut times = vec![0; sequence.len()];
    let bounds = bounds(concurrent, sequence, (together, durations), &mut times);
    // No chain of bounds is longer than the sequence.
    for _ in 0..=sequence.len() {
        let mut has_changed = false;
        for (from, to, by) in &bounds {
            let least = times[*from] + by;
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
pub(super) fn durations(concurrent: &TemporalTask, sequence: &[OperatorId]) -> Vec<Int> {
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
            _ => 0,
        });
    }
    durations
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "the first happening is together with none; durations are below 2^90"
)]
fn bounds(
    concurrent: &TemporalTask,
    sequence: &[OperatorId],
    (together, durations): (&[bool], &[Int]),
    times: &mut [Int],
) -> Vec<Bound> {
    let mut bounds = Vec::new();
    let mut marked: FxHashMap<Key, Vec<usize>> = FxHashMap::default();
    // Runs of an instance end in the order of their starts.
    let mut open_starts: FxHashMap<u32, VecDeque<usize>> = FxHashMap::default();
    // Running actions with a joint condition over all, each with the last happening that wrote an
    // atom or number in this condition.
    let mut joint: Vec<(u32, usize)> = Vec::new();
    let mut floor = 0;
    for (index, id) in sequence.iter().enumerate() {
        let happening = &concurrent.happenings[id.index()];
        if let Role::Timed(time) = happening.role {
            floor = time;
        }
        times[index] = floor;
        for (key, by) in &happening.accesses.after {
            bounds.extend(marked.get(key).into_iter().flatten().map(|earlier| (*earlier, index, *by)));
        }
        for key in &happening.accesses.marks {
            marked.entry(*key).or_default().push(index);
        }
        if together[index] {
            bounds.extend([(index - 1, index, 0), (index, index - 1, 0)]);
        }
        if let Role::End(instance) = happening.role {
            let first = joint.iter().position(|(candidate, _)| *candidate == instance);
            first.map(|first| joint.remove(first));
        }
        for (instance, last) in &mut joint {
            if concurrent.touches(*id, *instance) {
                bounds.push((*last, index, 0));
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
