//! The ground task: finite-domain and numeric variables, and operators whose function designs are still open.
//!
//! After Bäckström and Nebel's SAS+ \[1\], with two additions: numeric variables hold exact integers, and an
//! operator has *slots*, each to be filled with one function design. Conditions, costs and consumptions that
//! depend on the designs are tables over slots, so k functions of m designs cost k·m choices, not m^k operators.
//!
//! \[1\] C. Bäckström, B. Nebel: Complexity results for SAS+ planning, Computational Intelligence 11(4), 1995.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use crate::lifted::ObjectId;
use crate::number::{Int, Rational, dense};
use crate::task::dense_ids::dense_ids;
use crate::task::number::{TaskNumber, sum_of_products};
use crate::task::quantity::{Linear, NumericId, Quantity, SlotSet};
use crate::task::timing::Timing;

/// A finite-domain variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VariableId(pub u32);

/// An operator: an action schema with its arguments, apart from the function designs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OperatorId(pub u32);

/// A function whose design is chosen anew at every step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotId(pub u32);

dense_ids!(VariableId, OperatorId, SlotId);

/// A variable has a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Fact {
    /// The variable.
    pub variable: VariableId,
    /// The index of the value in the variable's domain.
    pub value: u32,
}

/// A fact or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Literal {
    pub fact: Fact,
    pub positive: bool,
}

/// What must hold: all facts, one literal of every clause, and every linear expression at least zero.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Condition<N = Int> {
    pub facts: Vec<Fact>,
    pub clauses: Vec<Vec<Literal>>,
    /// Each is ≥ 0.
    pub comparisons: Vec<Linear<N>>,
    /// Each is > 0. Integers have none: one that is > 0 is ≥ 1.
    pub above: Vec<Linear<N>>,
}

/// A finite-domain variable: at every moment exactly one of its values holds.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Ground atoms as written, or `none of these`.
    pub values: Vec<String>,
}

/// A function and the designs that may solve it.
#[derive(Debug, Clone)]
pub struct Slot {
    pub designs: Vec<ObjectId>,
}

/// How an operator uses a slot.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SlotUse {
    pub slot: SlotId,
    /// Indices into the slot's designs, ascending: those that suit this operator.
    pub designs: Vec<u32>,
}

/// Combinations of designs that an operator must not run with.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ForbiddenCombinations {
    /// Positions in the operator's slot list.
    pub slots: SlotSet,
    /// Each an index into `SlotUse::designs` for every slot of `slots`.
    pub combinations: Vec<SlotSet>,
}

/// What an operator does to a numeric variable: the variable becomes this.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct NumericEffect<N = Int> {
    pub variable: NumericId,
    pub value: Linear<N>,
}

/// What an operator sets if all literals hold before it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ConditionalEffect {
    pub condition: Vec<Literal>,
    pub effects: Vec<Fact>,
}

/// A rule of a derived variable: it has the value of the head if the body holds, and its last value if no body does.
#[derive(Debug, Clone)]
pub struct Axiom<N = Int> {
    pub head: Fact,
    pub body: Condition<N>,
}

/// Rules that depend on each other, or a single one; negated variables and those of other rules are in earlier layers.
#[derive(Debug, Clone)]
pub struct Layer<N = Int> {
    pub rules: Vec<Axiom<N>>,
    pub recursive: bool,
}

/// An argument of an action: fixed, or the design of a slot (by position in the operator's slot list).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Argument {
    Object(ObjectId),
    Slot(u32),
}

/// An operator. What depends on its designs is shared with other operators of the same schema.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Operator<N = Int> {
    /// Index of the action schema in the domain.
    pub schema: u32,
    pub arguments: Vec<Argument>,
    /// Each function that the action requires, with the argument that is its design.
    pub configuration: Vec<(ObjectId, Argument)>,
    pub slots: Arc<[SlotUse]>,
    pub forbidden: Arc<[ForbiddenCombinations]>,
    pub condition: Condition<N>,
    /// At most one value for each variable, ascending by variable.
    pub effects: Vec<Fact>,
    /// In order: later ones prevail over earlier ones and over `effects`.
    pub conditional: Vec<ConditionalEffect>,
    pub numeric_effects: Vec<NumericEffect<N>>,
    /// In the task's cost unit; may be negative where the metric rewards.
    pub cost: Quantity<N>,
    /// By the task's other objectives, in their units.
    pub others: Vec<Quantity<N>>,
    /// In the task's time unit.
    pub duration: Quantity<N>,
    /// Set if this is not an action but a wait until that time, in the task's time unit from the start of the plan.
    pub wait: Option<N>,
    /// In the task's time unit from the start of the plan.
    pub timing: Timing<N>,
}

/// A state: a value for each variable.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State<N = Int> {
    pub values: Vec<u32>,
    pub numbers: Vec<N>,
}

/// How integer costs relate to the metric of the problem file.
#[derive(Debug, Clone)]
pub struct Objective<N = Int> {
    /// Costs are this many times the metric.
    pub scale: Int,
    /// Added to the sum of operator costs (in scaled units).
    pub offset: N,
    /// Whether the file asks to maximize; operator costs are negated then.
    pub maximize: bool,
    /// Numeric variables whose final values count as well, with their factors (negated if to be maximized).
    pub rest: Vec<(NumericId, Rational)>,
}

impl Objective {
    /// The plain sum of costs.
    pub fn sum() -> Self {
        Self { scale: 1, offset: 0, maximize: false, rest: Vec::new() }
    }
}

/// A ground task.
#[derive(Debug, Clone)]
pub struct Task<N = Int> {
    pub object_names: Vec<String>,
    pub schema_names: Vec<String>,
    /// The basic variables, then the derived ones, which have two values: true (0) and false (1).
    pub variables: Vec<Variable>,
    /// How many variables are basic.
    pub basic: usize,
    /// Groups of facts over several variables, of which at most one holds in the initial state and in every state that follows. The
    /// operators do what the files say only in states of which that is true.
    pub exclusive: Vec<Vec<Fact>>,
    /// The numeric variables as PDDL writes them.
    pub number_names: Vec<String>,
    /// Numbers are this many times the values of the files.
    pub number_scale: Int,
    /// So many times that the values of numeric variables are, besides; empty where all are as they are.
    pub number_multiples: Vec<Int>,
    /// The rules of the derived variables, in the order of their evaluation.
    pub axioms: Vec<Layer<N>>,
    pub slots: Vec<Slot>,
    pub operators: Vec<Operator<N>>,
    pub initial: State<N>,
    pub goal: Condition<N>,
    pub objective: Objective<N>,
    /// Less important ones, in order.
    pub others: Vec<Objective<N>>,
    /// Durations are this many times the values of the files.
    pub time_scale: Int,
    /// Set if relaxed reachability shows that the goal cannot be reached: the reason.
    pub unreachable: Option<String>,
}

/// By what usually tells operators apart; the rest may be long.
impl<N> Hash for Operator<N> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.schema, &self.arguments, &self.condition.facts, &self.effects).hash(state);
    }
}

impl<N> Default for Condition<N> {
    fn default() -> Self {
        Self { facts: Vec::new(), clauses: Vec::new(), comparisons: Vec::new(), above: Vec::new() }
    }
}

impl<N> Operator<N> {
    /// How many designs each slot admits.
    pub fn sizes(&self) -> Vec<usize> {
        self.slots.iter().map(|slot| slot.designs.len()).collect()
    }

    /// Whether the combination (an index into `SlotUse::designs` for each slot) is not forbidden.
    pub fn admits(&self, choice: &[u32]) -> bool {
        self.forbidden.iter().all(|rule| {
            rule.combinations
                .iter()
                .all(|bad| rule.slots.iter().zip(bad).any(|(slot, design)| choice[*slot as usize] != *design))
        })
    }

    /// All admitted combinations of designs, in lexicographic order.
    pub fn admitted_combinations(&self) -> Choices<'_, N> {
        let empty = self.slots.iter().any(|slot| slot.designs.is_empty());
        Choices { operator: self, sizes: self.sizes(), next: (!empty).then(|| vec![0; self.slots.len()]) }
    }
}

/// Iterator over the admitted combinations of an operator's designs.
pub struct Choices<'a, N = Int> {
    operator: &'a Operator<N>,
    sizes: Vec<usize>,
    next: Option<Vec<u32>>,
}

impl<N> Iterator for Choices<'_, N> {
    type Item = Vec<u32>;

    #[expect(clippy::arithmetic_side_effects, reason = "a design is below the number of them")]
    fn next(&mut self) -> Option<Vec<u32>> {
        loop {
            let current = self.next.take()?;
            let mut following = current.clone();
            for position in (0..following.len()).rev() {
                following[position] += 1;
                if (following[position] as usize) < self.sizes[position] {
                    self.next = Some(following);
                    break;
                }
                following[position] = 0;
            }
            if self.operator.admits(&current) {
                return Some(current);
            }
        }
    }
}

impl<N: TaskNumber> Linear<N> {
    /// Factors with the numbers that they stand at.
    fn terms<'n>(&'n self, numbers: &'n [N]) -> impl Iterator<Item = (&'n N, &'n N)> + Clone {
        self.coefficients.iter().map(|(variable, factor)| (factor, &numbers[variable.index()]))
    }

    /// The value in a state, for a combination of designs; none if it does not fit.
    pub fn value(&self, numbers: &[N], choice: &[u32], sizes: &[usize]) -> Option<N> {
        sum_of_products(self.quantity.at(choice, sizes), self.terms(numbers))
    }

    /// Whether the value is at least 0, or above 0 if `strict`.
    fn compares(&self, numbers: &[N], choice: &[u32], sizes: &[usize], strict: bool) -> bool {
        N::compare(self.quantity.at(choice, sizes), self.terms(numbers), strict)
    }
}

impl<N> Condition<N> {
    /// Whether the propositional part holds.
    pub fn holds_propositionally(&self, values: &[u32]) -> bool {
        self.facts.iter().all(|fact| fact.holds(values))
            && self.clauses.iter().all(|clause| clause.iter().any(|literal| literal.holds(values)))
    }

    /// What the numeric part compares, whether or not strictly.
    pub fn linears(&self) -> impl Iterator<Item = &Linear<N>> {
        self.comparisons.iter().chain(&self.above)
    }
}

impl<N: TaskNumber> Condition<N> {
    /// Whether the numeric part holds.
    pub fn holds_numerically(&self, numbers: &[N], choice: &[u32], sizes: &[usize]) -> bool {
        self.comparisons.iter().all(|linear| linear.compares(numbers, choice, sizes, false))
            && self.above.iter().all(|linear| linear.compares(numbers, choice, sizes, true))
    }
}

impl Fact {
    /// Whether it holds.
    pub fn holds(self, values: &[u32]) -> bool {
        values[self.variable.index()] == self.value
    }
}

impl Literal {
    /// Whether it holds.
    pub fn holds(&self, values: &[u32]) -> bool {
        self.fact.holds(values) == self.positive
    }
}

impl Operator {
    /// The cost with a combination of designs.
    pub fn cost_of(&self, choice: &[u32]) -> Int {
        self.cost.at(choice, &self.sizes())
    }
}

impl<N: TaskNumber> Operator<N> {
    /// Whether the operator may be applied with this combination of designs.
    pub fn applicable(&self, state: &State<N>, choice: &[u32]) -> bool {
        self.condition.holds_propositionally(&state.values)
            && self.condition.holds_numerically(&state.numbers, choice, &self.sizes())
    }

    /// Changes what is equal to a state to the state after this operator, but for its derived variables.
    pub fn apply(&self, state: &State<N>, choice: &[u32], next: &mut State<N>) -> Option<()> {
        for effect in &self.effects {
            next.values[effect.variable.index()] = effect.value;
        }
        for conditional in &self.conditional {
            if conditional.condition.iter().all(|literal| literal.holds(&state.values)) {
                for effect in &conditional.effects {
                    next.values[effect.variable.index()] = effect.value;
                }
            }
        }
        if !self.numeric_effects.is_empty() {
            let sizes = self.sizes();
            for effect in &self.numeric_effects {
                let value = effect.value.value(&state.numbers, choice, &sizes)?;
                if !value.is_moderate() {
                    return None;
                }
                next.numbers[effect.variable.index()] = value;
            }
        }
        Some(())
    }
}

impl Task {
    /// Where the problem has no metric: whether plans are measured by their time, and not by the number of their steps.
    pub fn is_timed(&self) -> bool {
        self.is_measured_by_time(&self.objective.scale)
    }
}

impl<N: TaskNumber> Task<N> {
    /// [`Task::is_timed`], where `step` is what a step costs.
    pub fn is_measured_by_time(&self, step: &N) -> bool {
        let step = |operator: &Operator<N>| if operator.wait.is_some() { N::zero() } else { step.clone() };
        self.operators.iter().any(|operator| operator.cost != Quantity::constant(step(operator)))
    }

    /// Whether a state satisfies the goal.
    pub fn is_goal(&self, state: &State<N>) -> bool {
        self.goal.holds_propositionally(&state.values)
            && self.goal.holds_numerically(&state.numbers, &[], &[])
    }

    /// The state after an operator, which must be applicable with this combination of designs; none if its numbers grow
    /// too large.
    pub fn successor(&self, operator: &Operator<N>, state: &State<N>, choice: &[u32]) -> Option<State<N>> {
        let mut next = state.clone();
        operator.apply(state, choice, &mut next)?;
        self.evaluate_axioms(&mut next);
        Some(next)
    }

    /// Gives the derived variables their values: the least fixpoint of the rules, layer by layer.
    #[expect(clippy::arithmetic_side_effects, reason = "every variable has a value")]
    pub fn evaluate_axioms(&self, state: &mut State<N>) {
        if self.axioms.is_empty() {
            return;
        }
        for (value, variable) in state.values[self.basic..].iter_mut().zip(&self.variables[self.basic..]) {
            *value = dense(variable.values.len()) - 1;
        }
        for layer in &self.axioms {
            loop {
                let mut changed = false;
                for rule in &layer.rules {
                    let value = state.values[rule.head.variable.index()];
                    if value != rule.head.value
                        && rule.body.holds_propositionally(&state.values)
                        && rule.body.holds_numerically(&state.numbers, &[], &[])
                    {
                        state.values[rule.head.variable.index()] = rule.head.value;
                        changed = true;
                    }
                }
                if !changed || !layer.recursive {
                    break;
                }
            }
        }
    }
}
