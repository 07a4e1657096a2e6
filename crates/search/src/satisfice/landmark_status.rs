//! Landmark status: the landmarks reached on the path to a state, and the number of landmarks that are still
//! required.
//!
//! A landmark is reached when it is true and all its predecessors have been reached before. A reached
//! landmark is required again in two cases \[1\]: it is a goal that is not true, or it is not true and must
//! hold directly before another landmark that is not reached.
//!
//! \[1\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010, section 5.

use task::task::number::TaskNumber;
use task::task::{Fact, State};

use crate::satisfice::delete_relaxation::{Proposition, Relaxation};
use crate::satisfice::landmarks::Landmarks;

pub(super) struct LandmarkStatus {
    landmarks: Landmarks,
    /// For each landmark: the facts among its propositions, and the other propositions.
    facts: Vec<(Vec<Fact>, Vec<Proposition>)>,
    /// For each proposition: `true` if it belongs to an unreached landmark whose predecessors are reached.
    wanted: Vec<bool>,
    marks: Vec<Proposition>,
    holds: Vec<bool>,
}

fn words(count: usize) -> usize {
    count.div_ceil(64)
}

fn bit(words: &[u64], index: u32) -> bool {
    words[(index >> 6) as usize] >> (index & 63) & 1 == 1
}

fn set(words: &mut [u64], index: u32) {
    words[(index >> 6) as usize] |= 1 << (index & 63);
}

impl LandmarkStatus {
    pub(super) fn new<N: TaskNumber>(landmarks: Landmarks, relaxation: &Relaxation<N>) -> Self {
        let count = landmarks.all.len();
        let facts = landmarks.all.iter().map(|landmark| {
            let facts =
                landmark.any_of.iter().filter_map(|proposition| relaxation.fact_of(*proposition)).collect();
            let non_facts = landmark
                .any_of
                .iter()
                .copied()
                .filter(|proposition| relaxation.fact_of(*proposition).is_none());
            (facts, non_facts.collect())
        });
        Self {
            facts: facts.collect(),
            landmarks,
            wanted: vec![false; relaxation.propositions],
            marks: Vec::new(),
            holds: vec![false; count],
        }
    }

    pub(super) fn stride(&self) -> usize {
        words(self.landmarks.all.len())
    }

    pub(super) fn initially<N: TaskNumber>(
        &mut self,
        relaxation: &Relaxation<N>,
        state: &State<N>,
    ) -> Vec<u64> {
        let mut reached = vec![0; self.stride()];
        // A landmark is reached only after its predecessors, so reaching a landmark may enable others.
        for _ in 0..self.landmarks.all.len() {
            let before = reached.clone();
            reached = self.progress(relaxation, &before, state);
            if reached == before {
                break;
            }
        }
        reached
    }

    /// Returns the landmarks that are reached in `state`, if `before` were reached in its
    /// predecessor.
    pub(super) fn progress<N: TaskNumber>(
        &mut self,
        relaxation: &Relaxation<N>,
        before: &[u64],
        state: &State<N>,
    ) -> Vec<u64> {
        let mut reached = before.to_vec();
        let landmarks = self.landmarks.all.iter().zip(&self.facts);
        for ((landmark, (facts, non_facts)), index) in landmarks.zip(0_u32..) {
            let holds = facts.iter().any(|fact| fact.holds(&state.values))
                || non_facts.iter().any(|proposition| relaxation.holds(*proposition, state));
            self.holds[index as usize] = holds;
            if holds && !bit(before, index) && landmark.after.iter().all(|sooner| bit(before, *sooner)) {
                set(&mut reached, index);
            }
        }
        reached
    }

    /// Returns the number of landmarks that are unreached or required again in the state of the
    /// last call of `progress`.
    pub(super) fn remaining(&self, reached: &[u64]) -> u32 {
        let mut count: u32 = 0;
        for (landmark, index) in self.landmarks.all.iter().zip(0_u32..) {
            let again = || {
                !self.holds[index as usize]
                    && (landmark.is_goal || landmark.needed_by.iter().any(|by| !bit(reached, *by)))
            };
            if !bit(reached, index) || again() {
                count = count.saturating_add(1);
            }
        }
        count
    }

    pub(super) fn request_landmark(&mut self, reached: &[u64]) {
        self.request_none();
        for (landmark, index) in self.landmarks.all.iter().zip(0_u32..) {
            if !bit(reached, index) && landmark.after.iter().all(|sooner| bit(reached, *sooner)) {
                for proposition in &landmark.any_of {
                    self.wanted[*proposition as usize] = true;
                    self.marks.push(*proposition);
                }
            }
        }
    }

    pub(super) fn request_none(&mut self) {
        for mark in self.marks.drain(..) {
            self.wanted[mark as usize] = false;
        }
    }

    pub(super) fn is_wanted(&self, proposition: Proposition) -> bool {
        self.wanted[proposition as usize]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.landmarks.all.is_empty()
    }
}
