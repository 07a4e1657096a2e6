//! Lower bound on the makespan: necessary work divided among resources that do one action at a time.
//!
//! A variable is an *exclusive resource* if its values can be divided into *free* and *busy* ones as follows.
//! The start of an *occupying* action changes the variable from a free value to a busy one. Only the ends of
//! occupying actions can make a busy variable free: every other happening that sets a free value requires a
//! free value before. The runs of occupying actions are therefore disjoint intervals. The start of a run
//! reads what the end of the previous run has written, so both are at least the separation apart.
//!
//! Given `m` resources, a plan with makespan `T` contains occupying actions of total duration at most `T` per
//! resource, or `T + s` if each duration is increased by the separation `s`. The sum of the increased
//! durations over all actions of the plan, once for each resource that an action occupies, is therefore at
//! most `m (T + s)`. The LM-cut value `W` \[1\] is a lower bound on this sum if the start of each action
//! costs its increased duration, times the number of resources that it occupies. So `T ≥ W / m - s`. If
//! separations are not certain to be required, `s` is 0.
//!
//! \[1\] M. Helmert, C. Domshlak: Landmarks, critical paths and abstractions: what's the difference anyway?,
//! ICAPS 2009.

use std::collections::BTreeMap;

use num_bigint::BigInt;
use num_integer::Integer;
use rustc_hash::FxHashSet;
use search::bounds::landmark_cut_bound;
use task::limits::Limits;
use task::task::quantity::Quantity;
use task::task::{Fact, Operator, OperatorId, Task, VariableId};

use crate::concurrent::happening::Role;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

const MAX_GROUPS: usize = 6;
/// Costs are divided by a power of two, so that their maximum has at most this number of bits. LM-cut does
/// not support much higher costs.
const COST_BITS: u64 = 39;

#[derive(Clone)]
struct Resource {
    instances: Vec<u32>,
}

/// Lower bound on the makespan of every plan, in internal time units. 0 if no better bound is found, e.g.
/// without an exclusive resource.
pub(super) fn makespan_bound<T: TimeNumber>(concurrent: &TemporalTask<T>, limits: &Limits) -> T {
    let mut by_schemas: BTreeMap<Vec<u32>, Vec<Resource>> = BTreeMap::new();
    let mut by_size: BTreeMap<(Vec<u32>, usize), Vec<Resource>> = BTreeMap::new();
    // A resource for a single instance bounds no more than the duration of this instance.
    for resource in resources(concurrent, limits).into_iter().filter(|resource| resource.instances.len() > 1)
    {
        let schema = |instance: &u32| {
            let start = concurrent.instances[*instance as usize].start;
            concurrent.task.operators[start.index()].schema
        };
        // Interchangeable objects are resources for the same action schemas. Other variables that
        // these actions change usually have another number of instances.
        let mut schemas: Vec<u32> = resource.instances.iter().map(schema).collect();
        schemas.sort_unstable();
        schemas.dedup();
        by_size.entry((schemas.clone(), resource.instances.len())).or_default().push(resource.clone());
        by_schemas.entry(schemas).or_default().push(resource);
    }
    let mut groups: Vec<Vec<Resource>> = by_size.into_values().collect();
    // Groups by schemas are added only if the division by size splits them.
    groups.extend(by_schemas.into_values().filter(|group| {
        let sizes: FxHashSet<usize> = group.iter().map(|resource| resource.instances.len()).collect();
        sizes.len() > 1
    }));
    // Groups with many instances per resource usually have the highest bounds.
    groups.sort_by_key(|group| {
        let instances: usize = group.iter().map(|resource| resource.instances.len()).sum();
        std::cmp::Reverse(instances.checked_div(group.len()))
    });
    groups.truncate(MAX_GROUPS);
    if groups.is_empty() {
        return T::ZERO;
    }
    let mut task = without_costs(concurrent);
    let mut best = T::ZERO;
    for group in groups {
        if limits.reached() {
            break;
        }
        best = best.max(bound(concurrent, &mut task, &group, limits));
    }
    best
}

/// Lower bound on the makespan from one group of resources. Sets the costs of `task` to the work of the
/// group.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "durations and the separation have at most `TIME_BITS` bits, and an instance occupies fewer than 2^32 variables"
)]
fn bound<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    task: &mut Task,
    group: &[Resource],
    limits: &Limits,
) -> T {
    // In an inexact task, separations may be required that the semantics of plans does not require.
    let separation = if concurrent.is_exact { concurrent.separation } else { T::ZERO };
    let mut costs = vec![T::ZERO; concurrent.instances.len()];
    for instance in group.iter().flat_map(|resource| &resource.instances) {
        costs[*instance as usize] += concurrent.instances[*instance as usize].duration + separation;
    }
    let max_cost = costs.iter().copied().max().unwrap_or(T::ZERO);
    let shift = max_cost.bits().saturating_sub(COST_BITS);
    for (instance, cost) in concurrent.instances.iter().zip(costs) {
        // Rounding down keeps the costs lower bounds.
        task.operators[instance.start.index()].cost.constant = cost.shifted_down(shift);
    }
    let Some(work) = landmark_cut_bound(task, limits) else { return T::ZERO };
    let work = BigInt::from(work) << shift;
    // The makespan is an integer, so the quotient is rounded up.
    let quotient = T::from_big(&Integer::div_ceil(&work, &BigInt::from(group.len())));
    quotient.map_or(T::ZERO, |quotient| (quotient - separation).max(T::ZERO))
}

/// Copy of the split task without costs, in which ends also require the facts and clauses (not the
/// comparisons) of the over-all conditions: these hold at some time before the end, because the
/// duration is positive.
fn without_costs<T: TimeNumber>(concurrent: &TemporalTask<T>) -> Task {
    let mut task = concurrent.task.clone();
    for operator in &mut task.operators {
        operator.cost = Quantity { constant: 0, tables: Vec::new() };
    }
    for instance in &concurrent.instances {
        let Some(over_all) = instance.over_all else { continue };
        let condition = task.operators[over_all.index()].condition.clone();
        let end = &mut task.operators[instance.end.index()].condition;
        end.facts.extend(condition.facts);
        end.clauses.extend(condition.clauses);
    }
    task
}

/// Returns the exclusive resources that are found before a limit is reached.
fn resources<T: TimeNumber>(concurrent: &TemporalTask<T>, limits: &Limits) -> Vec<Resource> {
    let task = &concurrent.task;
    let mut setters: Vec<Vec<OperatorId>> = vec![Vec::new(); task.basic];
    for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
        if concurrent.happenings[id.index()].role == Role::Never {
            continue;
        }
        let mut variables: Vec<VariableId> = effects(operator).map(|fact| fact.variable).collect();
        variables.sort_unstable();
        variables.dedup();
        for variable in variables.into_iter().filter(|variable| variable.index() < task.basic) {
            setters[variable.index()].push(id);
        }
    }
    let ids = VariableId::all(task.basic);
    let resource = |(variable, setters): (_, Vec<_>)| resource(concurrent, variable, &setters, limits);
    ids.zip(setters).filter_map(resource).collect()
}

fn effects(operator: &Operator) -> impl Iterator<Item = Fact> {
    let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
    operator.effects.iter().chain(conditional).copied()
}

fn set_values(operator: &Operator, variable: VariableId) -> impl Iterator<Item = u32> {
    effects(operator).filter(move |fact| fact.variable == variable).map(|fact| fact.value)
}

fn value_in(facts: &[Fact], variable: VariableId) -> Option<u32> {
    facts.iter().find(|fact| fact.variable == variable).map(|fact| fact.value)
}

/// Returns a variable as a resource; `setters` are the operators that set the variable. Returns `None` if no
/// set of busy values that satisfies the definition is found, or if a limit is reached.
fn resource<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    variable: VariableId,
    setters: &[OperatorId],
    limits: &Limits,
) -> Option<Resource> {
    let operators = &concurrent.task.operators;
    let role = |id: OperatorId| concurrent.happenings[id.index()].role;
    let required = |id: OperatorId| value_in(&operators[id.index()].condition.facts, variable);
    // Value before and after the start of an action that certainly changes the variable.
    let change = |id: OperatorId| {
        let operator = &operators[id.index()];
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let is_certain = conditional.clone().all(|fact| fact.variable != variable);
        let after = value_in(&operator.effects, variable).filter(|_| is_certain)?;
        required(id).filter(|before| *before != after).map(|before| (before, after))
    };
    let is_start = |id: &&OperatorId| matches!(role(**id), Role::Start(_));
    let starts: Vec<OperatorId> = setters.iter().filter(is_start).copied().collect();
    let mut busy: FxHashSet<u32> =
        starts.iter().filter_map(|id| change(*id)).map(|(_, after)| after).collect();
    // Values that an operator may leave without being the end of an occupying action are not busy.
    // Removing them changes which actions occupy the variable, so this is repeated.
    loop {
        let occupies = |id: OperatorId| {
            change(id).is_some_and(|(before, after)| !busy.contains(&before) && busy.contains(&after))
        };
        let is_allowed = |id: OperatorId| {
            let sets_free = set_values(&operators[id.index()], variable).any(|value| !busy.contains(&value));
            !sets_free
                || required(id).is_some_and(|value| !busy.contains(&value))
                || matches!(role(id), Role::End(instance) if occupies(concurrent.instances[instance as usize].start))
        };
        let bad = setters.iter().copied().find(|id| !is_allowed(*id));
        let Some(bad) = bad else {
            let instances = starts.iter().filter(|id| occupies(**id)).filter_map(|id| match role(*id) {
                Role::Start(instance) => Some(instance),
                _ => None,
            });
            let instances: Vec<u32> = instances.collect();
            return (!instances.is_empty()).then_some(Resource { instances });
        };
        match required(bad) {
            Some(value) => busy.remove(&value),
            // The operator may leave any value, so no value is busy.
            None => return None,
        };
        if busy.is_empty() || limits.reached() {
            return None;
        }
    }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};
    use task::ground::GroundConfig;
    use task::number::Int;

    use super::*;
    use crate::concurrent::ground_concurrent;

    /// Lower bound on the makespan in thousandths, with a separation of a thousandth.
    fn bound_of(domain: &str, problem: &str) -> Int {
        let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
        let (domain, problem, _) = read.expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation);
        let concurrent = task.expect("a task").narrow();
        makespan_bound(&concurrent, &Limits::none()) * 1000 / concurrent.unit
    }

    /// Each switch changes a variable of its own, which must not count as a resource of the same kind
    /// as the hand that moves all switches.
    #[test]
    fn one_hand_moves_the_switches_one_after_another() {
        let domain = "(define (domain switches) (:requirements :durative-actions) (:predicates (on ?x) (off ?x) (free))
          (:durative-action switch :parameters (?x) :duration (= ?duration 2)
            :condition (and (at start (free)) (at start (off ?x)))
            :effect (and (at start (not (free))) (at start (not (off ?x))) (at end (on ?x)) (at end (free)))))";
        let problem = |init: &str| {
            format!(
                "(define (problem p) (:domain switches) (:objects a b c d) (:init (free) (off a) (off b) (off c) {init})
                   (:goal (and (on a) (on b) (on c))))"
            )
        };
        assert_eq!(bound_of(domain, &problem("")), 6_002);
        // A literal can free the hand during an action, so it is no exclusive resource.
        assert_eq!(bound_of(domain, &problem("(at 1 (free))")), 0);
    }

    #[test]
    fn robots_share_the_work() {
        let domain = "(define (domain jobs) (:requirements :durative-actions :typing) (:types robot place)
          (:predicates (at ?r - robot ?p - place) (free ?r - robot) (done ?p - place))
          (:durative-action drive :parameters (?r - robot ?a ?b - place) :duration (= ?duration 5)
            :condition (and (at start (at ?r ?a)) (at start (free ?r)))
            :effect (and (at start (not (at ?r ?a))) (at start (not (free ?r))) (at end (at ?r ?b)) (at end (free ?r))))
          (:durative-action work :parameters (?r - robot ?p - place) :duration (= ?duration 40)
            :condition (and (at start (free ?r)) (over all (at ?r ?p)))
            :effect (and (at start (not (free ?r))) (at end (free ?r)) (at end (done ?p)))))";
        let problem = "(define (problem p) (:domain jobs) (:objects r s - robot base a b c d - place)
          (:init (at r base) (free r) (at s base) (free s)) (:goal (and (done a) (done b) (done c) (done d))))";
        // Two jobs of 45 per robot, and three gaps.
        assert_eq!(bound_of(domain, problem), 90_003);
    }
}
