//! The temporal task: happenings with paired starts and ends, their constraints, and integer times.

use std::collections::BTreeMap;

use rustc_hash::FxHashSet;
use task::compile::is_violation;
use task::context::Context;
use task::error::Errors;
use task::ground::vocabulary::reached::RelaxedReachability;
use task::lifted::Rational;
use task::limits::{Interrupted, Limits};
use task::number::{Int, dense};
use task::task::{OperatorId, State, Task, VariableId};

use crate::concurrent::builder::Builder;
use crate::concurrent::compression_safe::compression_safe_actions;
use crate::concurrent::deadline::Deadline;
use crate::concurrent::envelope_facts::drop_links;
use crate::concurrent::happening::{Happening, Instance, Role};
use crate::concurrent::measure::Measure;
use crate::concurrent::monotone_metric::only_grows;
use crate::concurrent::self_overlap::bound_self_overlap;
use crate::concurrent::source_task::SourceTask;
use crate::concurrent::split::{Half, Split};
use crate::concurrent::unit::{LIMIT as TIME_LIMIT, Unit};

/// A ground task whose actions can overlap.
#[derive(Debug, Clone)]
pub struct TemporalTask {
    pub(crate) task: Task,
    /// By operator.
    pub(super) happenings: Vec<Happening>,
    pub(super) instances: Vec<Instance>,
    /// The timed initial literals by their time.
    pub(super) events: Vec<(Int, OperatorId)>,
    /// For each kind of access a variable whose current value everything reads that waits for such accesses.
    pub(super) guards: Vec<Option<u32>>,
    pub(super) measure: Measure,
    /// For each preference that may be violated in the end: the operators of which one can be applied then. They never happen.
    pub(super) violations: Vec<Vec<OperatorId>>,
    /// What plans have to keep in time, or should.
    pub(super) deadlines: Vec<Deadline>,
    /// Whether every plan is among those that the search goes through, with the times that it can have.
    pub(super) is_exact: bool,
    /// Whether no plan is better than all that the search goes through. If not, only what costs and times are by themselves is known: not below 0.
    pub(super) is_bounded: bool,
    /// Whether what plans are compared by is the whole metric.
    pub(super) is_whole: bool,
    /// How far apart interfering happenings are, in the task's time unit.
    pub(super) separation: Int,
    /// The same with durations that are as short as they may be, where the planner chooses some, and if that can be planned with.
    pub(super) shortest: Option<Box<Self>>,
    /// The files, if actions one after another may be planned as well.
    pub(super) kept: Option<SourceTask>,
}

/// Makes happenings of a split ground task.
pub(super) fn compile(
    mut task: Task,
    split: &Split,
    reached: &RelaxedReachability,
    separation: &Rational,
    time_weight: Rational,
    limits: &Limits,
) -> Result<TemporalTask, Errors> {
    let one = |error| vec![error];
    // Operators are watched as they are collected, each as a whole.
    let unlimited = Limits::none();
    let mut builder = Builder::new(split, reached, &unlimited);
    let context = Context::new(&task, limits);
    builder.collect(context)?;
    let has_cases = builder.pair(&mut task);
    let context = Context::new(&task, limits);
    let divisors = builder.divisors(context).map_err(one)?;
    let unit = Unit::new(&task, split, separation, &divisors).map_err(one)?;
    let separation = unit.of(separation).map_err(one)?;
    builder.separation = separation;
    let measure = Measure::new(&task.objective, time_weight, unit.0).map_err(one)?;
    let mut roles = vec![Role::Never; task.operators.len()];
    let mut instances = builder.instances(context, unit, &divisors, &mut roles).map_err(one)?;
    let contradictory = builder.contradictory(context).map_err(one)?;
    for ((operator, role), id) in task.operators.iter().zip(&mut roles).zip((0..).map(OperatorId)) {
        match split.origins[operator.schema as usize].half {
            Half::Whole if !contradictory.contains(&id) => *role = Role::Whole,
            Half::Timed(event) => *role = Role::Timed(unit.of(&split.events[event].time).map_err(one)?),
            _ => {}
        }
    }
    let chooses = instances.iter().any(|own| own.is_chosen);
    let is_whole = task.objective.rest.is_empty() || chooses && only_grows(&task, &instances);
    let is_exact = split.is_exact && !builder.assumes_conflicts() && !has_cases && is_whole;
    let (mut happenings, keys) = builder.happenings(context, &roles, &mut instances).map_err(one)?;
    let mut events: Vec<(Int, OperatorId)> = Vec::new();
    for (role, id) in roles.iter().zip((0..).map(OperatorId)) {
        events.extend(if let Role::Timed(time) = role { Some((*time, id)) } else { None });
    }
    events.sort_unstable();
    let violations = violations(&task);
    task.time_scale = unit.0;
    drop_links(&mut task, &instances);
    bound_self_overlap(&task, &happenings, &mut instances, separation, limits)?;
    let keys = keep_runs_apart(&mut task, &instances, &mut happenings, keys);
    let compressible = compression_safe_actions(&task, &happenings, &instances, limits);
    for (own, compressible) in instances.iter_mut().zip(compressible?) {
        own.compressible = compressible;
    }
    let guards = vec![None; keys];
    let mut concurrent = TemporalTask {
        task,
        happenings,
        instances,
        events,
        guards,
        measure,
        violations,
        deadlines: Vec::new(),
        is_exact,
        is_bounded: true,
        is_whole,
        separation,
        shortest: None,
        kept: None,
    };
    concurrent.guard(limits)?;
    Ok(concurrent)
}

/// Lets the next run of an instance wait for the end of the one before, unless several runs at a time can make a difference: of those no end says
/// that the instance is not under way any more, and no end clears how long it takes. Returns how many kinds of access there are then.
fn keep_runs_apart(
    task: &mut Task,
    instances: &[Instance],
    happenings: &mut [Happening],
    keys: usize,
) -> usize {
    let mut next = keys;
    for own in instances {
        if let Some(under_way) = own.under_way {
            let end = &mut task.operators[own.end.index()];
            end.effects.retain(|effect| effect.variable != under_way.variable);
            let is_timer = |number| own.timer.is_some_and(|(timer, _)| timer == number);
            end.numeric_effects.retain(|effect| !is_timer(effect.variable));
        } else {
            let ended = dense(next);
            next = next.saturating_add(1);
            happenings[own.start.index()].accesses.after.push((ended, 0));
            happenings[own.end.index()].accesses.marks.push(ended);
        }
    }
    next
}

impl TemporalTask {
    /// Finds the variables that tell of accesses that they are past, and what happenings set.
    fn guard(&mut self, limits: &Limits) -> Result<(), Interrupted> {
        let mut common: Vec<Option<Vec<u32>>> = vec![None; self.guards.len()];
        // An end may come before another run has begun that came before it in the sequence.
        let under_way: FxHashSet<VariableId> =
            self.instances.iter().filter_map(|own| Some(own.under_way?.variable)).collect();
        for pair in limits.watch(self.task.operators.iter().zip(&mut self.happenings)) {
            let (operator, happening) = pair?;
            let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
            happening.sets = operator.effects.iter().chain(conditional).map(|fact| fact.variable.0).collect();
            happening.sets.sort_unstable();
            happening.sets.dedup();
            let facts = operator.condition.facts.iter().map(|fact| fact.variable);
            let facts: Vec<u32> = facts
                .filter(|variable| variable.index() < self.task.basic && !under_way.contains(variable))
                .map(|variable| variable.0)
                .collect();
            // What happens by itself is put off by nothing: it bounds what was before, the change of a guard like any access.
            let heeded = match happening.role {
                Role::Timed(_) => &[][..],
                _ => &happening.accesses.after,
            };
            for (key, _) in heeded {
                match &mut common[*key as usize] {
                    Some(known) => known.retain(|variable| facts.contains(variable)),
                    none => *none = Some(facts.clone()),
                }
            }
        }
        let set: FxHashSet<u32> =
            self.happenings.iter().flat_map(|happening| happening.sets.iter().copied()).collect();
        for (guard, common) in self.guards.iter_mut().zip(common) {
            let size = |variable: &u32| self.task.variables[*variable as usize].values.len();
            *guard = common.into_iter().flatten().filter(|variable| set.contains(variable)).max_by_key(size);
        }
        let goals = self.task.goal.facts.iter().map(|fact| fact.variable.0);
        let heeded: FxHashSet<u32> = self.guards.iter().flatten().copied().chain(goals).collect();
        for happening in &mut self.happenings {
            happening.sets.retain(|variable| heeded.contains(variable));
        }
        Ok(())
    }

    /// How long an instance takes that has just started; none if it takes less than the separation, or a time that does not fit.
    pub(super) fn duration(&self, instance: &Instance, after: &State) -> Option<Int> {
        let Some((timer, factor)) = instance.timer else { return Some(instance.duration) };
        let duration = after.numbers[timer.index()].checked_mul(factor)?;
        (self.separation..TIME_LIMIT).contains(&duration).then_some(duration)
    }

    /// An instance is not under way any more in a state after the end of its last run.
    pub(super) fn end_last_run(&self, instance: u32, state: &mut State) {
        if let Some(fact) = self.instances[instance as usize].under_way {
            // Of two values, the other one. What is derived does not depend on it.
            state.values[fact.variable.index()] = u32::from(fact.value == 0);
            if let Some((timer, _)) = self.instances[instance as usize].timer {
                state.numbers[timer.index()] = 0;
            }
        }
    }

    /// Whether what must hold over all of an instance holds in a state.
    pub(super) fn holds_over_all(&self, instance: u32, state: &State) -> bool {
        let condition = self.instances[instance as usize].over_all;
        let condition = condition.map(|id| &self.task.operators[id.index()].condition);
        condition.is_none_or(|condition| {
            condition.holds_propositionally(&state.values)
                && condition.holds_numerically(&state.numbers, &[], &[])
        })
    }

    /// The end of the action that a happening starts; a happening that starts none is its own end.
    pub(super) fn end_of(&self, operator: OperatorId) -> OperatorId {
        match self.happenings[operator.index()].role {
            Role::Start(instance) => self.instances[instance as usize].end,
            _ => operator,
        }
    }

    /// Whether a happening writes what the joint condition over all of an instance reads.
    pub(super) fn touches(&self, operator: OperatorId, instance: u32) -> bool {
        let joint = &self.instances[instance as usize].joint;
        let writes = &self.happenings[operator.index()].writes;
        !joint.is_empty() && writes.iter().any(|id| joint.binary_search(id).is_ok())
    }
}

/// The operators of preferences that are violated, by preference.
fn violations(task: &Task) -> Vec<Vec<OperatorId>> {
    let mut violations: BTreeMap<u32, Vec<OperatorId>> = BTreeMap::new();
    for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
        if is_violation(&task.schema_names[operator.schema as usize]) {
            violations.entry(operator.schema).or_default().push(id);
        }
    }
    violations.into_values().collect()
}
