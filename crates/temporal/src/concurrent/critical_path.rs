//! Critical-path heuristic h¹ \[1\]: a lower bound on the makespan.
//!
//! All times are earliest times in the delete relaxation. A happening takes place when the last of its conditions
//! holds, and a proposition holds when the first happening adds it. An end takes place at least the duration after
//! its start. Unless the action is already running, the duration also separates the end from each proposition of the
//! over-all condition. The interference constraints add distances: to earlier happenings of the plan, and from the
//! happening that adds a condition to the one that requires it. A numeric condition holds after the first happening
//! that brings it closer.
//!
//! \[1\] P. Haslum, H. Geffner: Heuristic planning with time and resources, ECP 2001.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::number::{Int, dense};
use task::task::OperatorId;

use crate::concurrent::happening::Role;
use crate::concurrent::rule::Proposition;
use crate::concurrent::simple_temporal_network::{Key, SimpleTemporalNetwork};
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

#[derive(Debug, Clone, Copy)]
struct Reader<T: TimeNumber> {
    rule: u32,
    /// Least time between the happening that adds the proposition and the happening of the rule.
    delay: T,
    /// Instance whose over-all condition has the proposition. `None` if the rule itself requires it.
    over_all_of: Option<u32>,
}

pub(super) struct CriticalPath<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    relaxation: TemporalRelaxation,
    readers: Vec<Vec<Reader<T>>>,
    conditions: Vec<u32>,
    end_rules: Vec<Vec<u32>>,
    // The remaining fields but the last one describe the evaluated state.
    times: Vec<Option<T>>,
    /// For each proposition: `true` if the evaluated state satisfies it.
    holds: Vec<bool>,
    is_settled: Vec<bool>,
    unmet: Vec<u32>,
    /// Earliest time of each rule because of its settled conditions.
    rule_times: Vec<T>,
    /// Earliest end of each instance. `None` unless the instance is running or its start is reached.
    ends: Vec<Option<T>>,
    accesses: Vec<Option<T>>,
    queue: BinaryHeap<Reverse<(T, Proposition)>>,
    /// Number of conditions, effects and interference constraints visited in all evaluations.
    pub(super) work: usize,
}

impl<'a, T: TimeNumber> CriticalPath<'a, T> {
    pub(super) fn new(concurrent: &'a TemporalTask<T>) -> Self {
        let relaxation = TemporalRelaxation::admissible(concurrent);
        let (propositions, rules) = (relaxation.propositions, relaxation.unmet.len());
        let marks = common_marks(concurrent, &relaxation);
        let mut readers: Vec<Vec<Reader<T>>> = vec![Vec::new(); propositions];
        let mut conditions = vec![0_u32; rules];
        let ids = 0..dense(rules);
        let mut end_rules = vec![Vec::new(); concurrent.instances.len()];
        for ((rule, origin), count) in ids.zip(&relaxation.origins).zip(&mut conditions) {
            let happening = origin.map(|id| &concurrent.happenings[id.index()]);
            let after = happening.map_or(&[][..], |happening| &happening.accesses.after);
            let (needs, over_all) = (relaxation.needs.of(rule), relaxation.over_all.of(rule));
            for need in needs {
                let delay = distance(&marks[*need as usize], after);
                readers[*need as usize].push(Reader { rule, delay, over_all_of: None });
            }
            if let Some(Role::End(instance)) = happening.map(|happening| happening.role) {
                let delay = concurrent.instances[instance as usize].duration;
                for need in over_all {
                    readers[*need as usize].push(Reader { rule, delay, over_all_of: Some(instance) });
                }
                end_rules[instance as usize].push(rule);
            }
            *count = dense(needs.len().saturating_add(over_all.len()));
        }
        let keys = concurrent.happenings.iter().flat_map(|happening| {
            let accesses = &happening.accesses;
            accesses.marks.iter().copied().chain(accesses.after.iter().map(|(key, _)| *key))
        });
        let keys = keys.max().map_or(0, |key| (key as usize).saturating_add(1));
        Self {
            concurrent,
            readers,
            conditions,
            end_rules,
            times: vec![None; propositions],
            holds: vec![false; propositions],
            is_settled: vec![false; propositions],
            unmet: vec![0; rules],
            rule_times: vec![T::ZERO; rules],
            ends: vec![None; concurrent.instances.len()],
            accesses: vec![None; keys],
            queue: BinaryHeap::new(),
            work: 0,
            relaxation,
        }
    }

    /// Lower bound on the makespan of plans through a state. Returns `None` if the goal is unreachable.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn makespan(&mut self, situation: &TemporalState<T>) -> Option<T> {
        self.begin(situation);
        let clocks = &situation.clocks;
        for index in 0..self.relaxation.free.len() {
            let rule = self.relaxation.free[index];
            if self.conditions[rule as usize] == 0 {
                self.fire(rule, clocks);
            }
        }
        while let Some(Reverse((time, proposition))) = self.queue.pop() {
            if std::mem::replace(&mut self.is_settled[proposition as usize], true) {
                continue;
            }
            let holds = self.holds[proposition as usize];
            self.work = self.work.saturating_add(self.readers[proposition as usize].len());
            for index in 0..self.readers[proposition as usize].len() {
                let Reader { rule, delay, over_all_of } = self.readers[proposition as usize][index];
                if over_all_of.is_some_and(|instance| clocks.runs(instance) > 0) {
                    continue;
                }
                if !holds {
                    let rule_time = &mut self.rule_times[rule as usize];
                    *rule_time = (*rule_time).max(time + delay);
                }
                let unmet = &mut self.unmet[rule as usize];
                *unmet = unmet.saturating_sub(1);
                if *unmet == 0 {
                    self.fire(rule, clocks);
                }
            }
        }
        let mut makespan = T::ZERO;
        for goal in &self.relaxation.goal {
            let time = self.times[*goal as usize]?;
            if !self.holds[*goal as usize] {
                makespan = makespan.max(time);
            }
        }
        Some(makespan)
    }

    fn begin(&mut self, TemporalState { state, clocks, .. }: &TemporalState<T>) {
        self.times.fill(None);
        self.holds.fill(false);
        self.is_settled.fill(false);
        self.unmet.copy_from_slice(&self.conditions);
        self.rule_times.fill(T::ZERO);
        self.ends.fill(None);
        self.accesses.fill(None);
        self.queue.clear();
        for (key, time) in clocks.accesses() {
            if let Some(access) = self.accesses.get_mut(key as usize) {
                *access = Some(time);
            }
        }
        for open in clocks.opens() {
            self.started(open.instance, clocks.start(open), open.duration);
            // The over-all condition has held since the start. It may already be violated at the time of the end.
            for rule in &self.end_rules[open.instance as usize] {
                let needs = self.relaxation.needs.of(*rule).len();
                self.unmet[*rule as usize] = dense(needs);
            }
        }
        for (variable, value) in state.values.iter().enumerate().take(self.relaxation.first.len()) {
            self.hold(self.relaxation.first[variable].saturating_add(*value));
        }
        for index in 0..self.relaxation.defaults.len() {
            self.hold(self.relaxation.defaults[index]);
        }
        for index in 0..self.relaxation.numeric.len() {
            let numeric = &self.relaxation.numeric[index];
            let proposition = numeric.proposition;
            // A value that overflows may satisfy the condition.
            if numeric.linear.value(&state.numbers, &[], &[]).is_none_or(|value| value >= 0) {
                self.hold(proposition);
            }
        }
    }

    fn hold(&mut self, proposition: Proposition) {
        self.times[proposition as usize] = Some(T::ZERO);
        self.holds[proposition as usize] = true;
        self.queue.push(Reverse((T::ZERO, proposition)));
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn started(&mut self, instance: u32, start: T, duration: T) {
        let end = start + duration;
        let earliest = &mut self.ends[instance as usize];
        *earliest = Some(earliest.map_or(end, |earliest| earliest.min(end)));
    }

    fn fire(&mut self, rule: u32, clocks: &SimpleTemporalNetwork<T>) {
        let mut time = self.rule_times[rule as usize];
        self.work = self.work.saturating_add(self.relaxation.adds.of(rule).len());
        if let Some(id) = self.relaxation.origins[rule as usize] {
            let happening = &self.concurrent.happenings[id.index()];
            self.work = self.work.saturating_add(happening.accesses.after.len());
            time = time.max(clocks.floor()).max(self.past(id));
            match happening.role {
                Role::Start(instance) => {
                    let duration = self.concurrent.instances[instance as usize].duration;
                    self.started(instance, time, duration);
                }
                Role::End(instance) => {
                    let end = self.ends[instance as usize];
                    time = end.map_or(time, |end| time.max(end));
                }
                Role::Timed(event) => {
                    let (at, _) = self.concurrent.events[event as usize];
                    if at <= clocks.floor() {
                        return;
                    }
                    time = time.max(at);
                }
                Role::Whole | Role::Never => {}
            }
        }
        for index in 0..self.relaxation.adds.of(rule).len() {
            self.improve(self.relaxation.adds.of(rule)[index], time);
        }
        for index in 0..self.relaxation.raises[rule as usize].len() {
            let (numeric, _) = self.relaxation.raises[rule as usize][index];
            self.improve(self.relaxation.numeric[numeric as usize].proposition, time);
        }
    }

    fn improve(&mut self, proposition: Proposition, time: T) {
        let current = &mut self.times[proposition as usize];
        if current.is_none_or(|current| time < current) {
            *current = Some(time);
            self.queue.push(Reverse((time, proposition)));
        }
    }

    /// Earliest time at which the interference constraints with past happenings admit an operator.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn past(&self, id: OperatorId) -> T {
        let after = &self.concurrent.happenings[id.index()].accesses.after;
        let times = after.iter().filter_map(|(key, by)| Some(self.accesses[*key as usize]? + *by));
        times.max().unwrap_or(T::ZERO)
    }
}

/// Returns, for each proposition, the access kinds that all happenings adding it have in common,
/// ascending. Empty for propositions of clauses and derived facts, which no happening adds.
fn common_marks<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    relaxation: &TemporalRelaxation,
) -> Vec<Vec<Key>> {
    let mut common: Vec<Option<Vec<Key>>> = vec![None; relaxation.propositions];
    let ids = 0..dense(relaxation.origins.len());
    for (rule, origin) in ids.zip(&relaxation.origins) {
        let marks = origin.map_or(&[][..], |id| &concurrent.happenings[id.index()].accesses.marks);
        let numeric = relaxation.raises[rule as usize].iter();
        let numeric = numeric.map(|(index, _)| &relaxation.numeric[*index as usize].proposition);
        for proposition in relaxation.adds.of(rule).iter().chain(numeric) {
            match &mut common[*proposition as usize] {
                Some(keys) => keys.retain(|key| marks.binary_search(key).is_ok()),
                unknown => *unknown = Some(marks.to_vec()),
            }
        }
    }
    common.into_iter().map(Option::unwrap_or_default).collect()
}

fn distance<T: TimeNumber>(marks: &[Key], after: &[(Key, T)]) -> T {
    let distances = after.iter().filter(|(key, _)| marks.binary_search(key).is_ok()).map(|(_, by)| *by);
    distances.max().unwrap_or(T::ZERO)
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};
    use task::ground::GroundConfig;
    use task::lifted::Rational;

    use super::CriticalPath;
    use crate::concurrent::ground_concurrent;
    use crate::concurrent::successors::Expansion;
    use crate::concurrent::time_number::TimeNumber as _;

    /// Bound for the initial state in PDDL time units, with a separation of 1/1000. `None` if the goal is unreachable.
    fn bound(requirements: &str, init: &str, goal: &str) -> Option<String> {
        let domain = format!(
            "(define (domain d) (:requirements :fluents :adl :durative-actions :timed-initial-literals) {requirements})"
        );
        let problem = format!("(define (problem p) (:domain d) (:init {init}) (:goal {goal}))");
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let concurrent = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect("a task")
            .narrow();
        let makespan = CriticalPath::new(&concurrent).makespan(&Expansion::new(&concurrent).root())?;
        let makespan: Rational = makespan.to_rational() / concurrent.unit.to_rational();
        Some(makespan.to_big().to_string())
    }

    #[test]
    fn numbers_are_read_a_separation_after_they_have_changed() {
        let domain = "(:predicates (g)) (:functions (x))
            (:durative-action a :parameters () :duration (= ?duration 2) :condition () :effect (at end (increase (x) 1)))
            (:durative-action b :parameters () :duration (= ?duration 3) :condition (at start (>= (x) 1)) :effect (at end (g)))";
        assert_eq!(bound(domain, "(= (x) 0)", "(g)").as_deref(), Some("5001/1000"));
        assert_eq!(bound(domain, "(= (x) 1)", "(g)").as_deref(), Some("3"));
    }

    #[test]
    fn over_all_conditions_hold_for_the_whole_duration() {
        let domain = "(:predicates (lit) (ready) (g))
            (:durative-action light :parameters () :duration (= ?duration 2) :condition () :effect (at end (lit)))
            (:durative-action work :parameters () :duration (= ?duration 10) :condition (and (over all (lit)) (at end (ready)))
              :effect (at end (g)))
            (:durative-action prepare :parameters () :duration (= ?duration 20) :condition () :effect (at end (ready)))";
        assert_eq!(bound(domain, "(ready)", "(g)").as_deref(), Some("12"));
        assert_eq!(bound(domain, "(lit) (ready)", "(g)").as_deref(), Some("10"));
        assert_eq!(bound(domain, "", "(g)").as_deref(), Some("20001/1000"));
    }

    #[test]
    fn simultaneous_starts_satisfy_the_over_all_conditions_of_each_other() {
        let domain = "(:predicates (p) (q) (g) (h))
            (:durative-action a :parameters () :duration (= ?duration 5) :condition (over all (q))
              :effect (and (at start (p)) (at end (not (p))) (at end (g))))
            (:durative-action b :parameters () :duration (= ?duration 5) :condition (over all (p))
              :effect (and (at start (q)) (at end (not (q))) (at end (h))))";
        assert_eq!(bound(domain, "", "(and (g) (h))").as_deref(), Some("5"));
    }

    #[test]
    fn timed_literals_hold_from_their_times_on() {
        let domain = "(:predicates (open) (g))
            (:durative-action enter :parameters () :duration (= ?duration 4) :condition (at start (open)) :effect (at end (g)))";
        assert_eq!(bound(domain, "(at 7 (open))", "(g)").as_deref(), Some("11001/1000"));
    }
}
