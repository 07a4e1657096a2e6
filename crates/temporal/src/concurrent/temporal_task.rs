//! The ground temporal task: happenings, pairs of starts and ends, interference constraints, and
//! integer times.

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
use crate::concurrent::time_number::{TimeNumber, Wide};
use crate::concurrent::unit::{StaticDurations, Unit};

/// A ground task whose actions can overlap in time.
#[derive(Debug, Clone)]
pub struct ConcurrentTask(pub(super) Width);

impl ConcurrentTask {
    /// Returns the numeric fluents of the metric that the search does not minimise, in PDDL, e.g. because
    /// actions change them by amounts that depend on the state.
    pub fn not_minimised(&self) -> Vec<String> {
        let (task, is_whole) = match &self.0 {
            Width::Narrow(narrow) => (&narrow.task, narrow.is_whole),
            Width::Wide(wide) => (&wide.task, wide.is_whole),
        };
        let fluents = task.objective.rest.iter().filter(|_| !is_whole);
        fluents.map(|(fluent, _)| task.number_names[fluent.index()].clone()).collect()
    }
}

#[cfg(test)]
impl ConcurrentTask {
    pub(super) fn narrow(self) -> TemporalTask {
        let Width::Narrow(task) = self.0 else { panic!("the times are wide") };
        *task
    }
}

#[derive(Debug, Clone)]
pub(super) enum Width {
    Narrow(Box<TemporalTask>),
    /// Task with the wide number type for times. It is used if the narrow type is too small for the
    /// common unit of all times, a constant time or the metric. The threshold `narrow_times` can also
    /// demand it.
    Wide(Box<TemporalTask<Wide>>),
}

#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "the properties are independent")]
pub(super) struct TemporalTask<T: TimeNumber = Int> {
    pub(super) task: Task,
    pub(super) happenings: Vec<Happening<T>>,
    pub(super) instances: Vec<Instance<T>>,
    /// Time (in internal units) and operator of each group of simultaneous timed initial literals, ascending.
    pub(super) events: Vec<(T, OperatorId)>,
    /// By key of an access kind (such as deleting a certain atom): its guard variable, if any. Every happening
    /// that must wait for such an access, except timed initial literals, requires a value of the guard.
    /// Accesses that are at least the separation before the latest change of their guard delay no later happening.
    pub(super) guards: Vec<Option<u32>>,
    pub(super) measure: Measure<T>,
    /// Per preference that can be violated: operators of which at least one is applicable in the
    /// final state if the preference is violated. These operators never occur in a plan.
    pub(super) violations: Vec<Vec<OperatorId>>,
    /// Deadlines of trajectory constraints, which are checked on complete plans.
    pub(super) deadlines: Vec<Deadline<T>>,
    /// `true` if the search covers every plan with all its possible times, so that exhausting the search is a
    /// proof.
    pub(super) is_exact: bool,
    /// `true` if the heuristic lower bounds hold for every plan, and no plan exists if the relaxed task is
    /// unreachable. Otherwise, 0 is the only lower bound.
    pub(super) is_bounded: bool,
    /// `true` if the search for chosen durations must continue after a happening that violates an over-all
    /// condition of a running action, because simultaneous happenings may remove the violation.
    pub(super) repairs_over_all: bool,
    /// `false` if the search minimises only a part of the metric.
    pub(super) is_whole: bool,
    /// Least distance between interfering happenings, in internal time units.
    pub(super) separation: T,
    /// Number of internal time units per PDDL time unit.
    pub(super) unit: T,
    /// Variant of the task in which chosen durations are minimal. `None` if no duration is chosen
    /// or the variant is not supported.
    pub(super) shortest: Option<Box<Self>>,
    /// PDDL files of the task, if sequential plans may be searched as well.
    pub(super) kept: Option<SourceTask>,
}

/// Least distance between interfering happenings, and weight of the makespan, in PDDL units.
pub(super) struct Scale<'s> {
    pub(super) separation: &'s Rational,
    /// Increase of the minimised metric per PDDL time unit of the makespan.
    pub(super) time_weight: &'s Rational,
}

/// Builds the temporal task from a ground split task. Uses the narrow number type for times if it suffices
/// for all constant times and the metric, unless the thresholds demand the wide type.
pub(super) fn compile(
    mut task: Task,
    split: &Split,
    reached: &RelaxedReachability,
    scale: &Scale<'_>,
    limits: &Limits,
) -> Result<ConcurrentTask, Errors> {
    let to_errors = |error| vec![error];
    // The builder's methods check the limits of the `Context` that they are given, so the builder itself has none.
    let unlimited = Limits::none();
    let mut builder = Builder::new(split, reached, &unlimited);
    builder.collect(Context::new(&task, limits))?;
    let has_cases = builder.pair(&mut task);
    let fixed = builder.static_durations(Context::new(&task, limits)).map_err(to_errors)?;
    let unit = Unit::new::<Wide>(&task, split, scale.separation, &fixed).map_err(to_errors)?;
    let is_narrow = (unit.0.bits() <= limits.thresholds().narrow_times || split.chosen.contains(&true))
        && unit.fits::<Int>(split, scale.separation, &fixed)
        && Measure::<Int>::new(&task.objective, scale.time_weight, &unit.0).is_ok();
    let parts = Parts { task, split, builder, fixed, unit, has_cases };
    Ok(if is_narrow {
        ConcurrentTask(Width::Narrow(Box::new(parts.build(scale, limits)?)))
    } else {
        ConcurrentTask(Width::Wide(Box::new(parts.build(scale, limits)?)))
    })
}

/// Parts of a temporal task that do not depend on the type that represents times.
struct Parts<'p> {
    task: Task,
    split: &'p Split,
    builder: Builder<'p>,
    fixed: StaticDurations,
    unit: Unit,
    /// `true` if an action has several starts or ends.
    has_cases: bool,
}

impl Parts<'_> {
    fn build<T: TimeNumber>(self, scale: &Scale<'_>, limits: &Limits) -> Result<TemporalTask<T>, Errors> {
        let Self { mut task, split, builder, fixed, unit, has_cases } = self;
        let to_errors = |error| vec![error];
        let separation: T = unit.of(scale.separation).map_err(to_errors)?;
        let measure = Measure::new(&task.objective, scale.time_weight, &unit.0).map_err(to_errors)?;
        let context = Context::new(&task, limits);
        let mut roles = vec![Role::Never; task.operators.len()];
        let instances = builder.instances(context, (&unit, separation), &fixed, &mut roles);
        let mut instances = instances.map_err(to_errors)?;
        let contradictory = builder.contradictory(context).map_err(to_errors)?;
        let mut events: Vec<(T, OperatorId)> = Vec::new();
        for ((operator, role), id) in task.operators.iter().zip(&mut roles).zip((0..).map(OperatorId)) {
            match split.origins[operator.schema as usize].half {
                Half::Whole if !contradictory.contains(&id) => *role = Role::Whole,
                Half::Timed(event) => {
                    events.push((unit.of(&split.events[event].time).map_err(to_errors)?, id));
                }
                _ => {}
            }
        }
        events.sort_unstable();
        for (event, (_, id)) in (0..).zip(&events) {
            roles[id.index()] = Role::Timed(event);
        }
        let has_chosen_durations = instances.iter().any(|instance| instance.is_chosen);
        let is_whole =
            task.objective.rest.is_empty() || has_chosen_durations && only_grows(&task, &instances);
        let is_exact = split.is_exact && !builder.assumes_conflicts() && !has_cases && is_whole;
        let happenings = builder.happenings(context, separation, &roles, &mut instances);
        let (mut happenings, keys) = happenings.map_err(to_errors)?;
        let violations = violations(&task);
        drop_links(&mut task, &instances);
        bound_self_overlap(&task, &happenings, &mut instances, separation, limits)?;
        let keys = keep_runs_apart(&mut task, &instances, &mut happenings, keys);
        let compressible = compression_safe_actions(&task, &happenings, &instances, limits);
        for (instance, compressible) in instances.iter_mut().zip(compressible?) {
            instance.compressible = compressible;
        }
        let mut concurrent = TemporalTask {
            task,
            happenings,
            instances,
            events,
            guards: vec![None; keys],
            measure,
            violations,
            deadlines: Vec::new(),
            is_exact,
            is_bounded: split.is_bounded,
            repairs_over_all: false,
            is_whole,
            separation,
            unit: unit.of(&Rational::from_integer(1)).map_err(to_errors)?,
            shortest: None,
            kept: None,
        };
        concurrent.guard(limits)?;
        Ok(concurrent)
    }
}

/// Makes each run of an instance wait for the end of its previous run, unless simultaneous runs can
/// be useful. For instances with useful simultaneous runs, removes the end effects that clear the
/// running fact and the duration, because only the end of the last run clears them. Returns the new
/// number of access keys.
fn keep_runs_apart<T: TimeNumber>(
    task: &mut Task,
    instances: &[Instance<T>],
    happenings: &mut [Happening<T>],
    keys: usize,
) -> usize {
    let mut next = keys;
    for instance in instances {
        if let Some(under_way) = instance.under_way {
            let end = &mut task.operators[instance.end.index()];
            end.effects.retain(|effect| effect.variable != under_way.variable);
            let is_timer = |number| instance.timer.is_some_and(|(timer, _)| timer == number);
            end.numeric_effects.retain(|effect| !is_timer(effect.variable));
        } else {
            let ended = dense(next);
            next = next.saturating_add(1);
            happenings[instance.start.index()].accesses.after.push((ended, T::ZERO));
            happenings[instance.end.index()].accesses.marks.push(ended);
        }
    }
    next
}

impl<T: TimeNumber> TemporalTask<T> {
    pub(super) fn chooses_durations(&self) -> bool {
        self.instances.iter().any(|instance| instance.is_chosen)
    }

    /// Computes `guards` and, for each happening, the variables that it sets (`sets`). Only guards
    /// and variables of the goal's facts are kept in `sets`.
    fn guard(&mut self, limits: &Limits) -> Result<(), Interrupted> {
        let mut common: Vec<Option<Vec<u32>>> = vec![None; self.guards.len()];
        // A run may end before another run that precedes it in the sequence has begun. So variables
        // that mark an instance as running are no guards.
        let under_way: FxHashSet<VariableId> =
            self.instances.iter().filter_map(|instance| Some(instance.under_way?.variable)).collect();
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
            // Timed initial literals cannot be delayed: they bound the times of earlier accesses
            // and need no guard.
            let waits_for = match happening.role {
                Role::Timed(_) => &[][..],
                _ => &happening.accesses.after,
            };
            for (key, _) in waits_for {
                match &mut common[*key as usize] {
                    Some(variables) => variables.retain(|variable| facts.contains(variable)),
                    unset => *unset = Some(facts.clone()),
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
        let relevant: FxHashSet<u32> = self.guards.iter().flatten().copied().chain(goals).collect();
        for happening in &mut self.happenings {
            happening.sets.retain(|variable| relevant.contains(variable));
        }
        Ok(())
    }

    /// Duration of an instance that has just started, in internal time units, read from the state
    /// after the start. Returns `None` if the duration is shorter than the separation or overflows.
    pub(super) fn duration(&self, instance: &Instance<T>, after: &State) -> Option<T> {
        let Some((timer, factor)) = instance.timer else { return Some(instance.duration) };
        let duration = T::from(after.numbers[timer.index()]).checked_mul(factor)?;
        (duration >= self.separation && duration.bits() <= T::TIME_BITS).then_some(duration)
    }

    /// Clears the running fact and the duration of an instance in `state`, after the last of its
    /// simultaneous runs has ended. Does nothing if the instance has no simultaneous runs, because the
    /// end itself then clears both.
    pub(super) fn end_last_run(&self, instance: u32, state: &mut State) {
        if let Some(fact) = self.instances[instance as usize].under_way {
            // The variable of the running fact has two values, so this is the other one. No derived
            // variable depends on it, so none is computed again.
            state.values[fact.variable.index()] = u32::from(fact.value == 0);
            if let Some((timer, _)) = self.instances[instance as usize].timer {
                state.numbers[timer.index()] = 0;
            }
        }
    }

    pub(super) fn holds_over_all(&self, instance: u32, state: &State) -> bool {
        let condition = self.instances[instance as usize].over_all;
        let condition = condition.map(|id| &self.task.operators[id.index()].condition);
        condition.is_none_or(|condition| {
            condition.holds_propositionally(&state.values)
                && condition.holds_numerically(&state.numbers, &[], &[])
        })
    }

    /// Returns the end operator of the action that `operator` starts. Any operator other than a
    /// start is returned unchanged.
    pub(super) fn end_of(&self, operator: OperatorId) -> OperatorId {
        match self.happenings[operator.index()].role {
            Role::Start(instance) => self.instances[instance as usize].end,
            _ => operator,
        }
    }

    /// Returns `true` if the happening `operator` writes an atom or number that the over-all condition of
    /// `instance` reads. Always `false` unless several simultaneous happenings can maintain this condition
    /// jointly (see [`Instance::joint`]).
    pub(super) fn touches(&self, operator: OperatorId, instance: u32) -> bool {
        let joint = &self.instances[instance as usize].joint;
        let writes = &self.happenings[operator.index()].writes;
        !joint.is_empty() && writes.iter().any(|id| joint.binary_search(id).is_ok())
    }
}

fn violations(task: &Task) -> Vec<Vec<OperatorId>> {
    let mut violations: BTreeMap<u32, Vec<OperatorId>> = BTreeMap::new();
    for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
        if is_violation(&task.schema_names[operator.schema as usize]) {
            violations.entry(operator.schema).or_default().push(id);
        }
    }
    violations.into_values().collect()
}
