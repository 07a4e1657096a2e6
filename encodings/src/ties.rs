//! Which of several cheapest plans is chosen.
//!
//! Of plans that cost the same one with fewest steps is chosen, of those one with fewest reconfigurations (steps at which a
//! function changes its design), and of those the first in model order: step by step the action that the domain
//! declares first, with the arguments, and then the designs, that the problem declares first. Names play no part. Designs for
//! which there is a strictly better one (cheaper, or using up less) are not chosen.
//!
//! The search for it is held within cost and steps of the plan that is known, by the bounds of both. Where that is not
//! enough to keep it small, the choice stays what it is then: deterministic, but not in this order.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::bounds::{Bounds, Projection};
use crate::lifted::ObjectId;
use crate::limits::Limits;
use crate::plan::{GroundPlan, GroundStep, resolve};
use crate::search::is_monotone;
use crate::successors::{OperatorIndex, undominated};
use crate::task::{Operator, OperatorId, State, Task};

/// How many labels are made at most.
const LABEL_LIMIT: usize = 100_000;

/// Where a plan can have come to.
#[derive(Debug, Clone)]
struct Label {
    state: State,
    /// The design that each function ran with last.
    designs: Vec<Option<ObjectId>>,
    cost: i64,
    steps: usize,
    changes: Changes,
    parent: Option<(usize, GroundStep)>,
}

/// What is kept small, the more important first: steps that are not of the plan to stay close to, and functions that have changed
/// their design, each summed over the steps.
pub(crate) type Changes = (usize, usize);

/// Combinations of designs with their costs.
type Choices = Vec<(Vec<u16>, i64)>;

/// Labels by where they have come to.
type Seen = FxHashMap<(Box<[u32]>, Vec<Option<ObjectId>>), Vec<usize>>;

/// What is before the plan.
pub(crate) struct Beginning<'a> {
    pub(crate) state: &'a State,
    /// The design that functions ran with last.
    pub(crate) designs: &'a [(ObjectId, ObjectId)],
    /// Of plans that are as good, one with more of these steps is chosen.
    pub(crate) close_to: &'a FxHashSet<GroundStep>,
}

struct Ties<'a> {
    task: &'a Task,
    bounds: &'a Bounds,
    limits: &'a Limits,
    steps_to_go: Vec<Vec<Option<i64>>>,
    index: OperatorIndex,
    choices: Vec<Option<Choices>>,
    monotone: bool,
    functions: Vec<ObjectId>,
    close_to: &'a FxHashSet<GroundStep>,
    cost: i64,
    steps: usize,
    made: usize,
}

/// The chosen one among the plans that cost as much as a cheapest plan with fewest steps.
pub(crate) fn choose(task: &Task, bounds: &Bounds, limits: &Limits, plan: GroundPlan) -> GroundPlan {
    let close_to = FxHashSet::default();
    let beginning = Beginning { state: &task.initial, designs: &[], close_to: &close_to };
    choose_from(task, bounds, limits, plan, (usize::MAX, usize::MAX), &beginning).0
}

/// The same for plans that begin in another state, or after steps that are settled; with its changes, if they are at most so
/// many and plans were few enough to tell.
pub(crate) fn choose_from(
    task: &Task,
    bounds: &Bounds,
    limits: &Limits,
    plan: GroundPlan,
    most: Changes,
    beginning: &Beginning<'_>,
) -> (GroundPlan, Option<Changes>) {
    let mut functions: Vec<ObjectId> =
        task.operators.iter().flat_map(|o| o.configuration.iter().map(|(function, _)| *function)).collect();
    functions.sort_unstable();
    functions.dedup();
    let mut designs = vec![None; functions.len()];
    for (function, design) in beginning.designs {
        if let Ok(position) = functions.binary_search(function) {
            designs[position] = Some(*design);
        }
    }
    let mut ties = Ties {
        task,
        bounds,
        limits,
        steps_to_go: bounds.projections.iter().map(Projection::steps_to_go).collect(),
        index: OperatorIndex::new(task),
        choices: vec![None; task.operators.len()],
        monotone: is_monotone(task),
        cost: plan.cost,
        steps: plan.steps.len(),
        made: 0,
        functions,
        close_to: beginning.close_to,
    };
    let state = beginning.state.clone();
    let start = Label { state, designs, cost: 0, steps: 0, changes: (0, 0), parent: None };
    match ties.first(start, most, &plan.steps) {
        Some((steps, changes)) => (GroundPlan { steps, cost: plan.cost }, Some(changes)),
        None => (plan, None),
    }
}

impl Ties<'_> {
    /// The first plan in order, and its changes; none if those are more, or if there are too many plans to tell.
    fn first(
        &mut self,
        start: Label,
        most: Changes,
        known: &[GroundStep],
    ) -> Option<(Vec<GroundStep>, Changes)> {
        let (mut suffix, changes) = self.fewest_changes(&start, most)?;
        if suffix.len() != known.len() {
            return None;
        }
        let mut at = start;
        let mut chosen = Vec::new();
        while !suffix.is_empty() {
            let current = suffix[0].clone();
            let mut replaced = None;
            'candidates: for operator in self.index.applicable(self.task, &at.state) {
                for (choice, cost) in self.choices(operator)? {
                    if (operator, &choice) >= (current.operator, &current.choice) {
                        break 'candidates;
                    }
                    let step = GroundStep { operator, choice };
                    let Some(next) = self.successor(&at, &step, cost, None) else { continue };
                    if let Some((rest, _)) = self.fewest_changes(&next, changes) {
                        replaced = Some(std::iter::once(step).chain(rest).collect());
                        break 'candidates;
                    }
                    if self.made >= LABEL_LIMIT || self.limits.reached() {
                        return None;
                    }
                }
            }
            suffix = replaced.unwrap_or(suffix);
            let step = suffix.remove(0);
            let cost = self.task.operators[step.operator.index()].cost_of(&step.choice);
            at = self.successor(&at, &step, cost, None)?;
            chosen.push(step);
        }
        Some((chosen, changes))
    }

    /// None if there are too many.
    fn choices(&mut self, operator: OperatorId) -> Option<Choices> {
        let known = &mut self.choices[operator.index()];
        if known.is_none() {
            let schema = &self.task.operators[operator.index()];
            let mut choices = undominated(schema, self.monotone, true)?;
            for step in self.close_to.iter().filter(|step| step.operator == operator) {
                if choices.iter().all(|(choice, _)| *choice != step.choice) {
                    choices.push((step.choice.clone(), schema.cost_of(&step.choice)));
                }
            }
            choices.sort();
            *known = Some(choices);
        }
        known.clone()
    }

    /// The label after a step; none if it leads beyond the limits.
    fn successor(&self, label: &Label, step: &GroundStep, cost: i64, parent: Option<usize>) -> Option<Label> {
        let operator = &self.task.operators[step.operator.index()];
        if label.cost + cost > self.cost
            || label.steps >= self.steps
            || !operator.condition.holds_numerically(&label.state.numbers, &step.choice, &operator.sizes())
        {
            return None;
        }
        let state = self.task.successor(operator, &label.state, &step.choice);
        let mut next = Label {
            designs: label.designs.clone(),
            cost: label.cost + cost,
            steps: label.steps + 1,
            changes: label.changes,
            parent: parent.map(|parent| (parent, step.clone())),
            state,
        };
        let is_other = !self.close_to.is_empty() && !self.close_to.contains(step);
        next.changes.0 += usize::from(is_other);
        for (function, design) in self.configuration(operator, &step.choice) {
            next.changes.1 += usize::from(next.designs[function].is_some_and(|known| known != design));
            next.designs[function] = Some(design);
        }
        let within = next.cost + self.bounds.estimate(&next.state)? <= self.cost;
        let steps = |(projection, to_go): (&Projection, &Vec<Option<i64>>)| {
            to_go[projection.state(&next.state) as usize]
                .is_some_and(|more| next.steps as i64 + more <= self.steps as i64)
        };
        (within && self.bounds.projections.iter().zip(&self.steps_to_go).all(steps)).then_some(next)
    }

    fn configuration<'o>(
        &'o self,
        operator: &'o Operator,
        choice: &'o [u16],
    ) -> impl Iterator<Item = (usize, ObjectId)> + 'o {
        operator.configuration.iter().filter_map(move |(function, argument)| {
            let design = resolve(self.task, operator, choice, *argument);
            Some((self.functions.binary_search(function).ok()?, design))
        })
    }

    /// A way from a label to the goal with fewest changes in all, at most so many.
    fn fewest_changes(&mut self, from: &Label, most: Changes) -> Option<(Vec<GroundStep>, Changes)> {
        // The last step may be one change too many.
        if from.changes > most {
            return None;
        }
        let mut labels = vec![Label { parent: None, ..from.clone() }];
        let mut open = BinaryHeap::from([Reverse((from.changes, Reverse(from.steps), 0))]);
        let mut seen = Seen::default();
        while let Some(Reverse((changes, _, id))) = open.pop() {
            if self.task.is_goal(&labels[id].state) {
                return Some((path(&labels, id), changes));
            }
            let state = labels[id].state.clone();
            for operator in self.index.applicable(self.task, &state) {
                for (choice, cost) in self.choices(operator)? {
                    let step = GroundStep { operator, choice };
                    let Some(next) = self.successor(&labels[id], &step, cost, Some(id)) else { continue };
                    if next.changes > most {
                        continue;
                    }
                    let key = (next.state.values[..self.task.basic].into(), next.designs.clone());
                    let front = seen.entry(key).or_default();
                    if front.iter().any(|known| self.no_worse(&labels[*known], &next)) {
                        continue;
                    }
                    self.made += 1;
                    if self.made >= LABEL_LIMIT || (self.made.is_multiple_of(256) && self.limits.reached()) {
                        return None;
                    }
                    front.push(labels.len());
                    open.push(Reverse((next.changes, Reverse(next.steps), labels.len())));
                    labels.push(next);
                }
            }
        }
        None
    }

    fn no_worse(&self, a: &Label, b: &Label) -> bool {
        let numbers = a.state.numbers.iter().zip(&b.state.numbers);
        a.cost <= b.cost
            && a.steps <= b.steps
            && a.changes <= b.changes
            && if self.monotone {
                numbers.into_iter().all(|(a, b)| a >= b)
            } else {
                a.state.numbers == b.state.numbers
            }
    }
}

fn path(labels: &[Label], goal: usize) -> Vec<GroundStep> {
    let mut steps = Vec::new();
    let mut at = goal;
    while let Some((parent, step)) = &labels[at].parent {
        steps.push(step.clone());
        at = *parent;
    }
    steps.reverse();
    steps
}
