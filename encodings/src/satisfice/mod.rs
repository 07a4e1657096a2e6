//! A plan soon: relaxed plans and landmarks guide a lazy greedy search, and then weighted A\*, as in LAMA [1].
//!
//! `relaxation` makes nodes of a task without deletes, `explore` a relaxed plan for a state, `landmarks` what every plan passes, and
//! `status` how far a state has come with these. `search` goes by them through `open` lists, over states in a `store`.
//!
//! Nothing that is found here rests on an estimate: a plan is executed by whoever takes it, and only a search that has been
//! everywhere without one says that there is none.
//!
//! [1] S. Richter, M. Westphal: The LAMA planner: guiding cost-based anytime planning with landmarks, JAIR 39, 2010.

mod explore;
mod landmarks;
mod lists;
mod open;
mod queue;
mod relaxation;
mod search;
mod status;
mod store;

use num_traits::ToPrimitive as _;

use crate::context::Context;
use crate::limits::{Interrupted, Limits};
use crate::number::dense;
use crate::plan::ground::GroundPlan;
use crate::search::is_monotone;
use crate::search::successors::undominated;
use crate::task::number::TaskNumber;
use crate::task::{OperatorId, State, Task};

use explore::Explorer;
use landmarks::Landmarks;
use relaxation::Relaxation;
use search::{Outcome, Search, Weight};
use status::Status;

/// An operator with a combination of its designs, and what it costs.
struct Step<N> {
    operator: OperatorId,
    choice: Vec<u32>,
    cost: N,
}

/// What is known of a task, with room for looking at its states.
struct Known<'a, N> {
    task: &'a Task<N>,
    relaxation: Relaxation<N>,
    explorer: Explorer,
    status: Status,
    steps: Vec<Step<N>>,
    /// For each operator the number of its first step; then the number of all.
    first: Vec<u32>,
}

impl<'a, N: TaskNumber> Known<'a, N> {
    /// None if an operator has too many combinations of designs.
    fn new(context: Context<'a, N>) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        let monotone = is_monotone(task);
        let (mut steps, mut first) = (Vec::new(), Vec::new());
        for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
            let (own, operator) = item?;
            first.push(dense(steps.len()));
            let Some(choices) = undominated(own, monotone, false, limits)? else { return Ok(None) };
            steps.extend(choices.into_iter().map(|(choice, cost)| Step { operator, choice, cost }));
        }
        first.push(dense(steps.len()));
        let relaxation = Relaxation::new(task, limits)?;
        let explorer = Explorer::new(&relaxation, task.operators.len());
        let status = Status::new(Landmarks::new(task, &relaxation, limits)?, &relaxation);
        Ok(Some(Self { task, relaxation, explorer, status, steps, first }))
    }

    fn step(&self, step: u32) -> (OperatorId, &[u32], &N) {
        let Step { operator, choice, cost } = &self.steps[step as usize];
        (*operator, choice, cost)
    }

    /// The steps that are applicable in the state that was explored last, and which of them are preferred.
    fn steps(&mut self, state: &State<N>) -> (Vec<u32>, Vec<u32>) {
        self.explorer.applicable.sort_unstable();
        self.explorer.preferred.sort_unstable();
        let (mut all, mut preferred) = (Vec::new(), Vec::new());
        for operator in &self.explorer.applicable {
            let own = &self.task.operators[*operator as usize];
            if !own.condition.holds_propositionally(&state.values) {
                continue;
            }
            let is_preferred =
                self.explorer.preferred.binary_search(operator).is_ok() || self.brings_landmark(*operator);
            let sizes = own.sizes();
            let next = (*operator as usize).saturating_add(1);
            for step in self.first[*operator as usize]..self.first[next] {
                if own.condition.holds_numerically(&state.numbers, &self.steps[step as usize].choice, &sizes)
                {
                    all.push(step);
                    if is_preferred {
                        preferred.push(step);
                    }
                }
            }
        }
        (all, preferred)
    }

    fn brings_landmark(&self, operator: u32) -> bool {
        let effects = &self.task.operators[operator as usize].effects;
        effects.iter().any(|fact| self.status.is_wanted(self.relaxation.fact(*fact)))
    }

    /// Each operator at its cost, in a unit of which operators that cost something cost ten on average, and 1 more.
    fn prices(&self) -> Vec<u32> {
        let costs: Vec<f64> =
            self.task.operators.iter().map(|own| own.cost.minimum().approximate()).collect();
        let paid: Vec<f64> = costs.iter().copied().filter(|cost| *cost > 0.0).collect();
        let count = paid.len().to_f64().unwrap_or(1.0).max(1.0);
        let mean = paid.iter().sum::<f64>() / count;
        let price = |cost: &f64| {
            let scaled = if *cost > 0.0 { (10.0 * cost / mean).round().min(100_000.0) } else { 0.0 };
            scaled.to_u32().unwrap_or(0).saturating_add(1)
        };
        costs.iter().map(price).collect()
    }
}

/// The searches in their order: whether costs count, and how.
const PHASES: [(bool, Weight); 6] = [
    (false, Weight::Greedy),
    (true, Weight::Greedy),
    (true, Weight::Times(5)),
    (true, Weight::Times(3)),
    (true, Weight::Times(2)),
    (true, Weight::Times(1)),
];

/// A search may store so many states times words; then the next one has its turn.
const ROOM: usize = 400_000_000;

/// What came of going on for a while.
pub(crate) enum Advance<N> {
    /// A cheaper plan.
    Plan(GroundPlan<N>),
    /// There is no plan at all.
    Unsolvable,
    /// Nothing yet; it may go on.
    Paused,
    /// There is nothing left to be tried.
    Ended,
}

/// Searches for a plan, and then for cheaper and cheaper ones, that can be gone on with.
pub(crate) struct Satisficer<'a, N> {
    known: Known<'a, N>,
    limits: &'a Limits,
    phase: usize,
    search: Option<Search<N>>,
    /// States that were looked at.
    pub(crate) evaluated: u64,
}

impl<'a, N: TaskNumber> Satisficer<'a, N> {
    /// None if an operator has too many combinations of designs.
    pub(crate) fn new(context: Context<'a, N>) -> Result<Option<Self>, Interrupted> {
        let Some(known) = Known::new(context)? else { return Ok(None) };
        Ok(Some(Self { known, limits: context.limits, phase: 0, search: None, evaluated: 0 }))
    }

    /// What it takes to look at a state, about, in nodes and propositions.
    pub(crate) fn size(&self) -> u64 {
        let relaxation = &self.known.relaxation;
        (relaxation.propositions.saturating_add(relaxation.operators.len()) as u64).saturating_add(200)
    }

    /// How often it has begun anew.
    pub(crate) fn restarts(&self) -> usize {
        self.phase
    }

    /// Looks at up to so many further states for a plan that costs less than `limit`, or for any.
    pub(crate) fn run(&mut self, limit: Option<&N>, most: u64) -> Result<Advance<N>, Interrupted> {
        let Some((priced, weight)) = PHASES.get(self.phase).copied() else { return Ok(Advance::Ended) };
        let search = match &mut self.search {
            Some(search) => search,
            none => {
                let prices =
                    if priced { self.known.prices() } else { vec![1; self.known.task.operators.len()] };
                none.insert(Search::new(&mut self.known, weight, prices))
            }
        };
        let before = search.evaluated;
        let outcome = search.run(&mut self.known, limit, most, self.limits);
        self.evaluated = self.evaluated.saturating_add(search.evaluated.saturating_sub(before));
        let is_large = search.size() > ROOM;
        match outcome? {
            Outcome::Plan(plan) => {
                self.next();
                Ok(Advance::Plan(plan))
            }
            Outcome::Exhausted if limit.is_none() && !search.incomplete => Ok(Advance::Unsolvable),
            Outcome::Exhausted => {
                self.next();
                Ok(Advance::Paused)
            }
            Outcome::Paused => {
                if is_large {
                    self.next();
                }
                Ok(Advance::Paused)
            }
        }
    }

    fn next(&mut self) {
        self.phase = self.phase.saturating_add(1);
        self.search = None;
    }
}
