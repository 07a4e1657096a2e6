//! Tie-breaking among plans of equal cost: selects a canonical plan.
//!
//! The canonical plan has the fewest steps, and among these plans the fewest reconfigurations, i.e. changes
//! of a function's design. A step at which two functions change their designs counts twice. If there is a
//! reference plan, the number of steps that are not in it is minimised before the reconfigurations. Remaining
//! ties are broken by model order: step by step, it compares the position of the action in the domain, the
//! positions of its arguments in the problem, and its designs. Names are not compared. Unless the reference
//! plan contains it, a design is not selected if a strictly better design exists (cheaper, or with less
//! consumption).
//!
//! The cost and length of the known plan bound two searches: the first minimises reconfigurations, and the
//! second is a depth-first search in model order that stops at the first plan. If these searches exceed their
//! limits, the known plan is returned; the result is still deterministic, but not canonical.

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
use tracing::info_span;

use crate::bounds::{Bounds, Projection};
use crate::search::design_combinations::pareto_optimal_combinations;
use crate::search::monotonicity::is_monotone;
use crate::search::successor_generator::SuccessorGenerator;

/// Maximum number of labels (partial plans) that are stored in both searches together.
const LABEL_LIMIT: usize = 100_000;
const PAIR_LIMIT: usize = 50_000_000;

#[derive(Debug, Clone)]
struct Label {
    state: State,
    /// Last design of each function, if the function was used.
    designs: Vec<Option<ObjectId>>,
    cost: Int,
    steps: usize,
    changes: Changes,
}

impl Label {
    /// Returns the key of the Pareto front to which the label belongs. Numbers that must be equal for
    /// dominance are part of the key.
    fn place(&self, task: &Task, monotone: bool) -> Place {
        let numbers = if monotone { Vec::new() } else { self.state.numbers.clone() };
        (self.state.values[..task.basic].into(), self.designs.clone(), numbers)
    }
}

/// Secondary objectives in lexicographic order, summed over the steps: the number of steps that are not in
/// the reference plan (0 without a reference plan), and the number of changes of a function's design.
pub type Changes = (usize, usize);

struct Choice {
    designs: Vec<u32>,
    cost: Int,
    /// Functions used by the operator (as positions in `TieBreakContext::functions`), with their designs.
    configuration: Vec<(usize, ObjectId)>,
    /// `true` if the step is part of the reference plan, or there is no reference plan.
    is_kept: bool,
}

/// Combinations of designs of an operator, in ascending order; `None` if there are too many.
type Choices = Option<Vec<Choice>>;

/// Key of a Pareto front: the values of the basic variables, the last design of each function, and the values
/// of the numeric variables. The last are omitted if a higher value is never worse (the task is monotone).
type Place = (Box<[u32]>, Vec<Option<ObjectId>>, Vec<Int>);

#[derive(Default)]
struct Labels {
    all: Vec<Label>,
    fronts: FxHashMap<Place, Vec<usize>>,
}

/// Situation in which the plan begins: the state, and preferences for the remaining plan.
pub struct PlanPrefix<'a> {
    pub state: &'a State,
    /// Last design of each function before the plan, as pairs (function, design).
    pub designs: &'a [(ObjectId, ObjectId)],
    /// Steps of a reference plan; empty without a reference plan. Among equally good plans, a plan with more
    /// of these steps is selected.
    pub close_to: &'a FxHashSet<GroundStep>,
}

/// Tie-breaking data of a task that does not depend on the initial state.
pub struct TieBreakContext {
    /// Lower bounds on the number of steps to the goal, by projection and abstract state; `None` if the goal
    /// is unreachable.
    steps_to_go: Vec<Vec<Option<Int>>>,
    index: SuccessorGenerator,
    monotone: bool,
    functions: Vec<ObjectId>,
    choices: Vec<OnceLock<Choices>>,
}

impl TieBreakContext {
    /// Precomputes the data for comparing plans of equal cost.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn new(context: Context<'_>, bounds: &Bounds) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let configurations = task.operators.iter().flat_map(|operator| &operator.configuration);
        let mut functions: Vec<ObjectId> = configurations.map(|(function, _)| *function).collect();
        functions.sort_unstable();
        functions.dedup();
        // With unit costs, the goal distance equals the number of steps.
        let is_unit = |cost: (Int, Int)| cost == (1, 1);
        let unit =
            task.operators.iter().all(|operator| is_unit((operator.cost.minimum(), operator.cost.maximum())));
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

    /// Returns the Pareto-optimal combinations of designs of an operator, and the combinations of its steps
    /// in the reference plan, in ascending order. Returns `None` if there are too many combinations.
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
    /// Combinations of designs by operator if there is a reference plan. Otherwise the shared combinations in
    /// `prepared` are used.
    choices: Option<Vec<OnceLock<Choices>>>,
    close_to: &'a FxHashSet<GroundStep>,
    cost: Int,
    steps: usize,
    made: Cell<usize>,
    compared: Cell<usize>,
    pulse: RefCell<LimitPoll<'a>>,
}

/// Returns the canonical plan among all plans with the cost and the number of steps of `plan`. Returns `plan`
/// if a limit on labels, comparisons or time is reached, or if operator costs are only a part of the metric.
pub fn select_canonical_plan(context: Context<'_>, bounds: &Bounds, plan: GroundPlan) -> GroundPlan {
    let _span = info_span!("canonical plan").entered();
    if !context.task.objective.rest.is_empty() {
        return plan;
    }
    let close_to = FxHashSet::default();
    let beginning = PlanPrefix { state: &context.task.initial, designs: &[], close_to: &close_to };
    let Ok(prepared) = TieBreakContext::new(context, bounds) else { return plan };
    let max_changes = (usize::MAX, usize::MAX);
    choose_from((context, bounds, &prepared), plan, max_changes, &beginning).0
}

/// Selects the canonical plan for a given beginning, for example after steps that are already executed.
/// `plan` is the known plan, which sets cost and number of steps. Also returns the changes of the canonical
/// plan. If they exceed `max_changes` or the search reaches a limit, returns `plan` and `None`.
pub fn choose_from(
    (context, bounds, prepared): (Context<'_>, &Bounds, &TieBreakContext),
    plan: GroundPlan,
    max_changes: Changes,
    beginning: &PlanPrefix<'_>,
) -> (GroundPlan, Option<Changes>) {
    let Context { task, limits } = context;
    let mut designs = vec![None; prepared.functions.len()];
    for (function, design) in beginning.designs {
        if let Ok(position) = prepared.functions.binary_search(function) {
            designs[position] = Some(*design);
        }
    }
    let empty_choices = || task.operators.iter().map(|_| OnceLock::new()).collect();
    let ties = Ties {
        task,
        bounds,
        prepared,
        limits,
        choices: (!beginning.close_to.is_empty()).then(empty_choices),
        close_to: beginning.close_to,
        cost: plan.cost,
        steps: plan.steps.len(),
        made: Cell::new(0),
        compared: Cell::new(0),
        pulse: RefCell::new(limits.pulse()),
    };
    let start = Label { state: beginning.state.clone(), designs, cost: 0, steps: 0, changes: (0, 0) };
    match ties.first(start, max_changes) {
        Some((steps, changes)) => (GroundPlan { steps, cost: plan.cost }, Some(changes)),
        None => (plan, None),
    }
}

struct Branch<'a> {
    label: usize,
    operators: std::vec::IntoIter<OperatorId>,
    /// Current operator, and its untried combinations of designs.
    current: Option<(OperatorId, std::slice::Iter<'a, Choice>)>,
}

impl Ties<'_> {
    /// Returns the canonical plan and its changes, or `None` if more than `max_changes` are necessary or a
    /// limit on labels, comparisons or time is reached.
    fn first(&self, start: Label, max_changes: Changes) -> Option<(Vec<GroundStep>, Changes)> {
        let (changes, first_labels) = self.fewest_changes(start.clone(), max_changes)?;
        let steps = self.first_in_order(start, changes, &first_labels)?;
        (steps.len() == self.steps).then_some((steps, changes))
    }

    /// Returns the combinations of designs of an operator. Returns `None` if there are too many, or the
    /// computation was interrupted; only the former result is cached.
    fn choices(&self, operator: OperatorId) -> Option<&[Choice]> {
        let choices = &self.choices.as_ref().unwrap_or(&self.prepared.choices)[operator.index()];
        if choices.get().is_none() {
            let operator_choices = self
                .prepared
                .choices_of(Context::new(self.task, self.limits), operator, self.close_to)
                .ok()?;
            // If another thread has set the value first, it is equal.
            let _ = choices.set(operator_choices);
        }
        choices.get()?.as_deref()
    }

    /// Returns the label (partial plan) after a step. Returns `None` if the step is inapplicable or cannot
    /// lead to a plan within the cost and number of steps of the known plan.
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
        let remaining_steps = (self.steps - steps) as Int;
        let in_time = |(projection, to_go): (&Projection, &Vec<Option<Int>>)| {
            to_go[projection.state(&state) as usize].is_some_and(|more| more <= remaining_steps)
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

    /// Returns the minimum changes of a plan that starts at the label `from`, and all labels (partial plans)
    /// that were stored. Returns `None` if the minimum exceeds `max_changes` or a limit on labels,
    /// comparisons or time is reached.
    fn fewest_changes(&self, from: Label, max_changes: Changes) -> Option<(Changes, Labels)> {
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
                    // Labels are popped by ascending changes and then by descending depth, so the first goal
                    // label has the minimum changes.
                    if next.changes <= max_changes && !self.is_beaten(&labels, &next, false) {
                        open.push(Reverse((next.changes, Reverse(next.steps), labels.all.len())));
                        self.keep(&mut labels, next)?;
                    }
                }
            }
        }
        None
    }

    /// Returns the first plan in model order with at most `changes`, which must be the minimum. Uses
    /// depth-first search. Returns `None` if a limit on labels, comparisons or time is reached.
    ///
    /// A label (partial plan) is pruned if a visited label is at least as good. If the visited label has led
    /// to no plan, the new label leads to none either. If the visited label is an ancestor of the new label,
    /// a plan from the new label would imply a shorter plan from the ancestor, which cannot exist. A label is
    /// also pruned if a label in `first_labels`, from the search for the minimum changes, is strictly better
    /// in cost, steps or changes, because the minimum values of all three are known.
    fn first_in_order(
        &self,
        start: Label,
        changes: Changes,
        first_labels: &Labels,
    ) -> Option<Vec<GroundStep>> {
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
                && !self.is_beaten(first_labels, &next, true)
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

    /// Returns `true` if a stored label of the Pareto front of `next` is at least as good as `next`. If
    /// `strictly`, the label must also be better in cost, steps or changes.
    fn is_beaten(&self, labels: &Labels, next: &Label, strictly: bool) -> bool {
        let is_better =
            |label: &Label| (label.cost, label.steps, label.changes) != (next.cost, next.steps, next.changes);
        labels.fronts.get(&next.place(self.task, self.prepared.monotone)).is_some_and(|front| {
            self.compared.set(self.compared.get().saturating_add(front.len()));
            let mut labels_of_front = front.iter().map(|position| &labels.all[*position]);
            labels_of_front.any(|label| self.no_worse(label, next) && (!strictly || is_better(label)))
        })
    }

    fn beat(&self) -> Option<()> {
        self.pulse.borrow_mut().beat().ok()
    }

    /// Stores a label (partial plan). Returns `None` if the limit on labels or comparisons is reached.
    #[expect(clippy::arithmetic_side_effects, reason = "labels are counted up to their limit")]
    fn keep(&self, labels: &mut Labels, label: Label) -> Option<()> {
        labels
            .fronts
            .entry(label.place(self.task, self.prepared.monotone))
            .or_default()
            .push(labels.all.len());
        labels.all.push(label);
        let label_count = self.made.get() + 1;
        self.made.set(label_count);
        (label_count < LABEL_LIMIT && self.compared.get() < PAIR_LIMIT).then_some(())
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
