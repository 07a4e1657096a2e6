//! Selection among plans of equal cost.
//!
//! The chosen plan has the fewest steps, then the fewest reconfigurations (steps at which a function changes
//! its design), then comes first in model order. Model order compares step by step the position of the action
//! in the domain, of its arguments in the problem, and of its designs. Names play no part. A design is not
//! chosen if a strictly better one exists (cheaper, or with less consumption).
//!
//! The known plan bounds both searches: one for the fewest reconfigurations, and a depth-first search in model
//! order that stops at the first plan. If these bounds do not keep the searches small, the choice is still
//! deterministic, but not in this order.

use std::cell::{Cell, RefCell};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

use rustc_hash::{FxHashMap, FxHashSet};
use task::context::Context;
use task::lifted::ObjectId;
use task::limits::{Interrupted, LimitPoll, Limits};
use task::number::Int;
use task::plan::ground::{GroundPlan, GroundStep};
use task::plan::resolve;
use task::task::{OperatorId, State, Task};

use crate::bounds::{Bounds, Projection};
use crate::search::design_combinations::pareto_optimal_combinations;
use crate::search::monotonicity::is_monotone;
use crate::search::successor_generator::SuccessorGenerator;

/// How many labels are made at most.
const LABEL_LIMIT: usize = 100_000;
/// How many pairs of labels are compared at most.
const PAIR_LIMIT: usize = 50_000_000;

/// Where a plan can have come to.
#[derive(Debug, Clone)]
struct Label {
    state: State,
    /// The design that each function ran with last.
    designs: Vec<Option<ObjectId>>,
    cost: Int,
    steps: usize,
    changes: Changes,
}

impl Label {
    /// Where numbers have to be equal, they are part of the place.
    fn place(&self, task: &Task, monotone: bool) -> Place {
        let numbers = if monotone { Vec::new() } else { self.state.numbers.clone() };
        (self.state.values[..task.basic].into(), self.designs.clone(), numbers)
    }
}

/// What is kept small, the more important first: steps that are not of the plan to stay close to, and functions that have changed
/// their design, each summed over the steps.
pub type Changes = (usize, usize);

/// A combination of designs of an operator.
struct Choice {
    designs: Vec<u32>,
    cost: Int,
    /// Functions, by position, and their designs.
    configuration: Vec<(usize, ObjectId)>,
    /// Whether it is a step of the plan to stay close to, or there is no such plan.
    is_kept: bool,
}

/// An operator's combinations of designs in order; none if there are too many.
type Choices = Option<Vec<Choice>>;

/// Where a label has come to: its values, designs, and numbers.
type Place = (Box<[u32]>, Vec<Option<ObjectId>>, Vec<Int>);

/// Labels, and their positions by where they have come to.
#[derive(Default)]
struct Labels {
    all: Vec<Label>,
    fronts: FxHashMap<Place, Vec<usize>>,
}

/// What is before the plan.
pub struct PlanPrefix<'a> {
    pub state: &'a State,
    /// The design that functions ran with last.
    pub designs: &'a [(ObjectId, ObjectId)],
    /// Of plans that are as good, one with more of these steps is chosen.
    pub close_to: &'a FxHashSet<GroundStep>,
}

/// What choosing needs to know of a task, whatever state plans begin in.
pub struct TieBreakContext {
    /// By projection and abstract state.
    steps_to_go: Vec<Vec<Option<Int>>>,
    index: SuccessorGenerator,
    monotone: bool,
    functions: Vec<ObjectId>,
    choices: Vec<OnceLock<Choices>>,
}

impl TieBreakContext {
    /// Prepares the comparison of plans of equal cost.
    ///
    /// # Errors
    /// Fails when a limit is reached.
    pub fn new(context: Context<'_>, bounds: &Bounds) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let configurations = task.operators.iter().flat_map(|operator| &operator.configuration);
        let mut functions: Vec<ObjectId> = configurations.map(|(function, _)| *function).collect();
        functions.sort_unstable();
        functions.dedup();
        // Where every step costs 1, the number of steps is the cost.
        let is_unit = |cost: (Int, Int)| cost == (1, 1);
        let unit = task.operators.iter().all(|own| is_unit((own.cost.minimum(), own.cost.maximum())));
        let steps = bounds.projections.iter().map(|projection| {
            if unit { Ok(projection.costs().to_vec()) } else { projection.steps_to_go(limits) }
        });
        Ok(Self {
            steps_to_go: steps.collect::<Result<_, _>>()?,
            index: SuccessorGenerator::new(task),
            monotone: is_monotone(task),
            functions,
            choices: task.operators.iter().map(|_| OnceLock::new()).collect(),
        })
    }

    /// The combinations that no other one is strictly better than, and those of the steps to stay close to.
    fn choices_of(
        &self,
        context: Context<'_>,
        id: OperatorId,
        close_to: &FxHashSet<GroundStep>,
    ) -> Result<Choices, Interrupted> {
        let Context { task, limits } = context;
        let operator = &task.operators[id.index()];
        let Some(mut choices) = pareto_optimal_combinations(operator, self.monotone, true, limits)? else {
            return Ok(None);
        };
        for step in close_to.iter().filter(|step| step.operator == id) {
            if choices.iter().all(|(choice, _)| *choice != step.choice) {
                choices.push((step.choice.clone(), operator.cost_of(&step.choice)));
            }
        }
        choices.sort();
        let choices = choices.into_iter().map(|(choice, cost)| {
            let configuration = operator.configuration.iter().filter_map(|(function, argument)| {
                let design = resolve(task, operator, &choice, *argument);
                Some((self.functions.binary_search(function).ok()?, design))
            });
            let configuration = configuration.collect();
            let step = GroundStep { operator: id, choice };
            let is_kept = close_to.is_empty() || close_to.contains(&step);
            Choice { designs: step.choice, cost, configuration, is_kept }
        });
        Ok(Some(choices.collect()))
    }
}

struct Ties<'a> {
    task: &'a Task,
    bounds: &'a Bounds,
    prepared: &'a TieBreakContext,
    limits: &'a Limits,
    /// Where they depend on the plan to stay close to.
    choices: Option<Vec<OnceLock<Choices>>>,
    close_to: &'a FxHashSet<GroundStep>,
    cost: Int,
    steps: usize,
    made: Cell<usize>,
    compared: Cell<usize>,
    pulse: RefCell<LimitPoll<'a>>,
}

/// The chosen one among the plans that cost as much as a cheapest plan with fewest steps.
pub fn select_canonical_plan(context: Context<'_>, bounds: &Bounds, plan: GroundPlan) -> GroundPlan {
    let close_to = FxHashSet::default();
    let beginning = PlanPrefix { state: &context.task.initial, designs: &[], close_to: &close_to };
    let Ok(prepared) = TieBreakContext::new(context, bounds) else { return plan };
    let most = (usize::MAX, usize::MAX);
    choose_from((context, bounds, &prepared), plan, most, &beginning).0
}

/// The same for plans that begin in another state, or after steps that are settled; with its changes, if they are at most so
/// many and plans were few enough to tell.
pub fn choose_from(
    (context, bounds, prepared): (Context<'_>, &Bounds, &TieBreakContext),
    plan: GroundPlan,
    most: Changes,
    beginning: &PlanPrefix<'_>,
) -> (GroundPlan, Option<Changes>) {
    let Context { task, limits } = context;
    let mut designs = vec![None; prepared.functions.len()];
    for (function, design) in beginning.designs {
        if let Ok(position) = prepared.functions.binary_search(function) {
            designs[position] = Some(*design);
        }
    }
    let own = || task.operators.iter().map(|_| OnceLock::new()).collect();
    let ties = Ties {
        task,
        bounds,
        prepared,
        limits,
        choices: (!beginning.close_to.is_empty()).then(own),
        close_to: beginning.close_to,
        cost: plan.cost,
        steps: plan.steps.len(),
        made: Cell::new(0),
        compared: Cell::new(0),
        pulse: RefCell::new(limits.pulse()),
    };
    let start = Label { state: beginning.state.clone(), designs, cost: 0, steps: 0, changes: (0, 0) };
    match ties.first(start, most) {
        Some((steps, changes)) => (GroundPlan { steps, cost: plan.cost }, Some(changes)),
        None => (plan, None),
    }
}

/// What is left to try after a label.
struct Branch<'a> {
    label: usize,
    operators: std::vec::IntoIter<OperatorId>,
    /// An operator, and those of its choices that are left.
    current: Option<(OperatorId, std::slice::Iter<'a, Choice>)>,
}

impl Ties<'_> {
    /// The first plan in order, and its changes; none if those are more, or if there are too many plans to tell.
    fn first(&self, start: Label, most: Changes) -> Option<(Vec<GroundStep>, Changes)> {
        let (changes, known) = self.fewest_changes(start.clone(), most)?;
        let steps = self.first_in_order(start, changes, &known)?;
        (steps.len() == self.steps).then_some((steps, changes))
    }

    /// None if there are too many, or if a limit was reached, which is not kept.
    fn choices(&self, operator: OperatorId) -> Option<&[Choice]> {
        let choices = &self.choices.as_ref().unwrap_or(&self.prepared.choices)[operator.index()];
        if choices.get().is_none() {
            let own = self
                .prepared
                .choices_of(Context::new(self.task, self.limits), operator, self.close_to)
                .ok()?;
            // If another thread was first, its choices are the same.
            let _ = choices.set(own);
        }
        choices.get()?.as_deref()
    }

    /// The label after a step; none if it leads beyond the limits.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "costs are not negative and those of labels at most that of a known plan, so that sums with an operator and an estimate fit"
    )]
    fn successor(&self, label: &Label, operator: OperatorId, choice: &Choice) -> Option<Label> {
        let operator = &self.task.operators[operator.index()];
        let (cost, steps) = (label.cost + choice.cost, label.steps + 1);
        let sizes = operator.sizes();
        if cost > self.cost
            || steps > self.steps
            || !operator.condition.holds_numerically(&label.state.numbers, &choice.designs, &sizes)
        {
            return None;
        }
        let state = self.task.successor(operator, &label.state, &choice.designs)?;
        if cost + self.bounds.estimate(&state)? > self.cost {
            return None;
        }
        let most = (self.steps - steps) as Int;
        let in_time = |(projection, to_go): (&Projection, &Vec<Option<Int>>)| {
            to_go[projection.state(&state) as usize].is_some_and(|more| more <= most)
        };
        if !self.bounds.projections.iter().zip(&self.prepared.steps_to_go).all(in_time) {
            return None;
        }
        let mut next = Label { state, designs: label.designs.clone(), cost, steps, changes: label.changes };
        next.changes.0 += usize::from(!choice.is_kept);
        for (function, design) in &choice.configuration {
            let last = next.designs[*function].replace(*design);
            next.changes.1 += usize::from(last.is_some_and(|last| last != *design));
        }
        Some(next)
    }

    /// The fewest changes of a plan from a label on, if there is one with at most so many, and the labels that were made.
    fn fewest_changes(&self, from: Label, most: Changes) -> Option<(Changes, Labels)> {
        let mut open = BinaryHeap::from([Reverse((from.changes, Reverse(from.steps), 0))]);
        let mut labels = Labels { all: vec![from], ..Labels::default() };
        while let Some(Reverse((changes, _, id))) = open.pop() {
            if self.task.is_goal(&labels.all[id].state) {
                return Some((changes, labels));
            }
            for operator in self.prepared.index.applicable(self.task, &labels.all[id].state) {
                for choice in self.choices(operator)? {
                    self.beat()?;
                    let Some(next) = self.successor(&labels.all[id], operator, choice) else { continue };
                    if next.changes <= most && !self.is_beaten(&labels, &next, false) {
                        open.push(Reverse((next.changes, Reverse(next.steps), labels.all.len())));
                        self.keep(&mut labels, next)?;
                    }
                }
            }
        }
        None
    }

    /// The first plan in the order of the model with so many changes, the fewest that there can be, by a search in depth. A label is
    /// not followed where one was that is no worse: if that one led to no plan, neither does this one; and if this one comes
    /// after that one, a plan from here would be one with fewer steps from there. Nor is one that is worse than a known one in cost,
    /// steps or changes, which are the least already.
    fn first_in_order(&self, start: Label, changes: Changes, known: &Labels) -> Option<Vec<GroundStep>> {
        if self.task.is_goal(&start.state) {
            return Some(Vec::new());
        }
        let branch = |label: usize, state: &State| {
            let operators = self.prepared.index.applicable(self.task, state).into_iter();
            Branch { label, operators, current: None }
        };
        let mut branches = vec![branch(0, &start.state)];
        let mut steps: Vec<GroundStep> = Vec::new();
        let mut labels = Labels { all: vec![start], ..Labels::default() };
        while let Some(last) = branches.last_mut() {
            let Some((operator, choices)) = &mut last.current else {
                if let Some(operator) = last.operators.next() {
                    last.current = Some((operator, self.choices(operator)?.iter()));
                } else {
                    branches.pop();
                    steps.pop();
                }
                continue;
            };
            let operator = *operator;
            self.beat()?;
            let Some(choice) = choices.next() else {
                last.current = None;
                continue;
            };
            let Some(next) = self.successor(&labels.all[last.label], operator, choice) else { continue };
            if next.changes <= changes
                && !self.is_beaten(known, &next, true)
                && !self.is_beaten(&labels, &next, false)
            {
                steps.push(GroundStep { operator, choice: choice.designs.clone() });
                if self.task.is_goal(&next.state) {
                    return Some(steps);
                }
                branches.push(branch(labels.all.len(), &next.state));
                self.keep(&mut labels, next)?;
            }
        }
        None
    }

    /// Whether some label is no worse than another one; if `strictly`, one with less cost, steps or changes.
    fn is_beaten(&self, labels: &Labels, next: &Label, strictly: bool) -> bool {
        let is_better =
            |known: &Label| (known.cost, known.steps, known.changes) != (next.cost, next.steps, next.changes);
        labels.fronts.get(&next.place(self.task, self.prepared.monotone)).is_some_and(|front| {
            self.compared.set(self.compared.get().saturating_add(front.len()));
            let mut known = front.iter().map(|position| &labels.all[*position]);
            known.any(|known| self.no_worse(known, next) && (!strictly || is_better(known)))
        })
    }

    /// None if a limit is reached.
    fn beat(&self) -> Option<()> {
        self.pulse.borrow_mut().beat().ok()
    }

    /// Keeps a label; none if there are too many.
    #[expect(clippy::arithmetic_side_effects, reason = "labels are counted up to their limit")]
    fn keep(&self, labels: &mut Labels, label: Label) -> Option<()> {
        labels
            .fronts
            .entry(label.place(self.task, self.prepared.monotone))
            .or_default()
            .push(labels.all.len());
        labels.all.push(label);
        let made = self.made.get() + 1;
        self.made.set(made);
        (made < LABEL_LIMIT && self.compared.get() < PAIR_LIMIT).then_some(())
    }

    fn no_worse(&self, a: &Label, b: &Label) -> bool {
        let numbers = a.state.numbers.iter().zip(&b.state.numbers);
        a.cost <= b.cost
            && a.steps <= b.steps
            && a.changes <= b.changes
            && if self.prepared.monotone {
                numbers.into_iter().all(|(a, b)| a >= b)
            } else {
                a.state.numbers == b.state.numbers
            }
    }
}
