//! Lazy greedy best-first search over sequences of happenings, for a first plan and then better ones.
//!
//! Temporal states are evaluated when they are expanded, and queued by the value of their predecessor.
//! Preferred happenings have a second queue \[1\]. A third queue prefers successors of states with a fact
//! that is new among the states with the same number of unsatisfied goals \[2\]. In sequential mode, each end
//! directly follows its start in the sequence, apart from timed initial literals. Far fewer states remain,
//! and most tasks still have a plan; actions can still overlap in time. Among states with the same facts,
//! running actions and numbers (without those of the metric), only the first one is expanded, or in mode
//! `Sooner` each one with a smaller lower bound on the makespan. This search may therefore miss plans, and
//! proves nothing.
//!
//! \[1\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010.
//! \[2\] N. Lipovetzky, H. Geffner: Best-first width search, AAAI 2017.
//! \[3\] R. Valenzano, N. Sturtevant, J. Schaeffer, F. Xie: A comparison of knowledge-based GBFS enhancements
//! and knowledge-free exploration, ICAPS 2014.

use std::collections::hash_map::Entry;
use std::hash::{Hash, Hasher};

use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use search::bounds::Bounds;
use search::random::Random;
use search::satisfice::alternating_open_list::AlternatingOpenList;
use search::search::SearchStatistics;
use smallvec::SmallVec;
use task::limits::Limits;
use task::number::{Int, dense, words};
use task::task::OperatorId;

use crate::concurrent::makespan_heuristic::Estimate;

use crate::concurrent::relaxed_plan_heuristic::{HeuristicValue, RelaxedPlanHeuristic};
use crate::concurrent::search::Sequence;
use crate::concurrent::store::{PackedNode, Packing};
use crate::concurrent::successors::{DeadEnd, Expansion, TemporalState};
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Approximate memory use of a node without its packed state, in bytes: the node, its queue entries and its
/// hash.
const OVERHEAD: usize = size_of::<Node>() + 80;

/// Noise raises a heuristic value by up to `(NOISE_LEVELS - 1) / NOISE_DIVISOR` of the value.
const NOISE_LEVELS: usize = 8;
const NOISE_DIVISOR: u64 = 20;

/// A happening, and whether it takes place at the same time as the previous one.
type Link = (OperatorId, bool);
pub(super) type Links = SmallVec<[Link; 2]>;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// The end of an action directly follows its start in the sequence; only timed initial literals can come
    /// in between. Actions that do not interfere may still overlap in time.
    Sequential,
    Overlapping,
    /// Like `Overlapping`, with two additions. A state reached again with a smaller lower bound on
    /// the makespan is expanded again. Successors in which an over-all condition is violated until a
    /// simultaneous happening repairs it are kept.
    Sooner,
}

impl Mode {
    /// Returns the successor by a happening, after applying timed initial literals that must precede it.
    /// Appends all applied happenings to `links`. Returns `None` if the happening is not applicable or,
    /// except in mode `Sooner`, leaves an over-all condition violated.
    pub(super) fn apply_happening<T: TimeNumber>(
        self,
        concurrent: &TemporalTask<T>,
        expansion: &Expansion<'_, T>,
        situation: &TemporalState<T>,
        operator: OperatorId,
        links: &mut Links,
    ) -> Option<TemporalState<T>> {
        let mut waited: Option<TemporalState<T>> = None;
        loop {
            let before = waited.as_ref().unwrap_or(situation);
            let together = before.clocks.unsettled();
            match expansion.after(before, operator, false) {
                // Another simultaneous happening rarely repairs a violated over-all condition.
                Ok((situation, _)) if situation.clocks.unsettled() && self != Self::Sooner => return None,
                Ok((situation, compressed)) => {
                    links.push((operator, together));
                    if compressed {
                        links.push((concurrent.end_of(operator), false));
                    }
                    return Some(situation);
                }
                Err(DeadEnd::TooLate) => {
                    let (_, event) = expansion.next_event(&before.clocks)?;
                    let next = expansion.step(before, event).ok()?;
                    links.push((event, together));
                    waited = Some(next);
                }
                Err(DeadEnd::Impossible | DeadEnd::Unfit) => return None,
            }
        }
    }
}

struct Node {
    packed: PackedNode,
    parent: u32,
    links: Links,
}

/// Queue key: whether the state has no novel fact (always `false` in the first two queues), heuristic
/// value, and lower bound on the makespan. Smaller keys come first.
type Value<T> = (bool, u64, T);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Found,
    /// The open list is empty or the memory share is used up.
    Exhausted,
    Stopped,
}

pub(super) struct Greedy<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    expansion: &'a Expansion<'a, T>,
    estimate: &'a Estimate<T>,
    bounds: Option<&'a Bounds>,
    guidance: RelaxedPlanHeuristic<'a>,
    packing: Packing<'a, T>,
    nodes: Vec<Node>,
    latest: Option<(u32, TemporalState<T>)>,
    /// Lower bound on the makespan of each visited state, by a hash of the state: that of the first
    /// visit or, in mode `Sooner`, the least one.
    seen: FxHashMap<u64, T>,
    bytes: usize,
    /// Three queues: all happenings and preferred happenings by heuristic value, and all happenings
    /// with successors of novel states first.
    open: AlternatingOpenList<Value<T>>,
    /// Facts that held in some visited state, by the number of unsatisfied goals in that state.
    known: Vec<FxHashSet<(u32, u32)>>,
    pub(super) mode: Mode,
    noise: Option<Random>,
    nearest: u64,
    pub(super) figures: SearchStatistics,
}

/// Hash of a search state. A hash collision only loses a state, which is harmless because this
/// search proves nothing.
fn hash_of(key: &[u32]) -> u64 {
    let mut hasher = FxHasher::default();
    key.hash(&mut hasher);
    hasher.finish()
}

impl<'a, T: TimeNumber> Greedy<'a, T> {
    pub(super) fn new(
        concurrent: &'a TemporalTask<T>,
        expansion: &'a Expansion<'a, T>,
        estimate: &'a Estimate<T>,
        bounds: Option<&'a Bounds>,
        guidance: RelaxedPlanHeuristic<'a>,
        mode: Mode,
    ) -> Self {
        let (nodes, seen) = (Vec::new(), FxHashMap::default());
        let (packing, latest) = (Packing::new(concurrent), None);
        let open = AlternatingOpenList::new([false, true, false]);
        let bytes = 0;
        Self {
            bytes,
            concurrent,
            expansion,
            estimate,
            bounds,
            guidance,
            packing,
            nodes,
            latest,
            seen,
            open,
            known: Vec::new(),
            mode,
            noise: None,
            nearest: u64::MAX,
            figures: SearchStatistics::default(),
        }
    }

    /// Makes the search different from an earlier one: heuristic values grow by random amounts \[3\].
    /// No noise if `seed` is 0.
    #[must_use]
    pub(super) fn with_noise(self, seed: u64) -> Self {
        Self { noise: (seed > 0).then_some(Random(seed)), ..self }
    }

    /// Searches for a plan that is better than the incumbent. Generates at most `work` successors.
    #[expect(clippy::arithmetic_side_effects, reason = "counted down from what was given")]
    pub(super) fn run(
        &mut self,
        incumbent: &mut Option<Sequence<T>>,
        limits: &Limits,
        mut work: usize,
    ) -> Outcome {
        if self.nodes.is_empty() {
            let root = self.expansion.root();
            if let Some(outcome) = self.take_up(&root, 0, Links::new(), incumbent) {
                return outcome;
            }
        }
        let mut pulse = limits.pulse();
        loop {
            if work == 0 || pulse.beat().is_err() {
                return Outcome::Stopped;
            }
            // This search may use a quarter of the memory limit.
            if self.bytes.saturating_add(self.open.size().saturating_mul(8)) > limits.room() / 4 {
                return Outcome::Exhausted;
            }
            let Some((parent, operator)) = self.open.pop() else { return Outcome::Exhausted };
            let Some((situation, links)) = self.follow(parent, OperatorId(operator)) else { continue };
            work -= 1;
            if let Some(outcome) = self.take_up(&situation, parent, links, incumbent) {
                return outcome;
            }
        }
    }

    /// Returns the successor of a node by a happening or, in sequential mode, by a start and its
    /// end, and the list of applied happenings. Timed initial literals that must precede a
    /// happening are applied first. Returns `None` if a happening is not applicable.
    fn follow(&mut self, parent: u32, operator: OperatorId) -> Option<(TemporalState<T>, Links)> {
        let cached = self.latest.take().filter(|(id, _)| *id == parent);
        let unpack = || (parent, self.packing.unpack(&self.nodes[parent as usize].packed));
        let (_, situation) = self.latest.insert(cached.unwrap_or_else(unpack));
        let mut links = Links::new();
        let next =
            self.mode.apply_happening(self.concurrent, self.expansion, situation, operator, &mut links)?;
        let is_over = next.clocks.opens().is_empty();
        if self.mode != Mode::Sequential || is_over {
            return Some((next, links));
        }
        let end = self.concurrent.end_of(operator);
        let next = self.mode.apply_happening(self.concurrent, self.expansion, &next, end, &mut links)?;
        Some((next, links))
    }

    /// Evaluates a state and queues its successors, unless the state is a duplicate or cannot lead to a
    /// better plan. Returns `Found` if the state completes a plan that is better than the incumbent; the plan
    /// then becomes the incumbent.
    fn take_up(
        &mut self,
        situation: &TemporalState<T>,
        parent: u32,
        links: Links,
        incumbent: &mut Option<Sequence<T>>,
    ) -> Option<Outcome> {
        let value = self.value(situation)?;
        if incumbent.as_ref().is_some_and(|incumbent| value >= incumbent.value)
            || !self.is_new(situation, value.1)
        {
            return None;
        }
        let outcome = if self.expansion.is_goal(situation) {
            let better = self
                .sequence(situation, parent, &links)
                .filter(|sequence| incumbent.as_ref().is_none_or(|best| sequence.value < best.value));
            let outcome = better.is_some().then_some(Outcome::Found);
            *incumbent = better.or_else(|| incumbent.take());
            outcome
        } else {
            None
        };
        // If the task has preferences, a longer plan may violate fewer of them, so the goal state is expanded
        // as well.
        if outcome.is_some() && self.concurrent.violations.is_empty() {
            return outcome;
        }
        self.figures.evaluated = self.figures.evaluated.saturating_add(1);
        let Some(HeuristicValue { left, preferred }) = self.guidance.guide(situation) else { return outcome };
        if left < self.nearest {
            self.nearest = left;
            self.open.boost();
        }
        let is_old = !self.has_news(situation);
        let id = dense(self.nodes.len());
        let candidates: Vec<u32> =
            self.expansion.candidates(situation).iter().map(|operator| operator.0).collect();
        let counts = SearchStatistics { expanded: 1, generated: candidates.len() as u64, evaluated: 0 };
        self.figures = self.figures.plus(counts);
        let is_preferred = |operator: &u32| preferred.binary_search(&OperatorId(*operator)).is_ok();
        let preferred: Vec<u32> = candidates.iter().copied().filter(is_preferred).collect();
        let noise = self.noise.as_mut().map_or(0, |noise| noise.below(NOISE_LEVELS) as u64);
        let key = left.saturating_add(left.saturating_mul(noise) / NOISE_DIVISOR);
        let values = [false, false, is_old].map(|is_old| (is_old, key, value.1));
        self.open.push(id, values, &candidates, &preferred);
        let packed = self.packing.pack(situation);
        self.bytes = self.bytes.saturating_add(OVERHEAD).saturating_add(packed.bytes());
        self.nodes.push(Node { packed, parent, links });
        outcome
    }

    /// Lower bounds on the metric and the makespan of plans through this state. Returns `None` if
    /// the state is a dead end or the metric overflows.
    fn value(&self, situation: &TemporalState<T>) -> Option<(T, T)> {
        let TemporalState { state, clocks, cost } = situation;
        let makespan = self.estimate.left(state, clocks)?.makespan;
        let costs = self.bounds.map_or(Some(0), |bounds| bounds.estimate(state))?;
        Some((self.concurrent.measure.total(makespan, cost.checked_add(costs)?)?, makespan))
    }

    /// Returns `true` if a fact holds that held in no earlier state with the same number of
    /// unsatisfied goals, and records the facts of this state.
    fn has_news(&mut self, TemporalState { state, .. }: &TemporalState<T>) -> bool {
        let task = &self.concurrent.task;
        let to_go = task.goal.facts.iter().filter(|fact| !fact.holds(&state.values)).count();
        if self.known.len() <= to_go {
            self.known.resize(to_go.saturating_add(1), FxHashSet::default());
        }
        let facts_so_far = &mut self.known[to_go];
        let facts = (0..).zip(&state.values[..task.basic]);
        facts.fold(false, |news, (variable, value)| facts_so_far.insert((variable, *value)) || news)
    }

    /// Returns `true` if the state is not a duplicate or, in mode `Sooner`, has a smaller makespan
    /// bound than all earlier duplicates. Records the bound.
    fn is_new(&mut self, situation: &TemporalState<T>, makespan: T) -> bool {
        let TemporalState { state, clocks, .. } = situation;
        let mut key = state.values[..self.concurrent.task.basic].to_vec();
        // Numbers of the metric are ignored, because conditions rarely read them.
        let measured_terms = &self.concurrent.task.objective.rest;
        let is_read = |variable: u32| measured_terms.iter().all(|(number, _)| number.0 != variable);
        let numbers = (0..).zip(&state.numbers).filter(|(variable, _)| is_read(*variable));
        key.extend(numbers.flat_map(|(_, number)| words(*number)));
        key.extend(clocks.opens().iter().map(|open| open.instance));
        key.push(u32::from(clocks.unsettled()));
        match self.seen.entry(hash_of(&key)) {
            Entry::Vacant(entry) => {
                entry.insert(makespan);
                true
            }
            Entry::Occupied(mut entry) => {
                let is_sooner = self.mode == Mode::Sooner && makespan < *entry.get();
                if is_sooner {
                    entry.insert(makespan);
                }
                is_sooner
            }
        }
    }

    fn sequence(&self, situation: &TemporalState<T>, parent: u32, links: &Links) -> Option<Sequence<T>> {
        let value = self.concurrent.value(situation)?;
        let mut sequence_links: Vec<Link> = links.iter().rev().copied().collect();
        let mut at = parent as usize;
        while let Some(node) = self.nodes.get(at) {
            sequence_links.extend(node.links.iter().rev());
            if node.links.is_empty() {
                break;
            }
            at = node.parent as usize;
        }
        sequence_links.reverse();
        let (happenings, together) = sequence_links.into_iter().unzip();
        self.concurrent.judge(Sequence { value, happenings, together }, situation.cost)
    }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};

    use super::*;
    use crate::concurrent::ground_concurrent;
    use crate::concurrent::happening::Role;
    use crate::concurrent::temporal_relaxation::TemporalRelaxation;
    use task::ground::GroundConfig;

    /// Robots on a grid of two rows exchange places. A robot can enter a cell only after the
    /// previous robot has left it.
    const DOMAIN: &str = "(define (domain crowd) (:requirements :strips :typing :durative-actions)
        (:types robot cell) (:predicates (at ?r - robot ?c - cell) (clear ?c - cell) (next ?a ?b - cell))
        (:durative-action move :parameters (?r - robot ?from ?to - cell) :duration (= ?duration 1)
          :condition (and (at start (at ?r ?from)) (at start (clear ?to)) (over all (next ?from ?to)))
          :effect (and (at start (not (at ?r ?from))) (at start (not (clear ?to)))
            (at end (at ?r ?to)) (at end (clear ?from)))))";
    const PROBLEM: &str = "(define (problem swap) (:domain crowd) (:objects r1 r2 r3 - robot a1 a2 a3 b1 b2 b3 - cell)
        (:init (at r1 a1) (at r2 a2) (at r3 a3) (clear b1) (clear b2) (clear b3)
          (next a1 a2) (next a2 a1) (next a2 a3) (next a3 a2) (next b1 b2) (next b2 b1) (next b2 b3) (next b3 b2)
          (next a1 b1) (next b1 a1) (next a2 b2) (next b2 a2) (next a3 b3) (next b3 a3))
        (:goal (and (at r1 a3) (at r2 a2) (at r3 a1))))";

    fn first(mode: Mode) -> (Sequence, Vec<Role>) {
        let (domain, problem, _) =
            read(&Source::new("domain", DOMAIN), &Source::new("problem", PROBLEM)).expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let concurrent = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect("a task")
            .narrow();
        let (estimate, expansion) =
            (Estimate::new(&concurrent, &Limits::none()), Expansion::new(&concurrent));
        let relaxed = TemporalRelaxation::new(&concurrent);
        let mut greedy =
            Greedy::new(&concurrent, &expansion, &estimate, None, RelaxedPlanHeuristic::new(&relaxed), mode);
        let mut incumbent = None;
        let outcome = greedy.run(&mut incumbent, &Limits::none(), 100_000);
        assert_eq!(outcome, Outcome::Found);
        let sequence = incumbent.expect("a plan");
        let roles = sequence.happenings.iter().map(|id| concurrent.happenings[id.index()].role);
        (sequence.clone(), roles.collect())
    }

    #[test]
    fn sequential_mode_overlaps_actions_in_time() {
        let (sequence, roles) = first(Mode::Sequential);
        assert!(roles.len() > 6, "{roles:?}");
        for pair in roles.chunks(2) {
            let [Role::Start(start), Role::End(end)] = pair else { panic!("{roles:?}") };
            assert_eq!(start, end);
        }
        let actions = Int::try_from(roles.len() / 2).expect("few");
        assert!(sequence.value.1 < actions * 1000, "{:?}", sequence.value);
    }

    #[test]
    fn modes_with_separate_starts_and_ends_reach_the_goal() {
        for mode in [Mode::Overlapping, Mode::Sooner] {
            let (sequence, roles) = first(mode);
            assert_eq!(sequence.together.len(), roles.len());
        }
    }
}
