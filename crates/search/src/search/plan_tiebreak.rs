//! Tie-breaking among the plans that have the cost and the number of steps of a known plan: selects a
//! canonical plan.
//!
//! The number of steps is not minimised here: the canonical plan has the fewest steps only if the known plan
//! has. It has the fewest reconfigurations, i.e. changes of a function's design. A step at which two
//! functions change their designs counts twice. If there is a reference plan, the number of steps that are
//! not in it is minimised before the reconfigurations. Remaining ties are broken by model order: step by
//! step, it compares the position of the action in the domain, the positions of its arguments in the problem,
//! and its designs. Names are not compared. Unless the reference plan contains it, a design is not selected
//! if a strictly better design exists (cheaper, or with less consumption).
//!
//! The cost and length of the known plan bound two searches: the first minimises reconfigurations, and the
//! second is a depth-first search in model order that stops at the first plan. If these searches exceed their
//! limits or the second one ends with a shorter plan, the known plan is returned, which need not be
//! canonical.

use std::cell::{Cell, RefCell};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use task::context::Context;
use task::lifted::ObjectId;
use task::limits::{Interrupted, LimitPoll, Limits};
use task::number::{Int, dense};
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
    /// Last design of each function, in the plan or before it; `None` if it is not known.
    designs: Vec<Option<ObjectId>>,
    cost: Int,
    steps: usize,
    changes: Changes,
}

impl Label {
    /// Writes the values that labels of one Pareto front share: basic variables, last designs, and
    /// numbers that must be equal for dominance.
    fn write_front_key(&self, task: &Task, monotone: bool, key: &mut Vec<u32>) {
        key.clear();
        key.extend(&self.state.values[..task.basic]);
        key.extend(self.designs.iter().map(|design| design.map_or(u32::MAX, |design| dense(design.index()))));
        if !monotone {
            for number in &self.state.numbers {
                let bytes = number.to_le_bytes();
                let words = bytes.chunks_exact(4).map(|word| word.iter().map(|byte| u32::from(*byte)));
                key.extend(words.map(|bytes| bytes.fold(0, |word, byte| (word << 8) | byte)));
            }
        }
    }

    fn merits(&self) -> Merits {
        Merits {
            cost: self.cost,
            steps: self.steps,
            changes: self.changes,
            numbers: SmallVec::from_slice(&self.state.numbers),
        }
    }
}

struct Merits {
    cost: Int,
    steps: usize,
    changes: Changes,
    numbers: SmallVec<[Int; 1]>,
}

impl Merits {
    /// Returns `true` if these merits are at least as good as the others in each respect. If `monotone`,
    /// higher values of all numeric variables are never worse; otherwise they must be equal.
    fn is_no_worse(&self, other: &Self, monotone: bool) -> bool {
        self.cost <= other.cost
            && self.steps <= other.steps
            && self.changes <= other.changes
            && if monotone {
                self.numbers.iter().zip(&other.numbers).all(|(own, other)| own >= other)
            } else {
                self.numbers == other.numbers
            }
    }

    fn measures(&self) -> (Int, usize, Changes) {
        (self.cost, self.steps, self.changes)
    }
}

/// Secondary objectives in lexicographic order, summed over the steps: the number of steps that are not in
/// the reference plan (0 without a reference plan), and the number of changes of a function's design.
pub type Changes = (usize, usize);

struct Choice {
    designs: Vec<u32>,
    cost: Int,
    /// Functions used by the operator (as positions in `TieBreakContext::functions`), with their
    /// designs.
    configuration: Vec<(usize, ObjectId)>,
    /// `true` if the step is in the reference plan, or there is no reference plan.
    is_kept: bool,
}

/// Combinations of designs of an operator, in ascending order; `None` if there are too many.
type Choices = Option<Vec<Choice>>;

#[derive(Default)]
struct Labels {
    all: Vec<Label>,
    /// Merits of the non-dominated labels, by the key of [`Label::write_front_key`]. The start label
    /// (`all[0]`) is not included.
    fronts: FxHashMap<Box<[u32]>, Vec<Merits>>,
}

/// Situation in which the plan begins: the state, and preferences for the remaining plan.
pub struct PlanPrefix<'a> {
    pub state: &'a State,
    /// Last design of each function before the plan, as pairs (function, design).
    pub designs: &'a [(ObjectId, ObjectId)],
    /// Steps of a reference plan; empty without a reference plan. The number of steps outside this set is
    /// minimised first.
    pub close_to: &'a FxHashSet<GroundStep>,
}

/// Tie-breaking data of a task that does not depend on the initial state.
pub struct TieBreakContext {
    /// For each projection and abstract state: a lower bound on the number of steps to the goal;
    /// `None` if the goal is unreachable.
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

    /// Returns the Pareto-optimal combinations of designs of an operator, and those of the reference plan, in
    /// ascending order. Returns `None` if there are too many combinations.
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
    /// Combinations of designs by operator if there is a reference plan; otherwise those in
    /// `prepared` are used.
    choices: Option<Vec<OnceLock<Choices>>>,
    close_to: &'a FxHashSet<GroundStep>,
    cost: Int,
    steps: usize,
    made: Cell<usize>,
    compared: Cell<usize>,
    pulse: RefCell<LimitPoll<'a>>,
    /// Scratch buffer for successors, most of which are rejected.
    next: RefCell<State>,
    key: RefCell<Vec<u32>>,
}

/// Returns the canonical plan among all plans with the cost and the number of steps of `plan`.
/// Returns `plan` if the search fails, for example at a limit, or if operator costs are only a part
/// of the metric.
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

/// Selects the canonical plan (see the head of this file) among the plans from the situation
/// `beginning` that have the cost and the number of steps of `plan`. The situation may be the one
/// after steps that are already executed. Also returns the [`Changes`] of the selected plan. If
/// more than `max_changes` are necessary or the search fails, for example at a limit, returns
/// `plan` and `None`.
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
        next: RefCell::new(beginning.state.clone()),
        key: RefCell::default(),
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
    /// Current operator, the result of [`Ties::cost_to_go_after`] for it, and its untried
    /// combinations of designs.
    current: Option<(OperatorId, Int, std::slice::Iter<'a, Choice>)>,
}

impl Ties<'_> {
    /// Returns the canonical plan and its changes. Returns `None` if more than `max_changes` are
    /// necessary, a limit is reached, or the search ends with a shorter plan.
    fn first(&self, start: Label, max_changes: Changes) -> Option<(Vec<GroundStep>, Changes)> {
        let (changes, first_labels) = self.fewest_changes(start.clone(), max_changes)?;
        let steps = self.first_in_order(start, changes, &first_labels)?;
        (steps.len() == self.steps).then_some((steps, changes))
    }

    /// Returns the combinations of designs of an operator. Returns `None` if there are too many, or if the
    /// computation was interrupted. The result is cached unless the computation was interrupted.
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

    /// Lower bound on the cost from the states after an operator to the goal, for any of its
    /// designs. Returns `None` if the goal is unreachable within the number of steps of the known
    /// plan.
    ///
    /// The designs of the operator do not affect the basic finite-domain variables. The bound is 0 if the
    /// operator has conditional effects, because they are not applied here.
    fn cost_to_go_after(&self, label: &Label, operator: OperatorId) -> Option<Int> {
        let operator = &self.task.operators[operator.index()];
        let remaining_steps = self.steps.checked_sub(label.steps)?.checked_sub(1)?;
        if !operator.conditional.is_empty() {
            return Some(0);
        }
        let mut next = self.next.borrow_mut();
        next.values.clone_from(&label.state.values);
        for effect in &operator.effects {
            next.values[effect.variable.index()] = effect.value;
        }
        if !self.is_in_time(&next, remaining_steps) {
            return None;
        }
        self.bounds.cost_estimate(&next)
    }

    /// Returns `true` unless a projection proves that the goal is more than `remaining_steps` steps away.
    fn is_in_time(&self, state: &State, remaining_steps: usize) -> bool {
        let in_time = |(projection, to_go): (&Projection, &Vec<Option<Int>>)| {
            to_go[projection.state(state) as usize].is_some_and(|more| more <= remaining_steps as Int)
        };
        self.bounds.projections.iter().zip(&self.prepared.steps_to_go).all(in_time)
    }

    /// Returns the label after a step. The propositional condition of `operator` must hold, and
    /// `to_go` is the result of [`Self::cost_to_go_after`].
    ///
    /// Returns `None` if a numeric condition does not hold or a new value overflows. Also returns
    /// `None` if the step cannot lead to a plan within the cost and number of steps of the known
    /// plan.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "costs are not negative and those of labels at most that of a known plan, so that sums with an operator and an estimate fit"
    )]
    fn successor(&self, label: &Label, operator: OperatorId, to_go: Int, choice: &Choice) -> Option<Label> {
        let operator = &self.task.operators[operator.index()];
        let (cost, steps) = (label.cost + choice.cost, label.steps + 1);
        if cost + to_go > self.cost
            || steps > self.steps
            || !operator.condition.holds_numerically(&label.state.numbers, &choice.designs, &operator.sizes())
        {
            return None;
        }
        let mut next = self.next.borrow_mut();
        next.clone_from(&label.state);
        operator.apply(&label.state, &choice.designs, &mut next)?;
        // The bounds read no derived variables, which are not evaluated yet.
        if cost + self.bounds.estimate(&next)? > self.cost || !self.is_in_time(&next, self.steps - steps) {
            return None;
        }
        self.task.evaluate_axioms(&mut next);
        let (state, designs) = (next.clone(), label.designs.clone());
        let mut next = Label { state, designs, cost, steps, changes: label.changes };
        next.changes.0 += usize::from(!choice.is_kept);
        for (function, design) in &choice.configuration {
            let last = next.designs[*function].replace(*design);
            next.changes.1 += usize::from(last.is_some_and(|last| last != *design));
        }
        Some(next)
    }

    /// Returns the fewest [`Changes`] of a plan that begins with `from` and has at most the cost
    /// and the number of steps of the known plan. Also returns all stored labels. Returns `None` if
    /// there is no such plan with at most `max_changes`, or a limit is reached.
    fn fewest_changes(&self, from: Label, max_changes: Changes) -> Option<(Changes, Labels)> {
        let mut open = BinaryHeap::from([Reverse((from.changes, Reverse(from.steps), 0))]);
        let mut labels = Labels { all: vec![from], ..Labels::default() };
        while let Some(Reverse((changes, _, id))) = open.pop() {
            if self.task.is_goal(&labels.all[id].state) {
                return Some((changes, labels));
            }
            for operator in self.prepared.index.applicable(self.task, &labels.all[id].state) {
                let choices = self.choices(operator)?;
                let Some(to_go) = self.cost_to_go_after(&labels.all[id], operator) else { continue };
                for choice in choices {
                    self.beat()?;
                    let next = self.successor(&labels.all[id], operator, to_go, choice);
                    let Some(next) = next else { continue };
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

    /// Returns the first plan in model order with at most `changes`, which must be the minimum.
    /// Uses depth-first search. Returns `None` if a limit is reached or no plan is found.
    ///
    /// A label is pruned if a visited label is at least as good. If the visited label has led to no plan, the
    /// new label leads to none either. If the visited label is an ancestor of the new label, a plan from the new
    /// label would imply a shorter plan from the ancestor. A label is also pruned if a label in `first_labels` is
    /// at least as good, and better in cost, steps or changes. The pruning is exact if the known plan is a
    /// shortest one among the cheapest plans.
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
            let Some((operator, to_go, choices)) = &mut last.current else {
                if let Some(operator) = last.operators.next() {
                    let choices = self.choices(operator)?.iter();
                    let to_go = self.cost_to_go_after(&labels.all[last.label], operator);
                    last.current = to_go.map(|to_go| (operator, to_go, choices));
                } else {
                    branches.pop();
                    steps.pop();
                }
                continue;
            };
            let (operator, to_go) = (*operator, *to_go);
            self.beat()?;
            let Some(choice) = choices.next() else {
                last.current = None;
                continue;
            };
            let next = self.successor(&labels.all[last.label], operator, to_go, choice);
            let Some(next) = next else { continue };
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

    /// Returns `true` if a stored label of the Pareto front of `next` is at least as good as `next`
    /// and, if `strictly`, better in cost, steps or changes.
    fn is_beaten(&self, labels: &Labels, next: &Label, strictly: bool) -> bool {
        let (merits, monotone) = (next.merits(), self.prepared.monotone);
        let mut key = self.key.borrow_mut();
        next.write_front_key(self.task, monotone, &mut key);
        labels.fronts.get(key.as_slice()).is_some_and(|front| {
            self.compared.set(self.compared.get().saturating_add(front.len()));
            front.iter().any(|label| {
                label.is_no_worse(&merits, monotone) && (!strictly || label.measures() != merits.measures())
            })
        })
    }

    fn beat(&self) -> Option<()> {
        self.pulse.borrow_mut().beat().ok()
    }

    /// Stores a label, and removes the merits that it dominates. Returns `None` if the limit on labels or
    /// comparisons is reached.
    #[expect(clippy::arithmetic_side_effects, reason = "labels are counted up to their limit")]
    fn keep(&self, labels: &mut Labels, label: Label) -> Option<()> {
        let (merits, monotone) = (label.merits(), self.prepared.monotone);
        let mut key = self.key.borrow_mut();
        label.write_front_key(self.task, monotone, &mut key);
        match labels.fronts.get_mut(key.as_slice()) {
            Some(front) => {
                // All labels that a removed label dominates are also dominated by the new label.
                front.retain(|other| !merits.is_no_worse(other, monotone));
                front.push(merits);
            }
            None => {
                labels.fronts.insert(key.as_slice().into(), vec![merits]);
            }
        }
        labels.all.push(label);
        let label_count = self.made.get() + 1;
        self.made.set(label_count);
        (label_count < LABEL_LIMIT && self.compared.get() < PAIR_LIMIT).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::{SearchOutcome, search};
    use testing::ground_text;
    use testing::missions::Mission;

    const ENUMERATION_LIMIT: usize = 300_000;

    struct Enumeration<'a> {
        task: &'a Task,
        choices: Vec<Vec<(Vec<u32>, Int)>>,
        cost: Int,
        steps: usize,
        prefix: Vec<GroundStep>,
        best: Option<(usize, Vec<GroundStep>)>,
        visited: usize,
    }

    impl Enumeration<'_> {
        fn extend(
            &mut self,
            state: &State,
            cost: Int,
            designs: &FxHashMap<ObjectId, ObjectId>,
            changes: usize,
        ) {
            self.visited += 1;
            if self.task.is_goal(state) {
                let is_better = self.best.as_ref().is_none_or(|(fewest, _)| changes < *fewest);
                if is_better && (cost, self.prefix.len()) == (self.cost, self.steps) {
                    self.best = Some((changes, self.prefix.clone()));
                }
                return;
            }
            if self.prefix.len() == self.steps || self.visited > ENUMERATION_LIMIT {
                return;
            }
            for id in OperatorId::all(self.task.operators.len()) {
                let operator = &self.task.operators[id.index()];
                if !operator.condition.holds_propositionally(&state.values) {
                    continue;
                }
                for (choice, price) in self.choices[id.index()].clone() {
                    let is_possible =
                        operator.condition.holds_numerically(&state.numbers, &choice, &operator.sizes());
                    let next = self.task.successor(operator, state, &choice).filter(|_| is_possible);
                    let Some(next) = next.filter(|_| cost + price <= self.cost) else { continue };
                    let (mut designs, mut changes) = (designs.clone(), changes);
                    for (function, argument) in &operator.configuration {
                        let design = resolve(self.task, operator, &choice, *argument);
                        changes +=
                            usize::from(designs.insert(*function, design).is_some_and(|last| last != design));
                    }
                    self.prefix.push(GroundStep { operator: id, choice });
                    self.extend(&next, cost + price, &designs, changes);
                    self.prefix.pop();
                }
            }
        }
    }

    /// Compares the canonical plan of a random mission with the enumeration. Returns `true` if the mission has
    /// a plan and is small enough.
    fn check(seed: u64) -> bool {
        let mission = Mission::random(seed);
        let task = ground_text((mission.domain(), mission.problem()));
        let limits = Limits::none();
        let context = Context::new(&task, &limits);
        let bounds = Bounds::new(context).expect("no limit");
        let SearchOutcome::Optimal(plan) = search(context, &bounds) else { return false };
        let monotone = is_monotone(&task);
        let choices = task.operators.iter().map(|operator| {
            let choices = pareto_optimal_combinations(operator, monotone, true, &limits).expect("no limit");
            let mut choices = choices.expect("few combinations");
            choices.sort();
            choices
        });
        let choices = choices.collect();
        let (cost, steps) = (plan.cost, plan.steps.len());
        let (prefix, best, visited) = (Vec::new(), None, 0);
        let mut enumeration = Enumeration { task: &task, choices, cost, steps, prefix, best, visited };
        enumeration.extend(&task.initial, 0, &FxHashMap::default(), 0);
        if enumeration.visited > ENUMERATION_LIMIT {
            return false;
        }
        let canonical = select_canonical_plan(context, &bounds, plan);
        let (_, expected) = enumeration.best.expect("the known plan is among the plans");
        assert_eq!(canonical.steps, expected, "seed {seed}: {mission:?}");
        true
    }

    #[test]
    fn the_canonical_plan_is_the_first_with_the_fewest_reconfigurations() {
        let compared = (0..60).filter(|seed| check(*seed)).count();
        assert!(compared > 15, "{compared}");
    }

    #[test]
    #[ignore = "takes minutes"]
    fn the_canonical_plans_of_many_missions_are_the_first() {
        let compared = (60..2_000).filter(|seed| check(*seed)).count();
        assert!(compared > 500, "{compared}");
    }
}
