//! The ground task: finite-domain and numeric variables, and operators with slots for designs.
//!
//! The formalism is SAS+ by Bäckström and Nebel \[1\] with two extensions. Numeric variables have exact values:
//! integers, or rationals where integers would overflow. Operators have *slots*; a step of a plan chooses a
//! function design for each slot. Conditions, costs and consumption that depend on designs are tables over
//! slots. For k functions with m designs each, k·m choices thus replace m^k operators.
//!
//! \[1\] C. Bäckström, B. Nebel: Complexity results for SAS+ planning, Computational Intelligence
//! 11(4), 1995.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use crate::lifted::ObjectId;
use crate::number::{Int, Rational, dense};
use crate::task::dense_ids::dense_ids;
use crate::task::number::{TaskNumber, sum_of_products};
use crate::task::quantity::{Linear, NumericId, Quantity, SlotSet};
use crate::task::timing::Timing;

/// Id of a finite-domain variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VariableId(pub u32);

/// Id of an operator: an action schema with objects for all parameters except slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OperatorId(pub u32);

/// Id of a slot: a function whose design is chosen in every step that uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotId(pub u32);

dense_ids!(VariableId, OperatorId, SlotId);

/// A fact of SAS+: a variable has a particular value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Fact {
    /// The variable.
    pub variable: VariableId,
    /// Index of the value in the domain of the variable.
    pub value: u32,
}

/// A fact or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Literal {
    pub fact: Fact,
    pub positive: bool,
}

/// A condition. It holds if all facts, at least one literal of every clause, and all comparisons hold.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Condition<N = Int> {
    pub facts: Vec<Fact>,
    pub clauses: Vec<Vec<Literal>>,
    /// Expressions that must be ≥ 0.
    pub comparisons: Vec<Linear<N>>,
    /// Expressions that must be > 0. Empty for integers, where > 0 is written as ≥ 1.
    pub above: Vec<Linear<N>>,
}

/// A finite-domain variable. It has exactly one of its values in every state.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Name of each value: a ground atom, `condition NUMBER` for an auxiliary atom, or `none of these` for the last
    /// value.
    pub values: Vec<String>,
}

/// A slot of the task, with all designs that some operator allows for it.
#[derive(Debug, Clone)]
pub struct Slot {
    pub designs: Vec<ObjectId>,
}

/// The use of a slot by an operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SlotUse {
    pub slot: SlotId,
    /// Indices of the slot's designs that are suitable for the operator, in ascending order.
    pub designs: Vec<u32>,
}

/// A constraint on designs: combinations with which the operator is not applicable.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ForbiddenCombinations {
    /// Constrained slots, as positions in the operator's slot list.
    pub slots: SlotSet,
    /// Forbidden combinations. Each holds, for every slot in `slots`, an index into `SlotUse::designs`.
    pub combinations: Vec<SlotSet>,
}

/// Assignment of a new value to a numeric variable, as an expression over the state before the operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct NumericEffect<N = Int> {
    pub variable: NumericId,
    pub value: Linear<N>,
}

/// Facts that an operator sets if all literals of the condition hold before the operator.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ConditionalEffect {
    pub condition: Vec<Literal>,
    pub effects: Vec<Fact>,
}

/// A rule of a derived variable: the variable has the value in `head` if `body` holds. If no body of its
/// rules holds, the variable has the last value of its domain.
#[derive(Debug, Clone)]
pub struct Axiom<N = Int> {
    pub head: Fact,
    pub body: Condition<N>,
}

/// A layer of stratified rules: the rules of one derived variable, or of several mutually dependent derived
/// variables. All other derived variables that the rules read, and all that they read negatively, belong to
/// earlier layers.
#[derive(Debug, Clone)]
pub struct Layer<N = Int> {
    pub rules: Vec<Axiom<N>>,
    /// `true` if the body of a rule depends on the head of a rule of this layer.
    pub recursive: bool,
}

/// An argument of an action: an object, or the design of a slot (given by its position in the operator's slot
/// list).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Argument {
    Object(ObjectId),
    Slot(u32),
}

/// A ground operator. Operators of the same schema share the data that depend on designs if they have the same
/// objects for the parameters that determine these data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Operator<N = Int> {
    /// Index in [`Task::schema_names`]; for a wait, the number of these names.
    pub schema: u32,
    pub arguments: Vec<Argument>,
    /// Functions that the action requires, each with the argument that is its design.
    pub configuration: Vec<(ObjectId, Argument)>,
    pub slots: Arc<[SlotUse]>,
    pub forbidden: Arc<[ForbiddenCombinations]>,
    pub condition: Condition<N>,
    /// Assigned facts: at most one value for each variable, in ascending order of the variables.
    pub effects: Vec<Fact>,
    /// Conditional effects in order: later ones take precedence over earlier ones and over `effects`.
    pub conditional: Vec<ConditionalEffect>,
    pub numeric_effects: Vec<NumericEffect<N>>,
    /// Cost in the task's cost unit; negative if the operator improves the metric.
    pub cost: Quantity<N>,
    /// Costs under the other objectives of the task, in their units.
    pub others: Vec<Quantity<N>>,
    /// Duration in the task's time unit.
    pub duration: Quantity<N>,
    /// End of the wait if the operator is a wait, in the task's time unit since the start of the plan; `None`
    /// for an action.
    pub wait: Option<N>,
    /// Lower bounds on start and end that follow from timed initial literals, in the task's time unit since the
    /// start of the plan.
    pub timing: Timing<N>,
}

/// A state: values of all finite-domain and numeric variables.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State<N = Int> {
    pub values: Vec<u32>,
    pub numbers: Vec<N>,
}

/// Conversion between operator costs and the metric of the problem file.
#[derive(Debug, Clone)]
pub struct Objective<N = Int> {
    /// Factor by which values of the metric are multiplied to obtain costs.
    pub scale: Int,
    /// Constant that is added to the sum of operator costs, in cost units: the value of the metric in the initial
    /// state without the fluents in `rest`, negated for maximisation.
    pub offset: N,
    /// `true` if the metric is maximised; operator costs are then negated.
    pub maximize: bool,
    /// Numeric variables whose final values are part of the metric, with their factors (negated for
    /// maximisation).
    pub rest: Vec<(NumericId, Rational)>,
}

impl Objective {
    /// Returns the objective that is the sum of operator costs, without scale or offset.
    pub fn sum() -> Self {
        Self { scale: 1, offset: 0, maximize: false, rest: Vec::new() }
    }
}

/// A ground task.
#[derive(Debug, Clone)]
pub struct Task<N = Int> {
    pub object_names: Vec<String>,
    pub schema_names: Vec<String>,
    /// Basic (non-derived) variables, followed by derived variables. A derived variable has the values true
    /// (0) and false (1).
    pub variables: Vec<Variable>,
    /// Number of basic variables, i.e. variables that are not derived.
    pub basic: usize,
    /// Mutex groups that span several variables: at most one fact of a group holds in every reachable state.
    /// The operators are correct only in states with this property.
    pub exclusive: Vec<Vec<Fact>>,
    /// Names of the numeric variables in PDDL.
    pub number_names: Vec<String>,
    /// Factor by which values in PDDL files are multiplied to obtain numbers of the task.
    pub number_scale: Int,
    /// Additional factor of each numeric variable; empty if all factors are 1.
    pub number_multiples: Vec<Int>,
    /// Rules of the derived variables, in evaluation order.
    pub axioms: Vec<Layer<N>>,
    pub slots: Vec<Slot>,
    pub operators: Vec<Operator<N>>,
    pub initial: State<N>,
    pub goal: Condition<N>,
    pub objective: Objective<N>,
    /// Further objectives in lexicographic order.
    pub others: Vec<Objective<N>>,
    /// Factor by which durations in PDDL files are multiplied to obtain durations of the task.
    pub time_scale: Int,
    /// Reason why the task is unsolvable, if grounding shows that the goal is unreachable.
    pub unreachable: Option<String>,
}

/// Hashes only the fields that differ most between operators, because the others may be long.
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
    /// Returns the number of suitable designs of each slot.
    pub fn sizes(&self) -> Vec<usize> {
        self.slots.iter().map(|slot| slot.designs.len()).collect()
    }

    /// Returns `true` if a combination of designs is not forbidden. `choice` is an index into
    /// `SlotUse::designs` for each slot.
    pub fn admits(&self, choice: &[u32]) -> bool {
        self.forbidden.iter().all(|rule| {
            rule.combinations
                .iter()
                .all(|bad| rule.slots.iter().zip(bad).any(|(slot, design)| choice[*slot as usize] != *design))
        })
    }

    /// Returns all combinations of designs that are not forbidden, in lexicographic order.
    pub fn admitted_combinations(&self) -> Choices<'_, N> {
        let empty = self.slots.iter().any(|slot| slot.designs.is_empty());
        Choices { operator: self, sizes: self.sizes(), next: (!empty).then(|| vec![0; self.slots.len()]) }
    }
}

/// Iterator over the combinations of designs of an operator that are not forbidden.
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
                // The last slot varies fastest.
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
    fn terms<'n>(&'n self, numbers: &'n [N]) -> impl Iterator<Item = (&'n N, &'n N)> + Clone {
        self.coefficients.iter().map(|(variable, factor)| (factor, &numbers[variable.index()]))
    }

    /// Returns the value of the expression in a state for a combination of designs, or `None` on overflow.
    pub fn value(&self, numbers: &[N], choice: &[u32], sizes: &[usize]) -> Option<N> {
        sum_of_products(self.quantity.at(choice, sizes), self.terms(numbers))
    }

    fn compares(&self, numbers: &[N], choice: &[u32], sizes: &[usize], strict: bool) -> bool {
        N::compare(self.quantity.at(choice, sizes), self.terms(numbers), strict)
    }
}

impl<N> Condition<N> {
    /// Returns `true` if all facts hold and every clause contains a literal that holds.
    pub fn holds_propositionally(&self, values: &[u32]) -> bool {
        self.facts.iter().all(|fact| fact.holds(values))
            && self.clauses.iter().all(|clause| clause.iter().any(|literal| literal.holds(values)))
    }

    /// Returns the expressions of all comparisons, both ≥ 0 and > 0.
    pub fn linears(&self) -> impl Iterator<Item = &Linear<N>> {
        self.comparisons.iter().chain(&self.above)
    }
}

impl<N: TaskNumber> Condition<N> {
    /// Returns `true` if all numeric comparisons hold for a combination of designs.
    pub fn holds_numerically(&self, numbers: &[N], choice: &[u32], sizes: &[usize]) -> bool {
        self.comparisons.iter().all(|linear| linear.compares(numbers, choice, sizes, false))
            && self.above.iter().all(|linear| linear.compares(numbers, choice, sizes, true))
    }
}

impl Fact {
    /// Returns `true` if the variable has the value of the fact in a state with these values.
    pub fn holds(self, values: &[u32]) -> bool {
        values[self.variable.index()] == self.value
    }
}

impl Literal {
    /// Returns `true` if the literal is true in a state with these values.
    pub fn holds(&self, values: &[u32]) -> bool {
        self.fact.holds(values) == self.positive
    }
}

impl Operator {
    /// Returns the cost of the operator for a combination of designs.
    pub fn cost_of(&self, choice: &[u32]) -> Int {
        self.cost.at(choice, &self.sizes())
    }
}

impl<N: TaskNumber> Operator<N> {
    /// Returns `true` if the condition of the operator holds in a state for this combination of designs.
    /// Forbidden combinations are not checked, see [`Operator::admits`].
    pub fn applicable(&self, state: &State<N>, choice: &[u32]) -> bool {
        self.condition.holds_propositionally(&state.values)
            && self.condition.holds_numerically(&state.numbers, choice, &self.sizes())
    }

    /// Applies the propositional effects of the operator to `next`, which must initially equal `values`.
    pub fn apply_propositionally(&self, values: &[u32], next: &mut [u32]) {
        for effect in &self.effects {
            next[effect.variable.index()] = effect.value;
        }
        for conditional in &self.conditional {
            if conditional.condition.iter().all(|literal| literal.holds(values)) {
                for effect in &conditional.effects {
                    next[effect.variable.index()] = effect.value;
                }
            }
        }
    }

    /// Applies the effects of the operator to `next`, which must initially equal `state`. Derived variables
    /// are not updated. Returns `None` on numeric overflow.
    pub fn apply(&self, state: &State<N>, choice: &[u32], next: &mut State<N>) -> Option<()> {
        self.apply_propositionally(&state.values, &mut next.values);
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
    /// Returns `false` if each action costs 1 and each wait 0, so that the cost is the number of actions.
    /// Otherwise returns `true`, e.g. if the costs are durations.
    pub fn is_timed(&self) -> bool {
        self.is_measured_by_time(&self.objective.scale)
    }
}

impl<N: TaskNumber> Task<N> {
    /// Returns `false` if each wait costs 0 and each other operator costs `step`, and `true` otherwise; see
    /// [`Task::is_timed`].
    pub fn is_measured_by_time(&self, step: &N) -> bool {
        let step = |operator: &Operator<N>| if operator.wait.is_some() { N::zero() } else { step.clone() };
        self.operators.iter().any(|operator| operator.cost != Quantity::constant(step(operator)))
    }

    /// Returns `true` if a state satisfies the goal.
    pub fn is_goal(&self, state: &State<N>) -> bool {
        self.goal.holds_propositionally(&state.values)
            && self.goal.holds_numerically(&state.numbers, &[], &[])
    }

    /// Returns the state after an operator, or `None` on numeric overflow. The operator must be applicable
    /// with this combination of designs.
    pub fn successor(&self, operator: &Operator<N>, state: &State<N>, choice: &[u32]) -> Option<State<N>> {
        let mut next = state.clone();
        operator.apply(state, choice, &mut next)?;
        self.evaluate_axioms(&mut next);
        Some(next)
    }

    /// Computes the values of the derived variables: the least fixpoint of the rules, layer by layer.
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
