//! Delete relaxation of a ground task as an AND/OR graph: nodes with conditions and effects over
//! propositions.
//!
//! Propositions are facts, disjunctions and numeric comparisons. A node is an operator, a
//! conditional effect, a rule of a derived variable, or one disjunct of a disjunction. Conditions that
//! require a derived variable to be false are assumed to hold. For each numeric comparison separately, the
//! most favourable designs are assumed. The number of repetitions of an operator until a comparison holds is
//! estimated as by Scala et al. \[1\]. If an operator adds an expression that depends on the state, its value in the
//! evaluated state counts. An operator that assigns an expression is assumed to achieve a comparison with one
//! application.
//!
//! \[1\] E. Scala, P. Haslum, S. Thiébaux: Heuristics for numeric planning via subgoaling, IJCAI 2016.

use rustc_hash::{FxHashMap, FxHashSet};

use task::limits::{Interrupted, Limits};
use task::lists::Lists;
use task::number::dense;
use task::task::number::{TaskNumber, sum_of_products};
use task::task::quantity::{Linear, NumericId, Quantity};
use task::task::{Condition, Fact, Literal, Operator, OperatorId, State, Task, VariableId};

/// Index of a proposition: a fact, a disjunction, or a numeric comparison.
pub(super) type Proposition = u32;

pub(super) const NO_OPERATOR: u32 = u32::MAX;

pub(super) struct NumericCondition<N> {
    pub(super) sum: Vec<(NumericId, N)>,
    /// For each comparison: the threshold, a flag that is `true` for > and `false` for ≥, and its
    /// proposition.
    pub(super) thresholds: Vec<(N, bool, Proposition)>,
}

impl<N: TaskNumber> NumericCondition<N> {
    pub(super) fn value(&self, numbers: &[N]) -> Option<N> {
        let terms = self.sum.iter().map(|(variable, factor)| (factor, &numbers[variable.index()]));
        sum_of_products(N::zero(), terms)
    }
}

#[derive(Debug, Clone)]
pub(super) struct Achiever {
    pub(super) direction: u32,
    pub(super) gain: Gain,
}

#[derive(Debug, Clone)]
pub(super) enum Gain {
    Constant(f64),
    /// Constant and terms over the numbers of the evaluated state.
    Linear(f64, Vec<(NumericId, f64)>),
    /// A single application is assumed to suffice.
    Unlimited,
}

pub(super) struct Relaxation<N> {
    /// Index of the first fact of each variable, followed by the total number of facts.
    first: Vec<Proposition>,
    pub(super) propositions: usize,
    pub(super) always: Vec<Proposition>,
    pub(super) directions: Vec<NumericCondition<N>>,
    pub(super) operators: Vec<u32>,
    pub(super) conditions: Lists,
    pub(super) effects: Lists,
    pub(super) supports: Vec<Vec<Achiever>>,
    /// For each proposition: the nodes that have it as a condition.
    pub(super) waiting: Lists,
    /// For each node: `true` if it is the unconditional part of an operator.
    pub(super) is_base: Vec<bool>,
    pub(super) goals: Vec<Proposition>,
}

impl<N: TaskNumber> Relaxation<N> {
    pub(super) fn new(task: &Task<N>, limits: &Limits) -> Result<Self, Interrupted> {
        Builder::new(task).build(limits)
    }

    pub(super) fn fact(&self, fact: Fact) -> Proposition {
        self.first[fact.variable.index()].saturating_add(fact.value)
    }

    pub(super) fn fact_of(&self, proposition: Proposition) -> Option<Fact> {
        if proposition >= *self.first.last()? {
            return None;
        }
        let variable = self.first.partition_point(|first| *first <= proposition).checked_sub(1)?;
        let value = proposition.checked_sub(self.first[variable])?;
        Some(Fact { variable: VariableId::of(variable), value })
    }

    pub(super) fn facts<'s>(&'s self, values: &'s [u32]) -> impl Iterator<Item = Proposition> + 's {
        self.first.iter().zip(values).map(|(first, value)| first.saturating_add(*value))
    }
}

impl<N: TaskNumber> Relaxation<N> {
    /// Returns `true` if a fact or a numeric comparison holds in a state. Returns `false` for disjunctions, and if
    /// the value of a comparison overflows.
    pub(super) fn holds(&self, proposition: Proposition, state: &State<N>) -> bool {
        if let Some(fact) = self.fact_of(proposition) {
            return fact.holds(&state.values);
        }
        let thresholds = self.directions.iter().flat_map(|direction| {
            direction
                .thresholds
                .iter()
                .map(move |(threshold, strict, id)| (direction, threshold, *strict, *id))
        });
        thresholds.filter(|(.., id)| *id == proposition).any(|(direction, threshold, strict, _)| {
            direction
                .value(&state.numbers)
                .is_some_and(|value| if strict { value > *threshold } else { value >= *threshold })
        })
    }
}

struct Builder<'a, N> {
    task: &'a Task<N>,
    first: Vec<Proposition>,
    next: Proposition,
    always: Vec<Proposition>,
    is_always: FxHashSet<Proposition>,
    directions: Vec<NumericCondition<N>>,
    by_sum: FxHashMap<Vec<(NumericId, N)>, usize>,
    by_threshold: FxHashMap<(usize, N, bool), Proposition>,
    disjunctions: FxHashMap<Vec<Literal>, Proposition>,
    operators: Vec<u32>,
    is_base: Vec<bool>,
    conditions: Lists,
    effects: Lists,
}

impl<'a, N: TaskNumber> Builder<'a, N> {
    fn new(task: &'a Task<N>) -> Self {
        let mut first = Vec::with_capacity(task.variables.len().saturating_add(1));
        let mut next: Proposition = 0;
        for variable in &task.variables {
            first.push(next);
            next = next.saturating_add(dense(variable.values.len()));
        }
        first.push(next);
        Self {
            task,
            first,
            next,
            always: Vec::new(),
            is_always: FxHashSet::default(),
            directions: Vec::new(),
            by_sum: FxHashMap::default(),
            by_threshold: FxHashMap::default(),
            disjunctions: FxHashMap::default(),
            operators: Vec::new(),
            is_base: Vec::new(),
            conditions: Lists::default(),
            effects: Lists::default(),
        }
    }

    fn build(mut self, limits: &Limits) -> Result<Relaxation<N>, Interrupted> {
        let task = self.task;
        for (variable, id) in
            task.variables.iter().zip(VariableId::all(task.variables.len())).skip(task.basic)
        {
            for value in 1..dense(variable.values.len()) {
                let proposition = self.fact(Fact { variable: id, value });
                self.holds_always(proposition);
            }
        }
        let goals = self.condition(&task.goal);
        for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
            let (operator, id) = item?;
            let conditions = self.condition(&operator.condition);
            let effects: Vec<Proposition> = operator.effects.iter().map(|fact| self.fact(*fact)).collect();
            self.node(id.0, true, &conditions, &effects);
            for effect in &operator.conditional {
                let mut conditions = conditions.clone();
                for literal in &effect.condition {
                    conditions.extend(self.literal(*literal));
                }
                let effects: Vec<Proposition> = effect.effects.iter().map(|fact| self.fact(*fact)).collect();
                self.node(id.0, false, &conditions, &effects);
            }
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let conditions = self.condition(&rule.body);
            let head = self.fact(rule.head);
            self.node(NO_OPERATOR, false, &conditions, &[head]);
        }
        let supports = self.supports(limits)?;
        let propositions = self.next as usize;
        let waiting = self.conditions.inverse(propositions);
        Ok(Relaxation {
            first: self.first,
            propositions,
            always: self.always,
            directions: self.directions,
            operators: self.operators,
            conditions: self.conditions,
            effects: self.effects,
            supports,
            waiting,
            is_base: self.is_base,
            goals,
        })
    }

    fn fresh(&mut self) -> Proposition {
        let proposition = self.next;
        self.next = self.next.saturating_add(1);
        proposition
    }

    fn holds_always(&mut self, proposition: Proposition) {
        self.always.push(proposition);
        self.is_always.insert(proposition);
    }

    fn node(&mut self, operator: u32, is_base: bool, conditions: &[Proposition], effects: &[Proposition]) {
        let mut conditions: Vec<Proposition> =
            conditions.iter().copied().filter(|proposition| !self.is_always.contains(proposition)).collect();
        conditions.sort_unstable();
        conditions.dedup();
        self.operators.push(operator);
        self.is_base.push(is_base);
        self.conditions.push(&conditions);
        self.effects.push(effects);
    }

    fn fact(&self, fact: Fact) -> Proposition {
        self.first[fact.variable.index()].saturating_add(fact.value)
    }

    fn condition(&mut self, condition: &Condition<N>) -> Vec<Proposition> {
        let mut propositions: Vec<Proposition> =
            condition.facts.iter().map(|fact| self.fact(*fact)).collect();
        for clause in &condition.clauses {
            propositions.extend(self.clause(clause));
        }
        for (linears, strict) in [(&condition.comparisons, false), (&condition.above, true)] {
            for linear in linears {
                propositions.extend(self.comparison(linear, strict));
            }
        }
        propositions
    }

    /// Returns the proposition of the comparison `linear` > 0 if `strict`, otherwise ≥ 0, under the most
    /// favourable designs. Returns `None` if it is constant and holds.
    fn comparison(&mut self, linear: &Linear<N>, strict: bool) -> Option<Proposition> {
        let threshold = negated(maximum(&linear.quantity));
        if linear.coefficients.is_empty() {
            let holds = if strict { threshold < N::zero() } else { threshold <= N::zero() };
            if holds {
                return None;
            }
        }
        let direction = *self.by_sum.entry(linear.coefficients.clone()).or_insert_with(|| {
            let sum = linear.coefficients.clone();
            self.directions.push(NumericCondition { sum, thresholds: Vec::new() });
            self.directions.len().saturating_sub(1)
        });
        let key = (direction, threshold, strict);
        if let Some(proposition) = self.by_threshold.get(&key) {
            return Some(*proposition);
        }
        let proposition = self.fresh();
        self.directions[direction].thresholds.push((key.1.clone(), strict, proposition));
        self.by_threshold.insert(key, proposition);
        Some(proposition)
    }

    fn clause(&mut self, clause: &[Literal]) -> Option<Proposition> {
        if let [only] = clause {
            return self.literal(*only);
        }
        let mut parts = Vec::with_capacity(clause.len());
        for literal in clause {
            parts.push(self.literal(*literal)?);
        }
        let mut key = clause.to_vec();
        key.sort_unstable();
        if let Some(proposition) = self.disjunctions.get(&key) {
            return Some(*proposition);
        }
        let proposition = self.fresh();
        self.disjunctions.insert(key, proposition);
        for part in parts {
            self.node(NO_OPERATOR, false, &[part], &[proposition]);
        }
        Some(proposition)
    }

    /// Returns the proposition of a literal, or `None` if the literal is assumed to be always true.
    fn literal(&mut self, literal: Literal) -> Option<Proposition> {
        let Literal { fact, positive } = literal;
        let proposition = self.fact(fact);
        if positive {
            return (!self.is_always.contains(&proposition)).then_some(proposition);
        }
        let values = dense(self.task.variables[fact.variable.index()].values.len());
        if fact.variable.index() >= self.task.basic {
            // A derived variable is true only if a rule derives it. Its falsity is always assumed.
            return (fact.value != 0).then(|| self.fact(Fact { value: 0, ..fact }));
        }
        if values == 2 {
            return Some(self.fact(Fact { value: 1_u32.saturating_sub(fact.value), ..fact }));
        }
        let key = vec![literal];
        if let Some(proposition) = self.disjunctions.get(&key) {
            return Some(*proposition);
        }
        let proposition = self.fresh();
        self.disjunctions.insert(key, proposition);
        for value in (0..values).filter(|value| *value != fact.value) {
            let value_proposition = self.fact(Fact { value, ..fact });
            self.node(NO_OPERATOR, false, &[value_proposition], &[proposition]);
        }
        Some(proposition)
    }

    /// Returns, for each node, the linear expressions in conditions that the operator of the node can
    /// increase, and by how much. The list is empty for nodes that are not the unconditional part of an
    /// operator.
    fn supports(&self, limits: &Limits) -> Result<Vec<Vec<Achiever>>, Interrupted> {
        let mut conditions_by_variable: FxHashMap<NumericId, Vec<usize>> = FxHashMap::default();
        for (index, direction) in self.directions.iter().enumerate() {
            for (variable, _) in &direction.sum {
                conditions_by_variable.entry(*variable).or_default().push(index);
            }
        }
        let mut supports = vec![Vec::new(); self.operators.len()];
        let nodes = self.operators.iter().zip(&self.is_base).zip(&mut supports);
        for item in limits.watch(nodes) {
            let ((operator, is_base), achievers) = item?;
            if !*is_base {
                continue;
            }
            let operator = &self.task.operators[*operator as usize];
            let affected = operator
                .numeric_effects
                .iter()
                .filter_map(|effect| conditions_by_variable.get(&effect.variable));
            let mut indices: Vec<usize> = affected.flatten().copied().collect();
            indices.sort_unstable();
            indices.dedup();
            for index in indices {
                if let Some(gain) = gain(operator, &self.directions[index].sum) {
                    achievers.push(Achiever { direction: dense(index), gain });
                }
            }
        }
        Ok(supports)
    }
}

/// Returns the increase of an expression by one application of the operator with the most favourable designs.
/// Returns `None` if the increase is a constant that is not positive. Its sign is decided with exact
/// arithmetic, because a comparison that no operator increases counts as unreachable.
fn gain<N: TaskNumber>(operator: &Operator<N>, sum: &[(NumericId, N)]) -> Option<Gain> {
    let mut gain = N::zero();
    let mut terms: Vec<(NumericId, f64)> = Vec::new();
    for (variable, factor) in sum {
        let Some(effect) = operator.numeric_effects.iter().find(|effect| effect.variable == *variable) else {
            continue;
        };
        let quantity = &effect.value.quantity;
        let coefficients = &effect.value.coefficients;
        if !coefficients.iter().any(|(changed, factor)| changed == variable && factor.is_one()) {
            return Some(Gain::Unlimited);
        }
        let other_coefficients = coefficients.iter().filter(|(changed, _)| changed != variable);
        terms.extend(
            other_coefficients.map(|(other, times)| (*other, times.approximate() * factor.approximate())),
        );
        let amount = if *factor < N::zero() { quantity.minimum() } else { maximum(quantity) };
        let Some(next) = factor.times(&amount).and_then(|more| gain.plus(&more)) else {
            return Some(Gain::Unlimited);
        };
        gain = next;
    }
    if !terms.is_empty() {
        return Some(Gain::Linear(gain.approximate(), terms));
    }
    // A positive increase may round to 0 in floating-point arithmetic.
    (gain > N::zero()).then(|| Gain::Constant(gain.approximate().max(f64::MIN_POSITIVE)))
}

#[expect(clippy::arithmetic_side_effects, reason = "numbers of a task are far from the least integer")]
fn negated<N: TaskNumber>(number: N) -> N {
    -number
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
)]
fn maximum<N: TaskNumber>(quantity: &Quantity<N>) -> N {
    let maxima = quantity.tables.iter().filter_map(|table| table.values.iter().max());
    maxima.fold(quantity.constant.clone(), |sum, value| sum + value.clone())
}
