//! First plans of a temporal task from sequential plans, moved to the earliest times. Such a plan
//! exists only if the task does not require concurrency; its cost is an upper bound on the optimal
//! cost.
//!
//! The sequential task, in which actions do not overlap, is easier to search. It has fewer variables
//! with more values, and the search can exploit landmarks, mutexes and interchangeable objects. Each
//! sequential plan is executed in the temporal task at the earliest times, so that its actions
//! overlap where possible. Every returned plan is therefore a plan of the temporal task. A
//! sequential plan that cannot be executed is dropped, for example if a timed initial literal would
//! interrupt an action.

use std::cell::OnceCell;

use rustc_hash::FxHashMap;
use search::bounds::Bounds;
use search::satisfice::{Satisficer, StepResult};
use search::search::{InterleavedSearch, SearchOutcome, SearchProblem, SearchTask};
use task::compile::is_hidden;
use task::context::Context;
use task::ground::{GroundConfig, ground};
use task::limits::Limits;
use task::number::Int;
use task::plan::arguments;
use task::plan::ground::GroundPlan;
use task::plan::solution::Statistics;
use task::task::{Operator, OperatorId, Task};

use crate::concurrent::greedy::{Links, Mode};
use crate::concurrent::happening::Role;
use crate::concurrent::search::Sequence;
use crate::concurrent::successors::{Expansion, TemporalState};
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Upper limit on the operators of the temporal task; for larger tasks, no sequential task is
/// grounded.
const OPERATORS: usize = 100_000;

/// Work units of the satisficing search per evaluation of the greedy temporal search.
const WORK: u64 = 1_000;
/// States that the optimal search may store per evaluation of the greedy temporal search.
const STATES: usize = 4;
const MOST_STATES: usize = 1_000_000;

type Call = (String, Vec<String>);

pub(super) struct SequentialTask {
    task: Task,
    /// For each action (name and arguments): the operators of the temporal task that start the action or
    /// execute it as a whole.
    begins: FxHashMap<Call, Vec<OperatorId>>,
    /// Heuristics and successor data of the optimal search, computed on first use. The inner `None` means
    /// that the computation failed.
    parts: OnceCell<Option<(Bounds, SearchTask)>>,
}

impl SequentialTask {
    /// Grounds the sequential task. Returns `None` if the source files are not kept, grounding
    /// fails or finds the goal unreachable, or the task is too large.
    pub(super) fn new<T: TimeNumber>(concurrent: &TemporalTask<T>, limits: &Limits) -> Option<Self> {
        let split = &concurrent.task;
        if split.operators.len() > OPERATORS {
            return None;
        }
        let (domain, problem, config) = concurrent.kept.as_ref()?.files();
        let config = GroundConfig { limits: limits.clone(), ..config.clone() };
        let task = ground(domain, problem, &config).ok().filter(|task| task.unreachable.is_none())?;
        let mut begins: FxHashMap<Call, Vec<OperatorId>> = FxHashMap::default();
        for ((operator, happening), id) in
            split.operators.iter().zip(&concurrent.happenings).zip((0..).map(OperatorId))
        {
            if matches!(happening.role, Role::Start(_) | Role::Whole) {
                begins.entry(call(split, operator, &[])).or_default().push(id);
            }
        }
        Some(Self { task, begins, parts: OnceCell::new() })
    }

    fn space<'w>(&'w self, limits: &'w Limits) -> Option<SearchProblem<'w, Int, Bounds>> {
        let context = Context::new(&self.task, limits);
        let make = || Bounds::new(context).ok().zip(SearchTask::new(context).ok().flatten());
        let (bounds, prepared) = self.parts.get_or_init(make).as_ref()?;
        Some(SearchProblem { context, bounds, prepared, orbits: None })
    }

    /// Translates a sequential plan into happenings of the temporal task at their earliest times. Returns
    /// `None` if they cannot be executed, miss the goal, violate a hard deadline, or the metric overflows.
    fn sequence<T: TimeNumber>(
        &self,
        concurrent: &TemporalTask<T>,
        expansion: &Expansion<'_, T>,
        plan: &GroundPlan,
    ) -> Option<Sequence<T>> {
        let mut situation = expansion.root();
        let mut links = Links::new();
        for step in &plan.steps {
            let operator = &self.task.operators[step.operator.index()];
            if let Some(until) = operator.wait {
                let until = concurrent.unit.checked_mul(until.into())?;
                while let Some((time, event)) = expansion.next_event(&situation.clocks)
                    && time.checked_mul(self.task.time_scale.into())? <= until
                {
                    let together = situation.clocks.unsettled();
                    situation = expansion.step(&situation, event).ok()?;
                    links.push((event, together));
                }
                continue;
            }
            // Hidden actions record violated preferences. The temporal task derives the violations
            // from the final state instead.
            if is_hidden(&self.task.schema_names[operator.schema as usize]) {
                continue;
            }
            let begins = self.begins.get(&call(&self.task, operator, &step.choice))?;
            let mut executed = begins.iter().filter_map(|begin| {
                let mut action_links = Links::new();
                let mut happen = |situation: &TemporalState<T>, id| {
                    Mode::Sequential.apply_happening(concurrent, expansion, situation, id, &mut action_links)
                };
                let mut next = happen(&situation, *begin)?;
                if !next.clocks.opens().is_empty() {
                    next = happen(&next, concurrent.end_of(*begin))?;
                }
                Some((next, action_links))
            });
            let (next, action_links) = executed.next()?;
            links.extend(action_links);
            situation = next;
        }
        let value = concurrent.value(&situation).filter(|_| expansion.is_goal(&situation))?;
        let (happenings, together) = links.into_iter().unzip();
        concurrent.judge(Sequence { value, happenings, together }, situation.cost)
    }
}

fn call(task: &Task, operator: &Operator, choice: &[u32]) -> Call {
    (task.schema_names[operator.schema as usize].clone(), arguments(task, operator, choice))
}

/// Runs a satisficing and an optimal search for sequential plans. The optimal search may be faster if the
/// heuristics of the satisficing search are misleading.
pub(super) struct SequentialPlanner<'w> {
    whole: &'w SequentialTask,
    limits: &'w Limits,
    satisficer: Option<Satisficer<'w, Int>>,
    exact: Exact<'w>,
    stored: usize,
    known: Option<Int>,
}

enum Exact<'w> {
    /// The search begins later, because computing the heuristics may take longer than finding a plan.
    Later,
    Begun(Box<InterleavedSearch<'w, Int, Bounds>>),
    Over,
}

impl<'w> SequentialPlanner<'w> {
    pub(super) fn new(whole: &'w SequentialTask, limits: &'w Limits) -> Self {
        let satisficer = Satisficer::new(Context::new(&whole.task, limits)).ok().flatten();
        Self { whole, limits, satisficer, exact: Exact::Later, stored: 0, known: None }
    }

    /// Resumes both searches for the work that corresponds to `situations` evaluations of the greedy temporal
    /// search. Returns the better of their plans, or `None` if neither search yields a plan that is executable
    /// in the temporal task.
    pub(super) fn run<T: TimeNumber>(
        &mut self,
        of: (&TemporalTask<T>, &Expansion<'_, T>),
        situations: usize,
        statistics: &mut Statistics,
    ) -> Option<Sequence<T>> {
        let satisficing_plan = self.estimate(of, situations, statistics);
        if self.limits.reached() {
            return satisficing_plan;
        }
        let best = self.search(of, situations, statistics);
        satisficing_plan.into_iter().chain(best).min_by_key(|sequence| sequence.value)
    }

    fn estimate<T: TimeNumber>(
        &mut self,
        (concurrent, expansion): (&TemporalTask<T>, &Expansion<'_, T>),
        situations: usize,
        statistics: &mut Statistics,
    ) -> Option<Sequence<T>> {
        let satisficer = self.satisficer.as_mut()?;
        let before = satisficer.figures;
        let advance = satisficer.run(self.known.as_ref(), WORK.saturating_mul(situations as u64));
        satisficer.figures.add_to(before, statistics);
        match advance {
            Ok(StepResult::Plan(plan)) => {
                self.known = Some(plan.cost);
                self.whole.sequence(concurrent, expansion, &plan)
            }
            Ok(StepResult::Paused) => None,
            Ok(StepResult::Unsolvable | StepResult::Ended) | Err(_) => {
                self.satisficer = None;
                None
            }
        }
    }

    fn search<T: TimeNumber>(
        &mut self,
        (concurrent, expansion): (&TemporalTask<T>, &Expansion<'_, T>),
        situations: usize,
        statistics: &mut Statistics,
    ) -> Option<Sequence<T>> {
        if matches!(self.exact, Exact::Later) {
            let space = self.whole.space(self.limits);
            let begin =
                |space| Exact::Begun(Box::new(InterleavedSearch::new(space, &self.whole.task.initial)));
            self.exact = space.map_or(Exact::Over, begin);
        }
        let Exact::Begun(exact) = &mut self.exact else { return None };
        self.stored = self.stored.saturating_add(STATES.saturating_mul(situations));
        let before = exact.figures();
        let outcome = exact.run(self.stored, &mut |_, _| {});
        exact.figures().add_to(before, statistics);
        let plan = match &outcome {
            Some(SearchOutcome::Optimal(plan)) => Some(plan.clone()),
            Some(SearchOutcome::Unknown(plan)) => plan.clone(),
            Some(SearchOutcome::None) => None,
            None => exact.best_plan(),
        };
        if outcome.is_some() || self.stored > MOST_STATES {
            self.exact = Exact::Over;
        }
        plan.and_then(|plan| self.whole.sequence(concurrent, expansion, &plan))
    }
}
